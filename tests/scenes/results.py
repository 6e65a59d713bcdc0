"""Runs of the program, and what their folders hold."""

import glob
import os
import subprocess
import sys
import tempfile
import threading
from dataclasses import dataclass

import numpy

try:
    import h5py
except ImportError:
    print("skipped: no h5py for " + sys.executable)
    sys.exit(77)

SECONDS = 300   # of one run; scenes are small, but ranks wait for each other on a busy machine
ENVIRONMENT = dict(os.environ, OMP_WAIT_POLICY="passive", OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")


@dataclass
class Done:
    status: int
    words: str
    seconds: float = 0.0   # of processor time
    memory: float = 0.0    # MB, the most that the process had

    @property
    def first_line(self):
        lines = [line for line in self.words.split("\n") if line.strip()]
        return lines[0][:300] if lines else ""


def call(command):
    """Runs a command, with what it took."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = subprocess.Popen(command, stdout=out, stderr=err, stdin=subprocess.DEVNULL, env=ENVIRONMENT)
        timer = threading.Timer(SECONDS, process.kill)
        timer.start()
        _, status, used = os.wait4(process.pid, 0)
        late = not timer.is_alive()
        timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        words = []
        for file in (err, out):
            file.seek(0)
            words.append(file.read().decode(errors="replace").strip())
    if late:
        return Done(-99, "still running after %d s" % SECONDS)
    return Done(process.returncode, words[0] or words[1], used.ru_utime + used.ru_stime, used.ru_maxrss / 1000)


def frames(folder):
    return sorted(glob.glob(folder + "/frames/*.h5"))


def read(path):
    with h5py.File(path) as file:
        return {name: file[name][()] for name in file}, float(file.attrs["time"])


def reference(folder):
    with h5py.File(folder + "/reference.h5") as file:
        return {name: file[name][()] for name in ("position", "volume", "material_id")}


def final_values(folder):
    return read(frames(folder)[-1])[0]


def history(folder):
    """The columns of history.csv."""
    with open(folder + "/history.csv") as file:
        names = file.readline().strip().split(",")
        rows = [line.strip().split(",") for line in file]
    return {name: numpy.array([float(row[k]) if row[k] else 0.0 for row in rows]) for k, name in enumerate(names)}


def difference(one, other):
    """Where the frames of two folders have other bits, in words."""
    if len(frames(one)) != len(frames(other)):
        return "%d frames instead of %d" % (len(frames(other)), len(frames(one)))
    for a, b in zip(frames(one), frames(other)):
        fields, others = read(a)[0], read(b)[0]
        for name in fields:
            if not numpy.array_equal(fields[name], others[name], equal_nan=True):
                off = numpy.nanmax(numpy.abs(fields[name] - others[name]))
                return "%s of frame %s by %.3g of %.3g" % (name, os.path.basename(a), off, numpy.nanmax(numpy.abs(fields[name])))
    return ""


def history_difference(one, other):
    with open(one + "/history.csv") as a, open(other + "/history.csv") as b:
        lines, others = a.read().split("\n"), b.read().split("\n")
    names = lines[0].split(",")
    if len(lines) != len(others):
        return "%d rows of history instead of %d" % (len(others), len(lines))
    for line, there in zip(lines, others):
        if line != there:
            return "history: " + "; ".join("%s %s for %s" % row for row in zip(names, there.split(","), line.split(",")) if row[1] != row[2])[:200]
    return ""
