"""`surflect relight`: views under fixed light that pack and evaluate read, what it reports, and what it refuses."""

import json
import shutil
import signal
import subprocess
import time
import unittest

from support import STAGE, SURFLECT, TestInFolder, content, run, succeed

LIGHTS = """
[[light]]
type = "directional"
direction = {direction}
color = [3, 6, 1.5]
[[light]]
type = "point"
position = ["3*cos(frame)", "3*sin(frame)", 2]
intensity = 20
"""


class Relight(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.capture, cls.lights = cls.folder / "capture", cls.folder / "lights.toml"
        (cls.folder / "stage.toml").write_text(STAGE)
        succeed("capture", cls.folder / "stage.toml", "-o", cls.capture)
        cls.rig = json.loads((cls.capture / "transforms.json").read_text())
        cls.lights.write_text(LIGHTS.format(direction=cls.rig["lights"][0]["direction"]))
        cls.report = succeed("relight", cls.capture, "--lights", cls.lights, "--frame", "2", "-o",
                             cls.folder / "views")

    def assert_refused(self, said, *arguments):
        result = run("relight", *arguments)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"^surflect: [^\n]+\n$")
        self.assertIn(said, result.stderr)

    def test_the_report_counts_views_and_lists_weights(self):
        self.assertEqual((self.report["training_views"], self.report["test_views"]), (16, 2))
        weights = {entry["light"]: entry["weight"] for entry in self.report["weights"]}
        self.assertIn(len(weights), (3, 4))
        self.assertGreaterEqual(weights[self.rig["lights"][0]["name"]], [1, 2, 0.5])

    def test_the_views_are_a_capture_under_fixed_light_with_the_same_hold_outs(self):
        views = json.loads((self.folder / "views" / "transforms.json").read_text())
        self.assertNotIn("lights", views)
        held_out = {camera for camera in (frame["camera"] for frame in self.rig["frames"])
                    if all(f["split"] == "test" for f in self.rig["frames"] if f["camera"] == camera)}
        self.assertEqual({frame["camera"] for frame in views["frames"] if frame["split"] == "test"}, held_out)
        model = self.folder / "model.srf"
        succeed("pack", self.folder / "views", "-o", model, "--surfels", "4000", "--tables", "off")
        self.assertEqual(succeed("evaluate", model, self.folder / "views")["frame_count"], 2)

    def test_an_interrupted_run_goes_on_to_the_same_bytes(self):
        target = self.folder / "stopped"
        arguments = ["relight", self.capture, "--lights", self.lights, "--frame", "2", "-o", target]
        process = subprocess.Popen([SURFLECT, *map(str, arguments), "--threads", "1"], stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60
        while not (target / "images").exists() and time.monotonic() < deadline:
            time.sleep(0.001)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate()
        if process.returncode != 0:  # not too late
            self.assertEqual(said.splitlines()[-1], "surflect: interrupted; the same command goes on from here")
            self.assertFalse((target / "transforms.json").exists())
        succeed(*arguments)
        self.assert_same_files(content(target), content(self.folder / "views"))

    def test_what_cannot_be_relit_is_one_line(self):
        other = self.folder / "other.toml"
        other.write_text(LIGHTS.format(direction="[0, 0, 1]"))
        self.assert_refused("other lights", self.capture, "--lights", other, "-o", self.folder / "views")
        out = ["-o", self.folder / "none"]
        self.assert_refused("something there already", self.capture, "--lights", other, "-o", self.capture)
        self.assert_refused("lights: missing", self.folder / "views", "--lights", other, *out)
        for text, said in (("", "light: missing"), ('[[warp]]\ntype = "scale"\nfactor = [1, 1, 2]\n', "warp"),
                           ("[[light]]\ntype = \"lamp\"\n", "light[0].type"), ("[[light]\n", "wrong.toml")):
            with self.subTest(said=said):
                wrong = self.folder / "wrong.toml"
                wrong.write_text(text if "warp" not in text else LIGHTS.format(direction="[0, 0, 1]") + text)
                self.assert_refused(said, self.capture, "--lights", wrong, *out)
        self.assert_refused("none.exr", self.capture, "--environment", self.folder / "none.exr", *out)
        gap = self.folder / "gap"
        shutil.copytree(self.capture, gap)
        frames = [f for f in self.rig["frames"] if (f["camera"], f["light"]) != ("C003", "L00")]
        (gap / "transforms.json").write_text(json.dumps({**self.rig, "frames": frames}))
        self.assert_refused("view C003: no photograph under light L00", gap, "--lights", self.lights, *out)
        self.assertFalse(out[1].exists())
        report = succeed("relight", gap, "--lights", self.lights, "--skip-incomplete", *out)
        self.assertEqual((report["skipped_views"], report["training_views"]), (["C003"], 15))


if __name__ == "__main__":
    unittest.main()
