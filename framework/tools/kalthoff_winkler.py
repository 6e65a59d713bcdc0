#!/usr/bin/env python3
"""Kalthoff and Winkler's plate (configs/fracture/kalthoff_winkler.toml): angle, start and speed of the upper crack by kinematics, kernel,
horizon and orientation of the lattice. A Markdown table is printed; it is that of framework/docs/fracture.md, "Influence functions and the lattice".

    kalthoff_winkler.py PERIKIT OUT [--solid] [--spacing 1e-3] [--threads 1]

--solid: the plate in three dimensions, 9 mm thick (kalthoff_winkler_3d.toml), with the `constant` kernel and a horizon of three spacings.
Runs that are done are kept: a stopped command goes on where it was. Needs numpy and h5py.

Angle: of the line through the points with damage above 0.35, from 2 mm to 30 mm above the notch (of the fitted x over y, so that a vertical crack
has 90 degrees), in the first frame in which the crack has come so far: later other cracks come from the far edge. Start: the first frame in which the crack is 2 mm long. Speed: of its tip from there to 30 mm.
"""

import argparse
import math
import pathlib

import h5py
import numpy

import kept_runs
import turned_lattice

ROOT = pathlib.Path(__file__).resolve().parents[2]
PLATE, SOLID = (ROOT / "configs/fracture" / name for name in ("kalthoff_winkler.toml", "kalthoff_winkler_3d.toml"))
KINEMATICS = {  # by name: settings
    "bond_based": ['kinematics={type="bond_based",surface_correction="none"}'],
    "ordinary": ['kinematics={type="ordinary",surface_correction="none"}'],
    "baqp": ["kinematics=baqp"],
    "conventional, silling": ['kinematics={type="conventional",stabilization={type="silling",coefficient=1.0}}'],
}
KERNELS = {"bond_based": ["constant"]}  # which the influence function does not change


def run(perikit, folder, scene, spacing, kinematics, kernel, ratio, degrees, threads):
    settings = kinematics + ["family.influence=" + kernel, "family.horizon_ratio=%g" % ratio, "constants.dx=%g" % spacing,
                "output.frames=50"] + ([] if degrees else ["body.lattice.spacing=%g" % spacing])
    kept_runs.run(perikit, folder, settings, threads,
                  lambda: turned_lattice.turned(scene.read_text(), folder, spacing, degrees, (0, -0.1), (0.1, 0.1)))


def measured(folder):
    with h5py.File(folder / "reference.h5") as file:
        x = file["position"][:]
    tips, last, height = [], None, 0.0
    for frame in sorted((folder / "frames").glob("*.h5")):
        with h5py.File(frame) as file:
            damage, time = file["damage"][:], float(file.attrs["time"])
        crack = (damage > 0.35) & (x[:, 1] > 0.027) & (x[:, 0] > 0.02)
        if height <= 0.03:
            last = crack
        height = x[crack, 1].max() - 0.025 if crack.any() else 0.0
        tips.append((time, height))
    within = last & (x[:, 1] < 0.055)
    if within.sum() < 20:
        return "no crack", "", ""
    slope = numpy.polyfit(x[within, 1], x[within, 0], 1)[0]
    angle = math.degrees(math.atan2(1.0, slope))
    started = [k for k, (_, height) in enumerate(tips) if height > 0.002]
    passed = [k for k, (_, height) in enumerate(tips) if height > 0.03]
    start = "%.0f us" % (1e6 * tips[started[0]][0])
    if not passed:
        return "%.0f" % angle, start, "stops at %.0f mm" % (1e3 * tips[-1][1])
    way, time = tips[passed[0]][1] - tips[started[0]][1], tips[passed[0]][0] - tips[started[0]][0]
    return "%.0f" % angle, start, "%.0f m/s" % (way / math.sin(math.radians(angle)) / time if time > 0 else 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("perikit")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--solid", action="store_true")
    parser.add_argument("--spacing", type=float, default=1e-3)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    cases = [(3.015, 0)] if options.solid else [(3.015, 0), (4.015, 0), (3.015, 30)]
    print("| kinematics | kernel | " + " | ".join("horizon %g%s" % (round(r), ", turned by %d degrees" % d if d else "") for r, d in cases) + " |")
    print("|" + "---|" * (2 + len(cases)))
    for name, kinematics in KINEMATICS.items():
        for kernel in ("constant",) if options.solid else KERNELS.get(name, ("constant", "inverse", "cone", "gaussian", "cubic_spline")):
            cells = []
            for ratio, degrees in cases:
                folder = options.out / ("%s_%s_%d_%d%s" % (name.replace(", ", "_"), kernel, round(ratio), degrees, "_solid" if options.solid else ""))
                run(options.perikit, folder, SOLID if options.solid else PLATE, options.spacing, kinematics, kernel, ratio, degrees, options.threads)
                cells.append(", ".join(word for word in measured(folder) if word))
            print("| `%s` | `%s` | %s |" % (name, kernel, " | ".join(cells)), flush=True)


main()
