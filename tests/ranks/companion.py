"""Statics on several ranks with the companion distributed over them by PETSc, alone and within mixed systems: the results of one rank, in about its iterations.

usage: companion.py PROGRAM LIBRARY WORK
"""

import glob
import os
import re
import sys

from scenes import check, differences, failed, hide_petsc, need, run, scene, skip, torn_slowly, without_velocity

try:
    import h5py
    import numpy
except ImportError as error:
    skip(str(error))

PROGRAM, LIBRARY, WORK = sys.argv[1:]
THOROUGH = ("2D, two materials on rollers", "mixed, 3D lattice, auto", "mixed, bonds that fail at a slit")
DISTRIBUTED, GATHERED = "aggregation of PETSc on all ranks", "solved by the first rank"
BAQP = 'type = "baqp"'
STIFF = '[[region]]\nset = "some"\nmaterial = { type = "neo_hookean", density = 1.0, shear_modulus = 20.0, bulk_modulus = 30.0 }\n'


def integrator(name, steps, preconditioner="companion"):
    return 'type = "%s"\npreconditioner = "%s"\nsteps = %d\ntolerance = 1e-9' % (name, preconditioner, steps)


def still(dimension, cells, name="jfnk", extra=""):
    return without_velocity(scene(BAQP, dimension, False, integrator(name, 1), cells=cells, extra=extra))


def rubber(base, bulk, dimension, cloud, cells, preconditioner="mixed", extra=""):
    """Nearly incompressible, from rest."""
    text = scene('type = "selective"\nbase = "%s"' % base, dimension, cloud, integrator("jfnk", 1, preconditioner),
                 'type = "neo_hookean"\ndensity = 1.0\nshear_modulus = 1.0\nbulk_modulus = %g' % bulk, extra, cells)
    begin, end = text.index("[initial]"), text.index("[[boundary]]")
    return without_velocity(text[:begin] + text[end:])


def mixed_cases():
    """As cases(). Beyond 1000 shear moduli pressures have other equations. In the last case on one rank auto takes factors, on several none."""
    yield "mixed, 3D lattice, auto", rubber("baqp", 1e4, 3, False, [12, 9, 8], "auto"), (2, 3)
    yield "mixed, 3D cloud, auto", rubber("projection", 300, 3, True, [11, 8, 8], "auto"), (3,)
    yield "mixed, a plane of symmetry", rubber("bond_associated", 300, 2, False, [32, 20], extra='[[symmetry]]\naxis = "y"\n'), (2, 3)
    yield "mixed, periodic cloud", rubber("baqp", 1e4, 2, True, [32, 22], extra='[[periodic]]\naxis = "y"\n'), (2,)
    slit = rubber("baqp", 300, 2, False, [24, 16], extra='[[crack]]\nsegment = [[11.3, 9.2], [11.3, 20]]\n[damage]\ntype = "critical_stretch"\nstretch = 0.08\n')
    begin, end = slit.index("[[load]]"), slit.index("[integrator]")
    yield "mixed, bonds that fail at a slit", slit[:begin] + '[[boundary]]\nset = "high"\ndisplacement = [0.7, 0]\n' + slit[end:], (2, 3)
    yield "mixed, 2D lattice, auto", rubber("baqp", 5000, 2, False, [40, 24], "auto"), (3,)


def cases():
    """Name, scene, numbers of ranks."""
    rollers = still(2, [32, 20], extra=STIFF).replace("[sets]\n", '[sets]\nsome = "x > 17 && y > 9"\n').replace('"0.01*sin(t)", 0', '"0.01*sin(t)", "free"')
    yield "2D, two materials on rollers", rollers + '[[boundary]]\nset = "middle"\ndisplacement = ["free", 0]\n', (2, 3)
    yield "3D, a plane of symmetry", still(3, [10, 9, 8], extra='[[symmetry]]\naxis = "y"\n'), (2,)
    yield "1D, kinsol, a rank without unknowns", still(1, [600], "kinsol").replace('low = "x < 2"', 'low = "x < 350"'), (2,)
    yield "failing bonds and a loose corner", torn_slowly(BAQP, integrator("jfnk", 2), '[damage]\ntype = "critical_stretch"\nstretch = 0.02\n', True), (2,)
    yield from mixed_cases()


def displacement(folder):
    with h5py.File(sorted(glob.glob(folder + "/frames/*.h5"))[-1]) as frame:
        return frame["displacement"][...]


def log(folder):
    with open(folder + "/run.log") as file:
        return file.read()


def iterations(folder):
    return sum(int(jfnk or kinsol) for jfnk, kinsol in re.findall(r"gmres +(\d+)|(\d+) linear ones", log(folder)))


def compare(what, text, ranks, one, expected, environment=None):
    """A run on several ranks beside that on one, whose folder is `one`; its folder."""
    folder = "%s/%d_ranks" % (WORK, ranks)
    done = run(PROGRAM, text, folder, ranks, environment=environment)
    if done.returncode != 0:
        check(False, "%s: %s" % (what, done.stderr.strip()))
        return folder
    check(expected in log(folder), "%s: %s" % (what, expected))
    found, alone = displacement(folder), displacement(one)
    off = numpy.abs(found - alone).max() / numpy.abs(alone).max()
    check(off <= 1e-8, "%s: off by %.1e" % (what, off))
    few, many = sorted((iterations(folder), iterations(one)))
    if "preconditioner factorisation" in log(one):
        return folder
    check(many <= 1.25 * few + 2, "%s: %d iterations, on one rank %d" % (what, iterations(folder), iterations(one)))
    return folder


def main():
    need(LIBRARY)
    distributed = os.path.exists(os.path.join(os.path.dirname(LIBRARY), "libperikit_petsc.so"))
    hidden = hide_petsc(LIBRARY, WORK)
    one = WORK + "/one"
    for name, text, several in cases():
        preconditioner = "preconditioner %s, " % ("mixed" if name.startswith("mixed") else "companion")
        done = run(PROGRAM, text, one, 0)
        check(done.returncode == 0, name + ", one rank" + done.stderr)
        for ranks in several:
            what = "%s, %d ranks" % (name, ranks)
            if distributed:
                folder = compare(what, text, ranks, one, preconditioner + DISTRIBUTED)
        if name not in THOROUGH:
            continue
        if distributed:
            # Nothing of what users tell PETSc elsewhere is taken.
            again = WORK + "/again"
            run(PROGRAM, text, again, several[-1], environment={"PETSC_OPTIONS": "-pc_type none -mg_levels_ksp_max_it 7 -log_view"})
            check(not differences(folder, again), what + ": the same bits again, whatever PETSC_OPTIONS are")
        compare(name + ", without PETSc", text, several[0], one, preconditioner + GATHERED, hidden)
    sys.exit(1 if failed else 0)


main()
