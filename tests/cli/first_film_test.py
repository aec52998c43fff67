"""docs/import.md alone leads from a folder of photographs to a film: runs its commands with fewer surfels and frames, and
with another object in place of lego."""

import json
import math
import os
import re
import shlex
import subprocess
import unittest

from png import read_png, shares
from support import ROOT, VASE, TestInFolder, succeed

FRAMES = ["--frames", "24-24", "--scale", 0.3]  # when it is bent most


class FirstFilm(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        section = (ROOT / "docs/import.md").read_text().partition("\n## A first film\n")[2].partition("\n## ")[0]
        commands, script = (re.sub("^    ", "", block, flags=re.MULTILINE)
                            for block in re.findall(r"\n\n((?:    .*\n)+)", section))
        cls.commands = [shlex.split(line)[1:] for line in commands.splitlines()]
        (cls.folder / "bend.toml").write_text(script)
        (cls.folder / "rest.toml").write_text(script.partition("[[warp]]")[0])
        cls.write_photographs()
        bring, pack, render = (cls.in_folder(command) for command in cls.commands)
        cls.imported = succeed(*bring)
        cls.packed = succeed(*pack, "--surfels", 20000)
        succeed(*render, *FRAMES)
        succeed("render", cls.folder / "rest.toml", "-o", cls.folder / "rest", *FRAMES)

    @classmethod
    def in_folder(cls, command):
        """The documentation's command, of whose words those that are files lie in this test's folder."""
        files = {"lego", "lego-capture", "lego.srf", "bend.toml", "frames/"}
        return [cls.folder / word if word in files else word for word in command]

    @classmethod
    def write_photographs(cls):
        """The vase as NeRF-synthetic has its objects: RGBA, an angle of view, poses; no mesh, masks or lights."""
        subprocess.run([os.environ["WRITE_FOREIGN_CAPTURES"], VASE, cls.folder], check=True)
        lego = cls.folder / "lego"
        (cls.folder / "nerfstudio").rename(lego)
        foreign = json.loads((lego / "transforms.json").read_text())
        (lego / "transforms.json").unlink()
        frames = [{"file_path": "./" + frame["file_path"].removesuffix(".png"),
                   "transform_matrix": frame["transform_matrix"]} for frame in foreign["frames"]]
        angle = 2 * math.atan(foreign["w"] / 2 / foreign["fl_x"])
        for split, part in (("train", frames[1:]), ("test", frames[:1])):
            (lego / f"transforms_{split}.json").write_text(json.dumps({"camera_angle_x": angle, "frames": part}))

    def test_three_commands_do_it(self):
        self.assertEqual([command[0] for command in self.commands], ["import", "pack", "render"])
        self.assertEqual([self.imported["training_frames"], self.imported["test_frames"]], [11, 1])

    def test_the_hull_fills_the_mattes(self):
        self.assertEqual(self.packed["geometry"], "hull")
        for fit in self.packed["silhouettes"]:
            self.assertGreater(fit["iou"], 0.987)

    def test_the_film_shows_the_object_lit_and_whole(self):
        covered, opaque, lit = shares(self.folder / "frames/frame.0024.png")
        self.assertTrue(0.15 < covered < 0.25)
        self.assertGreater(opaque, 0.95)
        self.assertGreater(lit, 0.99)

    def test_the_bend_moves_the_upper_part_alone(self):
        rest, bent = (self.silhouette(folder) for folder in ("rest", "frames"))
        rows = sorted({y for _, y in rest})
        for part, least, most in ((rows[:len(rows) // 4], 0, 0.5), (rows[-len(rows) // 8:], 0.8, 1)):
            among = [{place for place in silhouette if place[1] in part} for silhouette in (rest, bent)]
            overlap = len(among[0] & among[1]) / len(among[0] | among[1])
            self.assertTrue(least <= overlap <= most, overlap)

    def silhouette(self, folder):
        width = round(800 * 0.3)
        return {(i % width, i // width) for i, pixel in enumerate(read_png(self.folder / folder / "frame.0024.png"))
                if pixel[3] > 127}


if __name__ == "__main__":
    unittest.main()
