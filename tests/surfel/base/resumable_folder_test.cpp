#include "surfel/base/resumable_folder.h"

#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

namespace surflect {
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
