"""perikit from Python: run scenes with overrides, open results as arrays and tables, load studies.

    import perikit
    results = perikit.run("bar.toml", "out/bar", {"constants.n": 8, "integrator.steps": 5})
    u = results.field("displacement")            # (points, 3) [m], last frame
    time, force = results.history["time"], results.history["pull"]

Pure Python over numpy and h5py; runs are done by the program `perikit`, which PERIKIT names or the search path has.
"""

import importlib.util
import sys


def _require(packages, version=(3, 11)):
    """Says which packages this Python lacks and which Python it is, before an import deep inside says less."""
    python = f"{sys.executable} (Python {sys.version_info.major}.{sys.version_info.minor})"
    if sys.version_info < version:
        raise ImportError(f"perikit needs Python {version[0]}.{version[1]} or later; this is {python}")
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    if missing:
        raise ModuleNotFoundError(
            f"perikit needs {' and '.join(missing)}, which {python} does not have. Install perikit with what it needs, `{sys.executable} -m pip install "
            f"DIR` with DIR = framework/python of the repository, or use a Python that has them: on Debian /usr/bin/python3 with the packages "
            f"{' and '.join('python3-' + name for name in missing)}", name=missing[0])


_require(["numpy", "h5py"])

from .program import RunFailed, SceneRefused, check, run, study  # noqa: E402
from .results import Results  # noqa: E402
from .study import Study  # noqa: E402

__all__ = ["Results", "RunFailed", "SceneRefused", "Study", "check", "run", "study"]
