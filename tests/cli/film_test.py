"""A film's finish: exposure, background and tone of `surflect render`, and films as files, read by ffprobe and ffmpeg."""

import json
import math
import os
import re
import resource
import struct
import subprocess
import unittest

from exr import read_exr, read_header
from png import read_png, write_png
from support import SCRIPT, SURFLECT, TestInFolder, content, run, succeed

SUN = '[[light]]\ntype = "directional"\ndirection = [1, -1, 1]\n'
GREY = "background = [0.5, 0.5, 0.5]"
WIDTH, HEIGHT = 120, 90
# A view whose colours are powers of linear light.
CONFIGURATION = """ocio_profile_version: 1
roles: {scene_linear: lin, default: lin}
displays:
  screen:
    - !<View> {name: film, colorspace: film}
colorspaces:
  - !<ColorSpace> {name: lin}
  - !<ColorSpace>
    name: film
    from_reference: !<ExponentTransform> {value: [POWER, POWER, POWER, 1]}
"""


def decibels(a, b):
    """PSNR of two lists of pixels, codes 0 to 255, over red, green and blue."""
    errors = [(p - q) ** 2 for x, y in zip(a, b, strict=True) for p, q in zip(x[:3], y[:3])]
    return 10 * math.log10(255 ** 2 * len(errors) / max(sum(errors), 1e-9))


def decoded(film, channels=3, size=(WIDTH, HEIGHT)):
    """The pixels of each frame, by ffmpeg."""
    raw = subprocess.run(["ffmpeg", "-v", "error", "-i", film, "-vf", "scale=in_color_matrix=bt709:flags=accurate_rnd+full_chroma_int",
                          "-f", "rawvideo", "-pix_fmt", "rgba" if channels == 4 else "rgb24", "-"], capture_output=True, check=True).stdout
    frame = size[0] * size[1] * channels
    return [[tuple(raw[at + channels * i:at + channels * (i + 1)]) for i in range(size[0] * size[1])]
            for at in range(0, len(raw), frame)]


def probed(film):
    report = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", film],
                            capture_output=True, check=True).stdout
    return json.loads(report)["streams"][0]


def linear(code):
    x = code / 255
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


def srgb(light):
    light = min(max(light, 0), 1)
    return 255 * (12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055)


class Film(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=3, lights=2, coarse=True)
        succeed("pack", cls.capture, "-o", cls.model, "--surfels", "20000", "--tables", "off")

    @classmethod
    def script_with(cls, name, output="", camera=""):
        script = cls.folder / f"{name}.toml"
        script.write_text(SCRIPT.replace('"depth", ', "").replace("png = true", f"png = true\n{output}").replace("fov_deg = 32", f"fov_deg = 32\n{camera}"))
        return script

    def render(self, name, output="", camera="", options=()):
        """The report, and the folder of the frames."""
        return succeed("render", self.script_with(name, output, camera), "-o", self.folder / name, *options), self.folder / name

    def test_stops_of_exposure_are_powers_of_two_in_the_exr(self):
        _, plain = self.render("plain")
        report, exposed = self.render("exposed", camera='exposure = "2*frame - 3"')
        self.assertEqual([frame["exposure_stops"] for frame in report["frames"]], [-1, 1, 3])
        self.assertNotIn("automatic_exposure_stops", report)
        smallest = 2 ** -13  # half floats below this have fewer digits at -1 stops
        compared = 0
        for frame, factor in ((1, 0.5), (2, 2), (3, 8)):
            name = f"frame.{frame:02}.exr"
            before, after = self.halves(plain / name), self.halves(exposed / name)
            self.assertIn(b"surflect.exposure", (exposed / name).read_bytes())
            self.assertNotIn(b"surflect.exposure", (plain / name).read_bytes())
            self.assertEqual(before["A"], after["A"])
            self.assertEqual(before["camera_blend.R"], after["camera_blend.R"])
            for channel in "RGB":
                for was, is_now in zip(before[channel], after[channel]):
                    if was == 0 or was > smallest:
                        self.assertEqual(is_now, factor * was)
                        compared += was > 0
        self.assertGreater(compared, 5000)

    def halves(self, path):
        """Channels of a frame: all in half floats, as the scripts ask for no depth."""
        return read_exr(path)[2]

    def test_one_is_white_at_a_given_exposure(self):
        _, folder = self.render("given", camera="exposure = 0")
        values, shown = self.halves(folder / "frame.02.exr"), read_png(folder / "frame.02.png")
        for i, pixel in enumerate(shown):
            alpha = values["A"][i]
            if alpha > 0.5:
                for c, channel in enumerate("RGB"):
                    self.assertAlmostEqual(pixel[c], srgb(values[channel][i] / alpha), delta=1.01)

    def test_the_automatic_exposure_is_said_and_can_be_fixed(self):
        script = self.script_with("automatic")
        result = run("render", script, "-o", self.folder / "automatic")
        stops, = re.findall(r"\[camera\] exposure = (-?\d+\.\d{3}) fixes it", result.stderr)
        _, fixed = self.render("fixed", camera=f"exposure = {stops}")
        for frame in (1, 2, 3):
            was, is_now = (read_png(folder / f"frame.{frame:02}.png") for folder in (self.folder / "automatic", fixed))
            self.assertGreater(decibels(was, is_now), 55)

    def test_lamps_of_other_strengths_look_other_at_a_given_exposure(self):
        means = []
        for intensity in (3, 30, 300):
            script = self.script_with(f"lit{intensity}", camera="exposure = -2")
            script.write_text(script.read_text().replace("intensity = 30", f"intensity = {intensity}").replace(SUN, ""))
            succeed("render", script, "-o", self.folder / f"lit{intensity}", "--frames", "2")
            pixels = [p for p in read_png(self.folder / f"lit{intensity}/frame.02.png") if p[3] > 0]
            means.append(sum(map(sum, (p[:3] for p in pixels))) / len(pixels))
        self.assertLess(1.2 * means[0], means[1])
        self.assertLess(1.2 * means[1], means[2])

    def test_a_background_lies_behind_by_alpha(self):
        _, clear = self.render("clear", camera="exposure = 1")
        _, grey = self.render("grey", GREY, camera="exposure = 1")
        edges = 0
        for over, under in zip(read_png(grey / "frame.02.png"), read_png(clear / "frame.02.png"), strict=True):
            alpha = under[3] / 255
            self.assertEqual(len(over), 3)
            edges += 0 < alpha < 1
            for c in range(3):
                wanted = srgb(alpha * linear(under[c]) + (1 - alpha) * linear(127.5))
                self.assertAlmostEqual(over[c], wanted, delta=1 if alpha in (0, 1) else 3)  # alpha has 8 bits
        self.assertGreater(edges, 60)

    def test_a_picture_behind_keeps_its_bytes(self):
        rows = [[(3 * x % 256, 5 * y % 256, (x * y) % 256, 255) for x in range(WIDTH)] for y in range(HEIGHT)]
        write_png(self.folder / "sky.png", rows)
        _, folder = self.render("sky", 'background = "sky.png"\ntone = "filmic"')
        alpha = self.halves(folder / "frame.02.exr")["A"]
        shown, behind = read_png(folder / "frame.02.png"), sum(rows, [])
        for i in range(WIDTH * HEIGHT):
            if alpha[i] == 0:
                self.assertEqual(shown[i], behind[i][:3])
        rows[0][0] = (9, 9, 9, 255)
        write_png(self.folder / "sky.png", rows)
        report, folder = self.render("sky", 'background = "sky.png"\ntone = "filmic"', options=["--resume"])
        self.assertEqual(len(report["frames"]), 3)  # another picture behind
        self.assertEqual(read_png(folder / "frame.02.png")[0], (9, 9, 9))

    def check_tags(self, stream, frames, rate, pixels):
        self.assertEqual((int(stream["nb_read_frames"]), stream["r_frame_rate"], stream["pix_fmt"]), (frames, rate, pixels))
        self.assertEqual([stream.get(f"color_{key}") for key in ("space", "primaries", "transfer", "range")],
                         ["bt709", "bt709", "iec61966-2-1", "tv"])

    def test_an_mp4_decodes_to_the_pngs(self):
        report, folder = self.render("mp4", f'{GREY}\ntone = "filmic"\nvideo = "film.mp4"')
        film = folder / "film.mp4"
        self.assertEqual(report["video"], str(film))
        self.check_tags(probed(film), 3, "24/1", "yuv420p")
        self.check_frames(film, folder, 38, 29)

    def check_frames(self, film, folder, least, least_at_edges):
        """Bounds of the decibels of frames, and of their outlines, where alpha lies between 0 and 1."""
        for frame, got in enumerate(decoded(film), 1):
            wanted = read_png(folder / f"frame.{frame:02}.png")
            alpha = self.halves(folder / f"frame.{frame:02}.exr")["A"]
            edges = [i for i in range(WIDTH * HEIGHT) if 0.05 < alpha[i] < 0.95]
            whole, outline = decibels(got, wanted), decibels([got[i] for i in edges], [wanted[i] for i in edges])
            self.assertGreater(whole, least)
            self.assertGreater(outline, least_at_edges)

    def test_a_mov_decodes_to_the_pngs(self):
        _, folder = self.render("mov", f'{GREY}\nvideo = "film.mov"')
        self.check_tags(probed(folder / "film.mov"), 3, "24/1", "yuv422p10le")
        self.check_frames(folder / "film.mov", folder, 45, 36)

    def test_a_transparent_mov_keeps_alpha(self):
        _, folder = self.render("alpha", 'video = "film.mov"')
        self.check_tags(probed(folder / "film.mov"), 3, "24/1", "yuva444p12le")
        for frame, got in enumerate(decoded(folder / "film.mov", 4), 1):
            wanted = read_png(folder / f"frame.{frame:02}.png")
            self.assertLessEqual(max(abs(p[3] - q[3]) for p, q in zip(got, wanted)), 2)  # 10 bits of limited range
            over = [[[round(p[3] / 255 * c) for c in p[:3]] for p in pixels] for pixels in (got, wanted)]
            self.assertGreater(decibels(*over), 58)  # the film has 16 bits: PNG and decoder each round to codes

    def test_a_transparent_mp4_is_over_black(self):
        report, folder = self.render("black", 'video = "film.mp4"')
        self.assertEqual(decoded(folder / "film.mp4")[0][0], (0, 0, 0))
        self.assertIn("over black", run("render", self.folder / "black.toml", "-o", folder, "--resume").stderr)

    def test_odd_sides_repeat_their_last_line(self):
        script = self.script_with("odd", f'{GREY}\nvideo = "film.mp4"')
        script.write_text(script.read_text().replace("[120, 90]", "[119, 89]"))
        succeed("render", script, "-o", self.folder / "odd", "--frames", "1")
        film = self.folder / "odd/film.1-1.mp4"
        stream = probed(film)
        self.assertEqual((stream["width"], stream["height"]), (120, 90))
        self.assertTrue(all(abs(c - 128) < 3 for c in decoded(film)[0][-1]))

    def test_a_part_of_a_film_never_takes_the_place_of_the_whole(self):
        video = f'{GREY}\nvideo = "film.mp4"'
        report, folder = self.render("parts", video, options=["--frames", "2-3"])
        self.assertEqual(report["video"], str(folder / "film.2-3.mp4"))
        self.assertEqual(probed(folder / "film.2-3.mp4")["nb_read_frames"], "2")
        self.assertFalse((folder / "film.mp4").exists())
        report, _ = self.render("parts", video, options=["--resume"])
        self.assertEqual(([frame["frame"] for frame in report["frames"]], probed(folder / "film.mp4")["nb_read_frames"]), ([1], "3"))
        _, whole = self.render("whole", video)
        self.assertEqual(decoded(folder / "film.mp4"), decoded(whole / "film.mp4"))
        before = (folder / "film.mp4").read_bytes()
        report, _ = self.render("parts", video, options=["--every", "2"])
        self.assertEqual(report["video"], str(folder / "film.1-3x2.mp4"))
        stream = probed(folder / "film.1-3x2.mp4")
        self.assertEqual((stream["nb_read_frames"], stream["r_frame_rate"]), ("2", "12/1"))
        self.assertEqual((folder / "film.mp4").read_bytes(), before)

    def test_a_video_of_an_earlier_run_is_told(self):
        script = self.script_with("stale", 'video = "film.mov"')
        result = run("render", script, "-o", self.folder / "stale", "--no-video")
        self.assertNotIn("film.mov", result.stderr)
        succeed("render", script, "-o", self.folder / "stale", "--resume")
        result = run("render", script, "-o", self.folder / "stale", "--no-video")
        self.assertIn(f"{self.folder}/stale/film.mov: of an earlier run", result.stderr)
        result = run("render", script, "-o", self.folder / "stale", "--no-video", "--resume")
        self.assertNotIn("film.mov", result.stderr)  # it has these frames

    def test_a_video_has_the_rate_of_its_headers(self):
        script = self.script_with("rated", 'video = "film.mp4"')
        script.write_text(script.read_text().replace("last = 3", "last = 3\nfps = 23.98"))
        succeed("render", script, "-o", self.folder / "rated")
        self.assertEqual(probed(self.folder / "rated/film.mp4")["r_frame_rate"], "24000/1001")
        kind, value = read_header(self.folder / "rated/frame.01.exr")[0]["framesPerSecond"]
        self.assertEqual((kind, struct.unpack("<iI", value)), ("rational", (24000, 1001)))

    def test_a_blurred_film_with_a_shadow_has_all_its_files(self):
        maps, tables = 'maps = ["normal", "height", "albedo"]', "[ground]\npoint = [0, 0, -1]\nshadow = 0.7\n"
        _, plain = self.render("sharp", maps, "exposure = -1")
        blurred = self.script_with("blurred", f'{maps}\n{GREY}\nvideo = "film.mov"\nsamples = 4', "exposure = -1\nshutter_deg = 180\naperture = 0.1")
        blurred.write_text(blurred.read_text() + tables)
        report, folder = succeed("render", blurred, "-o", self.folder / "blurred"), self.folder / "blurred"
        self.assertEqual(len(report["frames"]), 3)
        names = sorted(name for name in content(folder) if re.fullmatch(r"frame\.\d\d\.\w+\.png", name))
        self.assertEqual(len(names), 9)
        for name in names:
            self.assertEqual(read_png(folder / name), read_png(plain / name), name)
        for frame, got in enumerate(decoded(folder / "film.mov"), 1):
            shown = read_png(folder / f"frame.{frame:02}.png")
            self.assertGreater(decibels(got, shown), 45)
            darkened = sum(max(pixel) < 120 and a == 0 for pixel, a in zip(shown, self.halves(plain / f"frame.{frame:02}.exr")["A"]))
            self.assertGreater(darkened, 100)
        before = content(folder)
        report = succeed("render", blurred, "-o", folder, "--resume", "--no-video")
        self.assertEqual(report["frames"], [])
        self.assertEqual(content(folder), before)

    def test_another_configuration_of_colours_renders_a_film_anew(self):
        script, env = self.script_with("colours", 'tone = "ocio"'), {**os.environ, "OCIO": str(self.folder / "config.ocio")}

        def rendered(power):
            (self.folder / "config.ocio").write_text(CONFIGURATION.replace("POWER", str(power)))
            result = subprocess.run([SURFLECT, "render", script, "-o", self.folder / "colours", "--resume", "--json", "--frames", "2"],
                                    capture_output=True, text=True, env=env, timeout=300)
            self.assertEqual(result.returncode, 0, result.stderr)
            return len(json.loads(result.stdout)["frames"]), read_png(self.folder / "colours/frame.02.png")

        (first, before), (same, kept), (other, after) = rendered(0.5), rendered(0.5), rendered(0.25)
        self.assertEqual((first, same, other), (1, 0, 1))
        self.assertEqual(before, kept)
        self.assertNotEqual(before, after)

    def with_path(self, path, *arguments, **options):
        return subprocess.run([SURFLECT, *map(str, arguments)], capture_output=True, text=True, timeout=300,
                              env={**os.environ, "PATH": str(path)}, **options)

    def test_without_ffmpeg_a_video_is_refused_before_anything_is_rendered(self):
        script = self.script_with("lacking", 'video = "film.mp4"')
        result = self.with_path("", "render", script, "-o", self.folder / "lacking")
        self.assertEqual((result.returncode, result.stderr),
                         (1, f"surflect: {script}: output.video: needs ffmpeg, which is not installed (apt install ffmpeg); "
                             "--no-video renders the frames alone\n"))
        self.assertFalse((self.folder / "lacking").exists())
        result = self.with_path("", "render", script, "-o", self.folder / "lacking", "--no-video")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(len(content(self.folder / "lacking")), 6)

    def test_an_encoder_that_fails_leaves_no_part_of_a_film(self):
        script, programs = self.script_with("failing", 'video = "film.mp4"'), self.folder / "programs"
        programs.mkdir()
        for ending, said in (("kill -9 $$", "ffmpeg (has ended before the film|could not encode the film)"),
                             ("cat > /dev/null; echo no room >&2; exit 1", r"ffmpeg could not encode the film \(no room\)"),
                             ("echo broken >&2; exit 3", r"ffmpeg (has ended before|could not encode) the film \(broken\)")):
            (programs / "ffmpeg").write_text(f"#!/bin/sh\n{ending}\n")
            (programs / "ffmpeg").chmod(0o755)
            result = self.with_path(f"{programs}:/usr/bin:/bin", "render", script, "-o", self.folder / "failing", "--resume")
            self.assertEqual(result.returncode, 1)
            self.assertRegex(result.stderr.splitlines()[-1], f"^surflect: {self.folder}/failing/film.mp4: {said}$")
            self.assertEqual(len(content(self.folder / "failing")), 6)  # the frames

    def test_a_full_disk_leaves_no_part_of_a_film(self):
        script = self.script_with("full", f'{GREY}\nvideo = "film.mp4"')
        succeed("render", script, "-o", self.folder / "full", "--no-video")
        limit = 2000
        result = subprocess.run([SURFLECT, "render", script, "-o", self.folder / "full", "--resume"], capture_output=True, text=True,
                                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("/full/film.mp4: ffmpeg could not encode the film", result.stderr)
        self.assertEqual(len(content(self.folder / "full")), 6)

    def test_what_is_not_there_is_refused_before_anything_is_rendered(self):
        write_png(self.folder / "tall.png", [[(0, 0, 0, 255)] * 3] * 4)
        for lines, said in (('background = "tall.png"', "found 3 x 4, expected a picture of the frames' shape, 120 x 90"),
                            ('background = "nothing.png"', "cannot open"), ('tone = "ocio"', "output.tone: \"ocio\" needs")):
            result = run("render", self.script_with("refused", lines), "-o", self.folder / "refused")
            self.assertEqual(result.returncode, 1)
            self.assertIn(said, result.stderr)
            self.assertEqual(len(result.stderr.splitlines()), 1)
            self.assertFalse((self.folder / "refused").exists())


if __name__ == "__main__":
    unittest.main()
