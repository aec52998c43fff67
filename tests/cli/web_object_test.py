"""`surflect web` of light field maps: the page of an object that is turned, opened from its folder in headless Chromium.

Its pictures are compared with those of `surflect render` from the same camera. Tests print decibels with SHOW_DECIBELS.
"""

import os
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

def pack_small(folder, *names):
    """Small models of the vase under one lamp: a plain one, with products of bytes; with codebooks and S3TC; without negative values."""
    (folder / "lamp.toml").write_text(LAMP)
    succeed("relight", VASE, "--lights", folder / "lamp.toml", "--common-lights", "-o", folder / "views")
    options = {"plain": [], "small": ["--vq", "2", "--vq-means", "--s3tc"], "nmf": ["--factors", "nmf", "--s3tc"]}
    for name in names:
        succeed("pack", folder / "views", "--method", "lfm", "-o", folder / f"{name}.lfm", *SMALL, *options[name])


class ObjectPage(TestOfPage):
    is_ready = "return Boolean(surflect.app) && !surflect.app.busy"

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        pack_small(cls.folder, "plain", "small", "nmf")
        cls.reports = {name: succeed("web", cls.folder / f"{name}.lfm", "-o", cls.folder / name, "--title", "A <vase>", "--mm-per-unit", "50")
                       for name in ("plain", "small", "nmf")}

    def setUp(self):
        self.page.set_window_size(760, 480)
        self.open(self.folder / "small")

    def view(self):
        return self.js("return surflect.app.state.view")

    def assert_shown(self, name, least=45, **turned):
        """Compares the page's picture, seen from other angles, with the program's; over all pixels that show the object."""
        shown, wanted = pictures_of_object(self.page, self.folder / f"{name}.lfm", self.folder, **turned)
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
        self.page.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mouseWheel", "x": canvas.rect["x"] + 99, "y": canvas.rect["y"] + 99, "deltaX": 0, "deltaY": -200})
        self.assertAlmostEqual(turned["distance"] / self.view()["distance"], numpy.exp(0.5), delta=0.01)
        canvas.send_keys(Keys.ARROW_LEFT, Keys.ARROW_LEFT, Keys.ARROW_DOWN, "+")
        keyed = self.view()
        self.assertAlmostEqual((keyed["azimuth"] - turned["azimuth"]) % 360, 10, delta=0.01)
        self.assertAlmostEqual(keyed["elevation"] - turned["elevation"], 5, delta=0.01)
        self.assertAlmostEqual(turned["distance"] / keyed["distance"], 1.25 * numpy.exp(0.5), delta=0.01)
        canvas.send_keys(Keys.SHIFT, Keys.ARROW_UP)
        self.assertNotEqual(self.view()["target"], first["target"])
        self.press("#home")
        self.assertEqual(self.view(), first)
        azimuth = self.by("azimuth")
        azimuth.clear()
        azimuth.send_keys("75")
        self.assertEqual(self.view()["azimuth"], 75)

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
        self.assertAlmostEqual(turned["distance"] / self.view()["distance"], 2, delta=0.1)
        self.full_screen()

    def test_nothing_is_drawn_while_nothing_changes(self):
        count = """
            const done = arguments[0], { drawing } = surflect.app, draw = drawing.draw;
            let drawn = 0;
            drawing.draw = (...given) => { ++drawn; draw.apply(drawing, given); };
            setTimeout(() => { drawing.draw = draw; done(drawn); }, 400);"""
        self.page.execute_async_script(count)  # what was asked for before
        self.assertEqual(self.page.execute_async_script(count), 0)
        self.by("canvas").send_keys(Keys.ARROW_LEFT)
        self.assertGreater(self.page.execute_async_script(count), 0)

    def test_a_scale_bar_is_as_long_as_it_says(self):
        text, length = self.js("return [document.querySelector('#overlay text').textContent, document.getElementById('bar').getBBox().width]")
        number, unit = text.split()
        units = float(number) * {"mm": 1, "cm": 10}[unit] / 50
        view, height = self.view(), self.js("return document.getElementById('stage').clientHeight")
        self.assertAlmostEqual(length, units * height / (2 * numpy.tan(numpy.radians(15)) * view["distance"]), delta=0.5)

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
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        pack_small(cls.folder, "plain")

    def test_a_page_of_a_picture_becomes_that_of_an_object_and_keeps_title_and_scale(self):
        site = self.folder / "page"
        succeed("web", VASE.parent / "cat", "-o", site, "--planes", "1")
        succeed("web", self.folder / "plain.lfm", "-o", site, "--title", "A <vase>", "--mm-per-unit", "50", "--exposure", "1.5")
        report = succeed("web", self.folder / "plain.lfm", "-o", site)
        names = sorted(path.name for path in site.iterdir())
        self.assertEqual(names, ["data.js", "index.html", "maps.js", "object.js", "object_draw.js", "orbit.js", "overlay.js", "picture.js", "start.js",
                                 "style.css", "surflect-page.json", "term0.js", "term1.js", "term2.js"])
        self.assertIn("<title>A &lt;vase&gt;</title>", (site / "index.html").read_text())
        self.assertEqual(argument_of((site / "data.js").read_text())["mmPerUnit"], 50)
        self.assertEqual(report["bytes"], sum(path.stat().st_size for path in site.iterdir()))

    def test_exposure_is_that_of_films(self):
        film = succeed("render", self.folder / "plain.lfm", "-o", self.folder / "film", "--frames", "1")
        report = succeed("web", self.folder / "plain.lfm", "-o", self.folder / "exposed")
        self.assertAlmostEqual(report["exposure_stops"], film["automatic_exposure_stops"], delta=0.3)

    def test_the_same_bytes_for_any_number_of_threads(self):
        for threads in (1, 4):
            succeed("web", self.folder / "plain.lfm", "-o", self.folder / f"threads{threads}", "--threads", threads)
        self.assert_same_files(content(self.folder / "threads1"), content(self.folder / "threads4"))

    def test_what_a_page_does_not_show_is_refused(self):
        succeed("pack", self.folder / "views", "--method", "olfm", "-o", self.folder / "opacity.olfm", *SMALL)
        for source, options, code, said in (
                ("opacity.olfm", [], 1, r"opacity\.olfm: is a model of the method olfm: web draws light field maps.*--method lfm"),
                ("views", [], 1, r"views: found \d+, expected one view; `pack --method lfm` makes a model of several"),
                ("plain.lfm", ["--planes", "3"], 2, "--planes: is for captures of one view"),
                ("views", ["--mm-per-unit", "3"], 2, "--mm-per-unit: is for models")):
            result = run("web", self.folder / source, "-o", self.folder / "none", *options)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertRegex(result.stderr, said)
            self.assertFalse((self.folder / "none").exists())


if __name__ == "__main__":
    unittest.main()
