"""Pencils of spherical light fields: triangles of directions, and how much each counts for a direction."""

import numpy as np

from screen import unit

GOLDEN = (1 + 5 ** 0.5) / 2
POSITIONS = unit(np.array([
    (-1, GOLDEN, 0), (1, GOLDEN, 0), (-1, -GOLDEN, 0), (1, -GOLDEN, 0), (0, -1, GOLDEN), (0, 1, GOLDEN),
    (0, -1, -GOLDEN), (0, 1, -GOLDEN), (GOLDEN, 0, -1), (GOLDEN, 0, 1), (-GOLDEN, 0, -1), (-GOLDEN, 0, 1)]))
FACES = np.array([
    (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
    (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)])


def levels_of_pencils(levels):
    """For each level, corners of its pencils, and the image that each shows, numbered through all levels."""
    corners, images = POSITIONS[FACES], np.arange(20)
    yield corners, images
    for _ in range(levels - 1):
        a, b, c = (corners[:, i] for i in range(3))
        ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
        first = 3 * np.arange(len(corners)) + len(corners)
        children = [(bc, ca, ab), (a, ab, ca), (ab, b, bc), (ca, bc, c)]
        corners = np.stack([np.stack(child, 1) for child in children], 1).reshape(-1, 3, 3)
        images = np.stack([images, first, first + 1, first + 2], 1).ravel()
        yield corners, images


def directions_of_images(levels):
    """The middle of the coarsest pencil that shows each image."""
    directions = {}
    for corners, images in levels:
        for triangle, image in zip(corners, images):
            directions.setdefault(image, unit(triangle.sum(0)))
    return directions


def pencil_at(corners, toward):
    """The pencil that holds each direction."""
    sides = np.stack([np.cross(corners[:, (i + 1) % 3], corners[:, (i + 2) % 3]) for i in range(3)], 1)
    return np.einsum("nx,tcx->ntc", toward, sides).min(2).argmax(1)


def pencil_shares(corners, toward):
    """Weights [direction, pencil] of pencils, linear in each sixth (middle, corner, middle of a side) of a pencil."""
    _, vertex = np.unique(corners.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    vertex = vertex.reshape(-1, 3)  # of each corner
    held, shares = pencil_at(corners, toward), np.zeros((len(toward), len(corners)))
    for pencil in np.unique(held):
        at = np.flatnonzero(held == pencil)
        own, sixths = corners[pencil], []
        for i, j in ((0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2)):  # corner i, side i j
            x = np.linalg.solve(np.stack([unit(own.sum(0)), own[i], unit(own[i] + own[j])], 1), toward[at].T).T
            around = (vertex == vertex[pencil, i]).any(1)
            at_side = around & (vertex == vertex[pencil, j]).any(1)  # this pencil and the one across
            sixths.append((x, around / around.sum(), at_side / 2))
        chosen = np.argmax([x.min(1) for x, _, _ in sixths], 0)
        for number, (x, at_corner, at_side) in enumerate(sixths):
            here = chosen == number
            x = x[here] / x[here].sum(1, keepdims=True)
            shares[at[here]] = x[:, 1:2] * at_corner + x[:, 2:] * at_side
            shares[at[here], pencil] += x[:, 0]
    return shares
