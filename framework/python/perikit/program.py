"""Runs the program."""

import contextlib
import os
import pathlib
import shutil
import subprocess
import tempfile

from . import scene as toml
from .results import Results
from .study import Study


class RunFailed(RuntimeError):
    """The run began and did not come to its end; the message says why."""


class SceneRefused(ValueError):
    """The input was refused; the message says file, line, column, key, what was found and what is allowed."""


def program():
    """Path of the program: PERIKIT, or `perikit` on the search path. Raises FileNotFoundError."""
    found = os.environ.get("PERIKIT") or shutil.which("perikit")
    if not found:
        raise FileNotFoundError("no program 'perikit' on the search path; the variable PERIKIT may name it, e.g. build/release/bin/perikit of the repository")
    return found


def call(*words):
    result = subprocess.run([program(), *map(str, words)], capture_output=True, text=True)
    message = result.stderr.strip() or result.stdout.strip()
    if result.returncode == 2:
        raise SceneRefused(message)
    if result.returncode != 0:
        raise RunFailed(message)
    return result.stdout


def settings(overrides):
    return [word for key, value in (overrides or {}).items() for word in ("--set", f"{key}={toml.value(value)}")]


@contextlib.contextmanager
def scene_file(scene):
    """The file of a scene. Of a dictionary: one in the working directory, from which its names of files count, that is removed afterwards."""
    if not isinstance(scene, dict):
        yield scene
        return
    with tempfile.NamedTemporaryFile("w", dir=".", prefix="scene_", suffix=".toml", encoding="utf-8") as file:
        file.write(toml.text(scene))
        file.flush()
        yield os.path.relpath(file.name)


def check(scene, overrides=None):
    """What `perikit check` prints of a scene file or a dictionary: the resolved scene, sizes, memory, time step. Raises SceneRefused."""
    with scene_file(scene) as file:
        return call("check", file, *settings(overrides))


def run(scene, output=None, overrides=None, threads=None, options=()):
    """Runs a scene, a file or a dictionary, and opens its results.

    output: folder of the results; default: out/<name of the scene>. A dictionary has no name and needs one.
    overrides: values by key of the scene, {"constants.n": 8, "kinematics": {"type": "baqp"}}.
    options: further words of the command line, ("--resume",).
    Raises SceneRefused, RunFailed.
    """
    if output is None and isinstance(scene, dict):
        raise TypeError("perikit.run of a dictionary needs `output`, the folder of the results")
    output = pathlib.Path(output) if output else pathlib.Path("out") / pathlib.Path(scene).stem
    with scene_file(scene) as file:
        words = ["run", file, "-o", output, "--quiet", *settings(overrides), *options]
        call(*words, *(["--threads", threads] if threads else []))
    return Results(output)


def study(file, output=None, overrides=None, jobs=1, options=()):
    """Runs a study and opens its table.

    output, overrides, options: as in `run`; jobs: runs side by side.
    Raises SceneRefused and RunFailed; after the latter Study(output) opens what there is.
    """
    output = pathlib.Path(output) if output else pathlib.Path("out") / pathlib.Path(file).stem
    call("study", file, "-o", output, "--quiet", "--jobs", jobs, *settings(overrides), *options)
    return Study(output)
