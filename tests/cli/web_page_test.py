"""`surflect web`: the page of one view, opened from its folder in headless Chromium.

The reference decodes the folder's files by itself: JPEG by ffmpeg, the rest in numpy.
"""

import base64
import io
import json
import os
import shutil
import subprocess
import time
import unittest

import numpy
from selenium.webdriver.common.keys import Keys

from support import CAT, VASE, TestInFolder, content, run, succeed
from web_browser import TestOfPage, argument_of, canvas_of, decibels, srgb

def grey_pixels(picture, width, height):
    """Bytes of a grey picture, by ffmpeg."""
    raw = subprocess.run(["ffmpeg", "-v", "error", "-i", "-", "-f", "rawvideo", "-pix_fmt", "gray", "-"], input=picture, check=True,
                         stdout=subprocess.PIPE).stdout
    return numpy.frombuffer(raw, numpy.uint8).reshape(height, width)


class Reference:
    """What the files of a page say that it shows."""

    def __init__(self, folder):
        self.data = argument_of((folder / "data.js").read_text())
        width, height, side = self.data["width"], self.data["height"], self.data["tile"]
        self.planes = numpy.zeros((self.data["planes"], height, width))
        for path in sorted((folder / "tiles/0").glob("*.js")):
            x, y = (side * int(part) for part in path.stem.split("_"))
            wide, high = min(side, width - x), min(side, height - y)
            text = path.read_text()
            for k, plane in enumerate(json.loads(text[text.index("["):text.rindex("]") + 1])[:self.data["planes"]]):
                least, most = self.data["ranges"][k]
                grey = grey_pixels(base64.b64decode(plane), wide, high)
                self.planes[k, y:y + high, x:x + wide] = least + (most - least) * grey / 255

    def picture(self, x, y):
        """The picture, sRGB in 0..1, under a light in the direction (x, y)."""
        r = [numpy.hypot(x - light["towards"][0], y - light["towards"][1]) for light in self.data["lights"]]
        features = numpy.array([d * d * numpy.log(d) if d > 0 else 0 for d in r] + [1, x, y])
        weights = (features @ numpy.array(self.data["functions"])).reshape(-1, 3)
        encoded = weights[0] + numpy.tensordot(self.planes, weights[1:], (0, 0))
        toe = self.data["toe"]
        return srgb(numpy.maximum(encoded + toe, toe) ** 2 - toe ** 2)


class Page(TestOfPage):
    is_ready = "surflect.app.draw(); return !surflect.app.tiles.busy"

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.site = cls.folder / "page"
        cls.report = succeed("web", CAT, "-o", cls.site, "--title", "A cat of <plaster>", "--pixels-per-mm", "4")
        cls.reference = Reference(cls.site)

    def setUp(self):
        super().setUp()
        self.open(self.site)

    def lamp_at(self, x, y):
        self.js("surflect.app.setLamp(arguments[0], arguments[1]); surflect.app.draw()", x, y)

    def shown(self):
        """The picture on the canvas at 1:1, sRGB in 0..1."""
        width, height = self.reference.data["width"], self.reference.data["height"]
        self.press("#one")
        self.rest()
        x, y = self.js("surflect.app.draw(); const { x, y } = surflect.app.toScreen({ x: 0, y: 0 }); return [Math.round(x), Math.round(y)]")
        return canvas_of(self.page, x, y, width, height)

    def test_the_lamp_is_dragged_over_the_disc_and_the_picture_is_the_reference(self):
        self.drag(self.by("disc"), (0, 0), (8, -4), (14, -11))
        x, y = self.js("return [surflect.app.state.x, surflect.app.state.y]")
        self.assertAlmostEqual(x, 14 * 2.16 / 160, delta=0.01)
        self.assertAlmostEqual(y, 11 * 2.16 / 160, delta=0.01)
        difference = decibels(self.shown(), self.reference.picture(x, y))
        self.picture("lamp")
        self.assertGreater(difference, 51)

    def test_the_lamp_is_dragged_over_the_picture(self):
        before = self.shown()
        self.drag(self.by("canvas"), (0, 0), (40, -40), (60, -60))
        self.assertGreater(self.js("return surflect.app.state.x"), 0.1)
        self.assertGreater(self.js("return surflect.app.state.y"), 0.1)
        self.assertLess(decibels(self.shown(), before), 40)

    def test_keys_and_fields_move_the_lamp(self):
        self.by("disc").send_keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_UP)
        self.assertEqual(self.js("return [surflect.app.state.x.toFixed(2), surflect.app.state.y.toFixed(2)]"), ["0.06", "0.03"])
        self.press("[data-rake='180']")
        self.assertEqual(self.by("azimuth").get_attribute("value"), "180")
        self.assertEqual(self.by("elevation").get_attribute("value"), "15")
        self.page.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")  # drawn
        self.assertIn("No lamp was captured there", self.by("beyond").text)

    def test_a_captured_light_shows_its_photograph(self):
        capture = json.loads((CAT / "transforms.json").read_text())
        by_name = {light["name"]: light for light in capture["lights"]}
        worst = 100
        for light in self.reference.data["lights"][::4]:
            frame = next(f for f in capture["frames"] if f["light"] == light["name"] and f.get("split", "train") == "train")
            grey = grey_pixels((CAT / frame["file_path"]).read_bytes(), capture["w"], capture["h"]) / 255
            wanted = srgb(grey / by_name[light["name"]]["irradiance"][0] / self.report["white"])
            self.lamp_at(*light["towards"][:2])
            worst = min(worst, decibels(self.shown()[:, :, 0], wanted))
        self.assertGreater(worst, 36)
        self.assertGreater(self.report["captured"]["psnr_srgb_db"], 38)

    def test_a_measured_length_is_right_to_a_pixel(self):
        self.shown()
        self.press("[data-tool=measure]")
        self.drag(self.by("canvas"), (-150, -100), (0, 0), (150, 100))
        pixels, millimetres = self.by("length").text.split(" pixels, ")
        wanted = numpy.hypot(300, 200)
        self.assertAlmostEqual(float(pixels), wanted, delta=1)
        self.assertEqual(millimetres.split()[1], "cm")
        self.assertAlmostEqual(10 * float(millimetres.split()[0]), wanted / 4, delta=0.25)
        bar = self.js("return [document.querySelectorAll('#bar').length, document.querySelector('#bar').getBBox().width]")
        self.assertAlmostEqual(bar[1] / 4, {20: 20, 10: 10}[round(bar[1] / 4, -1)], delta=0.5)
        self.picture("measure")

    def test_keys_measure_what_the_middle_passes(self):
        self.shown()
        canvas = self.by("canvas")
        canvas.send_keys("m", Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_UP)
        self.rest()
        self.assertAlmostEqual(float(self.by("length").text.split()[0]), numpy.hypot(120, 60), delta=0.1)
        canvas.send_keys("m", Keys.ARROW_DOWN)  # the line has ended
        self.rest()
        self.assertAlmostEqual(float(self.by("length").text.split()[0]), numpy.hypot(120, 60), delta=0.1)

    def test_a_page_that_is_read_only_shows_its_annotations_and_takes_none(self):
        notes, site = self.folder / "read.json", self.folder / "read-only"
        notes.write_text('{"annotations": [{"x": 3, "y": 4, "text": "chip & <crack>"}]}')
        succeed("web", CAT, "-o", site, "--planes", "1", "--annotations", notes, "--read-only", "--credit", "(c) TITLE <museum>")
        self.open(site)
        self.assertEqual(self.by("credit").text, "(c) TITLE <museum>")
        self.assertEqual(self.js("return [...document.querySelectorAll('#notes li')].map((item) => item.textContent)"), ["1chip & <crack>"])
        shown = self.js("return [...document.querySelectorAll('#annotations button, #annotations input, #tools button')].filter((each) => each.checkVisibility()).map((each) => each.textContent)")
        self.assertEqual(shown, ["Lamp", "Move", "Measure", "chip & <crack>"])
        self.press("#notes button")
        self.assertEqual(self.js("return [surflect.app.notes.chosen, localStorage.length]"), [0, 0])
        self.picture("read-only")

    def test_normals_and_highlights_are_shown(self):
        self.lamp_at(0.5, 0.3)
        color = self.shown()
        self.press("[data-show=normals]")
        normals = 2 * self.shown() - 1
        lengths = numpy.linalg.norm(normals, axis=2)
        self.assertAlmostEqual(numpy.median(lengths), 1, delta=0.02)
        self.assertGreater(numpy.median(normals[:, :, 2]), 0.5)
        self.picture("normals")
        self.press("[data-show=specular]")
        self.assertLess(decibels(self.shown(), color), 30)
        self.assertTrue(self.by("exponent").is_displayed())
        # k_d L C + k_s (N.H)^n [Malzbender 2001]: with k_d = 1, k_s = 0 it is the relit picture, of which k_d takes its share.
        self.js("Object.assign(surflect.app.state, { diffuse: 1 })")
        self.assertLess(numpy.abs(self.shown() - color).max(), 2 / 255)
        self.picture("specular")

    def test_annotations_are_kept_by_browser_and_folder(self):
        self.press("[data-tool=box]")
        self.drag(self.by("canvas"), (-50, -60), (0, 0), (40, 30))
        self.page.switch_to.active_element.send_keys("left ear")
        self.press("#add")
        self.page.switch_to.active_element.send_keys("chip & <crack>")
        self.picture("annotations")
        text = self.js("return surflect.app.notes.text")
        self.page.refresh()
        self.rest()
        self.assertEqual(self.js("return surflect.app.notes.text"), text)
        self.assertEqual([note["text"] for note in json.loads(text)["annotations"]], ["left ear", "chip & <crack>"])

        site = self.folder / "second"
        shutil.copytree(self.site, site)
        (site / "annotations.json").write_text(text)
        for title in ("first", "second"):  # a second export keeps them
            succeed("web", CAT, "-o", site, "--planes", "1", "--title", title)
            self.assertEqual((site / "annotations.json").read_text(), text)
        self.open(site)
        self.assertEqual(self.js("return surflect.app.notes.text"), text)
        self.assertEqual(self.page.title, "second")

    def test_published_annotations_are_shown_when_they_change_and_the_kept_ones_offered(self):
        site = self.folder / "published"

        def publish(*texts):
            notes = self.folder / "notes.json"
            notes.write_text(json.dumps({"annotations": [{"x": 3, "y": 4, "text": text} for text in texts]}))
            succeed("web", CAT, "-o", site, "--planes", "1", "--title", " ".join(texts), "--annotations", notes)

        def listed():
            return self.js("return surflect.app.notes.list.map(({ text }) => text)")

        def reload():
            self.page.get((site / "index.html").as_uri())
            self.rest()

        publish("old")
        self.open(site)
        self.press("#add")
        self.page.switch_to.active_element.send_keys("mine")
        reload()
        self.assertEqual(listed(), ["old", "mine"])
        publish("new")
        self.assertEqual([path.name for path in site.glob("annotations.*.json")], ["annotations.1.json"])
        for _ in range(2):
            reload()
            self.assertEqual(listed(), ["new"])
            self.assertIn("other annotations", self.by("said").text)
        self.press("#earlier")
        self.assertEqual(listed(), ["old", "mine"])
        reload()
        self.assertEqual(listed(), ["old", "mine"])
        self.press("#reset")
        self.assertEqual(listed(), ["new"])
        self.assertTrue(self.by("earlier").is_displayed())
        publish("old", "mine")
        reload()
        self.assertEqual(listed(), ["old", "mine"])

    def test_annotations_belong_to_the_captured_object_and_not_to_the_page_of_its_path(self):
        self.press("#add")
        data = self.site / "data.js"
        text = data.read_text()
        try:
            data.write_text(text.replace(argument_of(text)["object"], 16 * "0"))  # another object at the same place
            self.page.refresh()
            self.rest()
            self.assertEqual(self.js("return surflect.app.notes.list"), [])
        finally:
            data.write_text(text)

    def test_a_missing_tile_is_told(self):
        site = self.folder / "torn"
        shutil.copytree(self.site, site)
        tile, other = sorted((site / "tiles/0").glob("*.js"))[:2]
        tile.unlink()
        other.write_text("// cut off\n")
        self.open(site)
        self.press("#one")
        self.rest()
        self.assertIn("A piece of the picture is missing: tiles/0/", self.by("problem").text)
        self.assertEqual(len(self.js("return surflect.errors.splice(0)")), 2)
        self.page.get_log("browser")

    def test_a_file_of_annotations_is_read_and_a_wrong_one_refused(self):
        good, bad = self.folder / "good.json", self.folder / "bad.json"
        good.write_text('{"annotations": [{"x": 3, "y": 4, "text": "read"}]}')
        bad.write_text('{"annotations": [{"x": "3", "y": 4, "text": "read"}]}')
        self.by("file").send_keys(str(bad))
        self.until_said("annotations[0].x: expected a number")
        self.by("file").send_keys(str(good))
        self.until_said("good.json: read")
        self.assertEqual(self.js("return surflect.app.notes.list.length"), 1)

    def until_said(self, text):
        for _ in range(100):
            if text in self.by("said").text:
                return
            time.sleep(0.05)
        self.fail(f"{self.by('said').text!r} lacks {text!r}")

    def test_axe_finds_nothing_in_light_and_dark_and_a_narrow_window_scrolls_down_alone(self):
        self.assert_accessible("")

    def test_a_finger_drags_the_lamp_and_two_zoom(self):
        self.screen(390, 844)
        self.touch("touchStart", (0, 0))
        self.touch("touchMove", (60, 0))
        self.touch("touchEnd")
        self.assertGreater(self.js("return surflect.app.state.x"), 0.2)
        zoom = self.js("return surflect.app.state.view.zoom")
        self.touch("touchStart", (-30, 0), (30, 0))
        self.touch("touchMove", (-60, 0), (60, 0))
        self.touch("touchEnd")
        self.assertAlmostEqual(self.js("return surflect.app.state.view.zoom") / zoom, 2, delta=0.1)
        # Two fingers take back what the first has done: lamp and line stay.
        lamp = self.js("return [surflect.app.state.x, surflect.app.state.y]")
        self.js("surflect.app.state.line = [{ x: 1, y: 2 }, { x: 4, y: 6 }]")
        for tool in ("lamp", "measure"):
            self.press(f"[data-tool={tool}]")
            self.touch("touchStart", (-30, 10))
            self.touch("touchMove", (-40, 20))
            self.touch("touchStart", (-40, 20), (30, 0))
            self.touch("touchMove", (-30, 20), (20, 0))
            self.touch("touchEnd")
        self.assertEqual(self.js("return [surflect.app.state.x, surflect.app.state.y]"), lamp)
        self.assertEqual(self.js("return surflect.app.state.line"), [{"x": 1, "y": 2}, {"x": 4, "y": 6}])
        self.assertIn("5.0 pixels", self.by("length").text)
        self.full_screen()

    def test_the_title_is_text(self):
        self.assertEqual(self.page.title, "A cat of <plaster>")
        self.assertEqual(self.by("title").text, "A cat of <plaster>")


class Command(TestInFolder):
    def test_a_ptm_is_read_by_its_specification_and_shows_the_photographs_as_well_as_their_fit(self):
        report = succeed("web", CAT, "-o", self.folder / "ptm", "--ptm", "--planes", "1")
        data = argument_of((self.folder / "ptm/data.js").read_text())
        file = io.BytesIO((self.folder / "ptm/object.ptm").read_bytes())
        lines = [file.readline().decode().split() for _ in range(6)]
        width, height = int(lines[2][0]), int(lines[3][0])
        self.assertEqual((lines[0], lines[1], width, height), (["PTM_1.2"], ["PTM_FORMAT_LRGB"], data["width"], data["height"]))
        scale, bias = (numpy.array([float(word) for word in line]) for line in lines[4:])
        raw = numpy.frombuffer(file.read(), numpy.uint8)
        self.assertEqual(len(raw), 9 * width * height)
        terms = scale * (raw[:6 * width * height].reshape(height, width, 6)[::-1] - bias)
        colors = raw[6 * width * height:].reshape(height, width, 3)[::-1] / 255

        capture = json.loads((CAT / "transforms.json").read_text())
        photographs, directions = [], []
        for light in data["lights"]:
            frame = next(f for f in capture["frames"] if f["light"] == light["name"])
            strength = next(each["irradiance"][0] for each in capture["lights"] if each["name"] == light["name"])
            grey = grey_pixels((CAT / frame["file_path"]).read_bytes(), width, height) / 255
            photographs.append(srgb(grey / strength / report["white"]))
            directions.append(light["towards"][:2])
        u, v = numpy.array(directions).T
        design = numpy.stack([u * u, v * v, u * v, u, v, numpy.ones_like(u)], 1)
        fitted = numpy.tensordot(design @ numpy.linalg.pinv(design), numpy.array(photographs), (1, 0))
        for light in range(len(u)):
            shown = numpy.clip(terms @ design[light] / 255, 0, 1)[:, :, None] * colors
            self.assertGreater(decibels(shown[:, :, 0], photographs[light]), decibels(numpy.clip(fitted[light], 0, 1), photographs[light]) - 0.5)

    def test_what_is_there_and_no_page_stays_as_it_is(self):
        (self.folder / "mine").mkdir()
        (self.folder / "mine/own.txt").write_text("own")
        result = run("web", CAT, "-o", self.folder / "mine")
        self.assertEqual(result.returncode, 1)
        self.assertIn("expected a new folder, or an empty one", result.stderr)
        self.assertEqual(content(self.folder / "mine"), {"own.txt": b"own"})
        self.assertEqual([path.name for path in self.folder.iterdir() if ".tmp." in path.name], [])

    def test_a_page_with_files_of_people_stays_as_it_is(self):
        site = self.folder / "site"
        succeed("web", CAT, "-o", site, "--planes", "1")
        (site / "README").write_text("own")
        before = content(site)
        result = run("web", CAT, "-o", site, "--planes", "1")
        self.assertEqual(result.returncode, 1)
        self.assertIn("site/README: is not of the earlier output", result.stderr)
        self.assertEqual(content(site), before)

    def test_a_title_that_is_no_text_is_refused_at_once(self):
        result = run("web", CAT, "-o", self.folder / "odd", "--title", os.fsdecode(b"c\xe4t"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("--title: found other bytes, expected UTF-8", result.stderr)

    def test_title_credit_and_scale_stay_over_an_export(self):
        site = self.folder / "again"
        succeed("web", CAT, "-o", site, "--planes", "1", "--title", "A <cat>", "--credit", "(c) us", "--pixels-per-mm", "4")
        succeed("web", CAT, "-o", site, "--planes", "1")
        self.assertEqual(argument_of((site / "data.js").read_text())["pixelsPerMm"], 4)
        self.assertIn("<title>A &lt;cat&gt;</title>", (site / "index.html").read_text())
        self.assertIn(">(c) us<", (site / "index.html").read_text())
        mark = site / "surflect-page.json"
        mark.write_text(json.dumps({**json.loads(mark.read_text()), "object": "another"}))
        succeed("web", CAT, "-o", site, "--planes", "1")  # of another object, they do not
        self.assertNotIn("pixelsPerMm", argument_of((site / "data.js").read_text()))
        self.assertIn(f"<title>{CAT.name}</title>", (site / "index.html").read_text())

    def test_several_views_are_refused_by_name(self):
        result = run("web", VASE, "-o", self.folder / "vase")
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"transforms\.json: views: found \d+, expected one view")
        self.assertFalse((self.folder / "vase").exists())

    def test_wrong_annotations_are_named(self):
        for text, problem in (("[", "is no JSON"), ("{}", "annotations: found none, expected a list"),
                              ('{"annotations": [{"x": 1, "y": 2}]}', r"annotations\[0\]\.text: missing"),
                              ('{"annotations": [{"x": 1, "y": "2", "text": ""}]}', r"annotations\[0\]\.y: found string, expected a number"),
                              ('{"annotations": [{"x": 1, "y": 2, "text": "", "widht": 3}]}', "widht: unknown; did you mean width")):
            path = self.folder / "annotations.json"
            path.write_text(text)
            result = run("web", CAT, "-o", self.folder / "page", "--annotations", path)
            self.assertEqual(result.returncode, 1)
            self.assertRegex(result.stderr, problem)
            self.assertFalse((self.folder / "page").exists())

    def test_the_same_bytes_for_any_number_of_threads(self):
        pages = [self.folder / name for name in ("one", "many")]
        for page, threads in zip(pages, (1, 4)):
            succeed("web", CAT, "-o", page, "--title", "cat", "--threads", threads)
        self.assert_same_files(*map(content, pages))


if __name__ == "__main__":
    unittest.main()
