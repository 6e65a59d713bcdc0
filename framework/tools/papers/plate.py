"""Finite elements for the plate with a hole of Hashim et al., section 4.5, which the paper compares with its own ones (Fig. 32) without printing numbers: plane
strain, small strains, 150 mm x 50 mm, hole of radius 10 mm, ends that move apart by 0.1 mm each and cannot contract.

Quarter of the plate, biquadratic elements of nine nodes: a fan from the hole to the square of the half width, and the rectangle beside it. With `rings` = 3, 4, 6 the
displacement of the hole's edge on the axis is 42.63, 42.66, 42.68 um: the reference is exact to 0.05 % of the ends' motion."""

import functools

import numpy as np

LENGTH, WIDTH, RADIUS, POISSON, PULL = 0.075, 0.025, 0.010, 0.33, 1e-4  # half the length, half the width


def _lagrange(x):
    return np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2]), np.array([x - 0.5, -2 * x, x + 0.5])


def _mesh(rings):
    """Positions of the nodes, and the two blocks of their numbers."""
    nodes, positions = {}, []

    def node(x, y):
        key = (round(x * 1e9), round(y * 1e9))
        if key not in nodes:
            nodes[key] = len(positions)
            positions.append((x, y))
        return nodes[key]

    def fan(share, angle):
        outer = WIDTH / max(np.cos(angle), np.sin(angle))
        radius = RADIUS + share * (outer - RADIUS)
        return node(radius * np.cos(angle), radius * np.sin(angle))

    shares, angles = np.linspace(0, 1, 2 * rings + 1) ** 1.5, np.linspace(0, np.pi / 2, 4 * rings + 1)
    columns = np.linspace(WIDTH, LENGTH, 4 * rings + 1)
    fans = np.array([[fan(share, angle) for angle in angles] for share in shares])
    beside = np.array([[node(x, WIDTH * np.tan(angle)) for angle in angles[: 2 * rings + 1]] for x in columns])
    return np.array(positions), fans, beside


def _stiffness(x):
    """Of an element with nodes x, for Young's modulus 1."""
    lame, shear = POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), 1 / (2 * (1 + POISSON))
    law = np.array([[lame + 2 * shear, lame, 0], [lame, lame + 2 * shear, 0], [0, 0, shear]])
    stiffness = np.zeros((18, 18))
    points, weights = np.polynomial.legendre.leggauss(3)
    for a, of_a in zip(points, weights):
        for b, of_b in zip(points, weights):
            (la, da), (lb, db) = _lagrange(a), _lagrange(b)
            slope = np.array([np.outer(da, lb).ravel(), np.outer(la, db).ravel()])
            jacobian = slope @ x
            slope = np.linalg.solve(jacobian, slope)
            strain = np.zeros((3, 18))
            strain[0, ::2], strain[1, 1::2], strain[2, ::2], strain[2, 1::2] = slope[0], slope[1], slope[1], slope[0]
            stiffness += of_a * of_b * abs(np.linalg.det(jacobian)) * strain.T @ law @ strain
    return stiffness


@functools.lru_cache
def axis(rings=6):
    """x and u_x of the nodes on the axis y = 0, from the hole's edge to the end."""
    positions, fans, beside = _mesh(rings)
    total = np.zeros((2 * len(positions),) * 2)
    for block in (fans, beside):
        for i in range(0, block.shape[0] - 2, 2):
            for j in range(0, block.shape[1] - 2, 2):
                nodes = block[i : i + 3, j : j + 3].ravel()
                unknowns = np.stack([2 * nodes, 2 * nodes + 1], axis=1).ravel()
                total[np.ix_(unknowns, unknowns)] += _stiffness(positions[nodes])
    end = positions[:, 0] > LENGTH - 1e-9
    u, held = np.zeros(len(total)), np.zeros(len(total), dtype=bool)
    held[0::2] = (positions[:, 0] < 1e-9) | end
    held[1::2] = (positions[:, 1] < 1e-9) | end
    u[0::2][end] = PULL
    u[~held] = np.linalg.solve(total[np.ix_(~held, ~held)], -total[np.ix_(~held, held)] @ u[held])
    line = np.concatenate([fans[:, 0], beside[1:, 0]])
    return positions[line, 0], u[2 * line]
