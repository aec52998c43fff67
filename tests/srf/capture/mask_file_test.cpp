#include "srf/capture/mask_file.h"

#include "srf/capture/photograph.h"
#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"
#include "tests/srf/image/foreign_files.h"

namespace surflect::capture {
namespace {

constexpr int kSide = 20;

// A disc of radius 6 in the middle, of the given value; the same for other values outside.
image::Image disc(float inside, float outside, int side = kSide) {
  image::Image image(side, side, 1);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const double away = std::hypot(x + 0.5 - side / 2., y + 0.5 - side / 2.);
      image.at(x, y)[0] = away < 0.3 * side ? inside : outside;
    }
  return image;
}

// RGB and alpha of two images of one channel.
image::Image joined(const image::Image& gray, const image::Image& alpha) {
  image::Image image(gray.width, gray.height, 4);
  for (size_t i = 0; i < alpha.values.size(); ++i) {
    std::fill_n(image.values.begin() + static_cast<std::ptrdiff_t>(4 * i), 3, gray.values[i]);
    image.values[4 * i + 3] = alpha.values[i];
  }
  return image;
}

MaskContent contentOf(image::Image image, int bits = 8) {
  return surflect::capture::contentOf(image::Picture{std::move(image), bits, false, {}});
}

TEST(Masks, OfTwoLevelsAreMasksWhateverTheBrighterIs) {
  const image::Image wanted = disc(1, 0);
  for (const float level : {1 / 255.f, 0.107f, 0.5f, 0.7152f, 200 / 255.f, 254 / 255.f, 1.f}) {
    const MaskContent content = contentOf(disc(level, 0));
    EXPECT_EQ(content.white, level);
    EXPECT_EQ(content.coverage.values, wanted.values) << level;
  }
  EXPECT_EQ(contentOf(disc(0.2f, 0.1f)).coverage.values, wanted.values); // none is black
  EXPECT_EQ(contentOf(disc(1, 0.6f)).coverage.values, disc(1, 0.6f).values);
  image::Image three = disc(1 / 255.f, 0);
  three.values[0] = 2 / 255.f;
  EXPECT_EQ(contentOf(three).coverage.values, three.values);
}

TEST(Masks, WithEdgesBetweenTwoLevelsAreMasks) {
  const auto withEdge = [](float level, int tenths) { // of the object's pixels
    image::Image mask = disc(level, 0);
    int object = 0;
    for (float& value : mask.values)
      if (value > 0 && object++ % 10 < tenths) value = level / 2;
    return mask;
  };
  EXPECT_EQ(contentOf(withEdge(0.8f, 1)).coverage.values, withEdge(1, 1).values);
  EXPECT_EQ(contentOf(withEdge(0.8f, 5)).white, 1); // as of glass
  EXPECT_EQ(contentOf(withEdge(0.4f, 1)).white, 1); // labels
  image::Image inexact = disc(0.78f, 0);            // as by JPEG
  for (size_t i = 0; i < inexact.values.size(); ++i) inexact.values[i] += 0.01f * static_cast<float>(i % 3);
  const MaskContent lossy = surflect::capture::contentOf(image::Picture{inexact, 8, false, {}}, true);
  EXPECT_NEAR(lossy.white, 0.79f, 0.005f);
  for (size_t i = 0; i < inexact.values.size(); ++i)
    EXPECT_NEAR(lossy.coverage.values[i], disc(1, 0).values[i], 0.03f);
}

TEST(Masks, OfLabelsThatAreAllOneAreFull) {
  const image::Image one = disc(1 / 255.f, 1 / 255.f), full = disc(1, 1);
  EXPECT_EQ(contentOf(one).coverage.values, full.values);
  const image::Image deep = disc(1 / 65535.f, 1 / 65535.f);
  EXPECT_EQ(contentOf(deep, 16).coverage.values, full.values);
  for (const float other : {0.f, 2 / 255.f, 0.5f}) EXPECT_EQ(contentOf(disc(other, other)).white, 1) << other;
  EXPECT_EQ(contentOf(one, 0).white, 1); // floating point
}

TEST(Masks, OfJpegHaveNoLabels) {
  using namespace std::string_literals;
  image::TemporaryFolder folder;
  std::string jpeg = image::grayJpeg(""); // the blocks become 0 and 1: differences of 8 bits and 1 bit
  jpeg.replace(jpeg.find("\0\x07"s), 2, "\x08\x01");
  jpeg.replace(jpeg.size() - 4, 2, "\x1f\xcd");
  image::writeBytes(folder / "m.JPG", jpeg);
  const MaskContent content = readMask(folder / "m.JPG");
  EXPECT_EQ(content.white, 1);
  EXPECT_EQ(content.coverage.at(0, 0)[0], 0);
  EXPECT_EQ(content.coverage.at(15, 7)[0], 1 / 255.f);
  EXPECT_EQ(surflect::capture::contentOf(image::readPicture(folder / "m.JPG")).white,
            1 / 255.f); // of a lossless file
}

TEST(Masks, WithAlphaAreCutOutsUnlessBlackAndWhite) {
  const image::Image alpha = disc(1, 0), black(kSide, kSide, 1),
                     photograph = image::randomImage(kSide, kSide, 1, 0.1f, 0.9f, 1);
  for (const image::Image& color : {black, photograph, disc(1, 0), disc(1, 1)})
    EXPECT_EQ(contentOf(joined(color, alpha)).coverage.values, alpha.values);
  image::Image left = disc(1, 1);
  for (int y = 0; y < kSide; ++y)
    for (int x = kSide / 2; x < kSide; ++x) left.at(x, y)[0] = 0;
  const MaskContent both = contentOf(joined(left, alpha)); // white and opaque
  for (size_t i = 0; i < both.coverage.values.size(); ++i)
    EXPECT_EQ(both.coverage.values[i], left.values[i] * alpha.values[i]);
}

TEST(Masks, AreResizedToPicturesOfTheirShapeByTheirMean) {
  image::TemporaryFolder folder;
  image::Image mask(8, 6, 1);
  mask.at(0, 0)[0] = mask.at(1, 0)[0] = mask.at(0, 1)[0] = mask.at(5, 5)[0] = 1;
  image::writePng(folder / "m.png", mask);
  const image::Image half = readCoverage(folder / "m.png", {4, 3});
  EXPECT_EQ(half.at(0, 0)[0], 0.75f);
  EXPECT_EQ(half.at(2, 2)[0], 0.25f);
  EXPECT_EQ(readCoverage(folder / "m.png", {16, 12}).at(11, 10)[0], 1);
  for (const image::PictureSize other :
       {image::PictureSize{8, 5}, image::PictureSize{7, 6}, image::PictureSize{4, 6}})
    EXPECT_NE(image::errorOf([&] { readCoverage(folder / "m.png", other); }).find("m.png: size: found 8 x 6"),
              std::string::npos);
  EXPECT_TRUE(isResized({4001, 3000}, {1000, 750}));
  EXPECT_TRUE(isResized({1001, 667}, {500, 333}));
  EXPECT_FALSE(isResized({1001, 667}, {1000, 667})); // a crop
}

class MaskSurveys : public ::testing::Test {
protected:
  MaskSurveys() { capture.file = folder / "transforms.json"; }

  void add(const std::optional<image::Image>& mask, int channels = 3) {
    const std::string number = std::to_string(capture.frames.size());
    capture.views.push_back({"C" + number, {{Lens::Model::pinhole, kSide, kSide, 20, 20, 10, 10}, {}}});
    Frame frame{.view = capture.frames.size(), .picture = "p" + number + ".png"};
    image::writePng(folder / frame.picture.string(), image::Image(kSide, kSide, channels));
    if (mask) {
      frame.mask = "m" + number + ".png";
      image::writePng(folder / frame.mask.string(), *mask);
    }
    capture.frames.push_back(frame);
  }
  std::vector<std::string> warnings(bool inverted = false) const {
    return surveyMasks(capture, inverted, {}).warnings;
  }

  image::TemporaryFolder folder;
  Capture capture;
};

TEST_F(MaskSurveys, FindNothingWhereMasksAreAsTheyShouldBe) {
  for (int i = 0; i < 3; ++i) add(disc(1, 0));
  add(disc(1, 1)); // the object fills the picture
  EXPECT_TRUE(warnings().empty());
  EXPECT_TRUE(surveyMasks(capture, false, {}).notes.empty());
}

TEST_F(MaskSurveys, CountViewsWithoutMaskOrAlphaBesideOthers) {
  add(disc(1, 0));
  add(std::nullopt);
  add(std::nullopt, 4);
  EXPECT_EQ(warnings(), (std::vector<std::string>{
                            "masks or alpha: 2 of 3 views; the other one shows all of its picture (C1)"}));
  capture.frames.erase(capture.frames.begin()); // the others have none
  capture.frames.erase(capture.frames.begin() + 1);
  capture.frames[0].view = 0;
  capture.views.resize(1);
  EXPECT_TRUE(warnings().empty());
}

TEST_F(MaskSurveys, TellEmptyMasksWithTheirLargestValue) {
  add(disc(1, 0));
  image::Image labels = disc(2 / 255.f, 0);
  labels.values[0] = 3 / 255.f;
  add(labels);
  ASSERT_EQ(warnings().size(), 1u);
  EXPECT_NE(warnings()[0].find("1 of 2 masks show nothing of the object"), std::string::npos);
  EXPECT_NE(warnings()[0].find("m1.png (20 x 20, values 0 to 3 of 255)"), std::string::npos) << warnings()[0];
  EXPECT_NE(describeFirstMatte(capture)->find("m0.png (20 x 20, values 0 to 255 of 255)"), std::string::npos);
}

TEST_F(MaskSurveys, DescribeAlphaOfLayers) {
  add(std::nullopt);
  Frame& frame = capture.frames[0];
  frame.picture = "p.exr";
  frame.layer = "beauty";
  const image::Image color(kSide, kSide, 3), clear(kSide, kSide, 1), alpha = disc(0.25f, 0);
  const image::ExrLayer layers[] = {{{"beauty.R", "beauty.G", "beauty.B"}, &color},
                                    {{"beauty.A"}, &clear},
                                    {{"matte.R", "matte.G", "matte.B"}, &color},
                                    {{"matte.A"}, &alpha}};
  image::writeExr(folder / "p.exr", layers);
  const std::string file = (folder / "p.exr").string();
  EXPECT_EQ(describeFirstMatte(capture), file + " (20 x 20, values 0 to 0, alpha 0 to 0)");
  frame.alphaLayer = "matte";
  EXPECT_EQ(describeFirstMatte(capture), file + " (20 x 20, values 0 to 0, alpha 0 to 0.25)");
}

TEST_F(MaskSurveys, TellMasksNoneOfWhichHasBackground) {
  for (int i = 0; i < 2; ++i) add(disc(1, 1));
  ASSERT_EQ(warnings().size(), 1u);
  EXPECT_EQ(warnings()[0].find("none of 2 masks shows any background"), 0u) << warnings()[0];
}

TEST_F(MaskSurveys, TellMasksWhoseBlackIsTheObject) {
  for (int i = 0; i < 3; ++i) add(disc(0, 1));
  ASSERT_EQ(warnings().size(), 1u);
  EXPECT_EQ(warnings()[0].find("masks look inverted"), 0u);
  EXPECT_NE(warnings()[0].find("--invert-masks"), std::string::npos);
  EXPECT_TRUE(warnings(true).empty());
}

// A close-up: the object leaves the picture on three sides, background shows at one and through a hole.
TEST_F(MaskSurveys, DoNotTakeCloseUpsForInverted) {
  image::Image closeUp = disc(1, 1);
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < 3; ++y) closeUp.at(x, y)[0] = 0;
  closeUp.at(10, 10)[0] = closeUp.at(11, 10)[0] = 0;
  for (int i = 0; i < 3; ++i) add(closeUp);
  EXPECT_TRUE(warnings().empty());
}

// One view under six lights, each photograph with a matte of its own.
TEST_F(MaskSurveys, TellPhotographsWhoseMatteIsNotThatOfTheirView) {
  const auto addOf = [&](const image::Image& mask) {
    add(mask);
    capture.frames.back().view = 0;
    capture.views.resize(1);
  };
  for (int i = 0; i < 4; ++i) addOf(disc(1, 0));
  EXPECT_TRUE(warnings().empty());
  addOf(disc(0, 0));
  image::Image half = disc(1, 0);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide / 2; ++x) half.at(x, y)[0] = 0;
  addOf(half);
  ASSERT_EQ(warnings().size(), 2u);
  EXPECT_NE(warnings()[1].find("of 6 mattes, some are not as those of the same view under other lights: 1 "
                               "empty (p4.png), 1 more than a tenth smaller (p5.png)"),
            std::string::npos)
      << warnings()[1];
}

TEST_F(MaskSurveys, NoteLabelsAndOtherSizes) {
  add(disc(1 / 255.f, 0));
  add(disc(1, 0, 2 * kSide));
  const MaskSurvey survey = surveyMasks(capture, false, {});
  EXPECT_TRUE(survey.warnings.empty());
  ASSERT_EQ(survey.notes.size(), 2u);
  EXPECT_EQ(
      survey.notes[0].find("1 of 2 masks have two levels, of which the brighter one is taken for the object"),
      0u);
  EXPECT_NE(survey.notes[1].find("m1.png (40 x 40 for 20 x 20)"), std::string::npos);
  const size_t frames[] = {0, 1};
  const auto photographs = readPhotographs(capture, frames);
  EXPECT_EQ(photographs[0].alpha.values, disc(1, 0).values);
  EXPECT_EQ(photographs[1].alpha.at(10, 10)[0], 1);
}

} // namespace
} // namespace surflect::capture
