#include "render/lightfield/slf/open_field.h"

#include "render/lightfield/slf/build.h"
#include "render/lightfield/slf/field_file.h"
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
