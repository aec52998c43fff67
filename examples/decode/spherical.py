#!/usr/bin/python3
"""Decodes a spherical light field, and shows its finest level to one camera, by planes and one pencil for each pixel.

    surflect pack VIEWS --method spherical -o MODEL
    examples/decode/spherical.py MODEL -o frame.npz
    surflect render SCRIPT -o frames --depth off --interpolated off --level LEVEL      # the same picture
"""

import zlib

import numpy as np

from common import Folder, bilinear, main
from screen import unit

GOLDEN = (1 + 5 ** 0.5) / 2
POSITIONS = unit(np.array([
    (-1, GOLDEN, 0), (1, GOLDEN, 0), (-1, -GOLDEN, 0), (1, -GOLDEN, 0), (0, -1, GOLDEN), (0, 1, GOLDEN),
    (0, -1, -GOLDEN), (0, 1, -GOLDEN), (GOLDEN, 0, -1), (GOLDEN, 0, 1), (-GOLDEN, 0, -1), (-GOLDEN, 0, 1)]))
FACES = np.array([
    (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
    (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)])


def pencils(level):
    """Corners of the pencils of a level, and the image that each shows."""
    corners, images = POSITIONS[FACES], np.arange(20)
    for _ in range(level):
        a, b, c = (corners[:, i] for i in range(3))
        ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
        first = 3 * np.arange(len(corners)) + len(corners)
        children = [(bc, ca, ab), (a, ab, ca), (ab, b, bc), (ca, bc, c)]
        corners = np.stack([np.stack(child, 1) for child in children], 1).reshape(-1, 3, 3)
        images = np.stack([images, first, first + 1, first + 2], 1).ravel()
    return corners, images


def mips(texels):
    """The image, and each half as large as the one before, in half floats."""
    levels = [texels]
    while len(levels[-1]) > 1:
        side = len(levels[-1]) // 2
        levels.append(levels[-1].astype(np.float32).reshape(side, 2, side, 2, 4).mean((1, 3)).astype(np.float16))
    return levels


class Images:
    """Images of all levels by number, read when they are needed."""

    def __init__(self, folder):
        self.size, self.entries = int(folder.numbers["size"]), []
        for level in range(int(folder.numbers["levels"])):
            content = (folder.path / f"level{level}.tiles").read_bytes()
            assert content[-32:-24] == b"SPHTILES"
            count, size = np.frombuffer(content[-24:-8], "<u8").astype(int)
            assert size == self.size
            index = np.frombuffer(content[-32 - 24 * count:-32], "<u8").reshape(count, 3).astype(int)
            self.entries += [(content, position, length) for position, length, _ in index]

    def read(self, number):
        """Texels [row, column]: red, green, blue times alpha, alpha; and heights."""
        content, position, length = self.entries[number]
        raw = np.frombuffer(zlib.decompress(content[position:position + length]), np.uint8)
        high, low = raw.reshape(5, 2, self.size, self.size).astype(np.uint16).swapaxes(0, 1)
        planes = np.cumsum(high << 8 | low, axis=2, dtype=np.uint16)  # modulo 2^16
        return planes[:4].view(np.float16).transpose(1, 2, 0), planes[4]


def axes_of(direction):
    """Right, up and towards the viewer in the image of a direction."""
    up = (0, 1, 0) if abs(direction[1]) < 0.9 else (0, 0, 1)
    right = unit(np.cross(up, direction))
    return np.stack([right, np.cross(direction, right), direction])


def decode(model, camera):
    folder = Folder(model, "surflect spherical", 1)
    middle = np.array([folder.numbers[f"middle.{axis}"] for axis in "xyz"])
    radius, images = folder.numbers["radius"], Images(folder)
    levels = [pencils(level) for level in range(int(folder.numbers["levels"]))]
    corners, image_of = levels[-1]
    directions = {}  # each image is projected along the middle of the coarsest pencil that shows it
    for of_level in levels:
        for triangle, image in zip(*of_level):
            directions.setdefault(image, unit(triangle.sum(0)))

    pixels = np.arange(camera.width * camera.height)
    rays = camera.rays(pixels)
    sides = np.stack([np.cross(corners[:, (i + 1) % 3], corners[:, (i + 2) % 3]) for i in range(3)], 1)
    pencil = np.einsum("nx,tcx->ntc", -unit(rays), sides).min(2).argmax(1)

    viewer = camera.position - middle
    nearest = viewer - (rays * viewer).sum(1, keepdims=True) / (rays ** 2).sum(1, keepdims=True) * rays
    meets = np.linalg.norm(nearest, axis=1) < radius
    mip = max(0, np.log2(np.linalg.norm(viewer) / camera.focal / (2 * radius / images.size)))
    color = np.zeros((len(pixels), 4))
    for number in np.unique(image_of[pencil[meets]]):
        at = np.flatnonzero(meets & (image_of[pencil] == number))
        axes = axes_of(directions[number])
        start, along = axes @ viewer, rays[at] @ axes.T
        place = (start - start[2] / along[:, 2:] * along)[:, :2] / (2 * radius) * (1, -1) + 0.5
        within = ((place >= 0) & (place <= 1)).all(1)
        pyramid = mips(images.read(number)[0])
        first = min(int(mip), len(pyramid) - 1)
        for level, share in ((first, 1 - (mip - first)), (min(first + 1, len(pyramid) - 1), mip - first)):
            side = len(pyramid[level])
            color[at] += share * within[:, None] * bilinear(pyramid[level], *(place * side).T)

    # Rasterisation and rounding choose the pencil of pixels at edges.
    shape = camera.height, camera.width
    around = np.pad(np.where(meets, pencil, -1).reshape(shape), 1, constant_values=-1)
    around = np.stack([around[j:j + shape[0], i:i + shape[1]] for j in range(3) for i in range(3)])
    color = color.reshape(*shape, 4)
    return color[..., :3], (around == around[4]).all(0) & (color[..., 3] > 0)


if __name__ == "__main__":
    main(__doc__, decode)
