#include "render/lightfield/slf/texture_slots.h"

#include "bench/slf/synthetic_field.h"
#include "render/lightfield/slf/reference.h"
#include "render/lightfield/slf/slf_frame.h"
#include "srf/image/half_float.h"
#include "tests/render/gl/gl_test.h"
#include "tests/render/lightfield/slf/cameras.h"

#include <cmath>
#include <random>
#include <vector>

namespace surflect::slf {
namespace {

using namespace bench;

class TextureSlotsTest : public gl::GlTest {};

// A field whose regions have textures of all sizes, from a single texel.
Field unequalField() {
  Field field = syntheticField();
  for (size_t region = 0; region < field.regions.size(); ++region) {
    Chart& chart = field.regions[region].chart;
    chart.width = 1 + static_cast<int>(region % 5) * 3;
    chart.height = 1 + static_cast<int>(region % 7) * 2;
  }
  return field;
}

// Random texels, so that those of another texture, or of none, would be seen.
class NoiseTextures : public Textures {
public:
  explicit NoiseTextures(const Field& field) : field_(field) {}
  std::vector<Texel> read(size_t region, size_t direction) const override {
    std::mt19937 random(static_cast<unsigned>(1000 * region + direction));
    std::uniform_real_distribution<float> value(0, 1);
    std::vector<Texel> texels(field_.regions[region].chart.texels());
    for (Texel& texel : texels)
      for (uint16_t& channel : texel) channel = image::nearestHalf(value(random));
    return texels;
  }

private:
  const Field& field_;
};

TEST_F(TextureSlotsTest, TexturesOfAllSizesShareSlots) {
  const Field field = unequalField();
  const NoiseTextures textures(field);
  const Reference reference(field, textures);
  std::mt19937 random(1);
  std::vector<Camera> path;
  for (int i = 0; i < 3; ++i) path.push_back(randomCamera(random, 80, 60));
  FrameRenderer ample(field, textures, {}, context_->describe().limits);
  for (const CachePolicy policy : {CachePolicy::lru, CachePolicy::modifiedLru, CachePolicy::planned}) {
    FrameRenderer scarce(field, textures, {0, policy}, context_->describe().limits);
    for (const Camera& camera : path) {
      const image::Image found = scarce.render(camera).color;
      EXPECT_EQ(found.values, ample.render(camera).color.values);
      const image::Image expected = reference.render(camera).color;
      size_t different = 0;
      for (size_t i = 0; i < expected.values.size(); ++i)
        different += std::abs(found.values[i] - expected.values[i]) > 1e-3f;
      EXPECT_LE(different, 12u); // of 19,200: at silhouettes
    }
  }
}

// Slots of several array textures, of which one draw may read all.
TEST_F(TextureSlotsTest, SeveralArrayTexturesShowTheSameBits) {
  const Field field = syntheticField();
  const NoiseTextures textures(field);
  gl::Limits limits = context_->describe().limits;
  FrameRenderer one(field, textures, {}, limits);
  ASSERT_EQ(one.slots().arrays()[1], one.slots().arrays()[0]);
  std::mt19937 random(9);
  for (const int layers : {1, 7, 61, 200}) {
    limits.arrayLayers = layers;
    FrameRenderer several(field, textures, {}, limits);
    const std::vector<const gl::Texture*> arrays = several.slots().arrays();
    EXPECT_NE(arrays[1], arrays[0]);
    EXPECT_EQ(several.slots().shape().count,
              std::min(field.textures(), kMostArrays * static_cast<size_t>(layers)));
    for (const Stages method : {Stages::fused, Stages::twoStages})
      for (int view = 0; view < 2; ++view) {
        const Camera camera = randomCamera(random, 48, 40);
        EXPECT_EQ(several.render(camera, {.method = method}).color.values,
                  one.render(camera, {.method = method}).color.values);
      }
  }
}

TEST_F(TextureSlotsTest, ATextureLargerThanOpenGlHasIsNamed) {
  Field field = syntheticField();
  field.regions[3].chart.height = 300;
  EXPECT_EQ(image::errorOf([&] { slotsOf(field, 1 << 20, {.textureSize = 256, .arrayLayers = 100}); }),
            "size of a texture: found 300, expected at most 255 texels, which OpenGL has");
}

TEST_F(TextureSlotsTest, SlotsAreLimitedByBudgetTexturesAndLayers) {
  const Field field = syntheticField(); // 432 textures
  const gl::Limits limits{.textureSize = 4096, .arrayLayers = 2048};
  const size_t bytes = slotsOf(field, 0, limits).bytes();
  EXPECT_EQ(slotsOf(field, 0, limits).count, kLeastSlots);
  EXPECT_EQ(slotsOf(field, 100 * bytes, limits).count, 100u);
  EXPECT_EQ(slotsOf(field, 100 * bytes - 1, limits).count, 99u);
  EXPECT_EQ(slotsOf(field, 10'000 * bytes, limits).count, 432u);
  EXPECT_EQ(slotsOf(field, 10'000 * bytes, limits).layers, 432u);
  const SlotShape several = slotsOf(field, 10'000 * bytes, {.textureSize = 4096, .arrayLayers = 256});
  EXPECT_EQ(several.count, 432u);
  EXPECT_EQ(several.layers, 256u);
  EXPECT_EQ(slotsOf(field, 10'000 * bytes, {.textureSize = 4096, .arrayLayers = 50}).count, 400u);
}

} // namespace
} // namespace surflect::slf
