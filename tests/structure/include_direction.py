"""Checks that includes point downwards only, room by room: tests -> apps -> render -> srf, warp -> surfel.

    include_direction.py SOURCE_ROOT

Prints each include that does not, every third-party header in a header, and every source that does not include its own
header first. Exits with 1 if there is any.
"""

import pathlib
import re
import sys

# Rooms that each room may include, besides itself. A file belongs to the innermost room that holds it.
SURFEL = ["surfel/base", "surfel/math", "surfel/geometry"]
CAPTURE = SURFEL + ["srf/image", "srf/capture"]
PROXY = CAPTURE + ["srf/proxy/mesh", "srf/proxy/hull", "srf/proxy/relief"]
ASKED = PROXY + ["surfel", "srf/proxy", "srf/codec", "srf/reflectance", "srf/weights", "srf/shading"]
SCENE = ["surfel/base", "surfel/math", "srf/image", "srf/capture", "srf/weights", "warp", "render/scene"]
LIGHT_FIELD = SURFEL + SCENE + ["srf/proxy", "render/method", "render/gl", "render/lightfield/common"]
LIBRARY = ["surfel", "srf", "warp", "render"]
BELOW = {
    "surfel/base": [],
    "surfel/math": ["surfel/base"],
    "surfel/geometry": ["surfel/base", "surfel/math"],
    "surfel": SURFEL,
    "srf/image": ["surfel/base", "surfel/math"],
    "srf/capture": SURFEL + ["srf/image"],
    "srf/calibration": CAPTURE,
    "srf/proxy/mesh": CAPTURE,
    "srf/proxy/hull": CAPTURE,
    "srf/proxy/relief": CAPTURE,
    "srf/proxy": PROXY,
    "srf/validation": CAPTURE + ["srf/proxy/mesh", "srf/proxy"],
    "srf/import": CAPTURE + ["srf/calibration", "srf/proxy/mesh", "srf/proxy/hull", "srf/validation"],
    "srf/planes": CAPTURE + ["srf/proxy/relief"],
    "srf/codec": ["surfel/base", "surfel/math", "srf/image"],
    "srf/weights": SURFEL + ["surfel", "srf/image", "srf/capture", "srf/codec", "srf/reflectance"],
    "srf/reflectance": SURFEL,
    "srf/shading": SURFEL + ["surfel", "srf/image", "srf/capture", "srf/codec", "srf/reflectance", "srf/weights"],
    "srf/model": ASKED,
    "warp": SURFEL + ["surfel"],
    "render/scene": SCENE,
    "render/splat": SURFEL + ["surfel", "srf/image", "srf/capture"],
    "render/method": SCENE + ["srf/validation"],  # the contract of a method
    "render/surfels": SURFEL + SCENE + ["surfel", "srf/codec", "srf/shading", "srf/model", "render/method", "render/splat"],
    "render/gaussians": SURFEL + SCENE + ["surfel", "srf/shading", "render/surfels"],
    "render": SCENE + ["render/method"],  # all methods, for those who open models
    "render/methods.cpp": LIGHT_FIELD + ["render", "srf/model", "render/stage", "render/surfels", "render/lightfield/slf",
                                         "render/lightfield/lumigraph", "render/lightfield/lfm", "render/lightfield/spherical",
                                         "render/lightfield/traced", "render/lightfield/olf"],  # the one file that knows them
    "render/control": ["surfel/base", "srf/image", "render/method"],
    "render/film": SURFEL + SCENE + ["render/method"],
    "render/session": SURFEL + ["render/method"],
    "render/evaluation": PROXY + SCENE + ["render/method"],
    "render/gl": CAPTURE,
    "render/lightfield/common": SCENE + SURFEL + ["srf/proxy", "srf/validation", "render/method"],
    "render/lightfield/slf": LIGHT_FIELD,
    "render/lightfield/lumigraph": LIGHT_FIELD,
    "render/lightfield/lfm": LIGHT_FIELD,
    "render/lightfield/spherical": LIGHT_FIELD,
    "render/lightfield/traced": LIGHT_FIELD + ["render/lightfield/spherical", "render/stage"],
    "render/verify": SURFEL + SCENE + ["surfel", "srf/codec", "srf/shading", "srf/model", "render/method", "render/splat", "render/surfels", "render/evaluation"],
    "render/lightfield/olf": LIGHT_FIELD + ["srf/proxy/hull", "render/lightfield/lfm"],
    "render/chart": SCENE + ["render/method", "render", "render/evaluation"],
    "render/stage/material": ["surfel/base", "surfel/math"],
    "render/stage": CAPTURE + ["srf/model", "warp", "render/scene", "render/stage/material"],
    "apps": LIBRARY,
    "bench": LIBRARY,
    "tests": LIBRARY + ["apps", "bench"],
}
# Beside the standard library and Eigen, which every header may use. The fields of a capture are functions of JSON values,
# which json_fwd.hpp declares.
HEADERS_MAY_USE = {"apps": ["CLI/", "nlohmann/"], "bench": ["nlohmann/"], "surfel/math": ["hwy/"], "render/splat": ["hwy/"],
                   "surfel/geometry": ["embree"],
                   "srf/capture": ["nlohmann/json_fwd.hpp"],
                   "tests": ["gtest/", "unistd.h", "nlohmann/"]}

INCLUDE = re.compile(r'^\s*#\s*include\s*(<|")([^>"]+)[>"]', re.MULTILINE)


def is_in(path, folder):
    return path == folder or path.startswith(folder + "/")


def room_of(path):
    """Returns the innermost room that holds a file, or None."""
    return max((folder for folder in BELOW if is_in(path, folder)), key=len, default=None)


def may_include(room, header):
    """Returns whether files of a room may include a header: one of their own room, or of a room that BELOW lists.

    apps, bench and tests may include whole top-level folders; every other room lists single rooms.
    """
    whole = room in ("apps", "bench", "tests")
    return any(is_in(header, folder) if whole else room_of(header) == folder for folder in [room] + BELOW[room])


def is_standard(header):
    return re.fullmatch("[a-z_0-9]+", header) is not None


def complaint(root, file, opening, header):
    """What is wrong with `#include header` in `file`; None if nothing is."""
    room = room_of(file)
    if opening == "<":
        allowed = ["Eigen/"] + HEADERS_MAY_USE.get(room, [])
        if not file.endswith(".h") or is_standard(header) or any(header.startswith(a) for a in allowed):
            return None
        return "third-party headers belong in .cpp files"
    if header in ("surfel/base/version.h", "page/page.h", "web/page.h"):  # made when the build is configured
        header = file
    if not (root / header).is_file() and pathlib.PurePath(header).name != "shaders.h":  # made by surflect_shaders()
        return "not a path from the root"
    if may_include(room, header):
        return None
    return f"{room} must not know {pathlib.PurePath(header).parent}"


def violations(root):
    found = []
    files = [path for top in ("surfel", "srf", "warp", "render", "apps", "tests", "bench")
             for path in (root / top).rglob("*") if path.suffix in (".h", ".cpp")]
    for path in sorted(files):
        file = path.relative_to(root).as_posix()
        if room_of(file) is None:
            found.append(f"{file}: in no known room")
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
