"""Examples of --help, README.md and docs/*.md run on tiny data of the names that they mention, and their TOML is read.

Man pages are what --help says. Long runs are shortened: fewer surfels, smaller frames; a demo only has its words read.
"""

import json
import math
import os
import re
import shlex
import shutil
import struct
import subprocess
import unittest

from png import shares, write_png
from support import CAT, COMMANDS, GLOSSY_BALL, ROOT, SURFLECT, VASE, TestInFolder, run, succeed

START = ROOT / "docs" / "start.md"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]

# A glossy lumpy ball under few lights.
STAGE = """
samples = 4
transport = "direct"
[camera]
model = "pinhole"
size = [32, 32]
distance = 5
fov_deg = 27
[views]
count = 12
test = 4
[lights]
count = {lights}
irradiance = [3, 3, 3]
""" + GLOSSY_BALL + """[scale.small]
samples = 2
[scale.paper]
samples = 2
"""

FILM = """
model = "{model}"
[frames]
first = 1
last = 48
[output]
size = [60, 40]
path = "frame.##.exr"
[camera]
orbit = {{ radius = 4, azimuth_deg = "60*s" }}
up = [0, 0, 1]
fov_deg = 32
"""
LIGHT = '[[light]]\ntype = "point"\nposition = [2, 1, 2]\nintensity = 20\n'
WARP = '[[warp]]\ntype = "twist"\naxis = [0, 0, 1]\nangle_deg = [[1, 0], [24, 40], [48, 0]]\n'

# Options of each method's `pack` that make it quick. Options of an example go before these.
QUICK = {"surfels": ["--surfels", "800", "--tables", "off"], "slf": ["--regions", "30"],
         "lumigraph": ["--st", "5", "--texels", "100000"], "lfm": ["--view-size", "12"],
         "spherical": ["--levels", "2", "--size", "32"], "vdtm": ["--triangles", "500"], "ulr": ["--triangles", "500"],
         "olfm": ["--triangles", "500"]}
COSTLY = {"--surfels": "1000", "--texels": "100000", "--triangles": "500", "--higher-view-size": "8"}  # whose values are replaced

METHODS = {".srf": "surfels", ".slf": "slf", ".lum": "lumigraph", ".lfm": "lfm", ".sph": "spherical", ".vdtm": "vdtm",
           ".olfm": "olfm"}
WRITTEN = ("-o", "--output", "--pack", "--overlay")

# What a word of an example stands for, where no file of that name is meant.
WORDS = {"M": "slf", "METHOD": "slf", "T": "0.05", "MODEL...": "MODEL", "SCRIPT": "SCRIPT.toml", "FILE": "film.toml"}


def block_lines(text):
    """Lines of indented blocks; those that a backslash continues are one."""
    lines = [line[4:] for line in text.splitlines() if line.startswith("    ")]
    return re.sub(r"\\\n\s*", "", "\n".join(lines)).splitlines()


def commands_in(line):
    """surflect commands of a line of a shell, without comments and what a table says beside them."""
    plain = re.split(r"\s#|\s{2,}", line.strip())[0]
    for part in plain.split("&&"):
        if found := re.match(r"(?:.*ssh .* )?(surflect .*)", part.strip()):
            yield found[1].strip()


def alternatives(command):
    """A command with and without what stands in brackets, and each word of A|B."""
    command = command.replace(" [options]", "")
    whole = re.sub(r"[\[\]]", "", command)
    short = re.sub(r"\s*\[[^\]]*\]", "", command)
    for form in dict.fromkeys((whole, short)):
        words = [word.split("|") for word in shlex.split(form)]
        for k in range(max(map(len, words))):
            yield [WORDS.get(word, word) for word in (each[min(k, len(each) - 1)] for each in words)]


def walk_of(text):
    """The section whose commands make one film, each from what those before it made."""
    return text.partition("\n## From RTI to a film\n")[2].partition("\n## ")[0]


def toml_blocks(text):
    """Indented blocks that hold a table or a key of TOML."""
    for block in re.findall(r"(?:\n\n|\A)((?:    .*\n|\n(?=    ))+)", text):
        block = re.sub(r"^    ", "", block, flags=re.MULTILINE)
        if re.search(r"^\[{1,2}\w+(\.\w+)?\]{1,2}\s*(#.*)?$|^\w+ = \"", block, re.MULTILINE) and "surflect" not in block:
            yield block


def with_keys_of(block, script):
    """A script with the keys of a block's tables in its own tables of the same names, or in new ones."""
    for header, keys in re.findall(r"^(\[{1,2}\w+\]{1,2}).*\n((?:(?!\[).*\n?)*)", block, re.MULTILINE):
        own = header + "\n"
        if own in script and "[[" not in header:  # the block's keys take the place of its own
            before, _, after = script.partition(own)
            table, bracket, rest = re.match(r"((?:(?!\[).*\n?)*)(\[?)(.*)", after, re.DOTALL).groups()
            for key in re.findall(r"^(\w+) =", keys, re.MULTILINE):
                table = re.sub(rf"^{key} =.*\n", "", table, flags=re.MULTILINE)
            script = before + own + table + bracket + rest
        script = script.replace(own, own + keys + "\n", 1) if own in script and "[[" not in header else script + own + keys + "\n"
    return script


class Documented(TestInFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.tiny, cls.runs, cls.done = cls.folder / "tiny", 0, set()
        cls.tiny.mkdir()
        cls.write_captures()
        cls.write_models()

    @classmethod
    def named(cls, source, *names):
        """Gives a file or folder more names."""
        for name in names:
            path = cls.tiny / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.symlink_to(cls.tiny / source)

    @classmethod
    def write_captures(cls):
        (cls.tiny / "stage.toml").write_text(STAGE.format(lights=10))
        (cls.tiny / "one_light.toml").write_text(STAGE.format(lights=1))
        succeed("capture", cls.tiny / "stage.toml", "-o", cls.tiny / "CAPTURE")
        succeed("capture", cls.tiny / "one_light.toml", "-o", cls.tiny / "views")
        cls.named("CAPTURE", "FOLDER", "TRUTH", "doll", "examples/vase", "lego-capture", "garden-capture", "stage-capture", "toy", "statue/capture",
                  "DATA/kiwi-gantry", "build/gallery/vase")
        shutil.copytree(cls.tiny / "CAPTURE", cls.tiny / "vase-cycles")
        (cls.tiny / "vase-cycles/transforms.json").rename(cls.tiny / "vase-cycles/deformed.json")
        cls.named("vase-cycles", "DATA/vase-cycles")
        for stage in (ROOT / "examples/stages").glob("*.toml"):
            cls.named("stage.toml", f"examples/stages/{stage.name}")
        foreign = cls.folder / "foreign"
        subprocess.run([os.environ["WRITE_FOREIGN_CAPTURES"], VASE, foreign], check=True)
        (foreign / "before-table/images_4").symlink_to("images")
        for name, kind in (("SOURCE", "nerfstudio"), ("lego", "nerfstudio"), ("garden", "before-table"), ("empty", "before-table/plates"), ("walk", "colmap-binary"),
                           ("FurBall", "nrhints"), ("templeSparseRing", "middlebury"), ("turntable", "before-screen"), ("studio", "before-screen")):
            (cls.tiny / name).symlink_to(foreign / kind)
        (cls.tiny / "empty.png").symlink_to(next((foreign / "before-screen/plates").iterdir()))
        (cls.tiny / "object.ply").symlink_to(VASE / "vase.ply")
        par = next((foreign / "middlebury").glob("*_par.txt"))
        par.with_name("templeSR_par.txt").write_bytes(par.read_bytes())
        par.unlink()
        (cls.tiny / "cameras.xml").symlink_to(foreign / "metashape/cameras.xml")
        (cls.tiny / "photographs").symlink_to(foreign / "metashape/photographs")
        cls.write_lamps(foreign / "nerfstudio", cls.tiny / "stage")
        lights = json.loads((CAT / "transforms.json").read_text())["lights"][:4]
        directions = "".join("{:.6f} {:.6f} {:.6f}\n".format(*light["direction"]) for light in lights)
        for folder, photographs in (("psbox-cat", "psbox-cat"), ("psmImages", "psmImages/cat")):
            (cls.tiny / photographs).mkdir(parents=True)
            for light in lights:
                shutil.copy(CAT / f"images/{light['name']}.png", cls.tiny / photographs)
            (cls.tiny / folder / "lights.txt").write_text(directions)
        cls.write_ball(cls.tiny / "psmImages/chrome", lights)
        (cls.tiny / "cat").symlink_to(CAT)
        (cls.tiny / "examples/cat").symlink_to(CAT)

    @classmethod
    def write_lamps(cls, source, folder):
        """Photographs of each camera under two lamps, of which one is posed, and the table of the lamps."""
        folder.mkdir()
        capture = json.loads((source / "transforms.json").read_text())
        for number, frame in enumerate(capture["frames"]):
            camera = folder / f"cam{number}"
            camera.mkdir()
            for lamp in ("left", "right"):
                shutil.copy(source / frame["file_path"], camera / f"{lamp}.png")
            frame["file_path"] = f"cam{number}/left.png"
        (folder / "transforms.json").write_text(json.dumps(capture))
        places = "".join("cam{} {} {} {}\n".format(number, *(row[3] for row in frame["transform_matrix"][:3]))
                         for number, frame in enumerate(capture["frames"]))
        for place in (cls.tiny, folder):
            (place / "lamps.txt").write_text("left -1 0 1\nright 1 0 1\n")
            (place / "places.txt").write_text(places)
        cls.named("stage", "set")

    @classmethod
    def write_ball(cls, folder, lights):
        """A mirror ball under each light, seen along -z, and its mask."""
        folder.mkdir(parents=True)
        size, radius = 160, 70
        grid = [[((x - size / 2 + 0.5) / radius, (size / 2 - 0.5 - y) / radius) for x in range(size)] for y in range(size)]
        write_png(folder / "mask.png", [[255 if u * u + v * v < 1 else 0 for u, v in row] for row in grid])
        for light in lights:
            x, y, z = light["direction"]
            half = math.hypot(x, y, z + 1)
            write_png(folder / f"{light['name']}.png",
                      [[255 if math.hypot(u - x / half, v - y / half) < 0.05 else 8 for u, v in row] for row in grid])

    @classmethod
    def write_models(cls):
        (cls.tiny / "lights.toml").write_text(LIGHT)
        succeed("pack", cls.tiny / "CAPTURE", "-o", cls.tiny / "vase.srf", "--surfels", "800", "--tables", "on")
        for suffix, method in METHODS.items():
            if method != "surfels":
                succeed("pack", cls.tiny / "views", "--method", method, "-o", cls.tiny / f"vase{suffix}", *QUICK[method])
        for suffix in (".slf", ".lfm"):
            cls.named("views", f"vase{suffix}/views")
        cls.named("vase.srf", "MODEL", "model.srf", "lego.srf", "fur.srf", "doll.srf", "kiwi.srf", "cat.srf",
                  "build/demo/vase.srf", "build/gallery/vase.srf")
        cls.named("vase.vdtm", "fern.vdtm")
        cls.named("vase.olfm", "fern.olfm")
        (cls.tiny / "film.toml").write_text(FILM.format(model=cls.tiny / "vase.srf") + LIGHT + WARP)
        cls.named("film.toml", "SCRIPT.toml", "bend.toml", "shot.toml", "cat.toml", "demo/film.toml", "examples/vase.toml", "statue/film.toml")
        (cls.tiny / "warp.toml").write_text(WARP)
        cls.named("warp.toml", "vase-cycles/warp.toml")
        cls.named("lights.toml", "L")
        shutil.copy(ROOT / "examples/environments/studio.exr", cls.tiny)
        cls.named("studio.exr", "examples/environments/studio.exr")

    def fresh_folder(self, written):
        """A folder in which all is there but what a command writes."""
        type(self).runs += 1
        folder = self.folder / f"run{self.runs}"
        folder.mkdir()
        for entry in self.tiny.iterdir():
            if entry.name not in written:
                (folder / entry.name).symlink_to(entry.resolve() if entry.is_symlink() else entry)
        return folder

    def shortened(self, words):
        """The command with what makes it quick, and with a capture that its method takes."""
        command = words[1]
        words = [COSTLY.get(before, word.replace(".jpg", ".png")) for before, word in zip(["", *words], words)]
        asked = set(words)
        method = words[words.index("--method") + 1] if "--method" in asked else "surfels"
        is_light_field = method != "surfels" or (command == "evaluate" and words[2].endswith(tuple(METHODS)[1:]))
        capture = ("examples/cat" if "--relief" in asked or command == "web" else
                   "views" if is_light_field and not asked & {"--lights", "--environment"} else "CAPTURE")
        words = [capture if word == "CAPTURE" and before not in WRITTEN else word for before, word in zip(["", *words], words)]
        extra = []
        if command == "pack" and not words[2].endswith((".lfm", ".olfm")):
            pairs = [QUICK[method][i:i + 2] for i in range(0, len(QUICK[method]), 2)]
            extra = [word for pair in pairs if pair[0] not in asked for word in pair]
        if command == "render":
            extra = [] if "--frames" in asked else ["--frames", "1-1"]
            extra += [] if "--scale" in asked else ["--scale", "0.1"]
            extra += ["--every", "100"]
        if command == "export":
            extra = [] if "--every" in asked else ["--every", "100"]
        if command == "capture" and "--pack" in asked:
            extra = ["--tables", "off", *([] if "--surfels" in asked else ["--surfels", "1000"])]
        if command == "inspect" and "--overlay" in asked and "--max-frames" not in asked:
            extra = ["--max-frames", "2"]
        if command == "chart":
            extra = ["--rounds", "1", "--frames", "1"]
        return [*words[1:], *extra]

    def run_example(self, words):
        """Runs a command in a folder of its own, once; where it would be too long, its words alone are read."""
        written = {word.rstrip("/") for before, word in zip(words, words[1:]) if before in WRITTEN}
        arguments = self.shortened(words)
        if tuple(arguments) in self.done:
            return
        self.done.add(tuple(arguments))
        folder = self.fresh_folder(written)
        if words[1] in ("demo", "view"):  # too long: what it writes is in the way
            (folder / "blocked").write_text("")
            arguments += [] if "-o" in arguments else ["-o", ""]
            arguments[arguments.index("-o") + 1] = "blocked/out"
        result = subprocess.run([SURFLECT, *arguments], cwd=folder, capture_output=True, text=True)
        told = shlex.join(arguments) + "\n" + result.stderr
        if words[1] in ("demo", "view"):
            self.assertEqual(result.returncode, 1, told)
            self.assertIn("blocked", result.stderr)
        elif words[1] == "verify" and "out of bounds" in result.stderr:  # its tiny model, not its words
            self.assertEqual(result.returncode, 1, told)
        elif "--flash auto" in told:  # cli.lamps has such photographs
            self.assertEqual(result.returncode, 1, told)
            self.assertIn("--flash auto: found", result.stderr)
        else:
            self.assertEqual(result.returncode, 0, told)

    def test_examples_of_help_run(self):
        for command in ([], *([each] for each in COMMANDS)):
            text = run(*command, "--help").stdout
            text = re.sub(r"\\\n\s*", "", text.partition("Example: ")[2].partition("\n\n")[0])
            examples = [example for line in text.splitlines() for example in commands_in(line)]
            self.assertNotEqual(examples, [], command)
            for example in examples:
                with self.subTest(example=example):
                    self.run_example(shlex.split(example))

    def test_commands_of_the_documentation_run(self):
        count = 0
        for page in PAGES:
            text = page.read_text()
            for line in block_lines(text.replace(walk_of(text), "") if page == START else text):
                for command in commands_in(line):
                    for words in alternatives(command):
                        count += 1
                        with self.subTest(page=page.name, command=shlex.join(words)):
                            self.run_example(words)
        self.assertGreater(count, 80)

    def test_the_walk_from_rti_to_a_film_runs_in_order(self):
        folder = self.folder / "walk"
        folder.mkdir()
        (folder / "examples").symlink_to(ROOT / "examples")
        steps = [words for line in block_lines(walk_of(START.read_text())) for command in commands_in(line)
                 for words in alternatives(command)]
        self.assertEqual([words[1] for words in steps], ["import", "inspect", "pack", "evaluate", "script", "render"])
        for words in steps:
            result = subprocess.run([SURFLECT, *self.shortened(words)], cwd=folder, capture_output=True, text=True)
            self.assertEqual(result.returncode, 0, shlex.join(words) + "\n" + result.stderr)
        covered, opaque, lit = shares(next((folder / "frames").glob("*.png")))
        self.assertTrue(0.05 < covered < 0.9)
        self.assertGreater(lit, 0.5)

    def test_commands_within_sentences_are_known(self):
        """In an empty folder, an argument is missing at most, or the file that one names."""
        empty = self.folder / "empty"
        empty.mkdir()
        for page in PAGES:
            for command in set(re.findall(r"`(surflect [^`]+)`", page.read_text())):
                for words in alternatives(command):
                    with self.subTest(page=page.name, command=command):
                        if words[1:] == ["demo"]:  # needs no argument
                            self.run_example(words)
                            continue
                        result = subprocess.run([SURFLECT, *words[1:]], cwd=empty, capture_output=True, text=True, timeout=60)
                        self.assertEqual(result.returncode == 0, "--help" in words, result.stderr)
                        if result.returncode == 2:
                            self.assertRegex(result.stderr, "required")

    def test_toml_of_the_documentation_is_read(self):
        folder = self.fresh_folder(set())
        for name in ("cage", "warps"):
            for file in (ROOT / "examples" / name).iterdir():
                shutil.copy(file, folder)
        rig = (folder / "rig.glb").read_bytes().replace(b'"Nod"', b'"Wave"').replace(b'"CC0 1.0"', b'"CC0 1."')
        (folder / "arm.glb").write_bytes(rig)
        shutil.copy(folder / "cage.obj", folder / "doll.obj")
        points = [float(x) for line in (folder / "cage.obj").read_text().splitlines() if line.startswith("v ") for x in line.split()[1:4]]
        (folder / "bend.mdd").write_bytes(struct.pack(f">2if{len(points)}f", 1, len(points) // 3, 0, *points))
        count = 0
        for page in ("script.md", "lightstage.md", "import.md"):
            first = None
            for block in toml_blocks((ROOT / "docs" / page).read_text()):
                count += 1
                keys = [key for key in re.findall(r"^(\w+) =", block.partition("[")[0], re.MULTILINE)]
                first = first or block
                text = block if "[camera]" in block else re.sub(rf"^({'|'.join(keys) or '-'}) =.*\n", "", first, flags=re.MULTILINE)
                if text is not block:  # it continues the page's first
                    text = block + text if keys else text + block
                if "[[object]]\nmodel" in block:
                    text = re.sub(r"^model = .*\n", "", text, count=1)
                (folder / "block.toml").write_text(text)
                with self.subTest(page=page, block=block):
                    found = subprocess.run([SURFLECT, "inspect", "block.toml", "--json"], cwd=folder, capture_output=True, text=True)
                    self.assertEqual(found.returncode, 0, found.stderr)
                    self.assertIn("stage" if page == "lightstage.md" else "script", json.loads(found.stdout)["file"])
        for page, block in ((page, block) for page in ("film.md", "outputs.md") for block in toml_blocks((ROOT / "docs" / page).read_text())):
            count += 1
            with self.subTest(page=page, block=block):
                (folder / "block.toml").write_text(with_keys_of(block, FILM.format(model="M.srf") + LIGHT))
                found = subprocess.run([SURFLECT, "inspect", "block.toml", "--json"], cwd=folder, capture_output=True, text=True)
                self.assertEqual(found.returncode, 0, found.stderr)
        self.assertGreater(count, 10)


if __name__ == "__main__":
    unittest.main()
