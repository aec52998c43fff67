"""`surflect view` without a browser: what its server answers, refuses and writes."""

import concurrent.futures
import contextlib
import http.client
import json
import math
import pathlib
import random
import shutil
import socket
import struct
import time
import unittest

import exr
import png
from support import ROOT, SCRIPT, TestInFolder, run, succeed
from viewer import Viewer, error_of, shot_of


class View(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=3, lights=3, script="# A small shot\n" + SCRIPT, coarse=True)
        succeed("pack", cls.capture, "-o", cls.model, "--surfels", "20000", "--tables", "off")
        cls.original = cls.script.read_text()
        cls.viewer = Viewer(cls.script, "--capture", cls.capture, "-o", "snapshots", folder=cls.folder)
        cls.addClassCleanup(cls.viewer.process.kill)
        cls.start = json.loads(cls.viewer.get("/start")[1])

    def setUp(self):
        self.assertIsNone(self.viewer.process.poll(), "the viewer has ended")

    def frame(self, **values):
        return self.viewer.post("/frame", shot_of(self.start, **values))

    def test_the_start_describes_model_capture_and_script(self):
        model = self.start["models"][0]
        self.assertEqual((model["name"], model["method"]), ("model.srf", "surfels"))
        self.assertTrue(model["relights"] and model["deforms"] and model["hasPhotographs"])
        self.assertEqual(len(model["photographs"]), 9 + 12)
        names = [camera["name"] for camera in model["cameras"]]
        self.assertIn("V01", names)
        self.assertTrue(model["cameras"][names.index("V01")]["heldOut"])
        self.assertEqual([light.get("#") for light in self.start["doc"]["light"]], [0, 1])
        self.assertEqual(self.start["text"], self.original)

    def test_pictures_are_jpeg_of_the_asked_size(self):
        for values in ({}, {"quality": "preview", "size": [64, 48]}, {"show": "depth"}, {"show": "normal"}, {"tone": "filmic"}):
            status, body, headers = self.frame(**values)
            self.assertEqual(status, 200, body[:300])
            self.assertEqual(body[:2], b"\xff\xd8")
            frame_header = body.index(b"\xff\xc0")
            height, width = struct.unpack(">2H", body[frame_header + 5:frame_header + 9])
            self.assertEqual([width, height], values.get("size", [120, 90]))
            picture = json.loads(headers["X-Picture"])
            self.assertEqual((picture["number"], picture["remark"]), (1, None))
            self.assertGreater(picture["white"], 0)

    def test_a_snapshot_has_the_bits_of_render(self):
        doc = json.loads(json.dumps(self.start["doc"]))
        doc["light"][0]["intensity"] = 12.5
        doc["camera"] = {"position": [3, 1, 1.5], "look_at": [0, 0, 0.1], "up": [0, 0, 1], "fov_deg": 35}
        doc["output"]["aov"] = ["normal"]
        answer = self.viewer.ask("/snapshot", shot_of(self.start, doc=doc, options={"cameras": 2}))
        picture, preview, script = map(lambda name: self.folder / name, answer["files"])
        self.assertTrue(preview.read_bytes().startswith(b"\x89PNG"))
        words = answer["command"].split()
        self.assertEqual(words[:2] + words[3:6], ["surflect", "render", "-o", "frames/", "--frames"])
        report = succeed("render", script, "-o", self.folder / "again", *words[5:])
        self.assertEqual(exr.read_exr(picture), exr.read_exr(pathlib.Path(report["frames"][0]["file"])))
        self.assertIn("# A small shot", script.read_text())

    def test_what_the_script_says_of_exposure_tone_and_background_is_shown(self):
        doc = json.loads(json.dumps(self.start["doc"]))
        doc["camera"]["exposure"] = "2 - frame"
        doc["output"].update(tone="filmic", background=[0.2, 0.3, 0.4], png=True)
        page = {"exposure": 3, "white": 0.5, "background": [1, 0, 0]}
        self.assertEqual(json.loads(self.frame(doc=doc, **page)[2]["X-Picture"])["white"], 1)
        self.assertEqual(self.frame(doc=doc, **page)[1], self.frame(doc=doc)[1])
        answer = self.viewer.ask("/snapshot", shot_of(self.start, doc=doc, **page))
        _, preview, script = map(lambda name: self.folder / name, answer["files"])
        succeed("render", script, "-o", self.folder / "finished", "--frames", "2")
        self.assertEqual(png.read_png(preview), png.read_png(self.folder / "finished/frame.02.png"))
        self.assertEqual(png.read_png(preview)[0], (51, 77, 102))
        del doc["output"]["background"]
        picture, preview, script = (self.folder / name for name in self.viewer.ask("/snapshot", shot_of(self.start, doc=doc, **page))["files"])
        succeed("render", script, "-o", self.folder / "clear", "--frames", "2")
        self.assertEqual(png.read_png(preview), png.read_png(self.folder / "clear/frame.02.png"))
        self.assertEqual(png.read_png(preview)[0][3], 0)
        for attribute in (b"surflect.exposure", b"worldToCamera", b"framesPerSecond"):
            self.assertIn(attribute, picture.read_bytes())

    def test_a_photograph_is_shown_at_the_exposure_of_the_script(self):
        for show in ("photograph", "match", "error"):
            shown = [self.frame(show=show, light="L05", size=[192, 192], doc={**self.start["doc"], "camera": {"from": "V01", **camera}}, **page)
                     for camera, page in (({"exposure": "frame - 1"}, {"exposure": -3, "white": 0.25}), ({}, {"exposure": 1, "white": 1}))]
            self.assertEqual([status for status, _, _ in shown], [200, 200])
            self.assertEqual(json.loads(shown[0][2]["X-Picture"])["white"], 1)
            self.assertEqual(shown[0][1], shown[1][1])

    def test_a_probed_pixel_is_that_of_the_file(self):
        doc = {**self.start["doc"], "output": {**self.start["doc"]["output"], "aov": []}}
        answer = self.viewer.ask("/snapshot", shot_of(self.start, doc=doc))
        width, _, values = exr.read_exr(self.folder / answer["files"][0])
        for x, y in ((60, 45), (55, 50), (2, 2)):
            probed = self.viewer.ask("/probe", shot_of(self.start, doc=doc, x=x + 0.5, y=y + 0.5))
            self.assertEqual(probed["color"], [values[channel][y * width + x] for channel in "RGBA"])
            self.assertEqual(probed["aovs"]["normal"] is None, probed["color"][3] == 0)
            self.assertEqual(len(probed["photographs"]) > 0, probed["color"][3] > 0)
            if probed["photographs"]:
                self.assertAlmostEqual(sum(each["weight"] for each in probed["photographs"]), 1, 14)
                self.assertLessEqual({each["camera"] for each in probed["photographs"]}, {"C13", "C17", "C21"})
                self.assertLess(max(map(abs, probed["aovs"]["rest"])), 2)  # on the vase

    def test_a_photograph_and_its_error_are_those_of_evaluate(self):
        wanted = succeed("evaluate", self.model, self.capture)["frames"]
        for frame in (wanted[0], wanted[5]):
            size = [192, 192]
            values = {"doc": {**self.start["doc"], "camera": {"from": frame["camera"]}}, "light": frame["light"], "size": size}
            self.assertEqual(self.frame(show="photograph", **values)[0], 200)
            for show in ("match", "error"):
                status, body, headers = self.frame(show=show, **values)
                self.assertEqual(status, 200, body[:300])
                decibels = json.loads(headers["X-Picture"])["decibels"]
                self.assertEqual((decibels["linear"], decibels["srgb"], decibels["ssim"]),
                                 (frame["psnr_linear_db"], frame["psnr_srgb_db"], frame["ssim_srgb"]))
        answer = self.viewer.post("/thumbnail", {"model": 0, "camera": "V01", "light": "L05", "x": 96, "y": 96, "white": 1})
        self.assertEqual(answer[0], 200)

    def test_a_held_out_camera_can_be_looked_through(self):
        doc = {**self.start["doc"], "camera": {"from": "V01"}}
        self.assertEqual(self.frame(doc=doc, size=[192, 192])[0], 200)
        values = self.viewer.ask("/values", {"doc": doc, "frame": 2})
        camera = next(camera for camera in self.start["models"][0]["cameras"] if camera["name"] == "V01")
        for got, wanted in zip(values["camera"]["position"] + values["camera"]["forward"], camera["position"] + camera["forward"]):
            self.assertAlmostEqual(got, wanted, 14)

    def test_values_of_tracks_are_told(self):
        values = self.viewer.ask("/values", {"doc": self.start["doc"], "frame": 2})
        for got, wanted in zip(values["camera"]["position"], [4.5, -0.5, 1]):
            self.assertAlmostEqual(got, wanted, 14)
        self.assertAlmostEqual(values["camera"]["fov_deg"], 32, 13)
        self.assertEqual(values["warp"][0]["angle_deg"], 20)
        self.assertAlmostEqual(values["light"][0]["position"][0], 3 * math.cos(1.5), 14)

    def test_saving_edits_the_script_in_place(self):
        doc = json.loads(json.dumps(self.start["doc"]))
        doc["light"][0]["intensity"] = 31
        try:
            self.assertEqual(self.viewer.ask("/text", {"doc": doc})["text"], self.original.replace("intensity = 30", "intensity = 31"))
            saved = self.viewer.ask("/save", {"doc": doc})
            self.assertEqual((saved["path"], saved["changed"]), (str(self.script), 1))
            self.assertEqual(self.script.read_text(), self.original.replace("intensity = 30", "intensity = 31"))
            self.assertEqual(json.loads(self.viewer.get("/start")[1])["doc"], doc)
            with open(self.script, "a") as script:
                script.write("# by somebody else\n")
            answer = self.viewer.post("/save", {"doc": self.start["doc"]})
            self.assertEqual(answer[0], 422)
            self.assertIn("changed by another program", error_of(answer))
            self.assertTrue(self.script.read_text().endswith("# by somebody else\n"))
        finally:
            self.script.write_text(self.original.replace("intensity = 30", "intensity = 31"))
            self.viewer.ask("/save", {"doc": self.start["doc"]})
        self.assertEqual(self.script.read_text(), self.original)

    def test_the_only_warp_may_be_left_out(self):
        for doc in ({**self.start["doc"], "warp": []}, {k: v for k, v in self.start["doc"].items() if k != "warp"}):
            self.assertEqual(self.frame(doc=doc)[0], 200)
            self.assertNotIn("[[warp]]", self.viewer.ask("/text", {"doc": doc})["text"])

    def test_a_held_out_camera_is_no_camera_of_a_script(self):
        doc = {**self.start["doc"], "camera": {"from": "V01"}}
        answer = self.viewer.post("/save", {"doc": doc})
        self.assertEqual(answer[0], 422)
        self.assertIn("held-out", error_of(answer))
        snapshot = self.viewer.ask("/snapshot", shot_of(self.start, doc=doc, size=[192, 192]))
        succeed("render", self.folder / snapshot["files"][2], "-o", self.folder / "held", "--frames", "2")

    def test_a_page_that_has_missed_a_save_is_told(self):
        saves = json.loads(self.viewer.get("/start")[1])["saves"]
        self.assertEqual(self.viewer.ask("/save", {"doc": self.start["doc"], "saves": saves})["saves"], saves + 1)
        status, body, _ = self.viewer.post("/save", {"doc": self.start["doc"], "saves": saves})
        self.assertEqual((status, json.loads(body)["saves"]), (422, saves + 1))

    def test_a_handle_rests_on_the_surface_before_its_warp(self):
        probed = self.viewer.ask("/probe", shot_of(self.start, x=60.5, y=45.5, before=1))
        for got, wanted in zip(probed["before"], probed["aovs"]["position"]):
            self.assertAlmostEqual(got, wanted, delta=1.6e-5)  # the surfel's middle and the pixel's place
        self.assertEqual(probed["before"], probed["after"])  # there is no second warp
        self.assertEqual(self.viewer.ask("/probe", shot_of(self.start, x=60.5, y=45.5, before=0))["before"], probed["aovs"]["rest"])

    def test_mistakes_of_a_script_name_their_field(self):
        def edited(change):
            doc = json.loads(json.dumps(self.start["doc"]))
            change(doc)
            return self.frame(doc=doc)

        for change, field in (
                (lambda doc: doc["light"][0].update(intensity=-3), "light[0].intensity"),
                (lambda doc: doc["camera"].update(fov_deg=200), "camera.fov_deg"),
                (lambda doc: doc["camera"].update(fov="1 +"), "camera.fov"),
                (lambda doc: doc["warp"][0].update(angle_deg="nonsense(t)"), "warp[0].angle_deg"),
                (lambda doc: doc["light"].append({"type": "environment", "image": "/etc/passwd"}), "a file of the script"),
                (lambda doc: doc.update(model="/etc"), "a file of the script"),
                (lambda doc: doc["warp"].append({"type": "mesh", "rest": "/etc/passwd", "frames": "x"}), "a file of the script"),
                (lambda doc: doc.update(light=[{"type": "directional", "direction": [0, 0, 1]}] * 10_000), "light: found 10000"),
                (lambda doc: doc.update(warp=[{"type": "handles", "handle": [{"rest": [0, 0, i], "to": [0, 0, i]}
                                                                              for i in range(65)]}]), "warp.handle: found 65"),
                (lambda doc: doc["light"][0].update({"#": 5}), "light.#"),
                (lambda doc: doc.pop("camera"), "camera")):
            answer = edited(change)
            self.assertEqual(answer[0], 422, answer)
            self.assertIn(field, error_of(answer))

    def test_malformed_requests_are_refused(self):
        good = shot_of(self.start)
        for name, value in (("size", [0, 10]), ("size", [5000, 10]), ("size", [1.5, 10]), ("size", "large"), ("size", [4096, 4096]), ("model", 1),
                            ("model", -1), ("frame", "x"), ("frame", 0.5), ("quality", "best"), ("tone", "x"), ("number", -1),
                            ("background", [0, 0]), ("background", [0, 0, 2]), ("white", -1), ("white", 0), ("exposure", 1e9),
                            ("doc", []), ("options", 3), ("unknown", 1), ("show", "x" * 2000)):
            answer = self.viewer.post("/frame", {**good, name: value})
            self.assertEqual(answer[0], 400, (name, value, answer))
            self.assertIn(name, error_of(answer))
        for key in ("number", "model", "doc", "frame", "size"):
            answer = self.viewer.post("/frame", {k: v for k, v in good.items() if k != key})
            self.assertEqual((answer[0], error_of(answer)), (400, f"{key}: missing"))
        for body in (b"", b"{", b"[]", b"\xff\xfe", b"[" * 100_000, b'{"a":' * 500 + b"1" + b"}" * 500, b'{"number":NaN}',
                     b'{"number":1e999}'):
            self.assertEqual(self.viewer.post("/frame", body)[0], 400, body[:20])
        for values in ({"options": {"cameras": "many"}}, {"options": {"no_such": 1}}, {"show": "no_such"},
                       {"show": "photograph", "doc": {**good["doc"], "camera": {"from": "nobody"}}},
                       {"show": "match", "doc": {**good["doc"], "camera": {"from": "V01"}}, "light": "x"}):
            self.assertEqual(self.frame(**values)[0], 422, values)
        self.assertEqual(self.viewer.post("/frame", b" " * (2 << 20))[0], 413)
        for name, value in (("Transfer-Encoding", "chunked"), ("Content-Encoding", "gzip")):
            self.assertEqual(self.viewer.post("/frame", good, headers={name: value})[0], 400, name)

    def test_foreign_pages_hosts_and_methods_are_refused(self):
        port = self.viewer.port
        for headers in ({"Host": "evil.example"}, {"Host": f"evil.example:{port}"}, {"Host": "127.0.0.1.evil.example"}, {"Host": None},
                        {"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": f"https://127.0.0.1:{port}"},
                        {"X-Surflect-Token": None}, {"X-Surflect-Token": ""}, {"X-Surflect-Token": "0" * 32}):
            for method, path in (("GET", "/start"), ("GET", "/events?after=0"), ("POST", "/frame"), ("POST", "/save"), ("POST", "/")):
                status = self.viewer.request(method, path, {}, headers=headers)[0]
                self.assertIn(status, (400, 403) if headers.get("Host", "") is None else (403,), (headers, path))
        self.assertEqual(self.viewer.get("/", headers={"Host": f"evil.example:{port}"})[0], 403)
        for host in (f"127.0.0.1:{port}", f"localhost:{port}", f"[::1]:{port}", "localhost:9000"):  # the last by ssh -L
            self.assertEqual(self.viewer.get("/start", headers={"Host": host, "Origin": f"http://{host}"})[0], 200)
        for method in ("PUT", "DELETE", "OPTIONS", "PATCH"):
            self.assertEqual(self.viewer.request(method, "/frame", {})[0], 405, method)
        for path in ("/film.toml", "/../film.toml", "/%2e%2e/film.toml", "/etc/passwd", "//etc/passwd", "/page.h", "/start.js"):
            self.assertEqual(self.viewer.get(path)[0], 404, path)
            self.assertEqual(self.viewer.post(path, {})[0], 404, path)
        for tab in ("", "x", "../../..", "0" * 65):
            self.assertEqual(self.viewer.get("/start", tab=tab)[0], 400, tab)

    def test_the_page_needs_no_token_and_allows_nothing_foreign(self):
        status, body, headers = self.viewer.get("/", headers={"X-Surflect-Token": None, "X-Surflect-Tab": None})
        self.assertEqual(status, 200)
        self.assertIn(b"<!doctype html>", body[:200].lower())
        self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
        self.assertNotIn("unsafe", headers["Content-Security-Policy"])
        self.assertNotIn(self.viewer.token.encode(), body)

    def test_no_more_than_eight_pages_at_a_time(self):
        with Viewer(self.model, folder=self.folder) as viewer:
            answers = [viewer.get("/start", tab=f"{i:016x}")[0] for i in range(50)]
            self.assertEqual(answers, [200] * 8 + [429] * 42)

    def test_a_newer_state_takes_the_place_of_a_full_frame(self):
        lamps = [{"type": "directional", "direction": [1, i / 30, 0.5]} for i in range(60)]
        large = {"size": [4096, 2160], "doc": {**self.start["doc"], "light": lamps}, "show": "predicted_error"}
        for delay in (0.1, 0.2, 0.4, 0.8):  # on a busy machine the older one may come late
            with concurrent.futures.ThreadPoolExecutor() as pool:
                older = pool.submit(self.frame, **large)
                time.sleep(delay)
                self.assertEqual(self.frame(quality="preview", size=[40, 30])[0], 200)
                if older.result()[0] == 409:
                    return
        self.fail("a full frame was never given up")

    def test_garbage_on_the_socket_is_survived(self):
        with concurrent.futures.ThreadPoolExecutor() as pool:
            list(pool.map(self.send_garbage, range(6)))  # for ten seconds each
        self.assertEqual(self.frame()[0], 200)

    def send_garbage(self, seed):
        seeded = random.Random(seed)
        tab = f"{seed:016x}"
        good = json.dumps(shot_of(self.start)).encode()
        begin = time.monotonic()
        rounds = 0
        while time.monotonic() - begin < 10:
            rounds += 1
            body = bytearray(good)
            for _ in range(seeded.randint(1, 8)):
                place = seeded.randrange(len(body))
                kind = seeded.randrange(3)
                if kind == 0:
                    body[place] = seeded.randrange(256)
                elif kind == 1:
                    del body[place:place + seeded.randint(1, 20)]
                else:
                    body[place:place] = seeded.choice([b"-", b"1e308", b"\"", b"[", b"null", b"}", b"\\u0000", b"9" * 30])
            status = self.viewer.post(seeded.choice(["/frame", "/probe", "/values", "/text", "/thumbnail", "/snapshot"]), bytes(body), tab=tab)[0]
            self.assertIn(status, (200, 400, 422))
            if rounds % 10 == 0:
                with socket.create_connection(("127.0.0.1", self.viewer.port)) as raw:
                    raw.sendall(seeded.randbytes(seeded.randint(1, 300)))
        self.assertGreater(rounds, 10)

    def test_a_killed_viewer_leaves_no_half_written_file(self):
        folder = self.folder / "killed"
        for delay in (0.05, 0.15, 0.3):
            with Viewer(self.script, "-o", folder, folder=self.folder) as viewer:
                start = json.loads(viewer.get("/start")[1])
                shot = shot_of(start, doc={**start["doc"], "output": {**start["doc"]["output"], "size": [800, 600], "aov": []}})
                with concurrent.futures.ThreadPoolExecutor() as pool:
                    asked = pool.submit(self.survive, viewer, shot)
                    time.sleep(delay)
                    viewer.process.kill()
                    asked.result()
        with Viewer(self.script, "-o", folder, folder=self.folder) as viewer:
            viewer.ask("/snapshot", shot)
        self.assertEqual(self.script.read_text(), self.original)
        wholes = {".exr": lambda path: exr.read_exr(path)[:2] == (800, 600), ".toml": lambda path: path.read_text().startswith("# A small"),
                  ".png": lambda path: path.read_bytes().endswith(b"IEND\xaeB`\x82")}
        kinds = [path.suffix for path in folder.iterdir() if path.suffix in wholes]
        self.assertLessEqual({".exr", ".png", ".toml"}, set(kinds))
        for path in folder.iterdir():
            self.assertTrue(wholes.get(path.suffix, lambda path: True)(path), path)

    @staticmethod
    def survive(viewer, shot):
        with contextlib.suppress(OSError, http.client.HTTPException):
            viewer.post("/snapshot", shot)

    def test_ctrl_c_ends_it_at_once_with_pages_waiting(self):
        with Viewer(self.script, folder=self.folder) as viewer, concurrent.futures.ThreadPoolExecutor() as pool:
            viewer.get("/start")
            waiting = pool.submit(viewer.get, "/events?after=0")
            time.sleep(0.2)
            begin = time.monotonic()
            self.assertEqual(viewer.end(), 0)
            self.assertLess(time.monotonic() - begin, 10)
            waiting.exception()


class Targets(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.write_small_shot(cameras=2, lights=2, coarse=True)
        succeed("pack", cls.capture, "-o", cls.model, "--surfels", "5000", "--tables", "off")

    def test_a_model_gets_a_script_of_its_own(self):
        with Viewer(self.model, "-o", "own", folder=self.folder) as viewer:
            start = json.loads(viewer.get("/start")[1])
            self.assertFalse(start["isScript"])
            self.assertFalse((self.folder / "own").exists())
            self.assertEqual(viewer.post("/frame", shot_of(start))[0], 200)
            saved = viewer.ask("/save", {"doc": start["doc"]})
        succeed("render", self.folder / saved["path"], "-o", self.folder / "film", "--frames", "1", "--scale", "0.1")

    def test_a_capture_shows_its_photographs(self):
        with Viewer(self.capture, folder=self.folder) as viewer:
            start = json.loads(viewer.get("/start")[1])
            self.assertEqual(start["models"][0]["method"], "capture")
            shot = shot_of(start, show="photograph", doc={**start["doc"], "camera": {"from": "V01"}}, light="L05", size=[192, 192])
            self.assertEqual(viewer.post("/frame", shot)[0], 200)
            self.assertEqual(viewer.post("/frame", {**shot, "overlay": True})[0], 200)
            self.assertEqual(viewer.post("/frame", shot_of(start))[0], 400)

    def test_a_folder_shows_its_models_and_snapshots_name_theirs(self):
        models = self.folder / "models"
        for name in ("a.srf", "b.srf"):
            shutil.copytree(self.model, models / name)
        with Viewer(models, "-o", "shots", folder=self.folder) as viewer:
            start = json.loads(viewer.get("/start")[1])
            self.assertEqual([model["name"] for model in start["models"]], ["a.srf", "b.srf"])
            doc = {**start["doc"], "output": {**start["doc"]["output"], "size": [40, 30]}}
            files = viewer.ask("/snapshot", shot_of(start, doc=doc, model=1))["files"]
            self.assertIn(f'model = "{models}/b.srf"', (self.folder / files[2]).read_text())

    def test_a_script_s_own_model_comes_first(self):
        other = shutil.copytree(self.model, self.folder / "other.srf")
        with Viewer(other, self.script, folder=self.folder) as viewer:
            self.assertEqual([model["name"] for model in json.loads(viewer.get("/start")[1])["models"]], ["model.srf", "other.srf"])

    def test_environments_are_named_from_the_script(self):
        (self.folder / "maps").mkdir()
        shutil.copy(ROOT / "examples" / "environments" / "studio.exr", self.folder / "maps")
        (self.folder / "here").mkdir()
        with Viewer("../film.toml", "--environments", "../maps", folder=self.folder / "here") as viewer:
            start = json.loads(viewer.get("/start")[1])
            light = {"type": "environment", "image": start["environments"][0]["image"]}
            self.assertEqual(light["image"], "maps/studio.exr")
            self.assertEqual(viewer.post("/frame", shot_of(start, doc={**start["doc"], "light": [light]}))[0], 200)

    def test_what_cannot_be_shown_is_said(self):
        (self.folder / "empty").mkdir()
        (self.folder / "note.txt").write_text("x")
        for target, words in (("missing", "cannot open (No such file or directory)"), ("empty", "expected a model"), ("note.txt", "expected a model")):
            result = run("view", self.folder / target)
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertIn(words, result.stderr)
        for option in (("--port", "0"), ("--port", "99999"), ("--cameras", "0"), ("--no-such",)):
            self.assertEqual(run("view", self.model, *option).returncode, 2, option)
        with Viewer(self.model, folder=self.folder) as viewer:
            taken = run("view", self.model, "--port", viewer.port)
            self.assertEqual(taken.returncode, 1)
            self.assertIn("the port is taken", taken.stderr)
        self.assertEqual(run("view", self.model, "--environments", self.folder / "empty").returncode, 1)


if __name__ == "__main__":
    unittest.main()
