#!/usr/bin/env python3
"""The double cantilever beam (configs/fracture/double_cantilever.toml) on lattices that are turned against the crack, at twice the spacing: energy per
new area and G over Gc with bonds that weaken. A Markdown table is printed; it is that of framework/docs/fracture.md, "What a crack costs".

    turned_beam.py PERIKIT OUT [--spacing 2e-3]

Runs that are done are kept. Needs numpy.
"""

import argparse
import pathlib
import subprocess

import turned_lattice

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "configs/fracture/double_cantilever.toml"
KINEMATICS = {  # by name in the table
    "`bond_based`": "bond_based",
    "`baqp`": "baqp",
    "`conventional` with `wan`": '{type="conventional",stabilization="wan"}',
}


def cell(perikit, folder, spacing, kinematics, degrees, softening):
    result = folder.with_suffix(".txt")
    if not result.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        scene = folder.with_suffix(".toml")
        scene.write_text(turned_lattice.turned(SCENE.read_text(), folder, spacing, degrees, (0, -0.01), (0.1, 0.01)))
        settings = ["kinematics=" + kinematics, "constants.dx=%g" % spacing, "integrator.steps=40",
                    "damage.softening=%g" % softening, "interface.0.damage.softening=%g" % softening]
        command = [str(ROOT / "framework/tools/double_cantilever.sh"), "--scene", str(scene), perikit, str(folder), "--force"]
        done = subprocess.run(command + [word for setting in settings for word in ("--set", setting)], capture_output=True, text=True, check=False)
        result.write_text(done.stdout if done.returncode == 0 else "failed: " + done.stderr.strip().splitlines()[-1] + "\n")
    words = result.read_text().split()
    return "%.2f, %.2f" % (float(words[0]), float(words[1])) if len(words) == 6 else " ".join(words)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("perikit")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--spacing", type=float, default=2e-3)
    options = parser.parse_args()
    cases = [(degrees, softening) for degrees in (15, 30, 45) for softening in (1, 4)]
    print("| kinematics | " + " | ".join("%d degrees, %s" % (d, "softening 4" if s > 1 else "at once") for d, s in cases) + " |")
    print("|" + "---|" * (1 + len(cases)))
    for name, kinematics in KINEMATICS.items():
        cells = [cell(options.perikit, options.out / ("%s_%d_%d" % (name.strip("`").replace("` with `", "_"), degrees, softening)), options.spacing,
                      kinematics, degrees, softening) for degrees, softening in cases]
        print("| %s | %s |" % (name, " | ".join(cells)), flush=True)


main()
