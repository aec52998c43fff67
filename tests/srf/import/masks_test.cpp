#include "srf/import/masks.h"

#include "srf/import/import.h"
#include "tests/srf/import/vision_camera.h"

#include <nlohmann/json.hpp>

namespace surflect {
namespace {

// Photographs that a JSON file names, and what lies beside them.
class MasksByName : public testing::Test {
protected:
  nlohmann::json& add(const std::string& picture) {
    writePicture(folder / picture);
    json["frames"].push_back(
        {{"file_path", picture},
         {"camera", picture},
         {"transform_matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}});
    return json["frames"].back();
  }
  void writeMask(const std::string& name) const {
    std::filesystem::create_directories((folder / name).parent_path());
    Image mask(16, 12, 1);
    for (int y = 3; y < 9; ++y) mask.at(8, y)[0] = 1;
    writePng(folder / name, mask);
  }
  // The notes, and the masks of the frames as the source has them, one after the other.
  std::string import(const ImportOptions& options = {}) {
    writeBytes(folder / "transforms.json", json.dump());
    std::filesystem::remove_all(folder / "out");
    notes = importCapture(folder.path(), folder / "out", options).notes;
    std::string masks;
    for (const Frame& frame : readCapture(folder / "out").frames) masks += frame.mask.string() + " ";
    return masks;
  }
  bool noted(const std::string& part) const {
    return std::ranges::any_of(notes, [&](const std::string& note) { return note.find(part) != note.npos; });
  }

  TemporaryFolder folder;
  nlohmann::json json{{"fl_x", 20}};
  std::vector<std::string> notes;
};

TEST_F(MasksByName, AreNamedByFileByStemOrWithASuffix) {
  add("images/a.png");
  for (const char* mask :
       {"masks/a.png.png", "masks/a.png", "mask/a_mask.png", "mask/mask_a.png", "images/masks/a.png",
        "images/mask/a.png.png", "masks/a.png.mask.png", "images/a_mask.png", "images/a.png.mask.png"}) {
    writeMask(mask);
    EXPECT_NE(import().find("a"), std::string::npos) << mask;
    EXPECT_TRUE(
        noted("1 mask found by name for 1 of 1 photograph: " + std::string(mask) + " for images/a.png"))
        << mask;
    std::filesystem::remove(folder / mask);
  }
  EXPECT_EQ(import(), " ");
}

TEST_F(MasksByName, ThatFitNothingOrAreSeveralAreTold) {
  for (const char* picture : {"images/a.png", "images/b.png"}) add(picture);
  for (const char* mask : {"masks/a.png", "masks/a_mask.png", "masks/c.png", "masks/._a.png"})
    writeMask(mask);
  EXPECT_EQ(import(), "masks/a.png  ");
  EXPECT_TRUE(noted("several masks fit 1 photograph by name; taken: masks/a.png, not a_mask.png"));
  EXPECT_TRUE(noted("files among masks that are not used: 2 (masks/a_mask.png, masks/c.png)"));
  EXPECT_TRUE(noted("masks: 1 of 2 views; the other one shows all of its picture (images/b.png)"));
}

TEST_F(MasksByName, ThatSeveralViewsCouldClaimAreLeft) {
  for (const char* picture : {"left/a.png", "right/a.png"}) add(picture);
  writeMask("masks/a.png");
  EXPECT_EQ(import(), "  ");
  EXPECT_TRUE(noted("photographs of several views have, which are not used: 1 (masks/a.png)"));
  json["frames"][1]["camera"] = "left/a.png"; // one view, twice
  json["frames"][1]["exposure"] = 2;
  EXPECT_EQ(import(), "masks/a.png ");
}

TEST_F(MasksByName, AreToldButLeftWhereTheFileNamesOthers) {
  for (const char* picture : {"images/a.png", "images/b.png"}) add(picture);
  for (const char* mask : {"masks/a.png", "masks/b.png"}) writeMask(mask);
  json["frames"][0]["mask_path"] = "masks/a.png";
  EXPECT_EQ(import(), "masks/a.png  ");
  EXPECT_TRUE(noted("masks of 1 photograph that the source names no mask for are not used"));
}

TEST_F(MasksByName, AreInvertedOnlyWhenAsked) {
  add("images/a.png");
  writeMask("masks/a.png");
  import();
  EXPECT_EQ(readPng(folder / "out/masks/a.png").image.at(8, 5)[0], 1);
  ImportOptions options;
  options.invertMasks = true;
  import(options);
  EXPECT_EQ(readPng(folder / "out/masks/a.png").image.at(8, 5)[0], 0);
  EXPECT_EQ(readPng(folder / "out/masks/a.png").image.at(0, 0)[0], 1);
  std::filesystem::remove(folder / "masks/a.png");
  EXPECT_NE(errorOf([&] { import(options); }).find("--invert-masks: the source has no masks"),
            std::string::npos);
}

TEST_F(MasksByName, PicturesThatNoFrameNamesAreTold) {
  add("images/a.png");
  for (const char* other : {"images/b.png", "images/a_normal.png", "images/.hidden.png"})
    writePicture(folder / other);
  import();
  EXPECT_TRUE(
      noted("pictures beside the photographs that are not used: 2 (images/a_normal.png, images/b.png)"));
}

} // namespace
} // namespace surflect
