#include "surfel/math/lanes_scalar.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surflect {
namespace {

TEST(Lanes, CompressingKeepsThoseOfTheMaskInOrder) {
  float in[16], out[16] = {};
  for (int i = 0; i < 16; ++i) in[i] = static_cast<float>(i * 7 % 16);
  storeCompressed(out, load(in) < broadcast(5), load(in));
  const float expected[] = {0, 3, 1, 4, 2};
  for (int i = 0; i < 5; ++i) EXPECT_EQ(out[i], expected[i]);
}

TEST(Lanes, WholePowersOfTwoMultiplyExactly) {
  float powers[16], whole[16], out[16];
  for (int i = 0; i < 16; ++i) powers[i] = 8.25f * static_cast<float>(i) - 66;
  store(whole, nearestWhole(load(powers)));
  store(out, timesPowerOfTwo(broadcast(1.3f), nearestWhole(load(powers))));
  for (int i = 0; i < 16; ++i) {
    EXPECT_EQ(whole[i], std::nearbyint(powers[i]));
    EXPECT_EQ(out[i], std::ldexp(1.3f, static_cast<int>(whole[i])));
  }
}

} // namespace
} // namespace surflect
