#include "render/evaluation/diagnostics.h"

#include "tests/srf/image/files.h"
#include "tests/warp/meshes.h"

#include <gtest/gtest.h>

namespace surflect::evaluation {
namespace {

class Unreached : public ::testing::Test {
protected:
  Unreached() {
    warp::writeObj(folder / "cage.obj", warp::torus(24, 12));
    warp::writeObj(folder / "cage.1.obj", warp::torus(24, 12));
    for (const auto& p : warp::torus(96, 48).positions) object.push_back(p);
  }
  std::optional<std::string> of(const std::string& before, const std::string& after = "") const {
    const scene::Script script = scene::parseScript(
        before + "[[warp]]\ntype = \"mesh\"\nrest = \"cage.obj\"\nframes = \"cage.#.obj\"\n" + after,
        folder / "film.toml");
    return beyondRestMesh(script, scene::shotTime(script, 1), object);
  }
  static std::string scale(const std::string& factor) {
    return "[[warp]]\ntype = \"scale\"\nfactor = [" + factor + ", " + factor + ", " + factor + "]\n";
  }

  image::TemporaryFolder folder;
  std::vector<Point3<AcquisitionSpace>> object;
};

TEST_F(Unreached, AMeshAroundTheSurfelsIsRight) {
  EXPECT_EQ(of(""), std::nullopt);
  EXPECT_EQ(of("", scale("100")), std::nullopt); // what comes after it does not matter
  EXPECT_EQ(of(scale("100") + scale("0.01")), std::nullopt);
}

TEST_F(Unreached, OneInOtherUnitsIsTold) {
  const auto line = of(scale("100"));
  ASSERT_TRUE(line);
  EXPECT_NE(line->find("film.toml: warp[1]: 100 % of the surfels"), std::string::npos) << *line;
  EXPECT_EQ(line->find('\n'), std::string::npos);
  EXPECT_TRUE(of(scale("0.01"))); // all in the hole of the torus
}

} // namespace
} // namespace surflect::evaluation
