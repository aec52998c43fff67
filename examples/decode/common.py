"""What the decoders share: folders, meshes and texels as docs/format.md describes them, and the command line."""

import argparse
import json
import pathlib

import numpy as np

from screen import Camera


class Folder:
    """A light field on disk: its numbers, files and training views."""

    def __init__(self, path, format, version):
        self.path = pathlib.Path(path)
        manifest = json.loads((self.path / "manifest.json").read_text())
        if (manifest["format"], manifest["version"]) != (format, version):
            raise SystemExit(f"{path}: found {manifest['format']} {manifest['version']}, expected {format} {version}")
        self.numbers = manifest["numbers"]
        self.rig = json.loads((self.path / "transforms.json").read_text())

    def read(self, name):
        return Reader((self.path / name).read_bytes())

    def mesh(self, name="mesh.bin"):
        """Positions, and the three corners of each triangle."""
        file = self.read(name)
        positions, triangles = file.count(), file.count()
        return file.take("f4", positions, 3).astype(float), file.take("u4", triangles, 3)

    def texels(self, name):
        """Four half floats for each texel, one after the other."""
        return np.fromfile(self.path / name, "<f2").reshape(-1, 4)


class Reader:
    """Little-endian numbers, read in their order."""

    def __init__(self, content):
        self.content, self.at = content, 0

    def take(self, kind, *shape):
        kind = np.dtype(kind).newbyteorder("<")
        values = np.frombuffer(self.content, kind, int(np.prod(shape)), self.at).reshape(shape)
        self.at += values.nbytes
        return values

    def count(self):
        return int(self.take("u8", 1)[0])


class View:
    """A captured camera, whose axes are right, down and forward."""

    def __init__(self, rig, frame):
        pose, lens = np.array(frame["transform_matrix"]), {**rig, **frame}
        self.position, self.axes = pose[:3, 3], pose[:3, :3].T * [[1], [-1], [-1]]
        self.focal = np.array([lens["fl_x"], lens.get("fl_y", lens["fl_x"])])
        self.middle = np.array([lens.get("cx", lens["w"] / 2), lens.get("cy", lens["h"] / 2)])

    def pixels(self, points):
        """Places of points in the photograph: x, y."""
        seen = (points - self.position) @ self.axes.T
        return (seen[:, :2] / seen[:, 2:] * self.focal + self.middle).T


def bilinear(texels, x, y):
    """texels[row, column] at places in texels, whose centres are at halves; constant beyond the outermost centres."""
    height, width = texels.shape[:2]
    x, y = np.clip(x - 0.5, 0, width - 1), np.clip(y - 0.5, 0, height - 1)
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    x1, y1 = np.minimum(x0 + 1, width - 1), np.minimum(y0 + 1, height - 1)
    a, b = (x - x0)[:, None], (y - y0)[:, None]
    texels = texels.astype(float)
    return (1 - b) * ((1 - a) * texels[y0, x0] + a * texels[y0, x1]) + b * ((1 - a) * texels[y1, x0] + a * texels[y1, x1])


def main(description, decode):
    """Command line of a decoder: writes the picture that decode(model, camera) returns, and its interior."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", help="folder of the model")
    parser.add_argument("-o", "--output", required=True, help="picture (.pfm); its interior is written beside it (.pgm)")
    parser.add_argument("--size", type=int, nargs=2, default=[64, 64])
    for name, default in (("position", [4, -1, 1]), ("look-at", [0, 0, 0]), ("up", [0, 0, 1])):
        parser.add_argument(f"--{name}", type=float, nargs=3, default=default)
    parser.add_argument("--fov", type=float, default=32, help="degrees, vertical")
    given = parser.parse_args()
    color, inside = decode(given.model, Camera(given.position, given.look_at, given.up, given.fov, given.size))
    size, path = b"%d %d\n" % tuple(given.size), pathlib.Path(given.output)
    path.write_bytes(b"PF\n" + size + b"-1.0\n" + color[::-1].astype("<f4").tobytes())
    path.with_suffix(".pgm").write_bytes(b"P5\n" + size + b"255\n" + (255 * inside.astype(np.uint8)).tobytes())
    print(f"{path}: {100 * inside.mean():.1f} % of the pixels are interior")
