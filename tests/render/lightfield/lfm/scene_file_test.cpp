#include "render/lightfield/lfm/scene_file.h"

#include "tests/srf/image/files.h"

#include <string>

namespace surflect::lfm {
namespace {

SceneFile parsed(const std::string& text) { return parseSceneFile(text, "/scenes/shelf.toml"); }
std::string errorIn(const std::string& text) {
  return image::errorOf([&] { parsed(text); });
}

TEST(LfmSceneFile, ObjectsArePlacedAndModelsAreNamedOnce) {
  const SceneFile file = parsed("[[object]]\nmodel = 'a.lfm'\n"
                                "[[object]]\nmodel = '../b.lfm'\nposition = [1, 2, 3]\n"
                                "[[object]]\nmodel = './a.lfm'\nrotate_deg = 90\nscale = 0.5\n");
  ASSERT_EQ(file.models.size(), 2u);
  EXPECT_EQ(file.models[0], "/scenes/a.lfm");
  EXPECT_EQ(file.models[1], "/b.lfm");
  ASSERT_EQ(file.objects.size(), 3u);
  EXPECT_EQ(file.objects[1].model, 1u);
  EXPECT_EQ(file.objects[2].model, 0u);
  EXPECT_EQ(file.objects[1].placement.position, Vec3<double>(1, 2, 3));
  EXPECT_EQ(file.objects[2].placement.scale, 0.5);
  // A quarter turn about z.
  EXPECT_LT((file.objects[2].placement.rotation * Vec3<double>(1, 0, 0) - Vec3<double>(0, 1, 0)).norm(),
            1e-15);
}

TEST(LfmSceneFile, FaultsAreNamed) {
  const std::string object = "[[object]]\nmodel = 'a.lfm'\n";
  EXPECT_EQ(errorIn(""), "/scenes/shelf.toml: object: missing from the table on line 1");
  EXPECT_EQ(errorIn("object = []"), "/scenes/shelf.toml: object: found 0, expected 1 to 10000 tables");
  EXPECT_EQ(errorIn("[[object]]\nscale = 1"),
            "/scenes/shelf.toml: object[0].model: missing from the table on line 1");
  EXPECT_EQ(errorIn(object + "scale = 0"),
            "/scenes/shelf.toml: object[0].scale: found 0 on line 3, expected 1e-06 to 1000000");
  EXPECT_EQ(errorIn(object + "position = [1, 2]"), "/scenes/shelf.toml: object[0].position: found an array "
                                                   "of 2 on line 3, expected an array of 3 numbers");
  EXPECT_EQ(errorIn(object + "rotate_axis = [0, 0, 1]"),
            "/scenes/shelf.toml: object[0].rotate_axis: found an array of 3 on line 3, expected rotate_deg "
            "beside it");
  EXPECT_EQ(errorIn(object + "rotate_axis = [0, 0, 0]\nrotate_deg = 1"),
            "/scenes/shelf.toml: object[0].rotate_axis: found an array of 3 on line 3, expected a direction "
            "other than 0");
  EXPECT_EQ(errorIn(object + "turn = 3"),
            "/scenes/shelf.toml: object[0].turn: unknown key on line 3; the nearest known one is model");
}

} // namespace
} // namespace surflect::lfm
