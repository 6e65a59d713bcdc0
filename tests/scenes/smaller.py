"""A scene that fails is made smaller as long as it fails in the same way: sections and keys are removed, bodies and times halved."""

import copy
import time

from trial import Trial

NEEDED = ("format", "body", "family", "kinematics", "material", "integrator")


def candidates(scene):
    """Smaller scenes, those that lose most first."""
    for name in list(scene):
        if name not in NEEDED and name != "files":
            yield {key: value for key, value in scene.items() if key != name}
    for name, value in scene.items():
        if isinstance(value, list) and len(value) > 1 and isinstance(value[0], dict):
            for k in range(len(value)):
                yield {**scene, name: value[:k] + value[k + 1:]}
    for name, value in scene.items():
        if isinstance(value, dict) and name != "files":
            for key in value:
                if key != "type":
                    yield {**scene, name: {k: v for k, v in value.items() if k != key}}
                if isinstance(value[key], dict):
                    for inner in value[key]:
                        yield {**scene, name: {**value, key: {k: v for k, v in value[key].items() if k != inner}}}
        if isinstance(value, list) and value and isinstance(value[0], dict):
            for k, item in enumerate(value):
                for key in item:
                    changed = copy.deepcopy(value)
                    del changed[k][key]
                    yield {**scene, name: changed}
    for part in ("kinematics", "material"):
        if isinstance(scene[part], dict) and set(scene[part]) == {"type"}:
            yield {**scene, part: scene[part]["type"]}
    lattice = scene["body"].get("lattice")
    if lattice:
        for axis, (low, high) in enumerate(zip(lattice["lower"], lattice["upper"])):
            n = round((high - low) / lattice["spacing"])
            if n > 3:
                changed = copy.deepcopy(scene)
                changed["body"]["lattice"]["upper"][axis] = float("%.6g" % (low + (2 * n // 3) * lattice["spacing"]))
                yield changed
    if "end_time" in scene["integrator"]:
        yield {**scene, "integrator": {**scene["integrator"], "end_time": float("%.4g" % (0.5 * scene["integrator"]["end_time"]))}}


def smaller(program, tables, folder, scene, kind, seconds=60):
    began = time.time()
    going_on = True
    while going_on:
        going_on = False
        for candidate in candidates(scene):
            if time.time() - began > seconds:
                return scene
            try:
                findings = Trial(program, tables, folder, candidate, only=kind).try_scene()
            except (KeyError, TypeError, ValueError, OSError):
                continue
            if any(found == kind for found, _ in findings):
                scene, going_on = candidate, True
                break
    return scene
