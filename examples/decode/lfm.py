#!/usr/bin/python3
"""Decodes light field maps, and shows them to one camera.

    surflect pack VIEWS --method lfm -o MODEL
    examples/decode/lfm.py MODEL -o frame.npz
"""

import numpy as np

from common import Folder, main
from edges import corrections, from_edges, from_sides, look_up, on_edges
from s3tc import read_tiles
from screen import Fragments, interior, unit


VERSION = 3  # of the format


class Maps:
    """Content of maps.bin. A table has the map of each user, -1 for none, and values [map, row, column, channel].

    `edges` has corrections: of surface maps, by term, [triangle, corner, side, step, 1]; of means the same by channel.
    """

    def __init__(self, folder, corners, magic, channels):
        file = folder.read("maps.bin")
        assert bytes(file.take("u1", 8)) == magic
        vertices, triangles, method, self.scalar, self.samples, self.cells, higher, terms = (file.count() for _ in range(8))
        surface, view, mean = (file.count() for _ in range(3))
        white = file.take("f4", 1)[0]
        frames = file.take("f4", vertices, 2, 3).astype(float)
        self.frames = np.stack([frames[:, 0], np.cross(frames[:, 1], frames[:, 0]), frames[:, 1]], 1)
        signed = (lambda b: np.maximum(b.view(np.int8) / 127, -1)) if method == 0 else (lambda b: b / 255)
        codes = 127 if method == 0 else 255  # for a value of 1
        patch = np.add.outer(np.arange(self.samples), np.arange(self.samples)) < self.samples  # [row j, column i]
        squares = [np.ones((cells, cells), bool) for cells in (self.cells, *[higher] * 63)]
        users, of_corners = (3 * triangles, 1) if self.scalar else (triangles, 3)
        self.terms = [{"scale": file.take("f4", vertices),
                       "surface": self.table(file, users, surface, patch, of_corners, signed, method == 0),
                       "view": self.table(file, vertices, view, squares[k], channels, signed, method == 0)}
                      for k in range(terms)]
        self.mean = self.table(file, 0 if method else triangles, mean, patch, channels, lambda b: white * b / 255, False)
        surfaces = [on_edges(term["surface"], self.samples, self.scalar, True) for term in self.terms]
        self.edges = [corrections(corners, surface, codes, False) for surface in surfaces]
        means = None if method else on_edges(self.mean, self.samples, False, False)
        self.mean_edges = 0 if method else corrections(corners, means, 255 / white, True)

    def table(self, file, users, coding, stored, channels, valued, biased):
        """Map of each user, and values of the maps; valued() turns bytes into values."""
        count, listed = file.count(), file.count()
        of_user = np.arange(users)
        if listed:
            kind = "u2" if count < 65535 else "u4"
            of_user = file.take(kind, users).astype(int)
            of_user[of_user == np.iinfo(kind).max] = -1
        if coding == 0:
            content = np.zeros((count, *stored.shape, channels), np.uint8)
            content[:, stored] = file.take("u1", count, stored.sum(), channels)
        else:
            content = read_tiles(file, coding, count, len(stored), channels, not stored.all())
            content = content - np.uint8(128 if biased else 0)
        return of_user, valued(content)


def patch_blend(samples, b, c):
    """The three samples (i, j) around barycentric coordinates b, c of corners 1 and 2."""
    last = samples - 1
    u = np.clip(b, 0, 1) * last
    v = np.clip(c * last, 0, last - u)
    i = np.minimum(u.astype(int), last - 1)
    j = np.minimum(v.astype(int), last - 1 - i)
    x, y = u - i, v - j
    low = (x + y <= 1) | (i + j == last - 1)
    return [(np.where(low, i, i + 1), np.where(low, j, j + 1), np.where(low, 1 - x - y, x + y - 1)),
            (np.where(low, i + 1, i), np.where(low, j, j + 1), np.where(low, x, 1 - x)),
            (np.where(low, i, i + 1), np.where(low, j + 1, j), np.where(low, y, 1 - y))]


def turned(samples, blend, corner):
    """The same samples, counted as if the triangle began at the corner."""
    for i, j, weight in blend:
        steps = (samples - 1 - i - j, i, j)
        yield steps[(corner + 1) % 3], steps[(corner + 2) % 3], weight


def view_blend(cells, frames, toward):
    """The four cells of view maps around directions to the viewer."""
    x, y, z = (frames * toward[:, None]).sum(2).T
    radius = np.where(z < 0, np.hypot(x, y), 1)
    x, y = (np.clip((t / radius + 1) / 2 * cells - 0.5, 0, cells - 1) for t in (x, y))
    i, j = (np.minimum(t.astype(int), cells - 2) for t in (x, y))
    a, b = x - i, y - j
    return [(i, j, (1 - a) * (1 - b)), (i + 1, j, a * (1 - b)), (i, j + 1, (1 - a) * b), (i + 1, j + 1, a * b)]


def roots(maps, triangles, fragments, toward):
    """The sum of mean and terms at each fragment."""
    n, t = maps.samples, fragments.triangle
    patch = patch_blend(n, fragments.weights[:, 1], fragments.weights[:, 2])
    total, b = 0, fragments.weights
    if len(maps.mean[0]):
        total = look_up(maps.mean, t, patch) + from_edges(maps.mean_edges, t, b)
    for term, edges in zip(maps.terms, maps.edges):
        cells = term["view"][1].shape[1]
        views = [view_blend(cells, maps.frames[triangles[t, k]], toward) for k in range(3)]
        if maps.scalar:
            surface = [look_up(term["surface"], 3 * t + k, turned(n, patch, k))[:, 0] for k in range(3)]
        else:
            surface = look_up(term["surface"], t, patch).T
        for k in range(3):
            vertex = triangles[t, k]
            factor = (surface[k] + from_sides(edges, t, b, k)) * fragments.weights[:, k] * term["scale"][vertex]
            total = total + factor[:, None] * look_up(term["view"], vertex, views[k])
    return total


def decode(model, camera):
    folder = Folder(model, "surflect light field maps", VERSION)
    positions, triangles = folder.mesh()
    maps = Maps(folder, triangles, b"lfm maps", 3)
    seen = Fragments(camera, positions, triangles)
    inside = interior(camera, seen)
    seen.only(seen.nearest)
    color = np.zeros((camera.height * camera.width, 3))
    color[seen.pixel] = np.maximum(roots(maps, triangles, seen, -unit(camera.rays(seen.pixel))), 0) ** 2
    return color.reshape(camera.height, camera.width, 3), inside


if __name__ == "__main__":
    main(__doc__, decode)
