#!/usr/bin/python3
"""Decodes a surface light field, and shows it to one camera.

    surflect pack VIEWS --method slf -o MODEL
    examples/decode/slf.py MODEL -o frame.npz
"""

import numpy as np

from common import Folder, bilinear, main
from screen import Fragments, interior

NOT_STORED = 2**64 - 1


def hats(directions, triangles, toward):
    """The three directions around each direction, and their hat functions there."""
    a, b, c = (directions[triangles[:, i]] for i in range(3))
    sides = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], 1)  # triangle, corner, axis
    volumes = np.einsum("nx,tcx->ntc", toward, sides)
    within = volumes.min(2).argmax(1)
    weights = np.maximum(volumes[np.arange(len(toward)), within], 0)
    return triangles[within], weights / weights.sum(1, keepdims=True)


def read_field(folder):
    """Direction meshes with their triangles, and regions."""
    file = folder.read("field.bin")
    assert bytes(file.take("u1", 9)) == b"slf field"
    meshes, regions = [], []
    for _ in range(file.count()):
        count = file.count()
        meshes.append((file.take("f8", count, 3), file.take("u4", 2 * count - 4, 3)))
    for _ in range(file.count()):
        mesh, width, height, vertices, triangles = (file.count() for _ in range(5))
        regions.append({
            "mesh": mesh, "width": width, "height": height,
            "vertices": file.take("u4", vertices), "coordinates": file.take("f4", vertices, 2),
            "triangles": file.take("u4", triangles, 3), "mesh_triangles": file.take("u4", triangles),
            "textures": file.take("u8", len(meshes[mesh][0]))})
    return meshes, regions


def decode(model, camera):
    folder = Folder(model, "surflect surface light field", 2)
    positions, _ = folder.mesh()
    meshes, regions = read_field(folder)
    texels = folder.texels("textures.bin")

    # All triangles, as their regions list them: mesh vertices, and places in the region's textures.
    corners = np.concatenate([r["vertices"][r["triangles"]] for r in regions])
    places = np.concatenate([(r["coordinates"] * (r["width"], r["height"]))[r["triangles"]] for r in regions])
    region_of = np.repeat(np.arange(len(regions)), [len(r["triangles"]) for r in regions])

    seen = Fragments(camera, positions, corners)
    inside = interior(camera, seen)
    seen.only(seen.nearest)
    x, y = seen.blend(places).T
    toward = -camera.rays(seen.pixel)
    color = np.zeros((camera.height * camera.width, 3))
    for number, region in enumerate(regions):
        here = np.flatnonzero(region_of[seen.triangle] == number)
        if not len(here):
            continue
        around, weights = hats(*meshes[region["mesh"]], toward[here])
        for corner in range(3):
            for direction in np.unique(around[:, corner]):
                if region["textures"][direction] == NOT_STORED:
                    continue
                chosen = around[:, corner] == direction
                first, size = int(region["textures"][direction]), region["width"] * region["height"]
                texture = texels[first:first + size].reshape(region["height"], region["width"], 4)[..., :3]
                at = here[chosen]
                color[seen.pixel[at]] += weights[chosen, corner, None] * bilinear(texture, x[at], y[at])
    return color.reshape(camera.height, camera.width, 3), inside


if __name__ == "__main__":
    main(__doc__, decode)
