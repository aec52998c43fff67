#!/usr/bin/python3
"""Decodes opacity light field maps, and shows them to one camera.

    surflect pack VIEWS --method olfm -o MODEL
    examples/decode/olfm.py MODEL -o frame.npz
"""

import numpy as np

from common import Folder, main
from lfm import Maps, roots
from screen import Fragments, interior, unit
from ulr import composite


def decode(model, camera):
    folder = Folder(model, "surflect opacity light field maps", 2)
    positions, triangles = folder.mesh()
    maps = Maps(folder, triangles, b"rgbamaps", 4)
    seen = Fragments(camera, positions, triangles)
    colors = np.maximum(roots(maps, triangles, seen, -unit(camera.rays(seen.pixel))), 0) ** 2
    colors[:, :3] *= folder.numbers["white"]
    colors[:, 3] = np.minimum(colors[:, 3], 1)
    return composite(camera, seen, colors), interior(camera, seen)


if __name__ == "__main__":
    main(__doc__, decode)
