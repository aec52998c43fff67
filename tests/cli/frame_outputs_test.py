"""What `surflect render` gives beside its pictures: attributes of the EXR, maps, events, and frames in a viewer."""

import json
import math
import pathlib
import re
import socket
import struct
import subprocess
import threading
import unittest

from exr import read_exr, read_header
from png import read_png
from support import SCRIPT, SURFLECT, TestInFolder, content, run, succeed

LAYERS = SCRIPT.replace('"stretch"]', '"stretch", "position"]')
NAME = "film.toml"


# A matte ball seen from all sides, under light from all sides.
BALL = """
samples = 16
transport = "direct"
[camera]
model = "orthographic"
size = [48, 48]
distance = 5
height = 2.2
[views]
turntable = 8
elevations_deg = [-30, 30]
[lights]
count = 64
irradiance = [3, 3, 3]
[[material]]
name = "clay"
type = "lambert"
albedo = [0.8, 0.4, 0.2]
[[object]]
type = "sphere"
material = "clay"
radius = 1
segments = 64
"""
BALL_FILM = """
model = "ball.srf"
[frames]
first = 1
last = 1
[output]
size = [96, 96]
path = "f.#.exr"
maps = ["albedo"]
[camera]
position = [4, 1, 0.5]
look_at = [0, 0, 0]
fov_deg = 32
[[light]]
type = "directional"
direction = [1, 0, 1]
"""


def linear(sample):
    encoded = sample / 65535
    return encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4


class TevServer:
    """The image viewer tev, as far as a client sees it [github.com/Tom94/tev, Ipc.h]."""

    def __init__(self, reads=True):
        self.pictures, self.created, self.problem = [], [], None
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.thread = threading.Thread(target=self.serve if reads else self.hang, daemon=True)
        self.thread.start()

    def hang(self):
        with self.listener:
            self.connection, _ = self.listener.accept()

    def serve(self):
        with self.listener:
            connection, _ = self.listener.accept()
        with connection, connection.makefile("rb") as stream:
            while head := stream.read(4):
                try:
                    self.take(stream.read(struct.unpack("<I", head)[0] - 4))
                except Exception as problem:
                    self.problem = problem
                    raise

    def take(self, packet):
        kind, at = packet[0], 2

        def text():
            nonlocal at
            end = packet.index(b"\0", at)
            value, at = packet[at:end].decode(), end + 1
            return value

        def numbers(form):
            nonlocal at
            values = struct.unpack_from("<" + form, packet, at)
            at += struct.calcsize("<" + form)
            return values

        name = text()
        if kind == 4:  # CreateImage
            width, height, count = numbers("3i")
            self.size = width, height
            self.created.append((name, width, height, [text() for _ in range(count)]))
        elif kind == 6:  # UpdateImageV3
            count, = numbers("i")
            channels = [text() for _ in range(count)]
            x, y, width, height = numbers("4i")
            offsets, strides = numbers(f"{count}q"), numbers(f"{count}q")
            floats = numbers(f"{(len(packet) - at) // 4}f")
            if x != 0 or width != self.size[0] or name != self.created[0][0]:
                raise AssertionError(f"lines of {name} from {x}, {width} wide")
            if y == 0:
                self.pictures.append({channel: [] for channel in channels})
            for channel, offset, stride in zip(channels, offsets, strides):
                self.pictures[-1][channel] += floats[offset::stride][:width * height]
        else:
            raise AssertionError(f"a packet of type {kind}")
        if at != len(packet):
            raise AssertionError(f"{len(packet) - at} bytes after a packet's end")


def half(value):
    return struct.unpack("<e", struct.pack("<e", value))[0]


class FrameOutputs(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=3, lights=3, coarse=True)
        succeed("pack", cls.capture, "-o", cls.model, "--surfels", "20000", "--tables", "off")
        cls.script.write_text(LAYERS)
        cls.report = cls.render("film")
        cls.film = content(cls.folder / "film")

    @classmethod
    def render(cls, name, *options):
        return succeed("render", cls.script, "-o", cls.folder / name, *options)

    def script_with(self, name, **lines):
        """A script with more keys in a table."""
        path, text = self.folder / name, LAYERS
        for table, line in lines.items():
            text = text.replace(f"[{table}]\n", f"[{table}]\n{line}\n")
        path.write_text(text)
        return path

    # Attributes.

    def test_world_to_ndc_projects_each_position_onto_its_own_pixel(self):
        offsets = []
        for frame in (1, 2, 3):
            path = self.folder / "film" / f"frame.{frame:02}.exr"
            self.assertEqual(read_header(path)[0]["worldToNDC"][0], "m44f")
            # OpenImageIO reads matrix and positions.
            shown = subprocess.run(["oiiotool", "--info", "-v", path], capture_output=True, text=True, check=True).stdout
            found = re.search(r"worldtoNDC: ([-\d.e+, ]+)", shown, re.I)
            m = [float(x) for x in re.findall(r"[-\d.e+]+", found[1])]
            self.assertEqual(len(m), 16)
            places = self.folder / "places.exr"
            subprocess.run(["oiiotool", path, "--ch", "A,position.X,position.Y,position.Z", "-o", places], check=True)
            samples = subprocess.run(["oiiotool", "--info", "-v", "--dumpdata", places], capture_output=True, text=True, check=True).stdout
            width, height = 120, 90
            for i, j, values in re.findall(r"Pixel \((\d+), (\d+)\): ([-\d.e+ ]+)", samples):
                alpha, *p = map(float, values.split())
                if alpha < 1:
                    continue
                x, y, _, w = (sum((p + [1])[row] * m[4 * row + column] for row in range(4)) for column in range(4))
                offsets.append((x / w * width - int(i) - 0.5, y / w * height - int(j) - 0.5))
        worst = max(abs(x) for offset in offsets for x in offset)
        means = [sum(offset) / len(offsets) for offset in zip(*offsets)]
        print(f"worldToNDC: {len(offsets)} pixels, at most {worst:.4f} pixels off, in the mean {means[0]:.4f} and {means[1]:.4f}")
        self.assertGreater(len(offsets), 3000)
        self.assertLess(worst, 1)
        self.assertLess(max(map(abs, means)), 0.0024)

    def test_world_to_camera_gives_each_position_its_depth(self):
        path = self.folder / "film" / "frame.02.exr"
        m = struct.unpack("<16f", read_header(path)[0]["worldToCamera"][1])
        _, _, layers = read_exr(path)
        errors = sorted(abs(sum(layers[f"position.{axis}"][i] * m[4 * row + 2] for row, axis in enumerate("XYZ")) + m[14] -
                            layers["depth.Z"][i]) for i, alpha in enumerate(layers["A"]) if alpha == 1)
        middle, most = errors[len(errors) // 2], errors[len(errors) * 9 // 10]
        print(f"worldToCamera: depths of {len(errors)} pixels differ by {middle:.5f}, 9 of 10 by less than {most:.5f}")
        self.assertLess(most, 0.0026)  # where surfaces share a pixel, position and depth are different means

    def test_a_foreign_reader_finds_the_standard_attributes(self):
        script = self.script_with("owner.toml", output='owner = "A Studio"', frames="fps = 23.976")
        succeed("render", script, "-o", self.folder / "owner", "--frames", "2")
        info = subprocess.run(["oiiotool", "--info", "-v", self.folder / "owner" / "frame.02.exr"], capture_output=True,
                              text=True, check=True).stdout
        for line in (r"FramesPerSecond: 24000/1001 ", r"worldtocamera: -?\d", r"worldtoNDC: -?\d", r"(owner|Copyright): \"A Studio\"",
                     r"Software: \"surflect \d", r"imageCounter: 2\b", r"screenWindowWidth: 0\.7646", r"screenWindowCenter: 0, 0",
                     r"PixelAspectRatio: 1\b", r"chromaticities: 0\.64, 0\.33"):
            self.assertRegex(info, re.compile(line, re.I))
        self.assertNotIn("owner", read_header(self.folder / "film" / "frame.02.exr")[0])

    # Maps.

    def test_maps_agree_with_the_layers_that_they_show(self):
        script = self.script_with("maps.toml", output='maps = ["normal", "height", "albedo"]')
        report = succeed("render", script, "-o", self.folder / "maps", "--frames", "2")
        names = [f"frame.02.{name}.png" for name in ("normal", "height", "albedo")]
        self.assertEqual([pathlib.Path(path).name for path in report["frames"][0]["maps"]], names)
        self.assertEqual(sorted(content(self.folder / "maps")), sorted(names + ["frame.02.exr", "frame.02.png"]))
        path = self.folder / "film" / "frame.02.exr"
        self.assertEqual(read_exr(self.folder / "maps" / "frame.02.exr"), read_exr(path))  # frames stay what they are
        _, _, layers = read_exr(path)
        m = struct.unpack("<16f", read_header(path)[0]["worldToCamera"][1])
        normals, heights, albedo = (read_png(self.folder / "maps" / name) for name in names)
        black, white = report["height"]["black"], report["height"]["white"]
        self.assertEqual(black, -white)
        worst_normal, worst_height, middles = 0, 0, []
        for i, alpha in enumerate(layers["A"]):
            if alpha == 0:
                self.assertEqual((normals[i], heights[i], albedo[i]), ((32768, 32768, 65535, 0), (0,) * 2, (0,) * 4))
                continue
            self.assertAlmostEqual(albedo[i][3] / 65535, alpha, delta=3e-4)
            n = [layers[f"normal.{axis}"][i] for axis in "XYZ"]
            length = math.hypot(*n)
            for axis, sign in enumerate((1, 1, -1)):  # z towards the viewer
                wanted = sign * sum(n[row] * m[4 * row + axis] for row in range(3)) / length
                worst_normal = max(worst_normal, abs(2 * normals[i][axis] / 65535 - 1 - wanted))
            middles.append(layers["depth.Z"][i] + black + (white - black) * heights[i][0] / 65535)
        worst_height = (max(middles) - min(middles)) / 2
        print(f"maps: normals {worst_normal:.5f}, heights {worst_height / white * 65535:.3f} of a step")
        self.assertLess(worst_normal, 7e-4)  # the layer's halves
        self.assertLess(worst_height, 1.1 * white / 65535)  # half a step of 2 white / 65535
        for name, pixels in zip(names, (normals, heights, albedo)):
            shown = subprocess.run(["oiiotool", "--no-autopremult", "--info", "-v", "--dumpdata", self.folder / "maps" / name],
                                   capture_output=True, text=True, check=True).stdout
            foreign = [tuple(map(int, samples.split())) for samples in re.findall(r"Pixel \(\d+, \d+\): ([\d ]+) \(", shown)]
            self.assertEqual(foreign, pixels, name)
        self.assertIn(b"tEXtheight of white\0", (self.folder / "maps" / names[1]).read_bytes())

    def test_a_matte_ball_shows_its_albedo(self):
        (self.folder / "ball.toml").write_text(BALL)
        (self.folder / "ball_film.toml").write_text(BALL_FILM)
        succeed("capture", self.folder / "ball.toml", "-o", self.folder / "ball")
        succeed("pack", self.folder / "ball", "-o", self.folder / "ball.srf", "--surfels", "20000", "--tables", "off")
        succeed("render", self.folder / "ball_film.toml", "-o", self.folder / "ball_film")
        whole = [pixel for pixel in read_png(self.folder / "ball_film" / "f.1.albedo.png") if pixel[3] == 65535]
        self.assertGreater(len(whole), 4000)
        for channel, albedo in enumerate((0.8, 0.4, 0.2)):
            shown = sorted(linear(pixel[channel]) / albedo for pixel in whole)
            print(f"albedo {albedo}: times {shown[0]:.4f} to {shown[-1]:.4f}, middle {shown[len(shown) // 2]:.5f}")
            self.assertGreater(shown[0], 0.985)
            self.assertLess(shown[-1], 1.034)
            self.assertLess(abs(shown[len(shown) // 2] - 1), 0.0013)

    def test_a_missing_map_is_rendered_again(self):
        script = self.script_with("resumed.toml", output='maps = ["height"]')
        succeed("render", script, "-o", self.folder / "resumed")
        (self.folder / "resumed" / "frame.02.height.png").unlink()
        report = succeed("render", script, "-o", self.folder / "resumed", "--resume")
        self.assertEqual([frame["frame"] for frame in report["frames"]], [2])

    def test_heights_that_are_clipped_are_told_once(self):
        script = self.script_with("high.toml", output='maps = ["height"]')
        script.write_text(script.read_text() + '[[warp]]\ntype = "rigid"\ntranslate = [1.5, 0, 0]\n')
        result = run("render", script, "-o", self.folder / "high")
        self.assertEqual((result.returncode, result.stderr.count("the height map clips heights of up to")), (0, 1), result.stderr)

    def test_maps_that_cannot_be_are_refused(self):
        for line, complaint in (('maps = ["hight"]', "output.maps[0]: found 'hight'"), ('maps = "normal"', "output.maps: ")):
            result = run("render", self.script_with("bad.toml", output=line), "-o", self.folder / "bad")
            self.assertEqual(result.returncode, 1)
            self.assertIn(complaint.replace("'", ""), result.stderr.replace("'", "").replace('"', ""))

    # Events.

    def test_a_program_can_react_to_a_frame_before_the_film_ends(self):
        script, events = self.folder / "long.toml", []
        script.write_text(LAYERS.replace("last = 3", "last = 90"))
        with subprocess.Popen([SURFLECT, "render", script, "-o", self.folder / "long", "--json-lines"],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            for line in process.stdout:
                events.append(json.loads(line))
                if events[-1]["event"] == "frame" and events[-1]["frame"] == 1:
                    process.terminate()
        self.assertEqual(process.returncode, 143)
        self.assertEqual((events[-1]["event"], events[-1]["status"]), ("end", 143))
        first, = (event for event in events if event["event"] == "frame" and event["frame"] == 1)
        self.assertEqual(read_exr(pathlib.Path(first["file"]))[:2], (120, 90))
        self.assertFalse((self.folder / "long" / "frame.90.exr").exists())

    def test_events_tell_the_course_of_a_film(self):
        result = run("render", self.script, "-o", self.folder / "events", "--json-lines")
        events = [json.loads(line) for line in result.stdout.splitlines()]
        self.assertEqual((events[0]["event"], events[0]["command"]), ("start", "render"))
        film, = (event for event in events if event["event"] == "film")
        self.assertEqual((film["first"], film["last"], film["size"]), (1, 3, [120, 90]))
        frames = [event for event in events if event["event"] == "frame"]
        self.assertEqual([event["frame"] for event in frames], [1, 2, 3])
        self.assertTrue(frames[0]["preview"].endswith("frame.01.png") and "maps" not in frames[0])
        for event in events:
            if event["event"] == "progress":
                self.assertTrue(0 <= event["fraction"] <= 1 and event["stage"], event)
        self.assertEqual((events[-1]["event"], events[-1]["status"]), ("end", 0))
        self.assertEqual(events[-1]["report"].keys(), self.report.keys())
        self.assertEqual(content(self.folder / "events"), self.film)

    def test_an_error_is_the_last_event(self):
        for arguments, status in ((("render", "none.toml", "-o", self.folder / "x"), 1), (("inspect", self.folder / "none.srf"), 1)):
            result = run(*arguments, "--json-lines")
            events = [json.loads(line) for line in result.stdout.splitlines()]
            self.assertEqual(result.returncode, status)
            self.assertEqual((events[-1]["event"], events[-1]["status"]), ("end", status))
            self.assertEqual(f"surflect: {events[-1]['report']['error']}\n", result.stderr)

    def test_events_name_all_files(self):
        script = self.script_with("named.toml", output='maps = ["normal", "albedo"]\nvideo = "film.mp4"')
        result = run("render", script, "-o", self.folder / "named", "--json-lines")
        named = set()
        for event in map(json.loads, result.stdout.splitlines()):
            if event["event"] in ("frame", "video"):
                named |= {event["file"], event.get("preview"), *event.get("maps", [])} - {None}
        self.assertEqual(named, {str(self.folder / "named" / name) for name in content(self.folder / "named")})
        result = run("export", script, "-o", self.folder / "splats" / "##.ply", "--surfels", "500", "--sh", "0", "--json-lines")
        events = [event for event in map(json.loads, result.stdout.splitlines()) if event["event"] == "file"]
        self.assertEqual([(event["frame"], event["bytes"]) for event in events],
                         [(frame, (self.folder / "splats" / f"{frame:02}.ply").stat().st_size) for frame in (1, 2, 3)])

    def test_a_reader_of_events_that_ends_does_not_end_the_film(self):
        with subprocess.Popen([SURFLECT, "render", self.script, "-o", self.folder / "unread", "--json-lines"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            process.stdout.readline()
            process.stdout.close()
            said = process.stderr.read()
        self.assertEqual(process.returncode, 1)
        self.assertEqual(said.count("standard output: cannot write events (Broken pipe); the work goes on\n"), 1, said)
        self.assertEqual(content(self.folder / "unread"), self.film)

    def test_a_usage_error_of_the_work_is_the_last_event(self):
        result = run("render", self.model, "--model", self.model, "-o", self.folder / "x", "--json-lines")
        events = [json.loads(line) for line in result.stdout.splitlines()]
        self.assertEqual((result.returncode, events[0]["event"], events[-1]["event"], events[-1]["status"]), (2, "start", "end", 2))
        result = run("render", self.model, "--json-lines")
        self.assertEqual((result.returncode, result.stdout), (2, ""))

    def test_kept_frames_are_events_too(self):
        self.render("kept")
        result = run("render", self.script, "-o", self.folder / "kept", "--resume", "--json-lines")
        frames = [event for event in map(json.loads, result.stdout.splitlines()) if event["event"] == "frame"]
        self.assertEqual([(frame["frame"], frame["kept"]) for frame in frames], [(1, True), (2, True), (3, True)])

    # Frames in a viewer.

    def test_a_viewer_receives_the_pixels_of_the_frames(self):
        server = TevServer()
        self.render("shown", "--display", f"127.0.0.1:{server.port}")
        server.thread.join(20)
        self.assertIsNone(server.problem)
        self.assertEqual(server.created, [(NAME, 120, 90, ["R", "G", "B", "A"])])
        self.assertEqual(len(server.pictures), 3)
        for frame, picture in enumerate(server.pictures, 1):
            _, _, layers = read_exr(self.folder / "shown" / f"frame.{frame:02}.exr")
            for channel in "RGBA":
                self.assertEqual([half(value) for value in picture[channel]], layers[channel])
        self.assertEqual(content(self.folder / "shown"), self.film)

    def test_without_a_viewer_the_film_is_rendered_and_one_line_says_so(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
        for address in (f"127.0.0.1:{port}", "nowhere.invalid"):
            result = run("render", self.script, "-o", self.folder / "unseen", "--display", address)
            self.assertEqual(result.returncode, 0)
            self.assertEqual(result.stderr.count("display "), 1, result.stderr)
            self.assertIn("rendering goes on without it", result.stderr)
            self.assertEqual(content(self.folder / "unseen"), self.film)

    def test_a_viewer_that_takes_nothing_does_not_hold_the_film(self):
        server = TevServer(reads=False)
        script = self.script_with("large.toml")
        script.write_text(script.read_text().replace("[120, 90]", "[1200, 900]"))  # more than sockets buffer
        result = run("render", script, "-o", self.folder / "held", "--display", f"127.0.0.1:{server.port}")
        self.assertEqual(result.returncode, 0)
        server.connection.close()
        self.assertEqual(result.stderr.count("display 127"), 1, result.stderr)
        self.assertEqual(len(content(self.folder / "held")), 6)

    def test_an_address_that_is_none_is_a_usage_error(self):
        for address in ("", "host:", "host:0", "host:65536", "host:a", ":14158", "[::1", "[::1]x"):
            result = run("render", self.script, "-o", self.folder / "x", "--display", address)
            self.assertEqual(result.returncode, 2, address)
            self.assertIn("--display", result.stderr)


if __name__ == "__main__":
    unittest.main()
