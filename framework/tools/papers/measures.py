"""What rows measure on results, and the references that papers compare with where these are not printed: beams, elasticas."""

import math
import re

import numpy as np

import plate


# Slender beams under pressure (Hashim et al., sections 4.2, 4.3): E I w'''' - N w'' = q, N/(E A) the mean of w'^2/2 (von Karman), ends
# held along the axis, clamped or pinned. 254 mm x 5.08 mm, E = 68.95 GPa, 276 kPa.

def beam_deflection(load, clamped):
    """Deflection in the middle over the depth, at `load` (0 to 1) times 276 kPa."""
    length, depth, modulus = 0.254, 5.08e-3, 68.95e9
    inertia, q, a = depth**3 / 12, 276e3 * load, 0.127
    s = np.linspace(-1.0, 1.0, 2001) * a

    def shape(force):
        k = np.sqrt(force / (modulus * inertia))
        if clamped:
            w = q / (2 * force) * (a**2 - s**2) - q * a / (force * k * np.sinh(k * a)) * (np.cosh(k * a) - np.cosh(k * s))
            slope = -q * s / force + q * a / (force * np.sinh(k * a)) * np.sinh(k * s)
        else:
            w = q / (2 * force) * (a**2 - s**2) - q / (force * k**2) * (1 - np.cosh(k * s) / np.cosh(k * a))
            slope = -q * s / force + q / (force * k) * np.sinh(k * s) / np.cosh(k * a)
        return w, slope

    low, high = 1e-6 * modulus * inertia / length**2, 1e4 * modulus * inertia / length**2
    for _ in range(200):
        force = np.sqrt(low * high)
        slope = shape(force)[1]
        stretch = np.sum((slope[1:] ** 2 + slope[:-1] ** 2) / 4) * (s[1] - s[0]) / length
        low, high = (force, high) if modulus * depth * stretch > force else (low, force)
    return shape(np.sqrt(low * high))[0][1000] / depth


def cantilever(load, at=9.9):
    """Elastica of Hashim et al., section 4.4: horizontal and vertical displacement [m] where a vertical force of `load` times 100 kN acts."""
    stiffness = 12e6 / 12
    ratio = load * 100e3 / stiffness
    s = np.linspace(0.0, at, 401)

    # angle'' = -P cos(angle)/(E I), angle(0) = 0, angle'(at) = 0: shooting on the slope of the end.
    def end(angle):
        theta, bend, h = angle, 0.0, s[1] - s[0]
        x = y = 0.0
        for _ in range(len(s) - 1):  # from the free end to the clamped one
            middle = theta - bend * h / 2
            bend_middle = bend + ratio * math.cos(theta) * h / 2
            x, y = x + h * math.cos(middle), y + h * math.sin(middle)
            theta, bend = theta - bend_middle * h, bend + ratio * math.cos(middle) * h
        return theta, x, y

    low, high = 0.0, np.pi / 2
    for _ in range(30):
        angle = (low + high) / 2
        low, high = (angle, high) if end(angle)[0] < 0 else (low, angle)
    _, x, y = end((low + high) / 2)
    return at - x, y


def hinged_ring(length, depth, gap):
    """Height of the middle of a rod of which two hinges, half its depth off the axis on the concave side at both ends, have come to
    `gap` of each other: inextensible elastica. Returns the height of the middle above the line of the hinges, the angle of the ends, and the
    force over E I."""
    half = length / 2

    def end(curvature, force):
        # from the middle: angle' = -(curvature - force y), y the drop below the middle; bending moment in units of E I
        n, theta, x, y = 2000, 0.0, 0.0, 0.0
        h = half / n
        for _ in range(n):
            k = curvature - force * y
            middle = theta + k * h / 2
            x, y = x + h * np.cos(middle), y + h * np.sin(middle)
            theta += (curvature - force * y + k) / 2 * h
        hinge_x, hinge_y = x - depth / 2 * np.sin(theta), y + depth / 2 * np.cos(theta)
        return hinge_x - gap / 2, curvature - force * hinge_y, hinge_y, theta

    # Two equations: the hinges' distance, and no moment there. Newton's method by differences, from the circle's neighbourhood.
    unknown = np.array([1.8 * np.pi / length, 20.0 / length**2])
    for _ in range(60):
        r = np.array(end(*unknown)[:2])
        jacobian = np.empty((2, 2))
        for k in range(2):
            d = unknown.copy()
            d[k] *= 1 + 1e-6
            jacobian[:, k] = (np.array(end(*d)[:2]) - r) / (unknown[k] * 1e-6)
        step = np.linalg.solve(jacobian, r)
        unknown -= step * min(1.0, 0.3 / np.max(np.abs(step / unknown)))
        if np.max(np.abs(step / unknown)) < 1e-10:
            break
    return end(*unknown)[2], end(*unknown)[3], unknown[1]


def elong(value):
    """Relative error of the elongation of the bar under traction of Partmann et al. (eqs. 5.2-5.5): 100 mm, 2 GPa, E = 210 GPa."""
    stretch = max(np.roots([1, 0, -1, -2 * 2e9 / 210e9]).real)
    return value / (0.1 * (stretch - 1)) - 1


# Runs.

def residuals(log, step):
    """Relative residuals of a load step, first to last, from run.log: [[iteration 0], 1, ...]."""
    part = re.split(r"^step +\d+  t = ", log, flags=re.M)[1:]
    return np.array([float(x) for x in re.findall(r"iteration +\d+  residual (\S+)", part[step - 1])])


def most_iterations(log, steps):
    return max(len(residuals(log, step)) - 1 for step in steps)


def rate(spacing, error):
    """Slope of log(error) over log(spacing), by least squares."""
    return np.polyfit(np.log(spacing), np.log(error), 1)[0]


def crossing(x, y):
    """Where y(x) passes zero for the first time, straight in log(x)."""
    for a, b, u, v in zip(x[:-1], x[1:], y[:-1], y[1:]):
        if u * v <= 0:
            return float(np.exp(np.log(a) + (np.log(b) - np.log(a)) * u / (u - v)))
    return np.nan


def along(results, field, axis, **fixed):
    """A component or scalar of the points of a line, sorted along `axis`: positions, values. fixed: y=0.5 takes the nearest row."""
    position = results.position
    chosen = np.ones(len(position), dtype=bool)
    for name, value in fixed.items():
        column = position[:, "xyz".index(name)]
        chosen &= np.abs(column - column[np.argmin(np.abs(column - value))]) < 1e-9 * np.ptp(position)
    order = np.flatnonzero(chosen)[np.argsort(position[chosen, "xyz".index(axis)])]
    return position[order, "xyz".index(axis)], results.field(field)[order]


def roughness(u):
    """Sum of |second differences| over the whole rise."""
    return np.sum(np.abs(np.diff(u, 2))) / abs(u[-1] - u[0])


def sawtooth(u, scale):
    """Root mean square of (u_(k-1) - 2 u_k + u_(k+1))/4 over `scale`."""
    return np.sqrt(np.mean((np.diff(u, 2) / 4) ** 2)) / scale


def crack(results, plane, layer=True, least=0.25):
    """Cracked points (damage above `least`; of the layer with the largest z): largest x, largest distance from y = plane."""
    x, damage = results.position, results.field("damage")
    top = np.abs(x[:, 2] - x[:, 2].max()) < 1e-9 if layer else np.ones(len(x), dtype=bool)
    cracked = top & (damage > least)
    return (x[cracked, 0].max(), np.abs(x[cracked, 1] - plane).max()) if cracked.any() else (np.nan, np.nan)


def balance(results, after=0.125):
    """Work less strain, kinetic and dissipated energy, the largest later than a share of the run, over the largest work."""
    h = results.history
    held = h["strain_energy"] + h["kinetic_energy"]
    missing = h["external_work"] - (held - held[0]) - h["dissipated_energy"]
    return np.max(np.abs(missing[h["time"] > after * h["time"][-1]])) / np.max(np.abs(h["external_work"]))


def mean_relative_error(results, exact):
    """Eq. 56 of Hashim et al.: mean of |u - exact|/|exact| over the volume, but for points that do not move."""
    u, e = results.field("displacement"), exact(results.position)
    size = np.linalg.norm(e, axis=1)
    moving = size > 1e-12 * size.max()
    return np.average(np.linalg.norm(u - e, axis=1)[moving] / size[moving], weights=results.volume[moving])


def coefficients(texts):
    """Numbers of a column of a study like `silling (coefficient = 0.1)`."""
    return np.array([float(re.search(r"coefficient = ([^),]+)", text).group(1)) for text in texts])


def elastic_energy(results, name, youngs_modulus=210000.0, poisson_ratio=0.25):
    """Energy density of the Saint Venant-Kirchhoff law at the point gradient, mean over a set."""
    F = results.field("deformation_gradient")[results.sets[name]].reshape(-1, 3, 3)
    E = (np.swapaxes(F, 1, 2) @ F - np.eye(3)) / 2
    shear, lame = youngs_modulus / (2 * (1 + poisson_ratio)), youngs_modulus * poisson_ratio / (1 + poisson_ratio) / (1 - 2 * poisson_ratio)
    return np.mean(lame / 2 * np.trace(E, axis1=1, axis2=2) ** 2 + shear * np.sum(E**2, axis=(1, 2)))


def twist_difference(study):
    """[%]: largest twist (u_x of the corner) of the second run over that of the first, less 1; largest distance of the two motions, over the largest motion."""
    paths = []
    for k in (0, 1):
        h = study.results(k).history
        paths.append((h["time"], np.column_stack([h["corner_ux"], h["corner_uy"], h["end_uz"]])))
    other = np.column_stack([np.interp(paths[0][0], paths[1][0], column) for column in paths[1][1].T])
    largest = [np.max(np.abs(path[1][:, 0])) for path in paths]
    return 100 * np.array([largest[1] / largest[0] - 1, np.max(np.linalg.norm(paths[0][1] - other, axis=1)) / np.max(np.linalg.norm(paths[0][1], axis=1))])


def ring(results):
    """The bar of Fig. 11 of Partmann et al.: distance of the inner edges [mm] (of the outermost points, less a spacing's share), and the moment of the
    reactions of the left end about its edge over E I times the curvature in the middle."""
    x, u, reaction = results.position, results.field("displacement"), results.field("reaction")
    spacing = 2 * x[:, 0].min()
    y, left = x + u, results.sets["left"]
    turn = u[left][np.argmax(x[left, 2])] - u[left][np.argmin(x[left, 2])]  # of the end face, over nearly its depth
    depth = np.ptp(x[left, 2])
    angle = np.arctan2(-turn[0], depth + turn[2])
    corner = left[np.argmin(x[left, 0] + x[left, 2])]
    edge = y[corner] - spacing / 2 * np.array([np.cos(angle) - np.sin(angle), 0, np.sin(angle) + np.cos(angle)])
    arm = y[left] - edge
    moment = np.sum(arm[:, 2] * reaction[left, 0] - arm[:, 0] * reaction[left, 2])
    # curvature of the middle from the stretch of its outermost rows of points
    def row(z):
        near = (np.abs(x[:, 0] - 0.1) < 4.1 * spacing) & (np.abs(x[:, 2] - z) < 0.1 * spacing)
        a, b = near & (x[:, 0] < 0.1), near & (x[:, 0] > 0.1)
        return np.linalg.norm(y[b].mean(axis=0) - y[a].mean(axis=0)) / (x[b, 0].mean() - x[a, 0].mean())
    curvature = (row(x[:, 2].max()) - row(x[:, 2].min())) / np.ptp(x[:, 2])
    return np.array([-2e3 * (edge[0] - 0.1), moment / (2.3e9 * 0.01**4 / 12 * curvature)])


def branches(results, start, least=0.25):
    """Of the layer with the largest z: x from which some column of points is cracked in two places, two points or more between them, and the
    largest number of such places in a column. (nan, 1) where there is no such column beyond `start`."""
    x, damage = results.position, results.field("damage")
    top = np.abs(x[:, 2] - x[:, 2].max()) < 1e-9
    spacing = np.min(np.diff(np.unique(np.round(x[:, 1], 9))))
    first, most = np.nan, 1
    for column in np.unique(np.round(x[top & (x[:, 0] > start), 0], 9)):
        y = np.sort(x[top & (np.abs(x[:, 0] - column) < 1e-9) & (damage > least), 1])
        places = 1 + int(np.sum(np.diff(y) > 2.5 * spacing))
        if places > 1 and np.isnan(first):
            first = column
        most = max(most, places)
    return first, most


def inside(results):
    """Points of a bar of length 1 that are three horizons of 0.01 and more from its ends: e(k) of these."""
    x = results.position[:, 0]
    return (x > 0.03) & (x < 0.97)


def spectrum(energy, kinematics, k, which, grid):
    """e(k) at a half, nine tenths and all of the wave number of the grid, over that at k = 50."""
    name = {"conventional": "conventional", "two": "parts = 2", "four": "parts = 4"}[which]
    e = {int(wave): value for wave, value, text in zip(k, energy, kinematics) if name in text}
    return [e[w] / e[50] for w in (grid // 2, 9 * grid // 10, grid)]


def kinematics_is(texts, name, local):
    """Rows of a study whose kinematics is `name`, with the published force states or without."""
    return np.array([text.startswith(name) and ("local" in text) == local for text in texts])


def penalty(texts):
    """Coefficients of the penalty in a column of a study, 0 where there is none."""
    return np.array([coefficients([text])[0] if "coefficient" in text else 0.0 for text in texts])


def plate_axis(results):
    """Plate with a hole: largest distance of u_x along the row next to the axis from the finite elements of plate.py, and its sawtooth, in % of the ends'
    motion. Half of the plate, without the columns that carry the motion."""
    x, u = along(results, "displacement", "x", y=1e-6)
    inside = (x > 0) & (x < plate.LENGTH)
    x, u = x[inside], u[inside, 0]
    off = np.max(np.abs(u - np.interp(x, *plate.axis())))
    return [100 * off / plate.PULL, 100 * sawtooth(u, plate.PULL)]


def hole(results):
    """Plate with a hole: how far from its axes points with damage above 0.25 lie, largest |y|, largest |x| [mm]."""
    x, damage = results.position, results.field("damage")
    return 1e3 * np.array([np.abs(x[damage > 0.25, 1]).max(), np.abs(x[damage > 0.25, 0]).max()])
