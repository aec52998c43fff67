#include "srf/image/color.h"

#include "srf/image/icc.h"
#include "tests/srf/image/files.h"
#include "tests/support/color_files.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace surflect::image {

namespace {

TEST(Color, SrgbCurveAndItsInverseCancel) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1, 8);
  for (int i = 0; i < 100000; ++i) {
    const float x = value(random);
    EXPECT_NEAR(srgbFromLinear(linearFromSrgb(x)), x, 3.6e-7f * std::max(1.f, std::abs(x)));
    EXPECT_NEAR(linearFromSrgb(srgbFromLinear(x)), x, 5.9e-7f * std::max(1.f, std::abs(x)));
  }
}

TEST(Color, SrgbBytesAreTheNearestToTheCurve) {
  const SrgbBytes bytes;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> value(0, 1), exponent(-20, 0);
  const auto expectNearest = [&](float x) {
    ASSERT_EQ(bytes(x), std::lround(255 * srgbFromLinear(x))) << std::hexfloat << x;
  };
  for (int i = 0; i < 100000; ++i) {
    expectNearest(value(random));
    expectNearest(std::exp2(exponent(random)));
  }
  for (int byte = 0; byte < 255; ++byte) { // about the thresholds
    float x = linearFromSrgb((static_cast<float>(byte) + 0.5f) / 255);
    for (int i = 0; i < 8; ++i) x = std::nextafter(x, 0.f);
    for (int i = 0; i < 16; ++i, x = std::nextafter(x, 1.f)) expectNearest(x);
  }
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(bytes(-1), 0);
  EXPECT_EQ(bytes(0), 0);
  EXPECT_EQ(bytes(1), 255);
  EXPECT_EQ(bytes(infinity), 255);
  EXPECT_EQ(bytes(std::numeric_limits<float>::quiet_NaN()), 0);
}

TEST(Color, SrgbCurveKeepsBlackAndWhite) {
  EXPECT_EQ(linearFromSrgb(0), 0);
  EXPECT_FLOAT_EQ(linearFromSrgb(1), 1);
  EXPECT_NEAR(linearFromSrgb(0.5f), 0.2140f, 5e-5f); // the standard's middle grey
}

TEST(Color, SrgbCurveRisesWithoutAStep) {
  for (int i = 0; i < 10000; ++i) {
    const float x = static_cast<float>(i) / 10000, next = static_cast<float>(i + 1) / 10000;
    EXPECT_LT(linearFromSrgb(x), linearFromSrgb(next));
    EXPECT_LT(linearFromSrgb(next) - linearFromSrgb(x), 2.4e-4f); // slope of at most 2.28
  }
}

TEST(Color, LumaOfGrayIsTheGray) {
  for (float gray = 0; gray < 10; gray += 0.37f) EXPECT_FLOAT_EQ(luma({gray, gray, gray}), gray);
}

} // namespace

namespace {

const Primaries kSpaces[] = {kRec709, kAdobeRgb, kDisplayP3, kRec2020, kAces, kAcesCg};

TEST(ColorEncoding, Rec709IsTheWorkingSpace) {
  EXPECT_EQ(rec709From(kRec709), Mat3<double>::Identity());
  Primaries rounded = kRec709;
  rounded.white = {0.31271, 0.32902};
  EXPECT_EQ(rec709From(rounded), Mat3<double>::Identity());
  Mat3<double> standard; // [IEC 61966-2-1, 5.3], to its four digits
  standard << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505;
  EXPECT_LT((xyzFromRgb(kRec709) - standard).cwiseAbs().maxCoeff(), 6e-5);
}

TEST(ColorEncoding, WhiteBecomesWhiteAndGrayStaysGray) {
  for (const Primaries& space : kSpaces)
    EXPECT_LT((rec709From(space) * Vec3<double>::Ones() - Vec3<double>::Ones()).norm(), 2e-15);
}

TEST(ColorEncoding, ConversionsCancel) {
  for (const Primaries& space : kSpaces) {
    const Mat3<double> there = rec709From(space), back = xyzFromRgb(space).inverse() *
                                                         adaptation(kD65, space.white) * xyzFromRgb(kRec709);
    EXPECT_LT((there * back - Mat3<double>::Identity()).norm(), 1.5e-15);
  }
}

TEST(ColorEncoding, AcescgIsThePublishedMatrix) {
  Mat3<double> published; // [ACES CTL, ACEScg to Rec. 709 with Bradford], to its digits
  published << 1.7050510, -0.6217921, -0.0832589, -0.1302564, 1.1408047, -0.0105483, -0.0240034, -0.1289690,
      1.1529724;
  EXPECT_LT((rec709From(kAcesCg) - published).cwiseAbs().maxCoeff(), 1.3e-7);
}

TEST(ColorEncoding, PrimariesThatSpanNoColoursAreRefused) {
  const Chromaticity zero{};
  for (const Primaries& wrong : {Primaries{}, Primaries{kD65, kD65, kD65, kD65},
                                 Primaries{kRec709.red, kRec709.green, kRec709.blue, zero},
                                 Primaries{kRec709.red, kRec709.green, kRec709.blue, {0.7, 0.2}}})
    EXPECT_NE(errorOf([&] { xyzFromRgb(wrong); }).find("primaries"), std::string::npos);
}

TEST(ColorEncoding, CurvesAreThoseOfTheirStandards) {
  using Curve = Transfer::Curve;
  EXPECT_EQ(linearised({Curve::linear}, 0.3f), 0.3f);
  EXPECT_EQ(linearised({Curve::srgb}, 0.3f), linearFromSrgb(0.3f));
  EXPECT_FLOAT_EQ(linearised({Curve::gamma, 2}, 0.5f), 0.25f);
  EXPECT_FLOAT_EQ(linearised({Curve::gamma, 2}, -0.5f), -0.25f);
  EXPECT_FLOAT_EQ(linearised({Curve::srgb}, -0.5f), -0.5f / 12.92f);
  EXPECT_FLOAT_EQ(linearised({Curve::bt709}, -0.5f), -0.5f / 4.5f);
  EXPECT_NEAR(linearised({Curve::bt709}, 0.4090f), 0.18f, 1.2e-5f); // mid gray
  EXPECT_NEAR(linearised({Curve::bt709}, 0.0405f), 0.009f, 1e-7f);
  for (const Curve curve : {Curve::linear, Curve::srgb, Curve::bt709, Curve::gamma}) {
    EXPECT_NEAR(linearised({curve, 1.8}, 0), 0, 1e-7f);
    EXPECT_NEAR(linearised({curve, 1.8}, 1), 1, 1e-6f);
    EXPECT_TRUE(std::isnan(linearised({curve, 1.8}, NAN)));
  }
}

TEST(ColorEncoding, DescriptionsNameWhatTheyKnow) {
  const Transfer srgb{Transfer::Curve::srgb}, gamma{Transfer::Curve::gamma, 1e5 / 45455};
  EXPECT_EQ(described({}, srgb), "sRGB");
  EXPECT_EQ(described({Transfer{}, kRec709, nullptr}, srgb), "linear");
  EXPECT_EQ(described({gamma, kAdobeRgb, nullptr}, srgb), "gamma 2.2, primaries of Adobe RGB");
  EXPECT_EQ(described({Transfer{}, Primaries{{0.7, 0.3}, {0.2, 0.7}, {0.1, 0.1}, kD65}, nullptr}, srgb),
            "linear, other primaries");
}

// Little CMS rounds primaries to 16.16 bits on their way to D50.
TEST(ColorEncoding, ProfilesAgreeWithTheClosedForm) {
  const Image colors = randomImage(64, 16, 3, 0, 1, 1);
  for (const Primaries& space : {kRec709, kAdobeRgb, kDisplayP3, kRec2020}) {
    const ColorEncoding closed{Transfer{Transfer::Curve::srgb}, space, nullptr};
    const ColorEncoding byProfile{
        {}, {}, std::make_shared<IccTransform>(profileBytes(space, ProfileCurve::srgb), 3)};
    const Image expected = decoded(colors, {closed, {}}), got = decoded(colors, {byProfile, {}});
    for (size_t i = 0; i < expected.values.size(); ++i)
      EXPECT_NEAR(got.values[i], expected.values[i], 7e-5f) << i;
  }
}

TEST(ColorEncoding, ProfilesOfLinearLightGoOnBeyondWhite) {
  const IccTransform profile(profileBytes(kRec709, ProfileCurve::linear), 3);
  const float stored[] = {4, 2, 0.5f};
  float rgb[3];
  profile.toRec709(stored, rgb, 1);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(rgb[c], stored[c], 1e-4f);
}

TEST(ColorEncoding, ProfilesOfTablesAreReadToo) {
  const IccTransform profile(tableProfileBytes(), 3);
  const Image colors = randomImage(20, 1, 3, 0.1f, 0.9f, 2);
  std::vector<float> rgb(colors.values.size());
  profile.toRec709(colors.values.data(), rgb.data(), 20);
  for (size_t i = 0; i < 20; ++i) { // grays of lightness min(r, g, b)
    const float* stored = &colors.values[3 * i];
    const float lightness = std::min({stored[0], stored[1], stored[2]});
    const float expected = std::pow((100 * lightness + 16) / 116, 3.f); // [CIE 15, 8.2.1.1]
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(rgb[3 * i + c], expected, 1e-5f);
  }
}

TEST(ColorEncoding, GrayProfilesGiveGray) {
  const IccTransform gray(grayProfileBytes(2), 1);
  EXPECT_EQ(gray.channels(), 1);
  const float stored[] = {0, 0.25f, 0.5f, 1};
  float rgb[12];
  gray.toRec709(stored, rgb, 4);
  for (size_t i = 0; i < 12; ++i) EXPECT_NEAR(rgb[i], stored[i / 3] * stored[i / 3], 2.4e-7f);
}

TEST(ColorEncoding, ProfilesOfOtherPicturesAndDamagedOnesAreRefused) {
  const std::string rgb = profileBytes(kDisplayP3, ProfileCurve::srgb);
  EXPECT_EQ(errorOf([&] { IccTransform(rgb, 1); }),
            "found 'RGB' of 'made by a test', expected one of colour space 'GRAY', as the picture is");
  EXPECT_NE(errorOf([&] { IccTransform(grayProfileBytes(1), 3); }).find("expected one of colour space 'RGB'"),
            std::string::npos);
  EXPECT_NE(
      errorOf([] { IccTransform(std::string_view("\0\0\0\0 no profile", 15), 3); }).find("cannot be read ("),
      std::string::npos);
  const std::string whole = ", expected the " + std::to_string(rgb.size()) + " bytes that its header says";
  for (size_t length = 0; length < rgb.size(); ++length) {
    const std::string complaint = errorOf([&] { IccTransform(rgb.substr(0, length), 3); });
    const bool saysSize = length >= 4; // the number of bytes, which comes first
    EXPECT_TRUE(saysSize ? complaint == "found " + std::to_string(length) + whole
                         : complaint.starts_with("cannot be read ("))
        << complaint;
  }
}

} // namespace

} // namespace surflect::image
