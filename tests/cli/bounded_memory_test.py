"""Films of a model larger than memory: `surflect render` gets memory for surfels, a film, the cache and 256 MiB, a limit
that the system enforces, and renders the same films.
"""

import os
import resource
import subprocess
import unittest

from support import SURFLECT, TestInFolder, content, succeed

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


if __name__ == "__main__":
    unittest.main()
