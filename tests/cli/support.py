"""Helpers for the command-line tests: running `surflect`, a small capture and a script."""

import functools
import itertools
import json
import os
import pathlib
import shutil
import struct
import subprocess
import tempfile
import unittest

SURFLECT = os.environ["SURFLECT"]
FILM_CHECK = os.environ["FILM_CHECK"]
ROOT = pathlib.Path(__file__).resolve().parents[2]
VASE = ROOT / "examples" / "vase"
CAT = ROOT / "examples" / "cat"
COMMANDS = ["demo", "import", "capture", "relight", "pack", "script", "render", "export", "view", "web", "evaluate", "chart", "verify", "inspect"]

# Seen from between the cameras of the small capture, under warps that bend, and two lights.
SCRIPT = """
model = "model.srf"
[frames]
first = 1
last = 3
[output]
size = [120, 90]
path = "frame.##.exr"
png = true
aov = ["depth", "normal", "camera_blend", "light_blend", "stretch"]
[camera]
position = ["4 + s", -0.5, 1]
look_at = [0, 0, 0]
up = [0, 0, 1]
fov_deg = 32
[[light]]
type = "point"
position = ["3*cos(3*s)", "3*sin(3*s)", 1]
color = [1, 0.7, 0.4]
intensity = 30
[[light]]
type = "directional"
direction = [1, -1, 1]
[[warp]]
type = "twist"
axis = [0, 0, 1]
angle_deg = [[1, 0], [3, 40]]
"""

# A lumpy ball, seen from 16 sides under 16 lights; two more of both are for the test.
STAGE = """
samples = 16
transport = "local"
[camera]
model = "orthographic"
size = [24, 24]
distance = 5
height = 2.2
[views]
turntable = 8
elevations_deg = [-30, 30]
test = 2
[lights]
count = 16
test = 2
irradiance = [3, 3, 3]
[[material]]
name = "clay"
type = "rough_diffuse"
albedo = [0.8, 0.4, 0.2]
roughness = 0.5
[[object]]
type = "bumpy_sphere"
material = "clay"
radius = 0.8
amplitude = 0.1
frequency = 4
segments = 64
"""
# With so few lights, a sixth of the frames.
GLOSSY_BALL = """
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
SMALL_STAGE = STAGE.replace("count = 16", "count = 2").replace("test = 2\nirradiance", "test = 1\nirradiance")


def run(*arguments):
    """A finished `surflect`: returncode, stdout, stderr."""
    return subprocess.run([SURFLECT, *map(str, arguments)], capture_output=True, text=True, timeout=300)


def succeed(*arguments):
    """The JSON report of a `surflect` that must do its work."""
    result = run(*arguments, "--json")
    if result.returncode != 0:
        raise AssertionError(f"surflect {arguments} failed: {result.stderr}")
    return json.loads(result.stdout)


def content(folder):
    """The bytes of every file below the folder, by relative path."""
    return {path.relative_to(folder).as_posix(): path.read_bytes()
            for path in sorted(folder.rglob("*")) if path.is_file()}


@functools.cache
def coarse_vase():
    """The vase's mesh with vertices of one cell merged, a tenth of its triangles: packed in half the time."""
    header, end, body = (VASE / "vase.ply").read_bytes().partition(b"end_header\n")
    words = header.split()
    vertices, faces = (int(words[words.index(name) + 1]) for name in (b"vertex", b"face"))
    cell = 0.04  # of an object two high
    merged, index_of, kept = {}, [], []
    for point in struct.iter_unpack("<3f", body[:12 * vertices]):
        index = merged.setdefault(tuple(round(x / cell) for x in point), len(kept))
        if index == len(kept):
            kept.append(struct.pack("<3f", *point))
        index_of.append(index)
    corners = (tuple(index_of[i] for i in face[1:])
               for face in struct.iter_unpack("<B3H", body[12 * vertices:12 * vertices + 7 * faces]))
    triangles = {frozenset(face): struct.pack("<B3H", 3, *face) for face in corners if len(set(face)) == 3}
    header = header.replace(b"vertex %d" % vertices, b"vertex %d" % len(kept))
    return header.replace(b"face %d" % faces, b"face %d" % len(triangles)) + end + b"".join([*kept, *triangles.values()])


def write_small_capture(folder, cameras, lights, coarse=False):
    """A few of the vase's cameras and lights, and a dozen of its photographs to evaluate.

    coarse: for tests in which neither the mesh nor the quality of pictures counts.
    """
    capture = json.loads((VASE / "transforms.json").read_text())
    training = {(f"C{4 * i + 13}", f"L{4 * j + 5:02}") for i in range(cameras) for j in range(lights)}
    test = {*itertools.product(("V01", "V03"), ("L05", "L17", "T01", "T02")),
            *itertools.product(("C13", "C21"), ("L07", "L19"))}
    kept = []
    for frame in capture["frames"]:
        pair = frame["camera"], frame["light"]
        if pair in training | test:
            kept.append({**frame, "split": "train" if pair in training else "test"})
    capture["frames"] = kept
    folder.mkdir()
    (folder / "transforms.json").write_text(json.dumps(capture))
    shutil.copytree(VASE / "images", folder / "images")
    if coarse:
        (folder / "vase.ply").write_bytes(coarse_vase())
    else:
        shutil.copy(VASE / "vase.ply", folder)


class TestInFolder(unittest.TestCase):
    """Every test class has an empty folder of its own."""

    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(holder.cleanup)
        cls.folder = pathlib.Path(holder.name)

    @classmethod
    def write_small_shot(cls, cameras, lights, script=SCRIPT, coarse=False):
        """A small capture, and a script for the model that will be packed of it."""
        cls.capture, cls.model, cls.script = (cls.folder / n for n in ("capture", "model.srf", "film.toml"))
        write_small_capture(cls.capture, cameras, lights, coarse)
        cls.script.write_text(script)

    def assert_same_files(self, got, wanted, message=None):
        """Compares what content() gives, and names the files that differ."""
        differ = [name for name in sorted(got.keys() | wanted.keys()) if got.get(name) != wanted.get(name)]
        self.assertEqual(differ, [], message)
