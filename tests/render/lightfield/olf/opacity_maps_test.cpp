#include "render/lightfield/olf/opacity_maps.h"

#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/tile.h"
#include "tests/render/lightfield/olf/painted_maps.h"
#include "tests/srf/image/files.h"
#include "tests/support/damage.h"

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace surflect::olf {
namespace {

namespace fs = std::filesystem;

OpacityMaps sample() {
  OpacityMaps maps;
  maps.white = 0.75, maps.order = Order::peel;
  maps.maps = lfm::testing::syntheticMaps(
      lfm::testing::squarePatch(2), {.samples = 3, .viewSize = 4, .terms = 2, .channels = kMapChannels});
  return maps;
}

class OpacityMapFile : public ::testing::Test {
protected:
  void SetUp() override {
    studio::photograph({.cameras = 3, .lights = 0, .size = 24}, folder_ / "capture");
    capture_ = capture::readCapture(folder_ / "capture");
    writeMaps(sample(), capture_, folder_ / "maps");
  }
  OpacityMaps read() const {
    return readMaps(lightfield::LightFieldFolder(folder_ / "maps", kMapFormat, kMapVersion));
  }
  std::string errorAfter(const std::function<void(OpacityMaps&)>& change) const {
    OpacityMaps maps = sample();
    change(maps);
    writeMaps(maps, capture_, folder_ / "maps");
    return image::errorOf([&] { read(); });
  }

  image::TemporaryFolder folder_;
  capture::Capture capture_;
};

TEST_F(OpacityMapFile, ReadingReturnsWhatWasWritten) {
  for (const bool isCompressed : {false, true}) {
    OpacityMaps before = sample();
    if (isCompressed) before.maps = lfm::encoded(before.maps);
    writeMaps(before, capture_, folder_ / "maps");
    const OpacityMaps after = read();
    EXPECT_EQ(after.white, 0.75);
    EXPECT_EQ(after.order, Order::peel);
    EXPECT_EQ(after.maps.channels, 4u);
    EXPECT_EQ(lfm::mapsBytes(after.maps), lfm::mapsBytes(before.maps));
    EXPECT_EQ(after.maps.mesh.triangles, before.maps.mesh.triangles);
  }
}

TEST_F(OpacityMapFile, MapsOfThreeChannelsAreAnotherFormat) {
  const std::vector<std::byte> four = lfm::mapsBytes(sample().maps);
  const TriangleMesh mesh = lfm::testing::squarePatch(2);
  EXPECT_EQ(image::errorOf([&] { lfm::parseMaps(four, mesh); }),
            "magic: found other bytes, expected \"lfm maps\"");
  const std::vector<std::byte> three = lfm::mapsBytes(lfm::testing::syntheticMaps(mesh, {.samples = 3}));
  EXPECT_EQ(image::errorOf([&] { lfm::parseMaps(three, mesh, kMapChannels); }),
            "magic: found other bytes, expected \"rgbamaps\"");
  EXPECT_THROW(lfm::openMaps(folder_ / "maps"), Error);
}

TEST_F(OpacityMapFile, DamageIsRefusedOrStillALightField) {
  tryDamage(lfm::mapsBytes(sample().maps), [](std::span<const std::byte> damaged) {
    const OpacityMaps maps{lfm::decoded(lfm::parseMaps(damaged, lfm::testing::squarePatch(2), kMapChannels)),
                           1, Order::list};
    EXPECT_TRUE(colorAt(maps, {0, 0.2, 0.3}, {0, 0, 1}, 2).allFinite());
  });
}

TEST_F(OpacityMapFile, WrongNumbersAreRefusedByTheirPlace) {
  const std::string manifest = (folder_ / "maps/manifest.json").string(),
                    maps = (folder_ / "maps/maps.bin").string();
  EXPECT_EQ(errorAfter([](OpacityMaps& m) { m.white = 0; }),
            manifest + ": numbers.white: found 0, expected a number from 1e-30 to 1e+30");
  EXPECT_EQ(errorAfter([](OpacityMaps& m) { m.order = Order::bsp; }),
            manifest + ": numbers.order: found 2, expected a number from 0 to 1");
  EXPECT_EQ(errorAfter([](OpacityMaps& m) { m.maps.terms[1].scale[3] = -1; }),
            maps + ": terms[1].scale[3]: found -1, expected a finite number of at least 0");
  EXPECT_EQ(errorAfter([](OpacityMaps& m) {
              lfm::MapSet& mean = m.maps.mean.maps;
              mean.coding = lfm::Coding::dxt1;
              mean.data.resize(lfm::bytesOf(lfm::meanShape(m.maps), mean.coding, mean.count));
            }),
            maps + ": mean.coding: is not that of maps with so many channels");
}

} // namespace
} // namespace surflect::olf
