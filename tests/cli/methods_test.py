"""Methods with fixed light, from views and from a capture, through pack, evaluate, render, inspect and chart."""

import fcntl
import json
import os
import shutil
import unittest

from png import read_png, write_png
from support import GLOSSY_BALL, TestInFolder, content, run, succeed
from viewer import Viewer

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
""" + GLOSSY_BALL

SCRIPT = """
model = "{model}"
[frames]
first = 1
last = 2
[output]
size = [60, 40]
path = "frame.#.exr"
png = true
[camera]
position = ["4 + s", -1, 1]
look_at = [0, 0, 0]
up = [0, 0, 1]
fov_deg = 32
"""


TEXELS = 500000  # of the lumigraph, at most


class Methods(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.views = cls.folder / "views"
        (cls.folder / "stage.toml").write_text(STAGE)
        succeed("capture", cls.folder / "stage.toml", "-o", cls.views)
        cls.reports = {
            "slf": succeed("pack", cls.views, "--method", "slf", "-o", cls.folder / "ball.slf", "--regions", "30"),
            "lumigraph": succeed("pack", cls.views, "--method", "lumigraph", "-o", cls.folder / "ball.lum", "--st", "5",
                                 "--texels", TEXELS),
            "lfm": succeed("pack", cls.views, "--method", "lfm", "-o", cls.folder / "ball.lfm", "--view-size", "12"),
            "spherical": succeed("pack", cls.views, "--method", "spherical", "-o", cls.folder / "ball.sph", "--levels", "3",
                                 "--size", "64"),
            "vdtm": succeed("pack", cls.views, "--method", "vdtm", "-o", cls.folder / "ball.vdtm", "--triangles", "1000"),
            "ulr": succeed("pack", cls.views, "--method", "ulr", "-o", cls.folder / "ball.ulr", "--hull",
                           "--triangles", "3000", "--budget-mb", "1"),
            "olfm": succeed("pack", cls.views, "--method", "olfm", "-o", cls.folder / "ball.olfm", "--triangles", "1000",
                            "--view-size", "12")}
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
        self.assertLessEqual(lumigraph["texels"], TEXELS)
        self.assertGreater(lumigraph["texels"], 0.9 * TEXELS)
        self.assertEqual(len(lumigraph["slab_widths"]), 6)

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
        small = succeed("pack", self.views, "--method", "lfm", "-o", self.folder / "small.lfm", "--view-size", "12",
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
            self.assertEqual(report["packed_bytes"], 8 * 32 * report["view_width"] * report["view_height"])
        self.assertEqual(vdtm["scale"], 1)
        self.assertLessEqual(ulr["packed_bytes"], 2**20)
        small = succeed("pack", self.views, "--method", "vdtm", "-o", self.folder / "small.vdtm", "--triangles", "1000", "--s3tc")
        self.assertLess(small["packed_bytes"], vdtm["packed_bytes"] / 7)  # sides are filled up to multiples of 4
        self.assertEqual(small["packed_bytes"], 32 * small["view_width"] * small["view_height"])

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
        small = succeed("pack", self.views, "--method", "olfm", "-o", self.folder / "small.olfm", "--hull", "--triangles",
                        "200", "--samples", "8", "--terms", "2", "--vq", "4", "--s3tc")
        self.assertTrue(small["hull"])
        self.assertGreater(small["compression"], 4 * olfm["compression"])
        for options in (["--terms", "65"], ["--regions", "9"], ["--samples", "1"]):
            self.assertEqual(run("pack", self.views, "--method", "olfm", "-o", self.folder / "none", *options).returncode, 2)

    def test_an_opacity_light_field_takes_plain_lenses_alone(self):
        views = self.folder / "distorted"
        shutil.copytree(self.views, views)
        transforms = json.loads((views / "transforms.json").read_text())
        transforms["k1"] = 0.1
        (views / "transforms.json").write_text(json.dumps(transforms))
        for method in ("vdtm", "olfm"):
            self.assert_refused("k1", "pack", views, "--method", method, "-o", self.folder / f"none.{method}")

    def test_a_chart_sweeps_the_knobs_of_a_light_field(self):
        report = succeed("chart", self.folder / "ball.lfm", self.views, "--sweep", "terms=3,0", "--sweep", "samples=2,1",
                         "-o", self.folder / "chart", "--frames", "2", "--timed-frames", "1", "--rounds", "1")
        self.assertEqual(len(report["points"]), 4)
        report = succeed("chart", self.folder / "ball.olfm", self.views, "--order", "peel", "--sweep", "layers=64,1", "--only", "-o",
                         self.folder / "layers", "--frames", "2", "--timed-frames", "1", "--rounds", "1")
        self.assertEqual(len(report["points"]), 2)
        wrong = run("chart", self.folder / "ball.lfm", self.views, "--sweep", "samples=9", "-o", self.folder / "none")
        self.assertEqual(wrong.returncode, 2)
        self.assertIn("--samples: found 9", wrong.stderr)

    def test_simplified_geometry_is_reported_with_its_ghosts(self):
        rough = succeed("pack", self.views, "--method", "lumigraph", "-o", self.folder / "rough.lum", "--texels", 100000,
                        "--st", "2", "--triangles", "100")
        errors = rough["depth_errors"]
        self.assertLessEqual(rough["depth_triangles"], 100)
        self.assertTrue(0 < errors["mean"] < errors["worst"] < 2)
        self.assertTrue(0 < errors["mean_offset_texels"] < errors["worst_offset_texels"])
        self.assertNotIn("depth_errors", self.reports["lumigraph"])
        self.assertEqual(self.reports["lumigraph"]["black_pictures"], 0)

    def test_held_out_views_are_met_by_every_model(self):
        packed = self.folder / "ball.srf"
        succeed("pack", self.views, "-o", packed, "--surfels", "4000")
        rows = succeed("evaluate", packed, *self.models, self.views)["models"]
        scores = [row["psnr_linear_db"] for row in rows]
        self.assertEqual([row["model"] for row in rows], [str(packed), *map(str, self.models)])
        self.assertEqual([row["method"] for row in rows], ["surfels", *self.reports])
        hull = scores.pop(6)  # blurs outlines by the voxels of pictures this small
        self.assertGreater(hull, 22)
        self.assertGreater(min(scores), 25)  # wrong cameras or mirrored textures give less than 20
        self.assertEqual([len(row["frames"]) for row in rows], [4] * len(rows))
        self.assertGreater(rows[1]["passes"], 0)
        self.assertGreater(rows[1]["frame_ms"], 0)
        alone = succeed("evaluate", self.models[0], self.views)
        self.assertEqual(alone["psnr_linear_db"], rows[1]["psnr_linear_db"])
        self.assert_refused("nearest", "evaluate", self.models[0], self.views, "--baseline", "nearest")

    def test_scripts_are_rendered_alike_again(self):
        for model in self.models:
            script = self.script(model)
            succeed("render", script, "-o", self.folder / "film")
            first = content(self.folder / "film")
            succeed("render", script, "-o", self.folder / "film")
            self.assert_same_files(content(self.folder / "film"), first)

    def test_a_model_without_a_script_is_shown_from_all_around(self):
        for model in self.models:
            film = self.folder / f"{model.name}.turn"
            report = succeed("render", model, "-o", film, "--every", "24", "--scale", "0.1", "--preset", "preview")
            self.assertEqual(len(report["frames"]), 2)
            self.assertEqual(len(list(film.glob("*.png"))), 2)

    def test_the_viewer_shows_every_method(self):
        with Viewer(*self.models, folder=self.folder) as viewer:
            start = json.loads(viewer.get("/start")[1])
            self.assertEqual([model["name"] for model in start["models"]], [model.name for model in self.models])
            doc = {key: value for key, value in start["doc"].items() if key not in ("light", "warp")}
            for number, model in enumerate(start["models"]):
                self.assertEqual((model["relights"], model["deforms"]), (False, False))
                self.assertIn("those of the photographs", model["why"])
                for quality in ("preview", "full"):
                    shot = {"number": 1, "model": number, "doc": doc, "frame": 1, "size": [60, 45], "quality": quality}
                    status, body, headers = viewer.post("/frame", shot)
                    self.assertEqual(status, 200, (model["name"], body[:300]))
                    told = json.loads(headers["X-Picture"])
                    self.assertGreater(told["white"], 0, model["name"])
                    self.assertEqual("level" in told, model["method"] == "spherical" and quality == "preview")
                for aov in model["aovs"]:
                    self.assertEqual(viewer.post("/frame", {**shot, "show": aov})[0], 200, (model["name"], aov))
                self.assertEqual(viewer.post("/probe", {**shot, "x": 30, "y": 20})[0], 200)

    def test_every_method_renders_as_its_paper_prints_it(self):
        for model in self.models:
            plain, paper = self.folder / "plain", self.folder / "paper"
            succeed("render", self.script(model), "-o", plain, "--frames", "1")
            succeed("render", self.script(model), "-o", paper, "--frames", "1", "--preset", "paper")
            self.assertNotEqual(content(paper), content(plain), model)
            scores = succeed("evaluate", model, self.views, "--preset", "paper")
            self.assertGreater(scores["psnr_linear_db"], 15, model)

    def test_options_are_those_of_the_method(self):
        script = self.script(self.models[0])
        for options, said in ((["--terms", "1"], "slf has no option --terms"),
                              (["--basis", "gouraud"], "--basis: has an effect only with --stages two, found fused"),
                              (["--stages", "three"], "--stages: found three, expected fused or two")):
            result = run("render", script, "-o", self.folder / "none", *options)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(said, result.stderr)
        listed = run("render", script, "--help").stdout
        self.assertIn("Options of slf", listed)
        self.assertIn("--stages fused|two", listed)

    def test_an_aov_that_a_model_lacks_is_refused(self):
        script = self.folder / "aov.toml"
        script.write_text(SCRIPT.format(model=self.models[4]).replace('exr"', 'exr"\naov = ["depth"]'))
        self.assert_refused("output.aov", "render", script, "-o", self.folder / "none")

    def test_inspect_says_what_a_model_holds(self):
        for name, model in zip(self.reports, self.models):
            found = succeed("inspect", model)
            self.assertEqual((found["method"], found["views"]), (name, 32))
            self.assertIn("samples", found["options"])

    def test_the_report_of_a_spherical_light_field_adds_up(self):
        spherical = self.reports["spherical"]
        self.assertEqual(spherical["images"], 20 * 4 ** 2)
        self.assertEqual(len(spherical["level_bytes"]), 3)
        self.assertLess(sum(spherical["level_bytes"]), spherical["bytes"])
        self.assertGreater(spherical["level_bytes"][2], spherical["level_bytes"][0])  # 240 images and 20
        for options in (["--levels", "7"], ["--size", "100"]):
            self.assertEqual(run("pack", self.views, "--method", "spherical", "-o", self.folder / "none", *options).returncode, 2)

    def test_a_scene_shows_each_object_at_its_place(self):
        """A camera that moves as an object does sees the object as a camera that stands sees the model."""
        scene = self.folder / "scene.toml"
        text = SCRIPT.replace('model = "{model}"\n', "").replace('"4 + s"', "{x}")
        objects = ('[[object]]\nmodel = "ball.lfm"\n'
                   '[[object]]\nmodel = "ball.lfm"\nposition = [0, 900, 0]\nrotate_deg = 90\nscale = 2\n')
        alone = SCRIPT.replace('"4 + s"', "4").format(model="ball.lfm")
        # Turned by 90 degrees about z, (x, y) becomes (-y, x).
        places = {"standing": ("[4, -1, 1]", "[0, 0, 0]"), "moved": ("[2, 908, 2]", "[0, 900, 0]")}
        script = self.folder / "alone.toml"
        script.write_text(alone)
        succeed("render", script, "-o", self.folder / "alone", "--frames", "1")
        for name, (position, target) in places.items():
            scene.write_text(text.replace('[{x}, -1, 1]', position).replace("look_at = [0, 0, 0]", f"look_at = {target}") + objects)
            report = succeed("render", scene, "-o", self.folder / name, "--frames", "1")
            self.assertEqual(report["triangles"], 2 * self.reports["lfm"]["triangles"])
            # Maps are shared; each object has scales and indices of its own.
            self.assertLess(report["map_bytes"], 1.2 * self.reports["lfm"]["map_bytes"]["all"])
        self.assert_alike(self.folder / "standing", self.folder / "alone")
        self.assert_alike(self.folder / "moved", self.folder / "alone")
        for wrong, said in (('model = "ball.lum"', "method"), ('scale = -1\nmodel = "ball.lfm"', "object[0].scale")):
            scene.write_text(text.replace("{x}", "4") + f"[[object]]\n{wrong}\n")
            self.assert_refused(said, "render", scene, "-o", self.folder / "none")

    def assert_alike(self, film, other):
        """Previews of two films are equal but for a few steps of 8 bits."""
        one, two = (read_png(next(folder.glob("*.png"))) for folder in (film, other))
        off = sum(abs(a - b) for p, q in zip(one, two, strict=True) for a, b in zip(p, q, strict=True))
        self.assertLess(off / len(one), 1)

    def test_a_stage_is_traced_without_photographs(self):
        stage, traced = self.folder / "stage.toml", self.folder / "traced.sph"
        built = succeed("pack", stage, "--method", "spherical", "-o", traced, "--levels", "2", "--size", "32")
        self.assertEqual((built["images"], built["texels_unseen"]), (80, 0))
        scores = succeed("evaluate", traced, self.views)
        self.assertGreater(scores["psnr_linear_db"], 18)  # 19.6 measured
        for options in (["--nearest"], ["--mesh", "ball.ply"]):
            self.assertEqual(run("pack", stage, "--method", "spherical", "-o", self.folder / "none", *options).returncode, 2)
        self.assertEqual(run("pack", self.views, "--method", "spherical", "-o", self.folder / "none", "--scale", "tiny").returncode, 2)
        self.assert_refused("scale", "pack", stage, "--method", "spherical", "-o", self.folder / "none", "--scale", "huge")

    def test_a_budget_chooses_the_level_of_a_spherical_light_field(self):
        script = self.folder / "flight.toml"
        script.write_text(SCRIPT.format(model=self.models[3]).replace("last = 2", "last = 12"))
        options = ["--budget-ms", "10000", "--samples", "1"]
        frames = succeed("render", script, "-o", self.folder / "flight", *options)["frames"]
        levels = [frame["level"] for frame in frames]
        self.assertEqual(levels, sorted(levels))  # climbs
        self.assertEqual(levels[-1], 2)
        self.assertTrue(all(frame["predicted_ms"] > 0 for frame in frames))
        (self.models[3] / "level1.tiles").rename(self.folder / "away")
        self.assert_refused("level1.tiles: cannot open", "render", script, "-o", self.folder / "none")
        (self.folder / "away").rename(self.models[3] / "level1.tiles")

    def test_other_light_and_warps_are_refused(self):
        light = '[[light]]\ntype = "directional"\ndirection = [0, 0, 1]\n'
        warp = '[[warp]]\ntype = "scale"\nfactor = [1, 1, 2]\n'
        for model in self.models:
            for more, said in ((light, "baked"), (warp, "bent")):
                self.assert_refused(said, "render", self.script(model, more), "-o", self.folder / "none")

    def test_the_same_build_gives_the_same_bytes_for_any_number_of_threads(self):
        for kind, model, options in (("slf", self.models[0], ["--regions", "30"]),
                                     ("lumigraph", self.models[1], ["--st", "5", "--texels", TEXELS]),
                                     ("lfm", self.models[2], ["--view-size", "12"]),
                                     ("spherical", self.models[3], ["--levels", "3", "--size", "64"]),
                                     ("vdtm", self.models[4], ["--triangles", "1000"])):
            again = self.folder / f"again.{kind}"
            succeed("pack", self.views, "--method", kind, "-o", again, *options, "--threads", "1")
            self.assert_same_files(content(again), content(model))

    def test_finished_maps_are_compressed_to_the_bytes_of_a_build(self):
        compression = ["--higher-view-size", "6", "--vq", "4", "--s3tc"]
        for kind, model, options in (("lfm", self.models[2], ["--view-size", "12"]),
                                     ("olfm", self.models[6], ["--triangles", "1000", "--view-size", "12"])):
            built, small = self.folder / f"built.{kind}", self.folder / f"compressed.{kind}"
            wanted = succeed("pack", self.views, "--method", kind, "-o", built, *options, *compression)
            found = succeed("pack", model, "-o", small, *compression)
            self.assert_same_files(content(small), content(built))
            for name in ("method", "bytes", "map_bytes", "compression", "resampled_bytes", "triangles", "samples"):
                self.assertEqual(found[name], wanted[name])
            none = self.folder / f"none.{kind}"
            self.assert_refused("have S3TC blocks already", "pack", small, "-o", none, "--vq", "4")
            wrong = run("pack", model, "-o", none, "--terms", "2")
            self.assertEqual(wrong.returncode, 2)
            self.assertIn("--terms: is for photographs", wrong.stderr)
            self.assert_refused("would compress it", "pack", model, "-o", none)
            self.assert_refused("--higher-view-size: found 13, expected at most 12", "pack", model, "-o", none,
                                "--higher-view-size", "13")
            self.assertEqual(run("pack", model, "--method", "vdtm", "-o", none, *compression).returncode, 2)
            self.assert_refused("is the source", "pack", model, "-o", model, *compression)
            self.assertEqual(run("pack", model, "-o", none, "--mesh", "a.ply").returncode, 2)
            self.assertFalse(none.exists())
        half, whole = self.folder / "half.lfm", self.folder / "whole.lfm"
        succeed("pack", self.models[2], "-o", half, "--higher-view-size", "6", "--vq", "4")
        succeed("pack", half, "-o", whole, "--s3tc")
        self.assert_same_files(content(whole), content(self.folder / "compressed.lfm"))
        for again in (["--vq", "4"], ["--higher-view-size", "4"]):
            self.assert_refused("have codebooks already", "pack", half, "-o", none, *again)
        self.assertEqual(run("pack", self.models[0], "-o", none, "--vq", "4").returncode, 2)  # slf
        self.assertEqual(run("pack", self.models[2], "-o", none, "--vq-means").returncode, 2)
        succeed("pack", self.models[2], "-o", whole, "--vq", "4", "--preset", "paper")
        for arguments in ([self.models[2]], [self.views, "--method", "lfm"]):
            self.assert_refused("--vq: found 1000000 for each codeword, expected", "pack", *arguments, "-o", none, "--vq", "1000000")
        means = succeed("pack", self.models[2], "-o", whole, "--vq", "4", "--vq-means")["map_bytes"]["mean"]
        self.assertLess(means, 0.3 * self.reports["lfm"]["map_bytes"]["mean"])

    def test_damaged_folders_are_one_line(self):
        for model in self.models:
            broken = self.folder / "broken"
            for file in model.iterdir():
                shutil.rmtree(broken, ignore_errors=True)
                shutil.copytree(model, broken)
                (broken / file.name).write_bytes(file.read_bytes()[:-9])
                self.assert_refused(file.name, "evaluate", broken, self.views)

    def test_a_model_of_another_method_is_not_replaced(self):
        self.assert_refused("finished model of method slf", "pack", self.views, "--method", "lfm", "-o", self.models[0])

    def test_a_folder_that_another_process_writes_is_left_alone(self):
        model = self.folder / "held.lum"
        model.mkdir()
        holder = os.open(model, os.O_RDONLY)
        fcntl.flock(holder, fcntl.LOCK_EX)
        pack = "pack", self.views, "--method", "lumigraph", "--st", "3", "--texels", TEXELS, "-o", model
        self.assert_refused("held.lum: another process writes there", *pack)
        self.assertEqual(list(model.iterdir()), [])
        os.close(holder)
        succeed(*pack)

    def test_what_cannot_be_built_is_one_line(self):
        out = ["-o", self.folder / "none"]
        self.assert_refused("not a light field", "pack", self.views, "--method", "slf", "-o", self.views)
        capture = json.loads((self.views / "transforms.json").read_text())
        for frame in capture["frames"]:
            frame["split"] = "test"
        (self.folder / "held").mkdir()
        (self.folder / "held" / "transforms.json").write_text(json.dumps(capture))
        for file in self.views.iterdir():
            if file.name != "transforms.json":
                (shutil.copytree if file.is_dir() else shutil.copy)(file, self.folder / "held" / file.name)
        for kind in ("slf", "lumigraph", "lfm", "spherical"):
            self.assert_refused("training frames", "pack", self.folder / "held", "--method", kind, *out)


    def changed_views(self, name, change):
        """A copy of the views whose description `change` has edited."""
        views = self.folder / name
        shutil.copytree(self.views, views)
        capture = json.loads((views / "transforms.json").read_text())
        change(capture, views)
        (views / "transforms.json").write_text(json.dumps(capture))
        return views

    def test_a_mesh_in_another_frame_than_the_cameras_stops_every_method_unless_forced(self):
        def move_away(capture, _):
            for frame in capture["frames"]:
                for row in frame["transform_matrix"][:3]:
                    row[3] *= 1.4
        views = self.changed_views("farther", move_away)
        model = self.folder / "farther.model"
        for method in ("slf", "lumigraph", "lfm", "vdtm", "ulr", "olfm", "spherical"):
            pack = "pack", views, "--method", method, "-o", model
            result = run(*pack)
            self.assertEqual(result.returncode, 1)
            self.assertIn("error: the mesh and the masks differ in ", result.stderr)
            self.assertIn("stopped by 1 error, see above; no model was made. surflect inspect ", result.stderr)
            self.assertFalse((model / "manifest.json").exists())
        forced = succeed("pack", views, "--method", "ulr", "-o", self.folder / "forced.ulr", "--force")
        self.assertEqual(forced["findings"][0]["severity"], "error")
        self.assertEqual(self.reports["ulr"]["findings"], [])

    def test_a_view_that_shows_nothing_is_named(self):
        def blank(capture, views):
            frame = next(frame for frame in capture["frames"] if frame["split"] == "train")
            for key in [key for key in frame if "layer" in key]:
                del frame[key]
            frame["file_path"] = "blank.png"
            write_png(views / "blank.png", [[(0, 0, 0, 0)] * 48] * 48)
        views = self.changed_views("blank", blank)
        report = succeed("pack", views, "--method", "ulr", "-o", self.folder / "blank.ulr")
        self.assertRegex(report["findings"][0]["text"], "1 of 32 views")


class FromACapture(TestInFolder):
    """A capture under many lights: the views of a method with fixed light are relit, and kept."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=3, lights=3, coarse=True)
        cls.lamps = cls.folder / "lamps.toml"
        cls.lamps.write_text('[[light]]\ntype = "directional"\ndirection = [1, -1, 1]\n')
        cls.built = succeed("pack", cls.capture, "--method", "slf", "--lights", cls.lamps, "--common-lights", "-o",
                            cls.folder / "vase.slf", "--regions", "20", "--directions", "18", "--texels", "4000")

    def test_the_relit_views_are_those_of_relight(self):
        succeed("relight", self.capture, "--lights", self.lamps, "--common-lights", "-o", self.folder / "views")
        self.assert_same_files(content(self.folder / "vase.slf" / "views"), content(self.folder / "views"))
        again = succeed("pack", self.folder / "views", "--method", "slf", "-o", self.folder / "again.slf", "--regions",
                        "20", "--directions", "18", "--texels", "4000")
        self.assertEqual(again["bytes"], self.built["bytes"])
        self.assertEqual((self.folder / "again.slf" / "manifest.json").read_bytes(),
                         (self.folder / "vase.slf" / "manifest.json").read_bytes())

    def test_views_are_kept_for_the_next_build(self):
        built = succeed("pack", self.capture, "--method", "slf", "--lights", self.lamps, "--common-lights", "-o",
                        self.folder / "vase.slf", "--regions", "20", "--directions", "18", "--texels", "4000")
        self.assertEqual(built["views"]["resumed_views"], 5)

    def test_the_light_must_be_said(self):
        for options, said in (([], "lights"), (["--method", "surfels", "--lights", self.lamps], "surfels keep their light")):
            method = [] if options else ["--method", "slf"]
            result = run("pack", self.capture, *method, *options, "-o", self.folder / "none")
            self.assertEqual(result.returncode, 2)
            self.assertIn(said, result.stderr)


if __name__ == "__main__":
    unittest.main()
