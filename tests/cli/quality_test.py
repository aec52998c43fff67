"""`surflect render` with options, --preset, --tolerance and --budget-ms: frames, identities and reports."""

import unittest

from support import SCRIPT, TestInFolder, content, run, succeed

FRAMES = 12
TOLERANCE = "0.9"  # so few cameras and lights are all needed for less


class Quality(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        script = SCRIPT.replace("last = 3", f"last = {FRAMES}").replace("[3, 40]", f"[{FRAMES}, 40]")
        cls.write_small_shot(cameras=3, lights=3, script=script.replace("size = [120, 90]", "size = [60, 45]"))
        succeed("pack", cls.capture, "-o", cls.model, "--surfels", "8000", "--tables", "off")
        cls.full = cls.frames("full")
        cls.coarse = cls.frames("coarse", "--tolerance", TOLERANCE)

    @classmethod
    def render(cls, name, *options):
        return succeed("render", cls.script, "-o", cls.folder / name, *options)

    @classmethod
    def frames(cls, name, *options):
        cls.render(name, *options)
        return content(cls.folder / name)

    def settings(self, report):
        return [frame["setting"] for frame in report["frames"]]

    def test_nothing_is_allowed_to_differ_at_tolerance_0(self):
        frames = self.frames("exact", "--tolerance", "0")
        for name, bytes_ in self.full.items():
            if name.endswith("png"):
                self.assertEqual(frames[name], bytes_)
        self.assertEqual(set(self.settings(self.render("exact", "--tolerance", "0"))), {"full"})

    def test_a_film_within_a_tolerance_is_the_same_whatever_renders_it(self):
        self.assertNotEqual(self.coarse, self.full)
        self.assert_same_files(self.frames("alone", "--tolerance", TOLERANCE, "--threads", "1", "--cache-mb", "0"),
                               self.coarse)
        for frames in ("7-9", "1-12"):
            report = self.render("resumed", "--tolerance", TOLERANCE, "--frames", frames, "--resume")
        self.assertEqual(len(report["frames"]), FRAMES - 3)
        self.assert_same_files(content(self.folder / "resumed"), self.coarse)

    def test_frames_of_another_target_are_not_kept(self):
        self.frames("mixed", "--frames", "1-2")
        for options in (["--tolerance", TOLERANCE], ["--tolerance", "0.91"], ["--lights", "1"],
                        ["--preset", "preview"], ["--budget-ms", "1000"], []):
            report = self.render("mixed", "--frames", "1-2", "--resume", *options)
            self.assertEqual(len(report["frames"]), 2, options)
            self.assertEqual(len(self.render("mixed", "--frames", "1-2", "--resume", *options)["frames"]), 0, options)

    def test_true_errors_are_reported(self):
        report = self.render("true", "--tolerance", TOLERANCE, "--verify")
        for frame in report["frames"]:
            self.assertLessEqual(frame["predicted_error"], float(TOLERANCE))
            if frame["setting"] == "full":
                self.assertEqual(frame["true_error"], 0)
        self.assertNotEqual(set(self.settings(report)), {"full"})
        self.assertEqual(report["true_error_most"], max(frame["true_error"] for frame in report["frames"]))
        within = sum(frame["true_error"] <= float(TOLERANCE) for frame in report["frames"])
        self.assertEqual(report["frames_within_tolerance"], within)
        self.assertGreaterEqual(report["frames_within_1.2_tolerance"], within)
        self.assertGreater(report["probes"], 0)
        said = run("render", self.script, "-o", self.folder / "said", "--tolerance", TOLERANCE, "--verify").stderr
        self.assertIn(f"within {TOLERANCE} in {within} of {FRAMES} frames", said)

    def test_options_that_are_given_are_kept(self):
        self.assertEqual(self.settings(self.render("k", "--frames", "1", "--lights", "1", "--cameras", "2")),
                         ["cameras=2 lights=1"])
        (preview,) = self.settings(self.render("p", "--frames", "1", "--preset", "preview"))
        self.assertNotEqual(preview, "full")
        (held,) = self.settings(self.render("p", "--frames", "1", "--preset", "preview", "--cameras", "1"))
        self.assertIn("cameras=1", held)
        (held,) = self.settings(self.render("h", "--frames", "1", "--tolerance", "0.01", "--cameras", "1"))
        self.assertIn("cameras=1", held)

    def test_what_a_given_option_needs_is_kept(self):
        report = self.render("needs", "--frames", "1-2", "--tolerance", TOLERANCE, "--interpolation", "kriging",
                             "--reciprocity", "on")
        self.assertTrue(all("interpolation=kriging" in setting for setting in self.settings(report)))

    def test_a_budget_of_any_length_gives_a_film(self):
        self.assertEqual(set(self.settings(self.render("long", "--budget-ms", "100000"))), {"full"})
        self.assertNotIn("full", self.settings(self.render("short", "--budget-ms", "0.01")))

    def test_wrong_qualities_are_refused_in_one_line(self):
        for status, options, said in (
                (2, ["--terms", "1"], "surfels has no option --terms"),
                (2, ["--cameras", "0"], "--cameras: found 0, expected 1..16, whole"),
                (2, ["--reciprocity", "on", "--interpolation", "paper"], "only with --interpolation kriging or shared, found paper"),
                (2, ["--tolerance", "-1"], "--tolerance"), (2, ["--tolerance", "nan"], "--tolerance"),
                (2, ["--budget-ms", "0"], "--budget-ms"), (2, ["--preset", "best"], "--preset"),
                (2, ["--tolerance", "0.1", "--budget-ms", "9"], "--tolerance")):
            with self.subTest(options=options):
                result = run("render", self.script, "-o", self.folder / "none", *options)
                self.assertEqual(result.returncode, status, result.stderr)
                self.assertIn(said, result.stderr)
                if status == 1:
                    self.assertEqual(result.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main()
