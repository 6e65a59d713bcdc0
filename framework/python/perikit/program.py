"""Runs the program."""

import os
import pathlib
import shutil
import subprocess

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
        raise FileNotFoundError("no program 'perikit' on the search path; the variable PERIKIT may name it")
    return found


def toml(value):
    """A Python value as TOML, for --set."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if hasattr(value, "tolist"):  # arrays and scalars of numpy
        return toml(value.tolist())
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    return repr(value)


def call(*words):
    result = subprocess.run([program(), *map(str, words)], capture_output=True, text=True)
    message = result.stderr.strip() or result.stdout.strip()
    if result.returncode == 2:
        raise SceneRefused(message)
    if result.returncode != 0:
        raise RunFailed(message)
    return result.stdout


def settings(overrides):
    return [word for key, value in (overrides or {}).items() for word in ("--set", f"{key}={toml(value)}")]


def check(scene, overrides=None):
    """What `perikit check` prints: the resolved scene, sizes, memory, time step. Raises SceneRefused."""
    return call("check", scene, *settings(overrides))


def run(scene, output=None, overrides=None, threads=None, options=()):
    """Runs a scene file and opens its results.

    output: folder of the results; default: out/<name of the scene>.
    overrides: values by key of the scene, {"constants.n": 8, "kinematics": {"type": "baqp"}}.
    options: further words of the command line, ("--resume",).
    Raises SceneRefused, RunFailed.
    """
    output = pathlib.Path(output) if output else pathlib.Path("out") / pathlib.Path(scene).stem
    words = ["run", scene, "-o", output, "--quiet", *settings(overrides), *options]
    call(*words, *(["--threads", threads] if threads else []))
    return Results(output)


def study(file, output=None, overrides=None, jobs=1):
    """Runs a study and opens its table. Raises SceneRefused, RunFailed (where no run came to its end)."""
    output = pathlib.Path(output) if output else pathlib.Path("out") / pathlib.Path(file).stem
    call("study", file, "-o", output, "--quiet", "--jobs", jobs, *settings(overrides))
    return Study(output)
