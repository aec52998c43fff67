"""The site that scripts/site makes of the documentation: links, widths, and what hinders people."""

import html.parser
import os
import pathlib
import re
import subprocess
import unittest
import urllib.parse

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

from support import ROOT, TestInFolder

AXE = pathlib.Path(os.environ["AXE"])  # axe.min.js
PICTURES = os.environ.get("PICTURES")


class Page(html.parser.HTMLParser):
    """Anchors and addresses of a page."""

    def __init__(self, path):
        super().__init__()
        self.anchors, self.addresses = set(), []
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id":
                self.anchors.add(value)
            if name in ("href", "src"):
                self.addresses.append(value)


class Site(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.site = cls.folder / "site"
        subprocess.run([ROOT / "scripts/site", cls.site], check=True, stdout=subprocess.DEVNULL)
        cls.pages = {path: Page(path) for path in sorted(cls.site.rglob("*.html"))}

    def test_every_page_of_docs_is_in_the_list(self):
        listed = re.findall(r"\]\((docs/[\w-]+\.md)\)", (ROOT / "README.md").read_text().partition("\n## Pages\n")[2])
        self.assertEqual(sorted(set(listed)), sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")))
        for page in listed:
            self.assertIn((self.site / page).with_suffix(".html"), self.pages)

    def test_links_lead_to_pages_and_anchors_within_the_site(self):
        count = 0
        for path, page in self.pages.items():
            for address in page.addresses:
                if re.match(r"https?:", address):
                    continue
                count += 1
                place, _, anchor = urllib.parse.unquote(address).partition("#")
                target = (path.parent / place).resolve() if place else path
                with self.subTest(page=path.relative_to(self.site), address=address):
                    self.assertTrue(target.is_file())
                    self.assertTrue(target.is_relative_to(self.site.resolve()))
                    if anchor:
                        self.assertIn(anchor, self.pages[target].anchors)
        self.assertGreater(count, 1000)

    def test_nothing_is_fetched_when_a_page_is_seen(self):
        for path in self.pages:
            loaded = re.findall(r"<(?:img|link|script|iframe)[^>]*(?:src|href)=\"(https?:[^\"]*)", path.read_text())
            self.assertEqual(loaded, [], path)

    def test_a_folder_that_is_not_empty_stays_as_it_is(self):
        taken = self.folder / "taken"
        taken.mkdir()
        (taken / "mine.txt").write_text("mine")
        result = subprocess.run([ROOT / "scripts/site", taken], capture_output=True, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertEqual([path.name for path in taken.iterdir()], ["mine.txt"])

    def test_pages_fit_their_window_and_axe_finds_nothing(self):
        options = Options()
        for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
                         "--disable-dev-shm-usage", "--hide-scrollbars", f"--user-data-dir={self.folder / 'profile'}"):
            options.add_argument(argument)
        page = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.addCleanup(page.quit)
        for width, scheme, names in ((480, "light", ("index", "docs/start", "docs/import")), (1280, "dark", ("docs/start", "docs/script")),
                                     (2560, "light", ("index", "docs/gallery"))):
            page.set_window_size(width, 1000)
            page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
            for name in names:
                with self.subTest(width=width, scheme=scheme, name=name):
                    page.get((self.site / f"{name}.html").as_uri())
                    self.assertTrue(page.execute_script("return document.documentElement.scrollWidth <= innerWidth"))
                    page.execute_script(AXE.read_text())
                    found = page.execute_async_script("const done = arguments[0]; axe.run().then((r) => done(r.violations.map((v) => "
                                                      "[v.id, v.help, v.nodes.slice(0, 3).map((n) => n.html)])))")
                    self.assertEqual(found, [])
                    if PICTURES:
                        page.save_screenshot(f"{PICTURES}/site_{name.replace('/', '_')}_{width}.png")


if __name__ == "__main__":
    unittest.main()
