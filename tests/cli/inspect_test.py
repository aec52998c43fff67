"""`surflect inspect --overlay`: the sheet that it draws, and the input that it refuses."""

import json
import os
import pathlib
import struct
import unittest

from support import TestInFolder, run, succeed, write_small_capture

EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"


def png_size(path):
    header = path.read_bytes()[:24]
    assert header[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", header[16:24])


class Overlay(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.capture = cls.folder / "capture"
        write_small_capture(cls.capture, cameras=3, lights=2)

    def overlay(self, *arguments):
        return succeed("inspect", self.capture, "--overlay", self.folder / "sheet.png", *arguments)["overlay"]

    def test_the_sheet_fits_a_screen_and_its_numbers_are_reported(self):
        report = self.overlay()
        width, height = png_size(self.folder / "sheet.png")
        self.assertTrue(1000 < width < 4000 and 500 < height < 4000, (width, height))
        self.assertEqual(report["geometry"], "mesh")
        self.assertEqual(len(report["frames"]), 18)
        for frame in report["frames"]:
            with self.subTest(frame=frame):
                self.assertGreater(frame["mask_iou"], 0.97)
                self.assertTrue(0 <= frame["back_share"] < 0.3)
                self.assertTrue(-1 <= frame["shading_correlation"] <= 1)
                self.assertTrue(frame["camera"] and frame["light"])

    def test_max_frames_bounds_the_tiles(self):
        self.assertEqual(len(self.overlay("--max-frames", "3")["frames"]), 3)

    def test_a_pipe_is_not_replaced_by_the_overlay(self):
        pipe = self.folder / "pipe.png"
        os.mkfifo(pipe)
        result = run("inspect", self.capture, "--overlay", pipe)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"^surflect: \S*/pipe.png: cannot write \(something else[^\n]*\n$")
        self.assertTrue(pipe.is_fifo())

    def test_another_mesh_is_drawn_instead(self):
        sliver = self.folder / "sliver.ply"
        sliver.write_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                          "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                          "end_header\n0 0 0\n0.1 0 0\n0 0 0.1\n3 0 1 2\n")
        for frame in self.overlay("--mesh", sliver, "--max-frames", "2")["frames"]:
            self.assertLess(frame["mask_iou"], 0.5)

    def test_without_geometry_the_hull_is_drawn(self):
        description = json.loads((self.capture / "transforms.json").read_text())
        del description["geometry"]
        (self.capture / "bare.json").write_text(json.dumps(description))
        sheet = self.folder / "bare.png"
        report = succeed("inspect", self.capture / "bare.json", "--overlay", sheet, "--max-frames", "6")
        self.assertEqual(report["overlay"]["geometry"], "hull")
        self.assertGreater(max(frame["mask_iou"] for frame in report["overlay"]["frames"]), 0.9)

    def test_a_model_has_nothing_to_draw_over(self):
        model = self.folder / "model.srf"
        succeed("pack", self.capture, "-o", model, "--surfels", "500", "--tables", "off")
        least, largest = succeed("inspect", model)["box"]
        for axis in range(3):
            self.assertTrue(-1.5 < least[axis] < largest[axis] < 1.5, (least, largest))
        result = run("inspect", model, "--overlay", self.folder / "model.png")
        self.assertEqual(result.returncode, 1)
        self.assertIn("--overlay", result.stderr)

    def test_what_a_single_file_is(self):
        for path, kind, fact in ((EXAMPLES / "environments/studio.exr", "a picture", ("samples", "floating point")),
                                 (EXAMPLES / "vase/vase.ply", "a mesh", ("triangles", 126912)),
                                 (EXAMPLES / "warps/rig.glb", "a mesh in glTF, whose y axis points up", ("vertices", 161)),
                                 (EXAMPLES / "vase.toml", "a script", ("warps", 2)),
                                 (EXAMPLES / "stages/vase.toml", "a stage", ("objects", 4))):
            with self.subTest(path=path):
                report = succeed("inspect", path)
                self.assertEqual(report["file"], kind)
                self.assertEqual(report[fact[0]], fact[1])
        self.assertEqual(run("inspect", EXAMPLES / "vase/vase.ply", "--overlay", self.folder / "none.png").returncode, 2)
        points = self.folder / "points.ply"
        points.write_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                          "end_header\n1 2 3\n")
        self.assertEqual(succeed("inspect", points)["file"], "points without triangles")
        neither = self.folder / "neither.toml"
        neither.write_text("colour = 3\n")
        self.assertRegex(run("inspect", neither).stderr, r"neither a script \(\S*neither.toml: colour: .*\) nor a stage \(")

    def test_a_capture_without_faults_is_told_so(self):
        self.assertIn("no fault was found", run("inspect", self.capture).stderr)
        folder = self.folder / "faulty"
        write_small_capture(folder, cameras=3, lights=2)
        description = json.loads((folder / "transforms.json").read_text())
        for light in description["lights"]:
            light["direction"] = [0, 0, 1]
        (folder / "transforms.json").write_text(json.dumps(description))
        result = run("inspect", folder)
        self.assertRegex(result.stderr, r"all \d+ lights stand in one direction")
        self.assertNotIn("no fault was found", result.stderr)
        self.assertIn("the lights were not checked: found 4 a view at most, expected 8", result.stderr)

    def test_a_mesh_that_no_key_names_is_told(self):
        folder = self.folder / "beside"
        write_small_capture(folder, cameras=3, lights=2)
        description = json.loads((folder / "transforms.json").read_text())
        (folder / description.pop("geometry")).rename(folder / "mesh.ply")
        (folder / "transforms.json").write_text(json.dumps(description))
        (folder / "folder.ply").mkdir()
        for command in (["inspect", folder], ["pack", folder, "-o", self.folder / "beside.srf", "--surfels", "500", "--tables", "off"]):
            self.assertIn("no mesh is named. Beside the capture: mesh.ply; to use one", run(*command).stderr)

    def test_surfels_far_apart_are_told_with_the_number_that_is_not(self):
        model = self.folder / "sparse.srf"
        result = run("pack", self.capture, "-o", model, "--surfels", "500", "--tables", "off")
        self.assertRegex(result.stderr, r"surfels are \d+\.\d pixels of the photographs apart.* take \d+\.\d GB .*: --surfels \d+0000")
        self.assertRegex(run("inspect", model).stderr, r"surfels are \d+\.\d pixels of the photographs apart")
        self.assertGreater(succeed("inspect", model)["pixels_between_surfels"], 0.75)

    def test_pack_says_how_good_new_views_will_be(self):
        folder = self.folder / "five"
        write_small_capture(folder, cameras=5, lights=4)
        result = run("pack", folder, "-o", self.folder / "five.srf", "--surfels", "500", "--tables", "off")
        self.assertRegex(result.stderr, r"new views: weighted by (camera and light separately|kriging over cameras and lights "
                                        r"together); photographs that were left out are predicted to \d+\.\d dB \((good|fair|poor)")

    def test_options_of_the_overlay_want_it(self):
        for arguments in (["--max-frames", "3"],
                          ["--overlay", "sheet.png", "--max-frames", "0"]):
            with self.subTest(arguments=arguments):
                self.assertEqual(run("inspect", self.capture, *arguments).returncode, 2)


class Extremes(TestInFolder):
    """Largest values of every field that the reader accepts."""

    def test_no_value_that_is_read_ends_the_program(self):
        capture = self.folder / "capture"
        write_small_capture(capture, cameras=3, lights=2)
        description = json.loads((capture / "transforms.json").read_text())
        description["frames"] = [frame for frame in description["frames"] if frame["split"] == "train"]
        far = {"transform_matrix": [[1, 0, 0, 1e12], [0, 1, 0, -1e12], [0, 0, 1, 1e12], [0, 0, 0, 1]]}
        orthographic = {"camera_model": "orthographic", "ortho_height": 1e12}
        lamp = {"type": "point", "position": [1e12, 1e12, -1e12], "intensity": [1e12, 1e-12, 1]}
        beam = {"type": "directional", "direction": [0, 0, 1], "irradiance": [1e-12, 1, 1e12]}
        for name, lens, first, light in (
                ("far cameras", {}, far, {}), ("principal point", {"cx": 1e12, "cy": -1e12}, {}, {}),
                ("orthographic", {**orthographic, "cx": 1e12}, {}, {}),
                ("all lamps far", {}, {}, lamp), ("strengths", {}, {}, beam),
                ("all", {**orthographic, "cx": -1e12}, far, lamp)):
            changed = json.loads(json.dumps({**description, **lens}))
            changed["frames"][0].update(first)
            for one in changed["lights"]:
                one.update(light)
            path = capture / "changed.json"
            path.write_text(json.dumps(changed))
            for arguments in (["inspect", path], ["inspect", path, "--overlay", self.folder / "sheet.png", "--max-frames", "2"],
                              ["pack", path, "-o", self.folder / f"{name}.srf", "--surfels", "200", "--tables", "off"]):
                with self.subTest(name=name, command=arguments[0], overlay="--overlay" in arguments):
                    result = run(*arguments)
                    self.assertIn(result.returncode, (0, 1), result.stderr)
                    if result.returncode == 1:
                        self.assertRegex(result.stderr.splitlines()[-1], r"^surflect: [^\n]+$")


class Findings(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.capture = cls.folder / "capture"
        write_small_capture(cls.capture, cameras=3, lights=4)

    def findings_where(self, change):
        description = json.loads((self.capture / "transforms.json").read_text())
        change(description)
        changed = self.capture / "changed.json"
        changed.write_text(json.dumps(description))
        return succeed("inspect", changed)["findings"]

    def test_the_vase_is_as_it_should_be(self):
        self.assertEqual(self.findings_where(lambda description: None), [])

    def test_lights_that_no_frame_names_do_not_make_a_lit_capture(self):
        def unlight(description):
            description["frames"] = [frame for frame in description["frames"] if frame["light"] == "L05"]
            for frame in description["frames"]:
                del frame["light"]

        self.assertEqual(self.findings_where(unlight), [])

    def test_a_camera_that_looks_away_is_found(self):
        def turn(description):
            for frame in description["frames"]:
                frame["transform_matrix"] = [[-x, y, -z, t] for x, y, z, t in frame["transform_matrix"][:3]] + [
                    [0, 0, 0, 1]]

        findings = self.findings_where(turn)
        self.assertTrue(findings)
        self.assertEqual(findings[0]["severity"], "error")


if __name__ == "__main__":
    unittest.main()
