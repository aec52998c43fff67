"""A capture of one camera without geometry: `surflect pack` makes a plane or a relief, `evaluate` compares it with both
baselines."""

import json
import unittest

from support import CAT, TestInFolder, run, succeed


class OneView(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.report = cls.pack("model.srf")

    @classmethod
    def pack(cls, name, *options):
        return succeed("pack", CAT, "-o", cls.folder / name, "--surfels", "8000", *options)

    def test_the_report_names_the_geometry(self):
        self.assertEqual(self.report["geometry"], "plane")
        self.assertEqual(self.pack("relief.srf", "--relief")["geometry"], "relief")

    def test_lights_over_plaster_are_blended_by_a_plane(self):
        blend = self.report["light_blend"]
        self.assertEqual(blend["fit"], "plane")
        self.assertGreater(blend["left_out_srgb_db"], 24)
        manifest = json.loads((self.folder / "model.srf/manifest.json").read_text())
        self.assertEqual(manifest["light_blend"], {"lights": blend["lights"], "fit": "plane", "foreshortened": blend["foreshortened"]})
        by = {name: succeed("evaluate", self.folder / "model.srf", CAT, *options)["psnr_srgb_db"]
              for name, options in {"model": [], "plane": ["--light-fit", "plane"], "mean": ["--light-fit", "mean"],
                                    "lights": ["--lights", "3"]}.items()}
        self.assertEqual(by["model"], by["plane"])
        self.assertNotEqual(by["model"], by["mean"])
        self.assertNotEqual(by["model"], by["lights"])

    def test_relief_and_mesh_exclude_each_other(self):
        result = run("pack", CAT, "-o", self.folder / "both.srf", "--relief", "--mesh", "cat.ply")
        self.assertEqual(result.returncode, 2)
        self.assertIn("--relief", result.stderr)

    def test_baselines_are_those_asked_for(self):
        keys = {"nearest": {"baseline"}, "lambert": {"baseline_lambert"},
                "lambert,nearest": {"baseline", "baseline_lambert"}}
        for names, wanted in keys.items():
            with self.subTest(names=names):
                report = succeed("evaluate", "--baseline", names, self.folder / "model.srf", CAT)
                for entry in (report, *report["frames"]):
                    self.assertEqual({key for key in entry if key.startswith("baseline")}, wanted)
                    for key in wanted:
                        self.assertGreater(entry[key]["psnr_srgb_db"], 15)

    def test_the_lambert_baseline_does_not_bend(self):
        script = self.folder / "warp.toml"
        script.write_text('[[warp]]\ntype = "rigid"\nangle_deg = 10\n')
        result = run("evaluate", self.folder / "model.srf", CAT, "--baseline", "lambert", "--script", script)
        self.assertEqual(result.returncode, 1)
        self.assertIn("does not bend", result.stderr)


if __name__ == "__main__":
    unittest.main()
