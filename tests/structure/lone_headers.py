"""Checks that every header of the libraries compiles alone.

    lone_headers.py SOURCE_ROOT BUILD

clang compiles headers with the options of a source of their folder in BUILD, after the headers that libraries have
precompiled; self_contained.py sees to those. A header that another one includes before all else is proved by that one.
Prints what the compiler says of those that fail; exits with 1 if there is any.
"""

import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

COMMON = "CMakeFiles/surflect_common_headers.dir/cmake_pch.hxx"
FIRST_INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)', re.MULTILINE)


def options_by_folder(build):
    """Options of a source of each folder."""
    found = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        words = shlex.split(entry["command"])
        output = words.index("-o")
        options = words[1:output]
        for with_argument in ("-Xclang", "-include"):  # precompiled headers, by clang or g++
            while with_argument in options:
                at = options.index(with_argument)
                del options[at:at + 2]
        found.setdefault(words[output + 1].partition("/CMakeFiles/")[0], options)
    return found


def clang(options, text=""):
    """What clang says, if it fails."""
    # -Wshadow: batched sources do without.
    result = subprocess.run(["clang++-16", *options, "-Wshadow", "-Wno-unknown-warning-option"], input=text,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return result.stdout + f"failed: {text}" if result.returncode else ""


def outermost(root):
    """Headers that no other one includes first."""
    headers = {path.relative_to(root).as_posix(): FIRST_INCLUDE.search(path.read_text())
               for top in ("surfel", "srf", "warp", "render", "bench") for path in (root / top).rglob("*.h")}
    return sorted(headers.keys() - {first[1] for first in headers.values() if first})


def main(root, build):
    options = options_by_folder(build)
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        common = f"{folder}/common.pch"
        said = clang([*options["surfel"], "-x", "c++-header", "-", "-o", common], f'#include "{build / COMMON}"\n')

        def proof(header):
            return clang([*options[os.path.dirname(header)], "-include-pch", common, "-fsyntax-only", "-x", "c++", "-"],
                         f'#include "{header}"\n')

        said += "".join(pool.map(proof, outermost(root)))
    print(said or "headers compile alone")
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(word).resolve() for word in sys.argv[1:])))
