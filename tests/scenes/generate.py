"""Random valid scenes over everything that the program's tables name.

A wish decides what chance would: wishes = {"kinematics": "baqp", "body": "voronoi 3D", "points": "h5", "region": "layer", "interfaces": "parallel", "damage": "max_stress" or "none",
"integrator": "newton", "condition": "symmetry", "keys": ("initial.from",)}, any of them.

Values of physical meaning (lengths, stiffnesses, loads, times) follow from a random scale of the body: waves cross it about once, strains are 1e-3 to 0.3. Every
other key gets a value that its table allows, so that a new key or part is tried without a change here."""

import random

from conditions import STATICS, Conditions
from draws import AXES, as_table, rounded

PAIR_LAWS = ("bond_based", "ordinary")
VECTORS = ("displacement", "velocity", "acceleration", "internal_force", "external_force", "reaction")
TENSORS = ("deformation_gradient", "first_piola", "cauchy")
NOT_OF_PAIRS = ("shape_tensor_condition",)
UNSEEN = ("unstable", "set", "crack", "not_finite")   # warnings that the net reads


def read_wishes(words):
    """Of a line of seeds.txt: kinematics=baqp body=voronoi-3D keys=initial.from,run.seed."""
    wishes = {}
    for word in words:
        what, value = word.split("=")
        wishes[what] = tuple(value.split(",")) if what == "keys" else value.replace("-", " ")
    return wishes


class Generator(Conditions):
    def __init__(self, tables, seed, explicit_only=False, wishes=None):
        super().__init__(tables, seed, wishes)
        self.explicit_only = explicit_only
        # Drawn apart, so that other draws are what they were before there were any.
        self.plastic = [name for name, table in tables.parts["material"].items() if "yield_stress" in table.keys]
        self.random_of_plastic = random.Random("plastic %s" % seed)

    # -- parts whose keys have a scale --------------------------------------------------------------------------------------------------------

    def varying(self, value, share=0.08):
        """A modulus that is a number, or varies a little through the body."""
        if not self.maybe(share):
            return rounded(value)
        axis = self.random.randrange(self.dimension)
        return "%.6g*(1 + 0.2*(%s - (%.6g))/%.6g)" % (value, AXES[axis], self.lower[axis], self.size)

    def hints_of_material(self, name):
        E, nu = self.E, self.nu
        mu, K = E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))
        values = {"density": self.rho, "youngs_modulus": E, "poisson_ratio": nu, "shear_modulus": mu, "bulk_modulus": K,
                  "lame_lambda": K - 2 * mu / 3, "C1": 0.35 * mu, "C2": 0.15 * mu}
        hints = {key: rounded(value) for key, value in values.items()}
        if name in self.plastic:
            yields = E * self.strain * self.between(0.1, 1)
            hints |= {"yield_stress": rounded(yields), "saturation_stress": rounded(1.5 * yields), "saturation_rate": lambda: rounded(self.scale(0, 2)),
                      "hardening": lambda: rounded(E * self.scale(-3, -1) * self.random.choice([1, 1, 1, -0.01]))}
        hints["density"] = self.varying(self.rho)
        for key in ("youngs_modulus", "shear_modulus"):
            hints[key] = lambda value=values[key]: self.varying(value, 0.04) if self.maybe(0.9) else self.number(value)
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
        order = lambda: self.random.choice({1: [1, 1, 2, 3, 4], 2: [1, 1, 2, 2, 3], 3: [1, 2]}[self.dimension])
        bases = [part for part in self.tables.parts["kinematics"] if part not in PAIR_LAWS + ("conventional", "selective")]
        parts = [2 ** self.dimension] * 3 + [1] + [4] * (self.dimension == 1)
        return {"order": order, "lambda": lambda: rounded(self.between(2, 40)), "n1": lambda: rounded(self.between(0, 3)),
                "n2": lambda: rounded(self.between(0.5, 3)), "parts": lambda: self.random.choice(parts),
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
        scene = {"format": 1, "constants": self.constants}
        if self.maybe(0.1, "title"):
            scene["title"] = "scene %s" % self.seed
        scene["body"] = self.body(scene)
        scene["sets"] = self.sets()
        scene["family"] = self.family()
        self.end_time = rounded(self.between(0.4, 2.5) * self.size / self.speed)
        explicit = self.explicit_only or self.maybe(0.6)
        self.integrator_name = self.wish("integrator", lambda: "verlet" if explicit else r.choice(list(self.tables.parts["integrator"])))
        scene["kinematics"] = self.kinematics()
        if self.kinematics_name in PAIR_LAWS and self.dimension > 1 and scene["family"].get("horizon_ratio") == 1.015:
            scene["kinematics"] = as_table(scene["kinematics"]) | {"surface_correction": "none"}   # nearest neighbours are too few for factors
        laws = [name for name in self.tables.parts["material"] if name not in self.plastic]
        scene["material"] = self.law(laws)
        failing = self.integrator_name != "evaluate" and self.maybe(0.45)
        failing = self.wishes.get("damage", "none" if not failing else "") != "none"
        if self.maybe(0.45, "region.set") or "region" in self.wishes:
            scene["region"] = self.regions(scene, laws)
            if self.maybe(0.5, "family.interfaces") or "interfaces" in self.wishes:
                scene["family"]["interfaces"] = self.wish("interfaces", lambda: r.choice(["laminate", "parallel"]))
        if failing:
            scene["damage"] = self.damage(scene)
        if self.dimension > 1 and self.maybe(0.15, "crack.%s" % ("segment" if self.dimension == 2 else "polygon")):
            scene["crack"] = [self.crack() for _ in range(r.choice([1, 1, 1, 2]))]
        self.conditions(scene)
        if terms := self.terms():
            scene["term"] = terms
        scene["integrator"] = as_table(self.part("integrator", self.integrator_name))
        scene["output"] = self.output(scene)
        if columns := [*self.columns(), *self.columns_of_cracks()]:
            scene["output"]["history"] = columns
        warnings = [word for word in self.choices(self.tables.sections["run"].keys["silence"]) if word not in UNSEEN]
        run = self.filled(self.tables.sections["run"], {"threads": 1, "weak_springs": lambda: rounded(self.scale(-5, -3)) if self.statics else None,
                                                       "silence": lambda: r.sample(warnings, r.randint(1, 3)), "seed": lambda: r.randint(1, 99)}, 0.1, section="run")
        if run:
            scene["run"] = run
        if not self.constants:
            del scene["constants"]
        return scene

    def kinematics(self):
        leave = () if not self.stress else ("selective",)
        names = [name for name in self.tables.parts["kinematics"] if name not in leave]
        name = self.wish("kinematics", lambda: self.random.choice(names + ["conventional"]))
        self.kinematics_name = name
        part = self.part("kinematics", name)
        if name == "conventional" and self.maybe(0.85):
            part = as_table(part)
            part["stabilization"] = self.part("stabilization")
        return part

    def law(self, laws):
        part = self.part("material", among=laws)
        plastic = self.plastic and self.random_of_plastic.random() < (0.0 if self.wishes else 0.15) or self.wishes.get("material") in self.plastic
        if plastic and self.kinematics_name not in PAIR_LAWS:
            others, self.random = self.random, self.random_of_plastic
            part = self.part("material", among=self.plastic)
            if isinstance(part, dict) and "saturation_stress" in part:
                part.setdefault("saturation_rate", rounded(self.scale(0, 2)))
            self.random = others
        return {"density": rounded(self.rho)} | as_table(part)

    def other_law(self, laws):
        """A law for a part of the body, up to thirty times softer or twice as stiff."""
        whole = self.E, self.rho, self.nu
        self.E, self.rho = self.E * self.scale(-1.5, 0.3), self.rho * self.between(0.5, 2)
        self.nu = self.random.choice([self.nu, self.nu, 0.0, 0.3, 0.45, -0.2])
        law = self.law(laws)
        self.E, self.rho, self.nu = whole
        return law

    def damage(self, scene):
        part = as_table(self.part("damage", self.wishes.get("damage")))
        sets = ["low", "high", "part", "patch", "some", *(region["set"] for region in scene.get("region", []))]
        hints = {"no_fail": lambda: self.random.sample(sets, self.random.randint(1, 2)), "gradual": lambda: self.maybe(0.7) if self.dynamic else None}
        part |= self.filled(self.tables.sections["damage"], hints, 0.25, section="damage")
        at_once = "softening" not in part and part["type"] != "smooth_degradation"
        if "region" in scene and at_once and self.maybe(0.5, "interface.between"):
            scene["interface"] = self.interfaces(scene, part)
        return part

    # -- output -------------------------------------------------------------------------------------------------------------------------------

    def fields_of_parts(self, names):
        names = [name for name in names if self.dynamic or name not in ("velocity", "acceleration")]
        return [name for name in names if self.kinematics_name not in PAIR_LAWS or name not in NOT_OF_PAIRS]

    def output(self, scene):
        r = self.random
        hints = {"frames": lambda: r.randint(1, 5), "every": lambda: r.choice([3, 10]) if self.dynamic else 1,
                 "times": lambda: [0.0, rounded(0.5 * self.end_time)] if self.dynamic else None, "checkpoint_every": lambda: r.randint(2, 9)}
        output = self.filled(self.tables.sections["output"], hints, 0.2, ("history_every",), section="output")
        output["history_every"] = r.choice([1] * 12 + [0, 2])
        if "frames" not in output and "every" not in output and "times" not in output:
            output["frames"] = 3
        if "fields" in output:
            output["fields"] = sorted({"displacement", *(["velocity"] if self.dynamic else []), *self.fields_of_parts(output["fields"]), *self.states(scene)})
        return output

    def states(self, scene):
        """Fields of what the laws of the scene remember."""
        if self.kinematics_name in PAIR_LAWS:
            return []
        laws = [scene["material"], *(region["material"] for region in scene.get("region", []))]
        return [state for law in laws for state in self.tables.states.get(as_table(law)["type"], [])]

    def columns(self):
        """Columns of the history: any field, over a set."""
        keys = self.tables.sections["output.history"].keys
        sets = ["all", "high", "low", "probe", "some", "part"]
        for number in range(self.random.choice([0, 0, 0, 1, 1, 2])):
            quantity = self.random.choice(self.fields_of_parts(self.choices(keys["quantity"])))
            tensors = [a + b for a in self.axes for b in self.axes]
            component = {"component": self.random.choice(self.axes if quantity in VECTORS else tensors)} if quantity in VECTORS + TENSORS else {}
            yield {"name": "column_%d" % number, "set": self.random.choice(sets), "quantity": quantity} | component | {"reduce": self.random.choice(["mean", "sum", "min", "max"])}
        middle = [rounded(0.5 * (low + high)) for low, high in zip(self.lower, self.upper)]
        for key, reduction in (("at", {"reduce": "fit", "at": middle}), ("exact", {"reduce": "error", "exact": self.shape(self.strain * self.size)})):
            if self.maybe(0.05, "output.history." + key):
                yield {"name": reduction["reduce"], "quantity": "displacement", "component": AXES[0]} | reduction

    def columns_of_cracks(self):
        """Columns of moments, cracks, pieces and other columns."""
        middle = [rounded(0.5 * (low + high)) for low, high in zip(self.lower, self.upper)]
        if self.maybe(0.05, "output.history.about") and self.dimension > 1:
            yield {"name": "moment", "quantity": "reaction", "reduce": "moment", "about": middle} | ({"component": "z"} if self.dimension == 3 else {})
        for key, reduce in (("direction", "extent"), ("above", "tip")):
            if self.maybe(0.05, "output.history." + key):
                yield {"name": reduce, "quantity": "damage", "reduce": reduce, "above": 0.3, "direction": [1.0] * self.dimension}
        if self.maybe(0.05, "output.history.piece"):
            yield {"name": "pieces", "quantity": "fragment", "reduce": "max"}
            if self.dynamic:   # others may have no density
                yield {"name": "largest", "quantity": "fragment", "reduce": "mass", "piece": 1}
        if self.maybe(0.05, "output.history.value"):
            yield {"name": "broken", "quantity": "damage", "reduce": "area"}
            yield {"name": "released", "value": "dissipated_energy/broken"}
