#include "render/lightfield/slf/open_field.h"

#include "render/lightfield/slf/build.h"
#include "render/lightfield/slf/field_file.h"
#include "render/lightfield/slf/texture_file.h"
#include "srf/image/half_float.h"
#include "tests/support/box_capture.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace surflect::slf {
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

TEST_F(OpenField, ADamagedFieldFileIsRefusedByName) {
  std::string content = readFile(folder / kFieldFile);
  content[content.size() / 2] ^= 1;
  image::writeBytes(folder / kFieldFile, content);
  EXPECT_NE(error().find("field.bin"), std::string::npos);
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

TEST_F(OpenField, TexelsThatAreNotFiniteAreRefusedWhenTheyAreRead) {
  std::string content = readFile(folder / kTexturesFile);
  content[1] = 0x7c; // the first half float becomes infinite or NaN
  image::writeBytes(folder / kTexturesFile, content);
  const OpenedField opened = openField(folder);
  const std::string message = image::errorOf([&] {
    for (size_t region = 0; region < 6; ++region)
      for (size_t i = 0; i < 6; ++i) opened.textures->read(region, i);
  });
  EXPECT_NE(message.find("has a texel that is not finite"), std::string::npos);
}

} // namespace
} // namespace surflect::slf
