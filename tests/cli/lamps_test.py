"""`surflect import` finds lamps: of path-traced photographs, whose lamps are known."""

import json
import math
import shutil
import unittest

from exr import read_exr
from png import write_png
from support import TestInFolder, run, succeed

# Two matte parts, a glossy body, and a glazed knob.
OBJECT = """
[[material]]
name = "plastic"
type = "ward"
diffuse = [0.2, 0.35, 0.6]
specular = [0.08, 0.08, 0.08]
alpha = [0.15, 0.15]
[[material]]
name = "clay"
type = "lambert"
albedo = [0.5, 0.3, 0.2]
[[material]]
name = "glaze"
type = "clear_coat"
base = "clay"
eta = 1.5
alpha = 0.08
[[object]]
type = "sphere"
material = "plastic"
radius = 0.6
scale = [1, 0.8, 1.1]
[[object]]
type = "sphere"
material = "clay"
radius = 0.4
position = [0.1, 0, 0.75]
[[object]]
type = "sphere"
material = "clay"
radius = 0.35
position = [0, 0.2, -0.75]
[[object]]
type = "sphere"
material = "glaze"
radius = 0.15
position = [-0.6, 0, 0.3]
"""
BALL = (0.1, -0.1, 0.05)
MIRROR_BALL = f"""
[[material]]
name = "chrome"
type = "conductor"
color = [0.9, 0.9, 0.9]
alpha = 0.02
[[object]]
type = "sphere"
material = "chrome"
radius = 1
position = {list(BALL)}
"""
DISTANCE = 5
FLASH = (0.25, 0.35, -0.1)


def around(count, distance):
    """Places around the object, at distance(number)."""
    places = []
    for i in range(count):
        z, angle = 0.9 - 1.5 * i / (count - 1), math.pi * (3 - math.sqrt(5)) * i
        r = math.sqrt(1 - z * z)
        places.append([distance(i) * x for x in (r * math.cos(angle), r * math.sin(angle), z)])
    return places


def write_stage(path, cameras, lamps, material, size, samples):
    path.write_text(f"""samples = {samples}
[camera]
model = "pinhole"
size = [{size}, {size}]
fov_deg = 28
[views]
positions = {cameras}
[lights]
positions = {lamps}
irradiance = [2, 2, 2]
{material}""")


def carried(camera):
    """Place of the flash of a camera that looks at the origin."""
    back = [x / DISTANCE for x in camera]
    length = math.hypot(back[0], back[1])
    right = (-back[1] / length, back[0] / length, 0)
    up = [back[(i + 1) % 3] * right[(i + 2) % 3] - back[(i + 2) % 3] * right[(i + 1) % 3] for i in range(3)]
    return [camera[i] + FLASH[0] * right[i] + FLASH[1] * up[i] + FLASH[2] * back[i] for i in range(3)]


def write_pictures(capture, folder, gain):
    """CAMERA/LIGHT.png of a capture, 8 bits in sRGB, and transforms.json with a pose for each camera."""
    def srgb(x):
        x = min(max(x, 0), 1)
        return round(255 * (12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055))
    description = json.loads((capture / "transforms.json").read_text())
    registered, pictures = {}, {}
    for frame in description["frames"]:
        path = capture / frame["file_path"]
        if path not in pictures:
            pictures = {path: read_exr(path)}
        width, height, values = pictures[path]
        alpha = values[frame["alpha_layer"] + ".A"] if frame["alpha_layer"] + ".A" in values else values["A"]
        channels = [values[f"{frame['layer']}.{c}"] for c in "RGB"]
        rows = [[tuple(srgb(gain * c[i] / alpha[i]) if alpha[i] > 0 else 0 for c in channels) + (round(255 * alpha[i]),)
                 for i in range(y * width, (y + 1) * width)] for y in range(height)]
        name = f"{frame['camera']}/{frame['light']}.png"
        (folder / frame["camera"]).mkdir(parents=True, exist_ok=True)
        write_png(folder / name, rows)
        registered.setdefault(frame["camera"], {"file_path": name, "transform_matrix": frame["transform_matrix"]})
    lens = {key: description[key] for key in ("w", "h", "fl_x", "fl_y", "cx", "cy")}
    (folder / "transforms.json").write_text(json.dumps({**lens, "frames": list(registered.values())}))


def lights_of(capture):
    return {light["name"]: light for light in json.loads((capture / "transforms.json").read_text())["lights"]}


class Flash(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.capture = cls.folder / "stage"
        cameras = around(14, lambda i: DISTANCE)
        write_stage(cls.folder / "stage.toml", cameras, [carried(camera) for camera in cameras], OBJECT, 64, 16)
        succeed("capture", cls.folder / "stage.toml", "-o", cls.capture)
        description = json.loads((cls.capture / "transforms.json").read_text())
        frames = [frame for frame in description["frames"] if frame["camera"][1:].lstrip("0") == frame["light"][1:].lstrip("0")]
        assert len(frames) == 14
        for frame in frames:
            del frame["light"]
        del description["lights"]
        cls.mesh = cls.capture / description.pop("geometry")
        cls.description = {**description, "frames": frames}

    def imported(self, frames, *arguments):
        source = self.capture / "flash.json"
        source.write_text(json.dumps({**self.description, "frames": frames}))
        out = self.folder / f"flash{len(list(self.folder.iterdir()))}"
        return out, run("import", source, "-o", out, "--flash", *arguments)

    def test_its_place_is_found_by_the_shading_of_a_partly_glossy_object(self):
        out, result = self.imported(self.description["frames"], "auto", "--mesh", self.mesh)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("flash found from shading at (", result.stderr)
        camera = self.description["frames"][0]["transform_matrix"]
        place = next(iter(lights_of(out).values()))["position"]
        seen = [sum(camera[row][axis] * (place[row] - camera[row][3]) for row in range(3)) for axis in range(3)]
        off = math.dist(seen, FLASH) / math.dist(carried([row[3] for row in camera[:3]]), (0, 0, 0))
        self.assertLess(off, 0.0048) # 0.0024

    def test_what_the_photographs_do_not_tell_is_said(self):
        frames = self.description["frames"]
        for (used, *arguments), problem in (
                ((frames, "auto"), "--flash auto: shading tells places of lamps only on a known surface: --mesh"),
                ((frames[:1], "auto", "--mesh", self.mesh), "--flash auto: found 0, expected at least 50 points of the mesh"),
                ((frames, "auto", "--mesh", self.folder / "none.ply"), "none.ply: --flash auto: cannot open"),
                ((frames, "auto", "1", "2"), "--flash: found auto 1 2, expected three numbers X Y Z, or auto"),
                ((frames, "0", "nan", "0"), "--flash: found 0 nan 0, expected three numbers X Y Z, or auto")):
            out, result = self.imported(used, *arguments)
            self.assertEqual(result.returncode, 2 if "three numbers" in problem else 1, result.stderr)
            self.assertIn(problem, result.stderr)
            self.assertFalse(out.exists())


class Lamps(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.cameras = around(5, lambda i: DISTANCE)
        cls.lamps = around(6, lambda i: 3 + 0.3 * i)
        # The ball is exposed for its highlights.
        for name, material, size, gain in (("object", OBJECT, 64, 1), ("ball", MIRROR_BALL, 160, 0.003)):
            write_stage(cls.folder / f"{name}.toml", cls.cameras, cls.lamps, material, size, 16)
            succeed("capture", cls.folder / f"{name}.toml", "-o", cls.folder / f"{name}-stage")
            write_pictures(cls.folder / f"{name}-stage", cls.folder / name, gain)
        cls.truth = lights_of(cls.folder / "object-stage")
        cls.mesh = cls.folder / "object-stage" / json.loads((cls.folder / "object-stage/transforms.json").read_text())["geometry"]

    def imported(self, *arguments):
        out = self.folder / f"out{len(list(self.folder.iterdir()))}"
        return out, run("import", self.folder / "object", "-o", out, "--pattern", "{camera}/{light}.png", *arguments)

    def offs(self, out):
        """Errors of the places over their distances from the origin."""
        found = lights_of(out)
        self.assertEqual(set(found), set(self.truth))
        return [math.dist(found[name]["position"], light["position"]) / math.hypot(*light["position"])
                for name, light in self.truth.items()]

    def test_their_places_and_strengths_are_found_by_shading(self):
        out, result = self.imported("--lights", "auto", "--mesh", self.mesh)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("found from shading: 6 lamps at places", result.stderr)
        self.assertLess(max(self.offs(out)), 0.008) # 0.0040
        ratios = [light["intensity"][0] / self.truth[name]["intensity"][0] for name, light in lights_of(out).items()]
        self.assertLess(max(ratios) / min(ratios), 1.016) # 1.009

    def test_their_places_are_found_by_a_mirror_ball_in_several_views(self):
        out, result = self.imported("--chrome-ball", self.folder / "ball")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("mirror ball of radius ", result.stderr)
        self.assertLess(max(self.offs(out)), 0.035) # 0.019

    def test_directions_of_one_view_are_found_by_a_mirror_ball(self):
        out = self.folder / "front"
        succeed("import", self.folder / "object/C000", "-o", out, "--chrome-ball", self.folder / "ball/C000", "--fov", "28")
        camera = json.loads((self.folder / "ball/transforms.json").read_text())["frames"][0]["transform_matrix"]

        def unit(v):
            return [x / math.hypot(*v) for x in v]

        for name, light in lights_of(out).items():
            # In the camera's axes, from the ball's centre; the ball reflects where its normal is between lamp and camera.
            lamp, eye = ([sum(camera[row][axis] * (place[row] - BALL[row]) for row in range(3)) for axis in range(3)]
                         for place in (self.truth[name]["position"], [row[3] for row in camera[:3]]))
            view = unit(eye)
            for _ in range(5):
                normal = unit([a + b for a, b in zip(view, light["direction"])])
                view = unit([a - b for a, b in zip(eye, normal)])
            towards = unit([a - b for a, b in zip(lamp, normal)])
            self.assertLess(math.degrees(math.dist(towards, light["direction"])), 1.7, name) # 0.86

    def test_mistakes_are_named(self):
        for arguments, code, problem in (
                (("--lights", "auto"), 1, "--lights auto: shading tells places of lamps only on a known surface: --mesh"),
                (("--chrome-ball", self.folder / "ball-stage"), 1, "ball-stage: found "),
                (("--chrome-ball", self.folder / "ball", "--lights", "auto"), 2, "only one of --lights, --chrome-ball and --lamp-images"),
                (("--chrome-ball", self.folder / "ball", "--positions"), 2, "--positions: a mirror ball has no light file")):
            out, result = self.imported(*arguments)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(problem, result.stderr)
            self.assertFalse(out.exists())
        lights = self.folder / "object/C000/front.lp"
        lights.write_text("1\nL000.png 0 0 1\n")
        try:
            for source, arguments, problem in (
                    ("object", ("--chrome-ball", self.folder / "ball"), "--chrome-ball: needs --pattern, which tells cameras and lights"),
                    ("object", ("--flash", "0", "0", "0", "--chrome-ball", self.folder / "ball"), "--flash: the camera carries the light; --chrome-ball tells others"),
                    ("object", ("--flash", "0", "0", "0", "--lights", lights), "--flash: the camera carries the light; --lights tells others"),
                    ("object/C000/front.lp", ("--chrome-ball", self.folder / "ball/C000"), "--chrome-ball: found ")):
                out = self.folder / "none"
                result = run("import", self.folder / source, "-o", out, *arguments)
                self.assertEqual(result.returncode, 2, result.stderr)
                self.assertIn(problem, result.stderr)
                self.assertFalse(out.exists())
        finally:
            lights.unlink()

    def test_another_mesh_is_told_before_cameras_are_blamed(self):
        # Waves, whose normals are not the object's.
        vertices, faces = [], []
        for i in range(16):
            for j in range(32):
                polar, angle = math.pi * (i + 0.5) / 16, 2 * math.pi * j / 32
                radius = 0.7 * (1 + 0.3 * math.sin(4 * polar) * math.sin(5 * angle))
                vertices.append((radius * math.sin(polar) * math.cos(angle), radius * math.sin(polar) * math.sin(angle), radius * math.cos(polar)))
                if i < 15:
                    a, b = 32 * i + j + 1, 32 * i + (j + 1) % 32 + 1
                    faces += [(a, a + 32, b), (b, a + 32, b + 32)]
        other = self.folder / "other.obj"
        other.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in vertices) + "".join(f"f {a} {b} {c}\n" for a, b, c in faces))
        out, result = self.imported("--lights", "auto", "--mesh", other)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("between the photographs and a Lambert surface of the mesh", result.stderr)
        self.assertFalse(out.exists())

    def test_lamps_need_only_be_photographed_by_some_registered_cameras(self):
        # L900 by an unregistered camera alone, and L01 by two of the five.
        folder = self.folder / "sparse"
        shutil.copytree(self.folder / "object", folder)
        (folder / "C900").mkdir()
        (folder / "C000/L00.png").rename(folder / "C900/L900.png")
        for camera in range(3):
            (folder / f"C{camera:03}/L01.png").unlink()
        description = json.loads((folder / "transforms.json").read_text())
        for frame in description["frames"]:
            frame["file_path"] = frame["file_path"][:-7] + "L02.png"
        (folder / "transforms.json").write_text(json.dumps(description))
        out = self.folder / "sparse-out"
        result = run("import", folder, "-o", out, "--pattern", "{camera}/{light}.png", "--lights", "auto", "--mesh", self.mesh)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("1 lamp left out, of cameras without a registered picture alone: L900", result.stderr)
        self.assertIn("found from shading: 6 lamps at places", result.stderr)
        self.assertLess(max(self.offs(out)), 0.009) # 0.0046


if __name__ == "__main__":
    unittest.main()
