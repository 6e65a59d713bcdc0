"""The same bits at every level that has fused operations: hashes of all fields and of the history of small scenes, against a stored list.

    fingerprints.py PROGRAM FOLDER [--write]

Runs scenes/*.toml in FOLDER. fingerprints.csv holds what they come to: scene, operations (fused or plain), field, hash. Scenes take no function of
the C library whose last digit its versions round otherwise, no solver and no Voronoi cells; what is hashed are numbers, not files."""

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "scenes"))
from results import call, frames, history, read  # noqa: E402

TABLE = os.path.join(HERE, "fingerprints.csv")


def operations(program):
    """Whether a product and a sum of this build are rounded once or twice; None where no list is for it."""
    level = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    if "x86-64-v2" in level:
        return "plain"
    if re.search(r"x86-64-v[34]", level):
        return "fused"
    if "native" in level and os.uname().machine == "x86_64":
        with open("/proc/cpuinfo") as file:
            return "fused" if " fma " in file.read() else None
    return None


def fingerprints(folder):
    """Hashes of the fields of all frames, of their times, and of the columns of the history."""
    values = {}
    for path in frames(folder):
        fields, time = read(path)
        for name, value in {**fields, "times": time}.items():
            values.setdefault(name, []).append(value.tobytes() if name != "times" else repr(value).encode())
    for name, value in history(folder).items():
        values.setdefault("history", []).append(name.encode() + value.tobytes())
    return {name: hashlib.sha256(b"".join(parts)).hexdigest()[:12] for name, parts in values.items()}


def read_table():
    stored = {}
    if os.path.exists(TABLE):
        with open(TABLE) as file:
            for line in file.read().split("\n")[1:]:
                if line:
                    scene, kind, field, value = line.split(",")
                    stored.setdefault((scene, kind), {})[field] = value
    return stored


def write_table(stored):
    with open(TABLE, "w") as file:
        file.write("scene,operations,field,hash\n")
        for (scene, kind), fields in sorted(stored.items()):
            file.writelines("%s,%s,%s,%s\n" % (scene, kind, *field) for field in sorted(fields.items()))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--write", action="store_true", help="stores what this build comes to")
    options = parser.parse_args()
    kind = operations(options.program)
    if kind is None:
        print("skipped: no list for a build of this architecture")
        sys.exit(77)
    stored = read_table()
    scenes = sorted(name[:-5] for name in os.listdir(os.path.join(HERE, "scenes")) if name.endswith(".toml"))
    failed = 0
    if options.write:
        stored = {key: fields for key, fields in stored.items() if key[1] != kind}
    for scene in scenes:
        out = os.path.join(options.folder, scene)
        shutil.rmtree(out, ignore_errors=True)
        done = call([options.program, "run", os.path.join(HERE, "scenes", scene + ".toml"), "-o", out, "--quiet", "--threads", "1"])
        if done.status != 0:
            print("FAILED  %s ends with %d: %s" % (scene, done.status, done.first_line))
            failed += 1
            continue
        found, expected = fingerprints(out), stored.get((scene, kind), {})
        if options.write:
            stored[scene, kind] = found
            continue
        others = [name for name in sorted(expected) if found.get(name) != expected[name]]
        if others or not expected:
            print("FAILED  %s: %s" % (scene, "other bits in " + ", ".join(others) if expected else "nothing is stored for it"))
            failed += 1
    if options.write and not failed:
        write_table(stored)
        print("%d scenes stored for %s operations" % (len(scenes), kind))
    elif failed:
        print("%d of %d scenes have other bits than those stored for %s. Was a change of results meant, and does `perikit check --machine` pass, then "
              "`ninja fingerprints` stores them anew: at x86-64-v3 or -v4, of which both must then pass, and at x86-64-v2. If none was meant, operations "
              "or the order of a sum depend on the compiler or on the width of a pack (framework/docs/decisions/0025-same-bits.md)."
              % (failed, len(scenes), "levels with fused operations" if kind == "fused" else "levels without"))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
