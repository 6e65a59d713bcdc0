#!/usr/bin/env python3
"""Cracks that branch (configs/fracture/branching.toml), by kinematics, orientation of the lattice, horizon and spacing: what they take per area, and
where and at what angle the first one branches. A Markdown table is printed; it is that of framework/docs/fracture.md, "Branches".

    branching.py PERIKIT OUT [--spacings 1e-3 5e-4] [--threads 1]

Runs that are done are kept: a stopped command goes on where it was. Needs numpy and h5py.

Cracked is a point with damage above 0.3: the lips of a straight crack along the lattice have lost 0.39 (horizon 3) and 0.42 (horizon 4), the rows behind them 0.21
and 0.27. Measured in the last frame in which three points with 90 mm < x < 96 mm and |y| < 12 mm are not cracked yet. Columns are two
spacings wide; the cracked points of one make as many arms as there are gaps of more than three spacings between them, and one more. Length of the
cracks, projected on the axis of the notch: the sum over the columns beyond it, each arm with the width of the column. Area: the length, per thickness. First
branch: the first column from which on those of the next 6 mm have two arms or more within |y| < 12 mm, but for one of them. Angle: between the lines from
the outermost cracked points above and below there to those 7 to 9 mm farther, where two arms have come so far.
"""

import argparse
import math
import pathlib

import h5py
import numpy

import kept_runs
import turned_lattice

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "configs/fracture/branching.toml"
NOTCH, GC = 0.05, 3.0  # [m], [J/m^2]
STRESS = {"bond_based": 2.0e6, "baqp": 3.0e6}  # at which they branch on coarse lattices, too [Pa]
SETTINGS = {"bond_based": '{type="bond_based",surface_correction="none"}'}
LATTICES = [("along", 0, 0.0), ("turned by 30 degrees", 30, 0.0), ("jittered by 0.2", 0, 0.2)]


def run(perikit, folder, spacing, kinematics, ratio, degrees, jitter, threads):
    settings = ["kinematics=" + SETTINGS.get(kinematics, kinematics), "family.horizon_ratio=%g" % ratio, "constants.dx=%g" % spacing,
                "constants.sigma=%g" % STRESS[kinematics]]
    if not degrees:
        settings += ["body.lattice.spacing=%g" % spacing] + (["body.lattice.jitter=%g" % jitter] if jitter else [])
    kept_runs.run(perikit, folder, settings, threads,
                  lambda: turned_lattice.turned(SCENE.read_text(), folder, spacing, degrees, (0, -0.02), (0.1, 0.02)))


def arms(y, spacing):
    return int((numpy.diff(numpy.sort(y)) > 3 * spacing).sum()) + 1 if len(y) else 0


def measured(folder, spacing):
    """Energy per area over Gc, length of the cracks [m], first branch [m], angle [degrees]; the last two None without a branch."""
    with h5py.File(folder / "reference.h5") as file:
        x, y = file["position"][:, 0], file["position"][:, 1]
    rows = [line.split(",") for line in (folder / "history.csv").read_text().splitlines() if not line.startswith("#")]
    history = {name: numpy.array([float(row[k]) for row in rows[1:]]) for k, name in enumerate(rows[0])}
    cracked = time = None
    for frame in sorted((folder / "frames").glob("*.h5")):
        with h5py.File(frame) as file:
            damage, now = file["damage"][:], float(file.attrs["time"])
        beyond = damage > 0.3
        if (beyond & (x > 0.09) & (x < 0.096) & (abs(y) < 0.012)).sum() >= 3:
            break
        cracked, time = beyond, now
    dissipated = numpy.interp(time, history["time"], history["dissipated_energy"])
    columns = numpy.arange(NOTCH, 0.09, 2 * spacing)
    of_column = [y[cracked & (x >= c) & (x < c + 2 * spacing)] for c in columns]
    length = 2 * spacing * sum(arms(heights, spacing) for heights in of_column)
    if length == 0:
        return None
    cost = dissipated / (GC * length)
    of_column = [heights[abs(heights) < 0.012] for heights in of_column]
    counts = numpy.array([arms(heights, spacing) for heights in of_column])
    ahead = round(0.006 / (2 * spacing))
    branched = [k for k in range(len(columns) - ahead) if counts[k] > 1 and (counts[k:k + ahead] < 2).sum() <= 1]
    if not branched:
        return cost, length, None, None
    first = columns[branched[0]]
    far = cracked & (abs(y) < 0.012) & (x > first + 0.007) & (x < first + 0.009)
    here = of_column[branched[0]]
    angle = math.atan((y[far].max() - here.max()) / 0.008) + math.atan((here.min() - y[far].min()) / 0.008) if arms(y[far], spacing) > 1 else math.nan
    return cost, length, first, math.degrees(angle)


def words(measures):
    if measures is None:
        return "no crack"
    cost, length, place, angle = measures
    branch = "no branch" if place is None else "branches at %.0f mm, " % (1e3 * place) + ("one arm stops" if math.isnan(angle) else "%.0f degrees" % angle)
    return "%.2f, %.0f mm, %s" % (cost, 1e3 * length, branch)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("perikit")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--spacings", type=float, nargs="+", default=[1e-3, 5e-4])
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    cases = [(ratio, spacing) for spacing in options.spacings for ratio in (3.015, 4.015)]
    print("| kinematics | lattice | " + " | ".join("horizon %g, %g mm" % (round(ratio), 1e3 * spacing) for ratio, spacing in cases) + " |")
    print("|" + "---|" * (2 + len(cases)))
    for kinematics in STRESS:
        for name, degrees, jitter in LATTICES:
            cells = []
            for ratio, spacing in cases:
                folder = options.out / ("%s_%d_%d_%d_%d" % (kinematics, degrees, round(10 * jitter), round(ratio), round(1e6 * spacing)))
                run(options.perikit, folder, spacing, kinematics, ratio, degrees, jitter, options.threads)
                cells.append(words(measured(folder, spacing)))
            print("| `%s` | %s | %s |" % (kinematics, name, " | ".join(cells)), flush=True)


main()
