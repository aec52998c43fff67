#include "apps/viewer/shot_document.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

namespace surflect::viewer {
namespace {

using Json = nlohmann::json;

constexpr const char* kDocumentText = R"(model = "a.srf" # the model
[frames]
first = 1
last = 9
[output]
size = [40, 30]
path = "f.####.exr"
[camera]
position = [[[1, 3], [9, 5]], "t", 1]
look_at = [0, 0, 0]
fov_deg = 30
[[light]]
type = "point"
position = [1, 2, 3]
)";

TEST(ShotDocument, NamesNoFileButThoseOfTheTextAndTheList) {
  const ShotDocument document(kDocumentText, "shot.toml", Vec3<double>::Zero(), {"studio.exr"});
  const auto with = [&](const Json& light) {
    Json values = document.values();
    values["light"].push_back(light);
    return document.edited(values);
  };
  EXPECT_NE(with({{"type", "environment"}, {"image", "studio.exr"}}).find("studio.exr"), std::string::npos);
  for (const char* const file : {"other.exr", "./studio.exr", "../studio.exr", "/etc/passwd", ""})
    EXPECT_THROW(with({{"type", "environment"}, {"image", file}}), Error) << file;
  Json behind = document.values();
  for (const Json& background : {Json("transparent"), Json({0, 0, 1})}) {
    behind["output"]["background"] = background;
    EXPECT_NO_THROW(document.edited(behind)) << background;
  }
  behind["output"]["background"] = "/etc/passwd.png";
  EXPECT_THROW(document.edited(behind), Error);
  Json values = document.values();
  values["object"] = {{{"model", "b.srf"}}};
  EXPECT_THROW(document.edited(values), Error);
}

TEST(ShotDocument, SavesUnlessTheFileHasBeenChanged) {
  const image::TemporaryFolder folder;
  const auto path = folder / "shot.toml";
  writeFileAtomically(path, std::string_view(kDocumentText));
  ShotDocument document(kDocumentText, path, Vec3<double>::Zero(), {});
  Json values = document.values();
  values["camera"]["fov_deg"] = 25;
  EXPECT_EQ(document.save(values), 1u);
  EXPECT_EQ(document.values(), values);
  EXPECT_EQ(document.saves(), 1u);
  EXPECT_EQ(document.text(), kDocumentText);
  EXPECT_EQ(readFile(path), document.edited(values));
  writeFileAtomically(path, std::string_view("changed"));
  EXPECT_THROW(document.save(values), Error);
  EXPECT_EQ(readFile(path), "changed");
  EXPECT_EQ(document.saves(), 1u);
}

TEST(ShotDocument, AMovableTextHasAbsoluteFiles) {
  const ShotDocument document(kDocumentText, "folder/shot.toml", Vec3<double>::Zero(), {"studio.exr"});
  Json values = document.values();
  values["light"].push_back({{"type", "environment"}, {"image", "studio.exr"}});
  const std::string text = document.movable(values, "b.srf");
  const std::string here = std::filesystem::current_path().string();
  EXPECT_NE(text.find("image = \"" + here + "/folder/studio.exr\""), text.npos) << text;
  EXPECT_NE(text.find("model = \"" + here + "/b.srf\" # the model"), text.npos) << text;
}

TEST(ShotDocument, TracksHaveTheirValues) {
  const ShotDocument document(kDocumentText, "shot.toml", Vec3<double>::Zero(), {});
  const Json at = valuesAt(document.values(), {.t = 0.5, .frame = 5, .s = 0.5});
  EXPECT_EQ(at["camera"]["position"], Json({4, 0.5, 1}));
  EXPECT_EQ(at["camera"]["fov_deg"], 30);
  EXPECT_EQ(at["light"][0]["type"], "point");
  EXPECT_EQ(at["light"][0]["#"], 0);
}

} // namespace
} // namespace surflect::viewer
