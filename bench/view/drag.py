#!/usr/bin/python3
"""Times the viewer: from a mouse's move to the picture that shows it, and until a full frame is given up.

    bench/view/drag.py SURFLECT MODEL [--size 960x720] [--seconds 10] [--json]

Drags the camera round the model in headless Chromium, then asks for full frames and takes them back. Prints medians, 95th
percentiles and how large previews were; needs chromium, chromium-driver and python3-selenium.
"""

import argparse
import contextlib
import http.client
import json
import pathlib
import statistics
import subprocess
import tempfile
import threading
import time

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By

PANEL, BARS = 321, 165  # pixels of the page beside and below the picture


def percentile(values, part):
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


def browser(profile, width, height):
    options = Options()
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                     "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--hide-scrollbars",
                     f"--user-data-dir={profile}", f"--window-size={width + PANEL},{height + BARS}"):
        options.add_argument(argument)
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


def drag(page, seconds):
    """Turns the camera to and fro by the mouse; returns latencies in ms and what the page tells of its pictures."""
    canvas = page.find_element(By.ID, "canvas")
    page.execute_script("surflect.latencies.length = 0; window.facts = []; const facts = document.getElementById('picture-facts');"
                        "new MutationObserver(() => window.facts.push(facts.textContent)).observe(facts, {childList: true, characterData: true, subtree: true})")
    latencies, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        chain = ActionChains(page, duration=16).move_to_element(canvas).click_and_hold()
        for step in range(60):
            chain.move_by_offset(3 if step < 30 else -3, 1 if step % 2 else -1)
        chain.release().perform()
        latencies += page.execute_script("return surflect.latencies.splice(0)")
    return latencies, page.execute_script("return window.facts")


def give_up(port, token, start, size, rounds=15):
    """Seconds until a full frame that gives way to a newer state is answered."""
    headers = {"X-Surflect-Token": token, "X-Surflect-Tab": "00112233445566ff"}
    shot = {"number": 1, "model": 0, "doc": start["doc"], "frame": 2, "size": size, "quality": "full", "white": 1}
    took = []

    def ask(changes, done):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        connection.request("POST", "/frame", json.dumps({**shot, **changes}), headers)
        answer = connection.getresponse()
        answer.read()
        done.append((answer.status, time.monotonic()))

    ask({}, [])
    for i in range(rounds):
        older = []
        thread = threading.Thread(target=ask, args=({}, older))
        thread.start()
        time.sleep(0.05 + 0.01 * i)
        begin = time.monotonic()
        ask({"quality": "preview", "size": [16, 12]}, [])
        thread.join()
        if older[0][0] == 409:
            took.append(older[0][1] - begin)
    return took


def address_in(log, viewer):
    """The address that the viewer prints once it listens."""
    while viewer.poll() is None:
        for line in log.read_text().splitlines():
            if line.startswith("http://"):
                return line
        time.sleep(0.05)
    raise SystemExit(log.read_text())


def measure(url, profile, width, height, seconds):
    port, token = int(url.split(":")[2].split("/")[0]), url.partition("token=")[2]
    page = browser(profile, width, height)
    try:
        begin = time.monotonic()
        page.get(url)
        while not page.execute_script("return Boolean(window.surflect && surflect.app && surflect.app.lastFull)"):
            time.sleep(0.01)
        first = time.monotonic() - begin
        drag(page, 3)  # the scale of previews settles
        latencies, pictures = drag(page, seconds)
        most = page.execute_script("return surflect.mostInFlight")
    finally:
        page.quit()
    connection = http.client.HTTPConnection("127.0.0.1", port)
    connection.request("GET", "/start", headers={"X-Surflect-Token": token, "X-Surflect-Tab": "00112233445566ff"})
    gaps = give_up(port, token, json.loads(connection.getresponse().read()), [width, height])
    return {"first_picture_ms": 1e3 * first, "pictures": len(latencies), "input_to_pixel_p50_ms": statistics.median(latencies),
            "input_to_pixel_p95_ms": percentile(latencies, 0.95), "most_in_flight": most,
            "last_preview": next((text for text in reversed(pictures) if "preview" in text), ""),
            "given_up": len(gaps), "given_up_p50_ms": 1e3 * statistics.median(gaps) if gaps else None,
            "given_up_p95_ms": 1e3 * percentile(gaps, 0.95) if gaps else None}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("surflect")
    parser.add_argument("model", help="or a script")
    parser.add_argument("--size", default="960x720", help="of the picture")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("more", nargs="*", help="options of surflect view, after --")
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    with tempfile.TemporaryDirectory() as folder:
        log = pathlib.Path(folder) / "log"
        with open(log, "w") as stderr, contextlib.ExitStack() as stack:
            viewer = subprocess.Popen([arguments.surflect, "view", arguments.model, "-o", folder + "/out", *arguments.more], stderr=stderr)
            stack.callback(viewer.wait)
            stack.callback(viewer.terminate)
            report = measure(address_in(log, viewer), folder + "/profile", width, height, arguments.seconds)
    print(json.dumps(report) if arguments.json else "\n".join(f"{key:24} {value}" for key, value in report.items()))


if __name__ == "__main__":
    main()
