#include "render/film/video.h"

#include "tests/srf/image/files.h"

#include <cstdio>
#include <memory>
#include <set>

namespace surflect::film {
namespace {

TEST(Video, RatesOfNtscAreFractions) {
  EXPECT_EQ(rateText(23.976), "24000/1001");
  EXPECT_EQ(rateText(23.98), "24000/1001");
  EXPECT_EQ(rateText(23.97), "23.97");
  EXPECT_EQ(rateText(29.97), "30000/1001");
  EXPECT_EQ(rateText(59.94), "60000/1001");
  EXPECT_EQ(rateText(119.88), "120000/1001");
  EXPECT_EQ(rateText(24), "24");
  EXPECT_EQ(rateText(25), "25");
  EXPECT_EQ(rateText(12.5), "12.5");
  EXPECT_EQ(rateText(0.001), "0.001");
}

TEST(Video, AlphaIsKeptByMovAlone) {
  EXPECT_EQ(videoFormat("film.mp4", true), VideoFormat::h264);
  EXPECT_EQ(videoFormat("film.mp4", false), VideoFormat::h264);
  EXPECT_EQ(videoFormat("film.mov", true), VideoFormat::proRes4444);
  EXPECT_EQ(videoFormat("film.mov", false), VideoFormat::proRes422);
}

// The codec keeps alpha without loss, in 10 bits.
TEST(Video, ProResHasMoreThanTheCodesOfEightBits) {
  ASSERT_TRUE(canEncodeVideo());
  const image::TemporaryFolder folder;
  constexpr int kSide = 64;
  method::FrameLayers film{image::Image(kSide, kSide, 4), {}};
  for (size_t i = 0; i < kSide * kSide; ++i)
    film.color.values[4 * i + 3] = static_cast<float>(i) / (kSide * kSide - 1);
  VideoWriter video(folder / "film.mov", VideoFormat::proRes4444, kSide, kSide, 24);
  video.add(shownColor(film, {.isTransparent = true, .bits = bitsOf(VideoFormat::proRes4444)}));
  video.finish();
  const std::string command = "ffmpeg -v error -i '" + (folder / "film.mov").string() +
                              "' -vf alphaextract -pix_fmt gray16le -f rawvideo -";
  const std::unique_ptr<FILE, int (*)(FILE*)> decoded(::popen(command.c_str(), "r"), ::pclose);
  std::set<uint16_t> codes;
  size_t pixels = 0;
  for (uint16_t code = 0; std::fread(&code, sizeof code, 1, decoded.get()) == 1; ++pixels) {
    codes.insert(code);
    EXPECT_NEAR(code / 65535., film.color.values[4 * pixels + 3], 1.1 / 1023);
  }
  EXPECT_EQ(pixels, size_t{kSide * kSide});
  EXPECT_GT(codes.size(), 1000u);
}

} // namespace
} // namespace surflect::film
