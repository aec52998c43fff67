"""kill -9 at any moment of `pack`, `capture --pack`, `render --resume` and `import`: the next run gives the same result as
an undisturbed one, and removes temporary files."""

import random
import shutil
import signal
import subprocess
import time
import unittest

from support import SCRIPT, SMALL_STAGE, SURFLECT, TestInFolder, content, succeed, write_small_capture

MOMENTS = 6


def kill_after(seconds, *arguments):
    """Starts `surflect` and kills it; whether it was still at work."""
    process = subprocess.Popen([SURFLECT, *map(str, arguments)], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    time.sleep(seconds)
    process.send_signal(signal.SIGKILL)
    return process.wait() == -signal.SIGKILL


class Kill(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.capture = cls.folder / "capture"
        write_small_capture(cls.capture, cameras=3, lights=2, coarse=True)

    @classmethod
    def pack(cls, name, capture="capture"):
        return ["pack", cls.folder / capture, "-o", cls.folder / name, "--surfels", "3000", "--tables", "off"]

    def killed_at_any_moment(self, arguments_for, whole, was_there=None):
        """Kills runs at moments spread over the time of a whole one; completes and compares each.

        was_there: what every other run finds in its folder.
        """
        begin = time.monotonic()
        succeed(*arguments_for("timed"))
        duration = time.monotonic() - begin
        shutil.rmtree(self.folder / "timed")
        uniform = random.Random(1).uniform
        for moment in range(MOMENTS):
            part = (moment + uniform(0, 1)) / MOMENTS
            name = f"killed-{moment}"
            while True:
                if was_there and moment % 2:
                    shutil.copytree(was_there, self.folder / name)
                was_killed = kill_after(part * duration, *arguments_for(name))
                succeed(*arguments_for(name))
                self.assert_same_files(content(self.folder / name), whole, f"killed after {part:.0%}")
                shutil.rmtree(self.folder / name)
                if was_killed:
                    break
                duration *= 0.8  # it was done already: other work on this machine has ended

    def test_pack(self):
        # A model of another capture, some of whose views have numbers that this one has, too.
        write_small_capture(self.folder / "other", cameras=5, lights=2, coarse=True)
        succeed(*self.pack("other.srf", "other"))
        succeed(*self.pack("whole.srf"))
        self.killed_at_any_moment(lambda name: [*self.pack(name), "--overwrite"],
                                  content(self.folder / "whole.srf"), self.folder / "other.srf")

    def test_capture_and_pack_in_one_pass(self):
        stage = self.folder / "stage.toml"
        stage.write_text(SMALL_STAGE)

        def arguments(name):
            output = self.folder / name
            return ["capture", stage, "--pack", output / "model.srf", "--surfels", "3000", "-o", output / "test"]

        succeed(*arguments("captured"))
        self.killed_at_any_moment(arguments, content(self.folder / "captured"))

    def test_render(self):
        script = self.folder / "film.toml"
        script.write_text(SCRIPT)
        succeed(*self.pack("model.srf"))
        succeed("render", script, "-o", self.folder / "whole")
        self.killed_at_any_moment(lambda name: ["render", script, "-o", self.folder / name, "--resume"],
                                  content(self.folder / "whole"))

    def test_import(self):
        arguments = ["import", self.capture, "-o"]
        place = self.folder / "imports"
        begin = time.monotonic()
        succeed(*arguments, place / "whole")
        duration = time.monotonic() - begin
        whole = content(place / "whole")
        shutil.rmtree(place / "whole")
        for moment in range(MOMENTS):
            kill_after(moment / MOMENTS * duration, *arguments, place / "killed")
            if not (place / "killed").exists():
                succeed(*arguments, place / "killed")
            self.assert_same_files(content(place / "killed"), whole)
            self.assertEqual([path.name for path in place.iterdir()], ["killed"])
            shutil.rmtree(place / "killed")

    def test_only_litter_of_the_command_itself_is_removed(self):
        name = "litter.srf"
        succeed(*self.pack(name))
        model = self.folder / name
        litter = [model / "views/0001.srfb.AbC123.tmp", model / "manifest.json.zzzzzz.tmp",
                  model / "views/identity.000000.tmp"]
        others = [model / "notes.txt.AbC123.tmp", model / "views/0001.srfb.tmp", model / "views/1.srfb.AbC123.tmp"]
        for path in litter + others:
            path.write_text("x")
        succeed(*self.pack(name))
        self.assertEqual([path.name for path in litter if path.exists()], [])
        self.assertEqual([path.name for path in others if not path.exists()], [])


if __name__ == "__main__":
    unittest.main()
