"""The Python module: arrays have the shapes and values that the scene implies, and errors are those of the program."""

import os
import pathlib
import tempfile
import tomllib

import numpy

import perikit

SCENE = """
format = 1
[constants]
n = 4
[body]
dimension = 2
plane = "stress"
[body.lattice]
spacing = "1/n"
lower = [0, 0]
upper = [2, 1]
[sets]
end = "x > 2 - 1/n"
[family]
horizon_ratio = 2.015
[kinematics]
type = "baqp"
[material]
type = "linear_elastic"
youngs_modulus = 1000.0
poisson_ratio = 0.25
[[boundary]]
face = "-x"
displacement = [0, "free"]
[[boundary]]
set = "end"
displacement = ["free", 0]
[[load]]
set = "end"
face = "+x"
traction = [1.0, 0]
[integrator]
type = "newton"
steps = 2
[output]
fields = ["displacement", "cauchy", "von_mises"]
history = [{ name = "pull", set = "end", quantity = "displacement", component = "x" }]
"""
STUDY = """
format = 1
scene = "bar.toml"
[values]
kinematics.type = ["baqp", "projection"]
constants.n = [2, 4]
[[quantity]]
name = "pull"
from = "pull"
reduce = "last"
reference = 2.0e-3
"""


def refused(action, error, *words):
    try:
        action()
    except error as e:
        assert all(word in str(e) for word in words), f"{e} names not all of {words}"
        return
    raise AssertionError(f"no {error.__name__}")


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    (folder / "bar.toml").write_text(SCENE, encoding="utf-8")
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")

    results = perikit.run(folder / "bar.toml", folder / "out", {"constants.n": 6, "integrator": {"type": "newton", "steps": 3}}, threads=1)
    points = 12 * 6
    assert results.position.shape == (points, 3) and results.volume.shape == (points,)
    assert numpy.isclose(results.volume.sum(), 2.0)
    assert results.frames[0] == 0 and numpy.isclose(results.times[-1], 1.0)
    assert list(results.sets) == ["end"] and len(results.sets["end"]) == 6
    assert results.field("displacement").shape == (points, 3)
    assert results.field("cauchy").shape == (points, 3, 3)
    assert numpy.allclose(results.field("cauchy")[:, 0, 0], 1.0, atol=0.05)
    assert numpy.array_equal(results.field("displacement", 0), numpy.zeros((points, 3)))
    assert numpy.array_equal(results.deformed(factor=0.0), results.position)
    columns = results.table()
    assert list(columns)[:4] == ["x", "y", "z", "volume"] and numpy.array_equal(columns["cauchy_xy"], results.field("cauchy")[:, 0, 1])
    assert len(results.history["pull"]) == 4 and numpy.isclose(results.history["time"][-1], 1.0)
    assert results.scene["constants"]["n"] == 6 and results.scene["integrator"]["steps"] == 3
    assert "newton" in results.log and "72 points" in repr(results)
    assert perikit.Results(folder / "out" / "results.h5").folder == folder / "out"

    study = perikit.study(folder / "study.toml", folder / "study")
    assert len(perikit.study(folder / "study.toml", folder / "study", jobs=2, options=["--resume"])) == 4
    assert len(study) == 4 and list(study["status"]) == ["done"] * 4
    fine = study.where(constants__n=4, kinematics__type="baqp")
    assert len(fine) == 1 and study["pull_error"][fine[0]] < 0.2
    assert study.results(fine[0]).scene["constants"]["n"] == 4

    # A dictionary is a scene, too: the same bits as its file, and a scene as it was run is one. Its names of files count from the working directory.
    os.chdir(folder)
    scene = tomllib.loads(SCENE)
    scene["constants"]["n"] = numpy.int64(6)
    scene["integrator"]["steps"] = 3
    scene["title"] = 'a "quoted" \\ title\nof two lines'
    again = perikit.run(scene, "out_dictionary", threads=1)
    assert numpy.array_equal(again.field("cauchy"), results.field("cauchy")) and again.scene["title"] == scene["title"]
    once_more = perikit.run(again.scene, "out_scene", threads=1)
    assert numpy.array_equal(once_more.field("cauchy"), results.field("cauchy"))
    rows = [f"{x},{y},0.0,{v}" for (x, y, _), v in zip(results.position, results.volume)]
    pathlib.Path("points.csv").write_text("x,y,z,volume\n" + "\n".join(rows) + "\n", encoding="utf-8")
    points_scene = {**scene, "body": {"dimension": 2, "plane": "stress", "points": {"file": pathlib.Path("points.csv")}}}
    assert "points" in perikit.check(points_scene) and "points.csv" in perikit.check(points_scene)
    assert not list(folder.glob("scene_*.toml"))
    refused(lambda: perikit.run(scene), TypeError, "output")
    refused(lambda: perikit.check({**scene, "title": None}), TypeError, "None")
    refused(lambda: perikit.check({**scene, "famly": scene["family"]}), perikit.SceneRefused, "famly", "family")

    assert "points" in perikit.check(folder / "bar.toml")
    refused(lambda: perikit.run(folder / "bar.toml", folder / "bad", {"material.poisson_ratio": 0.7}), perikit.SceneRefused, "poisson_ratio", "0.7")
    refused(lambda: perikit.run(folder / "bar.toml", folder / "bad", {"integrator.max_iterations": 1, "integrator.cut_backs": 0, "material.type": "hencky", "load.0.traction": [600.0, 0]}),
            perikit.RunFailed, "no equilibrium")
    refused(lambda: perikit.Results(folder / "nowhere"), FileNotFoundError, "nowhere")
    law = {"type": "hypoelastic", "youngs_modulus": 1000.0, "poisson_ratio": 0.25}
    remembering = perikit.run(folder / "bar.toml", folder / "remembering", {"constants.n": 4, "material": law, "output.fields": ["cauchy", "state:unrotated_stress", "state:work"]})
    assert remembering.fields() == ["cauchy", "state:unrotated_stress", "state:work"] and remembering.field("state:work").shape == (32,)
    stress = remembering.field("state:unrotated_stress")
    assert stress.shape == (32, 3, 3) and numpy.allclose(numpy.trace(stress, axis1=1, axis2=2), numpy.trace(remembering.field("cauchy"), axis1=1, axis2=2))
    assert numpy.array_equal(remembering.table()["state:unrotated_stress_xy"], stress[:, 0, 1])
    refused(lambda: remembering.field("state:wrok"), KeyError, "state:wrok", "state:work")
    refused(lambda: results.field("velocity"), KeyError, "velocity", "von_mises")
    refused(lambda: results.field("cauchy", 77), IndexError, "77")
    refused(lambda: results.field("cauchy", -77), IndexError, "-77")
    refused(lambda: results.history["pul"], KeyError, "pul", "history.csv", "strain_energy", "pull")
    refused(lambda: results.sets["tip"], KeyError, "tip", "end")
    refused(lambda: results.table()["cauchy"], KeyError, "cauchy_xx")
    refused(lambda: study["error"], KeyError, "error", "pull_error")
    refused(lambda: study.where(kinematics="baqp"), KeyError, "kinematics", "kinematics.type")
