#include "srf/capture/file_names.h"

#include "tests/srf/image/files.h"

namespace surflect::capture {
namespace {

constexpr const char* kComposed = "K\xc3\xb6ln \xc5\x81\xc3\xa9.png";        // NFC
constexpr const char* kDecomposed = "Ko\xcc\x88ln \xc5\x81\x65\xcc\x81.png"; // NFD

TEST(FileNames, FoldLetterCaseAndAccents) {
  EXPECT_EQ(foldedName(kComposed), foldedName(kDecomposed));
  EXPECT_EQ(foldedName("\xc3\x84Rger.PNG"), "arger.png");
  EXPECT_NE(foldedName("a.png"), foldedName("b.png"));
  EXPECT_NE(foldedName("\xe5\x9b\xbe.png"), foldedName("\xe5\x9b\xbd.png"));
}

TEST(FileNames, AFileIsFoundByOneLikeIt) {
  image::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "Images");
  image::writeBytes(folder.path() / "Images" / kDecomposed, "");
  EXPECT_EQ(similarFile(folder.path(), std::filesystem::path("images") / kComposed),
            std::filesystem::path("Images") / kDecomposed);
  EXPECT_EQ(similarFile(folder.path(), "images/other.png"), std::nullopt);
  std::filesystem::create_directory(folder / "IMAGES"); // two are like it
  EXPECT_EQ(similarFile(folder.path(), std::filesystem::path("images") / kComposed), std::nullopt);
}

TEST(FileNames, APictureIsFoundWithoutItsExtension) {
  image::TemporaryFolder folder;
  image::writeBytes(folder / "a.PNG", "");
  image::writeBytes(folder / "a.txt", "");
  EXPECT_EQ(pictureCalled(folder.path(), "a"), "a.PNG");
  EXPECT_EQ(pictureCalled(folder.path(), "b"), std::nullopt);
  image::writeBytes(folder / "a.CR2", ""); // from which the camera has developed it
  EXPECT_EQ(pictureCalled(folder.path(), "a"), "a.PNG");
  image::writeBytes(folder / "c.dng", "");
  EXPECT_EQ(pictureCalled(folder.path(), "c"), "c.dng");
  image::writeBytes(folder / "a.tif", "");
  EXPECT_EQ(pictureCalled(folder.path(), "a"), std::nullopt);
}

TEST(FileNames, BytesThatAreNotUtf8AreShown) {
  EXPECT_TRUE(isUtf8(kComposed) && isUtf8(kDecomposed) && isUtf8(""));
  EXPECT_EQ(escapedName(kComposed), kComposed);
  for (const char* name : {"K\xf6ln.png", "\xc3", "\xff"}) EXPECT_FALSE(isUtf8(name));
  EXPECT_EQ(escapedName("K\xf6ln.png"), "K\\xf6ln.png");
}

} // namespace
} // namespace surflect::capture
