"""Runs of the double cantilever beam (configs/fracture/double_cantilever.toml) for the tools beside this file: on lattices, turned and jittered, with any
kinematics, influence function, horizon and softening. Needs numpy."""

import argparse
import pathlib
import subprocess

import turned_lattice

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = ROOT / "configs/fracture/double_cantilever.toml"
KINEMATICS = {  # by name in the tables
    "`bond_based`": '{type="bond_based",surface_correction="none"}',
    "`ordinary`": '{type="ordinary",surface_correction="none"}',
    "`baqp`": "baqp",
    "`projection`": "projection",
    "`bond_associated`": "bond_associated",
    "`conventional` with `silling`": '{type="conventional",stabilization={type="silling",coefficient=1.0}}',
    "`conventional` with `wan`": '{type="conventional",stabilization="wan"}',
}


def options_of(doc):
    """What the command line of a tool asks for: `perikit`, `out` and `spacing`."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("perikit")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--spacing", type=float, default=2e-3)
    return parser.parse_args()


def cell(options, kinematics, kernel="constant", ratio=3.015, degrees=0, jitter=0, softening=4):
    """Energy per new area and G, over Gc, as a cell of a table; a run that is done is kept. `kinematics`: a name of KINEMATICS."""
    name = "%s_%s_%g_%g_%g_%g" % (kinematics.strip("`").replace("` with `", "_"), kernel, ratio, degrees, jitter, softening)
    folder = options.out / "".join(c if c.isalnum() else "_" for c in name)
    result = folder.with_suffix(".txt")
    if not result.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        scene = folder.with_suffix(".toml")
        scene.write_text(turned_lattice.turned(SCENE.read_text(), folder, options.spacing, degrees, (0, -0.01), (0.1, 0.01)))
        settings = ["kinematics=" + KINEMATICS[kinematics], "family.influence=" + kernel, "family.horizon_ratio=%g" % ratio,
                    "constants.dx=%g" % options.spacing, "integrator.steps=40", "integrator.bond_rounds=10000",
                    "damage.softening=%g" % softening, "interface.0.damage.softening=%g" % softening]
        if not degrees:
            settings += ["body.lattice.spacing=%g" % options.spacing, "body.lattice.jitter=%g" % jitter]
        command = [str(ROOT / "framework/tools/double_cantilever.sh"), "--scene", str(scene), options.perikit, str(folder), "--force"]
        done = subprocess.run(command + [word for setting in settings for word in ("--set", setting)], capture_output=True, text=True, check=False)
        result.write_text(done.stdout if done.returncode == 0 else "failed: " + done.stderr.strip().splitlines()[-1] + "\n")
    words = result.read_text().split()
    return "%.2f, %.2f" % (float(words[0]), float(words[1])) if len(words) == 6 else " ".join(words)


def table(head, columns, rows):
    """Prints a Markdown table. rows: pairs of a name and the functions that give its cells."""
    print("| %s | %s |\n|%s" % (head, " | ".join(columns), "---|" * (1 + len(columns))))
    for name, cells in rows:
        print("| %s | %s |" % (name, " | ".join(one() for one in cells)), flush=True)
