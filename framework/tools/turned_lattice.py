"""Point files of lattices that are turned against a rectangle, for the tools beside this file."""

import math

import numpy


def write(file, spacing, degrees, lower, upper):
    """The points of the lattice within the rectangle, each with the volume of a cell; the origin is the corner of four cells."""
    turn = math.radians(degrees)
    n = int(2 * max(abs(c) for c in (*lower, *upper)) / spacing)
    i, j = numpy.meshgrid(numpy.arange(-n, n) + 0.5, numpy.arange(-n, n) + 0.5)
    x = spacing * (math.cos(turn) * i - math.sin(turn) * j).ravel()
    y = spacing * (math.sin(turn) * i + math.cos(turn) * j).ravel()
    inside = (x > lower[0]) & (x < upper[0]) & (y > lower[1]) & (y < upper[1])
    points = numpy.column_stack([x[inside], y[inside], numpy.full(inside.sum(), spacing**2)])
    numpy.savetxt(file, points, delimiter=",", header="x,y,volume", comments="")


def put_in(text, name):
    """A scene with this point file in the place of its [body.lattice], which [sets] follows."""
    begin, end = text.index("[body.lattice]"), text.index("[sets]")
    return text[:begin] + '[body.points]\nfile = "%s"\n\n' % name + text[end:]


def turned(text, folder, spacing, degrees, lower, upper):
    """The scene, on such a lattice where there are degrees; its points stand beside the folder of its run."""
    if not degrees:
        return text
    points = folder.with_suffix(".csv")
    write(points, spacing, degrees, lower, upper)
    return put_in(text, points.name)
