"""Which parts of perikit go together: a table made by running small scenes, framework/docs/compositions.md.

usage: compositions.py PROGRAM WORK write|test

write: runs all cells, and writes what became of them into cells.csv and the page. All pairs of values of the axes below are among them, and all
combinations of kinematics, criterion and sides. test: the page says what cells.csv does, cells.csv knows all parts of the program, and a part of the cells,
run again, comes to the same.
"""

import concurrent.futures
import csv
import itertools
import os
import random
import re
import shutil
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "scenes"))
import numpy

from results import call, frames, read
from tables import read_tables
from trial import MPIRUN

KINEMATICS = {
    "bond_based": 'type = "bond_based"',
    "ordinary": 'type = "ordinary"',
    "conventional": 'type = "conventional"',
    "conventional, silling": 'type = "conventional"\nstabilization = { type = "silling", coefficient = 0.5 }',
    "conventional, wan": 'type = "conventional"\nstabilization = { type = "wan" }',
    "baqp": 'type = "baqp"',
    "projection": 'type = "projection"',
    "bond_augmented": 'type = "bond_augmented"',
    "non_spherical": 'type = "non_spherical"',
    "sub_horizon": 'type = "sub_horizon"',
    "bond_associated": 'type = "bond_associated"',
    "selective, baqp": 'type = "selective"\nbase = { type = "baqp" }',
    "selective, non_spherical": 'type = "selective"\nbase = { type = "non_spherical" }',
    "selective, sub_horizon": 'type = "selective"\nbase = { type = "sub_horizon" }',
    "baqp, order 2": 'type = "baqp"\norder = 2',
}
MODULI = "density = 1.0\nyoungs_modulus = 2.0\npoisson_ratio = {nu}"
LAWS = {
    "linear_elastic": 'type = "linear_elastic"\n' + MODULI,
    "saint_venant_kirchhoff": 'type = "saint_venant_kirchhoff"\n' + MODULI,
    "neo_hookean": 'type = "neo_hookean"\n' + MODULI,
    "hencky": 'type = "hencky"\n' + MODULI,
    "mooney_rivlin": 'type = "mooney_rivlin"\ndensity = 1.0\nC1 = 0.3\nC2 = 0.08\nbulk_modulus = 1.7',
    "hypoelastic": 'type = "hypoelastic"\n' + MODULI,
    "j2": 'type = "j2"\n' + MODULI + "\nyield_stress = 0.2\nhardening = 0.1",
}
CRITERIA = {
    "none": "",
    "critical_stretch": '[damage]\ntype = "critical_stretch"\nstretch = 0.09\n',
    "critical_energy": '[damage]\ntype = "critical_energy"\nenergy_release_rate = 0.03\n',
    "max_stress": '[damage]\ntype = "max_stress"\nstrength = 0.2\n',
    "smooth_degradation": '[damage]\ntype = "smooth_degradation"\nstretch_min = 0.06\nstretch = 0.2\n',
    "critical_energy, [[interface]]": '[damage]\ntype = "critical_energy"\nenergy_release_rate = 0.04\n'
                                      '[[interface]]\nbetween = ["some", "rest"]\ndamage = { type = "critical_energy", energy_release_rate = 0.02 }\n',
}
SIDES = ("layers", "faces", "symmetry", "periodic")
BODIES = ("lattice", "cloud", "cut cells")
INTEGRATORS = {
    "verlet": 'type = "verlet"\nend_time = 2.5\ntime_step = 0.1\nallow_unstable = true',
    "dynamic_relaxation": 'type = "dynamic_relaxation"\nsteps = 1\ntolerance = 1e-4',
    "jfnk": 'type = "jfnk"\nsteps = 1\ntolerance = 1e-6',
    "kinsol": 'type = "kinsol"\nsteps = 1\ntolerance = 1e-6',
    "newton": 'type = "newton"\nsteps = 1\ntolerance = 1e-6',
    "evaluate": 'type = "evaluate"',
}
RANKS = ("1", "2")
JOBS = 4   # runs at a time
AXES = {"kinematics": tuple(KINEMATICS), "law": tuple(LAWS), "criterion": tuple(CRITERIA), "sides": SIDES, "body": BODIES,
        "integrator": tuple(INTEGRATORS), "ranks": RANKS}
USUAL = {"kinematics": "baqp", "law": "saint_venant_kirchhoff", "criterion": "none", "sides": "layers", "body": "lattice", "integrator": "verlet", "ranks": "1"}
ALSO = {"law": ("neo_hookean", "linear_elastic"), "kinematics": ("conventional, wan", "bond_based"), "integrator": ("jfnk",), "criterion": ("critical_stretch",)}
WARNINGS_OF_NONSENSE = ("energy", "not_finite", "inside_out")


def scene(cell):
    law = LAWS[cell["law"]].format(nu=0.25 if cell["kinematics"] == "bond_based" else 0.3)
    statics = cell["integrator"] != "verlet"
    # On several ranks of a busy machine iterations wait for each other: a few are enough to see that they go together.
    integrator = INTEGRATORS[cell["integrator"]] if cell["ranks"] == "1" else re.sub("tolerance = .*", "tolerance = 0.3", INTEGRATORS[cell["integrator"]])
    lattice = {"lattice": "", "cloud": "jitter = 0.2\n", "cut cells": 'inside = "(x - 5)^2 + (y - 4)^2 > 2.3"\n'}[cell["body"]]
    pull = '"0.2*t^2"' if not statics else "0.7"
    held = '[[boundary]]\n%s\ndisplacement = [0, 0]\n[[boundary]]\n%s\ndisplacement = [%s, 0]\n'
    sides = held % ('set = "low"', 'set = "high"', pull)
    if cell["sides"] == "faces":
        sides = held % ('face = "-x"', 'face = "+x"', pull)
        if cell["body"] == "cut cells":
            sides += '[[boundary]]\nsurface = "2.3 - (x - 5)^2 - (y - 4)^2"\ndisplacement = [%s, 0]\n' % ('"0.1*t^2"' if not statics else "0.35")
    elif cell["sides"] == "symmetry":
        sides += '[[symmetry]]\naxis = "y"\n'
    elif cell["sides"] == "periodic":
        sides += '[[periodic]]\naxis = "y"\n'
    region = "" if "interface" not in cell["criterion"] else '[[region]]\nset = "some"\nmaterial = { %s }\n' % law.replace("\n", ", ")
    partial = "partial_volume = true\n" if cell["body"] == "cut cells" else ""
    return """format = 1
[body]
dimension = 2
plane = "strain"
[body.lattice]
spacing = 1.0
lower = [0, 0]
upper = [10, 8]
{lattice}[sets]
low = "x < 2"
high = "x > 8"
some = "x > 5"
[family]
horizon_ratio = 2.015
{partial}[kinematics]
{kinematics}
[material]
{law}
{region}{criterion}{sides}[integrator]
{integrator}
[output]
frames = 2
fields = ["displacement", "strain_energy_density"{damage}]
""".format(lattice=lattice, partial=partial, kinematics=KINEMATICS[cell["kinematics"]], law=law, region=region, criterion=CRITERIA[cell["criterion"]], sides=sides,
           integrator=integrator, damage="" if cell["criterion"] == "none" else ', "damage"')


def key(cell):
    return tuple(cell[axis] for axis in AXES)


def outcome(program, folder, cell):
    """"" where the cell works, else why it does not, in the words of the program."""
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    path = os.path.join(folder, "scene.toml")
    with open(path, "w") as file:
        file.write(scene(cell))
    ranks = MPIRUN + [cell["ranks"]] if cell["ranks"] != "1" else []
    done = call([*ranks, program, "run", path, "-o", os.path.join(folder, "out"), "--quiet", "--threads", "1"])
    if done.status != 0:
        return sentence(done, path)
    for frame in frames(os.path.join(folder, "out")):
        for name, values in read(frame)[0].items():
            if not numpy.all(numpy.isfinite(values)):
                return "FAILS: %s of %s is not finite" % (name, os.path.basename(frame))
    with open(os.path.join(folder, "out", "run.log")) as log:
        text = log.read()
        found = [name for name in WARNINGS_OF_NONSENSE if "[%s]" % name in text]
    return "FAILS: warning " + found[0] if found else ""


def sentence(done, path):
    lines = [line for line in done.words.split("\n") if re.search(r"\bfound |\bthe run failed", line)]
    line = re.sub(r"^.*?(found |the run failed)", r"\1", (lines or [done.first_line])[0].replace(path, "scene.toml")).strip()
    return ("" if done.status == 2 else "FAILS: status %d, " % done.status) + line


def rows_of_all_pairs(chance):
    """Cells in which every two values of two axes come together, greedily: the best of some random cells, again and again."""
    names = list(AXES)
    missing = {(a, x, b, y) for a, b in itertools.combinations(names, 2) for x in AXES[a] for y in AXES[b]}
    pairs = lambda cell: {(a, cell[a], b, cell[b]) for a, b in itertools.combinations(names, 2)}
    while missing:
        a, x, b, y = min(missing)
        best, most = None, -1
        for _ in range(60):
            cell = {axis: chance.choice(values) for axis, values in AXES.items()} | {"ranks": chance.choice("11112")} | {a: x, b: y}
            if len(pairs(cell) & missing) > most:
                best, most = cell, len(pairs(cell) & missing)
        missing -= pairs(best)
        yield best


def cells_of_product():
    for kinematics, criterion, sides in itertools.product(KINEMATICS, CRITERIA, SIDES):
        yield USUAL | {"kinematics": kinematics, "criterion": criterion, "sides": sides}


class Table:
    """What became of the cells that were run."""

    def __init__(self, program, work):
        self.program, self.work, self.found = program, work, {}

    def run(self, cell):
        if key(cell) not in self.found:
            self.found[key(cell)] = outcome(self.program, os.path.join(self.work, "%x" % abs(hash(key(cell)))), cell)
            if self.found[key(cell)].startswith("FAILS"):
                print("%s: %s" % (", ".join(key(cell)), self.found[key(cell)]), flush=True)
        return self.found[key(cell)]

    def fill(self):
        with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
            list(pool.map(self.run, itertools.chain(cells_of_product(), rows_of_all_pairs(random.Random(1)))))
        # A pair whose cells were all refused may have been refused for what else they held.
        for a, b in itertools.combinations(AXES, 2):
            for x, y in itertools.product(AXES[a], AXES[b]):
                if not self.works(a, x, b, y):
                    self.try_alone(a, x, b, y)

    def try_alone(self, a, x, b, y):
        for axis, value in itertools.chain([(None, None)], ((axis, value) for axis, values in ALSO.items() for value in values)):
            if self.run(USUAL | ({axis: value} if axis else {}) | {a: x, b: y}) == "":
                return

    def cells_with(self, a, x, b, y):
        places = {axis: k for k, axis in enumerate(AXES)}
        return {cell: words for cell, words in self.found.items() if cell[places[a]] == x and cell[places[b]] == y}

    def works(self, a, x, b, y):
        return any(words == "" for words in self.cells_with(a, x, b, y).values())


CELLS = os.path.join(HERE, "cells.csv")
PAGE = os.path.join(HERE, "..", "..", "framework", "docs", "compositions.md")
HEADING = """# What goes with what

Parts of perikit are chosen one by one: a kinematics, a law, a criterion for bonds that fail, sides that are held, symmetric or periodic, a kind of body, an
integrator, a number of ranks. This page says which of them go together. It is made by running %d small scenes: `python3 tests/compositions/compositions.py PERIKIT
WORK write`. A cell *works* where the run ends, all fields of its frames are finite, and the program has no doubt of its energies and its step. All else is refused
before the run begins, with one sentence that says why.

Every two values of two of these lists come together in some scene:

"""


def page(found):
    """The text of the page."""
    text = HEADING % len(found)
    for axis, values in AXES.items():
        text += "* %s: %s\n" % (axis, ", ".join("`%s`" % value for value in values))
    reasons = []

    def mark(words):
        if words == "":
            return "works"
        if words not in reasons:
            reasons.append(words)
        return "[%d](#why-not)" % (reasons.index(words) + 1)

    text += "\n## Kinematics, criteria and sides\n\nOn lattices, with `saint_venant_kirchhoff` and `verlet`.\n"
    for sides in SIDES:
        text += "\n| %s | %s |\n|%s\n" % (sides, " | ".join("`%s`" % criterion for criterion in CRITERIA), "---|" * (len(CRITERIA) + 1))
        for kinematics in KINEMATICS:
            cells = [USUAL | {"kinematics": kinematics, "criterion": criterion, "sides": sides} for criterion in CRITERIA]
            text += "| `%s` | %s |\n" % (kinematics, " | ".join(mark(found[key(cell)]) for cell in cells))
    text += "\n## Pairs that do not go together\n\n"
    refused = []
    for a, b in itertools.combinations(AXES, 2):
        places = {axis: k for k, axis in enumerate(AXES)}
        for x, y in itertools.product(AXES[a], AXES[b]):
            cells = {cell: words for cell, words in found.items() if cell[places[a]] == x and cell[places[b]] == y}
            if all(words != "" for words in cells.values()):
                usual = [cells[key(USUAL | {a: x, b: y})]] if key(USUAL | {a: x, b: y}) in cells else list(cells.values())[:1]
                refused.append((a, x, b, y, mark(usual[0])))
    text += "All other pairs of values work together somewhere.\n\n| | | why not |\n|---|---|---|\n" if refused else "There are none.\n"
    text += "".join("| %s `%s` | %s `%s` | %s |\n" % row for row in refused)
    for words in found.values():
        if words:
            mark(words)
    text += "\n## Why not\n\n" + "".join("%d. %s\n" % (n + 1, words) for n, words in enumerate(reasons))
    return text


def read_cells():
    with open(CELLS, newline="") as file:
        return {tuple(row[:-1]): row[-1] for row in list(csv.reader(file))[1:]}


def write_cells(found):
    with open(CELLS, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*AXES, "why not"])
        writer.writerows([*cell, words] for cell, words in sorted(found.items()))


def missing_parts(program):
    """Parts of the program that no axis has."""
    parts = read_tables(program).parts
    known = {"kinematics": [re.search(r'type = "(\w+)"', text).group(1) for text in KINEMATICS.values()], "material": LAWS,
             "damage": [re.search(r'type = "(\w+)"', text).group(1) for text in CRITERIA.values() if text], "integrator": INTEGRATORS}
    return ["%s %s" % (kind, name) for kind, names in known.items() for name in parts[kind] if name not in names]


def test(program, work):
    found, failed = read_cells(), []
    with open(PAGE) as file:
        if file.read() != page(found):
            failed.append("%s does not say what cells.csv does: compositions.py PROGRAM WORK write" % os.path.normpath(PAGE))
    failed += ["no cell has %s: compositions.py PROGRAM WORK write" % part for part in missing_parts(program)]
    failed += ["a cell fails: %s: %s" % (", ".join(cell), words) for cell, words in found.items() if words.startswith("FAILS")]
    cells = random.Random(2).sample(sorted(found), min(len(found), 50))
    for cell in cells:
        if cell[-1] != "1" and not shutil.which("mpirun"):
            continue
        now = outcome(program, os.path.join(work, "cell"), dict(zip(AXES, cell)))
        if now != found[cell]:
            failed.append("%s: \"%s\", and the page says \"%s\"" % (", ".join(cell), now or "works", found[cell] or "works"))
    print("\n".join(failed) or "%d cells of %d are as the page says" % (len(cells), len(found)))
    return 1 if failed else 0


if __name__ == "__main__":
    program, work, what = sys.argv[1:4]
    os.makedirs(work, exist_ok=True)
    if what == "test":
        sys.exit(test(program, work))
    table = Table(program, work)
    table.fill()
    write_cells(table.found)
    with open(PAGE, "w") as file:
        file.write(page(table.found))
    print("%d cells" % len(table.found))
