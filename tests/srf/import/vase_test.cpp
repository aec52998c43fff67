// The example capture in every format: imported, it must be the same cameras and lamps again.
#include "srf/import/import.h"
#include "srf/validation/validation.h"
#include "tests/srf/import/vision_camera.h"
#include "tests/support/foreign_captures.h"

namespace surflect {
namespace {

const std::filesystem::path examples = std::filesystem::path(__FILE__).parent_path() / "../../../examples";

class Vase : public testing::Test {
protected:
  static const Capture& original() {
    static const Capture capture = readCapture(examples / "vase");
    return capture;
  }
  static const TriangleMesh& mesh() {
    static const TriangleMesh read = readMesh(examples / "vase/vase.ply");
    return read;
  }
  static const std::vector<ForeignView>& views() {
    static const std::vector<ForeignView> photographed = photographedByOthers(original(), 2, 4);
    return photographed;
  }

  Capture imported(const ImportOptions& options = {}) const {
    importCapture(folder / "in", folder / "out", options);
    return readCapture(folder / "out");
  }

  static void expectTheSamePixels(const Capture& capture) {
    ASSERT_EQ(capture.views.size(), views().size());
    for (const ForeignView& view : views()) {
      const Camera<AcquisitionSpace>& wanted = viewNamed(original(), view.name).camera;
      const auto found = std::ranges::find_if(capture.views, [&](const View& other) {
        return std::filesystem::path(other.identity).stem() == view.name;
      });
      ASSERT_NE(found, capture.views.end()) << view.name;
      double largest = 0;
      for (const Point3<AcquisitionSpace>& position : mesh().positions) {
        const auto point = assume<Point3<AcquisitionSpace, double>>(position.raw().cast<double>());
        const auto got = found->camera.project(point), before = wanted.project(point);
        ASSERT_TRUE(got && before);
        largest = std::max(largest, std::hypot(got->x - before->x, got->y - before->y));
      }
      EXPECT_LT(largest, 1e-6) << view.name;
    }
  }
  static std::string findingsIn(const Capture& capture) {
    std::string texts;
    for (const Finding& finding : checkCapture(capture, mesh(), {}, {})) texts += finding.text + "\n";
    return texts;
  }

  TemporaryFolder folder;
};

TEST_F(Vase, ComesThroughColmapsText) {
  writeColmap(views(), folder / "in", false);
  const Capture capture = imported();
  expectTheSamePixels(capture);
  EXPECT_EQ(findingsIn(capture), "");
}

TEST_F(Vase, ComesThroughColmapsBinaries) {
  writeColmap(views(), folder / "in", true);
  const Capture capture = imported();
  expectTheSamePixels(capture);
  EXPECT_EQ(findingsIn(capture), "");
}

TEST_F(Vase, ComesThroughNerfstudio) {
  writeNerfstudio(views(), folder / "in");
  const Capture capture = imported();
  expectTheSamePixels(capture);
  EXPECT_EQ(findingsIn(capture), "");
}

TEST_F(Vase, ComesThroughRelightingSetsWithItsLamps) {
  writeRelighting(views(), folder / "in");
  const Capture capture = imported();
  expectTheSamePixels(capture);
  EXPECT_EQ(findingsIn(capture), "");
  ASSERT_EQ(capture.frames.size(), views().size());
  for (size_t i = 0; i < views().size(); ++i) {
    const auto& lamp = std::get<PointLight>(capture.lights[*capture.frames[i].light].kind);
    EXPECT_EQ(lamp.position.raw(), views()[i].lamp);
  }
}

TEST_F(Vase, ComesThroughMiddleburyWithMasksByThreshold) {
  writeMiddlebury(views(), folder / "in");
  ImportOptions options;
  options.maskThreshold = 0.003;
  const Capture capture = imported(options);
  expectTheSamePixels(capture);
  EXPECT_EQ(findingsIn(capture), "");
}

TEST_F(Vase, PosesWithAnotherAxisUpAreFound) {
  writeNerfstudio(withYUp(views()), folder / "in");
  EXPECT_NE(findingsIn(imported()).find("masks differ in 9 of 9 views"), std::string::npos);
}

TEST_F(Vase, MirroredLampsAreFound) {
  writeRelighting(withMirroredLamps(views()), folder / "in");
  EXPECT_NE(findingsIn(imported()).find("negated in y"), std::string::npos);
}

} // namespace
} // namespace surflect
