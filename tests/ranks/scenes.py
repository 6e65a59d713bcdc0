"""Scenes for runs on several ranks, and what compares their results."""

import filecmp
import os
import shutil
import subprocess
import sys

SKIPPED = 77

ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMP_WAIT_POLICY="passive")

failed = []   # what `check` has not found


def check(condition, what):
    print(("ok      " if condition else "FAILED  ") + what, flush=True)
    if not condition:
        failed.append(what)


def skip(why):
    print("skipped: " + why)
    sys.exit(SKIPPED)


def need(library):
    """Leaves with a clear word where runs on several ranks cannot be had or compared."""
    if not os.path.exists(library):
        skip("perikit was built without MPI (%s is not there)" % library)
    for program in ("mpirun", "h5diff", "h5import"):
        if not shutil.which(program):
            skip("no %s on this machine" % program)


def hide_petsc(library, work):
    """The environment of a perikit that was built without PETSc: the loader finds the framework in a folder in which that library is not."""
    folder = os.path.join(work, "without_petsc")
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    beside = os.path.dirname(library)
    for name in os.listdir(beside):
        if name.startswith("libperikit.so") or name == os.path.basename(library):
            os.symlink(os.path.join(beside, name), os.path.join(folder, name))
    return {"LD_LIBRARY_PATH": folder}


def vector(values):
    return "[" + ", ".join(str(value) for value in values) + "]"


def scene(kinematics, dimension=2, cloud=False, integrator='type = "verlet"\nend_time = 6.0', material="", extra="", cells=None):
    """A block that is held, pulled and shaken: `kinematics` are the lines of its section."""
    cells = cells or {1: [1200], 2: [32, 26], 3: [14, 12, 11]}[dimension]
    axes = "xyz"[:dimension]
    shake = {1: ["0.01*sin(x/3)"], 2: ["0.01*sin(x)*cos(y/2)", "0.004*cos(x/5 + y)"],
             3: ["0.01*sin(x)*cos(y/2)", "0.004*cos(x/5 + y)", "0.003*sin(z - x/4)"]}[dimension]
    length = cells[0]
    fields = ["displacement", "velocity", "internal_force", "external_force", "strain_energy_density", "reaction"]
    if "hypoelastic" in material:
        fields = ["state:unrotated_stress", "state:work"] + fields
    if '"j2"' in material:
        fields = ["state:plastic_strain", "state:equivalent_plastic_strain"] + fields
    return """format = 1
[body]
dimension = {dimension}
{state}
[body.lattice]
spacing = 1.0
lower = {lower}
upper = {upper}
jitter = {jitter}
[sets]
low = "x < 2"
high = "x > {high}"
middle = {{ nearest = {middle} }}
[family]
horizon_ratio = {ratio}
[kinematics]
{kinematics}
[material]
{material}
[initial]
displacement = {shake}
[[boundary]]
set = "low"
displacement = {held}
[[load]]
set = "high"
force = {force}
[integrator]
{integrator}
[output]
frames = 3
history_every = 1
fields = {fields}
history = [ {{ name = "end", set = "high", quantity = "displacement", component = "x", reduce = "mean" }},
            {{ name = "middle", set = "middle", quantity = "velocity", component = "x", reduce = "max" }},
            {{ name = "slope", set = "all", quantity = "displacement", component = "x", reduce = "fit", at = {middle} }},
            {{ name = "pull", set = "low", quantity = "reaction", component = "x", reduce = "sum" }} ]
{extra}
""".format(dimension=dimension, lower=vector([0] * dimension), upper=vector(cells), jitter=0.2 if cloud else 0.0, high=length - 2,
           middle=vector([c / 2 for c in cells]), state={1: 'line = "strain"', 2: 'plane = "strain"', 3: ""}[dimension], ratio=3.015 if dimension < 3 else 2.515,
           kinematics=kinematics, material=material or 'type = "saint_venant_kirchhoff"\ndensity = 1.0\nyoungs_modulus = 2.0\npoisson_ratio = 0.3',
           shake=vector('"%s"' % s for s in shake), held=vector(['"0.01*sin(t)"'] + [0] * (dimension - 1)),
           force=vector([0.05] + ['"0.01*t"'] * (dimension - 1)), integrator=integrator, fields=str(fields).replace("'", '"'), extra=extra)


def without_velocity(text):
    """The scene for statics."""
    return text.replace('quantity = "velocity"', 'quantity = "displacement"').replace('"velocity", ', "")


# A corner that no bond leads to.
LOOSE = "[[crack]]\nsegment = [[12.0, 27.0], [33.0, 12.0]]\n"


def torn_slowly(kinematics, integrator, damage, cloud):
    """Pulled in equilibrium until it is in two, around a corner that hangs on weak springs."""
    text = without_velocity(scene(kinematics, 2, cloud, integrator))
    begin, end = text.index("[[load]]"), text.index("[integrator]")
    text = text[:begin] + '[[boundary]]\nset = "end"\ndisplacement = [1.5, 0]\n' + text[end:]
    text = text.replace("[sets]\n", '[sets]\nend = "x > 29 && y < 13"\n').replace("[integrator]", "[run]\nweak_springs = 1e-5\n[integrator]")
    return text.replace('"reaction"]', '"reaction", "damage"]') + LOOSE + damage


def run(program, text, folder, ranks=1, threads=1, options=(), limit=300, environment=None):
    """Runs the scene in an empty folder; the finished process. ranks 0: without mpirun."""
    if "--resume" not in options:
        shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder, exist_ok=True)
    file = folder + ".toml"
    with open(file, "w") as out:
        out.write(text)
    return subprocess.run(command(program, file, folder, ranks, threads, options), env=dict(ENVIRONMENT, **(environment or {})), capture_output=True, text=True, timeout=limit)


def command(program, file, folder, ranks, threads, options=()):
    # Ranks that wait let others run: machines are shared.
    before = ["mpirun", "--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1", "-np", str(ranks)] if ranks else []
    return before + [program, "run", file, "-o", folder, "--threads", str(threads), "--quiet", *options]


def differences(a, b):
    """What differs between the results in two folders, in words."""
    found = []
    frames = sorted(os.listdir(os.path.join(a, "frames")))
    if frames != sorted(os.listdir(os.path.join(b, "frames"))):
        found.append("other frames")
    for name in ["reference.h5"] + ["frames/" + frame for frame in frames]:
        if filecmp.cmp(os.path.join(a, name), os.path.join(b, name), shallow=False):
            continue
        done = subprocess.run(["h5diff", os.path.join(a, name), os.path.join(b, name)], capture_output=True, text=True)
        if done.returncode != 0:
            found.append("%s: %s" % (name, " ".join(done.stdout.split()[:12]) or done.stderr.strip()))
    with open(os.path.join(a, "history.csv"), "rb") as one, open(os.path.join(b, "history.csv"), "rb") as other:
        if one.read() != other.read():
            found.append("history.csv")
    return found
