#!/usr/bin/python3
"""Decodes a spherical light field, and shows its finest level to one camera.

    surflect pack VIEWS --method spherical -o MODEL
    examples/decode/spherical.py MODEL -o frame.pfm
"""

import zlib

import numpy as np

from common import Folder, bilinear, main
from pencils import directions_of_images, levels_of_pencils, pencil_shares
from screen import unit

SOLID, MOST_STEPS = 0.5, 64


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
        self.texels_of_slope = len(levels[0]) * 2. ** -mip
        self.lowest, self.highest = levels[0][..., 4].min(), levels[0][..., 4].max()

    def at(self, places):
        """Texels at places 0..1."""
        return sum(share * bilinear(level, *(places * len(level)).T) for level, share in self.shares if share > 0)

    def heights_met(self, plane, slope, viewer):
        """Where rays first come from above to the heights, at solid texels if there are any; NaN if nowhere."""
        start, end = min(viewer, self.highest + 1 / 1024), self.lowest - 1 / 1024
        above = lambda rays, h: self.at(plane[rays] + h[:, None] * slope[rays])[:, 4] - h
        steps = np.clip(np.ceil((start - end) * np.linalg.norm(slope, axis=1) * self.texels_of_slope), 1, MOST_STEPS)
        met, met_alpha = np.full(len(plane), np.nan), np.zeros(len(plane))
        high = np.full(len(plane), start)
        high_above = np.minimum(0, above(np.arange(len(plane)), high))
        for i in range(1, int(steps.max()) + 1):
            rays = np.flatnonzero((i <= steps) & (met_alpha < SOLID))
            low = start - (start - end) * i / steps[rays]
            low_above = above(rays, low)
            crossed = (high_above[rays] < 0) & (low_above >= 0)
            some = rays[crossed]
            if len(some):
                h = self.crossing(some, above, high[some], high_above[some], low[crossed], low_above[crossed])
                alpha = self.at(plane[some] + h[:, None] * slope[some])[:, 3]
                better = alpha > met_alpha[some]
                met[some[better]], met_alpha[some[better]] = h[better], alpha[better]
            high[rays], high_above[rays] = low, low_above
        return met

    @staticmethod
    def crossing(rays, above, high, high_above, low, low_above):
        """Zero of above() between high, where it is negative, and low, by bisection."""
        for _ in range(40):
            h = (high + low) / 2
            value = above(rays, h)
            high, low = np.where(value < 0, h, high), np.where(value < 0, low, h)
        return low


def decode(model, camera):
    folder = Folder(model, "surflect spherical", 1)
    middle = np.array([folder.numbers[f"middle.{axis}"] for axis in "xyz"])
    radius, images = folder.numbers["radius"], Images(folder)
    levels = list(levels_of_pencils(int(folder.numbers["levels"])))
    (corners, image_of), directions = levels[-1], directions_of_images(levels)

    rays = unit(camera.rays(np.arange(camera.width * camera.height)))
    viewer = camera.position - middle
    meets = np.linalg.norm(viewer - (rays @ viewer)[:, None] * rays, axis=1) < radius
    mip = max(0, np.log2(np.linalg.norm(viewer) / camera.focal / (2 * radius / images.size)))
    shares = pencil_shares(corners, -rays) * meets[:, None]
    color = np.zeros((len(rays), 4))
    for number in np.unique(image_of):
        weights = shares[:, image_of == number].sum(1)
        at = np.flatnonzero(weights > 0)
        if not len(at):
            continue
        image = Image(images.read(number), directions[number], radius, mip)
        e, w = image.axes @ viewer + (0.5, 0.5, 0), rays[at] @ image.axes.T
        plane = e[:2] - e[2] / w[:, 2:] * w[:, :2]
        slope = (e[:2] - plane) / e[2]
        height = image.heights_met(plane, slope, e[2])
        place = plane + height[:, None] * slope
        shown = ~np.isnan(height) & (place >= 0).all(1) & (place <= 1).all(1)
        color[at[shown]] += weights[at[shown], None] * image.at(place[shown])[:, :4]
    color = color.reshape(camera.height, camera.width, 4)
    return color[..., :3], color[..., 3] > 0.99


if __name__ == "__main__":
    main(__doc__, decode)
