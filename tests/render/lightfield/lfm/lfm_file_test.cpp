#include "render/lightfield/lfm/lfm_file.h"

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/radiance.h"
#include "render/lightfield/lfm/tile.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/srf/image/files.h"
#include "tests/support/damage.h"
#include "tests/support/synthetic_capture.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace surflect::lfm {
namespace {

using namespace lfm::testing;

LightFieldMaps sample() {
  LightFieldMaps maps = syntheticMaps(squarePatch(2), {.samples = 3, .viewSize = 2, .terms = 2});
  maps.terms[1].surface.mapOf[2] = kNoMap; // of a codebook
  return maps;
}

std::string errorOfBytes(std::span<const std::byte> bytes) {
  return image::errorOf([&] { parseMaps(bytes, squarePatch(2)); });
}

// The error of a sample with one thing changed.
std::string errorWith(const std::function<void(LightFieldMaps&)>& change) {
  LightFieldMaps changed = sample();
  change(changed);
  return errorOfBytes(mapsBytes(changed));
}

TEST(LfmFile, ReadingReturnsWhatWasWritten) {
  LightFieldMaps nmf = syntheticMaps(squarePatch(2), {.method = Factorization::nmf, .samples = 4});
  for (Term& term : nmf.terms) term.surface = scalarTable(term.surface, nmf.samples);
  nmf.layout = SurfaceLayout::scalar;
  for (const LightFieldMaps& before :
       {sample(), nmf, encoded(sample()), syntheticMaps(squarePatch(2), {.terms = 0}),
        withHigherViewSize(syntheticMaps(squarePatch(2)), 5),
        encoded(withHigherViewSize(syntheticMaps(squarePatch(2)), 5)), syntheticMaps(bumpySphere(5, 7))}) {
    const std::vector<std::byte> bytes = mapsBytes(before);
    const LightFieldMaps after = parseMaps(bytes, before.mesh);
    EXPECT_EQ(mapsBytes(after), bytes);
    EXPECT_EQ(after.method, before.method);
    EXPECT_EQ(after.samples, before.samples);
    EXPECT_EQ(after.meanWhite, before.meanWhite);
    EXPECT_EQ(after.viewSize, before.viewSize);
    EXPECT_EQ(after.higherViewSize, before.higherViewSize);
    ASSERT_EQ(after.terms.size(), before.terms.size());
    for (size_t k = 0; k < before.terms.size(); ++k) {
      const Term &a = after.terms[k], &b = before.terms[k];
      EXPECT_EQ(a.scale, b.scale);
      EXPECT_EQ(a.surface.mapOf, b.surface.mapOf);
      EXPECT_EQ(a.surface.maps.data, b.surface.maps.data);
      EXPECT_EQ(a.view.maps.data, b.view.maps.data);
    }
    EXPECT_EQ(after.mean.maps.data, before.mean.maps.data);
    for (size_t v = 0; v < before.frames.size(); ++v) {
      EXPECT_LT((after.frames[v].x - before.frames[v].x).norm(), 1e-6);
      EXPECT_LT((after.frames[v].y - before.frames[v].y).norm(), 1e-6);
    }
  }
}

TEST(LfmFile, BytesAreThoseOfTheFileBesideGeometry) {
  const LightFieldMaps maps = sample();
  // Start, eleven numbers, white, frames; and two numbers for each of the five tables.
  const size_t rest = 8 + 11 * 8 + 4 + 24 * maps.mesh.positions.size() + 5 * 16;
  EXPECT_EQ(mapsBytes(maps).size(), rest + bytesOf(maps).total());
}

TEST(LfmFile, LargeCodebooksHaveLargerIndices) {
  for (const size_t count : {100u, 65534u, 65535u, 70000u}) {
    LightFieldMaps maps = syntheticMaps(squarePatch(2), {.samples = 2, .viewSize = 2, .terms = 1});
    MapTable& surface = maps.terms[0].surface;
    surface.maps.count = count;
    surface.maps.data.resize(count * surfaceShape(maps).bytes());
    surface.mapOf[1] = static_cast<uint32_t>(count - 1);
    surface.mapOf[2] = kNoMap;
    EXPECT_EQ(indexBytes(surface), count < 65535 ? 2u : 4u);
    EXPECT_EQ(parseMaps(mapsBytes(maps), maps.mesh).terms[0].surface.mapOf, surface.mapOf);
  }
}

TEST(LfmFile, DamageIsRefusedOrStillALightField) {
  const std::vector<std::byte> bytes = mapsBytes(sample());
  tryDamage(bytes, [&](std::span<const std::byte> damaged) {
    const LightFieldMaps maps = parseMaps(damaged, squarePatch(2));
    ASSERT_LE(maps.terms.size(), 2u);
    ASSERT_LE(bytesOf(maps).total(), bytes.size());
    EXPECT_TRUE(radianceAt(maps, {0, 0.2, 0.3}, {0, 0, 1}, 2).allFinite());
  });
}

TEST(LfmFile, ErrorsNameTheField) {
  EXPECT_EQ(errorWith([](LightFieldMaps& m) { m.terms[1].scale[3] = -1; }),
            "terms[1].scale[3]: found -1, expected a finite number of at least 0");
  EXPECT_EQ(errorWith([](LightFieldMaps& m) { m.meanWhite = std::numeric_limits<float>::infinity(); }),
            "meanWhite: found inf, expected a finite number of at least 1e-30");
  EXPECT_EQ(errorWith([](LightFieldMaps& m) { m.terms[1].surface.mapOf[4] = 8; }),
            "terms[1].surface.mapOf[4]: found 8, expected below 8");
  EXPECT_EQ(errorWith([](LightFieldMaps& m) { m.frames[2].x *= 1.001; }),
            "frames[2]: axes are not unit vectors at right angles");
  EXPECT_EQ(errorWith([](LightFieldMaps& m) { m.frames[2].z[1] = std::numeric_limits<double>::quiet_NaN(); }),
            "frames[2].axes[4]: found nan, expected a finite number");
  EXPECT_EQ(errorWith([](LightFieldMaps& m) { m.samples = 257; }), "samples: found 257, expected 2..256");
  EXPECT_EQ(errorWith([](LightFieldMaps& m) { m.higherViewSize = 1; }),
            "higherViewSize: found 1, expected 2..256");
  std::vector<std::byte> bytes = mapsBytes(sample());
  const uint64_t vertices = 10;
  std::memcpy(&bytes[8], &vertices, sizeof vertices);
  EXPECT_EQ(errorOfBytes(bytes), "vertices: found 10, expected 9");
}

TEST(LfmFile, AFolderIsReadAgainAndDamageIsNoticed) {
  const image::TemporaryFolder folder;
  studio::photograph({.cameras = 3, .lights = 0, .size = 24}, folder / "capture");
  const LightFieldMaps maps = sample();
  writeMaps(maps, capture::readCapture(folder / "capture"), folder / "maps");
  const OpenedMaps opened = openMaps(folder / "maps");
  EXPECT_EQ(mapsBytes(opened.maps), mapsBytes(maps));
  EXPECT_EQ(opened.maps.mesh.triangles, maps.mesh.triangles);
  EXPECT_EQ(opened.folder.rig().views.size(), 3u);
  EXPECT_EQ(opened.folder.count("terms", 0, 9), 2u);

  writeMaps(opened.maps, opened.folder, folder / "again");
  for (const char* name : {"manifest.json", "transforms.json", "mesh.bin", kMapsFile})
    EXPECT_EQ(readFile((folder / "again") / name), readFile((folder / "maps") / name)) << name;

  std::string content = readFile((folder / "maps") / kMapsFile);
  content[content.size() / 2] ^= 1;
  image::writeBytes((folder / "maps") / kMapsFile, content);
  const std::string error = image::errorOf([&] { openMaps(folder / "maps"); });
  EXPECT_NE(error.find("maps.bin: checksum"), std::string::npos) << error;
  EXPECT_THROW(openMaps(folder / "capture"), Error);
}

} // namespace
} // namespace surflect::lfm
