"""docs/captures.md alone leads from a folder of photographs to a film: its commands are run here as they stand."""

import json
import math
import os
import re
import shlex
import subprocess
import unittest

from png import read_png
from support import ROOT, VASE, TestInFolder, succeed

EVERY, SCALE = 23, 0.3  # frames 1, at rest, and 24, bent most


class FirstFilm(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        section = (ROOT / "docs/captures.md").read_text().partition("\n## A first film\n")[2].partition("\n## ")[0]
        blocks = [re.sub("^    ", "", block, flags=re.MULTILINE)
                  for block in re.findall(r"\n\n((?:    .*\n)+)", section)]
        commands, script = blocks
        cls.commands = [shlex.split(line)[1:] for line in commands.splitlines()]
        (cls.folder / "bend.toml").write_text(script)
        cls.write_photographs()
        pack, render = cls.commands
        cls.packed = succeed(*cls.in_folder(pack), "--surfels", 20000)
        succeed(*cls.in_folder(render), "--every", EVERY, "--scale", SCALE)

    @classmethod
    def in_folder(cls, command):
        """The documentation's command, of whose words those that are files lie in this test's folder."""
        files = {"lego", "lego.srf", "bend.toml", "frames/"}
        return [cls.folder / word if word in files else word for word in command]

    @classmethod
    def write_photographs(cls):
        """The vase as NeRF-synthetic keeps its objects: RGBA, an angle of view, poses; no mesh, masks or lights."""
        subprocess.run([os.environ["WRITE_FOREIGN_CAPTURES"], VASE, cls.folder], check=True)
        (cls.folder / "nerfstudio").rename(cls.folder / "lego")
        path = cls.folder / "lego/transforms.json"
        foreign = json.loads(path.read_text())
        frames = [{"file_path": "./" + frame["file_path"].removesuffix(".png"),
                   "transform_matrix": frame["transform_matrix"]} for frame in foreign["frames"]]
        width = foreign["w"]
        path.write_text(json.dumps({"camera_angle_x": 2 * math.atan(width / 2 / foreign["fl_x"]), "frames": frames}))

    def test_the_commands_are_pack_and_render(self):
        self.assertEqual([command[0] for command in self.commands], ["pack", "render"])

    def test_the_hull_fills_the_mattes(self):
        self.assertEqual(self.packed["geometry"], "hull")
        for fit in self.packed["silhouettes"]:
            self.assertGreater(fit["iou"], 0.98)

    def test_frames_show_the_object_lit_and_whole(self):
        for name in ("frame.0001.png", "frame.0024.png"):
            pixels = read_png(self.folder / "frames" / name)
            seen = [pixel for pixel in pixels if pixel[3] > 0]
            opaque = [pixel for pixel in seen if pixel[3] == 255]
            lit = [pixel for pixel in opaque if max(pixel[:3]) > 16]
            self.assertTrue(0.15 < len(seen) / len(pixels) < 0.25)
            self.assertGreater(len(opaque), 0.95 * len(seen))
            self.assertGreater(len(lit), 0.95 * len(opaque))

    def test_the_bend_bends(self):
        rest, bent = (self.silhouette(name) for name in ("frame.0001.png", "frame.0024.png"))
        self.assertLess(len(rest & bent), 0.8 * len(rest | bent))

    def silhouette(self, name):
        return {i for i, pixel in enumerate(read_png(self.folder / "frames" / name)) if pixel[3] > 127}


if __name__ == "__main__":
    unittest.main()
