"""`surflect capture`: from a stage file to scores, at rest and bent; killed runs are resumed."""

import re
import shutil
import signal
import subprocess
import time
import unittest

from support import ROOT, STAGE, SURFLECT, TestInFolder, content, run, succeed

WARP = """
[[warp]]
type = "bend"
axis = [0, 0, 1]
direction = [1, 0, 0]
angle_deg = [[1, 0], [2, 60]]
"""


class CaptureCommand(TestInFolder):
    def assert_refused(self, said, *arguments):
        """One line with these words, which is returned."""
        result = run(*arguments)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"^surflect: [^\n]+\n$")
        self.assertIn(said, result.stderr)
        return result.stderr

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.stage, cls.warp = cls.folder / "stage.toml", cls.folder / "warp.toml"
        cls.stage.write_text(STAGE)
        cls.warp.write_text(WARP)
        cls.report = succeed("capture", cls.stage, "-o", cls.folder / "capture")
        cls.truth = succeed("capture", cls.stage, "-o", cls.folder / "truth", "--script", cls.warp, "--frame", "2")
        succeed("pack", cls.folder / "capture", "-o", cls.folder / "model.srf", "--surfels", "4000", "--tables", "off")

    def test_the_report_counts_frames(self):
        self.assertEqual({key: self.report[key] for key in ("views", "lights", "training_frames", "test_frames")},
                         {"views": 18, "lights": 18, "training_frames": 256, "test_frames": 68})
        self.assertEqual((self.truth["views"], self.truth["training_frames"], self.truth["test_frames"]), (2, 0, 36))

    def test_renderings_are_nearer_than_the_nearest_photograph(self):
        scores = succeed("evaluate", self.folder / "model.srf", self.folder / "capture", "--baseline", "nearest")
        self.assertEqual(set(scores["groups"]),
                         {"new_camera", "new_light", "new_both", "front_lit", "back_lit"})
        self.assertGreater(scores["psnr_linear_db"], scores["baseline"]["psnr_linear_db"] + 1)

    def test_so_are_those_of_the_bent_object_by_the_script_that_bent_it(self):
        arguments = ["evaluate", self.folder / "model.srf", self.folder / "truth"]
        scores = succeed(*arguments, "--script", self.warp, "--frame", "2", "--baseline", "nearest")
        self.assertGreater(scores["psnr_linear_db"], scores["baseline"]["psnr_linear_db"] + 1)
        straight = succeed(*arguments)
        self.assertGreater(scores["psnr_linear_db"], straight["psnr_linear_db"] + 1)

    def test_predicted_errors_order_the_true_ones(self):
        confidence = succeed("evaluate", self.folder / "model.srf", self.folder / "capture", "--predicted-error")["predicted_error"]
        self.assertEqual(confidence["tiles"], 68)  # one a frame: the others hold little of the ball
        self.assertGreater(confidence["rank_correlation"], 0.87)
        left = confidence["rms_left"]
        for curve in left.values():
            self.assertAlmostEqual(curve[0], confidence["measured_rms"])
        self.assertTrue(all(best <= ours + 1e-12 for best, ours in zip(left["best"], left["by_prediction"])))
        self.assertLess(confidence["sparsification_error"], 0.08)

    def test_a_killed_run_goes_on_to_the_same_bytes_with_any_number_of_threads(self):
        target = self.folder / "killed"
        process = subprocess.Popen([SURFLECT, "capture", str(self.stage), "-o", str(target), "--threads", "1"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 60
        while not (target / "images" / "C002.exr").exists() and time.monotonic() < deadline:
            time.sleep(0.001)
        process.send_signal(signal.SIGKILL)
        process.wait(timeout=60)
        self.assertFalse((target / "transforms.json").exists(), "came too late to kill")
        report = succeed("capture", self.stage, "-o", target, "--threads", "3")
        self.assertGreaterEqual(report["resumed_views"], 3)
        self.assert_same_files(content(target), content(self.folder / "capture"))

    def test_packed_in_one_pass_it_is_the_same_model(self):
        model, test = self.folder / "one.srf", self.folder / "test"
        report = succeed("capture", self.stage, "--pack", model, "-o", test, "--surfels", "4000", "--tables", "off")
        one, two = content(model), content(self.folder / "model.srf")
        self.assertNotEqual(one.pop("views/identity"), two.pop("views/identity"))
        self.assert_same_files(one, two)
        views = report["model"]["store"]["views"]
        self.assertEqual([view["view"] for view in views], [f"C{number:03}" for number in range(16)])
        self.assertEqual(sum(view["bytes"] for view in views), report["model"]["store"]["bytes"])
        self.assertGreater(min(view["psnr_linear_db"] for view in views), 30)
        self.assertEqual(report["test"]["test_frames"], 2 * 18 + 8 * 2)
        again = succeed("capture", self.stage, "--pack", model, "-o", test, "--surfels", "4000", "--tables", "off")
        self.assertEqual((again["model"]["resumed_views"], again["test"]["resumed_views"]), (16, 10))
        self.assertEqual(again["model"]["store"], report["model"]["store"])
        coarser = ["capture", self.stage, "--pack", model, "--surfels", "4000", "--tables", "off", "--tolerance", "0.1"]
        self.assert_refused("--overwrite replaces it", *coarser)
        self.assert_same_files(content(model), {**one, "views/identity": content(model)["views/identity"]})
        overwritten = self.folder / "overwritten.srf"
        shutil.copytree(model, overwritten)
        coarser[3] = overwritten
        self.assertLess(succeed(*coarser, "--overwrite")["model"]["store"]["bytes"],
                        report["model"]["store"]["bytes"])
        scores = succeed("evaluate", model, test, "--baseline", "nearest")
        self.assertGreater(scores["psnr_linear_db"], scores["baseline"]["psnr_linear_db"] + 1)

    def test_what_keeps_the_test_from_being_written_is_said_before_anything_is_packed(self):
        model = self.folder / "never.srf"
        occupied = self.folder / "occupied"
        occupied.mkdir()
        (occupied / "mine.txt").write_text("mine")
        self.assert_refused("occupied", "capture", self.stage, "--pack", model, "-o", occupied)
        self.assertFalse(model.exists())
        nothing = self.folder / "nothing.toml"
        nothing.write_text(STAGE.replace("test = 2\n", ""))
        self.assert_refused("nothing.toml", "capture", nothing, "--pack", model, "-o", self.folder / "no_test")
        self.assertFalse(model.exists())
        self.assertFalse((self.folder / "no_test").exists())

    def test_cameras_inside_an_object_are_told(self):
        stage = self.folder / "inside.toml"
        stage.write_text(STAGE.replace("distance = 5", "distance = 0.01", 1).replace("height = 2.2", "fov_deg = 27")
                         .replace("orthographic", "pinhole"))
        result = run("capture", stage, "-o", self.folder / "inside")
        self.assertRegex(result.stderr, r"warning: (\d+) of \1 cameras are inside an object: ")

    def test_what_a_script_leaves_nothing_of_is_no_truth(self):
        for factor, said in (("[0, 0, 0]", "no triangle"), ("[1e12, 1, 1]", "within 1e9")):
            collapse = self.folder / "collapse.toml"
            collapse.write_text(f'[[warp]]\ntype = "scale"\nfactor = {factor}\n')
            line = self.assert_refused(said, "capture", self.stage, "-o", self.folder / "gone", "--script", collapse)
            self.assertIn("object[0]: bent by the script", line)

    def test_tiny_stages_are_nearer_than_the_nearest_photograph_bent_too(self):
        stages = self.folder / "coarse"
        shutil.copytree(ROOT / "examples" / "stages", stages)
        for name in ("doll", "mug"):
            with self.subTest(stage=name):
                stage = stages / f"{name}.toml"
                stage.write_text(re.sub(r"(?m)^segments = \d+$", "segments = 24", stage.read_text()))
                capture, truth, model = (self.folder / f"tiny-{name}{end}" for end in ("", "-bent", ".srf"))
                succeed("capture", stage, "--scale", "tiny", "-o", capture)
                succeed("capture", stage, "--scale", "tiny", "-o", truth, "--script", self.warp, "--frame", "2")
                succeed("pack", capture, "-o", model, "--surfels", "8000", "--tables", "off")
                for scores in (succeed("evaluate", model, capture, "--baseline", "nearest"),
                               succeed("evaluate", model, truth, "--script", self.warp, "--frame", "2",
                                       "--baseline", "nearest")):
                    self.assertGreater(scores["psnr_linear_db"], scores["baseline"]["psnr_linear_db"])

    def test_another_stage_does_not_go_on_there(self):
        other = self.folder / "other.toml"
        other.write_text(STAGE.replace("samples = 16", "samples = 17"))
        before = content(self.folder / "capture")
        result = run("capture", other, "-o", self.folder / "capture")
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"^surflect: [^\n]*another stage file[^\n]*\n$")
        self.assert_same_files(content(self.folder / "capture"), before)

    def test_the_example_stages_are_captured_at_their_scales(self):
        shutil.copytree(ROOT / "examples" / "stages", self.folder / "stages")
        stages = sorted((self.folder / "stages").glob("*.toml"))
        self.assertGreaterEqual(len(stages), 4)
        for stage in stages:
            small = re.sub(r"(?m)^(camera\.)?size = \[\d+, \d+\]$", r"\1size = [8, 8]", stage.read_text())
            stage.write_text(re.sub(r"(?m)^samples = \d+$", "samples = 1", small))
            with self.subTest(stage=stage.name):
                report = succeed("capture", stage, "--scale", "tiny", "-o", self.folder / stage.stem)
                self.assertEqual(report["samples"], 1)
                self.assertIn(report["training_frames"], range(80, 200))
                self.assertGreater(report["test_frames"], 0)
                for scale in ("small", "paper"):
                    self.assertIn(f"[scale.{scale}]", small)

    def test_a_scale_that_is_not_there_is_named(self):
        stage = ROOT / "examples" / "stages" / "sphere.toml"
        result = run("capture", stage, "--scale", "tyny", "-o", self.folder / "none")
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"^surflect: [^\n]*scale\.tyny: missing, [^\n]*; did you mean tiny\?\n$")

    def test_what_is_wrong_with_a_stage_is_one_line(self):
        (self.folder / "nan.obj").write_text("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")
        for wrong, right, said in (('material = "clay"', 'material = "clai"', "object[0].material"),
                                   ("roughness = 0.5", "roughness = -1", "material[0].roughness"),
                                   ("count = 16", "count = 0", "lights.count"),
                                   ("roughness = 0.5", 'roughness = 0.5\ntexture = "none.png"', "none.png"),
                                   ("albedo = [0.8,", "albedo = [nan,", "material[0].albedo[0]"),
                                   ("turntable = 8\nelevations_deg = [-30, 30]", "directions = [[0, 0, 0]]",
                                    "views.directions[0]"),
                                   ("[[material]]", "[exposure]\ntimes = [1, 1]\n[[material]]", "exposure.times[1]"),
                                   (STAGE[STAGE.index('type = "bumpy_sphere"'):],
                                    'type = "mesh"\nmaterial = "clay"\nfile = "nan.obj"\n', "nan.obj: line 2"),
                                   ('"bumpy_sphere"', '"mesh"', "object[0]"),
                                   (STAGE[STAGE.index("[lights]"):STAGE.index("[[material]]")], "", "lights: missing")):
            with self.subTest(said=said):
                stage = self.folder / "wrong.toml"
                stage.write_text(STAGE.replace(wrong, right))
                self.assert_refused(said, "capture", stage, "-o", self.folder / "wrong")
                self.assertFalse((self.folder / "wrong").exists())


if __name__ == "__main__":
    unittest.main()
