"""Random boundaries, loads, planes of symmetry, periodic sides and initial values."""

import random

from bodies import Bodies
from draws import AXES, rounded

STATICS = ("newton", "jfnk", "kinsol", "dynamic_relaxation")


class Conditions(Bodies):
    @property
    def dynamic(self):
        return self.integrator_name == "verlet"

    @property
    def statics(self):
        return self.integrator_name in STATICS

    def number(self, value):
        """A number, or an expression of a constant of the scene."""
        if not self.maybe(0.1, "constants"):
            return rounded(value)
        name = "half_%d" % (len(self.constants) + 1)
        self.constants[name] = rounded(value / 2)
        return "2*" + name

    # -- functions of time and place ------------------------------------------------------------------------------------------------------------

    def course(self, amplitude, steady=True):
        """A function of time from 0 to the end of the run, which may depend on the place. steady: it may be there from the start."""
        T = self.end_time if self.dynamic else 1.0
        value = "%.6g" % amplitude
        kinds = [value, "%s*t/%.6g" % (value, T), "%s*(t/%.6g)^2" % (value, T), "%s*sin(%.6g*t)" % (value, 6.28 / T),
                 "t < %.6g ? %s*t/%.6g : %s" % (0.3 * T, value, 0.3 * T, value)]
        course = self.random.choice((kinds if steady else kinds[1:]) if self.dynamic else kinds[:3])
        if course == value:
            course = self.number(amplitude)
        if self.maybe(0.15):
            axis = self.random.randrange(self.dimension)
            course = "(%s)*(1 + 0.3*(%s - (%.6g))/%.6g)" % (course, AXES[axis], self.lower[axis], self.size)
        return course

    def shape(self, amplitude):
        """A smooth function of the place."""
        waves = ["%.5g*%s" % (self.between(-4, 4) / self.size, axis) for axis in self.axes]
        return "%.6g*sin(%s + %.3g)" % (amplitude * self.random.choice([-1, 1]), " + ".join(waves), self.between(0, 6))

    def stretching(self, amplitude):
        """Displacements of a side that is stretched and sheared as a whole."""
        rows = []
        for axis in range(self.dimension):
            slopes = ["%.6g*(%s - (%.6g))" % (amplitude / self.size * self.between(-1, 1), name, low) for name, low in zip(self.axes, self.lower)]
            rows.append("(%s)*t/%.6g" % (" + ".join(slopes), self.end_time if self.dynamic else 1.0))
        return rows

    def face(self, side):
        return ("-" if side == "low" else "+") + AXES[self.axis]

    def place(self, side):
        return (self.lower if side == "low" else self.upper)[self.axis]

    # -- conditions -----------------------------------------------------------------------------------------------------------------------------

    def conditions(self, scene):
        r, d, wished = self.random, self.dimension, self.wishes.get("condition")
        amplitude = self.strain * self.size
        mirrors = self.mirrors(wished == "symmetry")
        if mirrors:
            scene["symmetry"] = [{"axis": AXES[axis]} | ({"at": self.lower[axis]} if self.cloud or self.maybe(0.3, "symmetry.at") else {}) for axis in mirrors]
        periodic = self.periodic_axes(mirrors, wished == "periodic")
        if periodic:
            scene["periodic"] = [{"axis": AXES[axis]} | ({"lower": self.lower[axis], "upper": self.upper[axis]} if self.cloud or self.maybe(0.3) else {})
                                 for axis in periodic]
        taken = set(mirrors + periodic)
        held = self.statics or self.maybe(0.35) or wished == "boundary"
        driven = held and not taken and self.maybe(0.12)
        boundaries, loads = [], []
        if driven:
            boundaries.append({"set": "rim", "displacement": self.stretching(amplitude)})
        elif held and self.axis not in taken:
            boundaries += self.supports(taken)
        ends_free = self.axis not in periodic and not driven
        if held and ends_free and self.maybe(0.5):
            boundaries.append(self.pulled(amplitude))
        if ends_free and (held and len(boundaries) < 2 or self.maybe(0.2) or wished == "load"):
            loads.append(self.load())
        if self.maybe(0.1):
            loads.append({"set": r.choice(["all", "part"]), "body_force": [self.course(self.E * self.strain / self.size * self.between(-1, 1)) for _ in range(d)]})
        if self.maybe(0.05, "initial.from") and not (self.dynamic and boundaries):
            scene["initial"] = {"from": "earlier/results.h5"}
        elif not self.statics:
            scene["initial"] = self.initial(amplitude, bool(boundaries), bool(loads))
        elif self.maybe(0.05):
            scene["initial"] = {"displacement": [self.shape(0.02 * amplitude) for _ in range(d)]}
        if self.statics:
            for condition in boundaries + loads:
                if self.maybe(0.15, "load.ramp"):
                    condition["ramp"] = self.maybe(0.3)
        if boundaries:
            scene["boundary"] = boundaries
        if loads:
            scene["load"] = loads

    def terms(self):
        """A foundation of about the stiffness of the body, which may grow. Drawn apart, so that all else of a seed is what it was."""
        r = random.Random("terms of %s" % self.seed)
        if r.random() > 0.12 and not self.wishes_key("term.set"):
            return []
        stiffness = rounded(self.E / self.size ** 2 * 10 ** r.uniform(-1, 1))
        end = self.end_time if self.integrator_name == "verlet" else 1.0
        term = {"type": "foundation", "set": r.choice(["all", "low", "part"]), "stiffness": r.choice([stiffness, "%.6g*(1 + t/%.6g)" % (stiffness, end)])}
        if r.random() < 0.5:
            term["normal"] = [rounded(r.uniform(0.1, 1) * r.choice([-1, 1])) for _ in range(self.dimension)]
        return [term]

    def mirrors(self, wished):
        """Axes of planes of symmetry, which may meet. In statics either all axes or none that the ends lie on: the rest stays held there."""
        if not wished and not self.maybe(0.1):
            return []
        if self.maybe(0.3):
            return list(range(self.dimension))
        across = self.across()
        return [self.random.choice(across)] if across else []

    def periodic_axes(self, mirrors, wished):
        free = [axis for axis in self.across() if axis not in mirrors]
        if not free or not wished and not self.maybe(0.1):
            return []
        return sorted(self.random.sample(free, self.random.randint(1, len(free)) if self.maybe(0.4) else 1))

    def across(self):
        return [axis for axis in range(self.dimension) if axis != self.axis or not self.statics]

    def supports(self, taken):
        """The lower end held, or all lower sides on rollers."""
        d = self.dimension
        if d > 1 and self.maybe(0.2):
            rollers = [axis for axis in range(d) if axis not in taken]
            faces = self.maybe(0.5)
            side = lambda axis: {"face": "-" + AXES[axis]} | ({"at": self.lower[axis]} if self.from_file else {}) if faces else {"set": "low_" + AXES[axis]}
            return [side(axis) | {"displacement": [0.0 if other == axis else "free" for other in range(d)]} for axis in rollers]
        low = {"set": "low", "displacement": [0.0] * d}
        if self.cloud and self.maybe(0.1, "boundary.surface"):
            low = {"surface": "%.9g - %s" % (self.place("low"), AXES[self.axis]), "displacement": [0.0] * d}
        elif self.maybe(0.3 if self.statics else 0.15, "boundary.face"):
            low["face"] = self.face("low")
            low |= {"at": self.place("low")} if self.from_file or self.maybe(0.2, "boundary.at") else {}
        round_side = [{"surface": self.surface, "displacement": [0.0] * d}] if self.surface and self.maybe(0.4) else []
        return round_side if round_side and self.maybe(0.5) else [low] + round_side

    def pulled(self, amplitude):
        """The upper end, along its axis or as a whole."""
        r, d = self.random, self.dimension
        key = r.choice(["displacement", "velocity"]) if self.dynamic else "displacement"
        key = "velocity" if self.wishes_key("boundary.velocity") else key
        size = amplitude if key == "displacement" else self.strain * self.speed * r.choice([-1, 1])
        values = ["free" if self.maybe(0.7) else 0.0] * d
        values[self.axis] = self.course(size, key == "velocity" or not self.dynamic)
        out = {"set": r.choice(["high", "high", "high", "patch"]), key: values}
        if self.maybe(0.2):
            out["face"] = self.face("high")
            out |= {"at": self.place("high")} if self.from_file else {}
        return out

    def load(self):
        """On the upper end or a part of it, on the body, on single points: a force, a traction or a pressure."""
        r, d = self.random, self.dimension
        stress = self.E * self.strain * 0.3
        area = self.section
        for axis in range(d):
            area *= 1 if axis == self.axis else self.extent[axis] * self.spacing
        kinds = ["force", "body_force", "traction", "pressure"]
        kind = next((kind for kind in kinds if self.wishes_key("load." + kind)), r.choice(kinds))
        vector = lambda size: [self.course(size * self.between(-1, 1)) if axis == self.axis or self.maybe(0.3) else 0.0 for axis in range(d)]
        load = {"set": r.choice(["high", "high", "high", "patch"])}
        if kind == "force":
            load["set"] = r.choice([load["set"], "part", "probe", "some"])
            few = load["set"] in ("probe", "some")
            load["force"] = vector(stress * area * (0.05 if few else 1))
        elif kind == "body_force":
            load["body_force"] = vector(stress / self.spacing)
        elif kind == "traction":
            load |= {"traction": vector(stress), "face": self.face("high")}
        else:
            load["pressure"] = self.course(stress * r.choice([-1, 1]))
            if self.maybe(0.6):
                load["face"] = self.face("high")
            elif self.maybe(0.3):
                load["set"] = r.choice(["all", "part"])
            if self.maybe(0.4, "load.follower"):
                load["follower"] = True
        return load

    def initial(self, amplitude, held, loaded):
        initial = {}
        if self.integrator_name == "evaluate" or self.maybe(0.2):
            initial["displacement"] = [self.shape(0.2 * amplitude) for _ in range(self.dimension)]
        if self.dynamic and (self.maybe(0.8) or not (held or loaded or initial)):
            initial["velocity"] = [self.shape(self.strain * self.speed * self.between(0.1, 0.6)) for _ in range(self.dimension)]
        if self.dynamic and held:
            initial.pop("displacement", None)   # it would jump to what is prescribed
        return initial
