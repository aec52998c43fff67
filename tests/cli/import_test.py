"""`surflect import` at the command line: the example capture copied whole, and a lit view from a light file."""

import json
import math
import struct
import unittest
import zlib

from support import VASE, TestInFolder, content, run, succeed


def write_png(path, rows):
    """8-bit gray."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    pixels = b"".join(b"\0" + bytes(row) for row in rows)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(pixels)) +
                     chunk(b"IEND", b""))


class Import(TestInFolder):
    def test_a_capture_of_our_own_comes_through_whole(self):
        out = self.folder / "vase"
        report = succeed("import", VASE, "-o", out)
        self.assertEqual(report["format"], "json")
        self.assertIn("colour: 42 pictures as linear (color_space)", report["notes"])
        before, after = succeed("inspect", VASE), succeed("inspect", out)
        self.assertEqual({**after, "geometry": ""}, {**before, "geometry": ""})
        self.assertEqual(report["training_frames"], before["training_frames"])
        pictures = {name: data for name, data in content(out).items() if name.startswith("images/")}
        self.assertEqual(report["pictures"], len(pictures))
        for name, data in pictures.items():
            self.assertEqual(data, (VASE / name).read_bytes())

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
                self.assertEqual(json.loads(result.stdout)["notes"], notes)
        capture["frames"][1]["is_fisheye"] = True
        (source / "transforms.json").write_text(json.dumps(capture))
        for command in [["import", source, "-o", self.folder / "fisheye"], *commands[1:]]:
            result = run(*command)
            self.assertEqual(result.returncode, 1)
            self.assertIn("transforms.json: frames[1].is_fisheye: found true, expected ", result.stderr)

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
