"""surflect export: PLY files of Gaussians and OpenUSD, read and drawn by programs of others."""

import json
import math
import os
import pathlib
import subprocess
import unittest

import numpy as np

import splat_raster
from png import read_png
from splat_page import draw_in_browser
from support import SCRIPT, TestInFolder, content, run, succeed

READERS = os.environ["READERS"]
SIZE = (240, 180)
SHOT = SCRIPT.replace("size = [120, 90]", f"size = {list(SIZE)}")


def decibels(got, wanted, inside):
    """Peak signal to noise ratio over some pixels, of colours 0..1."""
    return -10 * math.log10(((np.clip(got, 0, 1) - wanted)[inside] ** 2).mean())


def pixels_of(path):
    return np.array(read_png(path)).reshape(SIZE[1], SIZE[0], 4) / 255


def foreign(file, out):
    """What a program of others finds in a file: arrays by name and time, and what the file says of itself."""
    result = subprocess.run(["node", pathlib.Path(__file__).with_name("foreign_gaussians.mjs"), READERS, file, out],
                            capture_output=True, text=True)
    if result.returncode != 0:
        raise AssertionError(result.stderr)
    told, values, at, arrays = json.loads(result.stdout), np.fromfile(out, "<f4"), 0, {}
    for name, time, count in told["arrays"]:
        arrays[name, time] = values[at:at + count]
        at += count
    return arrays, told["stage"]


class Export(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(4, 4, SHOT, coarse=True)
        succeed("pack", cls.capture, "-o", cls.model, "--surfels", "4000", "--tables", "off")
        cls.frames = cls.folder / "frames"
        succeed("render", cls.script, "-o", cls.frames)
        cls.sequence = cls.folder / "splats"
        cls.report = succeed("export", cls.script, "-o", cls.sequence / "vase.##.ply")

    def test_every_frame_has_a_file_of_the_bytes_that_are_reported(self):
        files = {entry["frame"]: entry for entry in self.report["files"]}
        self.assertEqual(sorted(files), [1, 2, 3])
        for frame, entry in files.items():
            path = self.sequence / f"vase.{frame:02}.ply"
            self.assertEqual(entry["file"], str(path))
            self.assertEqual(path.stat().st_size, entry["bytes"])
            self.assertEqual(entry["gaussians"], self.report["surfels"])

    def test_splat_transform_reads_the_same_numbers(self):
        path = self.sequence / "vase.02.ply"
        ours = splat_raster.read_ply(path)
        theirs, _ = foreign(path, self.folder / "ply.floats")
        self.assertEqual([name for name, _ in theirs], list(ours))
        self.assertEqual(len(ours), 62)
        for (name, _), values in theirs.items():
            np.testing.assert_array_equal(values, ours[name], name)

    def test_threejs_reads_the_same_numbers_from_openusd(self):
        path = self.folder / "vase.usda"
        report = succeed("export", self.script, "-o", path)
        arrays, stage = foreign(path, self.folder / "usd.floats")
        self.assertEqual((stage["prim"], stage["defaultPrim"], stage["upAxis"], stage["metersPerUnit"], stage["timeCodesPerSecond"], stage["degree"]),
                         ("ParticleField", "Surfels", "Z", 1, 24, 3))
        for schema in ("PositionAttribute", "OrientationAttribute", "ScaleAttribute", "OpacityAttribute", "KernelGaussianSurflet",
                       "SphericalHarmonicsAttribute"):
            self.assertIn(f'"ParticleField{schema}API"', stage["schemas"])
        count = report["surfels"]
        self.assertEqual({time for _, time in arrays}, {1, 2, 3, None})  # opacities are not sampled
        for frame in (1, 2, 3):
            ours = splat_raster.read_ply(self.sequence / f"vase.{frame:02}.ply")
            place = arrays["point3f[] positions", frame].reshape(-1, 3)
            self.assertEqual(len(place), count)
            np.testing.assert_allclose(place, np.stack([ours[k] for k in "xyz"], 1), rtol=1e-6, atol=1e-7)
            turn = arrays["quatf[] orientations", frame].reshape(-1, 4)[:, [3, 0, 1, 2]]  # three.js has w last
            np.testing.assert_allclose(turn, splat_raster.columns(ours, "rot", 4), atol=1e-6)
            scale = arrays["float3[] scales", frame].reshape(-1, 3)
            np.testing.assert_allclose(scale, np.exp(splat_raster.columns(ours, "scale", 3)), rtol=6e-5)
            color = arrays["float3[] radiance:sphericalHarmonicsCoefficients", frame].reshape(count, 16, 3)
            np.testing.assert_allclose(color[:, 0], splat_raster.columns(ours, "f_dc", 3), rtol=1e-3, atol=1e-4)
            rest = splat_raster.columns(ours, "f_rest", 45).reshape(count, 3, 15).transpose(0, 2, 1)
            np.testing.assert_allclose(color[:, 1:], rest, rtol=1e-3, atol=1e-4)
            low, high = arrays["float3[] extent", frame].reshape(2, 3)
            self.assertTrue((low < place.min(0)).all() and (high > place.max(0)).all())
        np.testing.assert_allclose(arrays["float[] opacities", None], 1 / (1 + np.exp(-ours["opacity"])), rtol=1e-4)

    def own(self, frame):
        """The program's own frame over black, as programs for Gaussians show it, and where it is opaque."""
        picture = pixels_of(self.frames / f"frame.{frame:02}.png")
        return picture[:, :, :3] * picture[:, :, 3:], picture[:, :, 3] > 0.5

    def place(self, frame):
        """Camera of the frame: rotation and shift into x right, y down, z forward; focal length. As SCRIPT has it."""
        eye = np.array([4 + (frame - 1) / 2, -0.5, 1])
        forward = -eye / np.linalg.norm(eye)
        right = np.cross(forward, [0, 0, 1])
        right /= np.linalg.norm(right)
        turn = np.array([right, np.cross(forward, right), forward])
        return turn, -turn @ eye, SIZE[1] / 2 / math.tan(math.radians(16))

    def drawn(self, frame):
        turn, shift, focal = self.place(frame)
        gaussians = splat_raster.read_ply(self.sequence / f"vase.{frame:02}.ply")
        return splat_raster.draw(gaussians, turn, shift, focal, (SIZE[0] / 2, SIZE[1] / 2), SIZE)

    def test_drawn_plainly_they_look_like_the_programs_own_frames(self):
        for frame, least in ((1, 23), (2, 25.5), (3, 25.5)):
            wanted, inside = self.own(frame)
            picture = self.drawn(frame)
            self.assertGreater(decibels(picture[:, :, :3], wanted, inside | (picture[:, :, 3] > 0.5)), least)
            self.assertGreater(picture[inside][:, 3].mean(), 0.998)

    def test_a_webgl_viewer_draws_what_the_equations_say(self):
        turn, shift, focal = self.place(2)
        object_from_camera = np.eye(4)
        object_from_camera[:3, :3] = turn.T * [1, -1, -1]
        object_from_camera[:3, 3] = -turn.T @ shift
        png, count = draw_in_browser(READERS, self.sequence / "vase.02.ply", self.folder / "page", object_from_camera, 32, SIZE)
        self.assertEqual(count, self.report["surfels"])
        (self.folder / "page.png").write_bytes(png)
        picture = pixels_of(self.folder / "page.png")[:, :, :3]
        plain = self.drawn(2)
        self.assertGreater(decibels(picture, np.clip(plain[:, :, :3], 0, 1), plain[:, :, 3] > 0.5), 33)

    def test_fewer_gaussians_and_lower_degrees_make_smaller_files(self):
        path = self.folder / "small.ply"
        report = succeed("export", self.model, "-o", path, "--surfels", "1000", "--sh", "0")
        self.assertLessEqual(report["surfels"], 1000)
        small = splat_raster.read_ply(path)
        self.assertEqual(len(small["x"]), report["surfels"])
        self.assertEqual(len(small), 17)
        self.assertLess(path.stat().st_size, 0.1 * self.report["files"][0]["bytes"])

    def test_any_number_of_threads_gives_the_same_bytes(self):
        for threads in (1, 3):
            for name in ("a.ply", "a.usda"):
                succeed("export", self.script, "-o", self.folder / f"threads{threads}" / name, "--frames", "2", "--sh", "1", "--threads", threads)
        self.assert_same_files(content(self.folder / "threads1"), content(self.folder / "threads3"))

    def test_refusals_name_what_is_wrong_and_leave_nothing(self):
        before = content(self.folder)
        for status, arguments, told in (
                (2, ("-o", "vase.obj"), "'vase.obj', expected a name that ends in .ply"),
                (2, ("-o", "vase.##.usda"), "one .usda file holds all frames"),
                (2, ("-o", "v#a#.ply"), "one run of at most 16 #"),
                (2, ("-o", "vase.ply", "--frames", "1-3"), "vase.####.ply".replace("vase", "doll")),
                (1, ("-o", "vase.ply", "--frames", "9"), "expected A or A-B within 1-3"),
                (2, ("-o", "vase.ply", "--sh", "4"), "--sh"),
                (2, ("-o", "vase.ply", "--surfels", "0"), "--surfels"),
                (2, ("-o", "vase.ply", "--low-pass", "1"), "--low-pass: is for pictures"),
                (1, ("-o", "film.toml/vase.ply"), "film.toml")):
            with self.subTest(arguments=arguments):
                result = subprocess.run([os.environ["SURFLECT"], "export", self.script, *arguments], cwd=self.folder,
                                        capture_output=True, text=True)
                self.assertEqual(result.returncode, status, result.stderr)
                self.assertIn(told, result.stderr)
        self.assert_same_files(content(self.folder), before)

    def test_a_light_field_is_refused_by_name(self):
        folder = self.folder / "fixed.lfm"
        folder.mkdir()
        (folder / "manifest.json").write_text(json.dumps({"format": "surflect light field maps"}))
        result = run("export", folder, "-o", self.folder / "x.ply")
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, "fixed.lfm.*export takes surfels")


if __name__ == "__main__":
    unittest.main()
