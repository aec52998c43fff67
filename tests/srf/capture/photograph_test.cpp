#include "srf/capture/photograph.h"

#include "srf/capture/matte_vote.h"
#include "srf/capture/writer.h"
#include "srf/image/color.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"
#include "tests/srf/image/foreign_files.h"
#include "tests/support/color_files.h"

#include <Eigen/LU>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>

#include <limits>
#include <numeric>

namespace surflect::capture {
namespace {

constexpr int width = 12, height = 9;

class PhotographFile : public ::testing::Test {
protected:
  // A capture of one view; frames are appended by add().
  PhotographFile() {
    capture.file = folder / "transforms.json";
    capture.views = {{"C00", {{Lens::Model::pinhole, width, height, 10, 10, 6, 4.5}, {}}}};
  }

  Frame& add(const std::string& picture) {
    capture.frames.push_back({.view = 0, .picture = picture});
    return capture.frames.back();
  }
  std::vector<Photograph> readAll() const {
    std::vector<size_t> frames(capture.frames.size());
    std::iota(frames.begin(), frames.end(), size_t{0});
    return readPhotographs(capture, frames);
  }
  std::vector<float> firstRadiance() const { return readAll()[0].radiance.values; }
  void writeExrPicture(const image::Image& image) const {
    image::writeExr(folder / "a.exr", image, image::Precision::single);
  }

  image::TemporaryFolder folder;
  Capture capture;
};

image::Image constant(int channels, std::initializer_list<float> texel) {
  image::Image image(width, height, channels);
  for (size_t i = 0; i < image.values.size(); ++i) image.values[i] = texel.begin()[i % texel.size()];
  return image;
}

TEST_F(PhotographFile, LinearRadianceIsReadAsItIsNegativesIncluded) {
  const image::Image image = image::randomImage(width, height, 3, -1, 100, 1);
  writeExrPicture(image);
  add("a.exr");
  const Photograph photograph = readAll()[0];
  EXPECT_EQ(photograph.radiance.values, image.values);
  EXPECT_EQ(photograph.alpha.values, std::vector<float>(width * height, 1));
  EXPECT_FALSE(photograph.hasMatte);
  EXPECT_TRUE(photograph.invalidTexels.empty());
}

TEST_F(PhotographFile, GrayIsAllThreeChannels) {
  const image::Image image = image::randomImage(width, height, 1, 0, 1, 2);
  writeExrPicture(image);
  add("a.exr");
  const Photograph photograph = readAll()[0];
  for (size_t i = 0; i < photograph.radiance.values.size(); ++i)
    EXPECT_EQ(photograph.radiance.values[i], image.values[i / 3]);
}

TEST_F(PhotographFile, ExposureScalesRadianceDown) {
  writeExrPicture(image::randomImage(width, height, 3, 0, 1, 3));
  add("a.exr");
  add("a.exr").exposure = 4;
  const auto photographs = readAll();
  for (size_t i = 0; i < photographs[0].radiance.values.size(); ++i)
    EXPECT_EQ(photographs[0].radiance.values[i], 4 * photographs[1].radiance.values[i]);
}

TEST_F(PhotographFile, ABracketIsTheSceneWhereAnyExposureShowsIt) {
  // A linear camera that clips at 1 takes a scene of four decades.
  image::Image scene = image::randomImage(width, height, 3, -4, 4, 7);
  for (float& value : scene.values) value = std::exp(value);
  std::vector<Exposure> shots;
  for (const double seconds : {1., 0.015625, 0.125, 8.}) {
    image::Image picture = scene;
    for (float& value : picture.values) value = std::min(1.f, value * static_cast<float>(seconds));
    shots.push_back({"shot" + std::to_string(shots.size()) + ".exr", "", "", seconds});
    image::writeExr(folder / shots.back().picture, picture, image::Precision::single);
  }
  add("shot0.exr").further.assign(shots.begin() + 1, shots.end());
  add("shot1.exr").exposure = shots[1].exposure; // alone, beside its bracket
  const auto photographs = readAll();
  for (size_t i = 0; i < scene.values.size(); ++i) {
    EXPECT_NEAR(photographs[0].radiance.values[i], scene.values[i], 1e-6f * scene.values[i]);
    EXPECT_EQ(photographs[1].radiance.values[i], scene.values[i]); // by a power of two
  }
}

TEST_F(PhotographFile, ABracketOfLayersOrOfMasksIsOneToo) {
  const image::Image scene = image::randomImage(width, height, 3, 0.1f, 0.9f, 8);
  image::Image half = scene;
  for (float& value : half.values) value /= 2;
  const RadianceLayer layers[] = {{"full", &scene}, {"half", &half}};
  image::Image alpha = constant(1, {0.75f});
  alpha.at(1, 1)[0] = 0;
  writeViewPictures(folder / "a.exr", layers, &alpha, "matte", image::Precision::single);
  Frame& frame = add("a.exr");
  frame.layer = "full";
  frame.alphaLayer = "matte";
  frame.further = {{"a.exr", "half", "matte", 0.5}};
  frame.mask = "m.png";
  image::writePng(folder / "m.png", constant(1, {0.2f}));
  const Photograph photograph = readAll()[0];
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool gone = x == 1 && y == 1;
      EXPECT_NEAR(photograph.alpha.at(x, y)[0], gone ? 0 : 0.15f, 1e-7f);
      for (size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(photograph.radiance.at(x, y)[c], gone ? 0 : scene.at(x, y)[c], 1e-6f);
    }
  EXPECT_TRUE(photograph.invalidTexels.empty());
}

TEST_F(PhotographFile, WhatOneExposureLacksAnotherHas) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  image::Image a = constant(3, {0.5f, 0.5f, 0.5f}), b = a;
  a.at(1, 1)[0] = nan;
  a.at(2, 2)[1] = b.at(2, 2)[1] = nan;
  image::writeExr(folder / "a.exr", a, image::Precision::single);
  image::writeExr(folder / "b.exr", b, image::Precision::single);
  add("a.exr").further = {{"b.exr", "", "", 2}};
  const Photograph photograph = readAll()[0];
  EXPECT_EQ(photograph.invalidTexels, std::vector<size_t>{2 * width + 2});
  EXPECT_EQ(photograph.radiance.at(1, 1)[0], 0.25f);
  EXPECT_EQ(photograph.radiance.at(2, 2)[0], 0);
}

TEST_F(PhotographFile, AResponseCurveSaysWhatCodesMean) {
  capture.response.emplace();
  for (size_t c = 0; c < 3; ++c)
    for (size_t z = 0; z < image::Response::codes; ++z)
      capture.response->exposure[c][z] = static_cast<float>((c + 1) * z * z);
  image::Image codes(width, height, 3);
  for (size_t i = 0; i < codes.values.size(); ++i) codes.values[i] = static_cast<float>(i % 256) / 255;
  image::writePng(folder / "a.png", codes);
  add("a.png").exposure = 2;
  const Photograph photograph = readAll()[0];
  for (size_t i = 0; i < codes.values.size(); ++i) {
    const auto z = static_cast<float>(i % 256), expected = (static_cast<float>(i % 3) + 1) * z * z / 2;
    EXPECT_NEAR(photograph.radiance.values[i], expected, 1e-4f * (1 + expected));
  }
  image::writePng(folder / "a.png", codes, 16);
  EXPECT_NE(
      image::errorOf([&] { readAll(); }).find("a.png: found 16 bits, expected 8 bits, as the capture has a"),
      std::string::npos);
  writeExrPicture(codes);
  capture.frames[0].picture = "a.exr";
  EXPECT_NE(image::errorOf([&] { readAll(); }).find("a.exr: found floating point, expected 8 bits"),
            std::string::npos);
}

TEST_F(PhotographFile, EightBitsAreSrgbAndSixteenLinearUnlessStated) {
  const image::Image image = constant(3, {0.2f, 0.6f, 1});
  image::writePng(folder / "a.png", image, 8);
  image::writePng(folder / "b.png", image, 16);
  add("a.png");
  add("b.png");
  for (const auto stated :
       {std::optional<ColorSpace>(), std::optional(ColorSpace::srgb), std::optional(ColorSpace::linear)}) {
    capture.colorSpace = stated;
    const auto photographs = readAll();
    for (size_t p = 0; p < 2; ++p)
      for (size_t i = 0; i < image.values.size(); ++i) {
        const bool srgb = stated ? *stated == ColorSpace::srgb : p == 0;
        EXPECT_FLOAT_EQ(photographs[p].radiance.values[i],
                        srgb ? image::linearFromSrgb(image.values[i]) : image.values[i]);
      }
  }
}

// Colours within both gamuts, in linear light of other primaries.
image::Image inPrimaries(const image::Image& rec709, const image::Primaries& primaries) {
  const Mat3<float> matrix = image::rec709From(primaries).inverse().cast<float>();
  image::Image other = rec709;
  for (size_t i = 0; i < other.values.size(); i += 3) {
    Eigen::Map<Vec3<float>> color(&other.values[i]);
    color = (matrix * color).eval();
  }
  return other;
}

void writeWithChromaticities(const std::filesystem::path& path, const image::Image& image,
                             const image::Primaries& primaries) {
  const auto at = [](const image::Chromaticity& c) {
    return Imath::V2f(static_cast<float>(c.x), static_cast<float>(c.y));
  };
  Imf::Header header(image.width, image.height);
  Imf::addChromaticities(header,
                         {at(primaries.red), at(primaries.green), at(primaries.blue), at(primaries.white)});
  Imf::FrameBuffer pixels;
  for (size_t c = 0; c < 3; ++c) {
    const std::string name(1, "RGB"[c]);
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    auto* const first = reinterpret_cast<char*>(const_cast<float*>(&image.values[c]));
    pixels.insert(name, Imf::Slice(Imf::FLOAT, first, 12, 12 * static_cast<size_t>(image.width)));
  }
  Imf::OutputFile file(path.c_str(), header);
  file.setFrameBuffer(pixels);
  file.writePixels(image.height);
}

TEST_F(PhotographFile, PicturesOfOtherPrimariesBecomeRec709) {
  const image::Image scene = image::randomImage(width, height, 3, 0.2f, 0.8f, 21);
  writeWithChromaticities(folder / "a.exr", inPrimaries(scene, image::kAcesCg), image::kAcesCg);
  add("a.exr");
  for (size_t i = 0; const float value : firstRadiance()) EXPECT_NEAR(value, scene.values[i++], 1e-6f);
  capture.colorSpace = ColorSpace::linear; // which overrules the file
  EXPECT_EQ(readAll()[0].radiance.values, inPrimaries(scene, image::kAcesCg).values);
}

TEST_F(PhotographFile, AFileSaysWhatItsCodesMean) {
  const image::Image codes = constant(3, {0.2f, 0.6f, 1});
  image::writePng(folder / "plain.png", codes, 16);
  const std::string plain = readFile(folder / "plain.png");
  add("a.png");
  const auto radiance = [&](const std::string& file) {
    image::writeBytes(folder / "a.png", file);
    return firstRadiance();
  };
  for (size_t i = 0; const float value : radiance(withChunk(plain, "sRGB", "\1")))
    EXPECT_FLOAT_EQ(value, image::linearFromSrgb(codes.values[i++]));
  const std::string gamma2 = withChunk(plain, "gAMA", gamaContent(0.5));
  for (size_t i = 0; const float value : radiance(gamma2))
    EXPECT_NEAR(value, std::pow(codes.values[i++], 2), 1e-6f);
  const std::string adobe =
      withChunk(plain, "iCCP", iccpContent(profileBytes(image::kAdobeRgb, ProfileCurve::linear)));
  const Vec3<float> expected = image::rec709From(image::kAdobeRgb).cast<float>() * Vec3<float>(0.2f, 0.6f, 1);
  for (size_t i = 0; const float value : radiance(adobe)) EXPECT_NEAR(value, expected[i++ % 3], 3e-5f);
  capture.colorSpace = ColorSpace::srgb;
  for (size_t i = 0; const float value : radiance(adobe))
    EXPECT_FLOAT_EQ(value, image::linearFromSrgb(codes.values[i++]));
}

TEST_F(PhotographFile, AStatementThatCannotBeUnderstoodIsRefusedUnlessOverruled) {
  image::writePng(folder / "plain.png", constant(3, {0.2f, 0.6f, 1}));
  image::writeBytes(folder / "a.png", withChunk(readFile(folder / "plain.png"), "cICP", {9, 16, 0, 1}));
  add("a.png");
  EXPECT_EQ(image::errorOf([&] { readAll(); }).substr((folder / "a.png").string().size()),
            ": PNG cICP chunk: the curve is PQ, which is not supported; color_space of the capture, linear "
            "or srgb, "
            "would overrule it (import: --color-space)");
  capture.colorSpace = ColorSpace::srgb;
  EXPECT_FLOAT_EQ(readAll()[0].radiance.values[0], image::linearFromSrgb(0.2f));
}

TEST_F(PhotographFile, PremultipliedCodesAreDividedBeforeAProfileDecodesThem) {
  std::string pixels;
  for (int i = 0; i < width * height; ++i) pixels += "\x40\x20\x10\x80";
  const auto decodedAs = [&](uint32_t kind) {
    image::writeBytes(folder / "a.tif",
                      image::tiffFile({.width = width,
                                       .height = height,
                                       .channels = 4,
                                       .extraSample = kind,
                                       .pixels = pixels,
                                       .iccProfile = profileBytes(image::kRec709, ProfileCurve::srgb)}));
    return firstRadiance();
  };
  add("a.tif");
  for (size_t i = 0; const float value : decodedAs(1))
    EXPECT_NEAR(value, image::linearFromSrgb(0.5f / static_cast<float>(1 << i++ % 3)), 1e-5f);
  for (size_t i = 0; const float value : decodedAs(2))
    EXPECT_NEAR(value, image::linearFromSrgb(64.f / 255 / static_cast<float>(1 << i++ % 3)), 1e-5f);
}

TEST_F(PhotographFile, ABracketIsMergedInItsOwnPrimaries) {
  const image::Image scene = image::randomImage(width, height, 3, 0.05f, 0.9f, 22),
                     stored = inPrimaries(scene, image::kDisplayP3);
  image::Image longer = stored;
  for (float& value : longer.values) value = std::min(1.f, 2 * value); // clipped where that is above 1/2
  writeWithChromaticities(folder / "a.exr", stored, image::kDisplayP3);
  writeWithChromaticities(folder / "b.exr", longer, image::kDisplayP3);
  add("a.exr").further = {{"b.exr", "", "", 2}};
  for (size_t i = 0; const float value : firstRadiance()) EXPECT_NEAR(value, scene.values[i++], 1e-6f);
  writeWithChromaticities(folder / "b.exr", longer, image::kRec2020);
  EXPECT_NE(image::errorOf([&] {
              readAll();
            }).find("a.exr: found different ones, expected one statement of primaries"),
            std::string::npos);
}

// Linear codes of Adobe RGB's primaries. The longer exposure clips green alone, of which red and blue of
// Rec. 709 have a part.
TEST_F(PhotographFile, ABracketWithProfilesIsMergedWhereNoChannelClips) {
  const image::Image stored = constant(3, {0.25f, 0.75f, 0.125f});
  image::Image longer = stored;
  for (float& value : longer.values) value = std::min(1.f, 2 * value);
  const std::string profile = iccpContent(profileBytes(image::kAdobeRgb, ProfileCurve::linear));
  for (const auto& [name, codes] : {std::pair{"a.png", &stored}, {"b.png", &longer}}) {
    image::writePng(folder / name, *codes, 16);
    image::writeBytes(folder / name, withChunk(readFile(folder / name), "iCCP", profile));
  }
  add("a.png").further = {{"b.png", "", "", 2}};
  const Vec3<float> expected =
      image::rec709From(image::kAdobeRgb).cast<float>() * Vec3<float>(0.25f, 0.75f, 0.125f);
  for (size_t i = 0; const float value : firstRadiance()) EXPECT_NEAR(value, expected[i++ % 3], 4e-5f);
}

// Masks are values, no colours.
TEST_F(PhotographFile, WhatAMaskSaysOfColoursDoesNotCount) {
  writeExrPicture(constant(3, {1, 1, 1}));
  image::writePng(folder / "plain.png", constant(1, {0.6f}));
  image::writeBytes(folder / "m.png", withChunk(readFile(folder / "plain.png"), "gAMA", gamaContent(0.25)));
  add("a.exr").mask = "m.png";
  EXPECT_EQ(readAll()[0].alpha.values, constant(1, {0.6f}).values);
}

TEST_F(PhotographFile, PremultipliedColoursAreDividedByAlphaAndStraightOnesNot) {
  capture.colorSpace = ColorSpace::linear;
  writeExrPicture(constant(4, {0.1f, 0.2f, 0.3f, 0.5f}));
  image::writePng(folder / "a.png", constant(4, {0.2f, 0.4f, 0.6f, 0.2f}));
  add("a.exr");
  add("a.png");
  const auto photographs = readAll();
  EXPECT_EQ(photographs[0].radiance.values, constant(3, {0.2f, 0.4f, 0.6f}).values);
  EXPECT_EQ(photographs[1].radiance.values, constant(3, {0.2f, 0.4f, 0.6f}).values);
  EXPECT_EQ(photographs[0].alpha.values, constant(1, {0.5f}).values);
  EXPECT_EQ(photographs[1].alpha.values, constant(1, {0.2f}).values);
  EXPECT_TRUE(photographs[0].hasMatte && photographs[1].hasMatte);
}

TEST_F(PhotographFile, AlphaThatOvershootsKeepsThePremultipliedColour) {
  capture.colorSpace = ColorSpace::linear;
  writeExrPicture(constant(4, {0.1f, 0.2f, 0.3f, 1.125f}));
  add("a.exr");
  const Photograph photograph = readAll()[0];
  EXPECT_EQ(photograph.radiance.values, constant(3, {0.1f, 0.2f, 0.3f}).values);
  EXPECT_EQ(photograph.alpha.values, constant(1, {1}).values);
}

TEST_F(PhotographFile, AlphaOfAnotherScaleIsAnErrorThatNamesAPixel) {
  for (const float wrong : {1.5f, -0.5f, 255.f}) {
    image::Image image = constant(4, {0.1f, 0.2f, 0.3f, 1});
    image.at(2, 1)[3] = wrong;
    writeExrPicture(image);
    add("a.exr");
    const std::string error = image::errorOf([&] { readAll(); });
    EXPECT_NE(error.find("a.exr: alpha: found " + numberText(static_cast<double>(wrong)) +
                         " at pixel (2, 1), expected 0 to 1"),
              std::string::npos)
        << error;
    capture.frames.clear();
  }
}

TEST_F(PhotographFile, NothingIsSeenWhereAlphaIsZero) {
  image::Image image = image::randomImage(width, height, 4, 0.5f, 1, 4);
  for (size_t i = 0; i < image.values.size(); i += 8) image.values[i + 3] = i % 16 ? 0.f : -0.25f;
  writeExrPicture(image);
  add("a.exr");
  const Photograph photograph = readAll()[0];
  EXPECT_TRUE(photograph.invalidTexels.empty());
  for (size_t i = 0; i < photograph.alpha.values.size(); ++i) {
    EXPECT_EQ(photograph.alpha.values[i] == 0, i % 2 == 0);
    EXPECT_EQ(photograph.radiance.values[3 * i] == 0, i % 2 == 0);
  }
}

TEST_F(PhotographFile, TexelsThatAreNoNumbersAreBlackAndListed) {
  image::Image image = constant(4, {1, 2, 3, 1});
  image.at(2, 3)[1] = std::numeric_limits<float>::quiet_NaN();
  image.at(4, 3)[0] = std::numeric_limits<float>::infinity();
  image.at(5, 5)[3] = std::numeric_limits<float>::quiet_NaN();
  writeExrPicture(image);
  add("a.exr");
  const Photograph photograph = readAll()[0];
  EXPECT_EQ(photograph.invalidTexels, (std::vector<size_t>{3 * width + 2, 3 * width + 4, 5 * width + 5}));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool bad = (y == 3 && (x == 2 || x == 4)) || (x == 5 && y == 5);
      EXPECT_EQ(photograph.radiance.at(x, y)[2], bad ? 0 : 3);
    }
}

TEST_F(PhotographFile, AMaskScalesAlphaButNotRadiance) {
  writeExrPicture(constant(4, {0.1f, 0.2f, 0.3f, 0.5f}));
  image::Image mask = constant(1, {1});
  mask.at(0, 0)[0] = 0;
  mask.at(1, 0)[0] = 0.2f;
  image::writePng(folder / "gray.png", mask);
  image::Image transparent = constant(4, {1, 1, 1, 1});
  for (size_t i = 0; i < mask.values.size(); ++i) transparent.values[4 * i + 3] = mask.values[i];
  image::writePng(folder / "rgba.png", transparent);
  for (const char* name : {"gray.png", "rgba.png"}) add("a.exr").mask = name;
  for (const Photograph& photograph : readAll()) {
    EXPECT_TRUE(photograph.hasMatte);
    EXPECT_EQ(photograph.alpha.at(0, 0)[0], 0);
    EXPECT_NEAR(photograph.alpha.at(1, 0)[0], 0.1f, 1e-8f);
    EXPECT_NEAR(photograph.alpha.at(2, 0)[0], 0.5f, 3e-8f);
    EXPECT_EQ(photograph.radiance.at(0, 0)[0], 0);
    EXPECT_EQ(photograph.radiance.at(1, 0)[0], 0.2f);
  }
}

TEST_F(PhotographFile, LayersWrittenForAViewComeBack) {
  image::Image alpha = image::randomImage(width, height, 1, 0.1f, 1, 5);
  alpha.at(3, 3)[0] = 0;
  std::vector<image::Image> images;
  std::vector<RadianceLayer> layers;
  for (unsigned l = 0; l < 5; ++l) {
    images.push_back(image::randomImage(width, height, 3, 0, 5, 10 + l));
    std::fill_n(images[l].at(3, 3).begin(), 3, 0.f);
  }
  for (size_t l = 0; l < images.size(); ++l) layers.push_back({"Combined_L" + std::to_string(l), &images[l]});
  for (const image::Precision precision : {image::Precision::single, image::Precision::half}) {
    writeViewPictures(folder / "view.exr", layers, &alpha, "Combined", precision);
    capture.frames.clear();
    for (const auto& layer : layers) {
      Frame& frame = add("view.exr");
      frame.layer = layer.layer;
      frame.alphaLayer = "Combined";
    }
    const auto photographs = readAll();
    const float relative = precision == image::Precision::half ? 1.1e-3f : 1.3e-7f; // of colour, and of alpha
    for (size_t l = 0; l < images.size(); ++l)
      for (size_t i = 0; i < images[l].values.size(); ++i)
        EXPECT_NEAR(photographs[l].radiance.values[i], images[l].values[i],
                    relative * images[l].values[i] + 1e-6f);
  }
}

TEST_F(PhotographFile, WithoutAlphaFloatLayersComeBackExactly) {
  const image::Image image = image::randomImage(width, height, 3, -1, 5, 6);
  const RadianceLayer layer{"", &image};
  writeViewPictures(folder / "view.exr", std::span(&layer, 1), nullptr, "", image::Precision::single);
  add("view.exr");
  EXPECT_EQ(readAll()[0].radiance.values, image.values);
}

TEST_F(PhotographFile, PhotographsComeInTheOrderAskedFor) {
  std::vector<image::Image> images;
  std::vector<RadianceLayer> layers;
  for (unsigned l = 0; l < 4; ++l) images.push_back(image::randomImage(width, height, 3, 0, 1, l));
  for (size_t l = 0; l < 3; ++l) layers.push_back({"L" + std::to_string(l), &images[l]});
  writeViewPictures(folder / "view.exr", layers);
  writeExrPicture(images[3]);
  for (const auto& layer : layers) add("view.exr").layer = layer.layer;
  add("a.exr");
  const std::vector<size_t> order{3, 1, 2, 0, 1};
  const auto together = readPhotographs(capture, order);
  ASSERT_EQ(together.size(), order.size());
  for (size_t i = 0; i < order.size(); ++i)
    EXPECT_EQ(together[i].radiance.values,
              readPhotographs(capture, std::span(&order[i], 1))[0].radiance.values);
  EXPECT_EQ(together[0].radiance.values, images[3].values);
  EXPECT_NE(together[1].radiance.values, together[2].radiance.values);
}

// Twenty files with masks of their own, some of them wrong somewhere.
TEST_F(PhotographFile, PhotographsOfAViewShareOneMatte) {
  for (unsigned i = 0; i < 20; ++i) {
    const std::string name = std::to_string(i);
    image::Image picture = image::randomImage(width, height, 4, 0, 1, i);
    if (i % 7 == 0) picture.values[4 * i] = std::numeric_limits<float>::quiet_NaN();
    image::writeExr(folder / (name + ".exr"), picture, image::Precision::single);
    image::writePng(folder / (name + ".png"), image::randomImage(width, height, 1, 0.2f, 1, 100 + i));
    add(name + ".exr").mask = name + ".png";
  }
  const std::vector<Photograph> photographs = readAll();
  std::vector<size_t> frames(photographs.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  const ViewPhotographs view = readViewPhotographs(capture, frames);
  EXPECT_TRUE(view.hasMatte);
  ASSERT_EQ(view.radiance.size(), photographs.size());
  size_t invalid = 0;
  MatteVote vote(photographs.size());
  for (size_t i = 0; i < photographs.size(); ++i) {
    for (size_t v = 0; v < view.radiance[i].values.size(); ++v)
      if (photographs[i].alpha.values[v / 3] > 0) // elsewhere the view's matte may show the object
        EXPECT_EQ(view.radiance[i].values[v], photographs[i].radiance.values[v]) << i;
    invalid += photographs[i].invalidTexels.size();
    vote.add(photographs[i].alpha);
  }
  EXPECT_EQ(view.alpha.values, vote.outcome().values);
  EXPECT_EQ(view.invalidTexels, invalid);
  EXPECT_EQ(invalid, 3u);

  EXPECT_TRUE(readViewPhotographs(capture, {}).radiance.empty());
}

TEST_F(PhotographFile, RowsOfAViewAreThoseOfTheWhole) {
  for (unsigned i = 0; i < 9; ++i) {
    const std::string name = std::to_string(i);
    image::writeExr(folder / (name + ".exr"), image::randomImage(width, height, 4, 0, 1, i),
                    image::Precision::single);
    image::writePng(folder / (name + ".png"), image::randomImage(width, height, 1, 0, 1, 100 + i));
    add(name + ".exr").mask = name + ".png";
  }
  std::vector<size_t> frames(capture.frames.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  const ViewPhotographs whole = readViewPhotographs(capture, frames);
  const std::optional<image::Image> matte = readViewMatte(capture, frames);
  ASSERT_TRUE(matte);
  EXPECT_EQ(matte->values, whole.alpha.values);
  const int top = height / 3;
  const ViewPhotographs rows = readViewPart(capture, frames, {.top = top, .rows = 2, .matte = &*matte});
  const ViewPhotographs half = readViewPart(capture, frames, {.shrink = 2, .matte = &*matte});
  EXPECT_EQ(half.alpha.width, (width + 1) / 2);
  for (size_t i = 0; i < frames.size(); ++i)
    for (int y = 0; y < 2; ++y)
      for (int x = 0; x < width; ++x) {
        EXPECT_EQ(rows.alpha.at(x, y)[0], matte->at(x, top + y)[0]);
        if (matte->at(x, top + y)[0] < 1 / 16.f) continue;
        for (size_t c = 0; c < 3; ++c)
          EXPECT_EQ(rows.radiance[i].at(x, y)[c], whole.radiance[i].at(x, top + y)[c]) << i;
      }
  float color = 0, alpha = 0; // of the first texel of half the size
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 2; ++x) {
      color += matte->at(x, y)[0] * readViewPart(capture, frames, {.matte = &*matte}).radiance[0].at(x, y)[1];
      alpha += matte->at(x, y)[0];
    }
  EXPECT_FLOAT_EQ(half.alpha.at(0, 0)[0], alpha / 4);
  EXPECT_NEAR(half.radiance[0].at(0, 0)[1], color / alpha, 1e-6);
}

TEST_F(PhotographFile, MattesOfMasksAloneNeedNoPictures) {
  for (unsigned i = 0; i < 9; ++i) {
    const std::string name = std::to_string(i);
    image::writePng(folder / (name + ".png"), image::randomImage(width, height, 3, 0, 1, i));
    image::writePng(folder / (name + ".mask.png"), image::randomImage(width, height, 1, 0, 1, 100 + i));
    add(name + ".png").mask = name + ".mask.png";
  }
  std::vector<size_t> frames(capture.frames.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  const image::Image truth = readViewPhotographs(capture, frames).alpha;
  for (unsigned i = 0; i < 9; ++i) { // of which only the header is whole
    const auto path = folder / (std::to_string(i) + ".png");
    image::writeBytes(path, readFile(path).substr(0, 60));
  }
  const std::optional<image::Image> matte = readViewMatte(capture, frames);
  ASSERT_TRUE(matte);
  EXPECT_EQ(matte->values, truth.values);
}

TEST_F(PhotographFile, PicturesWithoutMattesHaveNone) {
  image::writePng(folder / "a.png", constant(3, {0.5f, 0.5f, 0.5f}));
  add("a.png");
  const std::vector<size_t> frames{0};
  EXPECT_FALSE(readViewMatte(capture, frames));
  const ViewPhotographs view = readViewPart(capture, frames, {.shrink = 4});
  EXPECT_FALSE(view.hasMatte);
  for (const float alpha : view.alpha.values) EXPECT_EQ(alpha, 1);
}

// A matting program that found nothing in one photograph has left the colours beneath.
TEST_F(PhotographFile, StraightColoursBeneathAnEmptyMatteCount) {
  image::Image picture = image::randomImage(width, height, 4, 0.2f, 1, 8);
  for (size_t i = 3; i < picture.values.size(); i += 4) picture.values[i] = i < 100 ? 0.f : 1.f;
  image::writePng(folder / "whole.png", picture);
  for (size_t i = 3; i < picture.values.size(); i += 4) picture.values[i] = 0;
  image::writePng(folder / "empty.png", picture);
  for (const char* name : {"whole.png", "empty.png", "whole.png"}) add(name);
  const std::vector<size_t> frames{0, 1, 2};
  const ViewPhotographs view = readViewPhotographs(capture, frames);
  EXPECT_EQ(view.alpha.values, readAll()[0].alpha.values);
  EXPECT_EQ(view.radiance[1].values, view.radiance[0].values);
  EXPECT_EQ(view.radiance[2].values, view.radiance[0].values);
}

TEST_F(PhotographFile, AFewCodesOfAlphaAreNothingAndFloatsMeanWhatTheySay) {
  image::Image picture = constant(4, {0.5f, 0.5f, 0.5f, 254.f / 255});
  for (int x = 0; x < 4; ++x) picture.at(x, 0)[3] = static_cast<float>(x) / 255;
  image::writePng(folder / "a.png", picture);
  writeExrPicture(picture);
  image::writePng(folder / "mask.png", constant(1, {1}));
  add("a.png");
  add("a.exr").mask = "mask.png";
  add("a.exr");
  const std::vector<Photograph> photographs = readAll();
  for (int x = 0; x < width; ++x) {
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(photographs[i].alpha.at(x, 0)[0], x < 4 ? 0 : 1) << i;
      EXPECT_EQ(photographs[i].radiance.at(x, 0)[0] > 0, x >= 4) << i;
    }
    EXPECT_EQ(photographs[2].alpha.at(x, 0)[0], picture.at(x, 0)[3]);
  }
}

TEST_F(PhotographFile, WhatDoesNotFitIsNamed) {
  image::writeExr(folder / "a.exr", image::Image(width + 1, height, 3));
  add("a.exr");
  EXPECT_NE(image::errorOf([&] { readAll(); }).find("a.exr: size: found 13 x 9, expected 12 x 9"),
            std::string::npos);
  image::writeExr(folder / "a.exr", image::Image(width, height, 3));
  capture.frames[0].mask = "m.png";
  image::writePng(folder / "m.png", image::Image(height, width, 1));
  EXPECT_NE(image::errorOf([&] { readAll(); }).find("m.png: size: found 9 x 12"), std::string::npos);
  capture.frames[0].mask = "";
  capture.frames[0].layer = "diffuse";
  EXPECT_NE(image::errorOf([&] { readAll(); }).find("a.exr: layer diffuse: "), std::string::npos);
  capture.frames[0] = {.picture = "a.exr", .alphaLayer = "matte"};
  EXPECT_NE(image::errorOf([&] { readAll(); }).find("a.exr: layer matte: "), std::string::npos);
  image::writePng(folder / "a.png", image::Image(width, height, 3));
  capture.frames[0] = {.picture = "a.png", .layer = "diffuse"};
  EXPECT_NE(image::errorOf([&] { readAll(); }).find("a.png: layer diffuse: only .exr"), std::string::npos);
}

} // namespace
} // namespace surflect::capture
