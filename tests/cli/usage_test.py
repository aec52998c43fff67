"""Responses of `surflect` to wrong arguments and wrong files."""

import itertools
import json
import os
import subprocess
import unittest

from support import COMMANDS, ROOT, SCRIPT, SURFLECT, TestInFolder, run


def first_example(page):
    """The first indented block of a page of docs/."""
    lines = (ROOT / "docs" / page).read_text().splitlines()
    block = itertools.dropwhile(lambda line: not line.startswith("    "), lines)
    block = itertools.takewhile(lambda line: not line or line.startswith("    "), block)
    return "\n".join(line[4:] for line in block)


class Usage(unittest.TestCase):
    def test_help_that_cannot_be_written_is_no_success(self):
        for arguments in (["--help"], ["pack", "--help"], ["--version"]):
            with open("/dev/full", "w") as full:
                self.assertEqual(subprocess.run([SURFLECT, *arguments], stdout=full, stderr=subprocess.DEVNULL).returncode, 1)

    def test_wrong_arguments_exit_with_2_and_leave_stdout_empty(self):
        for arguments in ([], ["paint"], ["pack"], ["pack", "capture"], ["render", "film.toml"], ["inspect"],
                          ["evaluate", "model.srf"], ["inspect", "model.srf", "--loud"],
                          ["import"], ["import", "source"], ["import", "source", "-o", "out", "--format", "avi"],
                          ["import", "source", "-o", "out", "--mask-from", "brightness:2"], ["import", "source", "-o", "out", "--mask-margin", "2"],
                          ["import", "source", "-o", "out", "--color-space", "linear", "--recover-response"],
                          ["capture", "stage.toml"],
                          ["capture", "stage.toml", "-o", "out", "--surfels", "5"],
                          ["capture", "stage.toml", "--pack", "m.srf", "--script", "film.toml"], ["capture", "stage.toml", "-o", "out", "--frame", "2"],
                          ["relight", "capture", "-o", "views"], ["relight", "capture", "--lights", "l.toml"],
                          ["relight", "capture", "--lights", "l.toml", "--environment", "e.exr", "-o", "views"],
                          ["relight", "capture", "--lights", "l.toml", "--up", "0", "0", "1", "-o", "views"],
                          ["pack", "views", "--method", "slf"], ["pack", "views", "--method", "slv", "-o", "out"],
                          ["pack", "views", "--method", "slf", "-o", "out", "--directions", "65"],
                          ["pack", "views", "--method", "slf", "-o", "out", "--blend", "all"],
                          ["pack", "views", "--method", "lumigraph", "-o", "out", "--texels", "0"],
                          ["pack", "views", "--method", "lumigraph", "-o", "out", "--st", "1"],
                          ["pack", "views", "--method", "vdtm", "-o", "out", "--domain", "torus"],
                          ["pack", "views", "--method", "ulr", "-o", "out", "--domain", "plane"],
                          ["pack", "views", "--method", "ulr", "-o", "out", "--budget-mb", "0"],
                          ["pack", "views", "--method", "lfm", "-o", "out", "--vq", "0.5"],
                          ["pack", "views", "--method", "lfm", "-o", "out", "--vq", "2", "--vq-error", "0.1"],
                          ["pack", "views", "--method", "lfm", "-o", "out", "--vq-start", "pairs"],
                          ["pack", "views", "--method", "spherical", "-o", "out", "--scale", "tiny"],
                          ["pack", "stage.toml", "--method", "spherical", "-o", "out", "--nearest"],
                          ["pack", "capture", "-o", "model.srf", "--lights", "l.toml"],
                          ["pack", "capture", "-o", "model.srf", "--preset", "best"],
                          ["pack", "capture", "-o", "model.srf", "--tolerance", "2"],
                          ["pack", "capture", "-o", "model.srf", "--surfels", "none"],
                          ["render", "film.toml", "-o", "frames", "--cameras", "0"],
                          ["render", "film.toml", "-o", "frames", "--threads", "0"],
                          ["evaluate", "model.srf", "capture", "--baseline", "best"],
                          ["evaluate", "model.srf", "capture", "--cameras", "17"],
                          ["chart", "model.srf", "-o", "report"], ["chart", "model.srf", "capture"],
                          ["chart", "model.srf", "capture", "-o", ""],
                          ["chart", "model.srf", "capture", "-o", "report", "--sweep", "cameras"],
                          ["chart", "model.srf", "capture", "-o", "report", "--rounds", "0"],
                          ["chart", "model.srf", "capture", "-o", "report", "--bent", "deformed"],
                          ["chart", "model.srf", "capture", "-o", "report", "--frame", "2"],
                          ["evaluate", "model.srf", "capture", "--frame", "2"]):
            with self.subTest(arguments=arguments):
                result = run(*arguments)
                self.assertEqual(result.returncode, 2)
                self.assertEqual(result.stdout, "")
                self.assertNotEqual(result.stderr, "")

    def test_numbers_out_of_range_are_wrong_arguments(self):
        imported, packed = ["import", "source", "-o", "out"], ["pack", "capture", "-o", "model.srf"]
        rendered, captured = ["render", "film.toml", "-o", "frames"], ["capture", "stage.toml", "-o", "out"]
        evaluated = ["evaluate", "model.srf", "capture"]
        for command, option in ((imported, "--height"), (imported, "--fov"), ([*imported, "--mask-from", "key"], "--mask-margin"),
                                (packed, "--tolerance"), (rendered, "--scale"), (rendered, "--low-pass"),
                                (evaluated, "--low-pass"), ([*evaluated, "--script", "film.toml"], "--frame"),
                                ([*captured, "--script", "film.toml"], "--frame")):
            for value in ("nan", "-nan", "inf", "-1e30", "1e30", "1e999", "one", ""):
                with self.subTest(command=command[0], option=option, value=value):
                    result = run(*command, f"{option}={value}")
                    self.assertEqual((result.returncode, result.stdout), (2, ""), result.stderr)
                    self.assertIn(option, result.stderr)
        for value in ("-1", "0", "1.5", "nan", "99999999999999999999999", "18446744073709551617"):
            with self.subTest(option="--test-every", value=value):
                self.assertEqual(run(*imported, f"--test-every={value}").returncode, 2)

    def test_empty_names_of_what_is_written_are_wrong_arguments(self):
        for arguments in (["pack", "capture", "-o"], ["import", "source", "-o"], ["render", "film.toml", "-o"],
                          ["capture", "stage.toml", "-o"], ["capture", "stage.toml", "--pack"],
                          ["inspect", "capture", "--overlay"]):
            with self.subTest(arguments=arguments):
                self.assertEqual(run(*arguments, "").returncode, 2)

    def test_help_succeeds_and_shows_an_example(self):
        for arguments in ([], *([command] for command in COMMANDS)):
            with self.subTest(command=arguments):
                result = run(*arguments, "--help")
                self.assertEqual(result.returncode, 0)
                self.assertIn("Example: surflect " + " ".join(arguments), result.stdout)

    def test_misspelt_words_are_answered_with_the_nearest(self):
        for arguments, answer in (
                ("rendr", "unknown: rendr; did you mean render?"),
                ("render film.toml -o f --sacle 2", "unknown: --sacle; did you mean --scale?"),
                ("pack capture --ouput f", "unknown: --ouput; did you mean --output?"),
                ("pack views --method slv -o f", "; did you mean slf?"),
                ("pack views --method slf -o f --vq 2", "slf has no option --vq"),
                ("pack views --method slf -o f --blend fittd", "; did you mean fitted?"),
                ("render film.toml -o f --preset papr", "; did you mean paper?"),
                ("render film.toml -o f --simd scaler", "; did you mean scalar?"),
                ("evaluate m.srf capture --baseline neares", "; did you mean nearest?"),
                ("evaluate m.srf capture --split tset", "; did you mean test?"),
                ("import source -o out --format colmpa", "; did you mean colmap?"),
                ("import source -o out --color-space sRGB", "; did you mean srgb?"),
                ("verify m.srf --bound unsen=5", "; did you mean unseen?")):
            with self.subTest(arguments=arguments):
                result = run(*arguments.split())
                self.assertEqual((result.returncode, result.stdout), (2, ""))
                self.assertIn(answer, result.stderr)

    def test_words_that_are_near_to_none_are_answered_with_none(self):
        for arguments in ("paint", "render film.toml -o f --photographs 2"):
            with self.subTest(arguments=arguments):
                self.assertNotIn("did you mean", run(*arguments.split()).stderr)

    def test_the_version_is_three_numbers(self):
        result = run("--version")
        self.assertEqual(result.returncode, 0)
        self.assertRegex(result.stdout, r"^\d+\.\d+\.\d+\n$")


class Failures(TestInFolder):
    def assert_fails_in_one_line(self, expected, *arguments):
        plain = run(*arguments)
        self.assertEqual(plain.returncode, 1)
        self.assertEqual(plain.stdout, "")
        self.assertRegex(plain.stderr, r"^surflect: [^\n]+\n$")
        self.assertIn(expected, plain.stderr)
        reported = run(*arguments, "--json")
        self.assertEqual(reported.returncode, 1)
        self.assertEqual("surflect: " + json.loads(reported.stdout)["error"] + "\n", plain.stderr)

    def test_a_missing_file_is_named_in_one_line(self):
        missing = self.folder / "missing"
        for arguments in (["pack", missing, "-o", self.folder / "model.srf"], ["inspect", missing],
                          ["import", missing, "-o", self.folder / "imported"],
                          ["capture", missing, "-o", self.folder / "captured"],
                          ["render", missing, "-o", self.folder / "frames"],
                          ["evaluate", missing, missing]):
            with self.subTest(arguments=arguments):
                self.assert_fails_in_one_line(str(missing), *arguments)

    def test_the_name_of_a_file_that_is_near_is_suggested(self):
        folder = self.folder / "beside"
        folder.mkdir()
        for name in ("vase.srf", "film.toml", ".film.toml.swp", "cameras12"):
            (folder / name).mkdir()
        (folder / "dangling.toml").symlink_to("nowhere")
        for arguments, meant in ((["view", "vase.sfr"], "vase.srf"), (["view", "flim.toml"], "film.toml"),
                                 (["inspect", "vase.sfr"], "vase.srf"), (["render", "vase.sfr/", "-o", "f"], "vase.srf"),
                                 (["evaluate", "vase.sfr", "capture"], "vase.srf"),
                                 (["pack", "vas.srf/capture/transforms.json", "-o", "m.srf"], "vase.srf"),
                                 (["import", "film.tml", "-o", "out"], "film.toml"),
                                 (["inspect", "cameras13"], None), (["inspect", "dangling.toml"], None), (["inspect", "nothing"], None)):
            with self.subTest(arguments=arguments):
                command, *paths = arguments
                result = run(command, *(folder / path for path in paths[:1]), *paths[1:])
                self.assertEqual(result.returncode, 1, result.stderr)
                meaning = f"; did you mean {folder / meant}?" if meant else "(No such file or directory)"
                self.assertTrue(result.stderr.endswith(meaning + "\n"), result.stderr)
        here = subprocess.run([SURFLECT, "view", "vase.sfr"], cwd=folder, capture_output=True, text=True)
        self.assertTrue(here.stderr.endswith("; did you mean vase.srf?\n"), here.stderr)

    def test_a_folder_that_cannot_be_looked_into_is_named_in_one_line(self):
        loop, long = self.folder / "loop", self.folder / ("x" * 300)
        loop.symlink_to(loop)
        for folder, problem in ((loop, "symbolic links"), (long, "too long")):
            for arguments in (["inspect", folder], ["pack", folder, "-o", self.folder / "model.srf"],
                              ["import", folder, "-o", self.folder / "imported"]):
                with self.subTest(arguments=arguments):
                    self.assert_fails_in_one_line(f"{folder}: cannot open", *arguments)
                    self.assert_fails_in_one_line(problem, *arguments)

    def test_a_folder_without_permission_is_named_in_one_line(self):
        folder = self.folder / "locked"
        folder.mkdir(mode=0)
        humble = ["setpriv", "--bounding-set=-dac_override,-dac_read_search"] if os.geteuid() == 0 else []
        for arguments in (["inspect", folder], ["import", folder, "-o", self.folder / "imported"],
                          ["pack", folder, "-o", self.folder / "model.srf"]):
            with self.subTest(arguments=arguments):
                result = subprocess.run([*humble, SURFLECT, *map(str, arguments)], capture_output=True, text=True)
                self.assertEqual(result.returncode, 1)
                self.assertRegex(result.stderr, r"^surflect: [^\n]+: cannot open \(Permission denied\)\n$")
                self.assertIn(str(folder), result.stderr)

    def test_an_unfinished_model_is_not_opened(self):
        unfinished = self.folder / "unfinished.srf"
        unfinished.mkdir()
        self.assert_fails_in_one_line("manifest", "evaluate", unfinished, unfinished)

    def test_a_misspelt_key_is_answered_with_the_nearest(self):
        script = self.folder / "misspelt.toml"
        for right, wrong in (("fov_deg", "fov_dge"), ('"point"', '"pont"'), ('"twist"', '"twits"'), ('"depth"', '"dept"'),
                             ("angle_deg", "angle"), ("[camera]", "[camra]")):
            with self.subTest(wrong=wrong):
                script.write_text(SCRIPT.replace(right, wrong, 1))
                meant = right.strip('"[]')
                self.assert_fails_in_one_line(f"; did you mean {meant}?", "render", script, "-o", self.folder / "frames")

    def test_tables_that_hold_one_another_too_deep_are_refused(self):
        deep = self.folder / "deep.toml"
        for text in (".".join("a" * 50000) + " = 1", "[" + ".".join("a" * 50000) + "]"):
            deep.write_text(text)
            for command in ("render", "capture"):
                with self.subTest(command=command, text=text[:3]):
                    self.assert_fails_in_one_line("line 1", command, deep, "-o", self.folder / "none")

    def test_the_examples_of_the_documentation_want_nothing_but_their_files(self):
        for page, name, command, wanted in (
                ("script.md", "film.toml", ["render", "-o", self.folder / "frames"], "doll.srf"),
                ("lightstage.md", "stage.toml", ["capture", "-o", self.folder / "captured"], "doll.obj"),
                ("capture.md", "transforms.json", ["inspect"], "mesh.ply")):
            with self.subTest(page=page):
                path = self.folder / name
                path.write_text(first_example(page))
                self.assert_fails_in_one_line(wanted, *command, path)

    def test_what_is_not_a_capture_is_refused(self):
        for index, text in enumerate(["", "{", "[]", "{}", '{"frames": []}', '{"frames": [{}]}', "\0" * 100]):
            with self.subTest(text=text):
                path = self.folder / f"{index}.json"
                path.write_text(text)
                self.assert_fails_in_one_line(path.name, "inspect", path)


if __name__ == "__main__":
    unittest.main()
