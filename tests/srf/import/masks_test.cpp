#include "srf/import/masks.h"

#include "srf/import/import.h"
#include "tests/srf/import/vision_camera.h"

#include <nlohmann/json.hpp>

namespace surflect::importers {
namespace {

// Photographs that a JSON file names, and what lies beside them.
class MasksByName : public ::testing::Test {
protected:
  nlohmann::json& add(const std::string& picture) {
    writePicture(folder / picture);
    json["frames"].push_back(
        {{"file_path", picture},
         {"camera", picture},
         {"transform_matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}});
    return json["frames"].back();
  }
  // White is one column.
  void writeMask(const std::string& name, int column = 8) const {
    std::filesystem::create_directories((folder / name).parent_path());
    image::Image mask(16, 12, 1);
    for (int y = 3; y < 9; ++y) mask.at(column, y)[0] = 1;
    image::writePng(folder / name, mask);
  }
  // The masks of the frames in the output, one after the other.
  std::string import(const ImportOptions& options = {}) {
    image::writeBytes(folder / "transforms.json", json.dump());
    std::filesystem::remove_all(folder / "out");
    notes = importCapture(folder.path(), folder / "out", options).notes;
    std::string masks;
    for (const capture::Frame& frame : capture::readCapture(folder / "out").frames)
      masks += frame.mask.string() + " ";
    return masks;
  }
  bool noted(const std::string& part) const {
    return std::ranges::any_of(notes, [&](const std::string& note) { return note.find(part) != note.npos; });
  }

  image::TemporaryFolder folder;
  nlohmann::json json{{"fl_x", 20}};
  std::vector<std::string> notes;
};

TEST_F(MasksByName, AreNamedByFileByStemOrWithASuffix) {
  for (const char* picture : {"images/a.png", "images/b.png"}) add(picture);
  const auto of = [](const std::string& pattern, const char* name) {
    return std::string(pattern).replace(pattern.find('*'), 1, name);
  };
  // In the source, and below masks/ of the output.
  const std::pair<const char*, const char*> patterns[] = {{"masks/*.png.png", "*.png.png"},
                                                          {"masks/*.png", "*.png"},
                                                          {"mask/*_mask.png", "mask/*_mask.png"},
                                                          {"mask/mask_*.png", "mask/mask_*.png"},
                                                          {"images/masks/*.png", "images/masks/*.png"},
                                                          {"images/mask/*.png.png", "images/mask/*.png.png"},
                                                          {"masks/*.png.mask.png", "*.png.mask.png"},
                                                          {"images/*_mask.png", "images/*_mask.png"},
                                                          {"images/*.png.mask.png", "images/*.png.mask.png"}};
  for (const auto& [pattern, output] : patterns) {
    const std::string a = of(pattern, "a"), b = of(pattern, "b");
    writeMask(a, 3);
    writeMask(b, 12);
    const std::string outputA = "masks/" + of(output, "a"), outputB = "masks/" + of(output, "b");
    EXPECT_EQ(import(), outputA + " " + outputB + " ");
    EXPECT_EQ(readFile(folder / "out" / outputA), readFile(folder / a));
    EXPECT_EQ(readFile(folder / "out" / outputB), readFile(folder / b));
    EXPECT_TRUE(noted("2 masks found by name for 2 of 2 photographs: " + a + " for images/a.png, " + b +
                      " for images/b.png"))
        << pattern;
    for (const std::string& mask : {a, b}) std::filesystem::remove(folder / mask);
  }
  EXPECT_EQ(import(), "  ");
}

TEST_F(MasksByName, ThatFitNothingOrAreSeveralAreTold) {
  for (const char* picture : {"images/a.png", "images/b.png"}) add(picture);
  for (const char* mask : {"masks/a.png", "masks/a_mask.png", "masks/c.png", "masks/._a.png"})
    writeMask(mask);
  EXPECT_EQ(import(), "masks/a.png  ");
  EXPECT_TRUE(noted("several masks fit 1 photograph by name; taken: masks/a.png, not a_mask.png"));
  EXPECT_TRUE(noted("files among masks that are not used: 2 (masks/a_mask.png, masks/c.png)"));
  EXPECT_TRUE(noted("warning: masks: 1 of 2 views; the other one shows all of its picture (images/b.png)"));
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
  EXPECT_EQ(image::readPng(folder / "out/masks/a.png").image.at(8, 5)[0], 1);
  ImportOptions options;
  options.invertMasks = true;
  import(options);
  EXPECT_EQ(image::readPng(folder / "out/masks/a.png").image.at(8, 5)[0], 0);
  EXPECT_EQ(image::readPng(folder / "out/masks/a.png").image.at(0, 0)[0], 1);
  std::filesystem::remove(folder / "masks/a.png");
  EXPECT_NE(image::errorOf([&] { import(options); }).find("--invert-masks: the source has no masks"),
            std::string::npos);
}

TEST_F(MasksByName, PicturesThatNoFrameNamesAreTold) {
  add("images/a.png");
  for (const char* other : {"images/b.png", "images/a_normal.png", "images/.hidden.png"})
    writePicture(folder / other);
  image::writeBytes(folder / "images/c.JPE", "told by its name alone");
  import();
  EXPECT_TRUE(noted("pictures beside the photographs that are not used: 3 (images/a_normal.png, "
                    "images/b.png, images/c.JPE)"));
}

TEST_F(MasksByName, InFoldersOfOtherNamesAreTold) {
  for (const char* picture : {"train/a.png", "train/b.png"}) add(picture);
  for (const char* mask : {"train_mask/a.png", "train_mask/b.png", "depth/a.png"}) writeMask(mask);
  EXPECT_EQ(import(), "  ");
  EXPECT_TRUE(
      noted("2 pictures of train_mask/ have the names of photographs, but masks are looked up in masks/ "
            "alone: if these are masks, rename the folder to train/masks/"));
  EXPECT_FALSE(noted("depth"));
  std::filesystem::rename(folder / "train_mask", folder / "train/masks");
  EXPECT_EQ(import(), "masks/train/masks/a.png masks/train/masks/b.png ");
  EXPECT_FALSE(noted("looked up"));
}

} // namespace
} // namespace surflect::importers
