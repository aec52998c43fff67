"""Every kind of wrong include is found when planted in a clean tree, and nothing else."""

import pathlib
import tempfile
import unittest

from include_direction import violations

CLEAN = {
    "surfel/math/space.h": "#include <Eigen/Core>\n#include <vector>\n",
    "srf/image/image.h": '#include "surfel/math/space.h"\n',
    "srf/image/png.h": '#include "srf/image/image.h"\n',
    "srf/image/png.cpp": '#include "srf/image/png.h"\n#include <png.h>\n',
    "srf/capture/capture.h": '#include "srf/image/image.h"\n',
    "srf/codec/block.h": '#include "surfel/math/space.h"\n',
    "srf/weights/ulr.h": '#include "srf/capture/capture.h"\n',
    "srf/model/model.h": '#include "srf/weights/ulr.h"\n#include "srf/codec/block.h"\n',
    "warp/warp.h": '#include "surfel/math/space.h"\n',
    "render/surfels/frame.h": '#include "srf/model/model.h"\n#include "warp/warp.h"\n',
    "apps/command.h": '#include "render/surfels/frame.h"\n#include <nlohmann/json.hpp>\n',
    "tests/render/surfels/frame_test.cpp": '#include "render/surfels/frame.h"\n#include <gtest/gtest.h>\n',
}

PLANTED = {
    "surfel/math/space.h": '#include "warp/warp.h"',
    "srf/image/image.h": '#include "srf/capture/capture.h"',
    "srf/capture/capture.h": '#include "srf/weights/ulr.h"',
    "srf/codec/block.h": '#include "srf/capture/capture.h"',
    "srf/weights/ulr.h": '#include "srf/model/model.h"',
    "srf/model/model.h": '  #  include "render/surfels/frame.h"',
    "srf/image/png.cpp": '#include "warp/warp.h"',
    "warp/warp.h": '#include "srf/image/image.h"',
    "render/surfels/frame.h": '#include "apps/command.h"',
    "apps/command.h": '#include "tests/render/surfels/frame_test.cpp"',
    "tests/render/surfels/frame_test.cpp": '#include "frame.h"',
}


def violations_of(sources):
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources.items():
            path = pathlib.Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return violations(pathlib.Path(folder))


class IncludeDirection(unittest.TestCase):
    def test_a_clean_tree_has_no_violations(self):
        self.assertEqual(violations_of(CLEAN), [])

    def test_an_upward_or_unrooted_include_is_found(self):
        for name, line in PLANTED.items():
            with self.subTest(file=name):
                found = violations_of({**CLEAN, name: CLEAN[name] + line + "\n"})
                self.assertEqual(len(found), 1)
                self.assertTrue(found[0].startswith(name + ": includes "), found[0])

    def test_a_source_that_does_not_include_its_own_header_first_is_found(self):
        for text in ('#include <vector>\n#include "srf/image/png.h"\n', '#include "srf/image/image.h"\n', ""):
            with self.subTest(text=text):
                self.assertEqual(violations_of({**CLEAN, "srf/image/png.cpp": text}),
                                 ["srf/image/png.cpp: does not include srf/image/png.h first"])

    def test_a_third_party_header_in_a_header_is_found(self):
        for header in ("nlohmann/json.hpp", "toml++/toml.h", "CLI/CLI.hpp", "muParser.h", "embree3/rtcore.h",
                       "flann/flann.hpp", "ImfHeader.h", "png.h", "OpenImageIO/imageio.h", "zlib.h",
                       "fmt/format.h", "tbb/parallel_for.h"):
            with self.subTest(header=header):
                name = "render/surfels/frame.h"
                found = violations_of({**CLEAN, name: CLEAN[name] + f"#include <{header}>\n"})
                self.assertEqual(len(found), 1)
                self.assertIn(header, found[0])

    def test_a_folder_without_a_place_is_found(self):
        self.assertEqual(len(violations_of({**CLEAN, "srf/misc/misc.h": ""})), 1)

    def test_an_empty_tree_is_a_violation(self):
        self.assertEqual(len(violations_of({})), 1)


if __name__ == "__main__":
    unittest.main()
