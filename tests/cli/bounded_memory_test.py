"""Films of a model larger than memory: `surflect render` gets memory for surfels, a film, the cache and 256 MiB, a limit
that the system enforces, and renders the same films. Where memory is too little for a method, one line says so.
"""

import json
import os
import resource
import subprocess
import unittest

from support import STAGE, SURFLECT, TestInFolder, content, run, succeed

MIB = 1 << 20
SURFELS, VIEWS, CACHE_MB, SIZE = 20_000, 48, 8, (512, 384)
# Once around it, so that all views are asked for.
FILM = f"""
model = "doll.srf"
[frames]
first = 1
last = 6
[output]
size = [{SIZE[0]}, {SIZE[1]}]
path = "frame.#.exr"
[camera]
orbit = {{ center = [0, 0, 0.5], radius = 4, azimuth_deg = "60*frame", elevation_deg = 25 }}
up = [0, 0, 1]
fov_deg = 18
[[light]]
type = "point"
position = [2, -2, 3]
intensity = 12
[[light]]
type = "directional"
direction = [-1, 1, 1]
"""


class BoundedMemory(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        model, cls.script = cls.folder / "doll.srf", cls.folder / "film.toml"
        subprocess.run([os.environ["WRITE_DOLL_MODEL"], model, str(SURFELS), str(VIEWS)], check=True)
        cls.script.write_text(FILM)
        surfels = SURFELS * (12 + 12 + 4 + 4 + VIEWS)
        film = SIZE[0] * SIZE[1] * 4 * 4
        cls.allowed = surfels + film + CACHE_MB * MIB + 256 * MIB
        cls.model_bytes = sum(path.stat().st_size for path in model.rglob("*") if path.is_file())
        cls.report = succeed("render", cls.script, "-o", cls.folder / "whole", "--cache-mb", 4096, "--threads", 2)
        cls.film = content(cls.folder / "whole")

    def render(self, name, *options):
        """`surflect` under the limit: all that it may write to and is not shared, touched or not."""
        def limit():
            resource.setrlimit(resource.RLIMIT_DATA, (self.allowed, self.allowed))

        arguments = ["render", self.script, "-o", self.folder / name, "--threads", "2", *options]
        return subprocess.run([SURFLECT, *map(str, arguments)], capture_output=True, text=True, timeout=300,
                              preexec_fn=limit)

    def test_the_model_is_larger_than_memory(self):
        self.assertGreater(self.model_bytes, self.allowed)

    def test_a_film_needs_no_more_than_its_cache_and_stays_the_same(self):
        bounded = self.render("bounded", "--cache-mb", str(CACHE_MB))
        self.assertEqual(bounded.returncode, 0, bounded.stderr)
        self.assert_same_files(content(self.folder / "bounded"), self.film)
        self.assertGreater(self.report["memory_peak_bytes"], self.allowed)

    def test_a_cache_that_is_too_large_ends_in_one_line(self):
        failed = self.render("failed", "--cache-mb", "4096")
        self.assertEqual(failed.returncode, 1)
        self.assertRegex(failed.stderr, r"\Asurflect: [^\n]*out of memory[^\n]*\n\Z")
        written = content(self.folder / "failed")
        self.assertLess(len(written), len(self.film))
        for name, frame in written.items():
            self.assertEqual(frame, self.film[name], name)


class LittleAddressSpace(TestInFolder):
    """All methods under `ulimit -v 600000`, and a build that cannot fit."""

    MODELS = {"slf": [], "lumigraph": ["--texels", "100000"], "lfm": [], "vdtm": [], "ulr": [], "olfm": [],
              "spherical": ["--levels", "2", "--size", "32"]}

    def limited(self, *arguments):
        def limit():
            resource.setrlimit(resource.RLIMIT_AS, (600_000 * 1024, 600_000 * 1024))

        return subprocess.run([SURFLECT, *map(str, arguments), "--threads", "2"], capture_output=True, text=True,
                              timeout=300, preexec_fn=limit)

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        stage, cls.capture = cls.folder / "stage.toml", cls.folder / "capture"
        stage.write_text(STAGE.replace('model = "orthographic"', 'model = "pinhole"').replace("height = 2.2", "fov_deg = 27")
                         .replace("count = 16\ntest = 2", "count = 1"))
        succeed("capture", stage, "-o", cls.capture)

    def test_a_lumigraph_that_cannot_fit_is_refused_before_work(self):
        result = self.limited("pack", self.capture, "--method", "lumigraph", "--st", "45", "--texels", 2**33, "-o",
                              self.folder / "out")
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"surflect: texels 8589934592 and st 45: needs [0-9.]+ GiB ")

    def test_each_method_works_or_says_that_memory_is_too_little(self):
        for method, options in self.MODELS.items():
            model, again = self.folder / method, self.folder / f"{method}-again"
            succeed("pack", self.capture, "--method", method, "-o", model, *options)
            for command in (["pack", self.capture, "--method", method, "-o", again, *options],
                            ["evaluate", model, self.capture],
                            ["render", model, "-o", self.folder / "frames", "--frames", "1"]):
                with self.subTest(method=method, command=command[0]):
                    result = self.limited(*command)
                    self.assertIn(result.returncode, (0, 1), result.stderr)
                    if result.returncode == 1:
                        self.assertRegex(result.stderr, r"surflect: [^\n]*(memory|unavailable|does not fit)[^\n]*\n\Z")


class ManyLightsAndObjects(TestInFolder):
    def test_lights_cost_no_memory_and_are_announced(self):
        subprocess.run([os.environ["WRITE_DOLL_MODEL"], self.folder / "doll.srf", "3000", "8"], check=True)
        peaks = []
        for lights in (2, 2000):
            script = self.folder / f"{lights}.toml"
            lamp = FILM[FILM.index("[[light]]"):]
            script.write_text(FILM[:FILM.index("[[light]]")] + lamp * (lights // 2))
            result = run("render", script, "-o", self.folder / str(lights), "--frames", "1", "--scale", "0.25", "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual("2000 lights: each is looked up at every visible surfel" in result.stderr, lights == 2000)
            peaks.append(json.loads(result.stdout)["memory_peak_bytes"])
        self.assertLess(peaks[1], peaks[0] + 200 * MIB)


if __name__ == "__main__":
    unittest.main()
