#!/usr/bin/env python3
"""The compact tension specimen of configs/fracture/compact_tension.toml beside linear elastic fracture mechanics. A Markdown table is printed; it is
that of framework/docs/fracture.md, "What a crack costs".

    compact_tension.py PERIKIT OUT [--threads 1] [--kinematics baqp ...]

Runs that are done are kept: a stopped command goes on where it was.

Stiffness: load over opening before the crack grows, over that of fracture mechanics. Peak: the largest load over that at which fracture mechanics
lets the crack grow. Then, from 1.1 times to twice the initial length of the crack, the load over that of fracture mechanics at the same opening (mean, least,
largest), and the energy dissipated per new area over Gc; the length is by what the rows beside the crack have lost.
"""

import argparse
import csv
import math
import pathlib

import kept_runs

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "configs/fracture/compact_tension.toml"
E, GC, W, A0, EDGE = 3e9, 500.0, 0.04, 0.018, 0.01
KINEMATICS = {  # by name in the table
    "`bond_based`": '{type="bond_based",surface_correction="none"}',
    "`ordinary`": '{type="ordinary",surface_correction="none"}',
    "`baqp`": "baqp",
    "`projection`": "projection",
    "`bond_associated`": "bond_associated",
    "`conventional` with `silling`, 1": '{type="conventional",stabilization={type="silling",coefficient=1.0}}',
    "`conventional` with `wan`": '{type="conventional",stabilization="wan"}',
}


def intensity(ratio):
    """K sqrt(W)/P per thickness of a crack of the length ratio*W [Srawley 1976]."""
    return (2 + ratio) / (1 - ratio) ** 1.5 * (0.886 + 4.64 * ratio - 13.32 * ratio**2 + 14.72 * ratio**3 - 5.6 * ratio**4)


def compliance(ratio):
    """E v/P per thickness, v the opening on the load line [Saxena and Hudak 1978]."""
    polynomial = 2.1630 + 12.219 * ratio - 20.065 * ratio**2 - 0.9925 * ratio**3 + 20.609 * ratio**4 - 9.9314 * ratio**5
    return ((1 + ratio) / (1 - ratio)) ** 2 * polynomial


def growing_load(ratio):
    """The load per thickness at which a crack of this length grows, K^2 = E Gc [N/m]."""
    return math.sqrt(E * GC * W) / intensity(ratio)


def load_at(opening):
    """That of the crack which has grown until it stands at this opening [N/m]."""
    low, high = 0.2, 0.975
    for _ in range(60):
        middle = 0.5 * (low + high)
        if growing_load(middle) * compliance(middle) / E < opening:
            low = middle
        else:
            high = middle
    return growing_load(low)


def measured(folder):
    with open(folder / "history.csv") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    start = rows[0]["lost"]
    first, ratios, work = rows[1], [], []
    stiffness = first["pull"] / (first["up"] - first["down"]) * compliance(A0 / W) / E
    peak = max(row["pull"] for row in rows) / growing_load(A0 / W)
    for row in rows[1:]:
        length = (A0 + EDGE) * row["lost"] / start - EDGE
        if 1.1 * A0 <= length <= 2 * A0:
            ratios.append(row["pull"] / load_at(row["up"] - row["down"]))
            work.append((length, row["dissipated_energy"]))
    if len(work) < 3:
        return "%.3f" % stiffness, "%.2f" % peak, "too short a crack", ""
    per_area = (work[-1][1] - work[0][1]) / (work[-1][0] - work[0][0]) / GC
    return "%.3f" % stiffness, "%.2f" % peak, "%.3f (%.3f to %.3f)" % (sum(ratios) / len(ratios), min(ratios), max(ratios)), "%.2f" % per_area


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("perikit")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--kinematics", nargs="+", metavar="NAME", help="a part of the names in the table; all without it")
    options = parser.parse_args()
    print("| kinematics | bonds fail | stiffness | peak | load | energy per area |\n|" + "---|" * 6)
    for name, kinematics in KINEMATICS.items():
        if options.kinematics and not any(asked in name for asked in options.kinematics):
            continue
        for softening in (1, 4):
            folder = options.out / ("%s_%d" % ("".join(c if c.isalnum() else "_" for c in name).strip("_"), softening))
            settings = ["kinematics=" + kinematics, "damage.softening=%g" % softening, "interface.0.damage.softening=%g" % softening]
            kept_runs.run(options.perikit, folder, settings, options.threads, SCENE.read_text)
            print("| %s | %s | %s |" % (name, "at once" if softening == 1 else "softening 4", " | ".join(measured(folder))), flush=True)


main()
