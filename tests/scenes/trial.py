"""What every scene must come to, whatever it holds. A finding is (kind, words): the kind stays the same while a scene is made smaller."""

import os
import random
import re
import shutil

import numpy

from other_runs import kinds_for, try_other
from results import call, difference, frames, history, read, reference
from scene_text import scene_text, write_scene

FEW_STEPS = 30   # runs of fewer steps are too short to tell an unstable step from a coarse one
MPIRUN = ["mpirun", "--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1", "-np"]


def make_earlier_results(program, scene, folder):
    """Where the scene starts from results: those of the same body, deformed, in the folder that it names."""
    name = scene.get("initial", {}).get("from")
    if not name:
        return
    d = scene["body"]["dimension"]
    lattice = scene["body"].get("lattice")
    size = max(high - low for low, high in zip(lattice["lower"], lattice["upper"])) if lattice else 1.0
    waves = ["%r*sin(%r*x)" % (0.003 * size, 3 / size)] + [0.0] * (d - 1)
    kept = ("format", "constants", "body", "sets", "family", "kinematics", "material", "region", "files")
    earlier = {key: value for key, value in scene.items() if key in kept} | {"initial": {"displacement": waves}, "integrator": {"type": "evaluate"}}
    path = write_scene(earlier, os.path.join(folder, "earlier_scene"))
    call([program, "run", path, "-o", os.path.join(folder, os.path.dirname(name)), "--quiet"])


def without_digits(words):
    return re.sub(r"\d[\d.e+-]*", "#", words)


class Trial:
    """Runs a scene and collects findings. only: of the kinds of findings, the one that matters (a scene that is made smaller). others: how many of the
    other runs that make sense for the scene are tried, chosen by the scene; None: all of them."""

    def __init__(self, program, tables, folder, scene, only=None, others=2):
        self.program, self.tables, self.folder, self.scene, self.only, self.others = program, tables, folder, scene, only, others
        self.findings, self.words, self.status, self.seconds, self.imbalance = [], "", None, 0.0, 0.0

    def found(self, kind, words):
        self.findings.append((kind, words))

    def wants(self, kind):
        return self.only is None or self.only.startswith(kind)

    def command(self, out, settings, threads, ranks, options, path=None):
        sets = [word for setting in settings for word in ("--set", setting)]
        return [*(MPIRUN + [str(ranks)] if ranks > 1 else []), self.program, "run", path or self.path, "-o", out, "--quiet", "--threads", str(threads), *sets, *options]

    def run(self, name, *settings, threads=1, ranks=1, scene=None):
        """The scene, or another one, in a folder of this name. Returns how it ended, and the folder of the results."""
        out = os.path.join(self.folder, name)
        shutil.rmtree(out, ignore_errors=True)
        path = write_scene(scene, os.path.join(self.folder, name + "_scene")) if scene else None
        return call(self.command(out, settings, threads, ranks, [], path)), out

    def try_scene(self):
        shutil.rmtree(self.folder, ignore_errors=True)
        self.path = write_scene(self.scene, self.folder)
        make_earlier_results(self.program, self.scene, self.folder)
        checked = call([self.program, "check", self.path]) if self.wants("check") else None
        done, out = self.run("out")
        self.status, self.words, self.seconds = done.status, done.words, done.seconds
        if done.status not in (0, 1, 2):
            self.found("status %d" % done.status, done.first_line)
            return self.findings
        if checked and (checked.status == 0) != (done.status != 2):
            self.found("check", "check ends with %d, run with %d: %s" % (checked.status, done.status, checked.first_line or done.first_line))
        if done.status == 1:
            self.judge_failure(out, done)
        if done.status != 2:
            self.look_at_values(out)
            self.compare(out, done)
        return self.findings

    def judge_failure(self, out, done):
        with open(out + "/run.log") as file:
            if "allowed by allow_unstable" in file.read():   # a step that is too long for the body, as the scene asked for
                return
        reasons = {"energies do not add up": "energy guard", "error:.*(bug|internal)": "internal"}
        for pattern, kind in reasons.items():
            if re.search(pattern, done.words):
                self.found(kind, done.first_line)

    def compare(self, out, done):
        """The same bits with two threads and without skipping, and what else must give the same."""
        cases = {"threads": ((), 2), "skip": (("run.skip=false",), 1)}
        for kind, (settings, threads) in cases.items():
            if not self.wants("bits " + kind):
                continue
            if kind == "skip" and not self.scene.get("run", {}).get("skip", True):
                continue
            other, folder = self.run(kind, *settings, threads=threads)
            if other.status != done.status:
                self.found("bits " + kind, "status %d instead of %d: %s" % (other.status, done.status, other.first_line or done.first_line))
                continue
            words = difference(out, folder)
            if words:
                self.found("bits " + kind, words)
        for kind in self.other_kinds():
            self.findings += try_other(kind, self, out, done)

    def other_kinds(self):
        kinds = kinds_for(self.scene, os.path.exists(self.ranks_library()), self.only == "memory" or self.others is None)
        if self.only is not None:
            return [kind for kind in kinds if kind == self.only or self.only == "others"]
        if self.others is None:
            return kinds
        return random.Random(scene_text(self.scene)).sample(kinds, min(self.others, len(kinds)))

    def ranks_library(self):
        return os.path.join(os.path.dirname(os.path.dirname(os.path.realpath(self.program))), "lib", "libperikit_mpi.so")

    # -- values -------------------------------------------------------------------------------------------------------------------------------

    def look_at_values(self, out):
        with open(out + "/run.log") as log:
            told = re.findall(r"warning: frame \d+: (\w+) is not finite", log.read())
        for path in frames(out):
            for name, values in read(path)[0].items():
                if name not in told and not numpy.all(numpy.isfinite(values)):
                    self.found("not finite", "%s of frame %s" % (name, os.path.basename(path)))
                    return
        if self.scene["integrator"]["type"] == "verlet":
            self.look_at_energies(out)
            if self.wants("momentum"):
                self.look_at_momentum(out)

    def look_at_energies(self, out):
        rows = history(out)
        parts = [rows[name] for name in ("strain_energy", "kinetic_energy", "dissipated_energy", "external_work")]
        if not self.conservative() or self.bonds_create_energy(out):
            return
        if len(parts[0]) == 0:
            return   # it ended before its first row
        total = parts[0] + parts[1] + parts[2] - parts[3]
        off = numpy.max(numpy.abs(total - total[0]))
        largest = max(numpy.max(numpy.abs(part)) for part in parts)
        self.imbalance = off / largest if largest > 0 else 0.0
        if self.imbalance > 0.5 and len(total) >= FEW_STEPS:
            self.found("energy", "off by %.2g of the largest energy" % self.imbalance)

    def part_name(self, section):
        part = self.scene.get(section)
        return part.get("type") if isinstance(part, dict) else part

    def conservative(self):
        """Whether forces follow from an energy, by the documentation of the parts."""
        return "local" not in str(self.scene["kinematics"])

    def bonds_create_energy(self, out):
        """Whether bonds may fail that raise the stored energy, as the scene wants it, and have: the log says by how much."""
        if self.scene.get("damage", {}).get("second_law") is not False:
            return False
        with open(out + "/run.log") as log:
            return "raised the strain energy" in log.read()

    def look_at_momentum(self, out):
        """Where nothing is held: linear momentum, and angular momentum of parts that keep it."""
        scene = self.scene
        if any(section in scene for section in ("boundary", "load", "term", "symmetry", "periodic")) or not self.conservative():
            return
        body = reference(out)
        X, V, law = body["position"], body["volume"], body["material_id"].astype(int)
        laws = [scene["material"]] + [region["material"] for region in scene.get("region", [])]
        masses = V * self.densities(laws, law, X)
        states = []
        for path in frames(out):
            fields = read(path)[0]
            if "velocity" not in fields:
                return
            states.append((X + fields["displacement"], fields["velocity"]))
        if not states or self.rests(out):
            return
        size = numpy.max(X.max(axis=0) - X.min(axis=0))
        motion = max(numpy.sum(masses * numpy.linalg.norm(v, axis=1)) for _, v in states)
        if motion == 0:
            return
        linear = numpy.array([(masses[:, None] * v).sum(axis=0) for _, v in states])
        off = numpy.max(numpy.abs(linear - linear[0])) / motion
        if off > 1e-12 * max(10, len(states)):
            self.found("momentum linear", "changes by %.2g of sum m |v|" % off)
        centre = X.mean(axis=0)
        angular = numpy.array([(masses[:, None] * numpy.cross(y - centre, v)).sum(axis=0) for y, v in states])
        off = numpy.max(numpy.abs(angular - angular[0])) / (motion * size)
        if off > 1e-11 and self.keeps_angular_momentum():
            self.found("momentum angular", "changes by %.2g of sum m |v| times the size" % off)

    def rests(self, out):
        """Whether only rounding moves the body: velocities below 1e-12 of those that its energies could give, as where all that was stretched has torn at once."""
        rows = history(out)
        largest = max(numpy.max(numpy.abs(rows[name]), initial=0.0) for name in ("strain_energy", "dissipated_energy"))
        return numpy.max(rows["kinetic_energy"], initial=0.0) < 1e-24 * largest

    def keeps_angular_momentum(self):
        return "wan" not in str(self.scene["kinematics"]) and "linear_elastic" not in str([self.scene["material"]] + self.scene.get("region", []))

    def densities(self, laws, law, X):
        out = numpy.zeros(len(X))
        for k, part in enumerate(laws):
            density = part["density"]
            value = eval(density.replace("^", "**"), {}, dict(zip("xyz", X.T))) if isinstance(density, str) else density
            out = numpy.where(law == k, value, out)
        return out
