"""`surflect lightfield`: all kinds of light fields from views, through build, evaluate, render, compare and chart."""

import json
import shutil
import unittest

from support import TestInFolder, content, run, succeed

# A glossy lumpy ball from all sides under one light.
STAGE = """
samples = 16
transport = "direct"
[camera]
model = "pinhole"
size = [48, 48]
distance = 5
fov_deg = 27
[views]
count = 32
test = 4
[lights]
count = 1
irradiance = [3, 3, 3]
[[material]]
name = "glaze"
type = "ward"
diffuse = [0.6, 0.3, 0.2]
specular = [0.1, 0.1, 0.1]
alpha = 0.3
[[object]]
type = "bumpy_sphere"
material = "glaze"
radius = 0.9
amplitude = 0.1
frequency = 4
segments = 48
"""

SCRIPT = """
model = "{model}"
[frames]
first = 1
last = 2
[output]
size = [60, 40]
path = "frame.#.exr"
[camera]
position = ["4 + s", -1, 1]
look_at = [0, 0, 0]
up = [0, 0, 1]
fov_deg = 32
"""


class LightField(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.views = cls.folder / "views"
        (cls.folder / "stage.toml").write_text(STAGE)
        succeed("capture", cls.folder / "stage.toml", "-o", cls.views)
        cls.reports = {
            "slf": succeed("lightfield", "build", "slf", cls.views, "-o", cls.folder / "ball.slf", "--regions", "30"),
            "lumigraph": succeed("lightfield", "build", "lumigraph", cls.views, "-o", cls.folder / "ball.lum", "--like",
                                 cls.folder / "ball.slf", "--st", "5"),
            "lfm": succeed("lightfield", "build", "lfm", cls.views, "-o", cls.folder / "ball.lfm", "--view-size", "12"),
            "spherical": succeed("lightfield", "build", "spherical", cls.views, "-o", cls.folder / "ball.sph", "--levels", "3",
                                 "--size", "64"),
            "vdtm": succeed("lightfield", "build", "vdtm", cls.views, "-o", cls.folder / "ball.vdtm", "--triangles", "1000"),
            "ulr": succeed("lightfield", "build", "ulr", cls.views, "-o", cls.folder / "ball.ulr", "--hull", "--order", "bsp",
                           "--bsp-trees", "2", "--triangles", "3000", "--budget", "1"),
            "olfm": succeed("lightfield", "build", "olfm", cls.views, "-o", cls.folder / "ball.olfm", "--triangles", "1000",
                            "--order", "peel", "--view-size", "12")}
        cls.models = [cls.folder / f"ball.{name}" for name in ("slf", "lum", "lfm", "sph", "vdtm", "ulr", "olfm")]

    def script(self, model, more=""):
        script = self.folder / f"{model.name}.toml"
        script.write_text(SCRIPT.format(model=model) + more)
        return script

    def assert_refused(self, said, *arguments):
        result = run(*arguments)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"(?m)^surflect: [^\n]+\n\Z")
        self.assertIn(said, result.stderr)

    def test_the_reports_count_texels(self):
        slf, lumigraph = self.reports["slf"], self.reports["lumigraph"]
        self.assertEqual(slf["photographs"], 32)
        self.assertLess(slf["atlas"]["redundancy"], 1.3)
        self.assertLessEqual(lumigraph["texels"], slf["texels"])
        self.assertGreater(lumigraph["texels"], 0.9 * slf["texels"])
        self.assertEqual(len(lumigraph["slabs"]), 6)

    def test_the_report_of_light_field_maps_adds_up(self):
        lfm = self.reports["lfm"]
        samples, cells = lfm["samples"] * (lfm["samples"] + 1) // 2, 12 * 12
        self.assertEqual(lfm["resampled_bytes"], 3 * lfm["triangles"] * samples * cells)
        self.assertEqual(lfm["map_bytes"]["mean"], 3 * lfm["triangles"] * samples)
        self.assertLessEqual(lfm["map_bytes"]["surface"], 3 * 3 * lfm["triangles"] * samples)
        self.assertEqual(lfm["map_bytes"]["surface"] % (3 * samples), 0)
        self.assertEqual(lfm["map_bytes"]["view"], 3 * cells * round(lfm["mean_terms"] * lfm["vertices"]))
        self.assertEqual(len(lfm["rms"]), 4)
        self.assertLess(lfm["rms"][3], lfm["rms"][0])
        small = succeed("lightfield", "build", "lfm", self.views, "-o", self.folder / "small.lfm", "--view-size", "12",
                        "--triangles", "60", "--samples", "8", "--terms", "2", "--vq", "4", "--s3tc")
        self.assertLessEqual(small["triangles"], 60)
        self.assertLess(small["map_bytes"]["all"], lfm["map_bytes"]["all"] / 4)

    def test_the_reports_of_opacity_light_fields_add_up(self):
        vdtm, ulr = self.reports["vdtm"], self.reports["ulr"]
        self.assertLessEqual(vdtm["triangles"], 1000)
        self.assertFalse(vdtm["hull"])
        self.assertTrue(ulr["hull"])
        self.assertEqual(ulr["visible_views"], 32)
        self.assertLess(vdtm["visible_views"], 16)
        for report in (vdtm, ulr):
            self.assertEqual(report["views"], 32)
            self.assertEqual(report["packed_bytes"], 8 * 32 * report["view_size"][0] * report["view_size"][1])
        self.assertEqual(vdtm["scale"], 1)
        self.assertLessEqual(ulr["packed_bytes"], 2**20)

    def test_the_report_of_opacity_light_field_maps_adds_up(self):
        olfm = self.reports["olfm"]
        samples, cells = olfm["samples"] * (olfm["samples"] + 1) // 2, 12 * 12
        self.assertLessEqual(olfm["triangles"], 1000)
        self.assertFalse(olfm["hull"])
        self.assertEqual(olfm["views"], 32)
        self.assertEqual(olfm["resampled_bytes"], 4 * olfm["triangles"] * samples * cells)
        self.assertEqual(olfm["map_bytes"]["mean"], 4 * olfm["triangles"] * samples)
        self.assertEqual(olfm["map_bytes"]["view"], 4 * cells * round(olfm["mean_terms"] * olfm["vertices"]))
        self.assertEqual(len(olfm["rms"]), 4)
        self.assertEqual(olfm["rms"], sorted(olfm["rms"], reverse=True))
        small = succeed("lightfield", "build", "olfm", self.views, "-o", self.folder / "small.olfm", "--hull", "--triangles",
                        "200", "--samples", "8", "--terms", "2", "--vq", "4", "--s3tc")
        self.assertTrue(small["hull"])
        self.assertGreater(small["compression"], 4 * olfm["compression"])
        for options in (["--terms", "65"], ["--order", "bsp"], ["--samples", "1"]):
            self.assertEqual(run("lightfield", "build", "olfm", self.views, "-o", self.folder / "none", *options).returncode, 2)

    def test_an_opacity_light_field_takes_plain_lenses_alone(self):
        views = self.folder / "distorted"
        shutil.copytree(self.views, views)
        transforms = json.loads((views / "transforms.json").read_text())
        transforms["k1"] = 0.1
        (views / "transforms.json").write_text(json.dumps(transforms))
        for method in ("vdtm", "olfm"):
            self.assert_refused("k1", "lightfield", "build", method, views, "-o", self.folder / f"none.{method}")

    def test_a_chart_sweeps_the_knobs_of_a_light_field(self):
        report = succeed("chart", self.folder / "ball.lfm", self.views, "--knob", "terms=3,0", "--knob", "samples=2,1",
                         "-o", self.folder / "chart", "--frames", "2", "--timed-frames", "1", "--rounds", "1")
        self.assertEqual(len(report["points"]), 4)
        report = succeed("chart", self.folder / "ball.olfm", self.views, "--knob", "layers=64,1", "--only", "-o",
                         self.folder / "layers", "--frames", "2", "--timed-frames", "1", "--rounds", "1")
        self.assertEqual(len(report["points"]), 2)
        self.assert_refused("samples", "chart", self.folder / "ball.lfm", self.views, "--knob", "samples=9", "-o",
                            self.folder / "none")

    def test_simplified_geometry_is_reported_with_its_ghosts(self):
        rough = succeed("lightfield", "build", "lumigraph", self.views, "-o", self.folder / "rough.lum", "--texels", 100000,
                        "--st", "2", "--triangles", "100")
        errors = rough["depth_errors"]
        self.assertLessEqual(rough["depth_triangles"], 100)
        self.assertTrue(0 < errors["mean"] < errors["worst"] < 2)
        self.assertTrue(0 < errors["mean_offset_texels"] < errors["worst_offset_texels"])
        self.assertIsNone(self.reports["lumigraph"]["depth_errors"])
        self.assertEqual(self.reports["lumigraph"]["black_pictures"], 0)

    def test_held_out_views_are_met_by_every_model(self):
        packed = self.folder / "ball.srf"
        succeed("pack", self.views, "-o", packed, "--surfels", "4000")
        rows = succeed("lightfield", "compare", packed, *self.models, "--views", self.views, "--nearest")["models"]
        scores = [row["psnr_linear_db"] for row in rows]
        self.assertEqual([row["name"] for row in rows], [str(packed), *map(str, self.models), "nearest view"])
        hull = scores.pop(6)  # blurs outlines by the voxels of pictures this small
        self.assertGreater(hull, 22)
        self.assertGreater(min(scores), 25)  # wrong cameras or mirrored textures give less than 20
        self.assertEqual([len(row["frames"]) for row in rows], [4] * len(rows))
        self.assertGreater(rows[1]["passes"], 0)
        self.assertNotIn("bytes", rows[-1])
        self.assert_refused("no nearest view", "lightfield", "compare", self.models[0], "--views", self.views, "--nearest")

    def test_evaluate_and_compare_agree(self):
        for model in self.models:
            evaluated = succeed("evaluate", model, self.views)
            compared = succeed("lightfield", "compare", model, "--views", self.views)["models"][0]
            self.assertEqual(evaluated["psnr_linear_db"], compared["psnr_linear_db"])

    def test_scripts_are_rendered_and_timed(self):
        for model in self.models:
            script = self.script(model)
            succeed("render", script, "-o", self.folder / "film")
            first = content(self.folder / "film")
            succeed("render", script, "-o", self.folder / "film")
            self.assert_same_files(content(self.folder / "film"), first)
            report = succeed("lightfield", "benchmark", script, script, "--rounds", "2")["scripts"][1]
            self.assertEqual(report["frames"], 4)
            self.assertGreater(report["frame_ms"]["least"], 0)

    def test_the_report_of_a_spherical_light_field_adds_up(self):
        spherical = self.reports["spherical"]
        self.assertEqual(spherical["images"], 20 * 4 ** 2)
        self.assertEqual(len(spherical["level_bytes"]), 3)
        self.assertLess(sum(spherical["level_bytes"]), spherical["bytes"])
        self.assertGreater(spherical["level_bytes"][2], spherical["level_bytes"][0])  # 240 images and 20
        for options in (["--levels", "7"], ["--size", "100"]):
            self.assertEqual(run("lightfield", "build", "spherical", self.views, "-o", self.folder / "none", *options).returncode, 2)

    def test_a_scene_shows_each_object_at_its_place(self):
        """Photographs moved as an object is show it as the model's own show the model."""
        objects, scene = self.folder / "objects.toml", self.folder / "scene.lfm"
        objects.write_text('[[object]]\nmodel = "ball.lfm"\n'
                           '[[object]]\nmodel = "ball.lfm"\nposition = [0, 900, 0]\nrotate_deg = 90\nscale = 2\n')
        joined, built = succeed("lightfield", "scene", objects, "-o", scene), self.reports["lfm"]
        self.assertEqual((joined["objects"], joined["models"], joined["triangles"]), (2, 1, 2 * built["triangles"]))
        # Maps are shared; each object has scales and indices of its own.
        self.assertLess(joined["map_bytes"], 1.2 * built["map_bytes"]["all"])
        transforms = json.loads((self.views / "transforms.json").read_text())
        del transforms["lights"]  # as views under fixed light have none
        unmoved, moved = self.folder / "unmoved", self.folder / "moved"
        for views in (unmoved, moved):
            shutil.copytree(self.views, views)
            for frame in transforms["frames"]:
                frame.pop("light", None)
                x, y, z, last = frame["transform_matrix"]  # turned by 90 degrees about z: (x, y) becomes (-y, x)
                if views == moved:
                    frame["transform_matrix"] = [[*(-n for n in y[:3]), -2 * y[3]], [*x[:3], 2 * x[3] + 900],
                                                 [*z[:3], 2 * z[3]], last]
            (views / "transforms.json").write_text(json.dumps(transforms))
        expected = succeed("evaluate", self.models[2], self.views)["psnr_linear_db"]
        for views in (unmoved, moved):
            self.assertAlmostEqual(succeed("evaluate", scene, views)["psnr_linear_db"], expected, delta=0.02)
        for text, said in (('model = "ball.lum"', "format"), ('scale = -1\nmodel = "ball.lfm"', "object[0].scale")):
            objects.write_text(f"[[object]]\n{text}\n")
            self.assert_refused(said, "lightfield", "scene", objects, "-o", self.folder / "none")
        objects.write_text('[[object]]\nmodel = "scene.lfm"\n')
        self.assert_refused("folder of its own", "lightfield", "scene", objects, "-o", scene)

    def test_a_stage_is_traced_without_photographs(self):
        stage, traced = self.folder / "stage.toml", self.folder / "traced.sph"
        built = succeed("lightfield", "build", "spherical", stage, "-o", traced, "--levels", "2", "--size", "32")
        self.assertEqual((built["images"], built["texels_unseen"]), (80, 0))
        scores = succeed("lightfield", "compare", traced, "--views", self.views)["models"]
        self.assertGreater(scores[0]["psnr_linear_db"], 18)  # 19.6 measured
        for options in (["--nearest"], ["--mesh", "ball.ply"]):
            self.assertEqual(run("lightfield", "build", "spherical", stage, "-o", self.folder / "none", *options).returncode, 2)
        self.assertEqual(run("lightfield", "build", "spherical", self.views, "-o", self.folder / "none", "--scale", "tiny").returncode, 2)
        self.assert_refused("scale", "lightfield", "build", "spherical", stage, "-o", self.folder / "none", "--scale", "huge")

    def test_a_flight_reports_every_frame(self):
        script = self.script(self.models[3])
        report = succeed("lightfield", "fly", script, "--rounds", "8", "--warm-up", "4", "--budget-ms", "10000")
        self.assertEqual(len(report["flight"]), 16)
        self.assertEqual(report["summary"]["frames"], 12)
        self.assertEqual(report["summary"]["share_within_budget"], 1)
        levels = [frame["level"] for frame in report["flight"]]
        self.assertEqual(levels, sorted(levels))  # climbs
        self.assertEqual(levels[-1], 2)
        fixed = succeed("lightfield", "fly", script, "--level", "1", "--wait", "--plane", "--single")["flight"]
        self.assertEqual([frame["level"] for frame in fixed], [1, 1])
        self.assertEqual([frame["triangles_of_ancestors"] for frame in fixed], [0, 0])
        self.assertGreater(fixed[0]["images_read"], 0)

    def test_a_flight_that_cannot_be_flown_is_one_line(self):
        script = self.script(self.models[3])
        for said, options in (("budget of main memory", ["--memory-mb", "0"]), ("budget of the GPU", ["--gpu-mb", "0"]),
                              ("--level", ["--level", "2.5"])):
            self.assert_refused(said, "lightfield", "fly", script, *options)
        self.assert_refused("format", "lightfield", "fly", self.script(self.models[0]))
        (self.models[3] / "level1.tiles").rename(self.folder / "away")
        self.assert_refused("level1.tiles: cannot open", "lightfield", "fly", script)
        (self.folder / "away").rename(self.models[3] / "level1.tiles")

    def test_other_light_and_warps_are_refused(self):
        light = '[[light]]\ntype = "directional"\ndirection = [0, 0, 1]\n'
        warp = '[[warp]]\ntype = "scale"\nfactor = [1, 1, 2]\n'
        for model in self.models:
            for more, said in ((light, "baked"), (warp, "bent")):
                self.assert_refused(said, "render", self.script(model, more), "-o", self.folder / "none")

    def test_the_same_build_gives_the_same_bytes_for_any_number_of_threads(self):
        for kind, model, options in (("slf", self.models[0], ["--regions", "30"]),
                                     ("lumigraph", self.models[1], ["--like", self.models[0], "--st", "5"]),
                                     ("lfm", self.models[2], ["--view-size", "12"]),
                                     ("spherical", self.models[3], ["--levels", "3", "--size", "64"]),
                                     ("vdtm", self.models[4], ["--triangles", "1000"])):
            again = self.folder / f"again.{kind}"
            succeed("lightfield", "build", kind, self.views, "-o", again, *options, "--threads", "1")
            self.assert_same_files(content(again), content(model))

    def test_damaged_folders_are_one_line(self):
        for model in self.models:
            broken = self.folder / "broken"
            for file in model.iterdir():
                shutil.rmtree(broken, ignore_errors=True)
                shutil.copytree(model, broken)
                (broken / file.name).write_bytes(file.read_bytes()[:-9])
                self.assert_refused(file.name, "lightfield", "compare", broken, "--views", self.views)

    def test_what_cannot_be_built_is_one_line(self):
        out = ["-o", self.folder / "none"]
        self.assert_refused("not a light field", "lightfield", "build", "slf", self.views, "-o", self.views)
        self.assert_refused("format", "lightfield", "build", "lumigraph", self.views, *out, "--like", self.models[1])
        capture = json.loads((self.views / "transforms.json").read_text())
        for frame in capture["frames"]:
            frame["split"] = "test"
        (self.folder / "held").mkdir()
        (self.folder / "held" / "transforms.json").write_text(json.dumps(capture))
        for file in self.views.iterdir():
            if file.name != "transforms.json":
                (shutil.copytree if file.is_dir() else shutil.copy)(file, self.folder / "held" / file.name)
        for kind in ("slf", "lumigraph", "lfm", "spherical"):
            self.assert_refused("training frames", "lightfield", "build", kind, self.folder / "held", *out)


if __name__ == "__main__":
    unittest.main()
