"""Full disk or file size limit: `surflect` reports it in one line and leaves nothing half-written."""

import json
import resource
import shutil
import subprocess
import unittest

from support import SCRIPT, SMALL_STAGE, SURFLECT, TestInFolder, content, succeed, write_small_capture


def run_within(file_bytes, *arguments):
    """`surflect` that can write no file beyond a size, as on a disk that is full from there on."""
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (file_bytes, file_bytes))

    return subprocess.run([SURFLECT, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True, timeout=300, preexec_fn=limit)


class FullDisk(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.capture = cls.folder / "capture"
        cls.script = cls.folder / "film.toml"
        write_small_capture(cls.capture, cameras=3, lights=2, coarse=True)
        cls.script.write_text(SCRIPT)
        succeed(*cls.pack("model.srf"))
        succeed(*cls.render("film"))

    @classmethod
    def pack(cls, name):
        return ["pack", cls.capture, "-o", cls.folder / name, "--surfels", "3000", "--tables", "off"]

    @classmethod
    def render(cls, name):
        return ["render", cls.script, "-o", cls.folder / name, "--resume"]

    def fails_and_recovers(self, arguments_for, whole):
        """A limit below each of the files in turn: that file is complained about, and no part of it is there."""
        for size in sorted({len(data) for data in whole.values()}):
            with self.subTest(limit=size - 1):
                result = run_within(size - 1, *arguments_for("full"), "--json")
                self.assertEqual(result.returncode, 1, result.stderr)
                error = json.loads(result.stdout)["error"]
                self.assertRegex(error, r"^\S*/full/\S+: cannot write \(File too large\)$")
                self.assertEqual(result.stderr.splitlines()[-1], "surflect: " + error)
                refused = error.split(":")[0].rpartition("/full/")[2]
                left = content(self.folder / "full")
                self.assertNotIn(refused, left)
                self.assert_same_files(left, {name: whole[name] for name in left})
                succeed(*arguments_for("full"))
                self.assert_same_files(content(self.folder / "full"), whole)
                shutil.rmtree(self.folder / "full")

    def test_pack(self):
        self.fails_and_recovers(self.pack, content(self.folder / "model.srf"))

    def test_render(self):
        self.fails_and_recovers(self.render, content(self.folder / "film"))

    def test_no_picture_of_an_older_film_stays_beside_a_newer_one(self):
        shutil.copytree(self.folder / "film", self.folder / "newer")
        brighter = self.folder / "brighter.toml"
        brighter.write_text(SCRIPT.replace("intensity = 30", "intensity = 60"))
        result = run_within(10, "render", brighter, "-o", self.folder / "newer", "--resume")
        self.assertEqual(result.returncode, 1)
        self.assertNotIn("frame.01.png", content(self.folder / "newer"))

    def test_capture_and_pack_in_one_pass(self):
        stage = self.folder / "stage.toml"
        stage.write_text(SMALL_STAGE)

        def arguments(name):
            return ["capture", stage, "--pack", self.folder / name, "--surfels", "3000"]

        succeed(*arguments("model"))
        whole = content(self.folder / "model")
        for limit in (20, 60, 5000, max(map(len, whole.values())) - 1):
            with self.subTest(limit=limit):
                result = run_within(limit, *arguments("full"))
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertRegex(result.stderr.splitlines()[-1],
                                 r"^surflect: \S*/full/\S+: cannot write \(File too large\)$")
                left = {name: data for name, data in content(self.folder / "full").items()
                        if not name.startswith("traced/")}
                self.assert_same_files(left, {name: whole[name] for name in left})
                succeed(*arguments("full"))
                self.assert_same_files(content(self.folder / "full"), whole)
                shutil.rmtree(self.folder / "full")

    def test_reports_that_cannot_be_written_are_failures(self):
        for arguments in (["inspect", self.folder / "model.srf"], self.render("film"),
                          ["evaluate", self.folder / "model.srf", self.capture]):
            with self.subTest(arguments=arguments), open("/dev/full", "w") as full:
                result = subprocess.run([SURFLECT, *map(str, arguments), "--json"], stdout=full,
                                        stderr=subprocess.PIPE, text=True, timeout=300)
                self.assertEqual(result.returncode, 1)
                self.assertIn("surflect: standard output: cannot write the report (No space left on device)",
                              result.stderr)

    def test_what_is_said_to_people_is_not_needed(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([SURFLECT, "inspect", self.folder / "model.srf"], stderr=full, timeout=300)
            self.assertEqual(result.returncode, 0)


if __name__ == "__main__":
    unittest.main()
