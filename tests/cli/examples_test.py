"""Every script in examples/ renders from small models of the captures there."""

import json
import re
import shutil
import subprocess
import unittest

from png import shares
from support import CAT, FILM_CHECK, ROOT, VASE, TestInFolder, succeed, write_small_capture

EXAMPLES = ROOT / "examples"
SCRIPTS = sorted(path.relative_to(EXAMPLES) for path in EXAMPLES.rglob("*.toml")
                 if path.parent.name != "stages")
EVERY, SCALE = 30, 0.4  # frames 1 and 31


def write_small_doll(folder):
    """Every fourth camera and light of the doll."""
    shutil.copytree(EXAMPLES / "doll", folder)
    capture = json.loads((folder / "transforms.json").read_text())
    capture["frames"] = [frame for frame in capture["frames"] if frame["split"] == "train" and
                         int(frame["camera"][1:]) % 4 == 0 and int(frame["light"][1:]) % 4 == 0]
    (folder / "transforms.json").write_text(json.dumps(capture))


class Examples(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        # Scripts find their models and pictures where they find them in the repository.
        shutil.copytree(EXAMPLES, cls.folder / "examples", ignore=shutil.ignore_patterns("vase", "cat", "doll"))
        models = cls.folder / "build" / "demo"
        models.mkdir(parents=True)
        write_small_capture(cls.folder / "capture", cameras=4, lights=6)
        succeed("pack", cls.folder / "capture", "-o", models / "vase.srf", "--surfels", "30000", "--tables", "off")
        write_small_doll(cls.folder / "doll")
        succeed("pack", cls.folder / "doll", "-o", models / "doll.srf", "--surfels", "30000", "--tables", "off")
        succeed("pack", CAT, "-o", models / "cat.srf", "--relief", "--surfels", "10000", "--tables", "off")
        for script in SCRIPTS:
            succeed("render", cls.folder / "examples" / script, "-o", cls.frames_of(script), "--every", EVERY,
                    "--scale", SCALE)

    @classmethod
    def frames_of(cls, script):
        return cls.folder / "frames" / script.with_suffix("")

    def test_there_is_a_script_for_each_warp_of_the_documentation(self):
        scripts = "".join((EXAMPLES / script).read_text() for script in SCRIPTS)
        section = (ROOT / "docs" / "script.md").read_text().partition("\n## [[warp]]\n")[2].partition("\n### ")[0]
        table = re.search(r"^\| type \|.*\n\|[-|]+\|\n((?:\|.*\n)+)", section, re.MULTILINE)[1]
        warps = re.findall(r'^\| `"(\w+)"`', table, re.MULTILINE)
        self.assertEqual(len(warps), 11)
        self.assertEqual([warp for warp in warps if f'type = "{warp}"' not in scripts], [])

    def test_the_page_of_the_doll_counts_right(self):
        page, doll = (EXAMPLES / "doll/README.md").read_text(), EXAMPLES / "doll"
        frames = json.loads((doll / "transforms.json").read_text())["frames"]
        trained = [frame for frame in frames if frame["split"] == "train"]
        cameras, lights = ({frame[key] for frame in trained} for key in ("camera", "light"))
        header = (doll / "doll.ply").read_bytes().partition(b"end_header")[0].decode()
        self.assertEqual(len(trained), len(cameras) * len(lights))
        for said in (f"{len(cameras)} cameras x {len(lights)} lights", f"{len(frames) - len(trained)}\nheld-out photographs",
                     "{} vertices, {} triangles".format(*re.findall(r"element \w+ (\d+)", header))):
            self.assertIn(said, page)
        self.assertLess(sum(path.stat().st_size for path in doll.rglob("*.*")), 12e6)

    def test_frames_are_lit_and_opaque(self):
        for script in SCRIPTS:
            with self.subTest(script=str(script)):
                covered, opaque, lit = shares(max(self.frames_of(script).glob("*.png")))
                self.assertTrue(0.05 < covered < 0.7)
                self.assertGreater(opaque, 0.9)
                self.assertGreater(lit, 0.5)

    def test_the_vase_covers_its_warped_mesh(self):
        for script in SCRIPTS:
            if 'vase.srf"' not in (EXAMPLES / script).read_text():
                continue
            with self.subTest(script=str(script)):
                path = self.folder / "examples" / script
                result = subprocess.run([FILM_CHECK, path, self.frames_of(script), VASE / "vase.ply", str(EVERY)],
                                        capture_output=True, text=True)
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


if __name__ == "__main__":
    unittest.main()
