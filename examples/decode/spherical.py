#!/usr/bin/python3
"""Decodes a spherical light field, and shows its finest level to one camera.

    surflect pack VIEWS --method spherical -o MODEL
    examples/decode/spherical.py MODEL -o frame.pfm
"""

import zlib

import numpy as np

from common import Folder, bilinear, main
from pencils import directions_of_images, levels_of_pencils, pencil_shares
from screen import Fragments, interior, unit


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
        """Mip levels, the largest first: texels [row, column] of red, green, blue times alpha, alpha, and height."""
        content, position, length = self.entries[number]
        raw = np.frombuffer(zlib.decompress(content[position:position + length]), np.uint8)
        high, low = raw.reshape(5, 2, self.size, self.size).astype(np.uint16).swapaxes(0, 1)
        planes = np.cumsum(high << 8 | low, axis=2, dtype=np.uint16)  # modulo 2^16
        levels = [np.dstack([*planes[:4].view(np.float16).astype(float), planes[4] / 65535 - 0.5])]
        while len(levels[-1]) > 1:
            side = len(levels[-1]) // 2
            four = levels[-1].reshape(side, 2, side, 2, 5)
            mean, alpha = four.mean((1, 3)), four[..., 3:4].mean((1, 3))
            weighted = (four[..., 3:4] * four[..., 4:]).mean((1, 3)) / np.maximum(alpha, 1e-300)
            height = np.where(alpha > 0, weighted, mean[..., 4:])
            levels.append(np.concatenate([mean[..., :4].astype(np.float16).astype(float), height], -1))
        return levels


class Image:
    """An image around a sphere, at a mip level."""

    def __init__(self, levels, direction, radius, mip):
        first = min(int(mip), len(levels) - 1)
        self.shares = [(levels[first], 1 - (mip - first)), (levels[min(first + 1, len(levels) - 1)], mip - first)]
        up = (0, 1, 0) if abs(direction[1]) < 0.9 else (0, 0, 1)
        right = unit(np.cross(up, direction))
        self.axes = np.stack([right, -np.cross(direction, right), direction]) / (2 * radius)
        self.texel = 2. ** mip / len(levels[0])

    def at(self, places):
        """Texels at places 0..1."""
        return sum(share * bilinear(level, *(places * len(level)).T) for level, share in self.shares if share > 0)

    def show(self, points):
        """Colours and alpha at points around the sphere's middle, and factors of the weights."""
        places = points @ self.axes.T + (0.5, 0.5, 0)
        texels = self.at(places[:, :2])
        in_front = (texels[:, 4] - places[:, 2]) / (2 * self.texel)
        shown = np.clip(2 - in_front, 0, 1) * np.clip(2 * texels[:, 3] - 1, 0, 1) ** 2
        return texels[:, :4], np.maximum(shown, 1 / 1024)


def decode(model, camera):
    folder = Folder(model, "surflect spherical", 1)
    middle = np.array([folder.numbers[f"middle.{axis}"] for axis in "xyz"])
    radius, images = folder.numbers["radius"], Images(folder)
    levels = list(levels_of_pencils(int(folder.numbers["levels"])))
    (corners, image_of), directions = levels[-1], directions_of_images(levels)

    seen = Fragments(camera, *folder.mesh(), both_sides=True)
    inside = interior(camera, seen)
    seen.only(seen.nearest)
    rays, viewer = camera.rays(seen.pixel), camera.position - middle
    points = viewer + seen.depth[:, None] * rays
    mip = max(0, np.log2(np.linalg.norm(viewer) / camera.focal / (2 * radius / images.size)))
    shares = pencil_shares(corners, -unit(rays))
    color, sums = np.zeros((len(rays), 4)), np.zeros((len(rays), 1))
    for number in np.unique(image_of):
        weights = shares[:, image_of == number].sum(1)
        at = np.flatnonzero(weights > 0)
        if len(at):
            shown, factors = Image(images.read(number), directions[number], radius, mip).show(points[at])
            color[at] += (weights[at] * factors)[:, None] * shown
            sums[at, 0] += weights[at] * factors
    picture = np.zeros((camera.height * camera.width, 3))
    picture[seen.pixel] = (color / sums)[:, :3]
    return picture.reshape(camera.height, camera.width, 3), inside


if __name__ == "__main__":
    main(__doc__, decode)
