#include "render/stage/material/merl.h"

#include "tests/render/stage/material/zoo.h"

#include <gtest/gtest.h>

namespace surflect::material {
namespace {

TEST(Merl, ATabulatedLambertIsLambert) {
  const MerlTable table = zoo::merlTable([](double, double, double) {
    return std::array{0.8 / kPi, 0.5 / kPi, 0.1 / kPi};
  });
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const auto wi = zoo::randomDirection(random), wo = zoo::randomDirection(random);
    const Rgb got = evaluate(Measured{&table}, wi, wo);
    const Rgb wanted = isAbove(wo) ? evaluate(Lambert{{0.8f, 0.5f, 0.1f}}, wi, wo) : Rgb{};
    EXPECT_NEAR(got.r, wanted.r, 1e-6);
    EXPECT_NEAR(got.g, wanted.g, 1e-6);
    EXPECT_NEAR(got.b, wanted.b, 1e-6);
  }
  EXPECT_NEAR(albedo(Measured{&table}, zoo::at(0.5, 1), 1 << 14).r, 0.8, 0.002);
}

// Functions of one angle each, that bins of a degree resolve.
TEST(Merl, AnglesAreThoseOfHalfAndDifference) {
  const MerlTable table = zoo::merlTable([](double h, double d, double p) {
    return std::array{std::cos(h), std::cos(d), 1 + std::sin(2 * p)};
  });
  std::mt19937 random(2);
  int compared = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto wi = zoo::randomDirection(random), wo = zoo::randomDirection(random);
    if (!isAbove(wi) || !isAbove(wo)) continue;
    ++compared;
    const auto h = normalized(wi + wo);
    const Rgb f = table.at(wi, wo);
    EXPECT_NEAR(f.r, h.z(), 0.02); // the first bin of theta_h ends at 0.01 degrees, the last is 2 wide
    EXPECT_NEAR(f.g, dot(wi, h), 0.01);
    // phi_d about h, from the side away from the normal: sin 2 phi = 2 sin phi cos phi.
    const Vec3<double> v = wi.raw() - dot(wi, h) * h.raw(), away = h.z() * h.raw() - Vec3<double>(0, 0, 1);
    if (v.norm() < 0.05 || away.norm() < 0.05) continue;
    const double cosine = v.dot(away) / (v.norm() * away.norm());
    const double sine = h.raw().dot(away.cross(v)) / (v.norm() * away.norm());
    EXPECT_NEAR(f.b, 1 + 2 * sine * cosine, 0.005);
  }
  EXPECT_GT(compared, 500);
}

TEST(Merl, WhatWasNotMeasuredIsBlack) {
  const MerlTable table = zoo::merlTable([](double h, double, double) {
    return std::array{h > 0.8 ? -1.0 / 1500 : 1, 1.0, 1.0};
  });
  EXPECT_EQ(table.at(zoo::at(0.05, 0), zoo::at(0.3, 0.2)).r, 0);
  EXPECT_FLOAT_EQ(table.at(zoo::at(0.9, 0), zoo::at(0.9, kPi)).r, 1);
}

TEST(Merl, DamagedFilesAreRefused) {
  const image::TemporaryFolder folder;
  const auto path = folder / "bad.binary";
  std::string bytes = zoo::merlFile([](double, double, double) { return std::array{1.0, 1.0, 1.0}; });
  const auto complaint = [&](const std::string& content) {
    image::writeBytes(path, content);
    const std::string line = image::errorOf([&] { MerlTable{path}; });
    EXPECT_EQ(line.find(path.string()), 0u);
    return line.substr(path.string().size());
  };
  EXPECT_EQ(complaint(""), ": found 0, expected 34992012 bytes");
  EXPECT_EQ(complaint(bytes.substr(0, 11)), ": found 11, expected 34992012 bytes");
  EXPECT_EQ(complaint(bytes.substr(0, 1000)), ": found 1000, expected 34992012 bytes");
  EXPECT_EQ(complaint(bytes.substr(0, bytes.size() - 1)), ": found 34992011, expected 34992012 bytes");
  EXPECT_EQ(complaint(bytes + "x"), ": found 34992013, expected 34992012 bytes");
  std::string huge = bytes.substr(0, 100);
  huge[3] = 0x7f;
  EXPECT_EQ(complaint(huge), ": dimensions: found 2130706522 x 90 x 180, expected 90 x 90 x 180");
  const double nan = std::nan("");
  std::memcpy(&bytes[12 + 8 * 7], &nan, sizeof nan);
  EXPECT_EQ(complaint(bytes), ": values[7]: found nan, expected a finite number");
  EXPECT_EQ(image::errorOf([&] { MerlTable{folder / "none"}; }).find((folder / "none").string()), 0u);
}

} // namespace
} // namespace surflect::material
