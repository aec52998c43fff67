"""`surflect web` of light field maps: the page of an object that is turned, opened from its folder in headless Chromium.

Its pictures are compared with those of `surflect render` from the same camera. Tests print decibels with SHOW_DECIBELS.
"""

import base64
import json
import os
import pathlib
import shutil
import tempfile
import unittest

import numpy
from selenium.webdriver.common.keys import Keys

from png import read_png
from support import VASE, TestInFolder, content, run, succeed
from web_browser import TestOfPage, argument_of, canvas_of, decibels, pictures_of_object

LAMP = """
[[light]]
type = "directional"
direction = [1, -1, 1]
"""
SMALL = ["--triangles", "300", "--samples", "6", "--view-size", "8"]



def setUpModule():
    """Small models of the vase under one lamp: a plain one, with products of bytes; with codebooks and S3TC; without negative values."""
    global MODELS
    MODELS = pathlib.Path(unittest.enterModuleContext(tempfile.TemporaryDirectory()))
    (MODELS / "lamp.toml").write_text(LAMP)
    succeed("relight", VASE, "--lights", MODELS / "lamp.toml", "--common-lights", "-o", MODELS / "views")
    for name, options in (("plain", []), ("small", ["--vq", "2", "--vq-means", "--s3tc"]), ("nmf", ["--factors", "nmf", "--s3tc"])):
        succeed("pack", MODELS / "views", "--method", "lfm", "-o", MODELS / f"{name}.lfm", *SMALL, *options)


class ObjectPage(TestOfPage):
    is_ready = "return Boolean(surflect.app) && !surflect.app.busy"

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.reports = {name: succeed("web", MODELS / f"{name}.lfm", "-o", cls.folder / name, "--title", "A <vase>", "--mm-per-unit", "50")
                       for name in ("plain", "small", "nmf")}

    def setUp(self):
        self.page.set_window_size(760, 480)
        self.open(self.folder / "small")

    def view(self):
        return self.js("return surflect.app.state.view")

    def assert_shown(self, name, least=50, **turned):
        """Compares the page's picture, seen from other angles, with the program's; over all pixels that show the object."""
        shown, wanted = pictures_of_object(self.page, MODELS / f"{name}.lfm", self.folder, **turned)
        self.assertGreater(wanted.std(), 0.1)
        if "SHOW_DECIBELS" in os.environ:
            print(f"{name}: {decibels(shown, wanted):.1f} dB, mean {wanted.mean():.2f}")
        self.assertGreater(decibels(shown, wanted), least)

    def test_the_picture_is_that_of_the_program(self):
        self.assert_shown("small")
        self.assert_shown("small", azimuth=40, elevation=35)
        for name in ("plain", "nmf"):
            self.open(self.folder / name)
            self.assert_shown(name, azimuth=-75, elevation=-20)

    def test_blocks_are_decoded_where_the_browser_has_none(self):
        html = self.folder / "small/index.html"
        text = html.read_text()
        try:
            without = 'const ask = WebGL2RenderingContext.prototype.getExtension; WebGL2RenderingContext.prototype.getExtension = function (name) { return /s3tc|color_buffer/.test(name) ? null : ask.call(this, name); };'
            html.write_text(text.replace('<script src="start.js">', f'<script>{without}</script><script src="start.js">'))
            self.open(self.folder / "small")
            self.assertFalse(self.js("return surflect.app.drawing.s3tc !== null || surflect.app.drawing.isHalf"))
            self.assert_shown("small", least=42, azimuth=40, elevation=35)
        finally:
            html.write_text(text)

    def test_a_mouse_turns_the_wheel_nears_and_keys_do_both(self):
        first = self.view()
        self.drag(self.by("canvas"), (0, 0), (30, 0), (60, 20))
        turned = self.view()
        self.assertAlmostEqual((first["azimuth"] - turned["azimuth"]) % 360, 60 * 240 / self.js("return document.getElementById('stage').clientHeight"), delta=1)
        self.assertGreater(turned["elevation"], first["elevation"] + 5)
        canvas = self.by("canvas")
        self.page.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mouseWheel", "x": canvas.rect["x"] + canvas.rect["width"] / 2 + 30, "y": canvas.rect["y"] + canvas.rect["height"] / 2 - 20, "deltaX": 0, "deltaY": -200})
        self.assertAlmostEqual(self.view()["zoom"], numpy.exp(0.5), delta=0.01)
        # What is under the pointer stays there: the target moves towards it by the share that leaves the picture.
        units = 2 * numpy.tan(numpy.radians(15)) * turned["distance"] / canvas.rect["height"]
        self.assertAlmostEqual(numpy.linalg.norm(self.view()["target"]) / (numpy.hypot(30, 20) * units * (1 - numpy.exp(-0.5))), 1, delta=0.05)
        canvas.send_keys(Keys.ARROW_LEFT, Keys.ARROW_LEFT, Keys.ARROW_DOWN, "+")
        keyed = self.view()
        self.assertAlmostEqual((keyed["azimuth"] - turned["azimuth"]) % 360, 10, delta=0.01)
        self.assertAlmostEqual(keyed["elevation"] - turned["elevation"], 5, delta=0.01)
        self.assertAlmostEqual(keyed["zoom"], 1.25 * numpy.exp(0.5), delta=0.01)
        canvas.send_keys(Keys.SHIFT, Keys.ARROW_UP)
        self.assertNotEqual(self.view()["target"], first["target"])
        self.press("#home")
        self.assertEqual(self.view(), first)
        azimuth = self.by("azimuth")
        azimuth.send_keys(Keys.CONTROL, "a", Keys.NULL, "75")
        self.assertEqual(self.view()["azimuth"], 75)
        elevation = self.by("elevation")
        elevation.send_keys(Keys.CONTROL, "a", Keys.NULL, "100", Keys.TAB)
        self.assertEqual(elevation.get_attribute("value"), "89")
        self.js("document.getElementById('azimuth').focus(); document.getElementById('home').onclick()")
        self.assertEqual(self.by("azimuth").get_attribute("value"), str(round(first["azimuth"])))

    def test_the_nearest_picture_still_shows_the_object(self):
        for _ in range(12):
            self.press("#in")
        self.assertEqual(self.view()["zoom"], 50)
        background = self.js("return getComputedStyle(document.getElementById('stage')).backgroundColor.match(/[\\d.]+/g).map(Number)")
        width, height = self.js("return [surflect.app.canvas.width, surflect.app.canvas.height]")
        shown = canvas_of(self.page, width // 2 - 20, height // 2 - 20, 40, 40)
        self.assertTrue((numpy.abs(shown - numpy.array(background) / 255).max(2) > 2 / 255).all())

    def test_a_finger_turns_and_two_near(self):
        self.screen(390, 844)
        first = self.view()
        self.touch("touchStart", (0, 0))
        self.touch("touchMove", (40, 0))
        self.touch("touchEnd")
        turned = self.view()
        self.assertAlmostEqual((first["azimuth"] - turned["azimuth"]) % 360, 40 * 240 / 390, delta=0.1)
        self.touch("touchStart", (-30, 0), (30, 0))
        self.touch("touchMove", (-60, 0), (60, 0))
        self.touch("touchEnd")
        self.assertAlmostEqual(self.view()["zoom"], 2, delta=0.1)
        self.full_screen()

    def test_nothing_is_drawn_while_nothing_changes(self):
        count = """
            const done = arguments[0], { drawing } = surflect.app, draw = drawing.draw;
            let drawn = 0;
            drawing.draw = (...given) => { ++drawn; draw.apply(drawing, given); };
            setTimeout(() => { drawing.draw = draw; done(drawn); }, 400);"""
        for _ in range(20):  # what was asked for before
            if self.page.execute_async_script(count) == 0:
                break
        self.assertEqual(self.page.execute_async_script(count), 0)
        self.by("canvas").send_keys(Keys.ARROW_LEFT)
        self.assertGreater(self.page.execute_async_script(count), 0)

    def test_a_scale_bar_is_as_long_as_it_says(self):
        text, length = self.js("return [document.querySelector('#overlay text').textContent, document.getElementById('bar').getBBox().width]")
        number, unit = text.split()
        units = float(number) * {"mm": 1, "cm": 10}[unit] / 50
        # Two points on the surface in the middle, so far from each other, stand as far from each other on the screen.
        a, b = self.js("""
            const { state, drawing } = surflect.app, { up, radius, fov } = surflect.page.camera, { orbit } = surflect, stage = document.getElementById("stage");
            const frame = orbit.frameOf(state.view, up), matrix = orbit.clipFromObject(frame, orbit.tangentsOf(fov, stage.clientWidth / stage.clientHeight, state.view.zoom), radius);
            const onScreen = (p) => {
              const [x, y, , w] = [0, 1, 2, 3].map((row) => matrix[row] * p[0] + matrix[4 + row] * p[1] + matrix[8 + row] * p[2] + matrix[12 + row]);
              return [(1 + x / w) * stage.clientWidth / 2, (1 - y / w) * stage.clientHeight / 2];
            };
            const corners = [...Array(drawing.count).keys()].map((t) => [0, 1, 2].map((i) => [...drawing.positions.subarray(3 * drawing.triangles[3 * t + i], 3 * drawing.triangles[3 * t + i] + 3)]));
            const middle = [stage.clientWidth / 2, stage.clientHeight / 2], cross = (a, b, p) => (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
            const near = (corner) => Math.hypot(...corner.map((x, i) => frame.eye[i] - x));
            const holds = corners.filter((each) => { const [a, b, c] = each.map(onScreen); return Math.max(cross(a, b, middle), cross(b, c, middle), cross(c, a, middle)) <= 0; });
            const [a, b, c] = holds.sort((s, t) => near(s[0]) - near(t[0]))[0], [p, q, r] = [a, b, c].map(onScreen), all = cross(p, q, r);
            const hit = a.map((x, i) => (x * cross(q, r, middle) + b[i] * cross(r, p, middle) + c[i] * cross(p, q, middle)) / all);
            return [hit, hit.map((x, i) => x + arguments[0] * frame.right[i])].map(onScreen);""", units)
        self.assertAlmostEqual(length, numpy.hypot(a[0] - b[0], a[1] - b[1]), delta=0.01 * length)

    def variant(self, name, change):
        """A copy of a page whose data are changed by a function."""
        site = self.folder / name
        shutil.copytree(self.folder / "small", site)
        data = argument_of((site / "data.js").read_text())
        change(data)
        (site / "data.js").write_text(f"surflect.data({json.dumps(data)});\n")
        return site

    def test_where_up_is_minus_y_the_camera_is_that_of_the_program(self):
        self.open(self.variant("down", lambda data: data["camera"].update(up=[0, -1, 0])))
        self.assert_shown("small", least=48, azimuth=40, elevation=10)

    def test_far_from_the_origin_the_picture_is_the_same(self):
        far = 1000 * 2 ** 6  # a power of two times an integer: both pages have the very same positions

        def moved(data, shift):
            positions = numpy.frombuffer(base64.b64decode(data["positions"]), numpy.float32)
            data["positions"] = base64.b64encode(((positions + numpy.float32(far)) - numpy.float32(far - shift)).tobytes()).decode()
            data["camera"]["center"] = [x + shift for x in data["camera"]["center"]]

        pictures = []
        for name, shift in (("near", 0), ("far", far)):
            self.open(self.variant(name, lambda data: moved(data, shift)))
            pictures.append(canvas_of(self.page, 0, 0, *self.js("return [surflect.app.canvas.width, surflect.app.canvas.height]")))
        self.assertLess(numpy.abs(pictures[0] - pictures[1]).max(), 1.5 / 255)

    def test_sides_that_nobody_photographed_are_told(self):
        self.assertEqual(self.by("beyond").text, "")
        self.open(self.variant("sector", lambda data: data["camera"].update(azimuth=10, sector=[-30, 50])))
        self.assertEqual(self.by("beyond").text, "")
        self.js("const { app } = surflect; app.setView({ ...app.state.view, azimuth: 60 })")
        self.assertIn("No photograph was taken from there", self.by("beyond").text)

    def test_a_moving_picture_is_coarse_on_slow_machines_and_a_resting_one_fine(self):
        drawn = self.page.execute_async_script("""
            const done = arguments[0], { app } = surflect, { drawing } = app, draw = drawing.draw, drawn = [];
            drawing.draw = (state, width, height, samples) => {
              drawn.push(samples);
              draw.call(drawing, state, width, height, samples);
              for (const begin = performance.now(); performance.now() < begin + 60;);
            };
            let frames = 0, moving;
            const rested = () => {
              if (drawn.at(-1) !== 2) return setTimeout(rested, 50);
              setTimeout(() => { drawing.draw = draw; done({ drawn, moving, after: app.coarse }); }, 50);
            };
            const turn = () => {
              app.setView({ ...app.state.view, azimuth: ++frames });
              if (frames < 12) return requestAnimationFrame(turn);
              moving = app.coarse;
              rested();
            };
            turn();""")
        self.assertLess(drawn["moving"], 1)
        self.assertIn(drawn["moving"], drawn["drawn"])
        self.assertEqual(drawn["drawn"][-1], 2)
        self.assertEqual(drawn["after"], min(1, 2 * drawn["moving"]))

    def test_samples_are_bounded_and_memory_that_does_not_suffice_is_told(self):
        self.assertEqual(self.js("return [[950, 672], [3840, 2160]].map((size) => surflect.app.drawing.finestOf(...size))"), [2, 1])
        self.assertLess(self.js("return surflect.app.drawing.finestOf(8000, 4000)"), 1)
        self.js("const { drawing } = surflect.app; drawing.gl.checkFramebufferStatus = () => 0; drawing.targets.width = 0; surflect.app.draw()")
        self.assertIn("graphics memory of this device does not hold", self.by("problem").text)
        self.assertEqual(self.js("return surflect.errors.splice(0).length"), 1)

    def test_the_picture_is_saved(self):
        self.page.execute_cdp_cmd("Page.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(self.folder / "saved")})
        self.press("#save")
        for _ in range(100):
            if (found := list((self.folder / "saved").glob("*.png"))):
                break
            self.js("return 0")
            self.page.execute_async_script("setTimeout(arguments[0], 50)")
        self.assertEqual([path.name for path in found], ["A _vase_.png"])
        width, height = self.js("return [surflect.app.canvas.width, surflect.app.canvas.height]")
        saved = numpy.array(read_png(found[0]))[:, :3].reshape(height, width, 3) / 255
        self.assertLess(numpy.abs(saved - canvas_of(self.page, 0, 0, width, height)).max(), 1.5 / 255)

    def test_a_missing_part_is_told(self):
        term = self.folder / "small/term1.js"
        text = term.read_text()
        try:
            term.write_text("// cut off\n")
            self.open(self.folder / "small")
            self.assertIn("A part of the object is missing: term1.js is damaged", self.by("problem").text)
            self.assertEqual(self.js("return [surflect.errors.splice(0).length, surflect.app.drawing.terms]"), [1, 1])
        finally:
            term.write_text(text)

    def test_axe_finds_nothing_in_light_and_dark_and_a_narrow_window_scrolls_down_alone(self):
        self.assertEqual(self.page.title, "A <vase>")
        self.assert_accessible("object-")


class Command(TestInFolder):
    def test_a_page_of_a_picture_becomes_that_of_an_object_and_keeps_title_scale_and_annotations(self):
        site, notes = self.folder / "page", self.folder / "notes.json"
        notes.write_text('{"annotations": [{"x": 3, "y": 4, "text": "chip"}]}')
        succeed("web", VASE.parent / "cat", "-o", site, "--planes", "1", "--annotations", notes)
        succeed("web", MODELS / "plain.lfm", "-o", site, "--title", "A <vase>", "--mm-per-unit", "50", "--exposure", "1.5")
        self.assertEqual((site / "annotations.1.json").read_text(), notes.read_text())
        # Packed again otherwise, it is the same object.
        report = succeed("web", MODELS / "small.lfm", "-o", site)
        names = sorted(path.name for path in site.iterdir())
        self.assertEqual(names, ["annotations.1.json", "data.js", "index.html", "maps.js", "object.js", "object_draw.js", "orbit.js", "overlay.js", "picture.js", "start.js",
                                 "style.css", "surflect-page.json", "term0.js", "term1.js", "term2.js"])
        self.assertIn("<title>A &lt;vase&gt;</title>", (site / "index.html").read_text())
        self.assertEqual(argument_of((site / "data.js").read_text())["mmPerUnit"], 50)
        self.assertEqual(report["bytes"], sum(path.stat().st_size for path in site.iterdir()))

    def test_exposure_is_that_of_films(self):
        film = succeed("render", MODELS / "plain.lfm", "-o", self.folder / "film", "--frames", "1")
        report = succeed("web", MODELS / "plain.lfm", "-o", self.folder / "exposed")
        self.assertAlmostEqual(report["exposure_stops"], film["automatic_exposure_stops"], delta=0.3)

    def test_the_same_bytes_for_any_number_of_threads(self):
        for threads in (1, 4):
            succeed("web", MODELS / "plain.lfm", "-o", self.folder / f"threads{threads}", "--threads", threads)
        self.assert_same_files(content(self.folder / "threads1"), content(self.folder / "threads4"))

    def test_what_a_page_does_not_show_is_refused(self):
        succeed("pack", MODELS / "views", "--method", "olfm", "-o", MODELS / "opacity.olfm", *SMALL)
        for source, options, code, said in (
                ("opacity.olfm", [], 1, r"opacity\.olfm: is a model of the method olfm: web draws light field maps.*--method lfm"),
                ("views", [], 1, r"web shows several views as a model.*pack CAPTURE --method lfm[^\0]*views: found \d+, expected one view"),
                ("plain.lfm", ["--planes", "3"], 2, "--planes: is for captures of one view"),
                ("plain.lfm", ["--allow-outside"], 2, "--allow-outside: is for captures of one view"),
                ("views", ["--mm-per-unit", "3"], 2, "--mm-per-unit: is for models")):
            result = run("web", MODELS / source, "-o", self.folder / "none", *options)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertRegex(result.stderr, said)
            self.assertFalse((self.folder / "none").exists())


if __name__ == "__main__":
    unittest.main()
