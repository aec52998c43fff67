#include "render/lightfield/common/light_field_folder.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace surflect::lightfield {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "surflect test field";

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TriangleMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0.1f}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

class LightFieldFolderTest : public ::testing::Test {
protected:
  void write(const Numbers& numbers = {{"regions", 7}, {"texel_size", 0.25}}) const {
    LightFieldWriter writer(folder_, kFormat, 3);
    writeFileAtomically(writer.file("field.bin"), "twelve bytes");
    writer.commit(rig_, tetrahedron(), numbers);
  }
  LightFieldFolder open() const { return {folder_, kFormat, 3}; }
  // The line of the Error that opening the folder and checking its file throws; empty if it throws none.
  std::string complaint() const {
    try {
      open().checked("field.bin");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  const image::TemporaryFolder root_;
  const fs::path folder_ = root_ / "out";
  capture::Capture rig_ = studio::photograph({.cameras = 3, .lights = 0, .size = 24}, root_ / "views");
};

TEST_F(LightFieldFolderTest, MoreThanTheDiskHoldsIsRefused) {
  requireDisk(folder_, 1, "a byte"); // in a folder that is not there yet
  const std::string error = image::errorOf([&] { requireDisk(folder_, 1e18, "six slabs"); });
  EXPECT_TRUE(error.starts_with("needs 931322574.6 GiB on disk for six slabs, but ")) << error;
  EXPECT_TRUE(error.ends_with(" GiB are free at " + folder_.string())) << error;
}

TEST_F(LightFieldFolderTest, GivesBackWhatWasWritten) {
  write();
  const LightFieldFolder folder = open();
  EXPECT_EQ(folder.mesh().positions, tetrahedron().positions);
  EXPECT_EQ(folder.mesh().triangles, tetrahedron().triangles);
  EXPECT_EQ(folder.rig().views.size(), 3u);
  EXPECT_EQ(folder.count("regions", 1, 10), 7u);
  EXPECT_EQ(folder.number("texel_size", 0, 1), 0.25);
  EXPECT_EQ(readFile(folder.file("field.bin")), "twelve bytes");
  folder.checked("field.bin");
}

TEST_F(LightFieldFolderTest, KeepsNoHeldOutView) {
  rig_.frames[1].split = capture::Split::test;
  write();
  EXPECT_EQ(open().rig().views.size(), 2u);
  EXPECT_EQ(open().rig().views[1].identity, rig_.views[2].identity);
}

TEST_F(LightFieldFolderTest, EqualContentHasEqualIdentity) {
  write();
  const uint64_t first = open().identity();
  write();
  EXPECT_EQ(open().identity(), first);
  write({{"regions", 8}, {"texel_size", 0.25}});
  EXPECT_NE(open().identity(), first);
}

TEST_F(LightFieldFolderTest, AnUnfinishedFolderIsRefusedAndTakenOver) {
  { LightFieldWriter writer(folder_, kFormat, 3); }
  EXPECT_TRUE(contains(complaint(), "unfinished light field"));
  write();
  EXPECT_EQ(complaint(), "");
}

TEST_F(LightFieldFolderTest, OtherFoldersAreNotOverwritten) {
  EXPECT_THROW(LightFieldWriter(root_ / "views", kFormat, 3), Error);
  EXPECT_TRUE(fs::exists(root_ / "views" / "transforms.json"));
}

TEST_F(LightFieldFolderTest, RefusesAnotherFormatOrVersion) {
  write();
  EXPECT_THROW(LightFieldFolder(folder_, "surflect other field", 3), Error);
  EXPECT_THROW(LightFieldFolder(folder_, kFormat, 4), Error);
}

TEST_F(LightFieldFolderTest, NumbersAreChecked) {
  write();
  const LightFieldFolder folder = open();
  EXPECT_THROW(folder.count("regions", 8, 10), Error);
  EXPECT_THROW(folder.count("texel_size", 0, 1), Error);
  EXPECT_THROW(folder.number("absent", 0, 1), Error);
}

TEST_F(LightFieldFolderTest, EveryTruncationIsRefused) {
  write();
  for (const char* name : {"manifest.json", "transforms.json", "mesh.bin", "field.bin"}) {
    const std::string whole = readFile(folder_ / name);
    for (size_t length = 0; length + 1 < whole.size(); length += 1 + whole.size() / 10) {
      std::ofstream(folder_ / name, std::ios::binary) << whole.substr(0, length);
      EXPECT_TRUE(contains(complaint(), name)) << name << " cut to " << length << ": " << complaint();
    }
    std::ofstream(folder_ / name, std::ios::binary) << whole;
  }
  EXPECT_EQ(complaint(), "");
}

TEST_F(LightFieldFolderTest, EveryChangedByteIsRefused) {
  write();
  for (const char* name : {"manifest.json", "mesh.bin", "field.bin"}) {
    const std::string whole = readFile(folder_ / name);
    for (size_t i = 0; i + 2 < whole.size(); i += 1 + whole.size() / 20) {
      std::string changed = whole;
      changed[i] = static_cast<char>(changed[i] ^ 1);
      std::ofstream(folder_ / name, std::ios::binary) << changed;
      // White space between the manifest's fields may change freely.
      const bool isSpace = whole[i] == ' ' || whole[i] == '\n';
      EXPECT_TRUE(isSpace || !complaint().empty()) << name << " byte " << i;
    }
    std::ofstream(folder_ / name, std::ios::binary) << whole;
  }
}

TEST_F(LightFieldFolderTest, CannotNameFilesOutsideItself) {
  LightFieldWriter writer(folder_, kFormat, 3);
  writeFileAtomically(writer.file("../escaped.bin"), "x");
  writer.commit(rig_, tetrahedron(), {});
  EXPECT_TRUE(contains(complaint(), "leads out of the folder"));
}

} // namespace
} // namespace surflect::lightfield
