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


def covariances(turns, scales):
    """R diag(scale)^2 R^T of each Gaussian."""
    turns = {f"rot_{k}": turns[:, k] for k in range(4)}
    axes = splat_raster.rotations(turns) * scales[:, None, :]
    return axes @ axes.transpose(0, 2, 1)


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
            scale = arrays["float3[] scales", frame].reshape(-1, 3)
            if frame == 1:  # later ones have the axes nearest to those before
                np.testing.assert_allclose(turn, splat_raster.columns(ours, "rot", 4), atol=1e-6)
                np.testing.assert_allclose(scale, np.exp(splat_raster.columns(ours, "scale", 3)), rtol=6e-5)
            spread = covariances(splat_raster.columns(ours, "rot", 4), np.exp(splat_raster.columns(ours, "scale", 3)))
            np.testing.assert_allclose(covariances(turn, scale), spread, atol=2e-4 * abs(spread).max())
            color = arrays["float3[] radiance:sphericalHarmonicsCoefficients", frame].reshape(count, 16, 3)
            np.testing.assert_allclose(color[:, 0], splat_raster.columns(ours, "f_dc", 3), rtol=1e-3, atol=1e-4)
            rest = splat_raster.columns(ours, "f_rest", 45).reshape(count, 3, 15).transpose(0, 2, 1)
            np.testing.assert_allclose(color[:, 1:], rest, rtol=1e-3, atol=1e-4)
            low, high = arrays["float3[] extent", frame].reshape(2, 3)
            self.assertTrue((low < place.min(0)).all() and (high > place.max(0)).all())
        np.testing.assert_allclose(arrays["float[] opacities", None], 1 / (1 + np.exp(-ours["opacity"])), rtol=1e-4)

    def own(self, frame, folder=None):
        """The program's own frame over black, as programs for Gaussians show it, and where it is opaque."""
        picture = pixels_of((folder or self.frames) / f"frame.{frame:02}.png")
        return picture[:, :, :3] * picture[:, :, 3:], picture[:, :, 3] > 0.5

    def place(self, frame):
        """Camera of the frame: rotation and shift into x right, y down, z forward; focal length. As SCRIPT has it."""
        eye = np.array([4 + (frame - 1) / 2, -0.5, 1])
        forward = -eye / np.linalg.norm(eye)
        right = np.cross(forward, [0, 0, 1])
        right /= np.linalg.norm(right)
        turn = np.array([right, np.cross(forward, right), forward])
        return turn, -turn @ eye, SIZE[1] / 2 / math.tan(math.radians(16))

    def drawn(self, frame, folder=None):
        turn, shift, focal = self.place(frame)
        gaussians = splat_raster.read_ply((folder or self.sequence) / f"vase.{frame:02}.ply")
        return splat_raster.draw(gaussians, turn, shift, focal, (SIZE[0] / 2, SIZE[1] / 2), SIZE)

    def test_drawn_plainly_they_look_like_the_programs_own_frames(self):
        for frame, least in ((1, 23), (2, 25.5), (3, 25.5)):
            wanted, inside = self.own(frame)
            picture = self.drawn(frame)
            self.assertGreater(decibels(picture[:, :, :3], wanted, inside | (picture[:, :, 3] > 0.5)), least)
            self.assertGreater(picture[inside][:, 3].mean(), 0.998)

    def test_the_scripts_exposure_is_in_the_colours_of_each_frame(self):
        script, folder = self.folder / "exposed.toml", self.folder / "exposed"
        # Two stops below what the others have, then rising.
        automatic = -math.log2(self.report["exposure"][0])
        track = [[1, -automatic - 2], [3, -automatic]]
        script.write_text(SHOT.replace("[camera]\n", f"[camera]\nexposure = {track}\n"))
        report = succeed("export", script, "-o", folder / "vase.##.ply")
        succeed("render", script, "-o", folder)
        np.testing.assert_allclose(report["exposure"], [2 ** (-automatic - stops) for stops in (2, 1, 0)], rtol=1e-9)
        self.assertEqual(report["frames"], [1, 2, 3])
        for frame, least in ((1, 23), (2, 25.5), (3, 25.5)):
            wanted, inside = self.own(frame, folder)
            picture = self.drawn(frame, folder)
            got = decibels(picture[:, :, :3], wanted, inside | (picture[:, :, 3] > 0.5))
            print(f"exposed frame {frame}: {got:.1f} dB")
            self.assertGreater(got, least)

    def test_names_end_no_line_and_no_string(self):
        script = self.folder / 'a"""\n\\b.toml'
        script.write_text(SHOT)
        for name in ("named.ply", "named.usda"):
            succeed("export", script, "-o", self.folder / name, "--frames", "1", "--surfels", "500", "--sh", "0")
            foreign(self.folder / name, self.folder / "named.floats")
            self.assertIn(b", a_____b.toml", (self.folder / name).read_bytes()[:400])
        succeed("export", f"{self.model}/", "-o", self.folder / "named.ply", "--surfels", "500", "--sh", "0")
        self.assertIn(f", {self.model.name}\n".encode(), (self.folder / "named.ply").read_bytes()[:400])

    def test_what_pictures_alone_have_is_said(self):
        script = self.folder / "pictures.toml"
        script.write_text(SHOT.replace("[camera]\n", "[camera]\nshutter_deg = 180\naperture = 0.1\n").replace(
            "[output]\n", '[output]\ntone = "filmic"\nbackground = [1, 1, 1]\n') + "\n[ground]\npoint = [0, 0, -1]\nnormal = [0, 0, 1]\n")
        result = run("export", script, "-o", self.folder / "pictures.ply", "--surfels", "500", "--sh", "0")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("[ground], shutter_deg, aperture, tone, background are for pictures, and not in the export", result.stderr)
        result = run("export", self.script, "-o", self.folder / "pictures.ply", "--surfels", "500", "--sh", "0")
        self.assertNotIn("for pictures", result.stderr)

    def test_a_mistake_in_the_script_is_told_before_the_model_is_opened(self):
        script = self.folder / "mistake.toml"
        script.write_text(SHOT.replace("[camera]\n", "[camera]\nexposre = 1\n"))
        damaged = self.folder / "damaged.srf"
        damaged.mkdir()
        (damaged / "manifest.json").write_bytes((self.model / "manifest.json").read_bytes())
        result = run("export", script, "-o", self.folder / "mistake.ply", "--model", damaged)
        self.assertEqual(result.returncode, 1)
        self.assertIn("did you mean exposure?", result.stderr)

    def test_a_warp_that_begins_collapsed_grows_in_openusd(self):
        script, path = self.folder / "grows.toml", self.folder / "grows.usda"
        script.write_text(SHOT + '\n[[warp]]\ntype = "scale"\nfactor = ["(frame-1)/2", "(frame-1)/2", "(frame-1)/2"]\n')
        succeed("export", script, "-o", path, "--surfels", "500", "--sh", "0")
        arrays, _ = foreign(path, self.folder / "grows.floats")
        self.assertEqual(abs(arrays["float3[] scales", 1]).max(), 0)
        self.assertGreater(arrays["float3[] scales", 3].min(), 0)
        self.assertGreater(arrays["float[] opacities", None].min(), 0.5)
        script.write_text(SHOT + '\n[[warp]]\ntype = "scale"\nfactor = [0, 0, 0]\n')
        before = content(self.folder)
        for name in ("gone.usda", "gone.ply"):
            result = run("export", script, "-o", self.folder / name)
            self.assertEqual(result.returncode, 1)
            self.assertIn("no surfel has a place and an area", result.stderr)
        self.assert_same_files(content(self.folder), before)

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
