"""Folders of `surflect web` in headless Chromium, which draws WebGL by SwiftShader.

With the environment variable PICTURES, a folder, pictures of the pages are written there.
"""

import base64
import json
import os
import pathlib
import time

import numpy
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By

from png import read_png
from support import TestInFolder, succeed

AXE = pathlib.Path(os.environ["AXE"])  # axe.min.js
PICTURES = os.environ.get("PICTURES")


def browser(profile, width=1280, height=860):
    options = Options()
    for argument in ("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
                     "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
                     "--disable-dev-shm-usage", "--hide-scrollbars", f"--user-data-dir={profile}", f"--window-size={width},{height}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


def argument_of(script):
    """The value that a script of the folder hands to the page."""
    return json.loads(script[script.index("(") + 1:script.rindex(")")])


def srgb(linear):
    linear = numpy.clip(linear, 0, 1)
    return numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def decibels(a, b):
    return -10 * numpy.log10(numpy.mean((a - b) ** 2))


OBJECT_SCRIPT = """
model = "{model}"
[frames]
first = 1
last = 1
[output]
size = [{width}, {height}]
path = "frame.#.exr"
png = true
background = {background}
[camera]
fov_deg = {fov}
up = {up}
exposure = {stops}
[camera.orbit]
center = {target}
radius = {distance}
azimuth_deg = {azimuth}
elevation_deg = {elevation}
"""


def canvas_of(page, x, y, width, height):
    """Pixels of the canvas from its upper left corner, sRGB in 0..1."""
    text = page.execute_script("""
        const [x, y, w, h] = arguments, { app } = surflect, gl = app.canvas.getContext("webgl2");
        app.draw();
        const bytes = new Uint8Array(4 * w * h);
        gl.readPixels(x, app.canvas.height - y - h, w, h, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
        let text = "";
        for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
        return btoa(text)""", x, y, width, height)
    return numpy.frombuffer(base64.b64decode(text), numpy.uint8).reshape(height, width, 4)[::-1, :, :3] / 255


def pictures_of_object(page, model, folder, **turned):
    """Pixels that show the object of a model on its page, and the same ones of the program from the same camera; sRGB in 0..1."""
    page.execute_script("const { app } = surflect; app.setView({ ...app.state.view, ...arguments[0] })", turned)
    found = page.execute_script("""
        const { app, page } = surflect;
        app.draw();
        const { width, height } = app.canvas;
        const background = getComputedStyle(document.getElementById("stage")).backgroundColor.match(/[\\d.]+/g).map((byte) => byte / 255);
        const { view } = app.state, { center, fov, up } = page.camera;
        return { ...view, target: view.target.map((x, i) => x + center[i]), width, height, background, up, stops: page.stops,
          fov: 360 / Math.PI * Math.atan(Math.tan(fov * Math.PI / 360) / view.zoom) }""")
    assert found["width"] >= found["height"]  # the field of view is that of the height
    script = folder / "object.toml"
    script.write_text(OBJECT_SCRIPT.format(model=model, **found))
    succeed("render", script, "-o", folder / "frames")
    wanted = numpy.array(read_png(folder / "frames/frame.1.png"))[:, :3].reshape(found["height"], found["width"], 3) / 255
    shown = canvas_of(page, 0, 0, found["width"], found["height"])
    is_object = numpy.maximum(*(numpy.abs(picture - found["background"]).max(2) for picture in (wanted, shown))) > 1.5 / 255
    assert is_object.mean() > 0.05
    return shown[is_object], wanted[is_object]


class TestOfPage(TestInFolder):
    """Tests of pages in one browser. `is_ready` is a script that says whether all that is seen is drawn."""

    is_ready = None

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.page = browser(cls.folder / "profile")
        cls.addClassCleanup(cls.page.quit)

    def setUp(self):
        self.page.set_window_size(1280, 860)

    def tearDown(self):
        self.assertEqual(self.js("return surflect.errors"), [])
        self.assertEqual([entry for entry in self.page.get_log("browser") if entry["level"] == "SEVERE"], [])

    def js(self, script, *arguments):
        return self.page.execute_script(script, *arguments)

    def open(self, site):
        self.page.get((site / "index.html").as_uri())
        if self.js("const { length } = localStorage; localStorage.clear(); return length"):
            self.page.refresh()
        self.rest()

    def rest(self):
        """Waits until all that is seen is drawn."""
        for _ in range(600):
            if self.js(self.is_ready):
                return
            time.sleep(0.05)
        self.fail("the page is still loading")

    def by(self, name):
        return self.page.find_element(By.ID, name)

    def press(self, selector):
        element = self.page.find_element(By.CSS_SELECTOR, selector)
        self.js("arguments[0].scrollIntoView({block: 'center'})", element)
        element.click()

    def drag(self, element, *places):
        """Drags from place to place, in pixels from the element's middle."""
        chain = ActionChains(self.page, duration=20)
        (x, y), *others = places
        chain.move_to_element_with_offset(element, x, y).click_and_hold()
        for x, y in others:
            chain.move_to_element_with_offset(element, x, y)
        chain.release().perform()

    def screen(self, width, height):
        """Emulates a screen; a narrow one is a phone's. Lasts until full_screen()."""
        self.page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                  {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500})
        self.rest()

    def full_screen(self):
        self.page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})

    def touch(self, kind, *places):
        """Fingers at places, in pixels from the middle of the canvas."""
        x0, y0 = self.js("const b = surflect.app.canvas.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]")
        self.page.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [
            {"x": x0 + x, "y": y0 + y, "id": i} for i, (x, y) in enumerate(places)]})

    def picture(self, name):
        if PICTURES:
            self.page.save_screenshot(f"{PICTURES}/{name}.png")

    def assert_accessible(self, name):
        """axe finds nothing in light and dark, wide and narrow, and a narrow window scrolls down alone."""
        for width, height in ((1280, 860), (390, 844)):
            self.screen(width, height)
            for scheme in ("light", "dark"):
                self.page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
                self.rest()
                self.js("window.axe ?? (0, eval)(arguments[0])", AXE.read_text())
                found = self.page.execute_async_script("axe.run({preload: false}).then((found) => arguments[0](found.violations.map((v) => [v.id, v.nodes.map((n) => n.html)])))")
                with self.subTest(width=width, scheme=scheme):
                    self.assertEqual(found, [])
                    self.assertLessEqual(self.js("return document.documentElement.scrollWidth"), width)
                self.picture(f"{name}{scheme}-{width}")
        self.full_screen()
