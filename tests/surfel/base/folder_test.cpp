#include "surfel/base/folder.h"

#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

namespace surflect {

namespace {

namespace fs = std::filesystem;

TEST(Folder, IsThereWithThoseItLiesInUntilItIsRemoved) {
  const image::TemporaryFolder folder;
  createFolder(folder / "a/b/c");
  EXPECT_TRUE(fs::is_directory(folder / "a/b/c"));
  createFolder(folder / "a/b");
  image::writeBytes(folder / "a/b/file", "x");
  removeFolder(folder / "a");
  EXPECT_FALSE(fs::exists(folder / "a"));
  removeFolder(folder / "a");
}

TEST(Folder, NameIsItsOwnHoweverThePathIsWritten) {
  for (const char* path : {"a/vase", "a/vase/", "vase", "/vase", "a/b/../vase/.", "a/vase//"})
    EXPECT_EQ(folderName(path), "vase") << path;
  EXPECT_EQ(folderName("."), fs::current_path().filename().string());
}

TEST(Folder, OneThatCannotBeIsNamed) {
  const image::TemporaryFolder folder;
  image::writeBytes(folder / "file", "x");
  const std::string line = image::errorOf([&] { createFolder(folder / "file/b"); });
  EXPECT_TRUE(line.starts_with((folder / "file/b").string() + ": cannot be created (")) << line;
}

TEST(Folder, ThatOneCannotBeIsKnownWithoutMakingIt) {
  const image::TemporaryFolder folder;
  image::writeBytes(folder / "file", "x");
  EXPECT_EQ(image::errorOf([&] { requireCreatable(folder / "file/b/c"); }),
            (folder / "file/b/c").string() + ": cannot be created (" + (folder / "file").string() +
                " is not a folder)");
  requireCreatable(folder / "a/b");
  requireCreatable(folder.path());
  EXPECT_FALSE(fs::exists(folder / "a"));
}

} // namespace

namespace {

const FolderIdentity kOurs = {"test.identity", "ours\n", "is of another test"};

TEST(ResumableFolder, IsClaimedOnceAndResumedByTheSameIdentityAlone) {
  const image::TemporaryFolder folder;
  const std::filesystem::path output = folder / "a/b";
  requireResumable(output, kOurs);
  claimFolder(output, kOurs);
  image::writeBytes(output / "images/kept.exr", "kept");
  requireResumable(output, kOurs);
  claimFolder(output, kOurs);
  EXPECT_EQ(image::contentOf(output),
            (std::map<std::string, std::string>{{"images/kept.exr", "kept"}, {"test.identity", "ours\n"}}));
  const FolderIdentity theirs = {"test.identity", "theirs\n", "is of another test"};
  EXPECT_NE(image::errorOf([&] { requireResumable(output, theirs); }).find("is of another test: give"),
            std::string::npos);
}

TEST(ResumableFolder, AFolderOfOtherFilesIsRefused) {
  const image::TemporaryFolder folder;
  EXPECT_NO_THROW(requireResumable(folder.path(), kOurs));
  image::writeBytes(folder / "mine.txt", "mine");
  EXPECT_THROW(requireResumable(folder.path(), kOurs), Error);
  EXPECT_THROW(requireResumable(folder / "mine.txt", kOurs), Error);
}

} // namespace

} // namespace surflect
