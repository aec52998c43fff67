#include "surfel/lanes_scalar.h"

#include <gtest/gtest.h>

namespace surflect {
namespace {

TEST(Lanes, CompressingKeepsThoseOfTheMaskInOrder) {
  float in[16], out[16] = {};
  for (int i = 0; i < 16; ++i) in[i] = static_cast<float>(i * 7 % 16);
  storeCompressed(out, load(in) < broadcast(5), load(in));
  const float expected[] = {0, 3, 1, 4, 2};
  for (int i = 0; i < 5; ++i) EXPECT_EQ(out[i], expected[i]);
}

} // namespace
} // namespace surflect
