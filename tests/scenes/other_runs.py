"""The same scene run in another way, or said in another way, whose results must be the same: on several ranks, after a kill, with its points in another order,
mirrored, turned, shifted, in other units, by another solver."""

import copy
import os
import random
import re
import shutil
import signal
import subprocess
import time

import numpy

from change import changed_scene, random_change, reordered, with_places_of_points
from conditions import STATICS
from results import ENVIRONMENT, call, difference, final_values, frames, history, history_difference, read, reference
from scene_text import write_scene

ROUNDING = 1e-7       # of the largest value of a field: rounding that a run has made larger
TORN = 1e-5           # where bonds fail
MOST_STEPS = 150      # on several ranks, which wait for each other on a busy machine
SMALL = 80           # MB: below that it is the program itself, or the Python that started it
SOLVED = 1e-4         # equilibria found by different solvers


def kinds_for(scene, several_ranks, larger_bodies):
    """Those that make sense for this scene."""
    kinds = ["killed"]
    integrator = scene["integrator"]["type"]
    explicit = integrator in ("verlet", "evaluate")
    if several_ranks and explicit:
        kinds += ["ranks 2", "ranks 3", "killed, other ranks"]
    if integrator == "evaluate":
        kinds = [kind for kind in kinds if "killed" not in kind]
    going_on = "from" in scene.get("initial", {})   # of results of the same points in the same order and place
    if "files" in scene and not going_on:
        kinds.append("order")
    branching = integrator in STATICS and "damage" in scene   # rounding may choose which of several equilibria is found
    if not (branching or scene["body"].get("lattice", {}).get("jitter") or going_on):
        kinds += ["mirrored", "shifted", "units"] + (["turned"] if scene["body"]["dimension"] > 1 else [])
    if integrator in STATICS and not any(section in scene for section in ("damage", "crack")):
        kinds.append("solvers")
    if larger_bodies and "lattice" in scene["body"]:
        kinds.append("memory")
    return kinds


def try_other(kind, trial, out, done):
    """Findings of one kind, as (kind, words)."""
    if kind.startswith("ranks"):
        words = several_ranks(trial, out, done, int(kind[-1]))
    elif kind.startswith("killed"):
        words = killed(trial, out, done, other_ranks="other" in kind)
    elif kind == "order":
        words = other_order(trial, out, done)
    elif kind == "solvers":
        words = other_solvers(trial, out, done)
    elif kind == "memory":
        words = memory(trial)
    else:
        words = changed(kind, trial, out, done)
    return [(kind, words)] if words else []


def status_words(other, done):
    return "status %d instead of %d: %s" % (other.status, done.status, other.first_line or done.first_line)


def several_ranks(trial, out, done, ranks):
    if len(history(out)["time"]) > MOST_STEPS:
        return ""
    other, folder = trial.run("ranks", ranks=ranks)
    if too_few_points(other):
        return ""
    if other.status != done.status:
        return status_words(other, done)
    return difference(out, folder) or history_difference(out, folder)


def too_few_points(done):
    return "fewer blocks" in done.words or "blocks of points" in done.words


# -- kills ------------------------------------------------------------------------------------------------------------------------------------


def of_session(session):
    """Processes of a session: mpirun gives each rank a group of its own."""
    found = []
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            if os.getsid(int(name)) == session:
                found.append(int(name))
        except ProcessLookupError:
            pass
    return found


def kill_session(process):
    """Kills the ranks and mpirun at once; ranks that outlive it for a moment would still hold the folder."""
    if process.poll() is None:
        for pid in of_session(process.pid):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
    process.wait()
    while of_session(process.pid):
        time.sleep(0.01)


def killed(trial, out, done, other_ranks):
    """A run with checkpoints that is killed at a random moment and goes on, there or on another number of ranks, has the bits of one without a stop."""
    if other_ranks and len(history(out)["time"]) > MOST_STEPS:
        return ""
    r = random.Random(str(trial.scene))
    folder = os.path.join(trial.folder, "killed")
    shutil.rmtree(folder, ignore_errors=True)
    ranks = (r.choice([1, 2]), r.choice([2, 3])) if other_ranks else (1, 1)
    setting = "output.checkpoint_every=%d" % r.choice([1, 3, 7])
    command = trial.command(folder, [setting], 1, ranks[0], [])
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=ENVIRONMENT, start_new_session=True)
    until = time.time() + 20
    while process.poll() is None and not os.path.exists(folder + "/checkpoint.h5") and time.time() < until:
        time.sleep(0.002)
    time.sleep(r.uniform(0, 0.05))
    kill_session(process)
    other = call(trial.command(folder, [setting], 1, ranks[1], ["--resume"]))
    if too_few_points(other):
        return ""
    if "nothing to do" in other.words or "finished" in other.words:
        other.status = done.status
    if other.status != done.status:
        return status_words(other, done)
    return difference(out, folder) or history_difference(out, folder)


# -- the same, said otherwise -----------------------------------------------------------------------------------------------------------------


def with_steps_of(scene, out, time=1.0):
    """With the time step of the run in `out`: its estimate begins with a motion that depends on the numbers of points, and is a little other in each
    order and mirror."""
    steps = history(out)["time_step"]
    if scene["integrator"]["type"] != "verlet" or len(steps) == 0:
        return scene
    rest = {key: value for key, value in scene["integrator"].items() if key not in ("safety", "estimate", "check_every")}
    return {**scene, "integrator": {**rest, "time_step": float(steps[0]) * time, "allow_unstable": True}}


def planned_anew(out):
    """Whether a run has shortened its steps on the way: with those that it began with, another one may come to another end."""
    steps = history(out)["time_step"]
    return len(steps) > 0 and numpy.min(steps) < (1 - 1e-9) * steps[0]


def other_order(trial, out, done):
    scene, order = reordered(trial.scene, str(trial.scene))
    scene = with_steps_of(scene, out)
    other, folder = trial.run("order", scene=scene)
    if other.status != done.status:
        return "" if planned_anew(out) else status_words(other, done)
    return mapped_difference(trial, out, folder, numpy.array(order), lambda name, values: values)


def changed(kind, trial, out, done):
    change = random_change(kind, trial.scene, str(trial.scene))
    if change is None or unstable(out):
        return ""
    points = reference(out)["position"]
    scene = with_steps_of(changed_scene(with_places_of_points(trial.scene, points), change, trial.tables, points), out, change.time)
    other, folder = trial.run(kind, scene=scene)
    if other.status != done.status:
        return "" if planned_anew(out) else status_words(other, done)
    X, Y = change.places(points), reference(folder)["position"]
    places = pairing(X, Y)
    if places is None:
        return "other points"
    factors = {"displacement": change.length, "velocity": change.length / change.time}

    def value(name, values):
        if name in factors:
            return change.vectors(values, factors[name])
        if name == "strain_energy_density":
            return values * change.factor("Pa")
        return values if name in ("damage", "jacobian", "material_id") else None

    return mapped_difference(trial, out, folder, places, value, change.time)


def unstable(folder):
    """Whether rounding says where the body goes, whose equilibria are no minima of the energy, or which side a point is on; or which of several equilibria is
    found, as where a law for small strains is strained beyond a half under a load that follows."""
    with open(folder + "/run.log") as file:
        log = file.read()
    strained = [float(most) for most in re.findall(r"strains or rotations were not small in .*, at most (\S+) at", log)]
    return re.search("warning:.*(stable|positive definite)|warning.*(rounding decides|passes through points)", log) is not None or max(strained, default=0) > 0.5


def pairing(X, Y):
    """For each row of Y the row of X at the same place."""
    if X.shape != Y.shape:
        return None
    size = numpy.max(X.max(axis=0) - X.min(axis=0)) or 1.0
    grid = lambda Z: numpy.round((Z - X.min(axis=0)) / (1e-6 * size) + 0.25).astype(numpy.int64)
    one, other = grid(X), grid(Y)
    a, b = numpy.lexsort(one.T), numpy.lexsort(other.T)
    if numpy.max(numpy.abs(one[a] - other[b])) > 1:   # neighbours may change places by rounding
        from_places = {tuple(row): k for k, row in enumerate(one)}
        found = [next((from_places[near] for near in around(row) if near in from_places), -1) for row in other]
        return numpy.array(found) if min(found) >= 0 else None
    places = numpy.empty(len(a), int)
    places[b] = a
    return places


def around(row):
    x, y, z = row
    return [(x + i, y + j, z + k) for i in (0, -1, 1) for j in (0, -1, 1) for k in (0, -1, 1)]


def rounding_energy(scene):
    """The energy density of strains of 1e-12, which is rounding where a body moves without being deformed."""
    material = scene["material"] if isinstance(scene["material"], dict) else {}
    moduli = [value for key, value in material.items() if ("modulus" in key or "lambda" in key) and isinstance(value, (int, float))]
    return 1e-24 * max(moduli, default=0.0)


def held(trial, fields):
    """The points that equilibrium says the place of: not those that hang by a bond or two."""
    torn = trial.scene["integrator"]["type"] in STATICS and "damage" in fields
    return fields["damage"] < 0.9 if torn else slice(None)


def balance(folder):
    """How many points of a cloud have been balanced, and in how many rounds. Where families are too small for all of them, rounding chooses what gives way."""
    with open(folder + "/run.log") as file:
        return re.findall(r"(\d+ points balanced, \d+ more|weights in \d+ rounds)", file.read())


def mapped_difference(trial, out, folder, places, value, time=1.0):
    """Row k of the fields in `folder` against row places[k] of those in `out`; nothing where the steps were planned anew on the way."""
    times, others = (history(of)["time"] for of in (out, folder))
    if len(times) != len(others) or numpy.max(numpy.abs(others - time * times), initial=0.0) > 1e-9 * time * numpy.max(times, initial=0.0):
        return ""
    if balance(out) != balance(folder):
        return ""
    if len(frames(out)) != len(frames(folder)):
        return "%d frames instead of %d" % (len(frames(folder)), len(frames(out)))
    allowed = SOLVED if trial.scene["integrator"]["type"] in STATICS else TORN if "damage" in trial.scene else ROUNDING
    largest = {}
    for path in frames(out):
        for name, values in read(path)[0].items():
            largest[name] = max(largest.get(name, 0.0), float(numpy.nanmax(numpy.abs(values), initial=0.0)))
    for a, b in zip(frames(out), frames(folder)):
        fields, others = read(a)[0], read(b)[0]
        for name in ("displacement", "velocity", "strain_energy_density", "damage", "jacobian", "material_id"):
            if name not in fields or name not in others:
                continue
            expected = value(name, fields[name])
            if expected is None:
                continue
            scale = largest[name] * (numpy.max(numpy.abs(value(name, numpy.ones_like(fields[name])))) or 1.0)
            off = numpy.nanmax(numpy.abs(others[name] - expected[places])[held(trial, others)], initial=0.0)
            if name == "strain_energy_density" and off < rounding_energy(trial.scene):
                continue
            if off > allowed * scale:
                return "%s of frame %s by %.3g of %.3g" % (name, os.path.basename(a), off, scale)
    return ""


# -- statics ----------------------------------------------------------------------------------------------------------------------------------


def other_solvers(trial, out, done):
    """Every solver, and damped dynamics, finds the same equilibrium of the whole load."""
    if done.status != 0 or unstable(out):
        return ""
    found = {}
    for solver in STATICS:
        scene = dict(trial.scene, integrator={"type": solver, "tolerance": 1e-8, "steps": trial.scene["integrator"].get("steps", 2)})
        other, folder = trial.run("solver", scene=scene)
        if other.status == 0 and not unstable(folder):
            found[solver] = final_values(folder)["displacement"]
    for solver, values in found.items():
        first, u = next(iter(found.items()))
        off, scale = numpy.max(numpy.abs(values - u)), numpy.max(numpy.abs(u))
        if off > SOLVED * scale:
            return "%s and %s differ by %.3g of %.3g" % (first, solver, off, scale)
    return ""


# -- memory -----------------------------------------------------------------------------------------------------------------------------------


def memory(trial):
    """What `check` says of the memory of a larger body is what a few steps of it take."""
    scene = copy.deepcopy(trial.scene)
    lattice, integrator = scene["body"]["lattice"], scene["integrator"]
    points = numpy.prod([(high - low) / lattice["spacing"] for low, high in zip(lattice["lower"], lattice["upper"])])
    finer = round(((20000 if integrator["type"] in ("verlet", "evaluate") else 2500) / points) ** (1 / scene["body"]["dimension"]))
    if finer < 2:
        return ""
    lattice["spacing"] /= finer
    if "horizon" in scene["family"]:
        scene["family"]["horizon"] /= finer
    if "end_time" in integrator:
        integrator["end_time"] /= 100
    if "steps" in integrator:
        integrator["steps"] = 1
    for section in ("damage", "interface"):
        scene.pop(section, None)
    checked = call([trial.program, "check", write_scene(scene, os.path.join(trial.folder, "memory_scene"))])
    said = re.search(r"# process\s+about ([\d.]+) (MB|GB)", checked.words)
    other, _ = trial.run("memory", scene=scene)
    if checked.status != 0 or other.status != 0 or not said or other.memory < SMALL:
        return ""
    expected = float(said.group(1)) * (1000 if said.group(2) == "GB" else 1)
    if not other.memory / 1.5 < expected < other.memory * 1.5:
        return "check says %.0f MB, the run took %.0f" % (expected, other.memory)
    return ""
