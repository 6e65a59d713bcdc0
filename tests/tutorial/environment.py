"""A virtual environment into which the Python module is installed as its page says, without a network. The packages that it needs are those of the
system, which the environment sees.

    environment.py FOLDER SOURCE PROGRAM     makes one anew and tries the module in it; status 77 where the system lacks what that takes
"""

import fcntl
import hashlib
import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
SKIPPED = 77


def what_is_missing():
    """Why no environment can be made here; empty where one can."""
    packages = {"venv": "python3-venv", "ensurepip": "python3-venv", "wheel": "python3-wheel", "numpy": "python3-numpy", "h5py": "python3-h5py"}
    missing = {package for module, package in packages.items() if importlib.util.find_spec(module) is None}
    return f"{sys.executable} lacks {', '.join(sorted(missing))}" if missing else ""


def do(*words, **more):
    result = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
    if result.returncode != 0:
        sys.exit(f"status {result.returncode} of {' '.join(map(str, words))}\n{result.stdout}")
    return result.stdout


def without_python_path():
    return {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}


def make(folder, source):
    """The interpreter of a new environment in `folder`. The sources are copied first, since a build leaves its files beside them."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(source, folder / "source", ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    do(sys.executable, "-m", "venv", "--system-site-packages", folder / "environment")
    python = folder / "environment" / "bin" / "python"
    do(python, "-m", "pip", "install", "--no-build-isolation", "--no-deps", "--disable-pip-version-check", folder / "source", env=without_python_path())
    return python


def interpreter(folder, source):
    """The interpreter of an environment with these sources, made where there is none yet; None where none can be made. Several tests may ask at once."""
    if what_is_missing():
        return None
    folder, source = pathlib.Path(folder), pathlib.Path(source)
    folder.mkdir(parents=True, exist_ok=True)
    files = sorted([source / "pyproject.toml", *(source / "perikit").glob("*.py")])
    digest = hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()[:16]
    with open(folder / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        python, made = folder / "made" / "environment" / "bin" / "python", folder / "digest"
        if not (python.exists() and made.exists() and made.read_text() == digest):
            made.unlink(missing_ok=True)
            make(folder / "made", source)
            made.write_text(digest)
    return python


def main(folder, source, program):
    if reason := what_is_missing():
        print("skipped:", reason)
        sys.exit(SKIPPED)
    folder = pathlib.Path(folder).resolve()
    python = make(folder, source)
    environment = without_python_path() | {"PERIKIT": str(program), "OMP_WAIT_POLICY": "passive"}
    print(do(python, HERE / "module.py", env=environment, cwd=folder))
    where = do(python, "-c", "import perikit; print(perikit.__file__)", env=environment, cwd=folder)
    assert str(folder / "environment") in where, f"another module than the installed one: {where}"
    version = do(python, "-c", "import importlib.metadata as m; print(m.version('perikit'), *sorted(m.requires('perikit')))", env=environment, cwd=folder).split()
    assert version[1:] == ["h5py", "numpy"] and version[0] in do(program, "--version").split(), f"version and needs of the module: {version}"

    # An interpreter without the packages: the message names them and the interpreter.
    do(sys.executable, "-m", "venv", "--without-pip", folder / "bare")
    bare = folder / "bare" / "bin" / "python"
    result = subprocess.run([bare, "-c", "import perikit"], env=without_python_path() | {"PYTHONPATH": str(source)}, capture_output=True, text=True)
    message = result.stderr.splitlines()[-1]
    assert result.returncode == 1 and all(word in message for word in ("numpy and h5py", str(bare), "pip install", "python3-numpy and python3-h5py")), message


if __name__ == "__main__":
    main(*sys.argv[1:])
