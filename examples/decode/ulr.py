#!/usr/bin/python3
"""Decodes an opacity light field with the weights of unstructured lumigraph rendering, and shows it to one camera.

    surflect pack VIEWS --method ulr -o MODEL
    examples/decode/ulr.py MODEL -o frame.npz
"""

import numpy as np

from common import Folder, View, bilinear, main
from s3tc import read_pictures
from screen import Fragments, interior, unit


class StoredView(View):
    """A photograph: its camera, and the part of it that is stored."""

    def __init__(self, rig, frame, file):
        super().__init__(rig, frame)
        self.low, self.scale = file.take("f8", 2, 2, 1)
        self.width, self.height = file.count(), file.count()

    def texels(self, points):
        """Places of points in the stored part, in texels."""
        return (self.pixels(points) - self.low) * self.scale


class Field:
    """Content of the folder: mesh, views, their pictures, and the visible views of each vertex."""

    def __init__(self, model, method):
        folder = Folder(model, "surflect opacity light field", 1)
        self.numbers = folder.numbers
        assert self.numbers["method"] == method, "a model of the other method"
        self.positions, triangles = folder.mesh()
        _, first, same = np.unique(self.positions, axis=0, return_index=True, return_inverse=True)
        self.triangles = first[same.ravel()][triangles]  # of vertices at one position, the first counts
        frames = folder.rig["frames"]
        file = folder.read("views.bin")
        self.views = [StoredView(folder.rig, frame, file) for frame in frames]
        first = file.take("u4", len(self.positions) + 1)
        self.visible = np.split(file.take("u4", first[-1]), first[1:-1])
        width, height = int(self.numbers["width"]), int(self.numbers["height"])
        if (folder.path / "blocks.bin").exists():
            file = folder.read("blocks.bin")
            self.whites = file.take("f4", len(frames)).astype(float)
            layers = read_pictures(file, 2, len(frames), width, height) / 255
        else:
            self.whites, layers = None, folder.texels("texels.bin").reshape(len(frames), height, width, 4)
        self.pictures = [layer[:view.height, :view.width] for layer, view in zip(layers, self.views)]
        self.centers = np.array([view.position for view in self.views])

    def seen(self, number, points):
        """Premultiplied colour and alpha of points in a view."""
        stored = bilinear(self.pictures[number], *self.views[number].texels(points))
        if self.whites is not None:
            stored[:, :3] = stored[:, 3:] * self.whites[number] * stored[:, :3] ** 2
        return stored


def ulr_weights(directions, toward, _):
    """Weights of the views in these directions from a vertex, for a viewer in direction `toward`."""
    penalties = ((directions - toward) ** 2).sum(1) / 2  # 1 - cos
    order = np.argsort(penalties, kind="stable")[:4]
    threshold = 1
    if len(order) >= 3:
        threshold, order = penalties[order[-1]], order[:-1]
    p = np.maximum(penalties[order], 1e-14)
    relevance = np.maximum(threshold - p, 0) / p
    weights = np.zeros(len(directions))
    weights[order] = relevance
    return weights / weights.sum() if weights.any() else np.eye(len(directions))[order[0]]


def composite(camera, fragments, colors):
    """Fragments of each pixel, nearest first: premultiplied red, green, blue, and alpha."""
    picture = np.zeros((camera.height * camera.width, 4))
    number = np.arange(len(fragments.pixel))
    nth = number - np.maximum.accumulate(np.where(fragments.nearest, number, 0))
    for layer in range(nth.max(initial=0) + 1):
        pixel, color = fragments.pixel[nth == layer], colors[nth == layer]
        picture[pixel] += np.maximum(0, 1 - picture[pixel, 3:] / np.maximum(color[:, 3:], 1e-300)) * color
    return picture.reshape(camera.height, camera.width, 4)[..., :3]


def show(field, camera, weights_at):
    """The picture, where weights_at(directions, toward, normal) has the weights of a vertex's views."""
    a, b, c = (field.positions[field.triangles[:, k]] for k in range(3))
    normals = np.zeros_like(field.positions)
    for k in range(3):
        np.add.at(normals, field.triangles[:, k], np.cross(b - a, c - a))
    weights = np.zeros((len(field.positions), len(field.views)))
    for vertex in np.unique(field.triangles):
        views, position = field.visible[vertex], field.positions[vertex]
        weights[vertex, views] = weights_at(
            unit(field.centers[views] - position), unit(camera.position - position), unit(normals[vertex]))
    seen = Fragments(camera, field.positions, field.triangles)
    points = camera.position + seen.depth[:, None] * camera.rays(seen.pixel)
    of_view = seen.blend(weights[field.triangles])
    colors = np.zeros((len(points), 4))
    for number in range(len(field.views)):
        at = np.flatnonzero(of_view[:, number])
        if len(at):
            colors[at] += of_view[at, number, None] * field.seen(number, points[at])
    return composite(camera, seen, colors), interior(camera, seen)


def decode(model, camera):
    return show(Field(model, 1), camera, ulr_weights)


if __name__ == "__main__":
    main(__doc__, decode)
