"""Random valid scenes against what every scene must come to.

    net.py PROGRAM FOLDER [--first SEED] [--count N] [--seeds FILE] [--scenes FOLDER] [--explicit] [--only KIND] [--no-shrink]

Seeds are tried one after the other; seeds that FOLDER/done.csv lists are not tried again. Failing scenes are kept, made small, in FOLDER/failing."""

import argparse
import collections
import os
import re
import shutil
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from coverage import features, wanted
from generate import Generator, read_wishes
from scene_text import scene_text, write_scene
from smaller import smaller
from tables import read_tables
from results import call
from trial import Trial, make_earlier_results, without_digits


MOST_STEPS = 1000


def repaired(program, folder, scene, attempts=8):
    """The scene without the keys that `check` refuses, and `run` must refuse, too: rules that bind several keys are the program's. Returns it with the refusals."""
    refusals = []
    for _ in range(attempts):
        shutil.rmtree(folder, ignore_errors=True)
        path = write_scene(scene, folder)
        make_earlier_results(program, scene, folder)
        checked = call([program, "check", path])
        if checked.status != 2:
            return shortened(scene, checked), refusals, checked
        ran = call([program, "run", path, "-o", folder + "/refused", "--quiet", "--threads", "1"])
        if ran.status != 2:
            print("FAILED  check: refuses what run ends with %d: %s\n%s" % (ran.status, checked.first_line, scene_text(scene)), flush=True)
        refusals.append(checked.first_line)
        match = re.search(r"scene\.toml:\d+:\d+: ([\w.\[\]]+): ", checked.words)
        if not match or not drop(scene, match.group(1).split(".")):
            return None, refusals, checked
    return None, refusals, checked


def shortened(scene, checked):
    """Runs of stiff bodies end sooner: they would take minutes."""
    steps = re.search(r"verlet: (\d+) steps", checked.words)
    if steps and int(steps.group(1)) > MOST_STEPS:
        scene["integrator"]["end_time"] = float("%.6g" % (scene["integrator"]["end_time"] * MOST_STEPS / int(steps.group(1))))
    return scene


def drop(scene, path):
    """Removes a key; where its section is needed and the key is, nothing can be done."""
    at, parents = scene, []
    for word in path:
        word = int(word) if isinstance(at, list) and word.isdigit() else word
        if isinstance(at, list) and isinstance(word, int) and word < len(at) or isinstance(at, dict) and word in at:
            parents.append((at, word))
            at = at[word]
        else:
            break
    while parents:
        holder, word = parents.pop()
        if word in ("type", "set", "integrator", "kinematics", "material", "family", "body", "format", "lattice"):
            continue
        del holder[word]
        if holder == [] and parents:
            upper, name = parents.pop()
            del upper[name]
        return True
    return False


def try_kept(program, tables, work, folder, name, options):
    """A scene that failed once. Its comments say what it is for, and may ask for more than other scenes are: words in run.log, energies that
    add up to a share of the largest. Returns findings."""
    with open(os.path.join(folder, name)) as file:
        text = file.read()
    trial = Trial(program, tables, os.path.join(work, name), tomllib.loads(text), options.only, others=0)
    findings = trial.try_scene()
    if trial.status != 0:
        return findings + [("status %d" % trial.status, trial.words[:300])]
    with open(os.path.join(work, name, "out", "run.log")) as log:
        log = log.read()
    for words in re.findall(r"^# log: (.+)$", text, re.MULTILINE):
        if words not in log:
            findings.append(("log", "without '%s'" % words))
    for share in re.findall(r"^# energies: (.+)$", text, re.MULTILINE):
        if trial.imbalance > float(share):
            findings.append(("energy", "off by %.2g of the largest, more than %s" % (trial.imbalance, share)))
    return findings


@dataclass
class Tried:
    outcome: str
    refusals: list
    findings: list = field(default_factory=list)
    features: list = field(default_factory=list)
    small: str = ""   # a scene that fails in the same way


def try_seed(tables, options, seed, wishes):
    folder = "%s/%d" % (options.folder, seed)
    scene, refusals, checked = repaired(options.program, folder, Generator(tables, seed, options.explicit, wishes).scene())
    if scene is None:
        shutil.rmtree(folder, ignore_errors=True)
        return Tried("refused" if checked.status in (0, 2) else "check ends with %d" % checked.status, refusals)
    trial = Trial(options.program, tables, folder, scene, options.only, None if options.all_others else options.others)
    findings = trial.try_scene()
    tried = Tried("status %d" % trial.status, refusals, findings, features(scene))
    if trial.status == 1:
        tried.outcome += ": " + without_digits(trial.words.split(": ", 1)[-1])[:110]
    if findings:
        kind, words = findings[0]
        tried.outcome = "FAILED " + kind
        small = scene if options.no_shrink else smaller(options.program, tables, folder + "_small", scene, kind)
        write_scene(small, "%s/failing/%d" % (options.folder, seed))
        with open("%s/failing/%d/finding" % (options.folder, seed), "w") as file:
            file.write("%s: %s\n" % (kind, words))
        tried.small = scene_text(small)
    shutil.rmtree(folder, ignore_errors=True)
    shutil.rmtree(folder + "_small", ignore_errors=True)
    return tried


def read_seeds(path):
    """Seeds with their wishes, and what no scene can have: "# feature: reason"."""
    with open(path) as file:
        lines = file.read().split("\n")
    words = [line.split() for line in lines if line and not line.startswith("#")]
    return [(int(row[0]), read_wishes(row[1:])) for row in words], {line[2:].split(": ")[0] for line in lines if re.match("# .+: ", line)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seeds")
    parser.add_argument("--scenes", help="a folder of scenes to be tried before the seeds")
    parser.add_argument("--explicit", action="store_true")
    parser.add_argument("--only", help="kinds of findings that begin so: what they do not need is not run")
    parser.add_argument("--others", type=int, default=2, help="how many other runs of a scene (ranks, kills, mirrored ...) are tried")
    parser.add_argument("--all-others", action="store_true")
    parser.add_argument("--jobs", type=int, default=1, help="scenes at a time")
    parser.add_argument("--no-shrink", action="store_true")
    options = parser.parse_args()
    tables = read_tables(options.program)
    os.makedirs(options.folder + "/failing", exist_ok=True)
    done_file = options.folder + "/done.csv"
    done = set()
    if os.path.exists(done_file) and not options.seeds:
        with open(done_file) as file:
            done = {int(line.split(",")[0]) for line in file}
    cases = [(seed, {}) for seed in range(options.first, options.first + options.count)]
    impossible = set()
    if options.seeds:
        cases, impossible = read_seeds(options.seeds)
    kinds, refused, failed, covered = collections.Counter(), collections.Counter(), [], set()
    began = time.time()
    for name in sorted(os.listdir(options.scenes)) if options.scenes else []:
        findings = try_kept(options.program, tables, options.folder, options.scenes, name, options)
        for kind, words in findings:
            print("FAILED  %s: %s: %s" % (name, kind, words), flush=True)
        failed += [name] if findings else []
        kinds["FAILED, kept" if findings else "status 0, kept"] += 1
    with ThreadPoolExecutor(options.jobs) as pool:
        cases = [(seed, wishes) for seed, wishes in cases if seed not in done]
        for (seed, _), tried in zip(cases, pool.map(lambda case: try_seed(tables, options, *case), cases)):
            for words in tried.refusals:
                refused[without_digits(words.split(": ", 1)[-1])[:160]] += 1
            for kind, words in tried.findings:
                print("FAILED  seed %d: %s: %s" % (seed, kind, words), flush=True)
            if tried.findings:
                failed.append(seed)
                print(tried.small, flush=True)
            else:
                covered.update(tried.features)
            kinds[tried.outcome] += 1
            with open(done_file, "a") as file:
                file.write("%d,%s\n" % (seed, tried.outcome.replace(",", ";").replace("\n", " ")))
    print("\n%d scenes in %.0f s" % (sum(kinds.values()), time.time() - began))
    for outcome, count in kinds.most_common():
        print("%5d  %s" % (count, outcome))
    print("keys that `check` refused and that were taken out:")
    for words, count in refused.most_common(30):
        print("%5d  %s" % (count, words))
    missing = sorted(wanted(tables) - covered - impossible)
    for feature in missing:
        print("%s %s" % ("FAILED  no seed has" if options.seeds else "no scene has", feature))
    if missing and options.seeds:
        print("A part or a key is new, or scenes are others than they were: choose.py chooses seeds anew.")
    sys.exit(1 if failed or not kinds or missing and options.seeds else 0)


if __name__ == "__main__":
    main()
