#!/usr/bin/env python3
"""What a crack costs with every influence function: the double cantilever beam (configs/fracture/double_cantilever.toml, an interface between its arms) at
twice the spacing, with bonds that weaken (softening 4). Energy per new area and G, over Gc. Two Markdown tables are printed, those of framework/docs/fracture.md,
"What a crack costs": by kinematics with a horizon of three spacings; and by horizon, on lattices turned by 22.5 and 45 degrees and on jittered ones.

    kernel_cost.py PERIKIT OUT [--spacing 2e-3]

Runs that are done are kept. Needs numpy.
"""

import argparse
import pathlib
import subprocess

import turned_lattice

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "configs/fracture/double_cantilever.toml"
KERNELS = {  # by name in the tables
    "`constant`": "constant",
    "`inverse`": "inverse",
    "`cone`": "cone",
    "`gaussian`": "gaussian",
    "`cubic_spline`": "cubic_spline",
    "exp(-9 r^2)": '{type="expression",formula="exp(-9*r^2)"}',
    "5 exp(-9 r^2)": '{type="expression",formula="5*exp(-9*r^2)"}',
}
KINEMATICS = {
    "`ordinary`": "ordinary",
    "`baqp`": "baqp",
    "`projection`": "projection",
    "`bond_associated`": "bond_associated",
    "`conventional` with `silling`": '{type="conventional",stabilization={type="silling",coefficient=1.0}}',
    "`conventional` with `wan`": '{type="conventional",stabilization="wan"}',
}
PLACES = [(2.015, 0, 0), (4.015, 0, 0), (5.015, 0, 0), (6.015, 0, 0), (3.015, 22.5, 0), (3.015, 45, 0), (3.015, 0, 0.2)]  # horizon, degrees, jitter


def cell(options, kinematics, kernel, ratio, degrees, jitter):
    name = "%s_%s_%g_%g_%g" % (kinematics, kernel, ratio, degrees, jitter)
    folder = options.out / "".join(c if c.isalnum() else "_" for c in name)
    result = folder.with_suffix(".txt")
    if not result.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        scene = folder.with_suffix(".toml")
        scene.write_text(turned_lattice.turned(SCENE.read_text(), folder, options.spacing, degrees, (0, -0.01), (0.1, 0.01)))
        settings = ["kinematics=" + KINEMATICS[kinematics], "family.influence=" + KERNELS[kernel], "family.horizon_ratio=%g" % ratio,
                    "constants.dx=%g" % options.spacing, "integrator.steps=40"]
        if not degrees:
            settings += ["body.lattice.spacing=%g" % options.spacing, "body.lattice.jitter=%g" % jitter]
        command = [str(ROOT / "framework/tools/double_cantilever.sh"), "--scene", str(scene), options.perikit, str(folder), "--force"]
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
    print("| kernel | " + " | ".join(KINEMATICS) + " |\n|" + "---|" * (1 + len(KINEMATICS)))
    for kernel in KERNELS:
        print("| %s | %s |" % (kernel, " | ".join(cell(options, kinematics, kernel, 3.015, 0, 0) for kinematics in KINEMATICS)), flush=True)
    names = ["turned by %g degrees" % d if d else "jittered by %g" % j if j else "horizon %d" % r for r, d, j in PLACES]
    print("\n| kinematics, kernel | " + " | ".join(names) + " |\n|" + "---|" * (1 + len(names)))
    for kinematics in ("`ordinary`", "`baqp`"):
        for kernel in list(KERNELS)[:5]:
            print("| %s, %s | %s |" % (kinematics, kernel, " | ".join(cell(options, kinematics, kernel, *place) for place in PLACES)), flush=True)


main()
