"""The viewer's page in headless Chromium: every hand and eye of it, by mouse and keys; and no error on the way.

With the environment variable PICTURES, a folder, the whole example is packed, and the pictures of docs/view.md are written.
"""

import json
import os
import pathlib
import shutil
import subprocess
import time
import unittest

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.select import Select

from support import ROOT, SCRIPT, VASE, TestInFolder, succeed, write_small_capture
from viewer import Viewer

PICTURES = os.environ.get("PICTURES")
AXE = pathlib.Path(os.environ["AXE"])  # axe.min.js
SHOT = SCRIPT.replace("size = [120, 90]", "size = [240, 180]").replace("last = 3", "last = 12").replace("[3, 40]]", "[12, 40]]")


def browser(profile, width=1280, height=800):
    options = Options()
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                     "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--hide-scrollbars",
                     f"--user-data-dir={profile}", f"--window-size={width},{height}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


class InBrowser(TestInFolder):
    """A browser, and hands in it."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.page = browser(cls.folder / "profile")
        cls.addClassCleanup(cls.page.quit)

    def show(self, viewer):
        """Opens the page of a viewer."""
        self.page.get(viewer.url)
        self.rest()

    def leave(self):
        """Leaves the page, which must have had no error and never more than one request in flight."""
        self.assertEqual(self.js("return surflect.errors"), [])
        self.assertLessEqual(self.js("return surflect.mostInFlight"), 1)
        wrong = [entry for entry in self.page.get_log("browser") if entry["level"] == "SEVERE" and "status of 4" not in entry["message"]]
        self.assertEqual(wrong, [])
        self.page.get("about:blank")

    def js(self, script, *arguments):
        return self.page.execute_script(script, *arguments)

    def until(self, condition, message="", seconds=60):
        for _ in range(20 * seconds):
            if self.js(f"return Boolean({condition})"):
                return
            time.sleep(0.05)
        self.fail(f"not within {seconds} s: {message or condition}; status: {self.text('remark')}")

    def rest(self):
        """Waits until the full picture of the present state is shown."""
        self.until("window.surflect && surflect.app && surflect.app.loop && surflect.app.lastFull")
        time.sleep(0.05)
        self.until("surflect.app.loop.stale.size + surflect.app.loop.owed.size === 0 && surflect.inFlight === 0")

    def by(self, name):
        return self.page.find_element(By.ID, name)

    def text(self, name):
        return self.by(name).text

    def doc(self):
        return json.loads(self.js("return JSON.stringify(surflect.app.store.doc)"))

    def press(self, name):
        self.js("arguments[0].scrollIntoView({block: 'center'}); arguments[0].closest('details')?.setAttribute('open', '')", self.by(name))
        self.by(name).click()

    def open(self, section):
        self.js("document.getElementById(arguments[0]).open = true", section)

    def type(self, element, text):
        self.js("arguments[0].scrollIntoView({block: 'center'})", element)
        element.send_keys(Keys.CONTROL, "a")
        element.send_keys(text, Keys.ENTER)

    def field(self, path, role):
        element = self.page.find_element(By.CSS_SELECTOR, f'[data-path="{path}"] [data-role={role}]')
        self.js("for (let e = arguments[0]; e; e = e.parentElement) if (e.tagName === 'DETAILS') e.open = true", element)
        return element

    def drag(self, element, dx, dy, steps=8, from_x=0, from_y=0, held=None):
        chain = ActionChains(self.page, duration=20)
        if held:
            chain.key_down(held)
        chain.move_to_element_with_offset(element, from_x, from_y).click_and_hold()
        for _ in range(steps):
            chain.move_by_offset(round(dx / steps), round(dy / steps))
        chain.release()
        if held:
            chain.key_up(held)
        chain.perform()

    def pixels(self):
        """A checksum of what the canvas shows."""
        return self.js("""const c = document.getElementById('canvas'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let sum = 0; for (let i = 0; i < d.length; i += 4) sum = (sum * 31 + d[i] + 3 * d[i + 1] + 7 * d[i + 2]) % 1000003; return sum""")

    def brightness(self):
        return self.js("""const c = document.getElementById('canvas'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let sum = 0; for (let i = 0; i < d.length; i += 4) sum += d[i] + d[i + 1] + d[i + 2]; return sum / d.length""")

    def changed_by(self, act):
        before = self.pixels()
        act()
        self.rest()
        self.assertNotEqual(self.pixels(), before)


class Page(InBrowser):
    """A model with its script, its photographs and environments."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=4, lights=4, script="# A shot to edit\n" + SHOT)
        if PICTURES:
            cls.capture = VASE
            succeed("pack", cls.capture, "-o", cls.model)
        else:
            succeed("pack", cls.capture, "-o", cls.model, "--surfels", "40000", "--tables", "off")
        shutil.copytree(ROOT / "examples" / "environments", cls.folder / "environments")
        cls.original = cls.script.read_text()
        cls.viewer = Viewer(cls.script, "--capture", cls.capture, "--environments", "environments", "-o", "snapshots",
                            folder=cls.folder)
        cls.addClassCleanup(cls.viewer.process.kill)

    def setUp(self):
        self.show(self.viewer)

    def tearDown(self):
        self.leave()

    # --- camera

    def test_a_drag_turns_the_camera_and_the_wheel_moves_it(self):
        canvas = self.by("canvas")
        position = lambda: self.js("return surflect.app.scene.pose().position")
        start = position()
        self.changed_by(lambda: self.drag(canvas, 160, 40))
        turned = position()
        self.assertNotEqual(turned, start)
        self.changed_by(lambda: self.js("""arguments[0].dispatchEvent(new WheelEvent('wheel', {deltaY: -300, bubbles: true, cancelable: true,
            clientX: 300, clientY: 300}))""", canvas))
        self.assertNotEqual(position(), turned)
        self.changed_by(lambda: self.drag(canvas, 60, 0, held=Keys.SHIFT))
        self.assertEqual(self.doc()["camera"], json.loads(self.viewer.get("/start")[1])["doc"]["camera"])
        self.press("camera-set")
        self.assertEqual(len(self.doc()["camera"]["position"]), 3)
        self.press("undo")
        self.rest()

    def test_keys_move_the_camera_and_the_help_lists_them(self):
        body = self.by("canvas")
        for keys in ("+", "-", Keys.ARROW_LEFT, Keys.ARROW_UP):
            self.changed_by(lambda: body.send_keys(keys))
        body.send_keys("?")
        self.assertTrue(self.by("help-dialog").is_displayed())
        self.by("help-close").click()
        self.changed_by(lambda: body.send_keys("c"))
        self.assertEqual(self.js("return surflect.app.store.view.camera.kind"), "captured")

    # --- lamps

    def test_a_lamp_is_dragged_on_its_sphere(self):
        marker = self.page.find_element(By.CSS_SELECTOR, '[data-marker="lamp-1"], [data-marker="lamp-0"]')
        name = marker.get_attribute("data-marker")
        place = int(name.split("-")[1])
        before = self.doc()["light"][place]
        key = "direction" if before["type"] == "directional" else "position"
        self.changed_by(lambda: self.drag(marker, -120, 40))
        after = self.doc()["light"][place]
        self.assertNotEqual(after[key], before[key])
        self.assertEqual(after["type"], before["type"])
        self.press("undo")
        self.rest()
        self.assertEqual(self.doc()["light"][place], before)

    def test_lamps_come_go_and_are_muted(self):
        self.open("section-lamps")
        self.press("add-directional")
        self.rest()
        self.assertEqual(len(self.doc()["light"]), 3)
        intensity = self.field("light.2.intensity", "number")
        self.changed_by(lambda: self.type(intensity, "7"))
        self.assertEqual(self.doc()["light"][2]["intensity"], 7)
        mute = self.page.find_element(By.CSS_SELECTOR, '#lamp-list [data-light="2"] [data-role=mute]')
        self.changed_by(mute.click)
        self.assertEqual(len(self.doc()["light"]), 3)
        self.page.find_element(By.CSS_SELECTOR, '#lamp-list [data-light="2"] [data-role=delete]').click()
        self.rest()
        self.assertEqual(self.doc(), json.loads(self.viewer.get("/start")[1])["doc"])

    def test_an_environment_lights_the_object(self):
        self.open("section-environment")
        select = Select(self.by("add-environment"))
        self.changed_by(lambda: select.select_by_index(1))
        self.assertEqual(self.doc()["light"][2]["type"], "environment")
        turn = self.field("light.2.rotate_deg", "number")
        self.changed_by(lambda: self.type(turn, "90"))
        self.changed_by(lambda: (self.press("undo"), self.press("undo")))

    # --- warps and time

    def test_a_slider_bends_the_object(self):
        self.open("section-warps")
        self.open_item("#warp-list", "warp", 0)
        slider = self.field("warp.0.angle_deg", "slider")
        self.js("arguments[0].scrollIntoView({block: 'center'})", slider)
        self.changed_by(lambda: self.drag(slider, 30, 0, steps=4))
        self.assertIsInstance(self.doc()["warp"][0]["angle_deg"], list)  # of keyframes still
        self.press("undo")
        self.rest()
        number = self.field("warp.0.angle_deg", "number")
        self.type(number, "90*s")
        self.rest()
        self.assertEqual(self.doc()["warp"][0]["angle_deg"], "90*s")
        self.type(self.field("warp.0.angle_deg", "number"), "90*(")
        self.until("document.querySelector('.problem:not([hidden])')?.textContent.length > 3 || document.querySelector('[aria-invalid=true]')")
        self.press("undo")
        self.rest()

    def open_item(self, host, kind, place):
        item = self.page.find_element(By.CSS_SELECTOR, f'{host} [data-{kind}="{place}"] [data-role=open]')
        self.js("arguments[0].scrollIntoView({block: 'center'})", item)
        if item.get_attribute("aria-expanded") != "true":
            item.click()

    def test_a_handle_is_put_on_the_surface_and_dragged(self):
        self.press("mode-handle")
        canvas = self.by("canvas")
        ActionChains(self.page).move_to_element(canvas).click().perform()
        self.until("surflect.app.store.doc.warp.some((w) => w.type === 'handles')")
        self.rest()
        warps = self.doc()["warp"]
        handles = next(i for i, warp in enumerate(warps) if warp["type"] == "handles")
        rest = warps[handles]["handle"][0]["rest"]
        self.assertLess(sum(x * x for x in rest), 4)  # on the vase
        marker = self.page.find_element(By.CSS_SELECTOR, f'[data-marker="handle-{handles}-0"]')
        self.changed_by(lambda: self.drag(marker, 60, -30))
        handle = self.doc()["warp"][handles]["handle"][0]
        self.assertEqual(handle["rest"], rest)
        self.assertNotEqual(handle["to"], rest)

    def test_the_timeline_scrubs_and_plays(self):
        scrub = self.by("scrub")
        self.changed_by(lambda: self.drag(scrub, 200, 0))
        frame = self.js("return surflect.app.store.view.frame")
        self.assertGreater(frame, 1)
        self.press("play")
        self.until(f"surflect.app.store.view.frame !== {frame}")
        self.press("play")
        self.rest()
        self.by("canvas").send_keys("[")
        self.rest()
        self.page.find_element(By.CSS_SELECTOR, "[data-key-frame='12']").click()
        self.rest()
        self.assertEqual(self.js("return surflect.app.store.view.frame"), 12)

    # --- eyes

    def test_layers_exposure_and_tone(self):
        self.open("section-view")
        show = Select(self.by("show"))
        for layer in ("normal", "depth", "predicted_error"):
            self.changed_by(lambda: show.select_by_value(layer))
        show.select_by_value("color")
        self.rest()
        dark = self.brightness()
        self.js("const e = document.getElementById('exposure'); e.value = 2; e.dispatchEvent(new Event('input', {bubbles: true}));"
                "e.dispatchEvent(new Event('change', {bubbles: true}))")
        self.rest()
        self.assertGreater(self.brightness(), 1.2 * dark)
        self.changed_by(lambda: Select(self.by("tone")).select_by_value("filmic"))

    def test_a_scripts_finish_is_changed_in_the_script(self):
        self.open("section-view")
        self.js("surflect.app.store.edit((doc) => { doc.camera.exposure = 1;"
                "doc.output = { ...doc.output, tone: 'filmic', background: [0, 0, 1] }; })")
        self.rest()
        self.until("document.getElementById('tone').value === 'filmic'")
        self.assertEqual([self.js("return document.getElementById(arguments[0]).value", name) for name in ("exposure", "background")],
                         ["1", "#0000ff"])
        self.assertFalse(self.by("auto-white").is_enabled())
        dark = self.brightness()
        self.js("const e = document.getElementById('exposure'); e.value = 3; e.dispatchEvent(new Event('input', {bubbles: true}));"
                "e.dispatchEvent(new Event('change', {bubbles: true}))")
        self.rest()
        self.assertGreater(self.brightness(), 1.05 * dark)
        self.changed_by(lambda: Select(self.by("tone")).select_by_value("none"))
        doc = self.doc()
        self.assertEqual((doc["camera"]["exposure"], doc["output"]["tone"], doc["output"]["background"]), (3, "none", [0, 0, 1]))
        self.assertEqual(self.js("return surflect.app.store.view.exposure"), 0)
        time.sleep(0.5)
        self.page.refresh()
        self.rest()
        self.assertEqual(self.doc(), doc)
        self.js("surflect.app.store.edit((doc) => { doc.camera.exposure = 's'; })")
        self.until("document.getElementById('exposure').disabled")

    def test_a_pixel_tells_its_values_and_photographs(self):
        self.press("mode-probe")
        ActionChains(self.page).move_to_element(self.by("canvas")).click().perform()
        self.until("document.querySelectorAll('#probe-values dd').length > 3")
        shot = json.loads(self.js("return JSON.stringify(surflect.app.lastFull)"))
        self.assertEqual(shot["quality"], "full")
        self.until("document.querySelectorAll('#probe-photographs li img').length > 0")
        self.assertEqual(self.js("return [...document.querySelectorAll('#probe-photographs img')].filter((i) => i.complete && !i.naturalWidth).length"), 0)

    def test_a_and_b_are_compared_at_a_divider(self):
        self.open("section-compare")
        self.changed_by(lambda: Select(self.by("compare-kind")).select_by_value("preset"))
        divider = self.by("divider")
        self.assertTrue(divider.is_displayed())
        self.drag(divider, -100, 0)
        self.rest()
        self.assertLess(self.js("return surflect.app.store.view.compare.split"), 0.45)

    def test_the_photograph_of_a_captured_camera_has_the_decibels_of_evaluate(self):
        frame = next(frame for frame in succeed("evaluate", self.model, self.capture)["frames"] if frame["camera"] == "V01")
        self.open("section-camera")
        Select(self.by("captured-camera")).select_by_value(frame["camera"])
        self.rest()
        self.open("section-compare")
        Select(self.by("compare-kind")).select_by_value("photograph")
        self.rest()
        Select(self.by("compare-light")).select_by_value(frame["light"])
        self.rest()
        self.until("document.getElementById('decibels').textContent.includes('dB')")
        self.assertIn(f"{frame['psnr_linear_db']:.2f} dB linear", self.text("decibels"))
        self.changed_by(lambda: self.press("compare-error"))

    # --- results

    def test_save_writes_the_script_and_undo_takes_it_back(self):
        self.open("section-lamps")
        self.open_item("#lamp-list", "light", 0)
        self.type(self.field("light.0.intensity", "number"), "12")
        self.rest()
        self.press("save")
        self.until("document.getElementById('remark').textContent.includes('film.toml')")
        self.assertEqual(self.script.read_text(), self.original.replace("intensity = 30", "intensity = 12"))
        self.press("undo")
        self.rest()
        self.press("save")
        for _ in range(100):
            if self.script.read_text() == self.original:
                break
            time.sleep(0.05)
        self.assertEqual(self.script.read_text(), self.original)

    def test_a_snapshot_and_a_film_are_written(self):
        self.press("snapshot")
        self.until("document.getElementById('remark').textContent.includes('.exr')")
        self.assertTrue(list((self.folder / "snapshots").glob("model_frame*.exr")))
        self.press("record")
        self.type(self.by("record-last"), "4")
        self.by("record-start").click()
        self.until("document.getElementById('record-note').textContent.includes('.mp4')", seconds=60)
        film, = (self.folder / "snapshots").glob("model_film*.mp4")
        told = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_entries",
                               "stream=width,height,nb_read_frames,color_primaries,color_space", "-of", "json", film],
                              capture_output=True, text=True, check=True)
        stream, = json.loads(told.stdout)["streams"]
        self.assertEqual((stream["width"], stream["height"], stream["nb_read_frames"], stream["color_primaries"],
                          stream["color_space"]), (240, 180, "4", "bt709", "bt709"))
        self.by("record-close").click()

    def test_the_address_keeps_the_state(self):
        self.changed_by(lambda: self.drag(self.by("canvas"), 160, 0))
        self.open("section-lamps")
        self.open_item("#lamp-list", "light", 0)
        self.type(self.field("light.0.intensity", "number"), "5")
        self.rest()
        time.sleep(0.5)
        shown, doc = self.pixels(), self.doc()
        self.page.refresh()
        self.rest()
        self.assertEqual(self.doc(), doc)
        self.assertEqual(self.pixels(), shown)
        self.assertNotIn(self.viewer.token, self.page.current_url)

    # --- for everybody

    def test_axe_finds_nothing_at_three_widths(self):
        for width, height, scheme in ((480, 900, "light"), (1280, 800, "dark"), (2560, 1400, "light")):
            self.page.set_window_size(width, height)
            self.page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
            self.rest()
            for section in self.page.find_elements(By.CSS_SELECTOR, "details"):
                self.js("arguments[0].open = true", section)
            self.rest()
            self.js(AXE.read_text())
            found = self.page.execute_async_script("const done = arguments[0]; axe.run().then((r) => done(r.violations.map((v) => "
                                                   "[v.id, v.help, v.nodes.slice(0, 3).map((n) => n.html)])))")
            self.assertEqual(found, [], f"at {width} pixels, {scheme}")
            self.assertEqual(self.js("return document.documentElement.scrollWidth <= innerWidth"), True, f"scrolls sideways at {width}")
            if PICTURES:
                self.page.save_screenshot(f"{PICTURES}/view_{width}.png")
        self.page.set_window_size(1280, 800)
        self.page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})

    def test_a_killed_browser_leaves_the_viewer_serving(self):
        other = browser(self.folder / "other", 800, 600)
        other.get(self.viewer.url)
        time.sleep(1)
        subprocess.run(["pkill", "-9", "-f", other.capabilities["chrome"]["userDataDir"]], check=True)
        other.quit()
        self.changed_by(lambda: self.by("canvas").send_keys("+"))


class OtherTargets(InBrowser):
    """A light field, whose light and shape are fixed, and a capture that is not packed."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.capture = cls.folder / "capture"
        write_small_capture(cls.capture, 3, 3, coarse=True)
        lights = cls.folder / "lights.toml"
        lights.write_text('[[light]]\ntype = "directional"\ndirection = [1, -1, 1]\nintensity = 3\n')
        succeed("pack", cls.capture, "--lights", lights, "--common-lights", "--method", "lfm",
                "-o", cls.folder / "vase.lfm", "--view-size", "12")

    def test_a_light_field_says_why_lamps_and_warps_are_fixed(self):
        with Viewer(self.folder / "vase.lfm", folder=self.folder) as viewer:
            self.show(viewer)
            for section, fields in (("lamps", "lamps-controls"), ("warps", "warps-controls")):
                self.open(f"section-{section}")
                self.assertTrue(self.js("return arguments[0].disabled", self.by(fields)))
                self.assertIn("light and shape are those of the photographs", self.text(f"{section}-why"))
            self.changed_by(lambda: self.drag(self.by("canvas"), 160, 0))
            self.leave()

    def test_a_capture_is_browsed_with_its_mesh_drawn_over_it(self):
        with Viewer(self.capture, folder=self.folder) as viewer:
            self.show(viewer)
            self.changed_by(lambda: Select(self.by("captured-camera")).select_by_value("V01"))
            self.open("section-view")
            self.changed_by(lambda: Select(self.by("photograph-light")).select_by_value("L17"))
            self.changed_by(lambda: self.by("overlay").click())
            if PICTURES:
                self.page.save_screenshot(f"{PICTURES}/view_capture.png")
            self.assertFalse(self.by("save").is_enabled())
            self.leave()


if __name__ == "__main__":
    unittest.main()
