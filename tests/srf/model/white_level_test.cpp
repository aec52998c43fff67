#include "srf/model/white_level.h"

#include <gtest/gtest.h>

namespace surflect::model {
namespace {

codec::ReflectanceStack stackOf(int width, int height, size_t lights) {
  codec::ReflectanceStack stack{width, height,
                                std::vector<image::Image>(lights, image::Image(width, height, 3)),
                                image::Image(width, height, 1)};
  return stack;
}

TEST(WhiteLevel, OneValueInTwoHundredIsBrighter) {
  codec::ReflectanceStack stack = stackOf(100, 10, 2); // 6000 values
  image::Mask object(100, 10);
  std::ranges::fill(object.inside, uint8_t{1});
  size_t next = 0;
  for (image::Image& light : stack.lights)
    for (float& value : light.values) value = static_cast<float>(++next);
  WhiteLevel white;
  white.add(stack, object);
  EXPECT_NEAR(white.value(), 0.995 * 6000, 3); // relative precision 2^-12
}

TEST(WhiteLevel, OnlyTheObjectCounts) {
  codec::ReflectanceStack stack = stackOf(4, 4, 1);
  std::ranges::fill(stack.lights[0].values, 100.f);
  WhiteLevel white;
  image::Mask object(4, 4);
  white.add(stack, object);
  EXPECT_FALSE(white.isKnown());
  object.inside[5] = 1;
  for (size_t c = 0; c < 3; ++c) stack.lights[0].values[15 + c] = 2;
  white.add(stack, object);
  EXPECT_TRUE(white.isKnown());
  EXPECT_NEAR(white.value(), 2, 1e-3);
}

TEST(WhiteLevel, BlackHasOneNevertheless) {
  image::Mask object(4, 4);
  object.inside[0] = 1;
  WhiteLevel white;
  white.add(stackOf(4, 4, 1), object);
  EXPECT_EQ(white.value(), 1e-20);
}

} // namespace
} // namespace surflect::model
