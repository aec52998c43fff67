"""A camera, and what its pixels see of a mesh."""

import numpy as np


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


class Camera:
    """A pinhole at `position`; its axes are right, down and forward."""

    def __init__(self, position, look_at, up, fov_deg, size):
        self.position, (self.width, self.height) = np.array(position, float), size
        forward = unit(np.array(look_at, float) - self.position)
        right = unit(np.cross(forward, up))
        self.axes = np.stack([right, np.cross(forward, right), forward])
        self.focal = self.height / 2 / np.tan(np.radians(fov_deg) / 2)

    def rays(self, pixels):
        """Directions through the centres of pixels, which are numbered row by row; of length 1 along forward."""
        x = (pixels % self.width + 0.5 - self.width / 2) / self.focal
        y = (pixels // self.width + 0.5 - self.height / 2) / self.focal
        return np.stack([x, y, np.ones_like(x)], -1) @ self.axes


class Fragments:
    """All places where rays through pixel centres meet fronts of triangles, or both sides, by pixel, then depth.

    pixel, triangle, depth along forward, weights of the three corners, and whether it is the nearest of its pixel.
    """

    def __init__(self, camera, positions, triangles, both_sides=False):
        corners = ((positions - camera.position) @ camera.axes.T)[triangles]
        assert corners[..., 2].min() > 0, "the camera must be in front of the object"
        onto = corners[..., :2] / corners[..., 2:] * camera.focal + (camera.width / 2, camera.height / 2)
        size = np.array([camera.width, camera.height])
        low = np.clip(np.ceil(onto.min(1) - 0.5), 0, size).astype(int)
        span = np.maximum(np.clip(np.floor(onto.max(1) + 0.5), 0, size).astype(int) - low, 0)
        area = span.prod(1)
        triangle = np.repeat(np.arange(len(triangles)), area)  # once for each pixel of its bounding box
        nth = np.arange(len(triangle)) - np.repeat(np.cumsum(area) - area, area)
        x, y = low[triangle, 0] + nth % span[triangle, 0], low[triangle, 1] + nth // span[triangle, 0]
        ray = camera.rays(y * camera.width + x) @ camera.axes.T
        a, b, c = (corners[:, i] for i in range(3))
        sides = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], 1)
        volumes = (sides[triangle] * ray[:, None]).sum(2)  # negative where the ray passes on the inner side of a front
        turned = np.sign(volumes.sum(1)) if both_sides else np.full(len(volumes), -1)
        keep = np.flatnonzero((volumes * turned[:, None] >= 0).all(1) & (volumes.sum(1) * turned > 0))
        depth = (a * sides[:, 0]).sum(1)[triangle[keep]] / volumes[keep].sum(1)
        order = np.lexsort((depth, (y * camera.width + x)[keep]))
        keep, self.depth = keep[order], depth[order]
        self.pixel, self.triangle = (y * camera.width + x)[keep], triangle[keep]
        self.weights = volumes[keep] / volumes[keep].sum(1, keepdims=True)
        self.nearest = np.diff(self.pixel, prepend=-1) > 0
        # In pixels, from the nearest edge of the triangle.
        edges, center = (np.roll(onto, -1, 1) - onto)[self.triangle], np.stack([x, y], 1)[keep, None] + 0.5
        away = center - onto[self.triangle]
        across = (edges[..., 0] * away[..., 1] - edges[..., 1] * away[..., 0]) / np.linalg.norm(edges, axis=2)
        self.edge_distance = np.abs(across).min(1)

    def only(self, chosen):
        """Keeps some of the fragments."""
        for name in ("pixel", "triangle", "depth", "weights", "nearest", "edge_distance"):
            setattr(self, name, getattr(self, name)[chosen])
        return self

    def blend(self, values):
        """Values of corners, by triangle and corner, at each fragment."""
        return (self.weights[..., None] * values[self.triangle]).sum(1)


def interior(camera, fragments):
    """Pixels that see a surface without steps in depth, as all pixels around them do, and no edge of a triangle.

    Rasterisers round corners to 1/256 pixel or so, and may thus choose the triangle beyond an edge.
    """
    depth = np.full((camera.height + 2, camera.width + 2), np.inf)
    nearest = fragments.nearest
    depth[1:-1, 1:-1].flat[fragments.pixel[nearest]] = fragments.depth[nearest]
    clear = np.ones((camera.height, camera.width), bool)
    clear.flat[fragments.pixel[fragments.edge_distance < 1 / 256]] = False
    around = np.stack([depth[j:j + camera.height, i:i + camera.width] for j in range(3) for i in range(3)])
    middle = depth[1:-1, 1:-1]
    steps = np.ptp(np.where(np.isfinite(around), around, 0), 0)
    return clear & np.isfinite(around).all(0) & (steps < 8 * middle / camera.focal)
