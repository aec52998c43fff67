"""Tables of docs/: how scripts/ replace and read them, and that summaries are those of the complete tables.

    doc_tables_test.py SOURCE_ROOT
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(sys.argv.pop())
sys.path.insert(0, str(ROOT / "scripts"))
import doc_tables  # noqa: E402

PAGE = "# Page\n\n<!-- a -->\n<!-- end -->\n\ntext\n\n<!-- a b -->\nold\n<!-- end -->\n"


class DocTables(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (self.folder / "page.md").write_text(PAGE)

    def test_a_table_is_read_as_it_was_written(self):
        head, rows = ["object", "dB, SSIM"], [["idol", "21.58, 0.8"], ["vase", ""]]
        doc_tables.replace("a", doc_tables.table(head, rows), self.folder)
        self.assertEqual(doc_tables.read("a", self.folder), (head, rows))

    def test_all_else_stays(self):
        doc_tables.replace("a b", "new\n", self.folder)
        self.assertEqual((self.folder / "page.md").read_text(), PAGE.replace("old", "new"))

    def test_a_name_stands_on_one_page(self):
        for pages in (["none"], ["a", "second"]):
            if "second" in pages:
                (self.folder / "second.md").write_text(PAGE)
            with self.assertRaises(SystemExit):
                doc_tables.page_of(pages[0], self.folder)

    def test_a_pivot_has_a_row_and_a_column_for_each_name(self):
        rows = [["idol", "slf", "1"], ["idol", "lfm", "2"], ["vase", "lfm", "3"]]
        self.assertEqual(doc_tables.pivot(rows, lambda r: r[0], lambda r: r[1], lambda r: r[2]),
                         (["slf", "lfm"], [["idol", "1", "2"], ["vase", "", "3"]]))

    def test_summaries_are_those_of_the_complete_tables(self):
        for name in ("docs", "scripts"):
            shutil.copytree(ROOT / name, self.folder / name)
        for command in (["accuracy", "summaries"], ["opacity", "summaries"], ["light_fields", "--only", "summaries"],
                        ["stability", "--summaries"]):
            subprocess.run([sys.executable, "-B", self.folder / "scripts" / command[0], *command[1:]], check=True)
        for page in sorted((ROOT / "docs").glob("*.md")):
            with self.subTest(page=page.name):
                self.assertEqual((self.folder / "docs" / page.name).read_text(), page.read_text())


if __name__ == "__main__":
    unittest.main()
