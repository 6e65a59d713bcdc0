#!/usr/bin/env python3
"""What a crack costs with every influence function and horizon: the double cantilever beam (configs/fracture/double_cantilever.toml, an interface between its
arms) at twice the spacing. Energy per new area and G, over Gc. Four Markdown tables are printed, those of framework/docs/fracture.md, "What a crack costs": by
horizon with the `constant` kernel, at once and with softening 4; `cubic_spline` by softening; every kernel by kinematics; and kernels by horizon, on turned
lattices and on jittered ones, the latter two with the softening that bonds of such a length need.

    kernel_cost.py PERIKIT OUT [--spacing 2e-3]

Runs that are done are kept.
"""

from functools import partial

import beam_runs

KERNELS = {  # by name in the tables
    "`constant`": "constant",
    "`inverse`": "inverse",
    "`cone`": "cone",
    "`gaussian`": "gaussian",
    "`cubic_spline`": "cubic_spline",
    "`exp(-9*r^2)`": '{type="expression",formula="exp(-9*r^2)"}',
    "5 times it": '{type="expression",formula="5*exp(-9*r^2)"}',
}
PLACES = {  # horizon, degrees, jitter
    "horizon 2": (2.015, 0, 0),
    "horizon 3": (3.015, 0, 0),
    "horizon 4": (4.015, 0, 0),
    "turned by 22.5 degrees": (3.015, 22.5, 0),
    "turned by 45 degrees": (3.015, 45, 0),
    "jittered by 0.2": (3.015, 0, 0.2),
}


def resolved(kernel, ratio=3.015, degrees=0, jitter=0):
    """Eight spacings over the mean length of the bonds, or more; on jittered points half more."""
    short, wide = "-9*r^2" in kernel, ratio > 4
    if kernel == "cubic_spline":
        return 5 if wide else 9
    if short:
        return 7 if wide else 13 if ratio < 3 or jitter else 9
    return 9 if ratio < 3 else 6 if jitter else 4


def main():
    options = beam_runs.options_of(__doc__)
    cell = partial(beam_runs.cell, options)
    every = ("`bond_based`", "`ordinary`", "`baqp`", "`conventional` with `wan`")
    beam_runs.table("", ["%s, %s" % (kinematics, "softening 4" if r > 1 else "at once") for kinematics in every for r in (1, 4)],
                    [(place + ", `constant`", [partial(cell, kinematics, "constant", *PLACES[place], r) for kinematics in every for r in (1, 4)])
                     for place in ("horizon 2", "horizon 3", "horizon 4", "jittered by 0.2")])
    print()
    some = [(name, r) for name in ("horizon 3", "horizon 2", "turned by 22.5 degrees", "jittered by 0.2") for r in (4, 9, 16)]
    beam_runs.table("`cubic_spline`", ["%s, softening %d" % column for column in some],
                    [(kinematics, [partial(cell, kinematics, "cubic_spline", *PLACES[name], r) for name, r in some]) for kinematics in ("`ordinary`", "`baqp`")])
    print()
    def by_kinematics(kinematics, kernel):
        return cell(kinematics, kernel, softening=4 if kinematics == "`bond_associated`" else resolved(kernel))   # it takes less with more

    named = [kinematics for kinematics in beam_runs.KINEMATICS if kinematics != "`bond_based`"]   # which the influence function does not change
    beam_runs.table("kernel, softening", [name + (", always 4" if "bond_associated" in name else "") for name in named],
                    [("%s, %d" % (name, resolved(kernel)), [partial(by_kinematics, kinematics, kernel) for kinematics in named]) for name, kernel in KERNELS.items()])
    print()
    beam_runs.table("kinematics, kernel", list(PLACES),
                    [(kinematics + ", " + name, [partial(cell, kinematics, KERNELS[name], *place, resolved(KERNELS[name], *place)) for place in PLACES.values()])
                     for kinematics in ("`ordinary`", "`baqp`") for name in ("`constant`", "`gaussian`", "`cubic_spline`", "`exp(-9*r^2)`")])


main()
