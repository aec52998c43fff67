"""Checks that headers include what they use of the headers that libraries have precompiled.

    self_contained.py SOURCE_ROOT

A source is compiled with these at hand, so the compiler does not notice where a header lacks one. A header has them from
its own includes or from those of the headers that it includes. Prints each that it lacks; exits with 1 if there is any.
"""

import pathlib
import re
import sys

# By header: names that come from it. cmake/SurflectTargets.cmake lists the headers.
NAMES = {
    "Eigen/": r"\bEigen::",
    "algorithm": r"\bstd::(?:min|max|clamp|sort|stable_sort|fill|copy|find_if|count_if|transform|ranges::(?:sort|any_of|all_of|find|fill|count))\(",
    "array": r"\bstd::array\b",
    "cmath": r"\bstd::(?:sqrt|abs|hypot|exp|log|pow|sin|cos|tan|atan2|floor|ceil|isfinite|isnan)\(",
    "cstdint": r"\bu?int(?:8|16|32|64)_t\b",
    "filesystem": r"\bstd::filesystem::",
    "functional": r"\bstd::function\b",
    "map": r"\bstd::map\b",
    "memory": r"\bstd::(?:unique_ptr|shared_ptr|make_unique|make_shared)\b",
    "optional": r"\bstd::(?:optional|nullopt)\b",
    "span": r"\bstd::span\b",
    "string": r"\bstd::(?:string|to_string)\b",
    "string_view": r"\bstd::string_view\b",
    "variant": r"\bstd::(?:variant|visit|holds_alternative|get_if)\b",
    "vector": r"\bstd::vector\b",
}
# Headers that bring another along, by the standard.
ALSO = {"string": {"string_view"}}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)


def included(root, header, known):
    """Returns all headers that a header includes, also through others of the library."""
    if header not in known:
        known[header] = set()
        for name in INCLUDE.findall((root / header).read_text()):
            known[header] |= {name} | ALSO.get(name, set())
            if (root / name).is_file():
                known[header] |= included(root, name, known)
    return known[header]


def lacking(root):
    found, known = [], {}
    for top in ("surfel", "srf", "warp", "render"):
        for path in sorted((root / top).rglob("*.h")):
            header = path.relative_to(root).as_posix()
            code = re.sub(r"//[^\n]*", "", path.read_text())
            for name, pattern in NAMES.items():
                if re.search(pattern, code) and not any(i == name or i.startswith(name) and name.endswith("/")
                                                        for i in included(root, header, known)):
                    found.append(f"{header}: lacks #include <{name}>")
    return found


if __name__ == "__main__":
    found = lacking(pathlib.Path(sys.argv[1]))
    print("\n".join(found) or "headers include what they use")
    sys.exit(1 if found else 0)
