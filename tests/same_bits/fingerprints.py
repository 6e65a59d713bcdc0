"""The same bits at every level that has fused operations: hashes of all fields and of the history of small scenes, against a stored list.

    fingerprints.py PROGRAM FOLDER [--write]

Runs scenes/*.toml in FOLDER. fingerprints.csv holds what they come to: scene, field, hash, size (root mean square). Builds without fused operations
round otherwise: of them the sizes are compared. Scenes take no function of the C library whose last digit its versions round otherwise, no solver
and no Voronoi cells; what is hashed are numbers, not files."""

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "scenes"))
from results import call, frames, history, numpy, read  # noqa: E402

TABLE = os.path.join(HERE, "fingerprints.csv")
TOLERANCE = 1e-11   # of sizes, where operations are not fused


def is_fused(program):
    """Whether this build computes what those for x86-64-v3 and -v4 compute."""
    level = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    if "native" in level and os.uname().machine == "x86_64":
        with open("/proc/cpuinfo") as file:
            return " fma " in file.read()
    return bool(re.search(r"x86-64-v[34]", level))


def fingerprints(folder):
    """Hash and size of each field in all frames, of the times of frames, and of the columns of the history."""
    values = {}
    for path in frames(folder):
        fields, time = read(path)
        for name, value in {**fields, "times": numpy.array(time)}.items():
            values.setdefault(name, []).append(value)
    values["history"] = list(history(folder).values())
    found = {}
    for name, arrays in values.items():
        numbers = numpy.concatenate([numpy.ravel(array).astype(float) for array in arrays])
        finite = numbers[numpy.isfinite(numbers)]
        found[name] = (hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()[:12], float(numpy.sqrt(numpy.mean(finite ** 2))))
    return found


def read_table():
    stored = {}
    with open(TABLE) as file:
        for line in file.read().split("\n")[1:]:
            if line:
                scene, field, value, size = line.split(",")
                stored.setdefault(scene, {})[field] = (value, float(size))
    return stored


def write_table(stored):
    with open(TABLE, "w") as file:
        file.write("scene,field,hash,size\n")
        for scene, fields in sorted(stored.items()):
            file.writelines("%s,%s,%s,%r\n" % (scene, name, *value) for name, value in sorted(fields.items()))


def others(found, stored, fused):
    """Fields that are not as stored, in words."""
    words = []
    for name, (value, size) in sorted(stored.items()):
        if name not in found:
            words.append(name + " (is missing)")
        elif fused and found[name][0] != value:
            words.append(name)
        elif abs(found[name][1] - size) > TOLERANCE * size:
            words.append("%s (size %.15g for %.15g)" % (name, found[name][1], size))
    return words


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--write", action="store_true", help="stores what this build comes to")
    options = parser.parse_args()
    fused = is_fused(options.program)
    if options.write and not fused:
        sys.exit("What is stored are the bits of x86-64-v3 and -v4.")
    stored = {} if options.write else read_table()
    scenes = sorted(name[:-5] for name in os.listdir(os.path.join(HERE, "scenes")) if name.endswith(".toml"))
    failed = 0
    for scene in scenes:
        out = os.path.join(options.folder, scene)
        shutil.rmtree(out, ignore_errors=True)
        done = call([options.program, "run", os.path.join(HERE, "scenes", scene + ".toml"), "-o", out, "--quiet", "--threads", "1"])
        if done.status != 0:
            sys.exit("FAILED  %s ends with %d: %s" % (scene, done.status, done.first_line))
        found = fingerprints(out)
        if options.write:
            stored[scene] = found
            continue
        words = others(found, stored[scene], fused) if scene in stored else ["nothing is stored for it"]
        if words:
            print("FAILED  %s: not as stored: %s" % (scene, ", ".join(words)))
            failed += 1
    if options.write:
        write_table(stored)
        print("%d scenes stored" % len(scenes))
    elif failed:
        print("%d of %d scenes %s. Was a change of results meant, and does `perikit check --machine` pass, then `ninja fingerprints` stores them anew, at "
              "x86-64-v3 or -v4; the test must then pass at the other, too. If none was meant, operations or the order of a sum depend on the "
              "compiler or on the width of a pack (framework/docs/decisions/0025-same-bits.md)."
              % (failed, len(scenes), "have other bits than levels x86-64-v3 and -v4" if fused else "are not those of x86-64-v3 and -v4 to %g" % TOLERANCE))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
