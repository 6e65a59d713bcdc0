"""perikit from Python: run scenes with overrides, open results as arrays and tables, load studies.

    import perikit
    results = perikit.run("bar.toml", "out/bar", {"constants.n": 8, "integrator.steps": 5})
    u = results.field("displacement")            # (points, 3) [m], last frame
    time, force = results.history["time"], results.history["pull"]

Pure Python over numpy and h5py; runs are done by the program `perikit`, which PERIKIT names or the search path has.
"""

from .program import RunFailed, SceneRefused, check, run, study
from .results import Results
from .study import Study

__all__ = ["Results", "RunFailed", "SceneRefused", "Study", "check", "run", "study"]
