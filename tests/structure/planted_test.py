"""The checks of named files and of headers' own includes find a fault that is planted in a clean tree, and nothing else."""

import contextlib
import io
import json
import pathlib
import tempfile
import unittest

import doc_paths
import lone_headers
import self_contained

CLEAN = {
    "README.md": "See `srf/a.h`.\n",
    "srf/a.h": '// Sums, as b.h has them.\n#include "srf/b.h"\ninline std::vector<int> a;\n',
    "srf/b.h": "// Lists.\n#include <vector>\n",
    "docs/page.md": "`srf/b.h` and [README.md](../README.md), for NAME in srf/NAME.h\n",
}


def found_by(check, sources):
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources.items():
            path = pathlib.Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return check(pathlib.Path(folder))


class Planted(unittest.TestCase):
    def test_a_clean_tree_has_no_faults(self):
        self.assertEqual(found_by(doc_paths.dangling, CLEAN), [])
        self.assertEqual(found_by(self_contained.lacking, CLEAN), [])

    def test_a_file_that_is_not_there_is_found(self):
        for name, text in (("README.md", "`srf/c.h`\n"), ("docs/page.md", "warp/warp.cpp\n"), ("srf/b.h", "// See c.h.\n")):
            with self.subTest(file=name):
                self.assertEqual(len(found_by(doc_paths.dangling, {**CLEAN, name: CLEAN[name] + text})), 1)

    def test_a_header_that_lacks_an_include_is_found(self):
        for line in ("std::optional<int> b;", "inline double c = std::sqrt(2);", "Eigen::Vector3d v;"):
            with self.subTest(line=line):
                found = found_by(self_contained.lacking, {**CLEAN, "srf/b.h": CLEAN["srf/b.h"] + line + "\n"})
                self.assertEqual(len(found), 1)
                self.assertTrue(found[0].startswith("srf/b.h: lacks"), found)

    def test_a_header_that_does_not_compile_alone_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in {"surfel/a.h": "#pragma once\nstruct A {};\n",
                               "surfel/b.h": "#pragma once\ninline A b;\n", lone_headers.COMMON: ""}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            command = f"c++ -I{root} -std=c++20 -o surfel/CMakeFiles/a.o -c a.cpp"
            (root / "compile_commands.json").write_text(json.dumps([{"command": command}]))
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                self.assertEqual(lone_headers.main(root, root), 1)
                (root / "surfel/b.h").write_text('#pragma once\n#include "surfel/a.h"\ninline A b;\n')
                self.assertEqual(lone_headers.main(root, root), 0)
                (root / "surfel/a.h").write_text("#pragma once\nstruct B {};\n")  # what the other one includes
                self.assertEqual(lone_headers.main(root, root), 1)
            self.assertEqual(said.getvalue().count("unknown type name 'A'"), 2)

    def test_a_header_is_compiled_after_no_more_than_it_includes(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            texts = {"surfel/a.h": "struct A {};\n", "surfel/b.h": "struct B {};\n" + 100 * "// long\n"}
            texts |= {f"surfel/user{i}.h": f'#include "surfel/b.h"\ninline B b{i};\n' for i in range(10)}
            texts["surfel/lacking.h"] = '#include "surfel/a.h"\ninline B b;\n'
            texts["surfel/second.h"] = '#include "surfel/b.h"\ninline A a;\n'
            plan = lone_headers.Plan(list(texts), texts, lone_headers.with_includes(texts))
            self.assertEqual(plan.bases, {"surfel/b.h"})
            for name, text in {**texts, lone_headers.COMMON: ""}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text("#pragma once\n" + text)
            command = f"c++ -I{root} -std=c++20 -o surfel/CMakeFiles/a.o -c a.cpp"
            (root / "compile_commands.json").write_text(json.dumps([{"command": command}]))
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                self.assertEqual(lone_headers.main(root, root), 1)
            self.assertEqual(said.getvalue().count("unknown type name"), 2)
            passed = json.loads((root / "lone_headers.json").read_text())
            # With the one that a faulty header includes first, which only that one would have proved.
            self.assertEqual(texts.keys() - passed.keys(), {"surfel/lacking.h", "surfel/second.h", "surfel/a.h"})


if __name__ == "__main__":
    unittest.main()
