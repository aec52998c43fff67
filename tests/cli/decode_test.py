"""The decoders of examples/decode, which follow docs/format.md, show the frames that surflect renders."""

import json
import math
import os
import shutil
import struct
import subprocess
import unittest

from exr import read_exr
from support import ROOT, VASE, TestInFolder, succeed

DECODERS = ROOT / "examples" / "decode"
SIZE, POSITION = 64, (3.4, -2, 1)
SCRIPT = f"""
model = "{{model}}"
[frames]
first = 1
last = 1
[output]
size = [{SIZE}, {SIZE}]
path = "{{name}}.#.exr"
[camera]
position = {list(POSITION)}
look_at = [0, 0, 0]
up = [0, 0, 1]
fov_deg = 32
"""
LIGHTS = ["L10", "L12", "L14", "L18", "L22"]  # of the packed photographs of surfels
LAMP = """
[[light]]
type = "directional"
direction = [1, -1, 1]
"""


def read_pfm(path):
    """Red, green, blue of each pixel, row by row from the top."""
    kind, size, scale, pixels = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    if (kind, float(scale)) != (b"PF", -1):
        raise AssertionError(f"{path} is no little-endian PFM of three channels")
    values = struct.unpack(f"<{3 * width * height}f", pixels)
    rows = [values[3 * width * y:3 * width * (y + 1)] for y in reversed(range(height))]
    return [row[3 * x:3 * x + 3] for row in rows for x in range(width)]


class Decode(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "lamp.toml").write_text(LAMP)
        cls.views = cls.folder / "views"
        succeed("relight", VASE, "--lights", cls.folder / "lamp.toml", "--common-lights", "-o", cls.views)

    def assert_decoded(self, name, pack, render=(), decibels=80):
        """Compares a light field that is packed by these options with its decoder."""
        method = name.split("-")[0]
        succeed("pack", self.views, "--method", method, "-o", self.folder / f"{name}.model", *pack)
        self.assert_shown(name, SCRIPT, ["--samples", "1", *render], decibels)

    def assert_shown(self, name, script, render, decibels=80):
        """The decoder of a packed model shows its frame by these options, in the decoder's interior."""
        model, script_file, picture = (self.folder / f"{name}.{kind}" for kind in ("model", "toml", "pfm"))
        script_file.write_text(script.format(model=model, name=name))
        succeed("render", script_file, "-o", self.folder / "frames", *render)
        decoder = [DECODERS / f"{name.split('-')[0]}.py", model, "-o", picture, "--size", SIZE, SIZE, "--position", *POSITION]
        result = subprocess.run([str(part) for part in decoder], capture_output=True, text=True, timeout=300)
        self.assertEqual((result.returncode, result.stderr), (0, ""))

        width, height, frame = read_exr(self.folder / "frames" / f"{name}.1.exr")
        self.assertEqual((width, height), (SIZE, SIZE))
        wanted = list(zip(frame["R"], frame["G"], frame["B"], strict=True))
        is_interior = picture.with_suffix(".pgm").read_bytes()[-SIZE * SIZE:]
        pairs = [(a, b) for got, pixel, inside in zip(read_pfm(picture), wanted, is_interior, strict=True) if inside
                 for a, b in zip(got, pixel, strict=True)]
        self.assertGreater(len(pairs), 0.2 * 3 * SIZE * SIZE)  # the object has 35 % of the pixels
        peak, squares = max(b for _, b in pairs), sum((a - b) ** 2 for a, b in pairs)
        self.assertGreater(peak, 0.1)
        found = 10 * math.log10(peak**2 * len(pairs) / squares)
        if "SHOW_DECIBELS" in os.environ:
            print(f"{name}: {found:.1f} dB")
        self.assertGreater(found, decibels)

    def test_each_decoder_is_short(self):
        for script in DECODERS.glob("*.py"):
            self.assertLessEqual(len(script.read_text().splitlines()), 150, script)

    def test_surfels(self):
        capture = self.folder / "capture"
        transforms = json.loads((VASE / "transforms.json").read_text())
        transforms["frames"] = [frame for frame in transforms["frames"] if frame["light"] in LIGHTS]
        shutil.copytree(VASE, capture)
        (capture / "transforms.json").write_text(json.dumps(transforms))
        succeed("pack", capture, "-o", self.folder / "surfels.model", "--surfels", "4000", "--tables", "off")
        self.assert_shown("surfels", SCRIPT + LAMP, ["--interpolation", "paper"])

    def test_surface_light_field(self):
        self.assert_decoded("slf", ["--regions", "20", "--directions", "18", "--texels", "4000"])

    def test_lumigraph(self):
        self.assert_decoded("lumigraph", ["--st", "3", "--texels", "100000"])
        self.assert_decoded("lumigraph-simplified", ["--st", "3", "--texels", "100000", "--triangles", "500"])

    def test_light_field_maps(self):
        maps = ["--triangles", "600", "--samples", "6", "--view-size", "8"]
        self.assert_decoded("lfm", maps)
        self.assert_decoded("lfm-higher", [*maps, "--higher-view-size", "5"])
        self.assert_decoded("lfm-nmf", [*maps, "--factors", "nmf", "--vq", "4"])
        # The GPU, or Mesa in its place, mixes the two colours of a block in few bits: 54.7 and 55.4 dB by Mesa.
        self.assert_decoded("lfm-s3tc", [*maps, "--s3tc"], decibels=50)
        self.assert_decoded("olfm-s3tc", [*maps, "--s3tc"], decibels=50)

    def test_opacity_light_field_maps(self):
        self.assert_decoded("olfm", ["--triangles", "600", "--samples", "6", "--view-size", "8", "--higher-view-size", "4",
                                     "--vq", "4"])

    def test_opacity_light_field(self):
        self.assert_decoded("vdtm", ["--triangles", "600"])
        self.assert_decoded("vdtm-plane", ["--triangles", "600", "--domain", "plane"])
        self.assert_decoded("ulr", ["--triangles", "600", "--budget-mb", "2"])
        # Blocks as above.
        self.assert_decoded("vdtm-s3tc", ["--triangles", "600", "--s3tc"], decibels=50)
        self.assert_decoded("ulr-s3tc", ["--triangles", "600", "--s3tc"], decibels=50)

    def test_spherical_light_field(self):
        # Pixels are wider than texels, so that mip levels are blended.
        self.assert_decoded("spherical", ["--levels", "2", "--size", "128"], ["--level", "1"])


if __name__ == "__main__":
    unittest.main()
