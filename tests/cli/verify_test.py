"""`surflect verify`: exit codes, its report and its page."""

import json
import unittest

from support import ROOT, SCRIPT, TestInFolder, run, succeed


class Verify(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=6, lights=5)
        succeed("pack", cls.capture, "-o", cls.model, "--surfels", "20000")

    # A small rig leaves much of the vase without a camera.
    LENIENT = ["--bound", "coverage=100", "--bound", "exact_pictures=10", "--bound", "unseen=100",
               "--bound", "views_extrapolated=100", "--bound", "lights_extrapolated=100",
               "--bound", "shadows_unmatched=100"]

    def test_a_model_within_bounds_exits_with_0(self):
        report = succeed("verify", self.model, self.script, "--capture", self.capture, "--photographs", 4, *self.LENIENT)
        self.assertEqual(report["out_of_bounds"], 0)
        self.assertEqual([frame["frame"] for frame in report["frames"]], [1, 2, 3])
        self.assertEqual(len(report["photographs"]), 4)
        names = [check["name"] for check in report["model"]]
        page = (ROOT / "docs" / "stability.md").read_text()
        for check in report["model"] + report["exactness"] + report["frames"][0]["checks"]:
            self.assertIn(f"| `{check['name']}` |", page)
        self.assertIn("block_error", names)
        for check in report["model"] + report["exactness"]:
            self.assertIn(check["verdict"], ("kept", "stated", "inapplicable"))

    def test_a_broken_bound_exits_with_1_and_its_report_says_where(self):
        self.script.write_text(SCRIPT + '[[warp]]\ntype = "expression"\nx = "abs(x)"\ny = "y"\nz = "z"\n')
        page = self.folder / "report"
        result = run("verify", self.model, self.script, "--frame", 2, "--photographs", 2, *self.LENIENT, "-o", page,
                     "--json")
        self.script.write_text(SCRIPT)
        self.assertEqual(result.returncode, 1, result.stderr)
        report = json.loads(result.stdout)
        broken = [check for check in report["frames"][0]["checks"] if check["verdict"] == "broken"]
        self.assertIn("folded", [check["name"] for check in broken])
        for check in broken:
            self.assertTrue(check["advice"])
        self.assertEqual(report["error"], result.stderr.splitlines()[-1].removeprefix("surflect: "))
        self.assertIn("frame 2: folded: ", result.stderr)
        html = (page / "index.html").read_text()
        self.assertIn("frame.0002.png", html)
        self.assertTrue((page / "frame.0002.png").exists())
        written = json.loads((page / "verify.json").read_text())
        self.assertEqual(written["out_of_bounds"], report["out_of_bounds"])

    def test_what_it_refuses(self):
        for arguments in ([], [self.model, "--bound", "unseen"], [self.model, "--bound", "unsen=3"],
                          [self.model, "--frames", "0"]):
            self.assertEqual(run("verify", *arguments).returncode, 2, arguments)
        result = run("verify", self.model, self.script, "--frame", 9)
        self.assertEqual(result.returncode, 1)
        self.assertEqual(result.stderr.splitlines()[-1], "surflect: --frame: found 9, expected a frame within 1-3")


if __name__ == "__main__":
    unittest.main()
