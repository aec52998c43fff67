#!/usr/bin/python3
"""Decodes an opacity light field with the weights of view-dependent texture mapping, and shows it to one camera.

    surflect pack VIEWS --method vdtm -o MODEL
    examples/decode/vdtm.py MODEL -o frame.npz
"""

import itertools

import numpy as np

from common import main
from screen import unit
from ulr import Field, show


def volumes(a, b, c):
    return (a * np.cross(b, c)).sum(-1)


def lower_hull(points, pole):
    """Triangles of the hull of points that a pole is not beyond, counter-clockwise seen from outside."""
    triples = np.array(list(itertools.combinations(range(len(points)), 3)))
    a, b, c = (points[triples[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    heights = np.vstack([points, pole]) @ normals.T - (normals * a).sum(1)  # above the plane of each triple
    above, below = (heights > 1e-12).any(0), (heights < -1e-12).any(0)
    triples[above] = triples[above][:, ::-1]
    return triples[above != below]


def on_sphere(directions):
    """Directions, their Delaunay triangles, and the place x inside of these."""
    mean = unit(directions.sum(0))
    return directions, lower_hull(directions, -mean), mean


def in_plane(points):
    """Points (x, y, 1) of the tangent plane, their Delaunay triangles, and the centroid of these."""
    lifted = np.column_stack([points[:, :2], (points[:, :2] ** 2).sum(1)])
    triangles = lower_hull(lifted, (0, 0, 1e6))[:, ::-1]
    corners = points[triangles]
    areas = volumes(*(corners[:, i] for i in range(3)))
    return points, triangles, (areas[:, None] * corners.mean(1)).sum(0) / areas.sum()


def flattened(directions, normal):
    """Directions on the tangent plane: (x, y, 1); those below are put on the rim of the unit disc."""
    x = unit(np.cross(normal, np.eye(3)[np.abs(normal).argmin()]))
    points = np.column_stack([directions @ x, directions @ np.cross(normal, x), np.ones(len(directions))])
    under = directions @ normal < 0
    points[under, :2] = unit(points[under, :2])
    return points


def vdtm_weights(directions, toward, normal, plane=False):
    """Weights of the views in these directions from a vertex, for a viewer in direction `toward`."""
    weights, views = np.zeros(len(directions)), np.arange(len(directions))
    if plane:
        views = np.flatnonzero(directions @ normal >= 0)
        directions, toward = flattened(directions[views], normal), flattened(toward[None], normal)[0]
    if len(views) < 3:
        nearness = 1 / np.maximum(np.linalg.norm(directions - toward, axis=1), 1e-14)
        weights[views] = nearness / nearness.sum()
        return weights
    sites, triangles, middle = (in_plane if plane else on_sphere)(directions)
    a, b, c = (sites[triangles[:, i]] for i in range(3))
    inside = np.stack([volumes(toward, b, c), volumes(a, toward, c), volumes(a, b, toward)], 1)
    holding = (inside >= -1e-12 * np.abs(inside).sum(1, keepdims=True)).all(1)
    if holding.any():
        found = np.flatnonzero(holding)[0]
        weights[views[triangles[found]]] = np.maximum(inside[found], 0)
        return weights / weights.sum()
    # Beyond the border: the two views of the edge that is crossed on the way from the middle.
    edges = {(t[i], t[(i + 1) % 3]) for t in triangles.tolist() for i in range(3)}
    border = np.array([edge for edge in edges if edge[::-1] not in edges])
    a, b = sites[border[:, 0]], sites[border[:, 1]]
    shares = np.stack([volumes(toward, b, middle), volumes(a, toward, middle)], 1)
    total = shares.sum(1)
    found = np.where(total > 0, shares.min(1) / np.where(total > 0, total, 1), -np.inf).argmax()
    weights[views[border[found]]] = np.clip(shares[found] / total[found], 0, 1)
    return weights


def decode(model, camera):
    field = Field(model, 0)
    plane = field.numbers["domain"] == 1
    return show(field, camera, lambda *vertex: vdtm_weights(*vertex, plane))


if __name__ == "__main__":
    main(__doc__, decode)
