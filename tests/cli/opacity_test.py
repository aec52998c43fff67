"""Opacity reflectance fields: fur is packed with its alpha, and evaluated and rendered through it, at rest and bent."""

import json
import unittest

from png import read_png
from support import STAGE, TestInFolder, content, run, succeed

# A tuft of hairs, thinner than a pixel, on a small ball.
FUR_STAGE = STAGE[:STAGE.index("[[material]]")].replace("count = 16", "count = 2").replace("test = 2\nirradiance", "test = 1\nirradiance") + """
[[material]]
name = "hair"
type = "lambert"
albedo = [0.8, 0.6, 0.4]
[[object]]
type = "sphere"
material = "hair"
radius = 0.3
segments = 32
[[object]]
type = "fur"
material = "hair"
on = { type = "sphere", radius = 0.3, segments = 32 }
hairs = 400
length = 0.5
radius = 0.012
disorder = 0.3
"""
FILM = """
model = "{model}"
[frames]
first = 1
last = 1
[output]
size = [48, 48]
path = "frame.#.exr"
png = true
[camera]
position = [3.5, 1, 1]
look_at = [0, 0, 0]
up = [0, 0, 1]
fov_deg = 30
[[light]]
type = "directional"
direction = [1, 0, 1]
"""
WARP = """
[[warp]]
type = "bend"
axis = [0, 0, 1]
direction = [1, 0, 0]
angle_deg = 40
"""


class Opacity(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        stage, cls.warp = cls.folder / "fur.toml", cls.folder / "warp.toml"
        stage.write_text(FUR_STAGE)
        cls.warp.write_text(WARP)
        cls.capture, cls.truth = cls.folder / "capture", cls.folder / "truth"
        succeed("capture", stage, "-o", cls.capture)
        succeed("capture", stage, "-o", cls.truth, "--script", cls.warp, "--frame", "1")
        cls.reports = {name: succeed("pack", cls.capture, "-o", cls.folder / name, "--surfels", "20000", "--tables", "off", *options)
                       for name, options in (("soft", []), ("opaque", ["--opaque"]), ("hull", ["--hull"]))}

    def manifest(self, name):
        return json.loads((self.folder / name / "manifest.json").read_text())

    def scores(self, name, *bent):
        return succeed("evaluate", self.folder / name, self.truth if bent else self.capture, *bent)

    def pixels(self, name):
        script = self.folder / f"{name}.toml"
        script.write_text(FILM.format(model=self.folder / name))
        succeed("render", script, "-o", self.folder / f"{name}-frames")
        return read_png(self.folder / f"{name}-frames/frame.1.png")

    def test_alpha_is_stored_for_each_view_unless_the_object_is_said_to_be_opaque(self):
        self.assertEqual({name: report["translucent"] for name, report in self.reports.items()},
                         {"soft": True, "opaque": False, "hull": True})
        self.assertEqual(self.manifest("soft")["version"], 6)
        self.assertEqual(len(self.manifest("soft")["alpha_checksums"]), 16)
        self.assertEqual(self.manifest("opaque")["version"], 5)
        alphas = [name for name in content(self.folder / "soft") if name.endswith(".srfa")]
        self.assertEqual(len(alphas), 16)
        self.assertFalse([name for name in content(self.folder / "opaque") if name.endswith(".srfa")])

    def test_alpha_brings_the_photographs_back_better(self):
        opaque = self.scores("opaque")
        for name in ("soft", "hull"):
            soft = self.scores(name)
            self.assertGreater(soft["psnr_linear_db"], opaque["psnr_linear_db"] + 2, name)
            self.assertLess(soft["alpha_error"], opaque["alpha_error"] / 2, name)

    def test_bent_fur_stays_soft(self):
        bent = ("--script", self.warp)
        soft, opaque = self.scores("soft", *bent), self.scores("opaque", *bent)
        self.assertGreater(soft["psnr_linear_db"], opaque["psnr_linear_db"] + 1)
        self.assertLess(soft["alpha_error"], opaque["alpha_error"])

    def test_the_background_shows_through(self):
        def share(name):
            covered = [pixel for pixel in self.pixels(name) if pixel[3] > 0]
            return sum(20 < pixel[3] < 235 for pixel in covered) / len(covered)
        self.assertGreater(share("soft"), 0.3)
        self.assertLess(share("opaque"), share("soft") / 2)

    def test_a_mesh_and_a_hull_exclude_each_other(self):
        result = run("pack", self.capture, "-o", self.folder / "both", "--hull", "--mesh", self.capture / "geometry.obj")
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("--hull", result.stderr)
        self.assertFalse((self.folder / "both").exists())


if __name__ == "__main__":
    unittest.main()
