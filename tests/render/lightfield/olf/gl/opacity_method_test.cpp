#include "render/lightfield/olf/opacity_method.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/olf/build.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <memory>

namespace surflect::olf {
namespace {

// A matte sphere, built once.
class OpacityMethodTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 40, .lights = 0, .size = 48}, *folder_ / "capture");
    for (const auto& [name, method] : {std::pair("vdtm", Blending::vdtm), {"ulr", Blending::ulr}}) {
      lightfield::Views views(*folder_ / "capture");
      build(views, {.method = method}, *folder_ / name);
    }
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static scene::Scene sceneFrom(const Vec3<double>& direction, const warp::Warp& warp) {
    return {warp, studio::cameraFrom<ObjectSpace>(direction, 48), {}};
  }

  static std::unique_ptr<method::Renderer> opened(const char* name, const method::Setting& setting = {}) {
    return vdtmMethod().open(*folder_ / name, setting, {});
  }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_F(OpacityMethodTest, ShowsTheObjectAndItsOutlineFromNewViewpoints) {
  for (const char* name : {"vdtm", "ulr"}) {
    const auto renderer = opened(name);
    for (const Vec3<double>& direction : {Vec3<double>(1, 2, 3), Vec3<double>(-3, 0.5, 1)}) {
      const method::FrameLayers layers = renderer->render(sceneFrom(direction, *rest_));
      const auto camera = studio::cameraFrom<AcquisitionSpace>(direction, 48);
      const image::Image truth = studio::overBlack(studio::viewSphere(camera, 3), studio::fixedRadiance);
      double squares = 0;
      for (size_t i = 0; i < truth.values.size(); ++i)
        squares += std::pow(static_cast<double>(truth.values[i] - layers.color.values[i]), 2);
      const double rms = std::sqrt(squares / static_cast<double>(truth.values.size()));
      RecordProperty(name, std::to_string(rms));
      EXPECT_LE(rms, 0.06) << name;
    }
  }
}

TEST_F(OpacityMethodTest, DescribesItself) {
  const auto renderer = opened("ulr", {{"order", "peel"}});
  EXPECT_EQ(renderer->describe().method, "ulr");
  EXPECT_EQ(opened("vdtm")->describe().method, "vdtm");
  EXPECT_EQ(renderer->describe().counts.at("views"), 40u);
  EXPECT_EQ(renderer->describe().counts.at("pieces"), renderer->describe().counts.at("triangles"));
  EXPECT_LE(length(renderer->describe().middle - Point3<AcquisitionSpace, double>(0, 0, 0)), 0.05);
  const std::string before = renderer->describe().identity;
  EXPECT_NE(before.find("peel"), std::string::npos);
  renderer->set({{"samples", 1}});
  EXPECT_NE(renderer->describe().identity, before);
  EXPECT_THROW(renderer->set({{"order", "list"}}), Error);
}

TEST_F(OpacityMethodTest, ReportsStagesAndWhatItKeepsInMemory) {
  for (const auto& [name, order] : {std::pair("vdtm", "bsp"), {"ulr", "list"}}) {
    const bool isBsp = order == std::string("bsp");
    const auto renderer = opened(name, {{"order", order}});
    const auto& counts = renderer->describe().counts;
    const bool isVdtm = renderer->describe().counts.at("triangulation_bytes") > 0;
    EXPECT_EQ(isVdtm, name == std::string("vdtm"));
    EXPECT_EQ(counts.at("bsp_tree_bytes") > 0, isBsp);
    EXPECT_EQ(counts.at("blend_bytes"), sizeof(TriangleBlend) * counts.at("triangles"));
    EXPECT_EQ(counts.at("matrix_bytes"), 64 * counts.at("views"));
    size_t sum = 0;
    for (const char* part : {"triangulation_bytes", "direction_bytes", "visible_view_bytes", "corner_bytes",
                             "bsp_tree_bytes", "piece_bytes", "blend_bytes", "matrix_bytes"})
      sum += counts.at(part);
    EXPECT_EQ(counts.at("auxiliary_bytes"), sum);
    const auto seconds = renderer->render(sceneFrom({1, 2, 3}, *rest_)).report.seconds;
    EXPECT_EQ(seconds.contains("order"), isBsp);
    for (const char* stage : {"closest views", "blends", "upload", "draw", "read"})
      EXPECT_TRUE(seconds.contains(stage)) << stage;
  }
}

} // namespace
} // namespace surflect::olf
