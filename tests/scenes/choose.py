"""Chooses the scenes of the test command, so that every part, every key and every pair that coverage.py names is in one of them.

    choose.py PROGRAM FOLDER seeds.txt

One scene for each pair of kinematics and body, with regions, criteria, integrators and conditions dealt out among them, then scenes for the keys that are left. A scene is
taken if `check` and `run` accept it in its own words, it ends well and soon, and it has what it was made for. What no scene could have is printed with what the
program said."""

import argparse
import itertools
import os
import re
import shutil
from concurrent.futures import ThreadPoolExecutor

from bodies import SHAPES
from coverage import BODIES, LAWS_THAT_MEET, features, wanted
from generate import Generator
from net import repaired
from tables import read_tables
from trial import Trial

SECONDS = 0.5   # of processor time, of one run
ATTEMPTS = 12


def wish_words(wishes):
    return " ".join("%s=%s" % (what, ",".join(value) if what == "keys" else value.replace(" ", "-")) for what, value in sorted(wishes.items()))


def design(tables):
    """Wishes of one scene for each pair of kinematics and body: each kinematics meets every shape of regions and every criterion, each integrator every condition."""
    bodies = ["%s %dD" % (kind, d) for kind, d in itertools.product(BODIES, (1, 2, 3)) if not (kind == "voronoi" and d == 1)]
    criteria = list(tables.parts["damage"]) + ["none"]
    statics = [name for name in tables.parts["integrator"] if name != "verlet"]
    conditions = ["boundary", "symmetry", "load", "periodic"]
    for (k, name), (b, body) in itertools.product(enumerate(tables.parts["kinematics"]), enumerate(bodies)):
        number = k * len(bodies) + b
        damage = criteria[(k + b) % len(criteria)]
        integrator = statics[number // 2 % len(statics)] if damage == "none" or number % 4 == 0 else "verlet"
        if integrator == "evaluate":
            damage = "none"
        wishes = {"kinematics": name, "body": body, "damage": damage, "integrator": integrator, "condition": conditions[number // 3 % 4]}
        if (b + k) % 7 < len(SHAPES):
            wishes |= {"region": SHAPES[(b + k) % 7], "interfaces": LAWS_THAT_MEET[(b + k) // 3 % 2]}
        yield wishes


def purpose(wishes):
    """The features that a scene is made for, the most important first."""
    out = []
    if "kinematics" in wishes and "body" in wishes:
        out.append("%s, %s" % (wishes["kinematics"], wishes["body"]))
    if "kinematics" in wishes and wishes.get("damage", "none") != "none":
        out.append("%s, %s" % (wishes["kinematics"], wishes["damage"]))
    if "integrator" in wishes and "condition" in wishes:
        out.append("%s, %s" % (wishes["integrator"], wishes["condition"]))
    out += ["%s, %s" % (wishes["kinematics"], wishes[what]) for what in ("region", "interfaces") if what in wishes and "kinematics" in wishes]
    out += ["points " + wishes["points"]] if "points" in wishes else []
    out += ["key " + key for key in wishes.get("keys", ())]
    return out


def attempt(program, tables, folder, seed, wishes):
    """The scene's features and what `check` refused; no features where the scene is not one for the test command."""
    scene = Generator(tables, seed, wishes=wishes).scene()
    scene, refusals, _ = repaired(program, folder, scene)
    if scene is None:
        return [], refusals
    trial = Trial(program, tables, folder, scene, only="none")
    trial.try_scene()
    shutil.rmtree(folder, ignore_errors=True)
    if trial.status != 0 or trial.findings:
        return [], refusals + ["status %d: %s" % (trial.status, trial.words[:200])]
    return (features(scene) if trial.seconds < SECONDS else []), refusals


def choose(program, tables, folder, number, wishes, wanted_of):
    """(wishes, seed, features) of the attempt that has most of what it was made for, and refusals."""
    best, said = None, []
    for k in range(ATTEMPTS):
        seed = 100 * number + k
        found, refusals = attempt(program, tables, "%s/%d" % (folder, number), seed, wishes)
        said += refusals
        have = sum(feature in found for feature in wanted_of)
        if found and (best is None or have > best[0]):
            best = (have, seed, found)
        if best and best[0] == len(wanted_of):
            break
    return best, said


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("seeds")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    tables = read_tables(options.program)
    os.makedirs(options.folder, exist_ok=True)
    all_of_it = wanted(tables)
    chosen, found, said = [], set(), {}

    def take(cases, first):
        with ThreadPoolExecutor(options.jobs) as pool:
            tried = pool.map(lambda case: (case[1], choose(options.program, tables, options.folder, case[0], case[1], purpose(case[1]))), enumerate(cases, first))
            for wishes, (best, words) in tried:
                if best:
                    chosen.append((best[1], wishes))
                    found.update(best[2])
                for feature in purpose(wishes):
                    if not best or feature not in best[2]:
                        said.setdefault(feature, []).extend(words)
                print("%d scenes have %d of %d" % (len(chosen), len(found & all_of_it), len(all_of_it)), flush=True)

    take(list(design(tables)), 1)
    for turn in range(3):
        left = sorted(all_of_it - found)
        cases = []
        for feature in left:
            cases += [wishes_for(feature, tables, turn)]
        take([case for case in cases if case], 1000 * (turn + 1))
    with open(options.seeds, "w") as file:
        file.write("# Scenes of the test command, chosen by choose.py (seeds and what was wished for)\n")
        file.writelines("%d %s\n" % (seed, wish_words(wishes)) for seed, wishes in sorted(chosen, key=lambda row: row[0]))
        file.write("\n# No scene has:\n")
        for feature in sorted(all_of_it - found):
            words = [re.sub(r"^\S+scene\.toml:\d+:\d+: ", "", text) for text in said.get(feature, ["nothing was said"])]
            file.write("# %s: %s\n" % (feature, max(set(words), key=words.count)))


def wishes_for(feature, tables, turn):
    bodies = ["lattice 2D", "jittered 2D", "lattice 3D"]
    if feature.startswith("key "):
        key = feature[4:]
        wishes = {"keys": (key,)}
        part = key.split(".")[0]
        if key.startswith(("body.points", "boundary.surface")):
            wishes["body"] = "voronoi 2D" if key != "boundary.surface" else ("jittered 2D", "jittered 3D")[turn % 2]
        elif key in ("body.area", "body.line"):
            wishes["body"] = "lattice 1D"
        elif key == "crack.polygon":
            wishes["body"] = "lattice 3D"
        elif part in ("kinematics", "damage", "integrator"):
            holders = [name for name, table in tables.parts[part].items() if key.split(".")[1] in table.keys]
            wishes[part] = holders[turn % len(holders)] if holders else {"integrator": "newton", "damage": "critical_stretch"}.get(part, "conventional")
        elif part == "run":
            wishes |= {"integrator": "newton", "condition": "load"}
        elif part == "initial":
            wishes |= {"integrator": "verlet", "condition": "none"}
        elif part == "load":
            wishes |= {"condition": "load"}
        elif part == "boundary":
            wishes |= {"condition": "boundary", "integrator": "verlet"}
        elif part in ("symmetry", "periodic"):
            wishes |= {"condition": part}
        elif part == "interface":
            wishes |= {"keys": (key, "region.set"), "damage": "critical_stretch"}
        return wishes
    words = feature.split(", ")
    if len(words) == 2:
        if words[0] in tables.parts["integrator"]:
            return {"integrator": words[0], "condition": words[1], "body": bodies[turn], "damage": "none"}
        if words[1] in SHAPES + LAWS_THAT_MEET:
            region = {"region": words[1]} if words[1] in SHAPES else {"region": SHAPES[turn], "interfaces": words[1]}
            return {"kinematics": words[0], "body": bodies[turn], "damage": "none"} | region
        if words[1] in tables.parts["damage"]:
            return {"kinematics": words[0], "damage": words[1], "body": bodies[turn], "integrator": "verlet"}
        return {"kinematics": words[0], "body": words[1], "integrator": ("verlet", "newton", "evaluate")[turn], "damage": "none"}
    kind, name = feature.split(" ", 1)
    if kind == "points":
        return {"points": name, "body": "file 2D"}
    return {kind: name} if kind in tables.parts or kind == "body" else None


if __name__ == "__main__":
    main()
