"""What every scene must come to, whatever it holds. A finding is (kind, words): the kind stays the same while a scene is made smaller."""

import glob
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass

import numpy

try:
    import h5py
except ImportError:
    print("skipped: no h5py for " + sys.executable)
    sys.exit(77)

from scene_text import scene_text

SECONDS = 100   # of one run; scenes are small
FEW_STEPS = 30   # runs of fewer steps are too short to tell an unstable step from a coarse one
STATICS = ("newton", "jfnk", "kinsol", "dynamic_relaxation")


@dataclass
class Done:
    status: int
    words: str

    @property
    def first_line(self):
        lines = [line for line in self.words.split("\n") if line.strip()]
        return lines[0][:300] if lines else ""


def call(program, arguments):
    environment = dict(os.environ, OMP_WAIT_POLICY="passive")
    try:
        done = subprocess.run([program] + arguments, capture_output=True, text=True, errors="replace", timeout=SECONDS, env=environment)
    except subprocess.TimeoutExpired:
        return Done(-99, "still running after %d s" % SECONDS)
    return Done(done.returncode, done.stderr.strip() or done.stdout.strip())


def write_scene(scene, folder):
    os.makedirs(folder, exist_ok=True)
    for name, text in scene.get("files", {}).items():
        with open(os.path.join(folder, name), "w") as file:
            file.write(text)
    path = os.path.join(folder, "scene.toml")
    with open(path, "w") as file:
        file.write(scene_text(scene))
    return path


def frames(folder):
    return sorted(glob.glob(folder + "/frames/*.h5"))


def read(path):
    with h5py.File(path) as file:
        return {name: file[name][()] for name in file}, float(file.attrs["time"])


def history(folder):
    """The columns of history.csv, without those that measure what a run took."""
    with open(folder + "/history.csv") as file:
        names = file.readline().strip().split(",")
        rows = [line.strip().split(",") for line in file]
    return {name: numpy.array([float(row[k]) if row[k] else 0.0 for row in rows]) for k, name in enumerate(names)}


def without_digits(words):
    return re.sub(r"\d[\d.e+-]*", "#", words)


class Trial:
    """Runs a scene and collects findings. only: of the kinds of findings, the one that matters (a scene that is made smaller)."""

    def __init__(self, program, folder, scene, only=None):
        self.program, self.folder, self.scene, self.only = program, folder, scene, only
        self.findings, self.words, self.status, self.imbalance = [], "", None, 0.0

    def found(self, kind, words):
        self.findings.append((kind, words))

    def wants(self, kind):
        return self.only is None or self.only.startswith(kind)

    def run(self, name, *settings, threads=1):
        out = os.path.join(self.folder, name)
        shutil.rmtree(out, ignore_errors=True)
        sets = [word for setting in settings for word in ("--set", setting)]
        done = call(self.program, ["run", self.path, "-o", out, "--quiet", "--threads", str(threads)] + sets)
        return done, out

    def try_scene(self):
        shutil.rmtree(self.folder, ignore_errors=True)
        self.path = write_scene(self.scene, self.folder)
        checked = call(self.program, ["check", self.path]) if self.wants("check") else None
        done, out = self.run("out")
        self.status, self.words = done.status, done.words
        if done.status not in (0, 1, 2):
            self.found("status %d" % done.status, done.first_line)
            return self.findings
        if checked and (checked.status == 0) != (done.status != 2):
            self.found("check", "check ends with %d, run with %d: %s" % (checked.status, done.status, checked.first_line or done.first_line))
        if done.status == 1:
            self.judge_failure(done)
        if done.status != 2:
            self.look_at_values(out)
            self.compare(out, done)
        return self.findings

    def judge_failure(self, done):
        reasons = {"energies do not add up": "energy guard", "error:.*(bug|internal)": "internal"}
        for pattern, kind in reasons.items():
            if re.search(pattern, done.words):
                self.found(kind, done.first_line)

    def compare(self, out, done):
        """The same bits with two threads and without skipping; the same to rounding without sharing."""
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
            difference = self.difference(out, folder)
            if difference:
                self.found("bits " + kind, difference)

    def difference(self, one, other):
        if len(frames(one)) != len(frames(other)):
            return "%d frames instead of %d" % (len(frames(other)), len(frames(one)))
        for a, b in zip(frames(one), frames(other)):
            fields, others = read(a)[0], read(b)[0]
            for name in fields:
                if not numpy.array_equal(fields[name], others[name], equal_nan=True):
                    off = numpy.nanmax(numpy.abs(fields[name] - others[name]))
                    return "%s of frame %s by %.3g of %.3g" % (name, os.path.basename(a), off, numpy.nanmax(numpy.abs(fields[name])))
        return ""

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
        if not self.conservative():
            return
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

    def look_at_momentum(self, out):
        """Where nothing is held: linear momentum, and angular momentum of parts that keep it."""
        scene = self.scene
        if any(section in scene for section in ("boundary", "load", "symmetry", "periodic")) or not self.conservative():
            return
        with h5py.File(out + "/reference.h5") as file:
            X, V, law = file["position"][()], file["volume"][()], file["material_id"][()].astype(int)
        laws = [scene["material"]] + [region["material"] for region in scene.get("region", [])]
        masses = V * self.densities(laws, law, X)
        states = []
        for path in frames(out):
            fields, _ = read(path)
            if "velocity" not in fields:
                return
            states.append((X + fields["displacement"], fields["velocity"]))
        if not states:
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

    def keeps_angular_momentum(self):
        return "wan" not in str(self.scene["kinematics"]) and "linear_elastic" not in str([self.scene["material"]] + self.scene.get("region", []))

    def densities(self, laws, law, X):
        out = numpy.zeros(len(X))
        for k, part in enumerate(laws):
            density = part["density"]
            value = eval(density.replace("^", "**"), {}, dict(zip("xyz", X.T))) if isinstance(density, str) else density
            out = numpy.where(law == k, value, out)
        return out
