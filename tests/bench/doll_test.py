"""bench_doll on a small model: what it reports, and that its answer is checked."""

import json
import math
import os
import pathlib
import subprocess
import tempfile
import unittest

SMALL = ["--surfels", "2000", "--views", "12", "--lights", "6", "--size", "128x160", "--output", "256x192",
         "--frames", "3"]
STAGES = ["warp", "splat", "queries", "ulr", "look-up", "develop"]


def bench(*arguments):
    return subprocess.run([os.environ["BENCH_DOLL"], *map(str, arguments)], capture_output=True, text=True)


class Doll(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.model = pathlib.Path(cls.folder.name) / "doll.srf"
        done = bench("--model", cls.model, *SMALL, "--json")
        assert done.returncode == 0, done.stderr
        cls.report = json.loads(done.stdout)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_the_frame_is_the_reference_frame(self):
        self.assertGreater(self.report["check"]["psnr_linear_db"], 130)
        self.assertLess(self.report["check"]["largest_difference"], 1.3e-6)  # measured 1.14e-6

    def test_stages_have_times_and_bounds(self):
        self.assertEqual([stage["stage"] for stage in self.report["stages"]], STAGES)
        for stage in self.report["stages"]:
            for field in ("ms", "cpu_ms", "naive_ms", "bytes", "operations", "bound_ms", "over_bound"):
                self.assertGreater(stage[field], 0, f"{stage['stage']} {field}")
            self.assertAlmostEqual(stage["over_bound"], stage["ms"] / stage["bound_ms"])
            self.assertIn(stage["bound_by"], ("memory", "arithmetic"))

    def test_ratios_are_those_of_their_times(self):
        report = self.report
        self.assertAlmostEqual(report["bound_ms"], sum(stage["bound_ms"] for stage in report["stages"]))
        self.assertAlmostEqual(report["frame_over_bound"], report["frame_ms"] / report["bound_ms"])
        self.assertAlmostEqual(report["naive_over_frame"], report["naive_ms"] / report["frame_ms"])
        self.assertLessEqual(sum(stage["naive_ms"] for stage in report["stages"]), report["naive_ms"])

    def test_the_preview_is_close_to_the_frame(self):
        report = self.report
        self.assertGreater(report["preview_db"], 35)
        self.assertGreater(report["preview_ms"], 0)
        self.assertAlmostEqual(report["preview_over_bound"], report["preview_ms"] / report["bound_ms"])
        self.assertEqual([stage["stage"] for stage in report["preview_stages"]], STAGES)

    def test_counts_are_those_of_the_frame(self):
        counts = self.report["counts"]
        self.assertEqual(self.report["output"], [256, 192])
        self.assertEqual((counts["pixels"], counts["views"], counts["rig_lights"], counts["lights"]),
                         (256 * 192, 12, 6, 5))
        self.assertAlmostEqual(counts["surfels"], 2000, delta=200)
        self.assertLessEqual(counts["visible"], counts["drawn"])
        self.assertLess(counts["drawn"], counts["surfels"])
        self.assertLessEqual(counts["visible"], counts["pairs"])
        self.assertLessEqual(counts["pairs"], 4 * counts["visible"])
        self.assertLessEqual(counts["lookups"], 6 * counts["pairs"])
        self.assertGreater(counts["contributions"], counts["visible"])
        cold = counts["block_bytes"] / (1e-3 * self.report["cold_frame_ms"])
        self.assertAlmostEqual(self.report["cold_bytes_per_second"], cold, delta=1e-6 * cold)

    def test_one_thing_grows_at_a_time(self):
        growth = self.report["growth"]
        sizes = {what: [row["size"] for row in sweep["rows"]] for what, sweep in growth.items()}
        surfels = sizes.pop("surfels")
        self.assertEqual(sizes, {"views": [3, 6, 12], "pixels": [256 * 192, 4 * 256 * 192], "lights": [1, 5, 60],
                                 "environments": [1]})
        self.assertEqual(surfels, [times * self.report["counts"]["surfels"] for times in (1, 2, 4)])
        for what, sweep in growth.items():
            rows = sweep["rows"]
            for row in rows:
                self.assertGreater(row["frame_ms"], 0)
                self.assertEqual([stage["stage"] for stage in row["stages"]], STAGES)
            if what != "environments":
                power = (math.log(rows[-1]["frame_cpu_ms"] / rows[0]["frame_cpu_ms"])
                         / math.log(rows[-1]["size"] / rows[0]["size"]))
                self.assertAlmostEqual(sweep["exponent"], power)

    def test_the_table_shows_medians_of_a_model_that_is_kept(self):
        before = (self.model / "manifest.json").stat()
        done = bench("--model", self.model, "--frames", "3", "--output", "64x48", "--shot-lights", "1",
                     "--benchmark_filter=^frame|machine/read")
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = [line.split()[0] for line in done.stdout.splitlines() if "median" in line]
        self.assertEqual(len(lines), 2, done.stdout)
        after = (self.model / "manifest.json").stat()
        self.assertEqual((before.st_ino, before.st_mtime_ns), (after.st_ino, after.st_mtime_ns))

    def test_usage(self):
        self.assertEqual(bench("--frames", "0").returncode, 2)
        self.assertEqual(bench("--model", self.model, "--unknown").returncode, 2)
        self.assertEqual(bench("--json", "--benchmark_filter=frame").returncode, 2)
        wrong = bench("--size", "10", "--model", self.model)
        self.assertEqual(wrong.returncode, 1)
        self.assertIn("--size", wrong.stderr)


if __name__ == "__main__":
    unittest.main()
