"""Full disk: `surflect` reports it in one line and leaves nothing half-written; after space is freed, the same command
succeeds. The disk is in memory, in a namespace of this process. Without the rights for that, the test is skipped.
"""

import json
import os
import shutil
import subprocess
import sys
import unittest

SKIPPED = 77  # exit code that CMakeLists.txt treats as skipped
PAGE = os.sysconf("SC_PAGE_SIZE")


def enter_namespace():
    """Starts again with mounts of our own, once."""
    if os.environ.get("SURFLECT_NAMESPACE"):
        return
    unshare = ["unshare", "--mount"] if os.geteuid() == 0 else ["unshare", "--mount", "--map-root-user"]
    try:
        subprocess.run([*unshare, "mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", "/mnt"], check=True,
                       capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as refusal:
        print("skipped: no disk can be mounted here:", refusal, getattr(refusal, "stderr", ""))
        sys.exit(SKIPPED)
    os.environ["SURFLECT_NAMESPACE"] = "1"
    os.execvp(unshare[0], [*unshare, sys.executable, "-B", *sys.argv])


enter_namespace()

from support import SCRIPT, SMALL_STAGE, TestInFolder, content, run, succeed, write_small_capture  # noqa: E402


class SmallDisk(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.capture, cls.elsewhere, cls.disk = (cls.folder / name for name in ("capture", "elsewhere", "disk"))
        write_small_capture(cls.capture, cameras=3, lights=2, coarse=True)
        cls.elsewhere.mkdir()
        cls.disk.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16m", "tmpfs", cls.disk], check=True)
        cls.addClassCleanup(subprocess.run, ["umount", cls.disk], check=True)
        cls.script = cls.elsewhere / "film.toml"
        cls.script.write_text(SCRIPT)

    @classmethod
    def pack(cls, output):
        return ["pack", cls.capture, "-o", output, "--surfels", "3000", "--tables", "off"]

    def fill_but(self, size):
        """Leaves nothing but ballast on the disk, and so many bytes free."""
        for path in self.disk.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        free = os.statvfs(self.disk)
        (self.disk / "ballast").write_bytes(bytes(free.f_bavail * free.f_frsize - size // PAGE * PAGE))

    def fails_and_recovers(self, arguments_for, keeps_parts):
        """Disks on which a part of the whole fits."""
        succeed(*arguments_for(self.elsewhere / "out"))
        whole = content(self.elsewhere / "out")
        shutil.rmtree(self.elsewhere / "out")
        needed = sum(PAGE * (len(data) // PAGE + 1) for data in whole.values())
        output = self.disk / "out"
        for part in (0, 0.2, 0.5, 0.9):
            with self.subTest(part=part):
                self.fill_but(int(part * needed))
                result = run(*arguments_for(output), "--json")
                self.assertEqual(result.returncode, 1, result.stderr)
                error = json.loads(result.stdout)["error"]
                self.assertIn("No space left on device", error)
                self.assertRegex(error, r"^\S+/out\S*: cannot ")
                self.assertEqual(result.stderr.splitlines()[-1], "surflect: " + error)
                left = content(output) if output.exists() else {}
                left = {name: data for name, data in left.items() if not name.startswith("traced/")}
                self.assert_same_files(left, {name: whole[name] for name in left})
                expected = {"ballast", "out"} if keeps_parts else {"ballast"}
                self.assertLessEqual({path.name for path in self.disk.iterdir()}, expected)
                (self.disk / "ballast").unlink()
                succeed(*arguments_for(output))
                self.assert_same_files(content(output), whole)

    def test_pack(self):
        self.fails_and_recovers(self.pack, keeps_parts=True)

    def test_capture_and_pack_in_one_pass(self):
        stage = self.elsewhere / "stage.toml"
        stage.write_text(SMALL_STAGE)
        self.fails_and_recovers(lambda output: ["capture", stage, "--pack", output, "--surfels", "3000"],
                                keeps_parts=True)

    def test_render(self):
        succeed(*self.pack(self.elsewhere / "model.srf"))
        self.fails_and_recovers(lambda output: ["render", self.script, "-o", output, "--resume"], keeps_parts=True)

    def test_import(self):
        self.fails_and_recovers(lambda output: ["import", self.capture, "-o", output], keeps_parts=False)

    def test_a_spherical_light_field_that_will_not_fit_stops_after_its_first_images(self):
        stage = self.elsewhere / "stage.toml"
        stage.write_text(SMALL_STAGE)
        self.fill_but(1 << 20)
        result = run("pack", stage, "--method", "spherical", "--levels", "6", "--size", "64", "-o", self.disk / "out")
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertRegex(result.stderr, r"levels 6 and size 64: needs [0-9.]+ GiB on disk for 20480 images, "
                                        r"by the size of the first 32, but 0.0 GiB are free at ")


if __name__ == "__main__":
    unittest.main()
