"""`surflect import`: copies the example capture completely, and imports a lit view from a light file."""

import json
import math
import struct
import unittest

from png import read_png, write_png
from support import VASE, TestInFolder, content, run, succeed, write_small_capture


def read_mesh(path):
    """Vertices and triangles of the vase."""
    header, data = path.read_bytes().split(b"end_header\n", 1)
    words = header.split()
    vertices, faces = (int(words[words.index(element) + 1]) for element in (b"vertex", b"face"))
    places = [struct.unpack_from("<3f", data, 12 * v) for v in range(vertices)]
    return places, [struct.unpack_from("<3H", data, 12 * vertices + 7 * f + 1) for f in range(faces)]


class Import(TestInFolder):
    def test_a_capture_of_our_own_comes_through_whole(self):
        out = self.folder / "vase"
        report = succeed("import", VASE, "-o", out)
        self.assertEqual(report["format"], "json")
        self.assertIn("colour: 46 pictures as linear (color_space)", report["notes"])
        before, after = succeed("inspect", VASE), succeed("inspect", out)
        self.assertEqual({**after, "geometry": ""}, {**before, "geometry": ""})
        self.assertEqual(report["training_frames"], before["training_frames"])
        pictures = {name: data for name, data in content(out).items() if name.startswith("images/")}
        self.assertEqual(report["pictures"], len(pictures))
        for name, data in pictures.items():
            self.assertEqual(data, (VASE / name).read_bytes())

    def test_a_scene_far_from_the_origin_gives_the_picture_of_one_that_is_near(self):
        """The vase's capture, moved to UTM coordinates with its mesh, and a script that speaks in them."""
        shift = (500000, 4600000, 30)
        near, far = self.folder / "near", self.folder / "far"
        for folder in (near, far):
            write_small_capture(folder, cameras=4, lights=1)
        description = json.loads((far / "transforms.json").read_text())
        for frame in description["frames"]:
            for row, offset in zip(frame["transform_matrix"], shift):
                row[3] += offset
        description["geometry"] = "mesh.obj"
        (far / "transforms.json").write_text(json.dumps(description))
        vertices, triangles = read_mesh(VASE / "vase.ply")
        (far / "mesh.obj").write_text("".join(
            ["v {!r} {!r} {!r}\n".format(*(x + d for x, d in zip(vertex, shift))) for vertex in vertices] +
            ["f {} {} {}\n".format(*(corner + 1 for corner in triangle)) for triangle in triangles]))
        report = succeed("import", far, "-o", self.folder / "far-capture")
        self.assertIn("cameras and lights count from (500000, 4600000, 3", " ".join(report["notes"]))
        succeed("import", near, "-o", self.folder / "near-capture")
        scores, pictures = [], []
        for name, place in (("near", (0, 0, 0)), ("far", shift)):
            model = self.folder / f"{name}.srf"
            self.assertEqual(succeed("pack", self.folder / f"{name}-capture", "-o", model, "--surfels", "20000", "--tables", "off")["findings"], [])
            scores += [succeed("evaluate", model, self.folder / f"{name}-capture"), succeed("evaluate", model, self.folder / name)]
            script = self.folder / f"{name}.toml"
            script.write_text(f"""
                model = "{name}.srf"
                coordinates = "original"
                frames = {{ first = 1, last = 1 }}
                output = {{ size = [90, 120], path = "{name}.#.exr", png = true }}
                [camera]
                position = [{place[0]}, {place[1] - 4}, {place[2] + 1}]
                look_at = [{place[0]}, {place[1]}, {place[2]}]
                up = [0, 0, 1]
                fov_deg = 30
                [[light]]
                type = "directional"
                direction = [1, -1, 1]
                [[warp]]
                type = "twist"
                axis = [0, 0, 1]
                center = [{place[0]}, {place[1]}, {place[2]}]
                angle_deg = 20
                """)
            succeed("render", script, "-o", self.folder / "frames")
            pictures.append(read_png(self.folder / "frames" / f"{name}.1.png"))
        for score in scores[1:]:
            self.assertAlmostEqual(score["psnr_srgb_db"], scores[0]["psnr_srgb_db"], delta=0.1)
        shown = sum(alpha > 0 for _, _, _, alpha in pictures[0])
        self.assertGreater(shown, 1000)
        difference = sum(abs(a - b) for p, q in zip(*pictures) for a, b in zip(p, q)) / (4 * shown)
        self.assertLess(difference, 1)  # of 255 codes: surfels are sampled anew

        # A mesh too small for single precision there moves the vase as a translation does.
        corners = [(0, 0, 0), (0.2, 0, 0), (0, 0.2, 0), (0, 0, 0.2)]
        for mesh, moved in (("rest.obj", (0, 0, 0)), ("cage.1.obj", (0.25, 0, 0.5))):
            (self.folder / mesh).write_text("".join(
                "v {!r} {!r} {!r}\n".format(*map(sum, zip(corner, shift, moved))) for corner in corners) +
                "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        head, _, _ = (self.folder / "far.toml").read_text().partition("[[warp]]")
        pictures = []
        for name, warp in (("mesh", 'rest = "rest.obj"\nframes = "cage.#.obj"'),
                           ("rigid", f"translate = [0.25, 0, 0.5]\ncenter = {list(shift)}")):
            script = self.folder / f"{name}.toml"
            script.write_text(f'{head}[[warp]]\ntype = "{name}"\n{warp}\n')
            succeed("render", script, "-o", self.folder / name)
            pictures.append(read_png(self.folder / name / "far.1.png"))
        self.assertGreater(sum(alpha > 0 for _, _, _, alpha in pictures[0]), 1000)
        self.assertLessEqual(max(abs(a - b) for p, q in zip(*pictures) for a, b in zip(p, q)), 1)

    def test_a_light_file_and_its_pictures_are_a_view(self):
        source = self.folder / "set"
        source.mkdir()
        lines = []
        for index in range(6):
            azimuth = math.pi / 3 * index
            towards = (0.4 * math.cos(azimuth), 0.4 * math.sin(azimuth), math.sqrt(1 - 0.16))
            write_png(source / f"{index}.png",
                      [[round(200 * max(0, (x - 8) / 20 * towards[0] - (y - 8) / 20 * towards[1] +
                                        0.8 * towards[2])) for x in range(16)] for y in range(16)])
            lines.append("{} {} {}".format(*towards))
        (source / "lights.txt").write_text("\n".join(lines))
        out = self.folder / "imported"
        report = succeed("import", "--test", "2,5", source, "-o", out, "--color-space", "linear", "--height", "3")
        self.assertEqual((report["format"], report["views"], report["lights"]), ("lights", 1, 6))
        self.assertEqual((report["training_frames"], report["test_frames"]), (4, 2))
        capture = json.loads((out / "transforms.json").read_text())
        self.assertEqual(capture["ortho_height"], 3)
        self.assertEqual(capture["color_space"], "linear")
        self.assertIn("light_strengths", capture["calibration"])
        self.assertEqual([frame["light"] for frame in capture["frames"] if frame["split"] == "test"], ["2", "5"])

    def test_lamps_without_strength_are_said(self):
        source = self.folder / "lamps"
        source.mkdir()
        frames = []
        for index in range(3):
            write_png(source / f"{index}.png", [[100] * 8] * 8)
            frames.append({"file_path": f"{index}.png", "pl_pos": [1, index, 2],
                           "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]})
        (source / "transforms.json").write_text(json.dumps({"camera_angle_x": 0.5, "frames": frames}))
        result = run("import", source, "-o", self.folder / "lamps-out")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("light strengths are unknown", result.stderr)
        written = json.loads((self.folder / "lamps-out/transforms.json").read_text())
        self.assertEqual(written["calibration"]["light_strengths"], "unknown, taken as equal")

    def test_every_command_says_how_it_understood_a_description_and_refuses_what_it_cannot(self):
        source = self.folder / "rounded"
        source.mkdir()
        write_png(source / "0.png", [[100] * 8] * 8)
        frame = {"file_path": "0.png", "foo": 1,
                 "transform_matrix": [[1, 0.001, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]}
        capture = {"camera_angle_x": 0.5, "frames": [frame, {**frame, "split": "test"}]}
        notes = ['1 key is not known and passed over: "foo" (in 2 frames)',
                 "2 rotations are rounded, off by up to 0.001; the nearest rotation is taken"]
        packed = self.folder / "rounded.srf"
        commands = [["import", source, "-o", self.folder / "rounded-out"], ["inspect", source],
                    ["pack", source, "-o", packed], ["evaluate", packed, source]]
        (source / "transforms.json").write_text(json.dumps(capture))
        for command in commands:
            result = run(*command, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            for note in notes:
                self.assertEqual(result.stderr.count(note), 1, result.stderr)
            if command[0] == "import":
                self.assertEqual(json.loads(result.stdout)["notes"],
                                 notes + ["colour: 1 picture as sRGB (8 bits that state nothing)"])
        capture["frames"][1]["is_fisheye"] = True
        (source / "transforms.json").write_text(json.dumps(capture))
        for command in [["import", source, "-o", self.folder / "fisheye"], *commands[1:]]:
            result = run(*command)
            self.assertEqual(result.returncode, 1)
            self.assertIn("transforms.json: frames[1].is_fisheye: found true, expected ", result.stderr)

    def test_metashape_cameras_are_brought_to_known_places_with_their_lamps(self):
        source = self.folder / "shoot"
        places = [(0, 0, 4), (4, 0, 0), (0, 4, 0), (3, 3, 3)]
        cameras = ""
        for index, (x, y, z) in enumerate(places):
            for light in ("left", "right"):
                (source / "images").mkdir(parents=True, exist_ok=True)
                write_png(source / "images" / f"c{index}_{light}.png", [[100] * 8] * 6)
            cameras += (f'<camera id="{index}" sensor_id="0" label="c{index}_left"><transform>1 0 0 {x / 2} 0 1 0 {y / 2} '
                        f'0 0 1 {z / 2} 0 0 0 1</transform></camera>')
        description = ('<document version="2.0.0"><chunk label="Chunk 1"><sensors><sensor id="0" type="frame">'
                       '<calibration type="frame"><resolution width="8" height="6"/><f>9</f></calibration></sensor></sensors>'
                       f'<cameras>{cameras}</cameras></chunk></document>')
        (source / "cameras.xml").write_text(description)
        (source / "places.txt").write_text("".join(f"c{i} {x} {y} {z}\n" for i, (x, y, z) in enumerate(places)))
        (source / "lamps.txt").write_text("left -5 0 5\nright 5 0 5\n")
        command = ["import", source, "--pattern", "{camera}_{light}.png", "--lights", source / "lamps.txt",
                   "--positions", "--camera-places", source / "places.txt"]
        report = succeed(*command, "-o", self.folder / "shoot-capture")
        self.assertEqual((report["format"], report["views"], report["lights"]), ("metashape", 4, 2))
        self.assertIn("4 known places of cameras: scaled by 2,", " ".join(report["notes"]))
        capture = json.loads((self.folder / "shoot-capture/transforms.json").read_text())
        for frame in capture["frames"]:
            for row, wanted in zip(frame["transform_matrix"], places[int(frame["camera"][1:])]):
                self.assertAlmostEqual(row[3], wanted, delta=1e-12)
        (source / "cameras.xml").write_text(description[:-20])
        result = run(*command, "-o", self.folder / "cut")
        self.assertEqual(result.returncode, 1)
        self.assertEqual(result.stderr.strip().count("\n"), 0)
        self.assertIn("cameras.xml: line 1: found no complete XML", result.stderr)
        self.assertFalse((self.folder / "cut").exists())

    def test_a_folder_that_holds_something_is_left_alone(self):
        out = self.folder / "mine"
        out.mkdir()
        (out / "letter.txt").write_text("dear")
        result = run("import", VASE, "-o", out)
        self.assertEqual(result.returncode, 1)
        self.assertIn("an empty one", result.stderr)
        self.assertEqual(content(out), {"letter.txt": b"dear"})
        self.assertEqual([path.name for path in self.folder.iterdir() if path.name.startswith("mine")], ["mine"])


if __name__ == "__main__":
    unittest.main()
