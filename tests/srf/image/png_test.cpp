#include "srf/image/png.h"

#include "srf/image/icc.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"
#include "tests/support/color_files.h"

namespace surflect::image {

namespace {

using Curve = Transfer::Curve;

class PngColor : public ::testing::Test {
protected:
  PngColor() : plain(written(3, 8, PngColors::unstated)) {}

  std::string written(int channels, int bits, PngColors colors) const {
    writePng(folder / "a.png", Image(3, 2, channels), bits, colors);
    return readFile(folder / "a.png");
  }
  // Statement of the file, alike by both readers.
  ColorStatement stated(const std::string& file) const {
    writeBytes(folder / "a.png", file);
    const auto whole = readPng(folder / "a.png").color, header = readPngHeader(folder / "a.png").color;
    if (!whole || !header) throw Error("nothing is stated");
    EXPECT_EQ(whole->source, header->source);
    EXPECT_EQ(whole->problem, header->problem);
    return *whole;
  }
  std::string problem(const std::string& name, const std::string& content) const {
    return stated(withChunk(plain, name, content)).problem;
  }

  TemporaryFolder folder;
  std::string plain;
};

TEST_F(PngColor, WithoutChunksNothingIsStated) {
  EXPECT_FALSE(pngColorStatement(plain));
  EXPECT_FALSE(pngColorStatement(withChunk(plain, "gAMA", gamaContent(0)))); // without a meaning
  EXPECT_FALSE(pngColorStatement(""));
}

TEST_F(PngColor, GammaIsTheExponentOfTheEncoding) {
  const auto transfer = [&](double gamma) {
    return *stated(withChunk(plain, "gAMA", gamaContent(gamma))).encoding.transfer;
  };
  EXPECT_EQ(transfer(1), Transfer{Curve::linear});
  EXPECT_EQ(transfer(0.5), (Transfer{Curve::gamma, 2}));
  EXPECT_EQ(transfer(0.45455), Transfer{Curve::srgb}); // as files of sRGB say for those who know no better
  EXPECT_NE(problem("gAMA", gamaContent(0.00001)).find("found 1, expected"), std::string::npos);
  EXPECT_EQ(problem("gAMA", "ab"), "found 2 bytes, expected 4 bytes");
}

TEST_F(PngColor, GammaOfOtherPrimariesIsNotTheSrgbCurve) {
  const ColorStatement adobe =
      stated(withChunk(withChunk(plain, "gAMA", gamaContent(0.45455)), "cHRM", chrmContent(kAdobeRgb)));
  EXPECT_EQ(adobe.encoding.transfer->curve, Curve::gamma);
  EXPECT_NEAR(adobe.encoding.transfer->exponent, 2.2, 1e-4);
  EXPECT_EQ(adobe.encoding.primaries, kAdobeRgb);
  const ColorStatement alone = stated(withChunk(plain, "cHRM", chrmContent(kAdobeRgb)));
  EXPECT_FALSE(alone.encoding.transfer);
  EXPECT_EQ(alone.source, "PNG cHRM chunk");
  EXPECT_NE(problem("cHRM", std::string(32, '\0')).find("primaries"), std::string::npos);
}

TEST_F(PngColor, TheStrongestChunkCounts) {
  std::string file = withChunk(plain, "gAMA", gamaContent(1));
  EXPECT_EQ(stated(file).source, "PNG gAMA chunk");
  file = withChunk(file, "sRGB", std::string(1, '\0'));
  EXPECT_EQ(stated(file).source, "PNG sRGB chunk");
  EXPECT_EQ(stated(file).encoding.transfer, Transfer{Curve::srgb});
  file = withChunk(file, "iCCP", iccpContent(profileBytes(kDisplayP3, ProfileCurve::srgb)));
  EXPECT_EQ(stated(file).source, "PNG iCCP chunk");
  EXPECT_EQ(stated(file).encoding.profile->name(), "made by a test");
  file = withChunk(file, "cICP", {9, 8, 0, 1});
  EXPECT_EQ(stated(file).source, "PNG cICP chunk");
  EXPECT_EQ(stated(file).encoding.transfer, Transfer{});
  EXPECT_EQ(stated(file).encoding.primaries, kRec2020);
}

TEST_F(PngColor, CodePointsThatAreNotUnderstoodAreNamed) {
  EXPECT_NE(problem("cICP", {9, 16, 0, 1}).find("PQ"), std::string::npos);
  EXPECT_NE(problem("cICP", {9, 18, 0, 1}).find("HLG"), std::string::npos);
  EXPECT_EQ(problem("cICP", {3, 13, 0, 1}), "colour primaries: found 3, expected 1, 2, 5, 6, 9, 11 or 12");
  EXPECT_EQ(problem("cICP", {1, 3, 0, 1}),
            "transfer function: found 3, expected 1, 2, 4, 5, 6, 8, 13, 14 or 15");
  EXPECT_EQ(problem("cICP", {1, 13, 1, 1}), "matrix coefficients: found 1, expected 0, RGB");
  EXPECT_EQ(problem("cICP", {1, 13, 0, 0}), "range: found 0, expected 1, full range");
}

TEST_F(PngColor, WhatCodePointsLeaveOpenIsUnstated) {
  const ColorStatement curve = stated(withChunk(plain, "cICP", {2, 13, 0, 1})),
                       primaries = stated(withChunk(plain, "cICP", {9, 2, 0, 1}));
  EXPECT_EQ(curve.encoding.transfer, Transfer{Curve::srgb});
  EXPECT_FALSE(curve.encoding.primaries);
  EXPECT_FALSE(primaries.encoding.transfer);
  EXPECT_EQ(primaries.encoding.primaries, kRec2020);
  const std::string open = withChunk(plain, "cICP", {2, 2, 0, 1});
  EXPECT_FALSE(pngColorStatement(open));
  EXPECT_EQ(stated(withChunk(open, "gAMA", gamaContent(1))).source, "PNG gAMA chunk");
}

TEST_F(PngColor, ProfilesMustBeWholeAndOfThePicturesChannels) {
  const std::string content = iccpContent(profileBytes(kDisplayP3, ProfileCurve::srgb));
  EXPECT_EQ(problem("iCCP", content), "");
  EXPECT_EQ(problem("iCCP", content.substr(0, content.size() / 2)), "the profile cannot be decompressed");
  EXPECT_EQ(problem("iCCP", "name"), "no name and method of compression 0");
  EXPECT_NE(problem("iCCP", iccpContent("no profile")).find("bytes that its header says"), std::string::npos);
  const std::string gray = written(1, 8, PngColors::unstated);
  EXPECT_NE(stated(withChunk(gray, "iCCP", content)).problem.find("'GRAY'"), std::string::npos);
  EXPECT_EQ(stated(withChunk(gray, "iCCP", iccpContent(grayProfileBytes(2)))).problem, "");
}

TEST_F(PngColor, ADamagedStatementIsAProblemAndNotPassedOver) {
  std::string file = withChunk(plain, "gAMA", gamaContent(1));
  file[33 + 8] ^= 1; // in the content
  EXPECT_EQ(pngColorStatement(file)->problem, "gAMA: the checksum is wrong");
  for (size_t length = 0; length < file.size(); ++length) {
    const auto statement = pngColorStatement(std::string_view(file).substr(0, length));
    EXPECT_TRUE(!statement || statement->problem == "gAMA: the checksum is wrong") << length;
  }
}

TEST_F(PngColor, ADamagedChunkDoesNotMatterBesideAStrongerOne) {
  std::string file = withChunk(plain, "cHRM", chrmContent(kRec709));
  file[33 + 8] ^= 1;
  EXPECT_EQ(pngColorStatement(file)->problem, "cHRM: the checksum is wrong");
  file = withChunk(file, "sRGB", std::string(1, '\0'));
  EXPECT_EQ(stated(file).source, "PNG sRGB chunk");
  EXPECT_EQ(stated(file).problem, "");
  file[33 + 8] ^= 1;
  EXPECT_EQ(stated(file).problem, "sRGB: the checksum is wrong");
}

TEST_F(PngColor, APictureWrittenAsSrgbSaysSo) {
  for (const int channels : {1, 3, 4}) {
    const ColorStatement statement = stated(written(channels, 8, PngColors::srgb));
    EXPECT_EQ(statement.source, "PNG sRGB chunk");
    EXPECT_EQ(statement.encoding.transfer, Transfer{Curve::srgb});
  }
  EXPECT_EQ(readPngHeader(folder / "a.png").bitDepth, 8);
}

TEST_F(PngColor, ChunksAreFoundUpToThePixels) {
  const std::string file = withChunk(plain, "tRNS", "abcdef");
  EXPECT_TRUE(hasPngChunk(file, "tRNS") && hasPngChunk(file, "IDAT"));
  EXPECT_FALSE(hasPngChunk(file, "IEND")); // after them
  EXPECT_FALSE(hasPngChunk(plain, "tRNS"));
  const size_t pixels = file.find("IDAT");
  EXPECT_TRUE(hasPngChunk(file.substr(0, pixels + 4), "IDAT")); // begun
  EXPECT_FALSE(hasPngChunk(file.substr(0, pixels + 3), "IDAT"));
}

TEST_F(PngColor, ChunksAfterThePixelsSayNothing) {
  std::string file = plain;
  const std::string chunk = withChunk(plain, "gAMA", gamaContent(1)).substr(33, 16);
  EXPECT_FALSE(pngColorStatement(file.insert(file.size() - 12, chunk)));
}

} // namespace

namespace {

std::string bytesOf(std::string_view hex) {
  std::string bytes;
  for (size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  return bytes;
}

// Written by hand: a 2-bit palette of which one entry is translucent, Adam7 rows, and a tiny file that claims
// 16000 x 16000 pixels.
const std::string palette =
    bytesOf("89504e470d0a1a0a0000000d4948445200000003000000010203000000668efc270000000950"
            "4c5445ff000000ff000000ff2d4acd8a0000000274524e53ff335a67515c0000000a49444154"
            "789c63900000001a00192d88f4360000000049454e44ae426082");
const std::string interlaced =
    bytesOf("89504e470d0a1a0a0000000d49484452000000030000000308000000010444daf50000001749"
            "444154789c6360601061b00960e062706390d330020008a701693ddf9762000000004945"
            "4e44ae426082");
const std::string huge =
    bytesOf("89504e470d0a1a0a0000000d4948445200003e8000003e800806000000417edfde0000000c49444154"
            "789c6360a03d00000064000186643c350000000049454e44ae426082");

class Png : public ::testing::Test {
protected:
  PngPicture read(const std::string& bytes) const {
    writeBytes(folder / "a.png", bytes);
    return readPng(folder / "a.png");
  }

  TemporaryFolder folder;
};

TEST_F(Png, SamplesSurviveARoundTrip) {
  for (const int bitDepth : {8, 16})
    for (int channels = 1; channels <= 4; ++channels) {
      Image image = randomImage(7, 5, channels, 0, 1, 3);
      const float white = bitDepth == 8 ? 255 : 65535;
      for (float& v : image.values) v = std::round(v * white) / white;
      writePng(folder / "a.png", image, bitDepth);
      const PngPicture back = readPng(folder / "a.png");
      EXPECT_EQ(back.bitDepth, bitDepth);
      EXPECT_EQ(back.image.channels, channels);
      EXPECT_EQ(back.image.values, image.values);
    }
}

TEST_F(Png, ValuesAreRoundedAndClamped) {
  const Image image = randomImage(40, 30, 3, -0.5f, 1.5f, 4);
  writePng(folder / "a.png", image);
  const PngPicture back = readPng(folder / "a.png");
  for (size_t i = 0; i < image.values.size(); ++i)
    EXPECT_NEAR(back.image.values[i], std::clamp(image.values[i], 0.f, 1.f), 0.5001f / 255);
}

TEST_F(Png, PalettesAndTheirTransparencyAreExpanded) {
  const PngPicture picture = read(palette);
  EXPECT_EQ(picture.bitDepth, 8);
  ASSERT_EQ(picture.image.channels, 4);
  EXPECT_EQ(picture.image.values, std::vector<float>({1, 0, 0, 1, 0, 1, 0, 0.2f, 0, 0, 1, 1}));
}

TEST_F(Png, InterlacedRowsComeInOrder) {
  const PngPicture picture = read(interlaced);
  ASSERT_EQ(picture.image.channels, 1);
  for (int i = 0; i < 9; ++i)
    EXPECT_FLOAT_EQ(picture.image.at(i % 3, i / 3)[0], 10 * static_cast<float>(i) / 255);
}

TEST_F(Png, TheSizeIsKnownWithoutThePixels) {
  writePng(folder / "a.png", Image(13, 6, 3));
  EXPECT_EQ(readPngHeader(folder / "a.png").width, 13);
  EXPECT_EQ(readPngHeader(folder / "a.png").height, 6);
}

TEST_F(Png, AlphaIsKnownWithoutThePixels) {
  for (const int channels : {1, 2, 3, 4}) {
    writePng(folder / "a.png", Image(2, 2, channels));
    EXPECT_EQ(readPngHeader(folder / "a.png").hasAlpha, channels % 2 == 0) << channels;
  }
  writeBytes(folder / "a.png", palette); // with a transparent colour
  EXPECT_TRUE(readPngHeader(folder / "a.png").hasAlpha);
}

TEST_F(Png, EveryTruncationIsRejected) {
  for (const std::string& whole : {palette, interlaced})
    for (size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(errorOf([&] { read(whole.substr(0, length)); }).find("a.png: cannot read"),
                std::string::npos);
}

TEST_F(Png, EveryFlippedBitIsRejected) {
  for (size_t bit = 0; bit < 8 * interlaced.size(); ++bit) {
    std::string damaged = interlaced;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    EXPECT_NE(errorOf([&] { read(damaged); }), "") << "bit " << bit;
  }
}

TEST_F(Png, AClaimThatTheFileCannotHoldIsRejectedBeforeMemoryIsTaken) {
  EXPECT_NE(errorOf([&] { read(huge); }).find("truncated"), std::string::npos);
}

TEST_F(Png, AMissingFileIsNamed) {
  EXPECT_NE(errorOf([&] { readPng(folder / "none.png"); }).find("none.png"), std::string::npos);
  EXPECT_NE(errorOf([&] { readPngHeader(folder / "none.png"); }).find("none.png"), std::string::npos);
}

} // namespace

} // namespace surflect::image
