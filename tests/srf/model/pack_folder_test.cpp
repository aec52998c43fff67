#include "srf/model/pack_folder.h"

#include "srf/model/model.h"
#include "tests/srf/image/files.h"

namespace surflect::model {
namespace {

namespace fs = std::filesystem;

// A view of 19 x 13 pixels under three lights.
codec::EncodedView encodedView(unsigned seed) {
  codec::ReflectanceStack stack{19, 13, {}, {}};
  stack.alpha = image::randomImage(19, 13, 1, 0, 1, seed);
  for (unsigned light = 1; light <= 3; ++light)
    stack.lights.push_back(image::randomImage(19, 13, 3, 0, 1, seed + light));
  return codec::encodeView(stack, {});
}

class PackFolder : public ::testing::Test {
protected:
  image::TemporaryFolder folder;
};

TEST_F(PackFolder, WhatAnInterruptedRunMayHaveLeftIsTakenOver) {
  claimPackFolder(folder / "new");
  fs::create_directory(folder / "empty");
  claimPackFolder(folder / "empty");
  claimPackFolder(folder / "new"); // subfolders exist now
  writeFileAtomically(folder / "new" / packIdentityPath(), "as it was made");
  image::writeBytes(folder / "new" / "surfels.ply", "");
  claimPackFolder(folder / "new");
  EXPECT_EQ(readFile(folder / "new" / packIdentityPath()), "as it was made");
}

TEST_F(PackFolder, WhatIsNotItsOwnIsLeftAlone) {
  image::writeBytes(folder / "transforms.json", "{}");
  EXPECT_NE(image::errorOf([&] { claimPackFolder(folder.path()); }).find("is not a model"),
            std::string::npos);
  EXPECT_EQ(image::contentOf(folder.path()).size(), 1u);
  EXPECT_NE(image::errorOf([&] { claimPackFolder(folder / "transforms.json"); }).find("transforms.json"),
            std::string::npos);
}

TEST_F(PackFolder, AViewComesBackWithWhatItLost) {
  claimPackFolder(folder.path());
  for (size_t view = 0; view < 3; ++view) {
    const codec::EncodedView encoded = encodedView(static_cast<unsigned>(10 * view));
    EXPECT_FALSE(finishedView(folder.path(), view));
    writeView(folder.path(), view, encoded);
    const auto found = finishedView(folder.path(), view);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->squaredError, encoded.summary.squaredError);
    EXPECT_EQ(found->clippedSquaredError, encoded.summary.clippedSquaredError);
    EXPECT_EQ(found->values, encoded.summary.values);
    EXPECT_EQ(found->objectTexels, encoded.summary.objectTexels);
    EXPECT_EQ(found->blocksOfRank, encoded.summary.blocksOfRank);
    EXPECT_EQ(found->fileBytes, encoded.summary.fileBytes);
  }
  removeViews(folder.path());
  for (size_t view = 0; view < 3; ++view) EXPECT_FALSE(finishedView(folder.path(), view));
}

TEST_F(PackFolder, NoPartOfAViewIsFinished) {
  claimPackFolder(folder.path());
  writeView(folder.path(), 0, encodedView(1));
  const auto whole = image::contentOf(folder.path());
  ASSERT_EQ(whole.size(), 2u);
  for (const auto& [name, bytes] : whole) {
    for (size_t length = 0; length < bytes.size(); length += 1 + length / 8) {
      image::writeBytes(folder / name, bytes.substr(0, length));
      EXPECT_FALSE(finishedView(folder.path(), 0)) << name << ": " << length;
    }
    fs::remove(folder / name);
    EXPECT_FALSE(finishedView(folder.path(), 0)) << name;
    image::writeBytes(folder / name, bytes);
  }
  EXPECT_TRUE(finishedView(folder.path(), 0));
}

TEST_F(PackFolder, OnlyViewsAndTheSurveyAreRemoved) {
  claimPackFolder(folder.path());
  writeView(folder.path(), 7, encodedView(1));
  for (const fs::path& path :
       {packIdentityPath(), surveyPath(), fs::path("views/notes"), fs::path("views/12.srfb")})
    image::writeBytes(folder / path.string(), "x");
  removeViews(folder.path());
  std::vector<std::string> left;
  for (const auto& [name, bytes] : image::contentOf(folder.path())) left.push_back(name);
  EXPECT_EQ(left, (std::vector<std::string>{"views/12.srfb", "views/identity", "views/notes"}));
}

} // namespace
} // namespace surflect::model
