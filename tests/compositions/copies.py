"""Bodies that are half of a whole, and bodies that go on with themselves, crack as the whole does: the same bonds fail in the same steps.

usage: copies.py PROGRAM LIBRARY WORK small|all

Half of a body with a plane of symmetry is compared with all of it, and a periodic body with the same one shifted by some
cells, and with two of its periods. Bonds through the plane or the periodic side fail in all of them.
"""

import itertools
import os
import random
import shutil
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "scenes"))
import numpy

from results import call, difference, frames, history, read, reference
from trial import MPIRUN

KINEMATICS = {
    "bond_based": 'type = "bond_based"',
    "ordinary": 'type = "ordinary"',
    "conventional": 'type = "conventional"',
    "silling": 'type = "conventional"\nstabilization = { type = "silling", coefficient = 0.5 }',
    "wan": 'type = "conventional"\nstabilization = { type = "wan" }',
    "baqp": 'type = "baqp"',
    "projection": 'type = "projection"',
    "bond_augmented": 'type = "bond_augmented"',
    "non_spherical": 'type = "non_spherical"',
    "sub_horizon": 'type = "sub_horizon"',
    "bond_associated": 'type = "bond_associated"',
    "selective baqp": 'type = "selective"\nbase = { type = "baqp" }',
    "selective sub_horizon": 'type = "selective"\nbase = { type = "sub_horizon" }',
    "baqp, order 2": 'type = "baqp"\norder = 2',
}
PAIRS = ("bond_based", "ordinary")
CRITERIA = {
    "stretch": 'type = "critical_stretch"\nstretch = 0.06',
    "released": 'type = "critical_energy"\nenergy_release_rate = 0.002',
    "held": 'type = "critical_energy"\nenergy_release_rate = 0.002\nenergy = "held"\nlimit = "equal"',
    "weakening": 'type = "critical_energy"\nenergy_release_rate = 0.002\nsoftening = 4',
    "gradual": 'type = "critical_energy"\nenergy_release_rate = 0.002\ngradual = true',
    "stress": 'type = "max_stress"\nstrength = 0.06',
}
SPACING = 1.0
WIDTH = 6     # cells of half of the body across the plane of symmetry, and of the period
LENGTH = 9    # along it


def points_of(dimension, cloud, seed):
    """Centres of half of the body, the plane of symmetry at y = 0, or at x = 0 in one dimension."""
    chance = random.Random(seed)
    cells = {1: [14], 2: [LENGTH, WIDTH], 3: [6, 4, 4]}[dimension]
    shake = 0.2 if cloud else 0.0
    return [[k + 0.5 + chance.uniform(-shake, shake) for k in at] for at in itertools.product(*map(range, cells))], cells


def scene(kinematics, criterion, dimension, body, sides, motion):
    state = {1: 'line = "strain"', 2: 'plane = "strain"', 3: ""}[dimension]
    return """format = 1
[body]
dimension = {dimension}
{state}
{body}
[family]
horizon_ratio = {ratio}
consistent = false
[kinematics]
{kinematics}
[material]
type = "saint_venant_kirchhoff"
density = 1.0
youngs_modulus = 2.0
poisson_ratio = {nu}
[damage]
{criterion}
{sides}
[initial]
velocity = [{motion}]
[integrator]
{integrator}
[output]
frames = 8
history_every = 1
fields = ["displacement", "damage"]
""".format(dimension=dimension, state=state, body=body, kinematics=kinematics, criterion=criterion, sides=sides, ratio=3.015 if dimension < 3 else 2.015,
           nu={"bond_based": 0.25}.get(kinematics.split('"')[1], 0.3), motion=", ".join('"%s"' % m for m in motion), integrator='type = "verlet"\nend_time = 4.0\ntime_step = 0.4\nallow_unstable = true')


def lattice(lower, upper):
    return "[body.lattice]\nspacing = %r\nlower = %s\nupper = %s" % (SPACING, list(lower), list(upper))


def cloud_file(folder, name, points):
    os.makedirs(folder, exist_ok=True)
    path = os.path.join(folder, name + ".csv")
    with open(path, "w") as file:
        file.write("x,y,z,volume\n")
        for point in points:
            file.write(",".join("%r" % c for c in point + [0.0] * (3 - len(point))) + ",%r\n" % SPACING ** len(point))
    return '[body.points]\nfile = "%s"' % path


class Runs:
    def __init__(self, program, folder):
        self.program, self.folder, self.failed = program, folder, []

    def run(self, name, text, ranks=1, options=()):
        out = os.path.join(self.folder, name)
        os.makedirs(out, exist_ok=True)
        with open(out + ".toml", "w") as file:
            file.write(text)
        done = call([*(MPIRUN + [str(ranks)] if ranks > 1 else []), self.program, "run", out + ".toml", "-o", out, "--quiet", "--threads", "1", *options])
        if done.status != 0:
            self.say(name, "status %d, %s" % (done.status, done.first_line))
        return out if done.status == 0 else None

    def compare(self, name, part, whole, copies, tolerance=1e-9):
        """part: a run; whole: of the body that it is a part of, `copies` times as large. Points of the part lie at the same places in the whole."""
        if not part or not whole:
            return
        self.say(name, self.difference(part, whole, copies, tolerance))

    def compare_shifted(self, name, one, other, axis, length):
        """Runs of the same periodic body, whose sides lie elsewhere."""
        fold = lambda x: numpy.round(numpy.where(numpy.arange(3) == axis, x % length, x) / (1e-4 * SPACING)).astype(int)
        place = {tuple(k): n for n, k in enumerate(fold(reference(other)["position"]))}
        at = numpy.array([place[tuple(k)] for k in fold(reference(one)["position"])])
        for a, b in zip(frames(one), frames(other)):
            here, there = read(a)[0], read(b)[0]
            for field in ("damage", "displacement"):
                off = numpy.abs(here[field] - there[field][at]).max()
                if not off <= 1e-9:
                    return self.say(name, "%s of %s off by %.2g" % (field, os.path.basename(a), off))
        self.say(name, "")

    def say(self, name, words):
        print(("ok      " if not words else "FAILED  ") + name + (": " + words if words else ""), flush=True)
        if words:
            self.failed.append(name)

    def difference(self, part, whole, copies, tolerance):
        here, there = reference(part)["position"], reference(whole)["position"]
        key = lambda x: tuple(numpy.round(x / (1e-4 * SPACING)).astype(int))
        place = {key(x): k for k, x in enumerate(there)}
        at = numpy.array([place[key(x)] for x in here])
        broken = 0
        for a, b in zip(frames(part), frames(whole)):
            one, other = read(a)[0], read(b)[0]
            for field in ("damage", "displacement"):
                off = numpy.abs(one[field] - other[field][at]).max()
                scale = max(numpy.abs(other["displacement"]).max(), 1e-3) if field == "displacement" else 1.0
                if not off <= tolerance * scale:
                    return "%s of %s off by %.2g" % (field, os.path.basename(a), off / scale)
            broken = numpy.abs(one["damage"]).max()
        if broken < 0.02:
            return "nothing failed (%.2g)" % broken
        ours, theirs = history(part)["dissipated_energy"], history(whole)["dissipated_energy"]
        off = numpy.abs(copies * ours - theirs).max() / numpy.abs(theirs).max()
        return "" if off <= 1e3 * tolerance else "dissipated energy off by %.2g" % off


def symmetric_motion(dimension):
    """Even along the plane, odd across it: the last axis but z is across."""
    return {1: ["0.12*sin(x/3)"],
            2: ["0.02*cos(y/2)*sin(x/3)", "0.13*sin(y/4)*(1 + 0.2*cos(x/2))"],
            3: ["0.02*cos(y/2)*sin(x/3)", "0.2*sin(y/3)*(1 + 0.2*cos(x/2))", "0.02*sin(x + z)*cos(y/2)"]}[dimension]


def mirrored(points, axis):
    return points + [[-c if k == axis else c for k, c in enumerate(point)] for point in points]


def half_and_whole(runs, name, kinematics, criterion, dimension, cloud):
    points, cells = points_of(dimension, cloud, 3)
    axis = min(1, dimension - 1)
    motion = symmetric_motion(dimension)
    plane = '[[symmetry]]\naxis = "%s"\n' % "xyz"[axis] + ("at = 0.0\n" if cloud else "")
    lower = [-c if k == axis else 0 for k, c in enumerate(cells)]
    bodies = (cloud_file(runs.folder, name + " half", points), cloud_file(runs.folder, name + " whole", mirrored(points, axis))) if cloud else \
             (lattice([0] * dimension, cells), lattice(lower, cells))
    part = runs.run(name + " half", scene(kinematics, criterion, dimension, bodies[0], plane, motion))
    whole = runs.run(name + " whole", scene(kinematics, criterion, dimension, bodies[1], "", motion))
    runs.compare(name, part, whole, 2)


def period_and_two(runs, name, kinematics, criterion, dimension, cloud, shifted=True):
    points, cells = points_of(dimension, cloud, 4)
    axis = min(1, dimension - 1)
    length = cells[axis]
    w = "2*pi/%d" % length
    motion = {1: ["0.2*sin(%s*x)" % w], 2: ["0.05*sin(x/3)", "0.2*sin(%s*y)*(1 + 0.2*cos(x/2))" % w],
              3: ["0.05*sin(x/3)", "0.3*sin(%s*y)*(1 + 0.2*cos(x/2))" % w, "0.02*sin(x + z)"]}[dimension]
    along = lambda values, change: [change(c) if k == axis else c for k, c in enumerate(values)]
    by = length // 2
    # Where the body begins and ends along the axis, and its points.
    bodies = [(0, length, points), (0, 2 * length, points + [along(p, lambda c: c + length) for p in points]),
              (by, length + by, [along(p, lambda c: (c - by) % length + by) for p in points])]
    out = []
    for k, (low, high, inside) in enumerate(bodies[:3 if shifted else 2]):
        body = cloud_file(runs.folder, name + " %d" % k, inside) if cloud else lattice(along([0] * dimension, lambda c: low), along(cells, lambda c: high))
        out.append(runs.run(name + " %d" % k, scene(kinematics, criterion, dimension, body, side_of(cloud, axis, low, high), motion)))
    runs.compare(name + ", two periods", out[0], out[1], 2)
    if shifted and out[0] and out[2]:
        runs.compare_shifted(name + ", shifted", out[0], out[2], axis, length)


def side_of(cloud, axis, low, high):
    return '[[periodic]]\naxis = "%s"\n' % "xyz"[axis] + ("lower = %r\nupper = %r\n" % (float(low), float(high)) if cloud else "")



SMALL_HALVES = (
    ("bond_based", "released", 2, False), ("ordinary", "held", 2, True), ("silling", "stress", 2, False), ("wan", "released", 1, False),
    ("baqp", "released", 2, True), ("baqp", "stress", 2, True), ("projection", "released", 3, False), ("bond_augmented", "held", 2, False),
    ("sub_horizon", "stress", 2, False), ("bond_associated", "weakening", 2, True), ("selective baqp", "gradual", 2, False))
SMALL_PERIODS = (
    ("bond_based", "released", 2, True), ("ordinary", "released", 2, False), ("silling", "released", 2, True), ("baqp", "gradual", 2, False),
    ("baqp", "stretch", 2, True), ("non_spherical", "released", 2, False), ("sub_horizon", "held", 2, True), ("bond_associated", "stress", 2, True))
RANKED = (("bond_based", "released", False), ("baqp", "released", True), ("bond_associated", "stress", False))


def label(kinematics, criterion, dimension, cloud):
    return "%s, %s, %dD %s" % (kinematics, criterion, dimension, "cloud" if cloud else "lattice")


def going_on(runs, name):
    """The run of this name once more, killed after its first checkpoint: what goes on from there has the same bits."""
    out = os.path.join(runs.folder, name + " killed")
    command = [runs.program, "run", os.path.join(runs.folder, name + ".toml"), "-o", out, "--quiet", "--threads", "1", "--set", "output.checkpoint_every=2"]
    shutil.rmtree(out, ignore_errors=True)
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None and not os.path.exists(out + "/checkpoint.h5"):
        time.sleep(0.001)
    process.kill()
    process.wait()
    call(command + ["--resume"])
    runs.say(name + ", killed and resumed", difference(os.path.join(runs.folder, name), out))


def on_two_ranks(runs, kinematics, criterion, cloud):
    name = "p " + label(kinematics, criterion, 2, cloud) + ", ranks"
    period_and_two(runs, name, KINEMATICS[kinematics], CRITERIA[criterion], 2, cloud, shifted=False)
    folder = os.path.join(runs.folder, name + " 0")
    text = open(folder + ".toml").read()
    other = runs.run(name + " on two", text, 2)
    if other:
        runs.say(name + ", the same bits on two ranks", difference(folder, other))


if __name__ == "__main__":
    program, library, work, which = sys.argv[1:5]
    shutil.rmtree(work, ignore_errors=True)
    runs = Runs(program, work)
    every = list(itertools.product(KINEMATICS, CRITERIA, (1, 2, 3), (False, True)))
    halves, periods = (SMALL_HALVES, SMALL_PERIODS) if which == "small" else (every, every)
    for name, case, compare in [("h ", c, half_and_whole) for c in halves] + [("p ", c, period_and_two) for c in periods]:
        kinematics, criterion, dimension, cloud = case
        if kinematics in PAIRS and criterion == "stress":
            continue
        compare(runs, name + label(*case), KINEMATICS[kinematics], CRITERIA[criterion], dimension, cloud)
    going_on(runs, "h " + label(*SMALL_HALVES[4]) + " half")
    if os.path.exists(library) and shutil.which("mpirun"):
        for case in RANKED:
            on_two_ranks(runs, *case)
    print("%d failed" % len(runs.failed))
    sys.exit(1 if runs.failed else 0)
