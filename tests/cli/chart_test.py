"""`surflect chart`: its report, that it goes on where it was interrupted, and what it refuses."""

import csv
import json
import signal
import subprocess
import time
import unittest

from support import SURFLECT, TestInFolder, run, succeed

ACCURACY = ("rest", "rms_to_full", "read_bytes_per_frame", "setting", "command")


class Chart(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=5, lights=4)
        succeed("pack", cls.capture, "-o", cls.model, "--surfels", "3000", "--tables", "off")

    def arguments(self, output, *more, rounds=1):
        return ["chart", self.model, self.capture, "-o", self.folder / output, "--frames", "3", "--timed-frames",
                "1", "--rounds", rounds, *more]

    def test_the_report_is_complete_and_the_same_again(self):
        arguments = self.arguments("report", "--sweep", "cameras=2,1", "--sweep", "scale=0.5")
        (self.folder / "report").mkdir()
        abandoned = self.folder / "report" / "chart.json.k3ZxQ1.tmp"  # of a killed run
        abandoned.write_text("{")
        chart = succeed(*arguments)
        self.assertFalse(abandoned.exists())
        self.assertEqual(len(chart["points"]), 6)
        self.assertEqual(chart["rest_frames"], 3)
        with open(self.folder / "report" / "chart.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([float(row["rest_flip"]) for row in rows], [p["rest"]["flip"] for p in chart["points"]])
        self.assertEqual(json.loads((self.folder / "report" / "chart.json").read_text()), chart)
        self.assertIn("<html", (self.folder / "report" / "index.html").read_text())
        self.assertEqual(succeed(*arguments), chart)

    def test_a_point_is_reproduced_by_its_command(self):
        chart = succeed(*self.arguments("sweep", "--sweep", "lights=1"))
        for point in chart["points"]:
            command = point["command"].replace("-o point/", f"-o {self.folder / 'point'}").split()
            again = succeed(*command[1:])
            self.assertEqual([p["setting"] for p in again["points"]], [point["setting"]])
            self.assertEqual([again["points"][0][key] for key in ACCURACY], [point[key] for key in ACCURACY])

    def test_an_option_without_values_of_its_own_can_be_swept(self):
        chart = succeed(*self.arguments("low-pass", "--sweep", "low_pass=0.3", "--reciprocity", "on", "--interpolation",
                                        "kriging"))
        self.assertEqual([point["setting"] for point in chart["points"]], [{}, {"low_pass": 0.3}])

    def test_an_interrupted_chart_goes_on(self):
        arguments = self.arguments("stopped", "--sweep", "cameras=1", rounds=1000000)
        process = subprocess.Popen([SURFLECT, *map(str, arguments)], stderr=subprocess.PIPE, text=True)
        kept = self.folder / "stopped" / "measurements.jsonl"
        while process.poll() is None and not (kept.exists() and kept.read_text().count("\n") == 2):
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate()
        self.assertEqual(process.returncode, 128 + signal.SIGINT)
        self.assertEqual(said.splitlines()[-1], "surflect: interrupted; the same command goes on from here")
        lines = kept.read_text()
        succeed(*self.arguments("stopped", "--sweep", "cameras=1"))
        self.assertTrue(kept.read_text().startswith(lines))

    def test_evaluate_turns_the_same_knobs_and_scores_alike(self):
        full, fast = (succeed("evaluate", self.model, self.capture, *knob) for knob in ([], ["--cameras", "1"]))
        points = succeed("chart", self.model, self.capture, "-o", self.folder / "scores", "--sweep", "cameras=1",
                         "--frames", "1000", "--rounds", "1")["points"]
        for point, scores in zip(points, (full, fast), strict=True):
            for measure in ("psnr_linear_db", "psnr_srgb_db", "ssim_srgb"):
                self.assertAlmostEqual(point["rest"][measure], scores[measure], places=9)
        self.assertNotEqual(full["psnr_linear_db"], fast["psnr_linear_db"])

    def test_wrong_input_is_one_line(self):
        for wrong, expected in ((["--sweep", "colour=1"], "surfels has no option --colour"),
                                (["--sweep", "cameras=99"], "--cameras: found 99, expected 1..16, whole"),
                                (["--sweep", "cameras=1", "--sweep", "cameras=2"], "cameras: is given twice"),
                                (["--cameras", "1", "--sweep", "cameras=2"], "--cameras: is swept, too"),
                                (["--sweep", "cache_mb=1,2"], "cache_mb: cannot be swept"),
                                (["--sweep", "scale=2"], "--scale: found 2, expected 0.01..1")):
            with self.subTest(wrong=wrong):
                result = run(*self.arguments("wrong", *wrong))
                self.assertEqual((result.returncode, result.stdout), (2, ""))
                self.assertIn(expected, result.stderr.splitlines()[-1])
        for again in (self.model, f"{self.model}/", self.folder / "capture" / ".." / "model.srf"):
            twice = run("chart", self.model, again, self.capture, "-o", self.folder / "wrong")
            self.assertEqual(twice.returncode, 1)
            self.assertIn("given twice", twice.stderr)


if __name__ == "__main__":
    unittest.main()
