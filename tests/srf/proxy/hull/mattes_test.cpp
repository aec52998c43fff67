#include "srf/proxy/hull/mattes.h"

#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "srf/proxy/impostor.h"
#include "tests/srf/proxy/hull/shapes.h"

namespace surflect::hull {
namespace {

// Two views under two lights; picture and mask of each frame are files of their own.
class Mattes : public ::testing::Test {
protected:
  Mattes() {
    for (const auto& camera : shapes::camerasAround(2, 16))
      capture.views.push_back({studio::numbered("C", capture.views.size()), camera});
    capture.lights = studio::studioLights(2);
    capture.file = folder / "transforms.json";
  }

  void add(size_t view, size_t light, const std::optional<image::Image>& mask) {
    capture::Frame frame;
    frame.view = view;
    frame.light = light;
    frame.picture = studio::numbered("picture", capture.frames.size()) + ".png";
    image::writePng(folder / frame.picture.string(), image::Image(16, 16, 3));
    if (mask) {
      frame.mask = studio::numbered("mask", capture.frames.size()) + ".png";
      image::writePng(folder / frame.mask.string(), *mask);
    }
    capture.frames.push_back(frame);
  }
  static image::Image columns(int from, int to) {
    image::Image mask(16, 16, 1);
    for (int y = 0; y < 16; ++y)
      for (int x = from; x < to; ++x) mask.at(x, y)[0] = 1;
    return mask;
  }

  image::TemporaryFolder folder;
  capture::Capture capture;
};

TEST_F(Mattes, AreUnitedOverTheFramesOfAView) {
  add(0, 0, columns(3, 6));
  add(0, 1, columns(5, 9));
  add(1, 0, std::nullopt);
  add(1, 1, columns(2, 4));
  const auto silhouetteViews = silhouetteViewsOf(capture, {});
  ASSERT_EQ(silhouetteViews.size(), 2u);
  EXPECT_EQ(silhouetteViews[0].name, "C0");
  EXPECT_EQ(silhouetteViews[0].outline.mask(), image::objectMask(columns(3, 9)));
  EXPECT_EQ(silhouetteViews[1].outline.mask(), image::objectMask(columns(2, 4)));
}

// Denoisers leave faint alpha beside the object, in floating point too.
TEST_F(Mattes, TouchWhatMoreThanAFew255thsOfAlphaShow) {
  add(0, 0, std::nullopt);
  image::Image picture(16, 16, 4);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) picture.at(x, y)[3] = x >= 5 && x < 9 ? 0.02f : 2 / 255.f;
  image::writeExr(folder / "picture.exr", picture, image::Precision::single);
  capture.frames[0].picture = "picture.exr";
  const auto silhouetteViews = silhouetteViewsOf(capture, {}, Silhouette::touched);
  ASSERT_EQ(silhouetteViews.size(), 1u);
  EXPECT_EQ(silhouetteViews[0].outline.mask(), image::objectMask(columns(4, 10)));
}

TEST_F(Mattes, ThatAreMissingOrWithoutBackgroundAreNone) {
  add(0, 0, std::nullopt);
  add(1, 0, columns(0, 16));
  EXPECT_TRUE(silhouetteViewsOf(capture, {}).empty());
}

TEST_F(Mattes, ThatAreAllEmptyOrFullAreExplainedByTheFirst) {
  for (size_t view = 0; view < 2; ++view) add(view, 0, columns(0, 0));
  EXPECT_NE(
      image::errorOf([&] { proxy::impostorOf(capture, {}, {}); })
          .find(
              "no geometry, and mattes that show no object (nothing is above half of white); the first is " +
              (folder / "mask0.png").string() + " (16 x 16, values 0 to 0 of 255)"),
      std::string::npos);
  for (const char* mask : {"mask0.png", "mask1.png"}) image::writePng(folder / mask, columns(0, 16));
  EXPECT_NE(
      image::errorOf([&] { proxy::impostorOf(capture, {}, {}); }).find("mattes that show no background"),
      std::string::npos);
  for (capture::Frame& frame : capture.frames) frame.mask.clear();
  EXPECT_NE(image::errorOf([&] {
              proxy::impostorOf(capture, {}, {});
            }).find("neither geometry nor mattes: give a mesh"),
            std::string::npos);
}

TEST_F(Mattes, ThatCannotBeReadAreNamed) {
  add(0, 0, columns(3, 6));
  image::writeBytes(folder / "mask0.png", "nothing");
  EXPECT_NE(image::errorOf([&] { silhouetteViewsOf(capture, {}); }).find("mask0.png"), std::string::npos);
}

} // namespace
} // namespace surflect::hull
