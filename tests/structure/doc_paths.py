"""Checks that the files which the documentation and comments name are there.

    doc_paths.py SOURCE_ROOT

Prints each path that leads nowhere, with the file that names it; exits with 1 if there is any. Paths count from the root
(`srf/codec/block.h`); in C++ comments a header may also be named alone (ulr.h), and must then exist somewhere.
"""

import pathlib
import re
import sys

ROOTED = re.compile(r"(?<![\w./-])((?:surfel|srf|warp|render|apps|tests|bench|examples|docs|scripts|cmake)/[\w./-]*\w\.(?:h|cpp|py|md|toml|in))\b")
HEADER = re.compile(r"(?<![\w./\"<-])([a-z_0-9]+\.h)\b")


def dangling(root):
    found = []
    headers = {path.name for top in ("surfel", "srf", "warp", "render", "apps", "tests", "bench")
               for path in (root / top).rglob("*.h")}
    sources = [path for top in ("surfel", "srf", "warp", "render", "apps", "bench", "docs", "scripts", "cmake")
               for path in (root / top).rglob("*") if path.suffix in (".h", ".cpp", ".md", "") and path.is_file()]
    for path in sorted(sources + [root / "README.md"]):
        text = path.read_text(errors="ignore")
        is_code = path.suffix in (".h", ".cpp")
        comments = "\n".join(re.findall(r"//([^\n]*)", text)) if is_code else text
        names = {name for name in ROOTED.findall(comments)
                 if "NAME" not in name and not (root / name).exists() and not (path.parent / name).exists()}
        if is_code:
            names |= {name for name in HEADER.findall(comments) if name not in headers}
        found += [f"{path.relative_to(root).as_posix()}: names {name}, which is not there" for name in sorted(names)]
    return found


if __name__ == "__main__":
    found = dangling(pathlib.Path(sys.argv[1]))
    print("\n".join(found) or "all files that are named are there")
    sys.exit(1 if found else 0)
