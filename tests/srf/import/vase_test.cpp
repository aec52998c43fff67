// The example capture in every format: importing it gives the same cameras and lamps.
#include "srf/import/import.h"
#include "srf/validation/validation.h"
#include "tests/srf/import/vision_camera.h"
#include "tests/support/foreign_captures.h"

namespace surflect::importers {
namespace {

const std::filesystem::path examples = std::filesystem::path(__FILE__).parent_path() / "../../../examples";

class Vase : public ::testing::Test {
protected:
  static const capture::Capture& original() {
    static const capture::Capture capture = capture::readCapture(examples / "vase");
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

  capture::Capture imported(const ImportOptions& options = {}) const {
    importCapture(folder / "in", folder / "out", options);
    return capture::readCapture(folder / "out");
  }

  static void expectTheSamePixels(const capture::Capture& capture) {
    ASSERT_EQ(capture.views.size(), views().size());
    for (const ForeignView& view : views()) {
      const capture::Camera<AcquisitionSpace>& wanted = viewNamed(original(), view.name).camera;
      const auto found = std::ranges::find_if(capture.views, [&](const capture::View& other) {
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
  static std::string findingsIn(const capture::Capture& capture) {
    std::string texts;
    for (const validation::Finding& finding : validation::checkCapture(capture, mesh(), {}, {}))
      texts += finding.text + "\n";
    return texts;
  }

  image::TemporaryFolder folder;
};

TEST_F(Vase, ComesThroughColmapsText) {
  writeColmap(views(), folder / "in", false);
  const capture::Capture capture = imported();
  expectTheSamePixels(capture);
  EXPECT_EQ(findingsIn(capture), "");
}

TEST_F(Vase, ComesThroughColmapsBinaries) {
  writeColmap(views(), folder / "in", true);
  const capture::Capture capture = imported();
  expectTheSamePixels(capture);
  EXPECT_EQ(findingsIn(capture), "");
}

TEST_F(Vase, ComesThroughNerfstudio) {
  writeNerfstudio(views(), folder / "in");
  const capture::Capture capture = imported();
  expectTheSamePixels(capture);
  EXPECT_EQ(findingsIn(capture), "");
}

TEST_F(Vase, ComesThroughRelightingSetsWithItsLamps) {
  writeRelighting(views(), folder / "in");
  const capture::Capture capture = imported();
  expectTheSamePixels(capture);
  EXPECT_EQ(findingsIn(capture), "");
  ASSERT_EQ(capture.frames.size(), views().size());
  for (size_t i = 0; i < views().size(); ++i) {
    const auto& lamp = std::get<capture::PointLight>(capture.lights[*capture.frames[i].light].kind);
    EXPECT_EQ(lamp.position.raw(), views()[i].lamp);
  }
}

TEST_F(Vase, ComesThroughMiddleburyWithMasksByThreshold) {
  writeMiddlebury(views(), folder / "in");
  ImportOptions options;
  options.masks = MaskMaking{.threshold = 0.003};
  const capture::Capture capture = imported(options);
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
} // namespace surflect::importers
