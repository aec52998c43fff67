"""`surflect render` and `evaluate`: their reports, and that frames depend on script and model alone."""

import subprocess
import unittest

from support import FILM_CHECK, SCRIPT, VASE, TestInFolder, content, run, succeed

FRAMES = [f"frame.{frame:02}.{kind}" for frame in (1, 2, 3) for kind in ("exr", "png")]


class Render(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=3, lights=3)
        succeed("pack", cls.capture, "-o", cls.model, "--surfels", "60000", "--tables", "off")
        cls.report = cls.render("film")
        cls.film = content(cls.folder / "film")

    @classmethod
    def render(cls, name, *options):
        return succeed("render", cls.script, "-o", cls.folder / name, *options)

    def test_the_report_of_a_frame_says_what_was_done(self):
        self.assertEqual([frame["frame"] for frame in self.report["frames"]], [1, 2, 3])
        self.assertGreater(self.report["memory_peak_bytes"], 0)
        for frame in self.report["frames"]:
            for key in ("lookups", "operations", "blocks_read", "bytes_read", "cache_hits", "mean_rank",
                        "total_seconds"):
                self.assertIsInstance(frame[key], (int, float), key)
            self.assertGreater(frame["surfels"]["drawn"], 1000)
            self.assertEqual(frame["surfels"]["dead"], 0)
            self.assertGreater(frame["operations"], 0)
            self.assertLessEqual({"warp", "splat", "queries", "ulr", "look-up", "develop", "aov", "write"},
                                 set(frame["seconds"]))
            self.assertLessEqual(sum(frame["seconds"].values()), frame["total_seconds"] + 1e-3)
        self.assertEqual(set(self.report["seconds"]), {"render", "aov", "write", "film"})
        self.assertLessEqual(self.report["seconds"]["render"], self.report["seconds"]["film"])
        self.assertGreater(self.report["frames"][0]["blocks_read"], 0)

    def test_every_frame_has_a_picture_and_a_preview(self):
        self.assertEqual(sorted(self.film), FRAMES)

    def test_a_film_with_predicted_errors_says_how_much_of_it_is_to_be_trusted(self):
        script = self.folder / "trust.toml"
        script.write_text(SCRIPT.replace('"stretch"]', '"stretch", "predicted_error"]'))
        result = run("render", script, "-o", self.folder / "trust")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"predicted error: at most 10/255 of white in \d+ % of the object's pixels "
                                        r"\(fewest: frame [123], \d+ %\); cameras and lights nearer")
        trust = succeed("render", script, "-o", self.folder / "trust")["trust"]
        self.assertLess(0, trust["share"])
        self.assertLessEqual(trust["worst_share"], trust["share"])
        self.assertNotIn("trust", self.report)
        for name in FRAMES[1::2]:  # previews: the same picture with and without the AOV
            self.assertEqual(content(self.folder / "trust")[name], self.film[name])

    def test_a_script_to_start_from_renders_and_is_not_overwritten(self):
        script = self.folder / "start" / "shot.toml"
        script.parent.mkdir()
        report = succeed("script", self.model, "-o", script)
        self.assertEqual(report["model"], "../model.srf")
        text = script.read_text()
        self.assertEqual(text.count("#[[warp]]"), 9)
        succeed("render", script, "-o", self.folder / "started", "--frames", "25", "--scale", "0.1")
        script.write_text("# mine")
        again = run("script", self.model, "-o", script)
        self.assertEqual((again.returncode, script.read_text()), (1, "# mine"))
        self.assertIn("--overwrite replaces it", again.stderr)
        succeed("script", self.model, "-o", script, "--overwrite")
        self.assertEqual(script.read_text(), text)

    def test_threads_and_cache_do_not_change_a_bit(self):
        for threads in (1, 2):
            for megabytes in (0, 64):
                with self.subTest(threads=threads, megabytes=megabytes):
                    name = f"film-{threads}-{megabytes}"
                    self.render(name, "--threads", threads, "--cache-mb", megabytes)
                    self.assertEqual(content(self.folder / name), self.film)

    def test_vector_instructions_can_be_chosen(self):
        self.render("auto", "--simd", "auto")
        self.assertEqual(content(self.folder / "auto"), self.film)
        result = run("render", self.script, "-o", self.folder / "none", "--simd", "sse9")
        self.assertEqual(result.returncode, 2)
        self.assertIn("--simd: found 'sse9', expected auto, scalar", result.stderr)
        plain, best = (succeed("evaluate", self.model, self.capture, "--simd", simd) for simd in ("scalar", "auto"))
        self.assertAlmostEqual(plain["psnr_linear_db"], best["psnr_linear_db"], delta=0.001)

    def test_frames_of_other_vector_instructions_are_not_kept(self):
        self.render("mixed", "--simd", "scalar")
        self.assertIn(b" simd scalar ", content(self.folder / "mixed")[FRAMES[0]])
        kept = 3 - len(self.render("mixed", "--resume")["frames"])
        self.assertEqual(kept, 3 if b" simd scalar " in self.film[FRAMES[0]] else 0)

    def test_a_part_of_the_film_is_the_same_as_in_the_whole(self):
        self.render("part", "--frames", "2-3")
        self.assertEqual(content(self.folder / "part"), {name: self.film[name] for name in FRAMES[2:]})

    def test_what_is_no_file_is_not_replaced_by_a_frame(self):
        for kind in ("exr", "png"):
            for is_full in (False, True):
                with self.subTest(kind=kind, is_full=is_full):
                    frames = self.folder / f"folder-{kind}-{is_full}"
                    (frames / f"frame.01.{kind}").mkdir(parents=True)
                    if is_full:
                        (frames / f"frame.01.{kind}" / "mine").write_text("mine")
                    result = run("render", self.script, "-o", frames, "--frames", "1")
                    self.assertEqual(result.returncode, 1)
                    self.assertEqual(result.stderr,
                                     f"surflect: {frames}/frame.01.{kind}: cannot write (a folder is there)\n")
                    self.assertTrue((frames / f"frame.01.{kind}").is_dir())

    def test_resume_renders_only_what_is_missing_or_damaged(self):
        frames = self.folder / "resumed"
        self.render("resumed", "--frames", "1-2")
        kept = (frames / "frame.01.exr").stat().st_mtime_ns
        (frames / "frame.02.exr").write_bytes(b"torn")
        report = self.render("resumed", "--resume")
        self.assertEqual([frame["frame"] for frame in report["frames"]], [2, 3])
        self.assertEqual((frames / "frame.01.exr").stat().st_mtime_ns, kept)
        self.assertEqual(content(frames), self.film)
        for name in ("frame.02.exr", "frame.02.png"):
            whole = (frames / name).read_bytes()
            middle = len(whole) // 2
            for damaged in (whole[:middle], whole[:-30], whole[:middle] + b"\xff\0\xff\0" + whole[middle + 4:]):
                (frames / name).write_bytes(damaged)
                report = self.render("resumed", "--resume")
                self.assertEqual([frame["frame"] for frame in report["frames"]], [2], name)
                self.assertEqual(content(frames), self.film)

    def test_resume_renders_anew_what_another_script_has_rendered(self):
        other = self.folder / "other.toml"
        other.write_text(SCRIPT.replace("40]]", "20]]"))
        succeed("render", other, "-o", self.folder / "changed")
        self.assertNotEqual(content(self.folder / "changed"), self.film)
        self.assertEqual(len(self.render("changed", "--resume")["frames"]), 3)
        self.assertEqual(content(self.folder / "changed"), self.film)

    def test_what_was_done_is_said_in_one_line(self):
        frames = self.folder / "said"
        for options, line in (((), r"rendered 3 frames \(\d+\.\d per second\) to F/"),
                              (("--frames", "2"), r"rendered 1 frame \(\d+\.\d per second\) to F/"),
                              (("--resume",), "rendered no frames to F/: 3 were up to date")):
            result = run("render", self.script, "-o", frames, *options)
            exposed = "" if "--resume" in options else r"PNG and video are exposed by [+-]\d+\.\d{3} stops, .*\n"
            self.assertRegex(result.stderr, f"^{exposed}{line.replace('F', str(frames))}\n$")
        (frames / "frame.01.png").unlink()
        self.assertIn("; 2 were up to date\n", run("render", self.script, "-o", frames, "--resume").stderr)

    def test_folders_of_frames_are_made(self):
        script = self.folder / "shots.toml"
        script.write_text(SCRIPT.replace("frame.##.exr", "shot a/##/frame.exr"))
        succeed("render", script, "-o", self.folder / "shots" / "all", "--frames", "1-2")
        self.assertEqual(sorted(content(self.folder / "shots")),
                         [f"all/shot a/{frame}/frame.{kind}" for frame in ("01", "02") for kind in ("exr", "png")])

    def test_what_cannot_be_written_is_refused_before_anything_is_rendered(self):
        frames = self.folder / "blocked"
        (frames / "frame.03.png").mkdir(parents=True)
        (self.folder / "file").write_text("")
        for output, said in ((frames, "blocked/frame.03.png: cannot write (a folder is there)"),
                             (self.folder / "file" / "film", f"cannot be created ({self.folder}/file is not a folder)")):
            result = run("render", self.script, "-o", output)
            self.assertEqual(result.returncode, 1)
            self.assertIn(said, result.stderr)
        self.assertEqual(content(frames), {})

    def test_frames_outside_the_script_are_refused(self):
        for frames in ("0-2", "3-4", "2-1", "x", "1-"):
            with self.subTest(frames=frames):
                result = run("render", self.script, "-o", self.folder / "none", "--frames", frames)
                self.assertEqual(result.returncode, 1)
                self.assertIn("--frames", result.stderr)

    def write_map(self, name, brightest):
        """A lat-long map of 8 x 4 pixels, RGBE: one texel of radiance 2 ^ (brightest - 128), the others of 1/2."""
        texels = [bytes([128, 128, 128, 128])] * 32
        texels[11] = bytes([255, 255, 255, brightest])
        (self.folder / name).write_bytes(
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n" + b"".join(texels))

    def test_an_environment_is_reported_and_part_of_the_films_identity(self):
        self.write_map("map.hdr", 135)
        script = self.folder / "map.toml"
        script.write_text(SCRIPT + "[[light]]\ntype = \"environment\"\nimage = \"map.hdr\"\nup = [0, 0, 1]\n")
        frames = self.folder / "lit"
        report = succeed("render", script, "-o", frames)
        (environment,) = report["environments"]
        self.assertEqual(environment["texel_lights"], 8192)
        self.assertEqual((environment["replaced_texels"], environment["clamped_texels"]), (0, 0))
        self.assertGreater(environment["lights"], 1)
        self.assertGreater(environment["seconds"], 0)
        for way in ("separate", "kriging"):
            (environment,) = succeed("render", script, "-o", self.folder / way, "--frames", "1-1", "--interpolation",
                                     way)["environments"]
            self.assertEqual(environment["key_lights"] > 0, way == "kriging")
        self.assertEqual(len(succeed("render", script, "-o", frames, "--resume")["frames"]), 0)
        lit = content(frames)
        self.assertNotEqual(lit, self.film)
        self.write_map("map.hdr", 137)
        self.assertEqual(len(succeed("render", script, "-o", frames, "--resume")["frames"]), 3)
        self.assertNotEqual(content(frames), lit)

    def test_an_environment_that_is_none_is_refused_by_name(self):
        (self.folder / "torn.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n")
        for image in ("torn.hdr", "none.exr"):
            script = self.folder / "bad.toml"
            script.write_text(SCRIPT + f"[[light]]\ntype = \"environment\"\nimage = \"{image}\"\n")
            result = run("render", script, "-o", self.folder / "none")
            self.assertEqual(result.returncode, 1)
            self.assertIn(image, result.stderr)

    def lines_about(self, *warps, look_at="[0, 0, 0]"):
        """Lines of `render` on stderr for a film under these warps, without its exposure and the last."""
        script = self.folder / "misfit.toml"
        text = SCRIPT.partition("[[warp]]")[0].replace("look_at = [0, 0, 0]", f"look_at = {look_at}")
        script.write_text(text + "".join(f"[[warp]]\n{warp}\n" for warp in warps))
        result = run("render", script, "-o", self.folder / "misfit", "--scale", "0.2")
        self.assertEqual(result.returncode, 0, result.stderr)
        return [line for line in result.stderr.splitlines()[:-1] if not line.startswith("PNG and video are exposed")]

    def test_a_film_that_is_all_but_empty_is_told_once(self):
        self.assertEqual(self.lines_about('type = "scale"\nfactor = [1, 1, 1]'), [])
        for warp in ('type = "expression"\nx = "x + sqrt(1.5 - frame)"\ny = "y"\nz = "z"',
                     'type = "scale"\nfactor = [[[1, 1], [2, 1e200]], 1, 1]'):
            with self.subTest(warp=warp):
                (line,) = self.lines_about(warp)
                self.assertIn("misfit.toml: frame 2: ", line)
                self.assertIn("surfels have no place or no area", line)
        (line,) = self.lines_about(look_at="[9, 0, 0]")
        self.assertIn("misfit.toml: frame 1: nothing is visible", line)

    def test_a_mesh_in_other_units_than_the_model_is_told(self):
        for name in ("rest.obj", "rest.1.obj"):
            (self.folder / name).write_text("v 900 0 0\nv 901 0 0\nv 900 1 0\nf 1 2 3\n")
        (line,) = self.lines_about('type = "mesh"\nrest = "rest.obj"\nframes = "rest.#.obj"')
        self.assertIn("misfit.toml: warp[0]: 100 % of the surfels", line)

    def film_check(self, script, frames):
        return subprocess.run([FILM_CHECK, script, frames, VASE / "vase.ply"], capture_output=True, text=True)

    def test_the_film_covers_the_warped_mesh(self):
        self.render("large", "--scale", "2")
        result = self.film_check(self.script, self.folder / "large")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn("3 frames: ", result.stdout)

    def test_the_film_checker_tells_another_warp_and_a_missing_frame(self):
        other = self.folder / "unwarped.toml"
        other.write_text(SCRIPT.replace("40]]", "0]]"))
        self.assertEqual(self.film_check(other, self.folder / "film").returncode, 1)
        self.assertEqual(self.film_check(self.script, self.folder / "nowhere").returncode, 1)

    def test_evaluate_reports_groups_and_baseline(self):
        report = succeed("evaluate", self.model, self.capture, "--baseline", "nearest")
        scores = {"psnr_linear_db", "psnr_srgb_db", "ssim_srgb"}
        self.assertGreater(report["exposure"], 0)
        self.assertLessEqual(scores, set(report))
        self.assertLessEqual(scores, set(report["baseline"]))
        self.assertEqual(len(report["frames"]), 12)
        for summary in (report, report["baseline"]):
            self.assertLessEqual({"new_camera", "new_light", "new_both"}, set(summary["groups"]))
        for frame in report["frames"]:
            self.assertLessEqual(scores | {"camera", "light"}, set(frame))

    def test_inspect_counts_views_and_lights(self):
        self.assertEqual(succeed("inspect", self.model)["views"], 3)
        self.assertEqual(succeed("inspect", self.model)["lights"], 3)
        self.assertEqual(succeed("inspect", self.capture)["training_frames"], 9)


if __name__ == "__main__":
    unittest.main()
