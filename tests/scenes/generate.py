"""Random valid scenes over everything that the program's tables name.

A wish decides what chance would: wishes = {"kinematics": "baqp", "body": "voronoi 3D", "damage": "max_stress" or "none", "integrator": "newton",
"condition": "symmetry", "keys": ("initial.from",)}, any of them.

Values of physical meaning (lengths, stiffnesses, loads, times) follow from a random scale of the body: waves cross it about once, strains are 1e-3 to 0.3. Every
other key gets a value that its table allows, so that a new key or part is tried without a change here."""

import random
import re

PAIR_LAWS = ("bond_based", "ordinary")
STATICS = ("newton", "jfnk", "kinsol", "dynamic_relaxation")
AXES = "xyz"


def rounded(value):
    return float("%.6g" % value)


def read_wishes(words):
    """Of a line of seeds.txt: kinematics=baqp body=voronoi-3D keys=initial.from,run.seed."""
    wishes = {}
    for word in words:
        what, value = word.split("=")
        wishes[what] = tuple(value.split(",")) if what == "keys" else value.replace("-", " ")
    return wishes


class Generator:
    def __init__(self, tables, seed, explicit_only=False, wishes=None):
        self.tables, self.random, self.explicit_only = tables, random.Random(seed), explicit_only
        self.seed, self.wishes = seed, wishes or {}

    # -- values by their tables ---------------------------------------------------------------------------------------------------------------

    def maybe(self, share, key=""):
        """key: with its section, where a wish may ask for it."""
        return self.random.random() < share or key in self.wishes.get("keys", ())

    def wish(self, what, otherwise):
        """What is wished for, or what chance says: a function that is called either way, so that other draws stay as they are."""
        drawn = otherwise()
        return self.wishes.get(what, drawn)

    def between(self, low, high):
        return self.random.uniform(low, high)

    def scale(self, low, high):
        """10 to a power between low and high."""
        return 10 ** self.between(low, high)

    def allowed_value(self, key, kind=None):
        """A value that the table allows; None for texts of which the table does not say enough."""
        text, r = key.allowed, self.random
        if text == "true or false":
            return self.maybe(0.5)
        if text.startswith("the name of a"):
            return self.part(re.match(r"the name of an? (\w+)", text).group(1))
        if re.match(r'(a list of )?"', text):
            choices = re.findall(r'"([^"]*)"', text)
            return r.sample(choices, r.randint(1, len(choices))) if text.startswith("a list") else r.choice(choices)
        if not re.match(r"an? (integer|number)", text):
            return None
        whole = text.startswith("an integer")
        bounds = {sign: float(number) for sign, number in re.findall(r"(>=|<=|>|<) (-?[\d.e+-]+)", text)}
        low = bounds.get(">=", bounds.get(">"))
        high = bounds.get("<=", bounds.get("<"))
        default = float(key.default) if re.match(r"-?[\d.]+(e-?\d+)?$", key.default) else None
        if whole:
            low = int(low) if low is not None else 0
            return r.randint(low, min(int(high), low + 3) if high is not None else low + 3)
        value = default * self.between(0.5, 2) if default else self.between(0.2, 2)
        if low is not None and high is not None and not low < value < high:
            value = self.between(low + 0.1 * (high - low), high - 0.1 * (high - low))
        if low is not None:
            value = max(value, low + 1e-3)
        return rounded(value)

    def filled(self, table, hints, share=0.3, leave=(), section=""):
        """A section: required keys, others with this probability, as many of each group as it asks for."""
        taken = {}
        grouped = set()
        for how, count, names in table.groups:
            grouped.update(names)
            usable = [name for name in names if name not in leave and (name in hints or self.has_value(table.keys[name]))]
            wished = [name for name in usable if "%s.%s" % (section, name) in self.wishes.get("keys", ())]
            if any(name in taken for name in names) or (how == "at most" and not self.maybe(share) and not wished):
                continue
            others = [name for name in self.random.sample(usable, len(usable)) if name not in wished]
            for name in (wished + others)[:count]:
                taken[name] = None
        for name, key in table.keys.items():
            if name in leave or (name in grouped and name not in taken):
                continue
            if name in taken or key.required or self.maybe(share, "%s.%s" % (section, name)):
                hint = hints.get(name, lambda: self.allowed_value(key))
                value = hint() if callable(hint) else hint
                if value is not None:
                    taken[name] = value
        return {name: taken[name] for name in table.keys if taken.get(name) is not None}

    def has_value(self, key):
        return self.allowed_value(key) is not None

    def part(self, kind, name=None, among=None, leave=()):
        """A part with keys: its name alone, or a table."""
        names = [part for part in self.tables.parts[kind] if among is None or part in among]
        drawn = self.random.choice(names)
        name = name or self.wishes.get(kind if kind in ("material", "influence", "stabilization") and self.wishes.get(kind) in names else "", drawn)
        hints = getattr(self, "hints_of_" + kind, lambda part: {})(name)
        keys = self.filled(self.tables.parts[kind][name], hints, 0.3, leave, kind)
        return {"type": name, **keys} if keys or self.maybe(0.2) else name

    # -- parts whose keys have a scale --------------------------------------------------------------------------------------------------------

    def varying(self, value):
        """A modulus that is a number, or varies a little through the body."""
        if not self.maybe(0.08):
            return rounded(value)
        return "%.6g*(1 + 0.2*(x - (%.6g))/%.6g)" % (value, self.lower[0], self.size)

    def hints_of_material(self, name):
        E, nu = self.E, self.nu
        mu, K = E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))
        values = {"density": self.rho, "youngs_modulus": E, "poisson_ratio": nu, "shear_modulus": mu, "bulk_modulus": K,
                  "lame_lambda": K - 2 * mu / 3, "C1": 0.35 * mu, "C2": 0.15 * mu}
        hints = {key: rounded(value) for key, value in values.items()}
        hints["density"] = self.varying(self.rho)
        return hints

    def hints_of_damage(self, name):
        strain = self.strain * self.between(0.1, 0.8)
        first = rounded(strain * self.between(0.3, 0.9))
        energy = rounded(self.E * strain ** 2 * self.horizon)
        return {"stretch": rounded(strain), "stretch_min": first, "energy_release_rate": energy, "strength": rounded(self.E * strain),
                "softening": lambda: rounded(self.between(1, 8)), "beta": lambda: rounded(self.between(0.5, 6))}

    def hints_of_influence(self, name):
        return {"formula": lambda: self.random.choice(["exp(-9*r^2)", "(1 - r)^2", "5*exp(-r^2)", "1 + 0.3*cos(3*r)", "1.1 - r"])}

    def hints_of_kinematics(self, name):
        small = len(self.extent) == 3
        order = lambda: self.random.choice([1, 2] if small else [1, 1, 2, 2, 3])
        bases = [part for part in self.tables.parts["kinematics"] if part not in PAIR_LAWS + ("conventional", "selective")]
        return {"order": order, "lambda": lambda: rounded(self.between(2, 40)), "n1": lambda: rounded(self.between(0, 3)),
                "n2": lambda: rounded(self.between(0.5, 3)), "parts": lambda: 2 ** self.dimension,
                "bond_horizon_ratio": lambda: rounded(self.between(0.8, 1.4)), "base": lambda: self.part("kinematics", among=bases)}

    def hints_of_stabilization(self, name):
        return {"coefficient": lambda: rounded(self.scale(-1, 0.5))}

    def hints_of_integrator(self, name):
        return {"end_time": self.end_time, "time_step": lambda: rounded(0.08 * self.spacing / self.speed) if self.maybe(0.3, "integrator.time_step") else None,
                "safety": lambda: rounded(self.between(0.2, 0.9)), "check_every": lambda: self.random.choice([20, 100, 500]),
                "steps": lambda: self.random.randint(1, 4), "tolerance": lambda: rounded(self.scale(-9, -6)),
                "max_iterations": lambda: self.random.randint(50, 400) * (100 if name == "dynamic_relaxation" else 1),
                "cut_backs": lambda: self.random.randint(3, 8), "bond_rounds": lambda: self.random.randint(100, 400), "restart": lambda: self.random.randint(20, 60),
                "max_restarts": lambda: self.random.randint(10, 40), "anderson": lambda: self.random.randint(2, 10)}

    # -- the scene ----------------------------------------------------------------------------------------------------------------------------

    def scene(self):
        r = self.random
        self.draw_scales()
        scene = {"format": 1}
        if self.maybe(0.1):
            scene["title"] = "scene %s" % self.seed
        scene["body"] = self.body(scene)
        scene["sets"] = self.sets()
        scene["family"] = self.family()
        self.end_time = rounded(self.between(0.4, 2.5) * self.size / self.speed)
        explicit = self.explicit_only or self.maybe(0.6)
        self.integrator_name = self.wish("integrator", lambda: "verlet" if explicit else r.choice(list(self.tables.parts["integrator"])))
        scene["kinematics"] = self.kinematics()
        laws = [law for law in self.tables.parts["material"] if law != "hypoelastic" or self.integrator_name not in STATICS]
        scene["material"] = self.law(laws)
        failing = self.integrator_name != "evaluate" and self.maybe(0.45)
        failing = self.wishes.get("damage", "none" if not failing else "") != "none"
        if self.maybe(0.2, "region.set"):
            scene["region"] = [{"set": "part", "material": self.softer(laws)}]
            if self.maybe(0.3, "family.interfaces"):
                scene["family"]["interfaces"] = r.choice(["laminate", "parallel"])
        if failing:
            scene["damage"] = self.damage(scene)
        if self.dimension > 1 and self.maybe(0.15, "crack.%s" % ("segment" if self.dimension == 2 else "polygon")):
            scene["crack"] = [self.crack()]
        self.conditions(scene)
        integrator = self.part("integrator", self.integrator_name)
        scene["integrator"] = integrator if isinstance(integrator, dict) else {"type": integrator}
        scene["output"] = self.output(scene)
        statics = self.integrator_name in STATICS
        run = self.filled(self.tables.sections["run"], {"threads": 1, "weak_springs": lambda: rounded(self.scale(-5, -3)) if statics else None,
                                                       "seed": lambda: r.randint(1, 99)}, 0.1, section="run")
        if run:
            scene["run"] = run
        if columns := list(self.columns_of_cracks()):
            scene["output"].setdefault("history", []).extend(columns)
        return scene

    def draw_scales(self):
        r = self.random
        self.dimension = r.choice([1, 2, 2, 2, 3, 3])
        if "body" in self.wishes:
            self.dimension = int(self.wishes["body"][-2])
        self.spacing = r.choice([0.001, 0.02, 0.1, 0.25, 1.0, 3.0])
        cells = {1: (8, 60), 2: (4, 12), 3: (3, 7)}[self.dimension] if not self.wishes else {1: (8, 30), 2: (4, 9), 3: (3, 5)}[self.dimension]
        self.extent = [r.randint(*cells) for _ in range(self.dimension)]
        self.lower = [rounded(self.spacing * r.choice([0, 0, r.randint(-20, 20), self.between(-9, 9)])) for _ in self.extent]
        self.upper = [rounded(low + n * self.spacing) for low, n in zip(self.lower, self.extent)]
        self.size = max(self.extent) * self.spacing
        self.E, self.rho = self.scale(2, 11), self.scale(1, 4)
        self.nu = r.choice([0.0, 0.25, 0.3, 0.33, 0.45, 0.2])
        self.speed = (self.E * (1 - self.nu) / ((1 + self.nu) * (1 - 2 * self.nu)) / self.rho) ** 0.5
        self.strain = self.scale(-3, -0.7)
        ratio = r.choice([1.515, 2.015, 2.015, 2.5, 3.015]) if self.dimension < 3 else r.choice([1.515, 2.015, 2.015, 2.515])
        self.ratio, self.horizon = ratio, ratio * self.spacing

    def body(self, scene):
        r = self.random
        body = {"dimension": self.dimension}
        if self.dimension == 2:
            body["plane"] = r.choice(["strain", "stress"])
        hints = {"dimension": self.dimension, "plane": body.get("plane"), "thickness": lambda: rounded(self.between(0.1, 2)),
                 "area": lambda: rounded(self.between(0.1, 2))}
        leave = ("thickness", "plane") if self.dimension != 2 else ()
        leave += ("line", "area") if self.dimension != 1 else ()
        body = self.filled(self.tables.sections["body"], hints, 0.3, leave + ("plane",), "body") | body
        self.stress = body.get("plane") == "stress" or (self.dimension == 1 and body.get("line", "stress") == "stress")
        self.section = body.get("thickness", 1.0) if self.dimension == 2 else body.get("area", 1.0) if self.dimension == 1 else 1.0
        self.cloud = self.maybe(0.35)
        self.from_file = self.cloud and self.maybe(0.4)
        kind = self.wishes.get("body", "").split(" ")[0]
        if kind:
            self.cloud, self.from_file = kind != "lattice", kind == "file" or kind == "voronoi" and self.from_file
        clipped = self.wishes.get("keys", ()) and "body.points.inside" in self.wishes["keys"]
        self.from_file = self.from_file or clipped
        inside = self.inside() if self.maybe(0.25, "body.lattice.inside") or clipped else None
        if self.from_file:
            body["points"] = self.points(scene, inside, kind)
            return body
        lattice = {"spacing": self.spacing, "lower": self.lower, "upper": self.upper}
        if inside:
            lattice["inside"] = inside
        if self.cloud:
            lattice["jitter"] = rounded(self.between(0.02, 0.3))
            if self.maybe(0.3):
                lattice["seed"] = r.randint(0, 99)
        if self.dimension > 1 and self.maybe(0.4 if self.cloud else 0.05):
            lattice["volume"] = r.choice(["cell", "voronoi"])
        if kind:
            lattice["volume"] = "voronoi" if kind == "voronoi" else "cell"
        self.has_inside = bool(inside)
        body["lattice"] = lattice
        return body

    def inside(self):
        """A hole, or half of the body behind a plane."""
        axes = AXES[:self.dimension]
        at = [self.between(low, high) for low, high in zip(self.lower, self.upper)]
        if self.maybe(0.6) and self.dimension > 1:
            return " + ".join("(%s - (%.6g))^2" % pair for pair in zip(axes, at)) + " > %.6g" % (1.3 * self.spacing) ** 2
        return " + ".join("%.3g*(%s - (%.6g))" % (self.between(-1, 1), axis, low) for axis, low in zip(axes, self.lower)) + " > %.6g" % (-0.3 * self.size)

    def points(self, scene, inside, kind):
        """Jittered points in random order, in a file."""
        r = self.random
        jitter = self.between(0, 0.25)
        cells = [[]]
        for n in self.extent:
            cells = [cell + [k] for cell in cells for k in range(n)]
        volume = self.spacing ** self.dimension * self.section
        rows = []
        for cell in cells:
            x = [low + (k + 0.5 + self.between(-jitter, jitter)) * self.spacing for low, k in zip(self.lower, cell)]
            if inside and not eval(inside.replace("^", "**"), {}, dict(zip(AXES, x))):
                continue
            rows.append(",".join("%.9g" % value for value in x + [0.0] * (3 - len(x)) + [volume]))
        if self.maybe(0.5):
            r.shuffle(rows)
        scene["files"] = {"points.csv": "x,y,z,volume\n" + "\n".join(rows) + "\n"}
        points = {"file": "points.csv"}
        voronoi = self.maybe(0.3)
        if self.dimension > 1 and (kind == "voronoi" or inside and self.maybe(0.6, "body.points.inside") or not kind and voronoi):
            points["volume"] = "voronoi"
            if self.maybe(0.7, "body.points.lower"):
                points.update(lower=self.lower, upper=self.upper)
            if inside:
                points["inside"] = inside
        self.has_inside = False
        return points

    def sets(self):
        """Two ends along one axis, a part of the body, a point."""
        self.axis = self.random.randrange(self.dimension)
        a = AXES[self.axis]
        low, high = self.lower[self.axis], self.upper[self.axis]
        band = 1.001 * self.spacing
        middle = self.lower[0] + self.between(0.3, 0.7) * (self.upper[0] - self.lower[0])
        self.middle = middle
        return {"low": "%s < %.9g" % (a, low + band), "high": "%s > %.9g" % (a, high - band), "part": "x > %.9g" % middle,
                "probe": {"nearest": [rounded(self.between(l, u)) for l, u in zip(self.lower, self.upper)]},
                "some": {"points": sorted(self.random.sample(range(4), 2))}}

    def family(self):
        lattice = not self.cloud
        family = {}
        if self.maybe(0.5):
            family["horizon_ratio"] = 1.015 if lattice and self.maybe(0.05) else self.ratio
        else:
            family["horizon"] = rounded(self.horizon)
        hints = {"consistent": lambda: self.maybe(0.6) if self.cloud else None,
                 "partial_volume": lambda: self.maybe(0.7) if lattice and self.has_inside else None}
        return family | self.filled(self.tables.sections["family"], hints, 0.3, ("horizon", "horizon_ratio", "interfaces"), "family")

    def kinematics(self):
        leave = () if not self.stress else ("selective",)
        names = [name for name in self.tables.parts["kinematics"] if name not in leave]
        name = self.wish("kinematics", lambda: self.random.choice(names + ["conventional"]))
        self.kinematics_name = name
        part = self.part("kinematics", name)
        if name == "conventional" and self.maybe(0.85):
            part = part if isinstance(part, dict) else {"type": part}
            part["stabilization"] = self.part("stabilization")
        return part

    def law(self, laws):
        part = self.part("material", among=laws)
        return part if isinstance(part, dict) and "density" in part else {**(part if isinstance(part, dict) else {"type": part}), "density": rounded(self.rho)}

    def softer(self, laws):
        """A law for a part of the body, up to a hundred times softer or stiffer."""
        E, rho = self.E, self.rho
        self.E, self.rho = E * self.scale(-1.5, 0.3), rho * self.between(0.5, 2)
        law = self.law(laws)
        self.E, self.rho = E, rho
        return law

    def damage(self, scene):
        part = self.part("damage", self.wishes.get("damage"))
        part = part if isinstance(part, dict) else {"type": part}
        explicit = self.integrator_name == "verlet"
        hints = {"no_fail": lambda: [self.random.choice(["low", "high"])], "gradual": lambda: self.maybe(0.7) if explicit else None}
        part |= self.filled(self.tables.sections["damage"], hints, 0.25, section="damage")
        if "region" in scene and self.maybe(0.4, "interface.between") and "softening" not in part and part["type"] != "smooth_degradation":
            other = self.part("damage", part["type"], leave=("softening",))
            scene["interface"] = [{"between": ["part", "rest"], "damage": other}]
        return part

    def crack(self):
        at = rounded(self.lower[0] + self.between(0.3, 0.7) * (self.upper[0] - self.lower[0]))
        y0, y1 = self.lower[1] - 0.5 * self.spacing, self.lower[1] + self.between(0.2, 0.6) * (self.upper[1] - self.lower[1])
        if self.dimension == 2:
            return {"segment": [[at, rounded(y0)], [rounded(at + self.between(-1, 1) * self.spacing), rounded(y1)]]}
        z0, z1 = rounded(self.lower[2] - self.spacing), rounded(self.upper[2] + self.spacing)
        return {"polygon": [[at, rounded(y0), z0], [at, rounded(y1), z0], [at, rounded(y1), z1], [at, rounded(y0), z1]]}

    # -- boundaries, loads, initial values ----------------------------------------------------------------------------------------------------

    def course(self, amplitude, steady=True):
        """A function of time from 0 to the end of the run. steady: it may be there from the start."""
        T = self.end_time if self.integrator_name == "verlet" else 1.0
        value = "%.6g" % amplitude
        kinds = [rounded(amplitude), "%s*t/%.6g" % (value, T), "%s*(t/%.6g)^2" % (value, T), "%s*sin(%.6g*t)" % (value, 6.28 / T),
                 "t < %.6g ? %s*t/%.6g : %s" % (0.3 * T, value, 0.3 * T, value)]
        return self.random.choice((kinds if steady else kinds[1:]) if self.integrator_name == "verlet" else kinds[:3])

    def shape(self, amplitude):
        """A smooth function of the place."""
        waves = ["%.5g*%s" % (self.between(-4, 4) / self.size, axis) for axis in AXES[:self.dimension]]
        return "%.6g*sin(%s + %.3g)" % (amplitude * self.random.choice([-1, 1]), " + ".join(waves), self.between(0, 6))

    def face(self, side):
        return ("-" if side == "low" else "+") + AXES[self.axis]

    def place(self, side):
        return (self.lower if side == "low" else self.upper)[self.axis]

    def conditions(self, scene):
        r, d, statics = self.random, self.dimension, self.integrator_name in STATICS
        amplitude = self.strain * self.size
        dynamic = self.integrator_name == "verlet"
        taken = set()   # axes with images
        wished = self.wishes.get("condition")
        across = [axis for axis in range(d) if axis != self.axis] if statics else list(range(d))   # the rest stays held at the ends
        if (self.maybe(0.1) or wished == "symmetry") and across:
            axis = r.choice(across)
            taken.add(axis)
            scene["symmetry"] = [{"axis": AXES[axis]} | ({"at": self.lower[axis]} if self.cloud or self.maybe(0.3) else {})]
        across = [axis for axis in across if axis not in taken]
        if (self.maybe(0.1) or wished == "periodic") and across:
            axis = r.choice(across)
            taken.add(axis)
            scene["periodic"] = [{"axis": AXES[axis]} | ({"lower": self.lower[axis], "upper": self.upper[axis]} if self.cloud or self.maybe(0.3) else {})]
        boundaries, loads = [], []
        held = statics or self.maybe(0.35) or wished == "boundary"
        if held and self.axis not in taken:
            boundaries.append({"set": "low", "displacement": [0.0] * d})
            if self.cloud and self.maybe(0.1, "boundary.surface"):
                boundaries[-1] = {"surface": "%.9g - %s" % (self.place("low"), AXES[self.axis]), "displacement": [0.0] * d}
            elif self.maybe(0.3 if statics else 0.15, "boundary.face"):
                boundaries[-1]["face"] = self.face("low")
                boundaries[-1] |= {"at": self.place("low")} if self.from_file or self.maybe(0.2, "boundary.at") else {}
        if held and self.axis not in taken and self.maybe(0.5):
            pulled = ["free"] * d
            key = r.choice(["displacement", "velocity"]) if dynamic else "displacement"
            key = "velocity" if "boundary.velocity" in self.wishes.get("keys", ()) else key
            size = amplitude if key == "displacement" else self.strain * self.speed
            pulled[self.axis] = self.course(size, not dynamic) if key == "displacement" else rounded(size * r.choice([-1, 1]))
            boundaries.append({"set": "high", key: pulled})
            if self.maybe(0.2):
                boundaries[-1]["face"] = self.face("high")
                boundaries[-1] |= {"at": self.place("high")} if self.from_file else {}
        if (held and len(boundaries) < 2 or self.maybe(0.2) or wished == "load") and self.axis not in taken:
            loads.append(self.load())
        if self.maybe(0.1):
            loads.append({"set": "all", "body_force": [self.course(self.E * self.strain / self.size * self.between(-1, 1)) for _ in range(d)]})
        if self.maybe(0.05, "initial.from") and not (dynamic and boundaries):
            scene["initial"] = {"from": "earlier/results.h5"}
        elif not statics:
            initial = {}
            if self.integrator_name == "evaluate" or self.maybe(0.2):
                initial["displacement"] = [self.shape(0.2 * amplitude) for _ in range(d)]
            if dynamic and (self.maybe(0.8) or not (boundaries or loads or initial)):
                initial["velocity"] = [self.shape(self.strain * self.speed * self.between(0.1, 0.6)) for _ in range(d)]
            if dynamic and boundaries:
                initial.pop("displacement", None)   # it would jump to what is prescribed
            scene["initial"] = initial
        if statics:
            for condition in boundaries + loads:
                if self.maybe(0.15, "load.ramp"):
                    condition["ramp"] = False
        if boundaries:
            scene["boundary"] = boundaries
        if loads:
            scene["load"] = loads

    def load(self):
        """On the high end: a force, a traction or a pressure."""
        r, d = self.random, self.dimension
        stress = self.E * self.strain * 0.3
        area = self.section
        for axis in range(d):
            area *= 1 if axis == self.axis else self.extent[axis] * self.spacing
        kinds = ["force", "body_force", "traction", "pressure"]
        kind = next((kind for kind in kinds if "load." + kind in self.wishes.get("keys", ())), r.choice(kinds))
        vector = lambda size: [self.course(size * self.between(-1, 1)) if axis == self.axis or self.maybe(0.3) else 0.0 for axis in range(d)]
        load = {"set": "high"}
        if kind == "force":
            load["force"] = vector(stress * area)
        elif kind == "body_force":
            load["body_force"] = vector(stress / self.spacing)
        elif kind == "traction":
            load |= {"traction": vector(stress), "face": self.face("high")}
        else:
            load["pressure"] = self.course(stress * r.choice([-1, 1]))
            if self.maybe(0.7):
                load["face"] = self.face("high")
            if self.maybe(0.4, "load.follower"):
                load["follower"] = True
        return load

    def columns_of_cracks(self):
        """Columns of moments, cracks, pieces and other columns. Drawn last, so that scenes of before stay as they are."""
        middle = [rounded(0.5 * (low + high)) for low, high in zip(self.lower, self.upper)]
        if self.maybe(0.05, "output.history.about") and self.dimension > 1:
            yield {"name": "moment", "quantity": "reaction", "reduce": "moment", "about": middle} | ({"component": "z"} if self.dimension == 3 else {})
        for key, reduce in (("direction", "extent"), ("above", "tip")):
            if self.maybe(0.05, "output.history." + key):
                yield {"name": reduce, "quantity": "damage", "reduce": reduce, "above": 0.3, "direction": [1.0] * self.dimension}
        if self.maybe(0.05, "output.history.piece"):
            yield {"name": "pieces", "quantity": "fragment", "reduce": "max"}
            if self.integrator_name == "verlet":   # others may have no density
                yield {"name": "largest", "quantity": "fragment", "reduce": "mass", "piece": 1}
        if self.maybe(0.05, "output.history.value"):
            yield {"name": "broken", "quantity": "damage", "reduce": "area"}
            yield {"name": "released", "value": "dissipated_energy/broken"}

    # -- output -------------------------------------------------------------------------------------------------------------------------------

    def output(self, scene):
        r, dynamic = self.random, self.integrator_name == "verlet"
        hints = {"frames": lambda: r.randint(1, 5), "every": lambda: r.choice([3, 10]) if dynamic else 1,
                 "times": lambda: [0.0, rounded(0.5 * self.end_time)] if dynamic else None, "history_every": 1,
                 "checkpoint_every": lambda: r.randint(2, 9)}
        output = self.filled(self.tables.sections["output"], hints, 0.2, section="output")
        output["history_every"] = 1
        if "frames" not in output and "every" not in output and "times" not in output:
            output["frames"] = 3
        fields = output.get("fields")
        if fields is not None:
            if not dynamic:
                fields = [name for name in fields if name not in ("velocity", "acceleration")]
            if self.kinematics_name in PAIR_LAWS:
                fields = [name for name in fields if name not in ("cauchy", "von_mises")]
            output["fields"] = sorted({"displacement", *(["velocity"] if dynamic else []), *fields})
        if self.maybe(0.2, "output.history.name"):
            output["history"] = [{"name": "end", "set": r.choice(["high", "probe", "all"]), "quantity": "displacement", "component": AXES[self.axis],
                                  "reduce": r.choice(["mean", "sum", "min", "max"])}]
        middle = [rounded(0.5 * (low + high)) for low, high in zip(self.lower, self.upper)]
        for key, reduction in (("at", {"reduce": "fit", "at": middle}), ("exact", {"reduce": "error", "exact": self.shape(self.strain * self.size)})):
            if self.maybe(0.05, "output.history." + key):
                output.setdefault("history", []).append({"name": reduction["reduce"], "quantity": "displacement", "component": AXES[0]} | reduction)
        return output
