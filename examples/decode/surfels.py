#!/usr/bin/python3
"""Decodes surfels of an opaque object, whose cameras all saw it under the same lights, under a distant lamp.

    surflect pack CAPTURE -o MODEL
    examples/decode/surfels.py MODEL -o frame.pfm
    surflect render SCRIPT -o frames --interpolation paper                # the same picture
"""

import json
import pathlib
import zlib

import numpy as np

from common import Reader, View, main
from screen import unit
from splats import splatted

DIRECTION, IRRADIANCE = unit(np.array([1., -1, 1])), 1  # of the lamp


def read_surfels(path):
    """Properties by name, and R0: columns u0, v0, n0."""
    header, content = path.read_bytes().split(b"end_header\n", 1)
    names = [line.split()[2] for line in header.decode().splitlines() if line.startswith("property float")]
    surfels = dict(zip(names, np.frombuffer(content, "<f4").reshape(-1, len(names)).T.astype(float)))
    x, y, zero = surfels["r0x"], surfels["r0y"], np.zeros_like(surfels["r0x"])
    cross = np.stack([zero, zero, y, zero, zero, -x, -y, x, zero], 1).reshape(-1, 3, 3)
    turn = np.eye(3) + 2 / (1 + x * x + y * y)[:, None, None] * (cross + cross @ cross)
    turn[surfels["lower"] == 1] *= [[1], [-1], [-1]]
    return surfels, turn


def read_block(record, lights, columns):
    """Texels [row, column, channel] of a block under lights that are weighted by columns[light, channel]."""
    flags, *terms = record.take("u1", 4)
    present = np.ones(64, bool)
    if flags & 2:
        present = np.unpackbits(record.take("u1", 8), bitorder="little").astype(bool)
    count = 3 * present.sum()
    sums = np.zeros((count // 3, 3))
    for bits, of_bits in zip((16, 8, 4), terms):
        for _ in range(of_bits):
            if bits == 16:
                a = record.take("f4" if flags & 1 else "f2", lights).astype(float)
            else:
                a = float(record.take("f4", 1)[0]) * levels(record, bits, lights)
            sums = sums + levels(record, bits, count).reshape(-1, 3) * (a @ columns)
    places = np.argwhere(present.reshape(8, 8))
    far = ((np.indices((8, 8)).reshape(2, 64).T[:, None] - places) ** 2).sum(2)
    return sums[far.argmin(1)].reshape(8, 8, 3)  # absent texels are filled from the nearest present one


def levels(record, bits, count):
    """Levels as shares of the largest, -1..1."""
    if bits == 4:
        pairs = record.take("u1", (count + 1) // 2)
        q = np.stack([pairs & 15, pairs >> 4], 1).ravel()[:count].astype(int)
        q = np.where(q > 7, q - 16, q)
    else:
        q = record.take(f"i{bits // 8}", count).astype(int)
    return np.clip(q / {4: 7, 8: 127, 16: 32639}[bits], -1, 1)


def read_view(path, columns):
    """The picture of a view under weighted lights, and which of its texels are in stored blocks."""
    file = Reader(path.read_bytes())
    assert bytes(file.take("u1", 8)) == b"srf view" and tuple(file.take("u4", 2)) == (1, 3)
    width, height, lights, blocks = file.take("u4", 4).astype(int)
    file.take("f4", 2)
    index = file.take("u4", blocks, 3).astype(int)
    file.count()
    across, down = -(-width // 8), -(-height // 8)
    picture, stored = np.zeros((down * 8, across * 8, 3)), np.zeros((down * 8, across * 8), bool)
    for position, size, _ in index:
        y, x = 8 * (position // across), 8 * (position % across)
        picture[y:y + 8, x:x + 8] = read_block(Reader(file.take("u1", size).tobytes()), lights, columns)
        stored[y:y + 8, x:x + 8] = True
    return picture[:height, :width], stored[:height, :width]


def ulr(penalties, blended=3):
    """Weights of the candidates of least penalty in each row."""
    order = np.argsort(penalties, axis=1, kind="stable")[:, :blended + 1]
    p = np.take_along_axis(penalties, order, 1)
    limit = np.maximum(1, 2 * p[:, 0])
    limit = np.minimum(p[:, blended], limit) if p.shape[1] > blended else limit
    relevance = np.zeros_like(penalties)
    p = np.maximum(p[:, :blended], 1e-12)
    np.put_along_axis(relevance, order[:, :blended], np.maximum(0, 1 - p / limit[:, None]) / p, 1)
    return relevance / np.maximum(relevance.sum(1, keepdims=True), 1e-300)


def bilinear_stored(picture, stored, x, y):
    """As bilinear(), without texels of blocks that are not stored; and whether there are others."""
    sums, weights = np.zeros((len(x), 3)), np.zeros(len(x))
    left, top = np.floor(x - 0.5).astype(int), np.floor(y - 0.5).astype(int)
    for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
        column, row = np.clip(left + i, 0, stored.shape[1] - 1), np.clip(top + j, 0, stored.shape[0] - 1)
        weight = (1 - abs(x - 0.5 - left - i)) * (1 - abs(y - 0.5 - top - j)) * stored[row, column]
        sums += weight[:, None] * picture[row, column]
        weights += weight
    return sums / np.maximum(weights, 1e-300)[:, None], weights > 0


def decode(model, camera):
    model = pathlib.Path(model)
    assert json.loads((model / "manifest.json").read_text())["version"] in (5, 7), "the object is translucent"
    rig = json.loads((model / "transforms.json").read_text())
    surfels, frames = read_surfels(model / "surfels.ply")
    points = np.stack([surfels[axis] for axis in "xyz"], 1)
    views = {}  # frames of each view, in the order of columns
    for frame in rig["frames"]:
        views.setdefault(frame["file_path"], []).append(frame)
    fades = np.frombuffer(zlib.decompress((model / "fades.bin").read_bytes()), np.uint8).reshape(len(views), -1).T
    seen = np.where(fades, 2. ** (-20 * (255. - fades) / 254), 0)

    towards = unit(camera.position - points)
    cameras = [View(rig, of_view[0]) for of_view in views.values()]
    angles = np.stack([((unit(view.position - points) - towards) ** 2).sum(1) / 2 for view in cameras], 1)
    penalties = np.where(fades, angles / np.maximum(seen, 1e-300), 1e30)
    weights = np.where(fades, ulr(penalties), 0)
    lights = {light["name"]: light for light in rig["lights"]}
    of_light = ulr(np.array([[((l["direction"] - DIRECTION) ** 2).sum() / 2 for l in lights.values()]]))[0]
    sums, kept = np.zeros((len(points), 3)), np.zeros(len(points))
    for number, (path, of_view) in enumerate(views.items()):
        at = np.flatnonzero(weights[:, number] > 0)
        columns = [of_light[list(lights).index(f["light"])] * IRRADIANCE / np.array(lights[f["light"]]["irradiance"])
                   for f in of_view]
        x, y = cameras[number].pixels(points[at])
        color, found = bilinear_stored(*read_view(model / path, np.array(columns)), x, y)
        share = weights[at, number] * found
        sums[at] += share[:, None] * color
        kept[at] += share
    told = (penalties.min(1) <= 1) & (kept > 0)  # others are continued from views that do not see them
    colors = sums / np.maximum(kept, 1e-300)[:, None]
    return splatted(camera, points, frames, surfels, colors, told)


if __name__ == "__main__":
    main(__doc__, decode)
