// The example photographs by one camera, with a light file instead of their capture: importing them gives
// that capture.
#include "srf/image/image_file.h"
#include "srf/import/import.h"
#include "tests/srf/image/files.h"
#include "tests/support/vision_camera.h"

namespace surflect::importers {
namespace {

namespace fs = std::filesystem;

const fs::path cat = fs::path(__FILE__).parent_path() / "../../../examples/cat";

class Cat : public ::testing::Test {
protected:
  Cat() { fs::copy(cat / "images", folder / "in"); }

  Vec3<double> towards(const capture::Capture& capture, size_t frame) const {
    return std::get<capture::DirectionalLight>(capture.lights[*capture.frames[frame].light].kind)
        .towards.raw();
  }
  void expectTheSame(const char* lights) const {
    ImportOptions options;
    options.lights = folder / "in" / lights;
    options.colorSpace = capture::ColorSpace::linear;
    options.litView.height = 2;
    options.masks = MaskMaking{.threshold = 0.08};
    options.test = {"Image_06", "Image_09", "Image_12"};
    importCapture(folder / "in", folder / lights, options);
    capture::Capture got = capture::readCapture(folder / lights);
    std::ranges::sort(got.frames, {}, &capture::Frame::picture);
    ASSERT_EQ(got.views.size(), 1u);
    EXPECT_EQ(got.views[0].camera.lens, original.views[0].camera.lens);
    EXPECT_EQ(got.views[0].camera.cameraFromWorld.rotation(),
              original.views[0].camera.cameraFromWorld.rotation());
    EXPECT_EQ(image::readPicture(got.folder() / got.frames[0].mask).image.values,
              image::readPicture(original.folder() / original.frames[0].mask).image.values);
    ASSERT_EQ(got.frames.size(), original.frames.size());
    for (size_t f = 0; f < got.frames.size(); ++f) {
      EXPECT_EQ(got.frames[f].picture.filename(), original.frames[f].picture.filename());
      EXPECT_EQ(got.frames[f].split, original.frames[f].split);
      EXPECT_LT((towards(got, f) - towards(original, f)).norm(), 1e-12);
      const auto& fitted =
          std::get<capture::DirectionalLight>(got.lights[*got.frames[f].light].kind).irradiance;
      const auto& known =
          std::get<capture::DirectionalLight>(original.lights[*original.frames[f].light].kind).irradiance;
      EXPECT_NEAR(fitted.g / known.g, 1, 1e-4) << got.frames[f].picture;
    }
  }

  image::TemporaryFolder folder;
  const capture::Capture original = capture::readCapture(cat);
};

TEST_F(Cat, ComesThroughAnLpFile) {
  // Light file written on another machine: backslashes, a missing folder, and another order.
  std::string text = std::to_string(original.frames.size()) + "\r\n";
  for (size_t f = original.frames.size(); f-- > 0;) {
    const Vec3<double> l = towards(original, f);
    text += "D:\\rti\\cat\\" + original.frames[f].picture.filename().string() + " " + row(l[0], l[1], l[2]) +
            "\r\n";
  }
  image::writeBytes(folder / "in/cat.lp", text);
  expectTheSame("cat.lp");
}

TEST_F(Cat, ComesThroughThreeRowsOfDirections) {
  std::string text;
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t f = 0; f < original.frames.size(); ++f) text += digits(towards(original, f)[axis]) + " ";
    text += "\n";
  }
  image::writeBytes(folder / "in/light_directions.txt", text);
  expectTheSame("light_directions.txt");
}

} // namespace
} // namespace surflect::importers
