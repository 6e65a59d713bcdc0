#!/usr/bin/env python3
"""Clouds against closed forms: the tables of framework/docs/orders.md.

  clouds.py PROGRAM FOLDER           every table, into FOLDER/clouds.md: some minutes
  clouds.py PROGRAM FOLDER --small   a few coarse bodies; fails where an error is larger than it should be

Points are made here: in polar rings, at random with a least distance (blue noise, everywhere the same or graded), and at the centroids of a
triangulation. The scenes are configs/clouds/*.toml and configs/pressure/lame_cylinder.toml.
"""
import csv
import math
import os
import random
import subprocess
import sys

CONFIGS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "configs")
KINEMATICS = {"baqp": '"baqp"', "projection": '"projection"', "bond_associated": '"bond_associated"', "bond_augmented": '"bond_augmented"',
              "non_spherical": '"non_spherical"', "conventional + silling": '{ type = "conventional", stabilization = "silling" }',
              "conventional + wan": '{ type = "conventional", stabilization = "wan" }', "sub_horizon": '"sub_horizon"'}


class Failure(Exception):
    pass


def polar(a, b, rings):
    """A quarter of a ring, in cells of equal height: centroids and volumes."""
    points = []
    h = (b - a) / rings
    for i in range(rings):
        r0, r1 = a + i * h, a + (i + 1) * h
        cells = max(1, round(math.pi / 2 * (r0 + r1) / 2 / h))
        angle = math.pi / 2 / cells
        r = 2 / 3 * (r1**3 - r0**3) / (r1**2 - r0**2) * math.sin(angle / 2) / (angle / 2)
        for j in range(cells):
            t = (j + 0.5) * angle
            points.append((r * math.cos(t), r * math.sin(t), (r1**2 - r0**2) / 2 * angle))
    return points


def blue_noise(upper, spacing, inside=lambda x, y, rim: True, seed=1):
    """Points at random, no two of them nearer than 0.77 spacings, until there is no room: about as many as a lattice of that spacing has.
    spacing: of x, y. None lies nearer than a quarter of a spacing to the sides of the box, nor to where `inside` ends, since cells that are slivers
    count for nothing but trouble."""
    generator = random.Random(seed)
    size = min(spacing(x * upper[0] / 16, y * upper[1] / 16) for x in range(17) for y in range(17)) * 0.77
    grid = {}
    points = []

    def fits(x, y):
        least = 0.77 * spacing(x, y)
        reach = math.ceil(least / size)
        i, j = int(x / size), int(y / size)
        for k in range(i - reach, i + reach + 1):
            for other in (p for l in range(j - reach, j + reach + 1) for p in grid.get((k, l), ())):
                if (other[0] - x)**2 + (other[1] - y)**2 < least**2:
                    return False
        return True

    cells = [(i, j) for i in range(int(upper[0] / size) + 1) for j in range(int(upper[1] / size) + 1)]
    for attempt in range(30):
        generator.shuffle(cells)
        for i, j in cells:
            x, y = (i + generator.random()) * size, (j + generator.random()) * size
            rim = 0.25 * spacing(x, y)
            if rim < x < upper[0] - rim and rim < y < upper[1] - rim and inside(x, y, rim) and fits(x, y):
                points.append((x, y))
                grid.setdefault((i, j), []).append((x, y))
    return points


def centroids(upper, spacing, seed=1):
    """Of the triangles of a mesh whose inner nodes are moved by up to 0.2 spacings: centroids and areas."""
    generator = random.Random(seed)
    n, m = round(upper[0] / spacing), round(upper[1] / spacing)
    move = lambda k, last: 0 if k in (0, last) else 0.2 * (2 * generator.random() - 1)
    node = {(i, j): ((i + move(i, n)) * upper[0] / n, (j + move(j, m)) * upper[1] / m) for i in range(n + 1) for j in range(m + 1)}
    points = []
    for i in range(n):
        for j in range(m):
            a, b, c, d = node[i, j], node[i + 1, j], node[i + 1, j + 1], node[i, j + 1]
            for p, q, r in ((a, b, c), (a, c, d)) if (i + j) % 2 else ((a, b, d), (b, c, d)):
                area = ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / 2
                points.append(((p[0] + q[0] + r[0]) / 3, (p[1] + q[1] + r[1]) / 3, area))
    return points


class Runs:
    def __init__(self, program, folder):
        self.program, self.folder, self.count = program, os.path.abspath(folder), 0
        os.makedirs(self.folder, exist_ok=True)

    def points(self, points):
        """[body.points], without the last brace."""
        self.count += 1
        name = os.path.join(self.folder, f"points_{self.count}.csv")
        with open(name, "w") as file:
            file.write("x,y,volume\n" if len(points[0]) == 3 else "x,y\n")
            file.writelines(",".join(repr(float(value)) for value in point) + "\n" for point in points)
        return f'points = {{ file = "{name}"' + ("" if len(points[0]) == 3 else ', volume = "voronoi"')

    def history(self, scene, values):
        """Columns of history.csv."""
        out = os.path.join(self.folder, "run")
        command = [self.program, "run", os.path.join(CONFIGS, scene), "-o", out, "--quiet", "--force"]
        for key, value in values.items():
            command += ["--set", f"{key}={value}"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise Failure(" ".join(command) + "\n" + done.stderr)
        with open(os.path.join(out, "history.csv")) as file:
            rows = list(csv.reader(file))
        return {name: [float(row[k]) for row in rows[1:]] for k, name in enumerate(rows[0])}


def tube(runs, rings, cloud, kinematics):
    """Relative error of the displacement of Lame's tube, n points through the wall."""
    h = 1.0 / rings
    inside = "sqrt(x^2 + y^2) > a && sqrt(x^2 + y^2) < b"
    if cloud == "polar":
        points = runs.points(polar(1.0, 2.0, rings)) + " }"
    elif cloud == "blue noise":
        points = runs.points(blue_noise((2, 2), lambda x, y: h, lambda x, y, rim: 1 + rim < math.hypot(x, y) < 2 - rim)) + f', lower = [0, 0], upper = [2, 2], inside = "{inside}" }}'
    else:
        jitter = 'jitter = 0.3, volume = "voronoi", ' if cloud == "jitter 0.3" else ""
        points = f'lattice = {{ spacing = {h}, lower = [0, 0], upper = [2, 2], {jitter}inside = "{inside}" }}'
    history = runs.history("pressure/lame_cylinder.toml", {
        "body": f'{{ dimension = 2, plane = "strain", {points} }}', "family": f'{{ horizon = {3.015 * h}, influence = "cubic_spline" }}', "kinematics": kinematics})
    return math.hypot(history["error_x"][-1], history["error_y"][-1]) / math.sqrt(2)


def hole(runs, n, cloud, kinematics):
    """Relative errors of the displacement and of the stress of Kirsch's plate."""
    values = {"constants.n": n, "kinematics": kinematics}
    if cloud == "blue noise":
        points = runs.points(blue_noise((1, 1), lambda x, y: 1 / n, lambda x, y, rim: math.hypot(x, y) > 0.25 + rim))
        values["body"] = f'{{ dimension = 2, plane = "stress", {points}, lower = [0, 0], upper = [1, 1], inside = "x^2 + y^2 > a^2" }} }}'
    elif cloud == "lattice":
        values.update({"body.lattice.jitter": 0, "body.lattice.volume": '"cell"'})
    elif cloud == "polar":
        h = 1.25 / round(1.25 * n)   # beyond the corner of the plate, as far as the rim reaches
        rings = [p for p in polar(0.25, 1.5, round(1.25 / h)) if p[0] < 1 and p[1] < 1]
        values["body"] = f'{{ dimension = 2, plane = "stress", {runs.points(rings)} }} }}'
    history = runs.history("clouds/kirsch.toml", values)
    return math.hypot(history["error_x"][-1], history["error_y"][-1]) / math.sqrt(2), history["error_stress"][-1]


def bar(runs, cloud, n, kinematics, consistent=True):
    """Relative error of the force that stretches the bar of configs/clouds/bar.toml, n points along it."""
    h = 1 / n
    horizon = 3.015 * h
    if cloud.startswith("jitter"):
        body = f'lattice = {{ spacing = {h}, lower = [0, 0], upper = [1, 0.5], jitter = {cloud.split()[1]}, volume = "voronoi" }}'
    elif cloud == "blue noise":
        body = runs.points(blue_noise((1, 0.5), lambda x, y: h)) + ", lower = [0, 0], upper = [1, 0.5] }"
    elif cloud == "graded":   # the spacing grows threefold from left to right; the horizon is 3 of the middle one
        body = runs.points(blue_noise((1, 0.5), lambda x, y: h * (0.5 + x))) + ", lower = [0, 0], upper = [1, 0.5] }"
    else:
        points = centroids((1, 0.5), h * math.sqrt(2))   # of half the area each
        body = runs.points(points) + " }"
    sides = ('[{ face = "-x", at = 0, displacement = [0, "free"] }, { face = "+x", at = 1, displacement = [1e-3, "free"] }, '
             '{ set = "middle", displacement = ["free", 0] }]')
    history = runs.history("clouds/bar.toml", {"body": f'{{ dimension = 2, plane = "stress", {body} }}', "boundary": sides, "kinematics": kinematics,
                                               "family": f'{{ horizon = {horizon}, influence = "cubic_spline", consistent = {str(consistent).lower()} }}'})
    return abs(history["pull"][-1]) / 0.5 - 1


def waves(runs, n, jitter, kinematics):
    """Speeds of longitudinal and transverse waves over those of the continuum, at four angles."""
    volume = '"voronoi"' if jitter else '"cell"'
    history = runs.history("clouds/waves.toml", {"constants.n": n, "body.lattice.jitter": jitter, "body.lattice.volume": volume, "kinematics": kinematics})
    young, nu = 1.0, 0.25
    lame, mu = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))
    squares = [1 / (4 * energy * 65 * (2 * math.pi)**2) for energy in history["strain_energy"][-8:]]
    return [math.sqrt(c / (lame + 2 * mu)) for c in squares[:4]], [math.sqrt(c / mu) for c in squares[4:]]


def order(coarse, fine, factor):
    return math.log(coarse / fine) / math.log(factor)


def all_tables(runs, write):
    def table(head, rows):
        write("| " + " | ".join(head) + " |\n|" + "---|" * len(head) + "\n")
        for row in rows:
            write("| " + " | ".join(row()) + " |\n")
        write("\n")

    def attempt(make):
        try:
            return make()
        except Failure as failure:
            return str(failure).strip().splitlines()[-1][:90]

    def percent(error):
        return error if isinstance(error, str) else f"{100 * error:.2g} %"

    table(["force on the bar", "jitter 0.1", "jitter 0.2", "jitter 0.3", "jitter 0.4", "blue noise", "graded", "centroids"],
          [lambda name=name, n=n, consistent=consistent: [f"`{name}`, {n} points along" + ("" if consistent else ", `consistent = false`")] +
           [percent(attempt(lambda: bar(runs, cloud, n, KINEMATICS[name], consistent)))
            for cloud in ("jitter 0.1", "jitter 0.2", "jitter 0.3", "jitter 0.4", "blue noise", "graded", "centroids")]
           for name, n, consistent in [("baqp", 40, False)] + [(name, 40, True) for name in KINEMATICS] + [("baqp", 80, True), ("projection", 80, True)]])
    clouds = ("lattice", "jitter 0.3", "blue noise", "polar")

    def orders(measure, name, sizes):
        cells = []
        for cloud in clouds:
            errors = attempt(lambda: [measure(size, cloud, KINEMATICS[name]) for size in sizes])
            cells.append(errors if isinstance(errors, str) else ", ".join(percent(e) for e in errors) + f" ({order(errors[0], errors[-1], sizes[-1] / sizes[0]):.1f})")
        return cells

    shown = ("baqp", "projection", "bond_associated", "conventional + silling", "sub_horizon")
    table(["tube, displacement; 8, 16, 32 through the wall (order)"] + list(clouds),
          [lambda name=name: [f"`{name}`"] + orders(lambda n, cloud, k: tube(runs, n, cloud, k), name, (8, 16, 32)) for name in shown])
    for what, place in (("displacement", 0), ("stress", 1)):
        table([f"plate with a hole, {what}; 20, 40, 80 along a side (order)"] + list(clouds),
              [lambda name=name: [f"`{name}`"] + orders(lambda n, cloud, k: hole(runs, n, cloud, k)[place], name, (20, 40, 80)) for name in shown])

    def speeds(name, jitter):
        result = attempt(lambda: waves(runs, 64, jitter, KINEMATICS[name]))
        if isinstance(result, str):
            return [result, "", ""]
        both = result[0] + result[1]
        spread = [100 * (max(kind) - min(kind)) / (sum(kind) / 4) for kind in result]
        return [", ".join(f"{c:.3f}" for c in result[0]), ", ".join(f"{c:.3f}" for c in result[1]), f"{spread[0]:.2g} %, {spread[1]:.2g} %"]

    table(["wave speed over that of the continuum", "longitudinal, at 7, 30, 60, 83 degrees", "transverse", "spread over the angles"],
          [lambda name=name, jitter=jitter: [f"`{name}`, " + (f"jitter {jitter}" if jitter else "lattice")] + speeds(name, jitter)
           for name in KINEMATICS for jitter in (0, 0.1, 0.3)])


def small(runs):
    """What a test asks for."""
    faults = []

    def expect(what, value, least, most):
        print(f"{what}: {value:.4g}, allowed {least:g} to {most:g}", flush=True)
        if not least <= value <= most:
            faults.append(what)

    for cloud in ("jitter 0.4", "blue noise", "centroids", "graded"):
        expect(f"bar on {cloud}, force", bar(runs, cloud, 20, KINEMATICS["baqp"]), -2e-3, 2e-3)
    expect("bar on blue noise as it comes, force", bar(runs, "blue noise", 20, KINEMATICS["baqp"], False), -0.4, -0.005)
    for cloud in ("polar", "blue noise"):
        coarse, fine = (tube(runs, n, cloud, KINEMATICS["baqp"]) for n in (8, 16))
        expect(f"tube on {cloud}, order", order(coarse, fine, 2), 0.6, 3)
        expect(f"tube on {cloud}, error", fine, 0, 0.04)
        error, stress = hole(runs, 20, cloud, KINEMATICS["projection"])
        expect(f"plate with a hole on {cloud}, displacement", error, 0, 0.04)
        expect(f"plate with a hole on {cloud}, stress", stress, 0, 0.12)
    lattice, cloud = (waves(runs, 40, jitter, KINEMATICS["projection"]) for jitter in (0, 0.3))
    for k, kind in enumerate(("longitudinal", "transverse")):
        for j in range(4):
            expect(f"{kind} wave {j + 1} on a cloud over that on a lattice", cloud[k][j] / lattice[k][j], 0.96, 1.04)
            expect(f"{kind} wave {j + 1} and its mirror image", lattice[k][j] / lattice[k][3 - j], 1 - 1e-6, 1 + 1e-6)
    if faults:
        raise SystemExit("beyond what is allowed: " + "; ".join(faults))


def main():
    if len(sys.argv) not in (3, 4) or (len(sys.argv) == 4 and sys.argv[3] != "--small"):
        raise SystemExit(__doc__)
    runs = Runs(sys.argv[1], sys.argv[2])
    if len(sys.argv) == 4:
        return small(runs)
    with open(os.path.join(runs.folder, "clouds.md"), "w") as page:
        def write(text):
            page.write(text)
            page.flush()
        all_tables(runs, write)


main()
