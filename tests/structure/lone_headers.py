"""Checks that every header of the libraries compiles alone.

    lone_headers.py SOURCE_ROOT BUILD

clang compiles headers with the options of a source of their folder in BUILD, after the headers that libraries have
precompiled; self_contained.py sees to those. A header that another one includes before all else is proved by that one,
and one that a source or a batch of sources of the libraries includes first by the build. Headers that many others include
are precompiled, too: what stands before a header then is only what it includes itself.
Headers are compiled again only if they or what they include of ours has changed: BUILD/lone_headers.json holds a hash
of each that has passed. Prints what the compiler says of those that fail; exits with 1 if there is any.
"""

import collections
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


def first_include(text):
    match = INCLUDE.search(text)
    return match[1] if match else None


def with_includes(texts):
    """By header: it and all headers of ours that it includes, also through others."""
    found = {}
    for header in texts:
        reached, new = set(), {header}
        while new:
            reached |= new
            new = {name for one in new for name in INCLUDE.findall(texts[one]) if name in texts} - reached
        found[header] = reached
    return found


def first_of_sources(build):
    """Headers that the build has compiled before all else, but for the precompiled ones of libraries."""
    found = set()
    for entry in json.loads((build / "compile_commands.json").read_text()):
        if COMMON_NAME not in entry["command"]:
            continue
        first, path = None, entry["file"]
        while path and os.path.exists(path):  # a batch includes sources by their paths
            first = first_include(pathlib.Path(path).read_text())
            path = first if first and first.endswith(".cpp") else None
        found.add(first)
    return found


def starts_with(header, texts, reached, base):
    """The header and those that it proves when it is compiled after a base: each is the first include of the one before,
    and includes the base."""
    while header in texts and (base is None or base in reached[header] - {header}):
        yield header
        header = first_include(texts[header])


class Plan:
    """Which headers are compiled, each after which base, so that all that are asked for are proved.

    A base is a header that many others include; it is precompiled, after no other base, since clang 16 crashes on longer
    chains. A header that compiles after one that it includes compiles alone too, if all that it includes do.
    """

    def __init__(self, asked, texts, reached):
        size = {header: sum(len(texts[name]) for name in reached[header]) for header in texts}
        self.base_of = {header: None for header in asked}
        self.bases = set()
        while True:  # the base that saves most, in characters read
            saved = collections.Counter()
            for header, base in self.base_of.items():
                for name in reached[header] - {header}:
                    saved[name] += max(0, size[name] - (size[base] if base else 0))
            best = max(saved, key=lambda name: (saved[name] - 2 * size[name], name), default=None)
            if best is None or saved[best] <= 2 * size[best]:
                break
            self.bases.add(best)
            for header, base in self.base_of.items():
                if best in reached[header] - {header} and (base is None or size[best] > size[base]):
                    self.base_of[header] = best
        self.base_of.update({base: None for base in self.bases})
        self.proves = {}
        for header in sorted(self.base_of, key=lambda name: (name not in self.bases, -size[name], name)):
            if header in self.bases or not any(header in proved for proved in self.proves.values()):
                self.proves[header] = list(starts_with(header, texts, reached, self.base_of[header]))


def content_hash(reached, texts, options):
    """Hash of the options and of all headers of ours that a header reaches."""
    words = [*options, *(part for name in sorted(reached) for part in (name, texts[name]))]
    return hashlib.sha256("\0".join(words).encode()).hexdigest()


def main(root, build):
    options = options_by_folder(build)
    texts = {path.relative_to(root).as_posix(): path.read_text()
             for top in ("surfel", "srf", "warp", "render", "bench") for path in (root / top).rglob("*.h")}
    reached = with_includes(texts)
    common_text = (build / COMMON).read_text()
    built = {header for first in first_of_sources(build) for header in starts_with(first, texts, reached, None)}
    hashes = {header: content_hash(reached[header], texts, [common_text, *options[os.path.dirname(header)]])
              for header in texts.keys() - built}
    passed = build / "lone_headers.json"
    before = json.loads(passed.read_text()) if passed.exists() else {}
    asked = [header for header in hashes if before.get(header) != hashes[header]]
    plan = Plan(asked, texts, reached)
    said, failed = {}, set()
    if asked:
        with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            # Once for all of them, and not again for each header.
            precompiled = ["-fpch-instantiate-templates", "-x", "c++-header", "-"]
            common = f"{folder}/common.pch"
            said[COMMON] = clang([*options["surfel"], *precompiled, "-o", common], f'#include "{build / COMMON}"\n')

            def pch(base):
                return f"{folder}/{base.replace('/', '+')}.pch" if base else common

            def proof(header):
                base = plan.base_of[header]
                if base:
                    proofs[base].result()
                return clang([*options[os.path.dirname(header)], "-include-pch", pch(base),
                              *([*precompiled, "-o", pch(header)] if header in plan.bases
                                else ["-fsyntax-only", "-x", "c++", "-"])], f'#include "{header}"\n')

            proofs = {}
            for header in plan.proves:
                proofs[header] = pool.submit(proof, header)
            said.update((header, job.result()) for header, job in proofs.items())
    for header, words in said.items():
        if words:
            failed.update(plan.proves.get(header, texts))
    passed.write_text(json.dumps({header: hash_ for header, hash_ in hashes.items() if header not in failed}))
    print("".join(said.values()) or f"headers compile alone: {len(asked)} proved, {len(hashes) - len(asked)} unchanged")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*(pathlib.Path(word).resolve() for word in sys.argv[1:])))
