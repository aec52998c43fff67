#include "srf/image/response.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surflect::image {
namespace {

Response squares() {
  Response response;
  for (size_t c = 0; c < 3; ++c)
    for (size_t z = 0; z < Response::codes; ++z)
      response.exposure[c][z] = static_cast<float>((c + 1) * z * z);
  return response;
}

TEST(Response, CodesGiveTheirExposure) {
  const Response response = squares();
  for (size_t c = 0; c < 3; ++c)
    for (size_t z = 0; z < Response::codes; ++z)
      EXPECT_NEAR(response(c, static_cast<float>(z) / 255), response.exposure[c][z],
                  1e-4f * static_cast<float>((c + 1) * (1 + z)));
}

TEST(Response, BetweenCodesItIsLinearAndBeyondThemItEnds) {
  const Response response = squares();
  EXPECT_NEAR(response(0, 10.5f / 255), 110.5f, 1e-3f);
  EXPECT_EQ(response(1, 2), response(1, 1));
  EXPECT_EQ(response(1, -1), 0);
  EXPECT_TRUE(std::isnan(response(1, NAN)));
}

} // namespace
} // namespace surflect::image
