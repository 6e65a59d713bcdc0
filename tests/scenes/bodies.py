"""Random bodies: lattices, clouds and files of points, what is cut out of them, sets, regions and cracks."""

import itertools

from draws import AXES, Draws, as_table, rounded

SHAPES = ("layer", "block", "corner", "inclusion", "grain", "oblique")   # of regions


def is_inside(expression, x):
    python = expression.replace("^", "**").replace("&&", " and ").replace("||", " or ")
    return eval(python, {}, dict(zip(AXES, x)))


class Bodies(Draws):
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
        ratios = {1: [1.0, 1.515, 2.0, 2.015, 3.015, 4.015], 2: [1.515, 2.0, 2.015, 2.015, 2.5, 3.0, 3.015], 3: [1.515, 2.0, 2.015, 2.015, 2.515]}
        self.ratio = r.choice(ratios[self.dimension])
        self.horizon = self.ratio * self.spacing
        self.constants = {}

    @property
    def axes(self):
        return AXES[:self.dimension]

    # -- points -------------------------------------------------------------------------------------------------------------------------------

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
        clipped = self.wishes_key("body.points.inside")
        self.from_file = self.from_file or clipped
        self.layer, self.surface = self.spacing, None   # thickness of the outermost layer; a round side
        inside = self.inside() if self.maybe(0.25, "body.lattice.inside") or self.wishes_key("family.partial_volume") or clipped else None
        if self.from_file:
            body["points"] = self.points(scene, inside, kind)
            return body
        lattice = {"spacing": self.spacing, "lower": self.lower, "upper": self.upper}
        if inside:
            lattice["inside"] = inside
        if self.cloud:
            lattice["jitter"] = rounded(self.between(0.02, self.random.choice([0.3, 0.3, 0.5])))
            if self.maybe(0.3):
                lattice["seed"] = r.randint(0, 99)
        if self.dimension > 1 and self.maybe(0.4 if self.cloud else 0.05):
            lattice["volume"] = r.choice(["cell", "voronoi"])
        if kind:
            lattice["volume"] = "voronoi" if kind == "voronoi" else "cell"
        if lattice.get("volume") != "voronoi" and not self.cloud and self.maybe(0.08):   # no whole number of spacings
            lattice["upper"] = [rounded(high + self.between(-0.3, 0.3) * self.spacing) for high in self.upper]
        self.has_inside = bool(inside)
        body["lattice"] = lattice
        return body

    def inside(self):
        """Without a hole or a notch, a disc or ball, or what lies behind a plane."""
        at = [self.between(low, high) for low, high in zip(self.lower, self.upper)]
        kind = self.random.choice(["hole", "hole", "ball", "notch", "plane"]) if self.dimension > 1 else "plane"
        if kind in ("hole", "ball"):
            radius = self.between(0.8, 1.8) * self.spacing if kind == "hole" else self.between(0.4, 0.55) * min(self.extent) * self.spacing
            if self.maybe(0.3):   # about a corner or centre of a cell
                at = [low + round(2 * (x - low) / self.spacing) * self.spacing / 2 for x, low in zip(at, self.lower)]
                radius = max(1, round(2 * radius / self.spacing)) * self.spacing / 2
            centre = at if kind == "hole" else [0.5 * (low + high) for low, high in zip(self.lower, self.upper)]
            squares = " + ".join("(%s - (%.6g))^2" % pair for pair in zip(self.axes, centre))
            sign = "-" if kind == "hole" else ""
            self.surface = "%s(sqrt(%s) - %.6g)" % (sign, squares, radius)
            return "%s %s %.6g" % (squares, ">" if kind == "hole" else "<", radius ** 2)
        if kind == "notch":
            return "%s > %.6g || %s < %.6g || %s > %.6g" % ("y", self.lower[1] + self.between(0.2, 0.6) * self.extent[1] * self.spacing,
                                                            "x", at[0] - 0.6 * self.spacing, "x", at[0] + 0.6 * self.spacing)
        slopes, height = [self.between(-1, 1) for _ in self.lower], -0.3 * self.size
        if self.maybe(0.4) and max(abs(slope) for slope in slopes) > 0.25:   # through corners, centres and sides of cells
            slopes, height = [round(2 * slope) / 2 for slope in slopes], round(2 * height / self.spacing) * self.spacing / 2
        return " + ".join("%.3g*(%s - (%.6g))" % row for row in zip(slopes, AXES, self.lower)) + " > %.6g" % height

    def rows_of_axis(self, axis, kind):
        """Positions along an axis, each with the share of the body that is its own: in the middle of cells, of graded ones, or on the sides."""
        n, low, size = self.extent[axis], self.lower[axis], self.extent[axis] * self.spacing
        if kind == "nodes":
            return [(low + k * self.spacing, self.spacing * (0.5 if k in (0, n) else 1.0)) for k in range(n + 1)]
        grading = self.between(-0.4, 0.4) if kind == "graded" else 0.0
        bound = lambda k: low + size * (k / n + grading * k / n * (1 - k / n))
        return [(0.5 * (bound(k) + bound(k + 1)), bound(k + 1) - bound(k)) for k in range(n)]

    def points(self, scene, inside, kind):
        """Points in a file, in some order: jittered, on the nodes of a lattice, or closer in some places. An .h5 file is made of the text when it is written."""
        r = self.random
        how = r.choice(["jittered", "jittered", "graded", "nodes"]) if not inside else "jittered"
        self.layer = self.spacing if how == "jittered" else 1.5 * self.spacing if how == "graded" else 0.5 * self.spacing
        jitter = self.between(0, 0.25) * self.spacing if how == "jittered" else 0.0
        voronoi = self.maybe(0.3)
        voronoi = self.dimension > 1 and (kind == "voronoi" or inside and self.maybe(0.6, "body.points.inside") or not kind and voronoi)
        volumes = not voronoi or self.maybe(0.5)
        rows = []
        for cell in itertools.product(*(self.rows_of_axis(axis, how) for axis in range(self.dimension))):
            x = [at + self.between(-jitter, jitter) for at, _ in cell]
            volume = self.section
            for _, share in cell:
                volume *= share
            if not inside or is_inside(inside, x):
                rows.append(",".join("%.9g" % value for value in x + [0.0] * (3 - len(x)) + ([volume] if volumes else [])))
        if self.maybe(0.5):
            r.shuffle(rows)
        scene["files"] = {"points.csv": "x,y,z" + (",volume" if volumes else "") + "\n" + "\n".join(rows) + "\n"}
        points = {"file": "points." + self.wish("points", lambda: r.choice(["csv", "csv", "h5"]))}
        if voronoi:
            points["volume"] = "voronoi"
            if self.maybe(0.7, "body.points.lower") or how != "jittered":
                points.update(lower=self.lower, upper=self.upper)
            if inside:
                points["inside"] = inside
        self.has_inside = False
        return points

    def family(self):
        lattice = not self.cloud
        family = {}
        if self.maybe(0.5):
            family["horizon_ratio"] = 1.015 if lattice and self.maybe(0.05) else self.ratio
        else:
            family["horizon"] = rounded(self.horizon)
        hints = {"consistent": lambda: self.maybe(0.6) if self.cloud else None,
                 "partial_volume": lambda: self.maybe(0.85) if lattice and self.has_inside else None}
        return family | self.filled(self.tables.sections["family"], hints, 0.35, ("horizon", "horizon_ratio", "interfaces"), "family")

    # -- sets ---------------------------------------------------------------------------------------------------------------------------------

    def sets(self):
        """Two ends along one axis and a part of one, the lower sides, the outermost layer, a part of the body, single points."""
        self.axis = self.random.randrange(self.dimension)
        a = AXES[self.axis]
        side = lambda axis, low: "%s %s %.9g" % (AXES[axis], *(("<", self.lower[axis] + 1.001 * self.layer) if low else (">", self.upper[axis] - 1.001 * self.layer)))
        other = (self.axis + 1) % self.dimension
        middle = lambda axis: self.lower[axis] + self.between(0.3, 0.7) * (self.upper[axis] - self.lower[axis])
        sets = {"low": side(self.axis, True), "high": side(self.axis, False), "part": "x > %.9g" % middle(0),
                "patch": side(self.axis, False) + (" && %s < %.9g" % (AXES[other], middle(other)) if self.dimension > 1 else ""),
                "rim": " || ".join(side(axis, low) for axis in range(self.dimension) for low in (True, False)),
                "probe": {"nearest": [rounded(self.between(l, u)) for l, u in zip(self.lower, self.upper)]},
                "some": {"points": sorted(self.random.sample(range(6), 2))}}
        return sets | {"low_" + AXES[axis]: side(axis, True) for axis in range(self.dimension)}

    # -- regions ------------------------------------------------------------------------------------------------------------------------------

    def regions(self, scene, laws):
        """Up to three bodies within the body, which may overlap or touch, each of a law of its own."""
        regions, r = [], self.random
        kinds = [self.wish("region", lambda: r.choice(SHAPES))] + [r.choice(SHAPES) for _ in range(r.choice([0, 0, 1, 2]))]
        for kind in kinds:
            for expression in getattr(self, "shape_of_" + kind)():
                name = kind if kind not in scene["sets"] else "%s_%d" % (kind, len(regions) + 1)
                scene["sets"][name] = expression
                law = r.choice(regions)["material"] if regions and self.maybe(0.15) else self.other_law(laws)
                regions.append({"set": name, "material": law})
        if self.maybe(0.1):
            regions.append({"set": r.choice(["probe", "some", "part", "rim"]), "material": self.other_law(laws)})
        return regions

    def bound(self, axis, k):
        """Between two layers of points; now and then elsewhere."""
        shift = 0.5 if self.layer < self.spacing else 0.0
        if self.maybe(0.15):
            shift += self.between(-0.4, 0.4)
        return "%.9g" % (self.lower[axis] + (k + shift) * self.spacing)

    def interval(self, axis, most=1.0):
        """From one layer on, along a side or inside."""
        n = self.extent[axis]
        cells = self.random.choice([1, 1, 2, self.random.randint(1, n)])
        cells = max(1, min(cells, int(most * n)))
        k = self.random.choice([0, n - cells, self.random.randint(0, n - cells)])
        limits = ["%s > %s" % (AXES[axis], self.bound(axis, k))] if k > 0 else []
        limits += ["%s < %s" % (AXES[axis], self.bound(axis, k + cells))] if k + cells < n else []
        return limits or ["%s > %s" % (AXES[axis], self.bound(axis, 1))]

    def shape_of_layer(self):
        """Across the body, or several of them."""
        axis = self.random.randrange(self.dimension)
        return [" && ".join(self.interval(axis, 0.6)) for _ in range(self.random.choice([1, 1, 2]))]

    def shape_of_block(self):
        """With all of its sides, or a column through the body."""
        axes = self.random.sample(range(self.dimension), self.random.randint(min(2, self.dimension), self.dimension))
        return [" && ".join(limit for axis in axes for limit in self.interval(axis, 0.7))]

    def shape_of_corner(self):
        """An edge or a corner of the body; or all but that."""
        axes = self.random.sample(range(self.dimension), self.random.randint(min(2, self.dimension), self.dimension))
        sign, join = self.random.choice([("<>", " && "), ("><", " || ")])
        limits = []
        for axis in axes:
            n = self.extent[axis]
            k = self.random.choice([1, 2, max(1, n // 2)])
            low = self.maybe(0.5)
            limits.append("%s %s %s" % (AXES[axis], sign[0] if low else sign[1], self.bound(axis, k if low else n - k)))
        return [join.join(limits)]

    def squares(self, at):
        return " + ".join("(%s - (%.9g))^2" % pair for pair in zip(self.axes, at))

    def shape_of_inclusion(self):
        """Round, from one point on, about a point or anywhere; now and then several of a kind."""
        out = []
        for _ in range(self.random.choice([1, 1, 2])):
            cell = [self.random.randrange(n) + (0.5 if self.maybe(0.6) else self.between(0, 1)) for n in self.extent]
            at = [low + k * self.spacing for low, k in zip(self.lower, cell)]
            radius = self.random.choice([0.9, self.between(0.9, 2.2), self.between(0.9, 0.4 * max(self.extent))]) * self.spacing
            out.append("%s < %.6g" % (self.squares(at), radius ** 2))
        return out

    def shape_of_grain(self):
        """Cells of two to four seeds, of which one may be the rest."""
        seeds = [[self.between(low, high) for low, high in zip(self.lower, self.upper)] for _ in range(self.random.randint(2, 4))]
        cell = lambda own: " && ".join("%s < %s" % (self.squares(own), self.squares(other)) for other in seeds if other is not own)
        return [cell(own) for own in seeds[self.random.choice([0, 1]):]]

    def shape_of_oblique(self):
        """Behind an oblique plane, or between two."""
        at = [self.between(low, high) for low, high in zip(self.lower, self.upper)]
        slopes = [self.random.choice([1.0, -1.0, 0.5, self.between(-1, 1)]) for _ in at]
        height = " + ".join("%.3g*(%s - (%.9g))" % row for row in zip(slopes, self.axes, at))
        limits = ["%s > 0" % height] + (["%s < %.6g" % (height, self.between(0.8, 3) * self.spacing)] if self.maybe(0.4) else [])
        return [" && ".join(limits)]

    def interfaces(self, scene, criterion):
        """Between some pairs of regions: the same criterion with other numbers."""
        names = [region["set"] for region in scene["region"]] + ["rest"]
        pairs = list(itertools.combinations(names, 2))
        chosen = [pair for pair in self.random.sample(pairs, len(pairs)) if self.maybe(0.4)] or pairs[:1]
        words = {key: value for key, value in criterion.items() if isinstance(value, (bool, str)) and key in self.tables.parts["damage"][criterion["type"]].keys}
        limits = lambda: self.part("damage", criterion["type"], leave=("softening", *words))
        return [{"between": list(pair), "damage": as_table(limits()) | words} for pair in chosen[:3]]

    # -- cracks -------------------------------------------------------------------------------------------------------------------------------

    def crack(self):
        """Across an axis and from a side, or somewhere and oblique."""
        corners = self.straight_crack() if self.maybe(0.5) else self.oblique_crack()
        return {"segment" if self.dimension == 2 else "polygon": corners}

    def straight_crack(self):
        at = rounded(self.lower[0] + self.random.choice([self.between(0.3, 0.7) * self.extent[0], self.random.randint(1, self.extent[0] - 1)]) * self.spacing)
        y0, y1 = self.lower[1] - 0.5 * self.spacing, self.lower[1] + self.between(0.2, 0.6) * (self.upper[1] - self.lower[1])
        if self.dimension == 2:
            return [[at, rounded(y0)], [rounded(at + self.random.choice([0, self.between(-1, 1)]) * self.spacing), rounded(y1)]]
        z0, z1 = rounded(self.lower[2] - self.spacing), rounded(self.upper[2] + self.spacing)
        return [[at, rounded(y0), z0], [at, rounded(y1), z0], [at, rounded(y1), z1], [at, rounded(y0), z1]]

    def oblique_crack(self):
        """3D: a triangle or a parallelogram; half of them inside of the body."""
        at = [self.between(low, high) for low, high in zip(self.lower, self.upper)]
        sides = [[self.between(-0.5, 0.5) * self.size for _ in at] for _ in range(self.dimension - 1)]
        ends = [[a + b for a, b in zip(at, side)] for side in sides]
        if self.dimension == 3 and self.maybe(0.5):
            ends.insert(1, [a + b + c for a, b, c in zip(at, *sides)])
        return [at] + ends
