#include "render/gl/texture.h"

#include "srf/image/color.h"
#include "tests/render/gl/gl_test.h"

#include <cmath>
#include <cstring>

namespace surflect::gl {
namespace {

class TextureTest : public GlTest {};

constexpr Format kUncompressed[] = {Format::rgba8,   Format::srgba8,  Format::rgba8s, Format::rg8s,
                                    Format::rgba16f, Format::rgba32f, Format::r32f,   Format::depth32f};

bool isSigned(Format format) { return format == Format::rgba8s || format == Format::rg8s; }

// Values between those that the 8-bit formats store.
image::Image pictureFor(Format format, int width, int height, unsigned seed) {
  return image::randomImage(width, height, channelsOf(format), isSigned(format) ? -1.f : 0.f, 1, seed);
}

image::Image stored(Format format, const image::Image& picture) {
  return pictureOf(format, picture.width, picture.height, texelsOf(format, picture));
}

TEST(Texels, OfEveryByteSurviveTheRoundTrip) {
  for (Format format : {Format::rgba8, Format::srgba8, Format::rgba8s, Format::rg8s}) {
    const int height = 64 / channelsOf(format);
    std::vector<std::byte> texels(1024);
    for (size_t i = 0; i < texels.size(); ++i) texels[i] = static_cast<std::byte>((i / 4 + i) % 256);
    if (isSigned(format)) std::ranges::replace(texels, std::byte{0x80}, std::byte{0x81}); // both are -1
    EXPECT_EQ(texelsOf(format, pictureOf(format, 16, height, texels)), texels);
  }
}

TEST(Texels, AreTheNearest) {
  for (Format format : {Format::rgba8, Format::rgba8s, Format::rgba16f}) {
    const image::Image picture = pictureFor(format, 8, 8, 1), nearest = stored(format, picture);
    for (size_t i = 0; i < picture.values.size(); ++i)
      EXPECT_NEAR(nearest.values[i], picture.values[i], format == Format::rgba16f ? 0x1p-12 : 0.5001 / 127);
  }
}

TEST_F(TextureTest, PicturesAreReadAsTheyWereUploaded) {
  for (Format format : kUncompressed) {
    const image::Image picture = pictureFor(format, 7, 5, 2);
    EXPECT_EQ(textureOf(format, picture).read().values, stored(format, picture).values);
  }
}

TEST_F(TextureTest, RectanglesOfLayersAndLevelsAreIndependent) {
  Texture texture({Format::rgba32f, 8, 6, 3, 2});
  std::vector<image::Image> pictures;
  for (int layer = 0; layer < 3; ++layer) {
    const auto seed = static_cast<unsigned>(layer);
    texture.upload(pictures.emplace_back(image::randomImage(8, 6, 4, 0, 1, seed)), {.layer = layer});
    texture.upload(image::Image(4, 3, 4), {.layer = layer, .level = 1});
  }
  const image::Image part = image::randomImage(2, 3, 4, 0, 1, 3);
  texture.upload(part, {5, 1, 1});
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 2; ++x) std::ranges::copy(part.at(x, y), pictures[1].at(5 + x, 1 + y).begin());
  for (int layer = 0; layer < 3; ++layer) {
    EXPECT_EQ(texture.read(layer).values, pictures[static_cast<size_t>(layer)].values);
    EXPECT_EQ(texture.read(layer, 1).values, std::vector<float>(48));
  }
}

TEST_F(TextureTest, LevelsAreAverages) {
  image::Image picture(2, 2, 1);
  picture.values = {1, 2, 3, 6};
  Texture texture({Format::r32f, 2, 2, 0, 2});
  texture.upload(picture);
  texture.fillLevels();
  EXPECT_EQ(texture.read(0, 1).values, std::vector<float>{3});
}

TEST_F(TextureTest, ClearedColoursAreReadExactly) {
  const Eigen::Vector4f value(0.25f, 0.1f, 1, 0.75f);
  for (Format format : kUncompressed) {
    if (format == Format::depth32f) continue;
    const Texture color({format, 9, 4});
    Framebuffer target("target", {{&color}});
    target.clearColor(0, value);
    image::Image picture(9, 4, channelsOf(format));
    for (size_t i = 0; i < picture.values.size(); ++i)
      picture.values[i] = value[static_cast<int>(i) % picture.channels];
    EXPECT_EQ(color.read().values, stored(format, picture).values) << static_cast<int>(format);
  }
}

TEST_F(TextureTest, ClearedDepthIsReadExactly) {
  const Texture depth({Format::depth32f, 9, 4});
  Framebuffer target("target", {}, {&depth});
  target.clearDepth(1);
  target.clearDepth(0.3f, Rect{2, 1, 1, 3});
  const image::Image read = depth.read();
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 9; ++x) EXPECT_EQ(read.at(x, y)[0], x == 2 && y >= 1 ? 0.3f : 1) << x << " " << y;
}

// A layer of a texture, drawn 1:1.
image::Image drawn(const Texture& texture) {
  const TextureShape& shape = texture.shape();
  const Texture color({Format::rgba32f, shape.width, shape.height});
  const Framebuffer target("target", {{&color}});
  Program program(kShaders, {"everywhere.vert", "layer.frag"});
  program.set("layer", 0);
  program.set("weight", 1.f);
  const Texture* textures[] = {&texture};
  draw({target, program, textures}, VertexArray({}), {0, 3});
  return color.read();
}

TEST_F(TextureTest, SrgbTexturesAreSampledInLinearLight) {
  const image::Image picture = image::randomImage(16, 16, 4, 0, 1, 4);
  Texture texture({Format::srgba8, 16, 16, 1});
  texture.upload(picture);
  const image::Image sampled = drawn(texture), nearest = stored(Format::srgba8, picture);
  for (size_t i = 0; i < sampled.values.size(); ++i)
    EXPECT_NEAR(sampled.values[i], nearest.values[i], 0.5 / 255);
}

TEST_F(TextureTest, CompressedBlocksAreSampled) {
  // [EXT_texture_compression_s3tc] two 5:6:5 colours, then two bits per texel: 0 and 1 select a colour, 2 and
  // 3 are thirds between. Rows of one index each.
  const auto block = [](std::vector<unsigned> bytes) {
    std::vector<std::byte> texels;
    for (unsigned byte : bytes) texels.push_back(static_cast<std::byte>(byte));
    return texels;
  };
  const std::vector<unsigned> colors{0xff, 0xff, 0x00, 0xf8, 0x00, 0x55, 0xaa, 0xff}; // white, red
  Texture dxt1({Format::dxt1, 4, 4, 1});
  dxt1.upload(block(colors), 4, 4);
  std::vector<unsigned> withAlpha{0x80, 0x00, 0, 0, 0, 0, 0, 0}; // alpha 128 everywhere
  withAlpha.insert(withAlpha.end(), colors.begin(), colors.end());
  Texture dxt5({Format::dxt5, 4, 4, 1});
  dxt5.upload(block(withAlpha), 4, 4);
  for (const Texture* texture : {&dxt1, &dxt5}) {
    const image::Image picture = drawn(*texture);
    const float greens[] = {1, 0, 2 / 3.f, 1 / 3.f}, alpha = texture == &dxt1 ? 1 : 128 / 255.f;
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 4; ++x) {
        EXPECT_NEAR(picture.at(x, y)[0], 1, 1e-6);
        EXPECT_NEAR(picture.at(x, y)[1], greens[y], 1 / 255.);
        EXPECT_NEAR(picture.at(x, y)[3], alpha, 1e-6);
      }
  }
  EXPECT_EQ(bytesOf(Format::dxt5, 5, 4), 32u);
}

} // namespace
} // namespace surflect::gl
