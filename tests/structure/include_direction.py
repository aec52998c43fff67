"""Includes point downwards only: tests -> apps -> render -> srf, warp -> surfel, and likewise inside srf.

    include_direction.py SOURCE_ROOT

Prints each include that does not, every third-party header in a header, and every source that does not include its own
header first, which is how the compiler learns that the header stands alone; exits with 1 if there is any.
"""

import pathlib
import re
import sys

# What a folder may include, beside itself and its subfolders.
BELOW = {
    "surfel": [],
    "srf/image": ["surfel"],
    "srf/capture": ["surfel", "srf/image"],
    "srf/calibration": ["surfel", "srf/image", "srf/capture"],
    "srf/import": ["surfel", "srf/image", "srf/capture", "srf/calibration"],
    "srf/store": ["surfel", "srf/image"],
    "srf/query": ["surfel", "srf/image", "srf/capture"],
    "srf/relief": ["surfel", "srf/image", "srf/capture"],
    "srf/hull": ["surfel", "srf/image", "srf/capture"],
    "srf/model": ["surfel", "srf/image", "srf/capture", "srf/store", "srf/query", "srf/relief", "srf/hull"],
    "srf/checks": ["surfel", "srf/image", "srf/capture", "srf/query"],
    "warp": ["surfel"],
    "render/stage/material": ["surfel"],
    "render": ["surfel", "srf/image", "srf/capture", "srf/store", "srf/query", "srf/relief", "srf/model", "warp"],
    "apps": ["surfel", "srf", "warp", "render"],
    "tests": ["surfel", "srf", "warp", "render", "apps", "bench"],
    "bench": ["surfel", "srf", "warp", "render"],
}
# Beside the standard library and Eigen, which every header may use. immintrin.h is the compiler's own.
HEADERS_MAY_USE = {"apps": ["CLI/", "nlohmann/"], "bench": ["nlohmann/"], "surfel": ["immintrin.h"],
                   "tests": ["gtest/", "unistd.h", "nlohmann/"]}

INCLUDE = re.compile(r'^\s*#\s*include\s*(<|")([^>"]+)[>"]', re.MULTILINE)


def is_in(path, folder):
    return path == folder or path.startswith(folder + "/")


def layer_of(path):
    """The layer of a file, or None where no layer has been given a place."""
    return next((folder for folder in BELOW if is_in(path, folder)), None)


def is_standard(header):
    return re.fullmatch("[a-z_0-9]+", header) is not None


def complaint(root, file, opening, header):
    """What is wrong with `#include header` in `file`; None if nothing is."""
    layer = layer_of(file)
    if opening == "<":
        allowed = ["Eigen/"] + HEADERS_MAY_USE.get(layer, [])
        if not file.endswith(".h") or is_standard(header) or any(header.startswith(a) for a in allowed):
            return None
        return "third-party headers belong in .cpp files"
    if not (root / header).is_file():
        return "not a path from the root"
    if any(is_in(header, folder) for folder in [layer] + BELOW[layer]):
        return None
    return f"{layer} must not know {pathlib.PurePath(header).parent}"


def violations(root):
    found = []
    files = [path for top in ("surfel", "srf", "warp", "render", "apps", "tests", "bench")
             for path in (root / top).rglob("*") if path.suffix in (".h", ".cpp")]
    for path in sorted(files):
        file = path.relative_to(root).as_posix()
        if layer_of(file) is None:
            found.append(f"{file}: in no known layer")
            continue
        includes = INCLUDE.findall(path.read_text())
        own = pathlib.PurePath(file).with_suffix(".h").as_posix()
        if path.suffix == ".cpp" and (root / own).is_file() and includes[:1] != [('"', own)]:
            found.append(f"{file}: does not include {own} first")
        for opening, header in includes:
            problem = complaint(root, file, opening, header)
            if problem:
                found.append(f"{file}: includes {header}: {problem}")
    if not files:
        found.append(f"{root}: no sources")
    return found


if __name__ == "__main__":
    found = violations(pathlib.Path(sys.argv[1]))
    print("\n".join(found) or "includes point downwards")
    sys.exit(1 if found else 0)
