"""A capture of one camera without geometry: `surflect pack` makes a plane or a relief, `evaluate` compares it with both
baselines."""

import json
import math
import random
import struct
import unittest
import zlib

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


def chunk(name, content):
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def write_png(path, width, height, texel):
    """An RGB picture of 8 bits; texel(x, y) are its three values, 0 to 255."""
    rows = b"".join(b"\0" + bytes(v for x in range(width) for v in texel(x, y)) for y in range(height))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class PixelGrid(TestInFolder):
    """Wavy plaster with a texture as fine as pixels, under 12 lights of a dome, two of which are held out."""

    WIDTH, HEIGHT = 99, 61  # not whole blocks

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        grain = random.Random(1)
        albedo = [[grain.uniform(0.3, 0.9) for _ in range(cls.WIDTH)] for _ in range(cls.HEIGHT)]
        cls.capture = cls.folder / "wavy"
        (cls.capture / "images").mkdir(parents=True)
        lights, frames = [], []
        for i in range(12):
            tilt, turn = 0.2 + 0.07 * i, 2.4 * i
            towards = [math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn), math.cos(tilt)]

            def texel(x, y):
                slope_x, slope_y = 0.5 * math.cos(x / 9), 0.4 * math.sin(y / 7)
                shade = (towards[2] - slope_x * towards[0] - slope_y * towards[1]) / math.hypot(1, slope_x, slope_y)
                value = 230 * albedo[y][x] * max(shade, 0)
                return round(value), round(0.8 * value), round(0.5 * value)

            write_png(cls.capture / f"images/{i}.png", cls.WIDTH, cls.HEIGHT, texel)
            lights.append({"name": str(i), "type": "directional", "direction": towards, "irradiance": [3, 3, 3]})
            frames.append({"file_path": f"images/{i}.png", "camera": "C", "light": str(i),
                           "split": "test" if i in (4, 7) else "train",
                           "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 9], [0, 0, 0, 1]]})
        cls.description = {"w": cls.WIDTH, "h": cls.HEIGHT, "camera_model": "orthographic", "ortho_height": 6.1,
                           "color_space": "linear", "lights": lights, "frames": frames}
        (cls.capture / "transforms.json").write_text(json.dumps(cls.description))
        cls.own = cls.folder / "own"  # the photographs that are packed are those that are compared
        (cls.own / "images").mkdir(parents=True)
        for i in range(12):
            (cls.own / f"images/{i}.png").write_bytes((cls.capture / f"images/{i}.png").read_bytes())
        test = [{**frame, "split": "test"} for frame in frames if frame["split"] == "train"]
        own = {**cls.description, "frames": [frame for frame in frames if frame["split"] == "train"] + test}
        (cls.own / "transforms.json").write_text(json.dumps(own))
        cls.reports = {name: succeed("pack", cls.own, "-o", cls.folder / f"{name}.srf", *options)
                       for name, options in {"plane": [], "relief": ["--relief"], "fine": ["--surfels", "1600"]}.items()}

    def test_surfels_are_corners_of_the_grid(self):
        for name, step in {"plane": 8, "relief": 1, "fine": 2}.items():
            columns, rows = math.ceil(self.WIDTH / step) + 1, math.ceil(self.HEIGHT / step) + 1
            report = self.reports[name]
            self.assertEqual((report["grid_step"], report["surfels"]), (step, columns * rows))
            manifest = json.loads((self.folder / f"{name}.srf/manifest.json").read_text())
            self.assertEqual((manifest["version"], manifest["grid_step"]), (8, step))

    def test_frames_from_the_own_camera_are_as_sharp_as_photographs(self):
        for name, report in self.reports.items():
            with self.subTest(model=name):
                # What is lost is lost to the tolerance of the blocks: 46.3 dB.
                self.assertGreater(succeed("evaluate", self.folder / f"{name}.srf", self.own)["psnr_linear_db"], 46)
                self.assertLess(report["store"]["psnr_linear_db"], 47)

    def test_new_lights_are_blended_as_for_surfels_apart(self):
        grid = succeed("evaluate", self.folder / "relief.srf", self.capture)["psnr_srgb_db"]
        nearest = succeed("evaluate", self.folder / "relief.srf", self.capture, "--interpolation", "nearest")
        self.assertGreater(grid, 30)
        self.assertGreater(grid, nearest["psnr_srgb_db"] + 5)

    def test_a_model_of_another_step_than_its_surfels_is_refused(self):
        model = self.folder / "plane.srf"
        path = model / "manifest.json"
        text = path.read_text()
        try:
            path.write_text(text.replace('"grid_step": 8', '"grid_step": 4'))
            result = run("inspect", model)
        finally:
            path.write_text(text)
        self.assertEqual(result.returncode, 1)
        self.assertIn("manifest.json", result.stderr)


def dng(path, width, height, level):
    """A linear Bayer picture of 16 bits: white of a level on the left, a quarter of that on the right."""
    neutral = (0.5, 1.0, 0.6)  # of the camera's red, green and blue
    pixels = b"".join(struct.pack("<H", round(65535 * level * neutral[(y % 2) + (x % 2)] * (1 if x < width // 2 else 0.25)))
                      for y in range(height) for x in range(width))
    xyz_to_srgb = ((3.2406, -1.5372, -0.4986), (-0.9689, 1.8758, 0.0415), (0.0557, -0.2040, 1.0570))
    matrix = [(round(1e4 * value * neutral[c]), 10000) for c, row in enumerate(xyz_to_srgb) for value in row]
    tags = {254: ("I", [0]), 256: ("I", [width]), 257: ("I", [height]), 258: ("H", [16]), 259: ("H", [1]),
            262: ("H", [32803]), 271: ("s", b"Surflect\0"), 272: ("s", b"Test\0"), 273: ("I", [0]), 274: ("H", [1]),
            277: ("H", [1]), 278: ("I", [height]), 279: ("I", [len(pixels)]), 33421: ("H", [2, 2]),
            33422: ("B", [0, 1, 1, 2]), 50706: ("B", [1, 4, 0, 0]), 50707: ("B", [1, 1, 0, 0]),
            50708: ("s", b"Surflect Test\0"), 50717: ("I", [65535]), 50721: ("ii", matrix),
            50728: ("II", [(round(1e4 * value), 10000) for value in neutral]), 50778: ("H", [21])}
    types = {"B": 1, "s": 2, "H": 3, "I": 4, "II": 5, "ii": 10}
    content = {tag: values if kind == "s" else b"".join(
        struct.pack("<" + kind, *(value if isinstance(value, tuple) else (value,))) for value in values)
        for tag, (kind, values) in tags.items()}
    behind = 8 + 2 + 12 * len(tags) + 4  # where longer values stand, then the pixels
    content[273] = struct.pack("<I", behind + sum(len(c) + len(c) % 2 for c in content.values() if len(c) > 4))
    entries, longer = b"", b""
    for tag, (kind, values) in sorted(tags.items()):
        entries += struct.pack("<HHI", tag, types[kind], len(values))
        if len(content[tag]) > 4:
            entries += struct.pack("<I", behind + len(longer))
            longer += content[tag] + b"\0" * (len(content[tag]) % 2)
        else:
            entries += content[tag].ljust(4, b"\0")
    path.write_bytes(b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + bytes(4) + longer + pixels)


class CameraRaw(TestInFolder):
    def test_raw_files_have_linear_values_in_one_scale(self):
        source = self.folder / "raw"
        source.mkdir()
        for i, level in enumerate((0.8, 0.4, 0.2)):
            dng(source / f"{i}.dng", 64, 48, level)
        (source / "dome.lp").write_text("3\n0.dng 0 0 1\n1.dng 0.6 0 0.8\n2.dng 0 0.6 0.8\n")
        (source / "light_intensities.txt").write_text("1 1 1\n" * 3)
        succeed("import", source, "-o", self.folder / "capture")
        report = succeed("pack", self.folder / "capture", "-o", self.folder / "model.srf")
        self.assertAlmostEqual(report["white"], 0.8, delta=0.001)


if __name__ == "__main__":
    unittest.main()
