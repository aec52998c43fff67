#!/usr/bin/python3
"""Decodes a lumigraph, and shows it to one camera.

    surflect pack VIEWS --method lumigraph -o MODEL
    examples/decode/lumigraph.py MODEL -o frame.npz
"""

import numpy as np

from common import Folder, bilinear, main
from screen import Fragments, interior

FILLED = 1e-3  # what a texel beside the object counts for its colour


class Slab:
    """Two planes across an axis, and the pictures [j, i] of the nodes of the st grid."""

    def __init__(self, folder, number, texels):
        numbers = folder.numbers
        self.axis, self.sign, self.nodes = number // 2, 1 - 2 * (number % 2), int(numbers["nodes"])
        after, last = (self.axis + 1) % 3, (self.axis + 2) % 3
        self.across = [after, last] if self.sign > 0 else [last, after]  # axes of u and s, of v and t
        value = lambda name: numbers[f"slab{number}.{name}"]
        self.st_plane, self.uv_plane, self.uv_spacing = (value(f) for f in ("st_plane", "uv_plane", "uv_spacing"))
        self.st_low, self.st_spacing, self.uv_low = (
            np.array([value(f"{f}.u"), value(f"{f}.v")]) for f in ("st_low", "st_spacing", "uv_low"))
        shape = self.nodes, self.nodes, int(value("height")), int(value("width")), 4
        self.pictures, self.rest = texels[:np.prod(shape) // 4].reshape(shape), texels[np.prod(shape) // 4:]

    def add(self, points, toward, weights, sums):
        """Adds weighted colours, their weights, and weighted alpha of points seen from directions `toward`."""
        across, depth = points[:, self.across], points[:, self.axis, None]
        st = across + (self.st_plane - depth) / toward[:, self.axis, None] * toward[:, self.across]
        st = np.clip((st - self.st_low) / self.st_spacing, 0, self.nodes - 1)
        first = st.astype(int)
        for corner in ((0, 0), (1, 0), (0, 1), (1, 1)):
            share = np.where(corner, st - first, 1 - (st - first)).prod(1) * weights
            node = np.minimum(first + corner, self.nodes - 1)
            place = self.st_low + node * self.st_spacing
            uv = across + (self.uv_plane - depth) / (self.st_plane - depth) * (place - across)
            u, v = ((uv - self.uv_low) / self.uv_spacing).T
            for i, j in np.unique(node[share > 0], axis=0):
                at = np.flatnonzero((node == (i, j)).all(1) & (share > 0))
                texels = bilinear(self.pictures[j, i], u[at], v[at])
                color_weight = share[at] * (texels[:, 3] + FILLED)
                sums[at, :3] += color_weight[:, None] * texels[:, :3]
                sums[at, 3] += color_weight
                sums[at, 4] += share[at] * texels[:, 3]


def radiance(folder, slabs, points, toward):
    """Premultiplied colours of points."""
    size, overlap = np.abs(toward), folder.numbers["overlap"]
    largest = size.max(1, keepdims=True)
    if overlap > 0:
        weights = np.maximum(1 - (largest - size) / largest * min(1e30, (1 + overlap) / overlap), 0)
    else:
        weights = np.eye(3)[size.argmax(1)]
    weights /= weights.sum(1, keepdims=True)
    sums = np.zeros((len(points), 5))
    for slab in slabs:
        used = np.where(toward[:, slab.axis] * slab.sign > 0, weights[:, slab.axis], 0)
        at = np.flatnonzero(used)
        if len(at):
            part = sums[at]
            slab.add(points[at], toward[at], used[at], part)
            sums[at] = part
    alpha = np.ones(len(points)) if folder.numbers["exact_outline"] else sums[:, 4]
    return (alpha / sums[:, 3])[:, None] * sums[:, :3]


def decode(model, camera):
    folder = Folder(model, "surflect lumigraph", 2)
    texels, slabs = folder.texels("texels.bin"), []
    for number in range(6):
        slabs.append(Slab(folder, number, texels))
        texels = slabs[-1].rest
    color, inside = np.zeros((camera.height * camera.width, 3)), None
    taken = np.zeros(len(color), bool)
    for mesh in ["mesh.bin"] if folder.numbers["exact_outline"] else ["geometry.bin", "fringe.bin"]:
        seen = Fragments(camera, *folder.mesh(mesh), both_sides=True)
        inside = interior(camera, seen) if inside is None else inside
        seen.only(seen.nearest & ~taken[seen.pixel])
        taken[seen.pixel] = True
        rays = camera.rays(seen.pixel)
        color[seen.pixel] = radiance(folder, slabs, camera.position + seen.depth[:, None] * rays, -rays)
    return color.reshape(camera.height, camera.width, 3), inside


if __name__ == "__main__":
    main(__doc__, decode)
