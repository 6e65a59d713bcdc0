"""Explicit runs on several ranks give the files of one rank, bit for bit.

usage: same_bits.py PROGRAM LIBRARY WORK small|all
"""

import concurrent.futures
import itertools
import os
import random
import re
import subprocess
import sys

from scenes import differences, hide_petsc, need, run, scene, torn_slowly, without_velocity

KINEMATICS = {
    "conventional": 'type = "conventional"',
    "silling": 'type = "conventional"\nstabilization = { type = "silling", coefficient = 0.5 }',
    "wan": 'type = "conventional"\nstabilization = { type = "wan" }',
    "order 2": 'type = "conventional"\norder = 2',
    "silling, order 2": 'type = "conventional"\norder = 2\nstabilization = { type = "silling", coefficient = 0.5 }',
    "wan, order 3": 'type = "conventional"\norder = 3\nstabilization = { type = "wan" }',
    "bond_based": 'type = "bond_based"',
    "surface correction": 'type = "bond_based"\nsurface_correction = "energy"',
    "ordinary": 'type = "ordinary"',
    "baqp": 'type = "baqp"',
    "baqp, order 2": 'type = "baqp"\norder = 2',
    "projection": 'type = "projection"',
    "bond_augmented": 'type = "bond_augmented"\nlambda = 1.3',
    "non_spherical": 'type = "non_spherical"',
    "sub_horizon": 'type = "sub_horizon"',
    "bond_associated": 'type = "bond_associated"',
    "selective projection": 'type = "selective"\nbase = { type = "projection" }',
    "selective sub_horizon": 'type = "selective"\nbase = { type = "sub_horizon" }',
}

PAIRS = ("bond_based", "surface correction", "ordinary")
INCLUSION = '[[region]]\nset = "some"\nmaterial = { type = "neo_hookean", density = 2.0, shear_modulus = "1 + x/100", bulk_modulus = 3.0 }\n'
DAMAGE = {
    "critical_stretch": '[damage]\ntype = "critical_stretch"\nstretch = 0.02\n',
    "gradual": '[damage]\ntype = "critical_stretch"\nstretch = 0.02\ngradual = true\n',
    "critical_energy": '[damage]\ntype = "critical_energy"\nenergy_release_rate = 0.005\n',
    "critical_energy, equal, gradual": '[damage]\ntype = "critical_energy"\nenergy_release_rate = 0.005\nlimit = "equal"\ngradual = true\n',
    "max_stress, gradual, second law": '[damage]\ntype = "max_stress"\nstrength = 0.02\ngradual = true\nsecond_law = true\n',
    "max_stress": '[damage]\ntype = "max_stress"\nstrength = 0.05\n',
    "smooth_degradation": '[damage]\ntype = "smooth_degradation"\nstretch_min = 0.01\nstretch = 0.05\n',
}
STATICS = {
    "jfnk": 'type = "jfnk"\npreconditioner = "companion"\nsteps = 2\ntolerance = 1e-9',
    "jfnk, no preconditioner": 'type = "jfnk"\nsteps = 1\ntolerance = 1e-6\npreconditioner = "none"',
    "kinsol": 'type = "kinsol"\npreconditioner = "companion"\nsteps = 2\ntolerance = 1e-9',
}
TEARING = {
    "jfnk": 'type = "jfnk"\npreconditioner = "companion"\nsteps = 6\ntolerance = 1e-7',
    "kinsol": 'type = "kinsol"\npreconditioner = "companion"\nsteps = 6\ntolerance = 1e-7',
    "dynamic_relaxation": 'type = "dynamic_relaxation"\nsteps = 6\ntolerance = 1e-6',
}
HYPOELASTIC = 'type = "hypoelastic"\ndensity = 1.0\nyoungs_modulus = 2.0\npoisson_ratio = 0.3'
J2 = 'type = "j2"\ndensity = 1.0\nyoungs_modulus = 2.0\npoisson_ratio = 0.3\nyield_stress = 0.01\nhardening = 0.05'
CRACK = "[[crack]]\nsegment = [[10.0, 8.0], [20.0, 19.0]]\n"


CRACK_COLUMNS = """ { name = "torque", set = "low", quantity = "reaction", component = "z", reduce = "moment", about = %(middle)s },
  { name = "area", quantity = "damage", reduce = "area" },
  { name = "tip", quantity = "damage", reduce = "tip", above = 0.2, direction = %(ones)s },
  { name = "pieces", quantity = "fragment", reduce = "max" },
  { name = "second", quantity = "fragment", reduce = "mass", piece = 2 },
  { name = "released", value = "dissipated_energy/area" }, """


def with_inclusion(text):
    return text.replace("[sets]\n", '[sets]\nsome = "x > 11 && y > 7 && x < 21"\n') + INCLUSION


def lone_points(kinematics):
    """Two laws, and a crack and a hole that leave points without a gradient."""
    text = scene(kinematics, 3, False, 'type = "verlet"\nend_time = 1.0\ntime_step = 0.05', cells=[3, 6, 7]).replace("ratio = 2.515", "ratio = 1.515")
    text = text.replace("[sets]\n", 'inside = "(x - 2.3)^2 + (y - 2.7)^2 + (z - 4.3)^2 > 1.69"\n[sets]\nsome = "x > 1.78"\n', 1)
    return text + INCLUSION + "[[crack]]\npolygon = [[1.57, -1, -1], [1.57, 1.7, -1], [1.57, 1.7, 8], [1.57, -1, 8]]\n"


def with_face(text):
    """The layer of held points becomes a face that moves as it did."""
    begin, end = text.index("[[boundary]]"), text.index("[[load]]")
    motion = text[text.index("displacement = ", begin):end]
    return text[:begin] + '[[boundary]]\nset = "all"\nface = "-x"\n' + motion + text[end:]


def with_surface(text):
    """The face is the rim of a large hole."""
    return with_face(text).replace('set = "all"\nface = "-x"', 'surface = "200 - sqrt((x + 200.2)^2 + (y - 12)^2)"', 1)


def with_rim(text):
    """The rim of a hole is held, beside what the scene has."""
    text = text.replace("[sets]", 'inside = "(x - 14)^2 + (y - 18)^2 > 81"\n[sets]', 1)
    return text + '[[boundary]]\nsurface = "9 - sqrt((x - 14)^2 + (y - 18)^2)"\ndisplacement = ["0.01*sin(t)", 0]\n'


SYMMETRY = '[[symmetry]]\naxis = "y"\n'
BEYOND = {
    "face": with_face,
    "face and symmetry": lambda text: with_face(text) + SYMMETRY,
    "two planes of symmetry": lambda text: text + SYMMETRY + '[[symmetry]]\naxis = "x"\n',
    "periodic": lambda text: text + '[[periodic]]\naxis = "y"\n',
}


def pressed(text, where, follower):
    """A pressure in place of the force."""
    begin, end = text.index("[[load]]"), text.index("[integrator]")
    return text[:begin] + '[[load]]\n%s\npressure = "0.02 + 0.01*t"\nfollower = %s\n' % (where, "true" if follower else "false") + text[end:]


def drawn(text, dimension, where, *faces):
    """Tractions in place of the force."""
    begin, end = text.index("[[load]]"), text.index("[integrator]")
    values = ", ".join(['"0.1*t"', "0.02", "0"][:dimension])
    return text[:begin] + "".join('[[load]]\nset = "%s"\ntraction = [%s]\nface = "%s"\n' % (where, values, face) for face in faces) + text[end:]


def beyond(everything):
    """Held faces, planes of symmetry and periodic sides, and pressures beside them; without `everything` other things that are rare, too."""
    if not everything:
        yield "silling, critical_energy, lattice", torn(KINEMATICS["silling"], DAMAGE["critical_energy"], False)
        yield "silling, critical_energy, periodic, cloud", BEYOND["periodic"](torn(KINEMATICS["silling"], DAMAGE["critical_energy"], True))
        yield "baqp, order 2, max_stress, gradual, second law", torn(KINEMATICS["baqp, order 2"], DAMAGE["max_stress, gradual, second law"], False)
        yield "baqp, max_stress, cloud", torn(KINEMATICS["baqp"], DAMAGE["max_stress"], True)
        yield "silling, order 2, lattice", scene(KINEMATICS["silling, order 2"], 2)
        yield "baqp, face and symmetry, cloud", BEYOND["face and symmetry"](scene(KINEMATICS["baqp"], 2, True))
        yield "baqp, surface and symmetry, cloud", with_surface(scene(KINEMATICS["baqp"], 2, True)) + SYMMETRY
        yield "bond_based, torn, periodic", BEYOND["periodic"](torn(KINEMATICS["bond_based"], DAMAGE["critical_stretch"], False))
        yield "projection, pressure, symmetry", pressed(scene(KINEMATICS["projection"], 2), 'set = "all"', True) + SYMMETRY
        return
    for (name, kinematics), (plane, change), cloud in itertools.product(KINEMATICS.items(), BEYOND.items(), (False, True)):
        yield "%s, %s, %s" % (name, plane, "cloud" if cloud else "lattice"), change(scene(kinematics, 2, cloud))
    for name, kinematics in KINEMATICS.items():
        yield "%s, surface and symmetry, cloud" % name, with_surface(scene(kinematics, 2, True)) + SYMMETRY
    for (plane, change), cloud in itertools.product(BEYOND.items(), (False, True)):
        kind = "%s, %s" % (plane, "cloud" if cloud else "lattice")
        for name in ("bond_based", "silling", "baqp"):
            yield "%s, torn, %s" % (name, kind), change(torn(KINEMATICS[name], DAMAGE["critical_stretch"], cloud))
        for name in ("bond_based", "ordinary", "projection"):
            yield "%s, inclusion, %s" % (name, kind), change(with_inclusion(scene(KINEMATICS[name], 2, cloud)) + CRACK)
        yield "conventional, hypoelastic, " + kind, change(scene(KINEMATICS["conventional"], 2, cloud, material=HYPOELASTIC))
        yield "projection, 3D, " + kind, change(scene(KINEMATICS["projection"], 3, cloud))
    for name, cloud in itertools.product(("conventional", "bond_based"), (False, True)):
        yield "%s, face, 1D %s" % (name, "cloud" if cloud else "lattice"), with_face(scene(KINEMATICS[name], 1, cloud))
    for where, follower, cloud in itertools.product(('set = "all"', 'set = "high"\nface = "+x"'), (False, True), (False, True)):
        for name in ("conventional", "baqp") + (() if cloud or follower else ("ordinary",)):
            kind = "%s, %s, %s, %s" % (name, where.replace("\n", " "), "following" if follower else "fixed", "cloud" if cloud else "lattice")
            text = pressed(scene(KINEMATICS[name], 2, cloud), where, follower)
            yield "pressure, " + kind, text
            yield "pressure, symmetry, " + kind, text + SYMMETRY
            yield "pressure, periodic, " + kind, BEYOND["periodic"](text)


def torn(kinematics, damage, cloud, material=""):
    """Pulled apart so fast that bonds fail, pieces among them, and points are turned inside out before they are let go."""
    # Gradients of bonds of clouds do not survive for long what fails beside them.
    end = 4.5 if cloud and kinematics == KINEMATICS["bond_associated"] else 10.0
    text = scene(kinematics, 2, cloud, 'type = "verlet"\nend_time = %s\ntime_step = 0.05' % end, material)
    text = text.replace("[[boundary]]", 'velocity = ["0.15*(x - 16)/16", "0.1*sin(x/3)*(y - 13)/13"]\n[[boundary]]', 1)
    return text.replace('"reaction"]', '"reaction", "damage"]') + CRACK + damage


def cases(everything, work):
    """Name, scene, numbers of ranks, numbers of threads."""
    small = [("conventional", 3, False), ("baqp", 2, True), ("bond_based", 3, True), ("sub_horizon", 2, False)]
    chosen = itertools.product(KINEMATICS, (1, 2, 3), (False, True)) if everything else small
    ranks, threads = ((1, 2, 3, 4), (1, 2)) if everything else ((2, 3), (1,))
    for name, dimension, cloud in chosen:
        short = "end_time = 2.0" if dimension == 3 else "end_time = 6.0"
        # Steps of a given length where families are too poor for the estimate to mean anything.
        step = "\ntime_step = 0.02" if "order 2" in name and dimension == 3 else ""
        yield "%s, %dD %s" % (name, dimension, "cloud" if cloud else "lattice"), scene(KINEMATICS[name], dimension, cloud, 'type = "verlet"\n' + short + step), ranks, threads
    # Bars whose groups of eight points a rank's border cuts.
    for name in KINEMATICS if everything else ("conventional", "silling", "bond_augmented"):
        for cells in (62, 91, 140) if everything else (62,):
            bar = scene(KINEMATICS[name], 1, False, 'type = "verlet"\nend_time = 2.0\ntime_step = 0.05', cells=[cells])
            yield "%s, bar of %d points" % (name, cells), bar.replace("ratio = 3.015", 'ratio = 4.0\ninfluence = "cone"'), (2, 3), (1,)
    # Rows of four chunks, of which a rank has runs that begin elsewhere.
    for name in KINEMATICS if everything else ("projection", "silling"):
        if "selective" not in name and "order" not in name:
            yield "%s, large" % name, scene(KINEMATICS[name], 3, False, 'type = "verlet"\nend_time = 0.1\ntime_step = 0.02', cells=[22, 22, 27]), (2, 3) if everything else (2,), (1,)
    for name in ("conventional", "silling", "wan", "baqp", "bond_based") if everything else ("conventional",):
        text = scene(KINEMATICS[name], 3, False, 'type = "verlet"\nend_time = 1.5\ntime_step = 0.05', cells=[22, 22, 27])
        text = text.replace("[[boundary]]", 'velocity = ["0.04*(x - 11)", "0.02*sin(x/3)*(y - 11)", "0.03*(z - 14)"]\n[[boundary]]', 1) + DAMAGE["critical_stretch"]
        yield "%s, large, torn" % name, text, (2, 3) if everything else (2,), (1,)
    for name in STATICS if everything else ("jfnk",):
        for cloud in (False, True) if everything else (False,):
            yield "%s, %s" % (name, "cloud" if cloud else "lattice"), without_velocity(scene(KINEMATICS["baqp"], 2, cloud, STATICS[name])), ranks, threads
    for integrator in TEARING if everything else ("jfnk",):
        for name, criterion in (("baqp", "critical_energy"), ("bond_based", "critical_stretch")) if everything else (("baqp", "critical_stretch"),):
            for cloud in (False, True) if everything else (True,):
                text = torn_slowly(KINEMATICS[name], TEARING[integrator], DAMAGE[criterion], cloud)
                yield "%s, %s, %s, %s" % (integrator, name, criterion, "cloud" if cloud else "lattice"), text, ranks, threads
    for name in ("conventional", "projection", "ordinary", "bond_associated") if everything else ("projection",):
        for cloud in (False, True) if everything else (False,):
            text = with_inclusion(scene(KINEMATICS[name], 2, cloud))
            yield "%s, inclusion and pre-crack, %s" % (name, "cloud" if cloud else "lattice"), text + CRACK, ranks, threads
    for name in KINEMATICS if everything else ("bond_based", "baqp", "silling"):
        if "order" in name or "sub_horizon" in name or "selective" in name:
            criteria = ("critical_stretch",)
        else:
            criteria = DAMAGE if everything else ("critical_energy",) if name == "silling" else ("critical_stretch",)
        for criterion, cloud in itertools.product(criteria, (False, True) if everything else (name != "bond_based",)):
            if criterion == "max_stress" and name in PAIRS:
                continue
            text = torn(KINEMATICS[name], DAMAGE[criterion], cloud)
            # Gradients of an order above 1 do not survive families that are torn to pieces.
            if "order" in name:
                text = text.replace("end_time = 10.0\ntime_step = 0.05", "end_time = 1.2\ntime_step = 0.02")
            yield "%s, %s, %s" % (name, criterion, "cloud" if cloud else "lattice"), text, ranks, threads
    for name in ("conventional", "baqp", "sub_horizon", "projection") if everything else ("baqp",):
        for cloud in (False, True) if everything else (False,):
            yield "%s, hypoelastic, %s" % (name, "cloud" if cloud else "lattice"), scene(KINEMATICS[name], 2, cloud, material=HYPOELASTIC), ranks, threads
    for name in ("conventional", "projection", "sub_horizon") if everything else ("projection",):
        for cloud in (False, True) if everything else (True,):
            yield "%s, j2, %s" % (name, "cloud" if cloud else "lattice"), scene(KINEMATICS[name], 2, cloud, material=J2), ranks, threads
    for name, text in beyond(everything):
        yield name, text, ranks, threads
    hole = scene(KINEMATICS["conventional"], 2).replace("[sets]", "inside = \"(x - 14)^2 + (y - 12)^2 > 40 && x + y > 6\"\n[sets]")
    yield "conventional, body with a hole", hole, ranks, threads
    # Ranks leave out bonds that nobody feels, in other batches than one rank evaluates.
    yield "baqp, points without a gradient", lone_points(KINEMATICS["baqp"]), (2, 3), (1,)
    # Rows in pieces, some of which no point of a rank feels beside pieces that it does.
    porous = scene(KINEMATICS["baqp"], 3, False, 'type = "verlet"\nend_time = 0.5\ntime_step = 0.05', cells=[200, 8, 4])
    yield "baqp, porous bar", porous.replace("[sets]", 'inside = "sin(12.9898*x + 78.233*y + 37.719*z) > 0.2"\n[sets]'), ranks, threads
    for name, text in itertools.chain(own_parts(everything), loads_on_surfaces(everything), planes_of_parts(everything), other_clouds(everything, work), long_interfaces(everything)):
        yield name, text, (2, 3, 4) if everything else (2, 4), threads


CRACK_IN_SPACE = "[[crack]]\npolygon = [[5.0, 3.0, 2.0], [9.0, 3.5, 2.0], [9.0, 9.0, 8.0], [5.0, 8.5, 8.0]]\n"
REGIONS = ('[[region]]\nset = "some"\nmaterial = { type = "neo_hookean", density = 2.0, shear_modulus = 1.7, bulk_modulus = 3.0 }\n'
           '[[region]]\nset = "other"\nmaterial = { type = "saint_venant_kirchhoff", density = 2.0, youngs_modulus = 5.0, poisson_ratio = 0.2 }\n')


def with_regions(text, some, other):
    """Three laws, which meet; the last region has what both name."""
    return text.replace("[sets]\n", '[sets]\nsome = "%s"\nother = "%s"\n' % (some, other)) + REGIONS


def own_parts(everything):
    """Lattices and clouds of which each rank places its own part: with holes, regions, pre-cracks, failing bonds, and sets of single points."""
    hole = {2: "(x - 14)^2 + (y - 12)^2 > 40 && x + y > 6", 3: "(x - 7)^2 + (y - 6)^2 + (z - 2)^2 > 8 && x + z > 2"}
    regions = {2: ("x > 11 && y > 7 && x < 21", "x - y > 17"), 3: ("(x - 8)^2 + (y - 6)^2 + (z - 6)^2 < 14", "x - y > 8")}
    crack = {2: CRACK, 3: CRACK_IN_SPACE}
    names = ("conventional", "wan", "baqp", "sub_horizon", "projection", "bond_based", "ordinary", "bond_associated") if everything else ("baqp", "ordinary")
    for name, dimension, cloud in itertools.product(names, (2, 3), (False, True)):
        if cloud and dimension == 3 and not everything:
            continue
        kind = "%s, %dD %s, " % (name, dimension, "cloud" if cloud else "lattice")
        cells = [32, 38] if cloud and dimension == 2 else None  # of more blocks than there are ranks
        text = scene(KINEMATICS[name], dimension, cloud, 'type = "verlet"\nend_time = 2.0\ntime_step = 0.05', cells=cells)
        holed = text.replace("[sets]", 'inside = "%s"\n[sets]\nlisted = { points = [70, 3, 500, 41] }' % hole[dimension])
        holed = holed.replace("history = [", 'history = [ { name = "few", set = "listed", quantity = "displacement", component = "x", reduce = "sum" },')
        if everything or name == "baqp":
            if everything or not cloud:
                yield kind + "hole", holed
            yield kind + "hole, regions and pre-crack", with_regions(holed, *regions[dimension]) + crack[dimension]
        pulled = with_regions(holed, *regions[dimension]).replace("[[boundary]]", 'velocity = [%s]\n[[boundary]]' % ", ".join(['"0.1*(x - 8)"', '"0.05*sin(x/3)*(y - 6)"', '"0.05*z"'][:dimension]), 1)
        if cloud:  # before points are turned inside out
            pulled = pulled.replace("end_time = 2.0", "end_time = 0.4" if name in ("bond_associated", "sub_horizon") else "end_time = 1.2")
        yield kind + "traction", drawn(text, dimension, "high", "+x")
        if not cloud and (everything or dimension == 2):
            yield kind + "traction on two materials", drawn(with_regions(text, *regions[dimension]), dimension, "all", "+y")
        pulled = pulled.replace('"reaction"]', '"reaction", "damage", "fragment"]').replace("history = [", "history = [" + CRACK_COLUMNS % {"middle": [9] * dimension, "ones": [1] * dimension})
        yield kind + "hole, regions, pre-crack and failing bonds", pulled + crack[dimension] + DAMAGE["critical_stretch"]


def loads_on_surfaces(everything):
    """Tractions and pressures, on bodies with holes, and on some so thin that both sides are near; most ranks have no point of the face across x."""
    brief, hole = 'type = "verlet"\nend_time = 1.0\ntime_step = 0.05', 'inside = "(x - 14)^2 + (y - 12)^2 > 40 && x + y > 6"\n[sets]'
    for name in ("conventional", "baqp", "ordinary", "projection") if everything else ("baqp", "ordinary"):
        for cells in ([40, 3], [40, 4, 2]) if everything or name == "baqp" else ([40, 3],):
            text = scene(KINEMATICS[name], len(cells), False, brief, cells=cells)
            yield "%s, tractions on a thin body, %dD" % (name, len(cells)), drawn(text, len(cells), "all", "+x", "-y")
            if everything or name == "ordinary":
                yield "%s, pressure on a thin body, %dD" % (name, len(cells)), pressed(text, 'set = "high"', False)
        holed = scene(KINEMATICS[name], 2, False, brief).replace("[sets]", hole)
        yield "%s, tractions beside a hole" % name, drawn(holed, 2, "all", "+y", "-x")
        if name not in PAIRS:
            yield "%s, pressure in a hole" % name, pressed(holed.replace("[sets]\n", '[sets]\nrim = "x < 21 && y < 19"\n'), 'set = "rim"', True)
            for where in ('set = "all"', 'set = "high"\nface = "+x"') if everything else ('set = "high"',):
                text = scene(KINEMATICS[name], 2, True, brief, cells=[32, 38])
                yield "%s, pressure, %s, cloud" % (name, where.replace("\n", " ")), pressed(text, where, False)


BETWEEN = SYMMETRY + '[[symmetry]]\naxis = "y"\nat = 3.0\n'


# Points of the outermost layer, rows of 32 from the lowest on.
FEW = {"listed": "{ points = [64, 0, 32, 96, 640] }", "nearest": "{ nearest = [0.0, 9.4] }"}


def with_face_of(text, few):
    """A held face of single points, beside what the scene has."""
    text = with_face(text).replace('set = "all"\nface = "-x"', 'set = "few"\nface = "-x"', 1)
    return text.replace("[sets]\n", "[sets]\nfew = %s\n" % few)


def periodic_all_around(text):
    """Nothing holds it any more."""
    return text[:text.index("[[boundary]]")] + text[text.index("[[load]]"):] + '[[periodic]]\naxis = "x"\n[[periodic]]\naxis = "y"\n'


def planes_of_parts(everything):
    """Bodies of which each rank places its own part, with what lies beyond its planes: corners of two planes, sides that other ranks have the
    points beyond, bodies so thin that images have images, holes at planes, faces of a part of the body."""
    brief, hole = 'type = "verlet"\nend_time = 1.0\ntime_step = 0.05', 'inside = "(x - 14)^2 + (y - 2)^2 > 40 && x + y > 6"\n[sets]'
    for name in ("conventional", "silling", "wan", "baqp", "bond_based", "ordinary", "projection", "sub_horizon") if everything else ("baqp",):
        text = scene(KINEMATICS[name], 2, False, brief)
        for plane in BEYOND if everything else ("face and symmetry",):
            yield "%s, %s" % (name, plane), BEYOND[plane](text)
        yield "%s, periodic along both axes" % name, periodic_all_around(text)
        thin = scene(KINEMATICS[name], 2, False, brief, cells=[300, 3])
        yield "%s, thin between planes" % name, thin + BETWEEN
        yield "%s, thin and periodic" % name, BEYOND["periodic"](thin)
        yield "%s, hole at a plane, traction" % name, drawn(text.replace("[sets]", hole), 2, "high", "+x") + SYMMETRY
        part = with_face(text).replace('set = "all"\nface = "-x"', 'set = "lower"\nface = "-x"', 1).replace("[sets]\n", '[sets]\nlower = "y < 13"\n')
        yield "%s, face of a part" % name, part
        for kind, few in FEW.items() if everything else (("listed", FEW["listed"]),):
            yield "%s, face of %s points" % (name, kind), with_face_of(text, few)
    for name in ("conventional", "silling", "baqp", "bond_based", "projection") if everything else ("bond_based",):
        cloud = scene(KINEMATICS[name], 2, True, brief, cells=[32, 38])
        for plane in BEYOND if everything else ("face and symmetry",):
            yield "%s, %s, cloud" % (name, plane), BEYOND[plane](cloud)
        yield "%s, periodic along both axes, cloud" % name, periodic_all_around(cloud)
        for kind, few in FEW.items() if everything else (("nearest", FEW["nearest"]),):
            yield "%s, face of %s points, cloud" % (name, kind), with_face_of(cloud, few)
        yield "%s, surface and periodic, cloud" % name, BEYOND["periodic"](with_surface(cloud))
        cut = scene(KINEMATICS[name], 2, False, brief, cells=[32, 38]).replace("[family]\n", "[family]\npartial_volume = true\n")
        yield "%s, held rim of cut cells" % name, with_rim(cut)
        yield "%s, surface, 3D" % name, with_surface(scene(KINEMATICS[name], 3, True, brief))
        thin = scene(KINEMATICS[name], 2, True, brief, cells=[400, 3])
        yield "%s, thin between planes, cloud" % name, thin + BETWEEN
    for name in ("bond_based", "silling", "projection") if everything else ("bond_based",):
        for plane in BEYOND if everything else ("two planes of symmetry", "periodic"):
            if everything or plane == "periodic":
                yield "%s, torn, %s" % (name, plane), BEYOND[plane](torn(KINEMATICS[name], DAMAGE["critical_stretch"], False))
            yield "%s, 3D, %s" % (name, plane), BEYOND[plane](scene(KINEMATICS[name], 3, False, brief))
    for name in ("bond_based", "silling", "projection") if everything else ("bond_based",):
        yield "%s, torn, surface" % name, with_surface(torn(KINEMATICS[name], DAMAGE["critical_stretch"], True))
    for cloud in (False, True) if everything else (True,):
        yield "bond_based, torn, face of listed points, %s" % ("cloud" if cloud else "lattice"), with_face_of(torn(KINEMATICS["bond_based"], DAMAGE["critical_stretch"], cloud), FEW["listed"])
    for name, cloud in itertools.product(("ordinary", "projection"), (False, True)) if everything else (("ordinary", True), ("projection", False)):
        text = with_regions(scene(KINEMATICS[name], 2, cloud, brief, cells=[32, 38]), "x > 11 + 0.3*y && x < 21", "x - y > 17") + CRACK
        for plane in BEYOND if everything else ("two planes of symmetry", "periodic"):
            yield "%s, regions, %s, %s" % (name, plane, "cloud" if cloud else "lattice"), BEYOND[plane](text)
    for name in ("conventional", "ordinary") if everything else ("conventional",):
        text = pressed(scene(KINEMATICS[name], 2, False, brief), 'set = "all"', name == "conventional")
        yield "%s, pressure and symmetry" % name, text + SYMMETRY
        yield "%s, pressure and periodic" % name, BEYOND["periodic"](text)


def points_file(work, dimension, binary):
    """Jittered points in an order that is not that of the curve, as a file; what takes the place of the lattice in a scene."""
    draw = random.Random(dimension)
    cells = {1: (1200,), 2: (32, 38), 3: (14, 12, 11)}[dimension]
    points = [[draw.uniform(0.9, 1.1)] + [k + 0.5 + draw.uniform(-0.2, 0.2) for k in cell] for cell in itertools.product(*map(range, cells))]
    draw.shuffle(points)
    columns = ["volume", "x", "y", "z"][:dimension + 1]
    file = "%s/points_%d.%s" % (work, dimension, "h5" if binary else "csv")
    os.makedirs(work, exist_ok=True)
    if binary:
        if os.path.exists(file):  # of another scene; h5import adds to files
            os.remove(file)
        command = ["h5import"]
        for column, values in zip(columns, zip(*points)):
            with open(file + "." + column, "w") as out:
                out.write("\n".join(map(repr, values)))
            command += [file + "." + column, "-d", str(len(values)), "-p", column, "-t", "TEXTFP", "-s", "64"]
        subprocess.run(command + ["-o", file], check=True, capture_output=True)
    else:
        with open(file, "w") as out:
            out.write(",".join(columns) + "\n")
            out.writelines(",".join(map(repr, row)) + ("  # a line without points comes\n\n" if n % 9 == 0 else "\n") for n, row in enumerate(points))
    return '[body.points]\nfile = "%s"\n' % file


def on_points(text, table):
    """The scene with points of a file in place of its lattice."""
    begin, end = text.index("[body.lattice]"), text.index("[sets]")
    return text[:begin] + table + text[end:]


def with_cells(text):
    """Volumes are those of Voronoi cells."""
    return text.replace("jitter = 0.2\n", 'jitter = 0.2\nvolume = "voronoi"\n', 1)


def other_clouds(everything, work):
    """Clouds of files, of cells that a surface cuts, and of Voronoi cells, of which each rank places its own part."""
    brief = 'type = "verlet"\nend_time = 1.0\ntime_step = 0.02'
    for name in ("conventional", "baqp", "bond_based", "ordinary", "projection") if everything else ("bond_based",):
        for dimension, binary in itertools.product((2, 3), (False, True)) if everything else ((2, True), (3, False)):
            text = on_points(scene(KINEMATICS[name], dimension, True, brief), points_file(work, dimension, binary))
            yield "%s, %dD, %s file" % (name, dimension, "HDF5" if binary else "CSV"), text
        if name in PAIRS:
            text = on_points(torn(KINEMATICS[name], DAMAGE["critical_stretch"], True), points_file(work, 2, False))
            yield "%s, file, regions and failing bonds" % name, with_regions(text, "x > 11 && y > 7 && x < 21", "x - y > 17")
    for name in ("conventional", "baqp", "bond_based", "ordinary", "projection") if everything else ("projection",):
        text = scene(KINEMATICS[name], 2, False, brief, cells=[32, 38]).replace("[family]\n", "[family]\npartial_volume = true\n")
        yield "%s, cut cells" % name, text.replace("[sets]", "inside = \"(x - 14)^2 + (y - 18)^2 > 47 && x + 1.3*y > 6\"\n[sets]", 1)
    for name in ("conventional", "baqp", "bond_based", "ordinary", "projection") if everything else ("bond_based",):
        for dimension in (2, 3) if everything else (2,):
            kind = "%s, Voronoi cells, %dD" % (name, dimension)
            text = scene(KINEMATICS[name], dimension, True, brief, cells=[32, 38] if dimension == 2 else None)
            if everything:
                yield kind, with_cells(text)
            yield kind + ", hole", with_cells(text.replace("[sets]", 'inside = "%s"\n[sets]' % {2: "(x - 14)^2 + (y - 18)^2 > 47", 3: "x^2 + y^2 + z^2 > 30"}[dimension], 1))
            yield kind + ", file", on_points(text, points_file(work, dimension, dimension == 3) + 'volume = "voronoi"\n')
        if name != "ordinary":
            yield "%s, Voronoi cells, torn" % name, with_cells(torn(KINEMATICS[name], DAMAGE["critical_stretch"], True))
        if name not in PAIRS or everything:
            yield "%s, Voronoi cells, surface and symmetry" % name, with_surface(with_cells(scene(KINEMATICS[name], 2, True, brief, cells=[32, 38]))) + SYMMETRY
    if everything:
        yield "conventional, 1D, CSV file", on_points(scene(KINEMATICS["conventional"], 1, True, brief), points_file(work, 1, False))


def long_interfaces(everything):
    """Surfaces between laws that no rank sees all of."""
    for name in ("conventional", "projection", "ordinary", "sub_horizon") if everything else ("projection",):
        text = scene(KINEMATICS[name], 2, False, 'type = "verlet"\nend_time = 0.5\ntime_step = 0.05', cells=[430, 18])
        yield "%s, long interfaces" % name, with_regions(text, "y > 9 + 4*sin(x/13)", "(x - 215)^2 + (y - 9)^2 < 50")


def carried(program, work, everything):
    """Runs from the end of another one on one rank, with its broken bonds and with the history of its laws. What differs."""
    begun = "frames = 3\ncheckpoint_every = 50"
    scenes = {"broken bonds": torn(KINEMATICS["bond_based"], DAMAGE["critical_energy"], False),
              "history": scene(KINEMATICS["conventional"], 2, material=HYPOELASTIC)}
    if everything:
        scenes["gradual"] = torn(KINEMATICS["projection"], DAMAGE["gradual"], False)
        scenes["weakened bonds"] = torn(KINEMATICS["bond_based"], DAMAGE["smooth_degradation"], True)
    for name, text in scenes.items():
        text = text.replace("frames = 3", begun)
        folder = work + "/carried"
        begin, end = text.index("[initial]"), text.index("[[boundary]]")
        later = text[:begin] + '[initial]\nfrom = "first/results.h5"\n' + text[end:]
        found = []
        for ranks in (0, 3):
            # Of the same name, for results hold their scenes.
            first = run(program, text, folder + "/first", 0)
            second = run(program, later, folder + "/%d" % ranks, ranks)
            found += [done.stderr.strip() for done in (first, second) if done.returncode != 0]
        found = found or differences(folder + "/0", folder + "/3")
        found += [] if log_lines(folder + "/3", "carried") else ["nothing was carried"]
        yield "initial.from, " + name, found


def checkpoints(program, work, everything):
    """Whether runs leave the same checkpoints, byte for byte, where laws remember and bonds fail. What differs."""
    names = [name for name in KINEMATICS if name not in PAIRS and "order" not in name] if everything else ("baqp", "projection")
    kinds = [(name, cloud, True) for name, cloud in (itertools.product(names, (False, True)) if everything else zip(names, (False, True)))]
    # Ghosts have a law of their own, bodies of one law have none beside it.
    kinds += [("baqp", cloud, False) for cloud in ((False, True) if everything else (False,))]
    for name, cloud, inclusion in kinds:
        text = torn(KINEMATICS[name], DAMAGE["critical_stretch"], cloud, HYPOELASTIC).replace("frames = 3", "frames = 3\ncheckpoint_every = 50")
        text = with_inclusion(text) if inclusion else text
        # Of the same name, for checkpoints hold their scenes.
        folder, found, kept = work + "/checkpoints", [], []
        for ranks in (0, 3):
            done = run(program, text, folder, ranks)
            found += [done.stderr.strip()] if done.returncode != 0 else not_as_meant(text, folder)
            with open(folder + "/checkpoint.h5", "rb") as file:
                kept.append(file.read())
        found += [] if kept[0] == kept[1] else ["checkpoint.h5"]
        yield "checkpoints, %s, hypoelastic, %s%s" % (name, "inclusion, " if inclusion else "", "cloud" if cloud else "lattice"), found


def written_by_all(program, work, everything):
    """Frames that every rank writes a share of are, byte for byte, those of one rank. What differs."""
    for name, cloud in itertools.product(("conventional", "baqp") if everything else ("conventional",), (False, True)):
        text = scene(KINEMATICS[name], 2, cloud)
        one, several, found = work + "/gathered", work + "/written_by_all", []
        done = run(program, text, one, 0)
        found += [done.stderr.strip()] if done.returncode != 0 else []
        for ranks in (2, 3):
            # Pieces of 100 points: several for each rank, and a last one that is short.
            done = run(program, text, several, ranks, environment={"PERIKIT_GATHERED_POINTS": "100"})
            if found or done.returncode != 0:
                found.append(done.stderr.strip())
                continue
            found += differences(one, several)
            if log_lines(several, "frames") != ["frames        written by all ranks\n"]:
                found.append("rank 0 has written the frames")
            for frame in os.listdir(one + "/frames"):
                with open(one + "/frames/" + frame, "rb") as a, open(several + "/frames/" + frame, "rb") as b:
                    if a.read() != b.read():
                        found.append(frame)
        yield "frames written by all ranks, %s" % ("cloud" if cloud else "lattice"), found


def log_lines(folder, name):
    with open(folder + "/run.log") as log:
        return [line for line in log if line.startswith(name + " ")]


def not_as_meant(text, folder):
    """What the scene is for and did not happen in its run, in words."""
    found = []
    if "[damage]" in text and not re.search(r"failed bonds +[1-9]|weakened [1-9]", "".join(log_lines(folder, "failed bonds"))):
        found.append("no bond failed")
    if "[run]\nweak_springs" in text and not any("weak springs" in line for line in log_lines(folder, "warning")):
        found.append("nothing is loose")
    return found


def compare(program, gathered, folder, name, text, ranks, threads):
    """The name of the case, how many runs were compared, and what was wrong, a line each."""
    one, several = folder + "_one", folder + "_several"
    done = run(program, text, one, 0)
    if done.returncode != 0:
        return name, 0, [" on one rank: " + done.stderr.strip()]
    lines, count = [": " + what for what in not_as_meant(text, one)], 0
    for r, t in itertools.product(ranks, threads):
        done = run(program, text, several, r, t, environment=gathered)
        found = [done.stderr.strip()] if done.returncode != 0 else differences(one, several)
        count += 1
        if found:
            lines.append(", %d ranks x %d threads: %s" % (r, t, "; ".join(found[:3])))
    return name, count, lines


def main():
    program, library, work, which = sys.argv[1:]
    need(library)
    # The companion of one rank on several: the first of them has it.
    gathered = hide_petsc(library, work)
    failed, count = [], 0
    # Two at a time: most of a short run on several ranks is their start, in which they wait for each other.
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        jobs = []
        for number, (name, text, ranks, threads) in enumerate(list(cases(which == "all", work))):
            # The small form takes the numbers of ranks by turns: every case runs, and each number of ranks has half of them.
            taken = ranks if which == "all" else ranks[number % len(ranks):][:1]
            jobs.append(pool.submit(compare, program, gathered, "%s/%d" % (work, number), name, text, taken, threads))
        for job in jobs:
            name, compared, lines = job.result()
            count += compared
            if lines:
                failed.append(name)
            print("\n".join("FAILED  %s%s" % (name, line) for line in lines) if lines else "same    " + name, flush=True)
    for name, found in itertools.chain(carried(program, work, which == "all"), checkpoints(program, work, which == "all"), written_by_all(program, work, which == "all")):
        count += 1
        if found:
            failed.append(name)
        print(("FAILED  %s: " % name + "; ".join(found[:3])) if found else "same    " + name, flush=True)
    print("%d runs compared, %d cases failed" % (count, len(set(failed))))
    sys.exit(1 if failed or count == 0 else 0)


main()
