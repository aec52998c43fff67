"""bench_doll on a small model: what it reports, and that its answer is checked."""

import json
import math
import os
import pathlib
import subprocess
import tempfile
import unittest

SMALL = ["--surfels", "2000", "--views", "12", "--lights", "6", "--size", "128x160", "--output", "256x192",
         "--frames", "3", "--stage-scale", "tiny"]
STAGES = ["warp", "splat", "queries", "camera ulr", "light ulr", "look-up", "develop"]


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

    def test_answer_is_that_of_the_paper(self):
        self.assertTrue(self.report["check"]["passed"])
        self.assertGreater(self.report["check"]["psnr_linear_db"], 130)
        self.assertLess(self.report["check"]["largest_difference"], 1.3e-6)  # measured 1.14e-6

    def test_stages_have_times_and_bounds(self):
        self.assertEqual([stage["stage"] for stage in self.report["stages"]], STAGES)
        for stage in self.report["stages"]:
            for field in ("ms", "best_ms", "cpu_ms", "bytes", "operations", "bound_ms", "over_bound"):
                self.assertGreater(stage[field], 0, f"{stage['stage']} {field}")
            self.assertLessEqual(stage["best_ms"], stage["ms"])
            self.assertAlmostEqual(stage["over_bound"], stage["ms"] / stage["bound_ms"])
            self.assertIn(stage["bound_by"], ("memory", "arithmetic"))

    def test_ratios_are_those_of_their_times(self):
        report = self.report
        self.assertAlmostEqual(report["bound_ms"], sum(stage["bound_ms"] for stage in report["stages"]))
        self.assertAlmostEqual(report["frame_over_bound"], report["frame_ms"] / report["bound_ms"])
        self.assertAlmostEqual(report["naive_over_frame"], report["naive_ms"] / report["frame_ms"])
        ideal = report["frame_cpu_ms"] / report["machine"]["threads"]
        self.assertAlmostEqual(report["frame_cpu_over_bound"], ideal / report["bound_ms"])
        self.assertAlmostEqual(report["naive_cpu_over_frame"], report["naive_cpu_ms"] / ideal)

    def test_naive_stages_are_parts_of_the_naive_frame(self):
        naive = [stage["naive_ms"] for stage in self.report["stages"]]
        self.assertGreater(min(naive), 0)
        self.assertLessEqual(sum(naive), self.report["naive_ms"])

    def test_frames_keep_to_their_memory(self):
        bounded = self.report["bounded"]
        self.assertEqual(bounded["cache_bytes"], 64 << 20)
        self.assertEqual(bounded["film_bytes"], 256 * 192 * 16)
        self.assertEqual(bounded["surfel_bytes"], self.report["counts"]["surfels"] * (12 + 12 + 4 + 4 + 12))
        allowed = bounded["surfel_bytes"] + bounded["film_bytes"] + (64 << 20) + (256 << 20)
        self.assertAlmostEqual(bounded["allowed_bytes"], allowed)
        self.assertGreater(bounded["peak_bytes"], bounded["surfel_bytes"] + bounded["film_bytes"])

    def test_blocks_are_nearly_as_good_as_the_best_of_their_rank(self):
        packing = self.report["packing"]
        self.assertGreater(packing["error_over_best"], 1)
        self.assertLess(packing["error_over_best"], 1.25)
        self.assertAlmostEqual(packing["blocks_per_second"], 1e6 / packing["us"])

    def test_splats_and_warps_are_timed_in_all_ways(self):
        splats, warps = self.report["splats"], self.report["warps"]
        ways = {splat["way"] for splat in splats}
        self.assertLessEqual({"scalar", "plain"}, ways)
        self.assertEqual(len(splats), 2 * 2 * len(ways))
        self.assertEqual({warp["way"] for warp in warps}, (ways - {"plain"}) | {"differences", "exact"})
        for splat in splats:
            self.assertGreater(splat["db"], 50)  # the aim; but for what is flipped the program asks for 115
            self.assertLess(splat["flipped"], 2e-5)
        for warp in warps:
            self.assertGreater(warp["ns"], 0)

    def test_marks_say_whether_they_are_reached(self):
        marks = {mark["what"]: mark for mark in self.report["marks"]}
        self.assertAlmostEqual(marks["frame over bound"]["value"], self.report["frame_over_bound"])
        self.assertAlmostEqual(marks["the paper's frame over ours"]["value"], self.report["naive_over_frame"])
        for mark in marks.values():
            error = mark["error"]
            reached = (mark["value"] - error <= mark["at_most"] if "at_most" in mark
                       else mark["value"] + error >= mark["at_least"])
            self.assertEqual(mark["reached"], reached, mark["what"])

    def test_growth_has_a_row_for_each_size(self):
        rows = {row["name"]: row for row in self.report["growth"]["rows"]}
        self.assertEqual(len(rows), 10)
        for name in ("3 views", "6 views", "12 views", "512x384", "1 light", "60 lights"):
            self.assertIn(name, rows)
        for row in rows.values():
            self.assertTrue(1 <= row["captured_lights"] <= 6)
            self.assertEqual(list(row["stages"]), STAGES)
            bound = sum(stage["bound_ms"] for stage in row["stages"].values())
            self.assertAlmostEqual(row["bound_ms"], bound)
            ideal = row["frame_cpu_ms"] / self.report["machine"]["threads"]
            self.assertAlmostEqual(row["cpu_over_bound"], ideal / bound)

    def test_verdicts_are_those_of_the_steps(self):
        sweeps = {sweep["what"]: sweep for sweep in self.report["growth"]["sweeps"]}
        self.assertEqual(set(sweeps), {"views", "pixels", "lights", "surfels"})
        for sweep in sweeps.values():
            times, sizes = 1, 1
            for step in sweep["steps"]:
                self.assertAlmostEqual(step["size"], step["to_size"] / step["from_size"])
                times *= step["time"]["median"]
                sizes *= step["size"]
            self.assertAlmostEqual(sweep["exponent"], math.log(times) / math.log(sizes))
            worst = max(step["time"]["median"] / step["size"] for step in sweep["steps"])
            self.assertAlmostEqual(sweep["worst_over_size"]["median"], worst)
            error = sweep["worst_over_size"]["error"]
            self.assertEqual(sweep["verdict"], "no worse than linear" if worst <= 1 else
                             "no worse than linear within the error" if worst - error <= 1 else "worse than linear")

    def test_growth_has_its_marks(self):
        growth = self.report["growth"]
        marks = {mark["what"]: mark for mark in self.report["marks"]}
        for sweep in growth["sweeps"]:
            mark = marks[f"growth with {sweep['what']}: time over size"]
            self.assertEqual((mark["at_most"], mark["value"]), (1, sweep["worst_over_size"]["median"]))
        for what, ratio in (("60 lights over 5", "60_lights_over_5"),
                            ("an environment over 5 lights", "environment_over_5")):
            mark = marks[f"look-ups: {what}"]
            self.assertEqual((mark["at_most"], mark["value"]), (1, growth["look_ups"][ratio]["median"]))

    def test_the_stage_doll_is_packed_to_its_bytes(self):
        doll = self.report["stage_doll"]
        self.assertEqual((doll["scale"], doll["views"], doll["all_views"], doll["lights"]), ("tiny", 8, 8, 12))
        self.assertGreater(doll["texels"], 100)
        self.assertLessEqual(doll["bytes_per_pixel_and_light"], 0.6)
        self.assertGreater(doll["bytes_per_pixel_and_light"], 0.58)  # few texels: measured 0.5871
        self.assertGreater(doll["psnr_linear_db"], 20)
        marks = {mark["what"]: mark for mark in self.report["marks"]}
        mark = marks["packing: dB of the light stage's doll at 0.6 bytes a pixel and light"]
        self.assertEqual((mark["at_least"], mark["value"]), (48, doll["psnr_linear_db"]))

    def test_sorted_look_ups_read_each_block_once(self):
        orders = self.report["look_up_orders"]
        self.assertEqual([cost["images"] for cost in orders], 4 * [1] + 4 * [3] + 4 * [16])
        for cost in orders:
            self.assertGreater(cost["us"], 0)
        one = {cost["order"]: cost["reads"] for cost in orders[:4]}
        once = self.report["counts"]["blocks"] / self.report["counts"]["pairs"]
        self.assertAlmostEqual(one["sorted, all at once"], once)
        self.assertGreater(one["shuffled, one by one"], one["along the curve, one by one"])
        self.assertGreater(one["along the curve, one by one"], once)

    def test_frame_is_that_asked_for(self):
        self.assertEqual(self.report["output"], [256, 192])
        self.assertEqual(self.report["counts"]["pixels"], 256 * 192)
        self.assertEqual(self.report["counts"]["lights"], 5)
        cold = self.report["counts"]["block_bytes"] / (1e-3 * self.report["cold_frame_ms"])
        self.assertAlmostEqual(self.report["cold_bytes_per_second"], cold, delta=1e-6 * cold)

    def test_a_model_that_is_there_is_kept(self):
        before = (self.model / "manifest.json").stat()
        done = bench("--model", self.model, "--frames", "1", "--output", "64x48", "--shot-lights", "1",
                     "--stage-scale", "tiny")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("| frame |", done.stdout)
        self.assertIn("| frame over bound |", done.stdout)
        self.assertIn("| 60 lights |", done.stdout)
        self.assertIn("| surfels | ", done.stdout)
        self.assertIn("look-ups: 60 lights over 5 ", done.stdout)
        self.assertIn("the light stage's doll (tiny), one block in 8 of 8 views of 8, ", done.stdout)
        after = (self.model / "manifest.json").stat()
        self.assertEqual((before.st_ino, before.st_mtime_ns), (after.st_ino, after.st_mtime_ns))

    def test_usage(self):
        self.assertEqual(bench("--frames", "0").returncode, 2)
        self.assertEqual(bench("--stage-scale", "enormous").returncode, 2)
        wrong = bench("--size", "10", "--model", self.model)
        self.assertEqual(wrong.returncode, 1)
        self.assertIn("--size", wrong.stderr)


if __name__ == "__main__":
    unittest.main()
