"""Checks that every header of the libraries compiles alone.

    lone_headers.py SOURCE_ROOT BUILD

clang compiles headers with the options of a source of their folder in BUILD, after the headers that libraries have
precompiled; self_contained.py sees to those. A header that another one includes before all else is proved by that one,
and one that a source or a batch of sources of the libraries includes first by the build.
Headers are compiled again only if they or what they include of ours has changed: BUILD/lone_headers.json holds a hash
of each that has passed. Prints what the compiler says of those that fail; exits with 1 if there is any.
"""

import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

COMMON_NAME = "surflect_common_headers"
COMMON = f"CMakeFiles/{COMMON_NAME}.dir/cmake_pch.hxx"
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)', re.MULTILINE)


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
        # One precompiled header serves programs and modules.
        options = [option for option in options if option not in ("-fPIC", "-fPIE")]
        found.setdefault(words[output + 1].partition("/CMakeFiles/")[0], options)
    return found


def clang(options, text=""):
    """What clang says, if it fails."""
    # -Wshadow: batched sources do without.
    result = subprocess.run(["clang++-16", *options, "-Wshadow", "-Wno-unknown-warning-option"], input=text,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return result.stdout + f"failed: {text}" if result.returncode else ""


def outermost(texts):
    """Headers that no other one includes first."""
    firsts = {first[1] for first in map(INCLUDE.search, texts.values()) if first}
    return sorted(texts.keys() - firsts)


def first_of_sources(build):
    """Headers that the build has compiled before all else, but for the precompiled ones of libraries."""
    found = set()
    for entry in json.loads((build / "compile_commands.json").read_text()):
        if COMMON_NAME not in entry["command"]:
            continue
        first, path = None, entry["file"]
        while path and os.path.exists(path):  # a batch includes sources by their paths
            match = INCLUDE.search(pathlib.Path(path).read_text())
            first = match[1] if match else None
            path = first if first and first.endswith(".cpp") else None
        found.add(first)
    return found


def content_hash(header, texts, options):
    """Hash of the options, the header and all headers of ours that it includes."""
    found, new = set(), {header}
    while new:
        found |= new
        new = {name for one in new for name in INCLUDE.findall(texts[one]) if name in texts} - found
    words = [*options, *(part for name in sorted(found) for part in (name, texts[name]))]
    return hashlib.sha256("\0".join(words).encode()).hexdigest()


def main(root, build):
    options = options_by_folder(build)
    texts = {path.relative_to(root).as_posix(): path.read_text()
             for top in ("surfel", "srf", "warp", "render", "bench") for path in (root / top).rglob("*.h")}
    common_text = (build / COMMON).read_text()
    built = first_of_sources(build)
    hashes = {header: content_hash(header, texts, [common_text, *options[os.path.dirname(header)]])
              for header in outermost(texts) if header not in built}
    passed = build / "lone_headers.json"
    before = json.loads(passed.read_text()) if passed.exists() else {}
    asked = [header for header in hashes if before.get(header) != hashes[header]]
    said = {}
    if asked:
        with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            common = f"{folder}/common.pch"
            # Once for all of them, and not again for each header.
            instantiated = "-fpch-instantiate-templates"
            said[COMMON] = clang([*options["surfel"], instantiated, "-x", "c++-header", "-", "-o", common],
                                 f'#include "{build / COMMON}"\n')

            def proof(header):
                return clang([*options[os.path.dirname(header)], "-include-pch", common, "-fsyntax-only", "-x", "c++", "-"],
                             f'#include "{header}"\n')

            said.update(zip(asked, pool.map(proof, asked)))
    failures = "".join(said.values())
    passed.write_text(json.dumps({header: hash_ for header, hash_ in hashes.items() if not said.get(header)}))
    print(failures or f"headers compile alone: {len(asked)} compiled, {len(hashes) - len(asked)} unchanged")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(word).resolve() for word in sys.argv[1:])))
