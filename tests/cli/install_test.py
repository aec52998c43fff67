"""The installed package serves a project of another compiler: tests/consumer finds it, builds with g++, and renders a
packed model."""

import os
import re
import subprocess
import unittest

from support import ROOT, TestInFolder, succeed, write_small_capture

CMAKE, BUILD = os.environ["CMAKE"], os.environ["BUILD"]


def finish(*command):
    """The output of a program that must succeed."""
    result = subprocess.run([*map(str, command)], capture_output=True, text=True)
    if result.returncode != 0:
        raise AssertionError(f"{command[0]} failed: {result.stdout}{result.stderr}")
    return result.stdout


class Install(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.prefix, build = cls.folder / "prefix", cls.folder / "build"
        finish(CMAKE, "--install", BUILD, "--prefix", cls.prefix)
        finish(CMAKE, "-S", ROOT / "tests/consumer", "-B", build, f"-DCMAKE_PREFIX_PATH={cls.prefix}",
               "-DCMAKE_CXX_COMPILER=g++")
        finish(CMAKE, "--build", build)
        cls.consumer = build / "consumer"

    def test_a_consumer_renders_a_packed_model(self):
        write_small_capture(self.folder / "capture", cameras=4, lights=6)
        succeed("pack", self.folder / "capture", "-o", self.folder / "vase.srf", "--surfels", "20000", "--tables", "off")
        numbers = [float(word) for word in finish(self.consumer, self.folder / "vase.srf").split()]
        width, height, red, green, blue, alpha = numbers
        self.assertGreater(min(width, height), 1)
        self.assertGreater(min(red, green, blue), 0)
        self.assertGreater(alpha, 0.9)

    def test_the_installed_program_makes_the_film_of_its_example(self):
        write_small_capture(self.folder / "small", cameras=3, lights=3)
        succeed("pack", self.folder / "small", "-o", self.folder / "demo/doll.srf", "--surfels", "5000", "--tables", "off")
        finish(self.prefix / "bin/surflect", "demo", "-o", self.folder / "demo", "--quick")
        self.assertEqual(len(list((self.folder / "demo/quick").glob("*.png"))), 9)
        script = self.folder / "demo/film.toml"
        self.assertIn('model = "doll.srf"', script.read_text())
        # One frame, of an older program without a film, and where nothing can encode one.
        text = re.sub("last = .*", "last = 1", re.sub("size = .*", "size = [60, 45]", script.read_text()))
        for lines, path, said in ((re.sub("video = .*\n", "", text), os.environ["PATH"], f"no film, frames alone: {script} has no video"),
                                  (text, "", f"no {self.folder}/demo/frames/film.mp4: ffmpeg is not installed"),
                                  (text, os.environ["PATH"], f"{self.folder}/demo/frames/film.mp4: the film")):
            script.write_text(lines)
            result = subprocess.run([self.prefix / "bin/surflect", "demo", "-o", self.folder / "demo"], capture_output=True,
                                    text=True, check=True, env={**os.environ, "PATH": path})
            self.assertIn(said, result.stderr)

    def test_bash_completes_commands_and_options(self):
        def completed(*words):
            script = f"source {self.prefix}/share/bash-completion/completions/surflect; COMP_WORDS=(surflect {' '.join(words)}); " \
                     f"COMP_CWORD={len(words)}; _surflect; echo ${{COMPREPLY[@]}}"
            return subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True,
                                  env={**os.environ, "PATH": f"{self.prefix}/bin:{os.environ['PATH']}"}).stdout.split()

        self.assertEqual(completed("re"), ["relight", "render"])
        self.assertEqual(completed("render", "--fra"), ["--frames"])
        self.assertEqual(completed("view", "--po"), ["--port"])

    def test_the_package_names_no_path_of_the_source_tree(self):
        for path in (self.prefix / "lib").rglob("*.cmake"):
            self.assertNotIn(str(ROOT), path.read_text(), path)


if __name__ == "__main__":
    unittest.main()
