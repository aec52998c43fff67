#include "render/lightfield/slf/field_file.h"

#include "render/lightfield/slf/build.h"
#include "srf/image/half_float.h"
#include "tests/srf/image/files.h"
#include "tests/support/box_capture.h"
#include "tests/support/damage.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace surflect::slf {

namespace {

constexpr int kStoredSide = 4;
constexpr uint64_t kTexels = 6 * 5 * kStoredSide * kStoredSide;

struct Sample {
  Field field;
  TexturePlaces places;
};

// A cube with six regions; two of them have their own directions. Five textures of each are stored.
Sample sample() {
  Sample result;
  result.field.mesh = boxes::unitCube();
  result.field.directionMeshes.emplace_back(octahedronDirections(0));
  result.field.directionMeshes.emplace_back(octahedronDirections(1));
  uint64_t place = 0;
  for (Chart& chart : boxes::faceCharts(result.field.mesh, kStoredSide)) {
    const auto mesh = static_cast<uint32_t>(result.field.regions.size() % 3 == 1);
    result.field.regions.push_back({std::move(chart), mesh});
    auto& places =
        result.places.emplace_back(result.field.directionMeshes[mesh].directions().size(), kNotStored);
    for (size_t i = 0; i < 5; ++i) places[i] = std::exchange(place, place + kStoredSide * kStoredSide);
  }
  return result;
}

std::vector<std::byte> bytesOf(const Sample& sample) { return fieldBytes(sample.field, sample.places); }

std::string errorOfBytes(std::span<const std::byte> bytes, uint64_t texels = kTexels) {
  return image::errorOf([&] { parseField(bytes, boxes::unitCube(), texels); });
}

// The error of a sample with one thing changed.
std::string errorWith(const std::function<void(Sample&)>& change) {
  Sample changed = sample();
  change(changed);
  return errorOfBytes(bytesOf(changed));
}

TEST(FieldFile, ReadingReturnsWhatWasWritten) {
  const Sample before = sample();
  const StoredField after = parseField(bytesOf(before), boxes::unitCube(), kTexels);
  EXPECT_EQ(after.places, before.places);
  EXPECT_EQ(after.field.mesh.triangles, before.field.mesh.triangles);
  ASSERT_EQ(after.field.directionMeshes.size(), before.field.directionMeshes.size());
  for (size_t i = 0; i < before.field.directionMeshes.size(); ++i) {
    EXPECT_TRUE(std::ranges::equal(after.field.directionMeshes[i].directions(),
                                   before.field.directionMeshes[i].directions()));
    EXPECT_TRUE(std::ranges::equal(after.field.directionMeshes[i].triangles(),
                                   before.field.directionMeshes[i].triangles()));
  }
  ASSERT_EQ(after.field.regions.size(), before.field.regions.size());
  for (size_t i = 0; i < before.field.regions.size(); ++i) {
    const Region &a = after.field.regions[i], &b = before.field.regions[i];
    EXPECT_EQ(a.directionMesh, b.directionMesh);
    EXPECT_EQ(a.chart.vertices, b.chart.vertices);
    EXPECT_EQ(a.chart.coordinates, b.chart.coordinates);
    EXPECT_EQ(a.chart.triangles, b.chart.triangles);
    EXPECT_EQ(a.chart.meshTriangles, b.chart.meshTriangles);
    EXPECT_EQ(a.chart.width, b.chart.width);
    EXPECT_EQ(a.chart.height, b.chart.height);
  }
  EXPECT_EQ(fieldBytes(after.field, after.places), bytesOf(before));
}

TEST(FieldFile, DamageIsRefusedOrStillAValidField) {
  tryDamage(bytesOf(sample()), [](std::span<const std::byte> damaged) {
    const StoredField stored = parseField(damaged, boxes::unitCube(), kTexels);
    size_t triangles = 0;
    for (const Region& region : stored.field.regions) {
      triangles += region.chart.meshTriangles.size();
      ASSERT_LT(region.directionMesh, stored.field.directionMeshes.size());
      for (const Vec2<float>& uv : region.chart.coordinates)
        ASSERT_TRUE(uv.minCoeff() >= 0 && uv.maxCoeff() <= 1);
    }
    ASSERT_EQ(triangles, 12u);
  });
}

TEST(FieldFile, ErrorsNameTheField) {
  static constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(errorWith([](Sample& s) {
              s.field.regions[1].chart.coordinates[2] = {kNan, 0.5f};
            }),
            "regions[1].coordinates[2]: found nan, expected 0..1");
  EXPECT_EQ(errorWith([](Sample& s) {
              s.field.regions[1].chart.coordinates[0] = {0.5f, 1.5f};
            }),
            "regions[1].coordinates[0]: found 1.5, expected 0..1");
  EXPECT_EQ(errorWith([](Sample& s) { s.field.regions[2].directionMesh = 2; }),
            "regions[2].directionMesh: found 2, expected 0..1");
  EXPECT_EQ(errorWith([](Sample& s) { s.field.regions[0].chart.width = 0; }),
            "regions[0].width: found 0, expected 1..16384");
  EXPECT_EQ(errorWith([](Sample& s) { s.field.regions[0].chart.vertices[1] = 8; }),
            "regions[0].vertices[1]: found 8, expected 0..7");
  EXPECT_EQ(errorWith([](Sample& s) { s.field.regions[0].chart.triangles[1][0] = 4; }),
            "regions[0].triangles[1]: found 4, expected 0..3");
  EXPECT_EQ(errorWith([](Sample& s) { s.field.regions[0].chart.meshTriangles[1] = 12; }),
            "regions[0].meshTriangles[1]: found 12, expected 0..11");
  EXPECT_EQ(errorWith([](Sample& s) {
              std::swap(s.field.regions[0].chart.vertices[0], s.field.regions[0].chart.vertices[1]);
            }).substr(0, 24),
            "regions[0].triangles[0]:");
  EXPECT_EQ(errorWith([](Sample& s) { s.field.regions[5] = s.field.regions[0]; }).substr(0, 28),
            "regions[5].meshTriangles[0]:");
  EXPECT_EQ(errorWith([](Sample& s) { s.field.regions.pop_back(); }).substr(0, 8), "regions:");
  EXPECT_EQ(errorWith([](Sample& s) { s.places[3][4] = kTexels - kStoredSide * kStoredSide + 1; }),
            "regions[3].textures[4]: found 16 texels at 465, expected within the 480 texels of textures.bin");
  EXPECT_NE(errorOfBytes(bytesOf(sample()), kTexels - 1), "");
}

TEST(FieldFile, DirectionsThatAreNoMeshAreRefused) {
  std::vector<std::byte> bytes = bytesOf(sample());
  const double two = 2;
  std::memcpy(bytes.data() + 9 + 8 + 8, &two, sizeof two); // x of the first direction
  EXPECT_EQ(errorOfBytes(bytes), "directionMeshes[0].directions[0]: found length 2, expected length 1");
}

} // namespace

namespace {

// The folder of a small light field; the same for all tests, and copied where one damages it.
class OpenField : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    made_ = new image::TemporaryFolder();
    boxes::writeCapture(
        boxes::unitCube(),
        [](const auto&, const auto&) {
          return Rgb{1, 2, 3};
        },
        {studio::spiral(12), 24, 0.3}, *made_ / "views");
    const lightfield::Views views(*made_ / "views");
    buildWithCharts(views, boxes::faceCharts(views.mesh(), 4), {.directions = 6}, *made_ / "field");
  }
  static void TearDownTestSuite() { delete made_; }

  OpenField() { std::filesystem::copy(*made_ / "field", folder); }

  std::string error() const {
    return image::errorOf([&] { openField(folder); });
  }

  static image::TemporaryFolder* made_;
  image::TemporaryFolder own;
  std::filesystem::path folder = own / "field";
};

image::TemporaryFolder* OpenField::made_ = nullptr;

TEST_F(OpenField, KeepsTheTrainingViewsAndTheMesh) {
  const OpenedField opened = openField(folder);
  EXPECT_EQ(opened.folder.rig().views.size(), 12u);
  EXPECT_EQ(opened.field.mesh.triangles.size(), 12u);
  EXPECT_EQ(opened.field.regions.size(), 6u);
}

TEST_F(OpenField, DamagedFilesAreRefusedByName) {
  for (const char* name : {kFieldFile, kTexturesFile}) {
    const std::string content = readFile(folder / name);
    std::string damaged = content;
    damaged[content.size() / 2] ^= 1;
    image::writeBytes(folder / name, damaged);
    EXPECT_NE(error().find(std::string(name) + ": checksum: found "), std::string::npos) << error();
    image::writeBytes(folder / name, content);
  }
  openField(folder);
}

TEST_F(OpenField, MissingFilesAreNamed) {
  for (const char* name : {kFieldFile, kTexturesFile}) {
    std::filesystem::rename(folder / name, own / "aside");
    EXPECT_NE(error().find(name), std::string::npos);
    std::filesystem::rename(own / "aside", folder / name);
  }
  openField(folder);
}

TEST_F(OpenField, AShortenedTextureFileIsRefused) {
  const std::string content = readFile(folder / kTexturesFile);
  for (const size_t size : {size_t{0}, size_t{8}, content.size() - 8, content.size() - 1}) {
    image::writeBytes(folder / kTexturesFile, content.substr(0, size));
    EXPECT_NE(error().find("textures.bin"), std::string::npos) << size;
  }
}

TEST_F(OpenField, ATextureFileThatShrinksWhileItIsOpenIsAnError) {
  const OpenedField opened = openField(folder);
  std::filesystem::resize_file(folder / kTexturesFile, 8);
  const std::string message = image::errorOf([&] {
    for (size_t i = 0; i < 6; ++i) opened.textures->read(5, i);
  });
  EXPECT_NE(message.find("textures.bin: texture "), std::string::npos);
  EXPECT_NE(message.find("has become shorter"), std::string::npos);
}

} // namespace

} // namespace surflect::slf
