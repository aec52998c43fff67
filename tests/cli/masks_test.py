"""Photographs without masks become models by `surflect import --mask-from`; wrong masks are answered in one line."""

import os
import subprocess
import unittest

from png import read_png
from support import VASE, TestInFolder, run, succeed


class Masks(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        subprocess.run([os.environ["WRITE_FOREIGN_CAPTURES"], VASE, cls.folder], check=True)
        cls.table, cls.screen = cls.folder / "before-table", cls.folder / "before-screen"
        cls.truth = cls.folder / "truth"
        succeed("import", cls.folder / "colmap-text", "-o", cls.truth, "--test-every", 4)

    def score(self, capture):
        """Error of a small model of the capture against photographs with true masks, in dB."""
        model = self.folder / f"{capture.name}.srf"
        packed = succeed("pack", capture, "-o", model, "--surfels", 5000)
        self.assertEqual(packed["findings"], [])
        return succeed("evaluate", model, self.truth)["psnr_srgb_db"]

    def overlaps(self, masks, truths):
        """Intersection over union of each mask with the object's alpha."""
        for path in sorted(masks.rglob("*.png")):
            pairs = [(a[0] > 127, b[0] > 127) for a, b in zip(read_png(path), read_png(truths / path.name))]
            yield sum(a and b for a, b in pairs) / sum(a or b for a, b in pairs)

    def test_photographs_without_masks_become_a_model(self):
        best = self.score(self.truth)
        for name, source, how, least in (("plate", self.table, f"plate:{self.table / 'plates'}", 0.98),
                                         ("key", self.screen, "key", 0.985),
                                         ("mesh", self.table, "mesh", 0.994)):
            with self.subTest(how=name):
                out = self.folder / name
                mesh = ["--mesh", VASE / "vase.ply"] if how == "mesh" else []
                report = succeed("import", source, "-o", out, "--test-every", 4, "--mask-from", how, *mesh)
                self.assertEqual(report["masks"], 12)
                self.assertEqual([note for note in report["notes"] if note.startswith("warning")], [])
                self.assertGreater(min(self.overlaps(out / "masks", source / "truth")), least)
                self.assertGreater(self.score(out), best - 0.03)

    def test_what_cannot_be_a_mask_is_one_line(self):
        empty = self.folder / "empty"
        empty.mkdir()
        for how, said in ((f"plate:{empty}", "found no picture, expected plates"),
                          (f"plate:{self.screen / 'plates'}", "none of 12 views could be segmented"),
                          (f"plate:{self.folder / 'none.png'}", "found none, expected a picture"),
                          ("key:0,0,255", "less than 20 % of its border have the key colour"),
                          ("mesh", "found none, expected one mesh")):
            with self.subTest(how=how):
                result = run("import", self.table, "-o", self.folder / "refused", "--mask-from", how)
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertIn(said, result.stderr.splitlines()[-1])
                self.assertFalse((self.folder / "refused").exists())

    def test_wrong_words_are_wrong_usage(self):
        for how in ("plates", "plate", "key:#12345", "key:red", "brightness:2", "mesh:object.ply"):
            with self.subTest(how=how):
                result = run("import", self.table, "-o", self.folder / "refused", "--mask-from", how)
                self.assertEqual(result.returncode, 2)
                self.assertIn("--mask-from", result.stderr)


if __name__ == "__main__":
    unittest.main()
