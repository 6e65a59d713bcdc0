"""A scene in other coordinates and other units: mirrored, turned, shifted, in millimetres. Its results must be those of the scene, changed alike."""

import copy
import itertools
import math
import random
import re

import numpy

AXES = "xyz"
POSITIONS = ("lower", "upper", "nearest", "segment", "polygon")
UNITS = {"kg": (0, 1, 0), "m": (1, 0, 0), "s": (0, 0, 1), "N": (1, 1, -2), "Pa": (-1, 1, -2), "J": (2, 1, -2)}


class Change:
    """New coordinate i is length * sign[i] * old[source[i]] + shift[i]; masses and times are `mass` and `time` times as large."""

    def __init__(self, source, sign, shift, length=1.0, mass=1.0, time=1.0):
        self.source, self.sign, self.shift = list(source), list(sign), list(shift)
        self.length, self.mass, self.time = length, mass, time

    def factor(self, unit):
        """Of a number with this unit, e.g. kg/m^3."""
        out = 1.0
        above, *below = unit.split("/")
        for words, side in ((above, 1), *((part, -1) for part in below)):
            for word in re.split(r"[ *]+", words.strip()):
                match = re.match(r"([A-Za-z]+)(?:\^(\d+))?$", word)
                if match and match.group(1) in UNITS:
                    l, m, t = UNITS[match.group(1)]
                    out *= (self.length ** l * self.mass ** m * self.time ** t) ** (side * int(match.group(2) or 1))
        return out

    def expression(self, text, factor=1.0):
        """The same function of the new coordinates and of the new time."""
        old = {AXES[a]: "((%r)*(%s - (%r)))" % (self.sign[i] / self.length, AXES[i], self.shift[i]) for i, a in enumerate(self.source)}
        old["t"] = "(t/%r)" % self.time
        text = re.sub(r"\b[xyzt]\b", lambda name: old.get(name.group(), name.group()), text)
        return text if factor == 1.0 else "(%r)*(%s)" % (factor, text)

    def value(self, value, factor=1.0):
        if isinstance(value, bool):
            return value
        if isinstance(value, str):
            return self.expression(value, factor)
        return value * factor if factor != 1.0 else value

    def vector(self, values, factor=1.0):
        out = []
        for a, sign in zip(self.source, self.sign):
            out.append(values[a] if values[a] == "free" else self.value(values[a], sign * factor))
        return out

    def place(self, values):
        return [self.length * sign * values[a] + shift for a, sign, shift in zip(self.source, self.sign, self.shift)]

    def axis(self, name):
        """The new axis, and whether it points the other way: of "x" or "-x"."""
        i = self.source.index(AXES.index(name[-1]))
        if len(name) == 1:
            return AXES[i]
        sign = self.sign[i] * (1 if name[0] == "+" else -1)
        return ("+" if sign > 0 else "-") + AXES[i]

    def along(self, axis, value):
        """A coordinate along an axis of the old scene."""
        i = self.source.index(AXES.index(axis[-1]))
        return self.length * self.sign[i] * value + self.shift[i]

    # -- results ------------------------------------------------------------------------------------------------------------------------------

    def places(self, X):
        """Rows of three coordinates; those beyond the dimension stay 0."""
        out = numpy.zeros_like(X)
        for i, (a, sign, shift) in enumerate(zip(self.source, self.sign, self.shift)):
            out[:, i] = self.length * sign * X[:, a] + shift
        return out

    def vectors(self, v, factor):
        out = numpy.zeros_like(v)
        for i, (a, sign) in enumerate(zip(self.source, self.sign)):
            out[:, i] = factor * sign * v[:, a]
        return out


def random_change(kind, scene, seed):
    r, d = random.Random(seed), scene["body"]["dimension"]
    axes, ones = list(range(d)), [1.0] * d
    if kind == "units":
        length, mass, time = r.choice([(1000.0, 1e-3, 1.0), (100.0, 1000.0, 1e-3), (1e6, 1.0, 1e6)])
        return Change(axes, ones, [0.0] * d, length, mass, time if scene["integrator"]["type"] == "verlet" else 1.0)   # else t has no unit
    size = extent(scene)
    if kind == "shifted":
        return Change(axes, ones, [round(r.uniform(-3, 3), 2) * size for _ in axes])
    turns = [(order, signs) for order in itertools.permutations(axes) for signs in itertools.product((1.0, -1.0), repeat=d)]
    proper = lambda order, signs: numpy.linalg.det(numpy.eye(d)[list(order)] * numpy.array(signs)[:, None]) > 0
    wanted = [turn for turn in turns if proper(*turn) == (kind == "turned") and turn != (tuple(axes), tuple(ones))]
    if not wanted:
        return None
    order, signs = r.choice(wanted)
    return Change(order, signs, [0.0] * d)


def extent(scene):
    body = scene["body"]
    if "lattice" in body:
        return max(high - low for low, high in zip(body["lattice"]["lower"], body["lattice"]["upper"]))
    rows = numpy.array([[float(word) for word in line.split(",")] for line in scene["files"]["points.csv"].strip().split("\n")[1:]])
    return float(numpy.max(rows[:, :3].max(axis=0) - rows[:, :3].min(axis=0)))


def changed_scene(scene, change, tables, points):
    """The scene in the new coordinates and units, of a body with these points. Numbers are taken by the units of their keys, so that new keys need no line here."""
    out = copy.deepcopy(scene)
    section = {1: "area", 2: "thickness"}.get(scene["body"]["dimension"])
    if section:   # 1 unless given, in any unit
        out["body"].setdefault(section, 1.0)
    lattice = out["body"].get("lattice")
    if lattice:   # points lie from the lower corner on: a corner that becomes the lower one must be theirs, too, and so must planes that are not given
        cells = [round((high - low) / lattice["spacing"]) for low, high in zip(lattice["lower"], lattice["upper"])]
        lattice["upper"] = [low + n * lattice["spacing"] for low, n in zip(lattice["lower"], cells)]
        for plane in out.get("symmetry", []):
            a, h = AXES.index(plane["axis"]), lattice["spacing"]
            plane.setdefault("at", lattice["lower"][a] + h * math.floor((float(points[:, a].min()) - lattice["lower"][a]) / h))   # below the lowest cell
    for name, content in out.items():
        if name in tables.sections:
            for item in content if isinstance(content, list) else [content]:
                change_section(item, name, tables, change)
        if name in tables.parts:
            out[name] = [changed_part(item, name, tables, change) for item in content] if isinstance(content, list) else changed_part(content, name, tables, change)
    out["sets"] = {name: changed_set(value, change) for name, value in scene.get("sets", {}).items()}
    out.get("output", {}).pop("history", None)
    if "files" in out:
        out["files"] = {name: changed_points(text, change, scene["body"]["dimension"]) for name, text in out["files"].items()}
    return out


def changed_set(value, change):
    if isinstance(value, dict):
        return {key: change.place(content) if key == "nearest" else content for key, content in value.items()}
    return change.expression(value)


def changed_part(part, kind, tables, change):
    if not isinstance(part, dict):
        return part
    keys = tables.parts[kind].get(part["type"]).keys
    out = {}
    for name, value in part.items():
        if name in tables.parts and isinstance(value, dict):
            value = changed_part(value, name, tables, change)
        elif name == "base" and isinstance(value, dict):
            value = changed_part(value, "kinematics", tables, change)
        elif name in keys and isinstance(value, list) and "one for each dimension" in keys[name].allowed:
            value = change.vector(value, change.factor(keys[name].unit))
        elif name in keys and takes_numbers(keys[name]):
            value = change.value(value, change.factor(keys[name].unit))
        out[name] = value
    return out


def takes_numbers(key):
    return re.match(r"an? (list of )?number", key.allowed) is not None


def change_section(item, name, tables, change):
    if not isinstance(item, dict):
        return
    keys = tables.sections[name].keys
    for key in list(item):
        value = item[key]
        sub = "%s.%s" % (name, key)
        if sub in tables.sections and isinstance(value, dict):
            change_section(value, sub, tables, change)
        elif key in tables.parts:
            item[key] = changed_part(value, key, tables, change)
        elif key in ("segment", "polygon"):
            item[key] = [change.place(corner) for corner in value]
        elif key in POSITIONS and isinstance(value, list):
            item[key] = change.place(value)
        elif key in ("face", "axis"):
            continue
        elif key in ("at", "lower", "upper") and ("face" in item or "axis" in item):
            item[key] = change.along(item.get("face") or item["axis"], value)
        elif key in keys:
            factor = change.factor(keys[key].unit)
            if isinstance(value, list) and "one for each dimension" in keys[key].allowed:
                item[key] = change.vector(value, factor)
            elif isinstance(value, list) and takes_numbers(keys[key]):
                item[key] = [change.value(number, factor) for number in value]
            elif takes_numbers(keys[key]):
                item[key] = change.value(value, factor)
    for key in ("face", "axis"):
        if key in item:
            item[key] = change.axis(item[key])
    in_order(item)


def in_order(item):
    """What was lower lies above in a mirror."""
    low, high = item.get("lower"), item.get("upper")
    if isinstance(low, list) and isinstance(high, list):
        item["lower"], item["upper"] = [min(pair) for pair in zip(low, high)], [max(pair) for pair in zip(low, high)]
    elif low is not None and high is not None:
        item["lower"], item["upper"] = min(low, high), max(low, high)


def with_places_of_points(scene, X):
    """Sets of points by their numbers, which are others in a lattice that is turned, as sets of what is near their places."""
    out = copy.deepcopy(scene)
    if "lattice" in scene["body"]:
        near = (0.01 * scene["body"]["lattice"]["spacing"]) ** 2
        for name, value in out.get("sets", {}).items():
            if isinstance(value, dict) and "points" in value:
                squares = [" + ".join("(%s - (%r))^2" % pair for pair in zip(AXES, X[k][:scene["body"]["dimension"]].tolist())) for k in value["points"]]
                out["sets"][name] = " || ".join("%s < %r" % (square, near) for square in squares)
    return out


def changed_points(text, change, dimension):
    head, *lines = text.strip().split("\n")
    rows = []
    for line in lines:
        x, y, z, *volume = (float(word) for word in line.split(","))
        place = change.place([x, y, z][:dimension]) + [0.0] * (3 - dimension)
        rows.append(",".join(repr(number) for number in place + [change.length ** 3 * v for v in volume]))
    return "\n".join([head] + rows) + "\n"


def reordered(scene, seed):
    """The points of the file in another order; sets of points by their numbers follow. Returns the scene and where each of its points was."""
    out = copy.deepcopy(scene)
    head, *lines = scene["files"]["points.csv"].strip().split("\n")
    order = list(range(len(lines)))
    random.Random(seed).shuffle(order)
    out["files"]["points.csv"] = "\n".join([head] + [lines[k] for k in order]) + "\n"
    for value in out.get("sets", {}).values():
        if isinstance(value, dict) and "points" in value:
            value["points"] = sorted(order.index(k) for k in value["points"])
    return out, order
