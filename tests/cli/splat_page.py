"""Draws Gaussians of a PLY file in headless Chromium, by gaussian-splats-3d, a WebGL viewer."""

import base64
import contextlib
import functools
import http.server
import json
import pathlib
import shutil
import threading

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

PAGE = """<!doctype html><meta charset="utf-8"><title>waiting</title>
<style>body { margin: 0; background: black } #view { width: WIDTHpx; height: HEIGHTpx }</style><div id="view"></div>
<script type="importmap">{"imports": {"three": "./three/build/three.module.js"}}</script>
<script type="module">
import * as THREE from "three";
import { Viewer, SceneFormat, SceneRevealMode, LogLevel } from "./gaussian-splats-3d/build/gaussian-splats-3d.module.js";
window.onunhandledrejection = event => { document.title = "failed: " + event.reason; };
const { object_from_camera, fov } = CAMERA;
const camera = new THREE.PerspectiveCamera(fov, WIDTH / HEIGHT, 0.1, 100);
new THREE.Matrix4().set(...object_from_camera).decompose(camera.position, camera.quaternion, camera.scale);
camera.updateMatrixWorld(true);
const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
renderer.setPixelRatio(1);
renderer.setSize(WIDTH, HEIGHT);
renderer.setClearColor(new THREE.Color(0, 0, 0), 1);
document.getElementById("view").appendChild(renderer.domElement);
const viewer = new Viewer({ selfDrivenMode: false, useBuiltInControls: false, renderer, camera, rootElement: document.getElementById("view"),
  ignoreDevicePixelRatio: true, gpuAcceleratedSort: false, sharedMemoryForWorkers: false, integerBasedSort: false, sphericalHarmonicsDegree: 2,
  logLevel: LogLevel.None, sceneRevealMode: SceneRevealMode.Instant, inMemoryCompressionLevel: 0, freeIntermediateSplatData: false });
await viewer.addSplatScene("splats.ply", { format: SceneFormat.Ply, showLoadingUI: false, splatAlphaRemovalThreshold: 0 });
while (!viewer.splatRenderReady) await new Promise(done => setTimeout(done, 50));
viewer.update();
await viewer.runSplatSort(true, true);
await viewer.sortPromise;
viewer.update();
viewer.render();
window.count = viewer.splatMesh.getSplatCount();
window.picture = renderer.domElement.toDataURL("image/png");
document.title = "drawn";
</script>
"""


@contextlib.contextmanager
def served(folder):
    """Address at which a folder is served."""
    handler = functools.partial(type("Quiet", (http.server.SimpleHTTPRequestHandler,), {"log_message": lambda *_: None}),
                                directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


def draw_in_browser(readers, ply, folder, object_from_camera, fov, size):
    """PNG of the file, and how many Gaussians the viewer found. Camera: 4 x 4, y up, looking along -z; fov: vertical, degrees."""
    folder.mkdir()
    for name in ("three", "gaussian-splats-3d"):
        (folder / name).symlink_to(pathlib.Path(readers, name).resolve())
    shutil.copy(ply, folder / "splats.ply")
    camera = json.dumps({"object_from_camera": [float(x) for x in object_from_camera.flatten()], "fov": fov})
    page = PAGE.replace("CAMERA", camera).replace("WIDTH", str(size[0])).replace("HEIGHT", str(size[1]))
    (folder / "index.html").write_text(page)
    options = Options()
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--use-angle=swiftshader",
                     "--enable-unsafe-swiftshader", f"--user-data-dir={folder}/profile", f"--window-size={size[0]},{size[1]}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    with served(folder) as address, webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options) as browser:
        browser.get(address)
        WebDriverWait(browser, 300).until(lambda b: b.title != "waiting")
        if browser.title != "drawn":
            raise AssertionError(f"{browser.title}: {browser.get_log('browser')}")
        picture = browser.execute_script("return window.picture").partition(",")[2]
        return base64.b64decode(picture), browser.execute_script("return window.count")
