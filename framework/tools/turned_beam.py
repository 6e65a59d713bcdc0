#!/usr/bin/env python3
"""The double cantilever beam (configs/fracture/double_cantilever.toml) on lattices that are turned against the crack, at twice the spacing: energy per
new area and G over Gc with bonds that fail at once and with bonds that weaken. A Markdown table is printed; it is that of framework/docs/fracture.md, "What a
crack costs".

    turned_beam.py PERIKIT OUT [--spacing 2e-3]

Runs that are done are kept.
"""

from functools import partial

import beam_runs


def main():
    options = beam_runs.options_of(__doc__)
    cases = [(degrees, softening) for degrees in (15, 30, 45) for softening in (1, 4)]
    beam_runs.table("kinematics", ["%d degrees, %s" % (d, "softening 4" if s > 1 else "at once") for d, s in cases],
                    [(kinematics, [partial(beam_runs.cell, options, kinematics, degrees=degrees, softening=softening) for degrees, softening in cases])
                     for kinematics in ("`bond_based`", "`baqp`", "`conventional` with `wan`")])


main()
