#include "render/film/frame_maps.h"

#include "render/methods.h"
#include "tests/render/films.h"
#include "tests/srf/image/files.h"

#include <utility>

namespace surflect::film {
namespace {

// Keeps the layers that frames of another renderer are asked for.
class AskedRenderer : public method::Renderer {
public:
  explicit AskedRenderer(std::unique_ptr<method::Renderer> renderer) : renderer_(std::move(renderer)) {}
  const method::Description& describe() const override { return renderer_->describe(); }
  std::span<const method::Option> options() const override { return renderer_->options(); }
  method::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                             const Progress& progress, method::FrameLayers memory) override {
    asked.push_back(aovs);
    return renderer_->render(scene, aovs, progress, std::move(memory));
  }
  std::vector<std::vector<std::string>> asked; // by frame

private:
  void configure(const method::Setting&) override {}
  std::unique_ptr<method::Renderer> renderer_;
};

class MapsOfSphere : public studio::PackedSphere<600> {
protected:
  // Lines of [output], of [camera], and tables.
  static scene::Script script(const std::string& output, const std::string& camera = "",
                              const std::string& tables = "") {
    return scene::parseScript(
        "model = \"m.srf\"\n[frames]\nfirst = 1\nlast = 9\n[output]\nsize = [40, 40]\npath = "
        "\"#.exr\"\n" +
            output + "\n[camera]\nposition = [4, 1, \"t\"]\nlook_at = [0, 0, 0]\nfov_deg = 40\n" + camera +
            "\n[[light]]\ntype = \"point\"\nposition = [1, 2, 3]\nintensity = 9\n" + tables,
        "shot.toml");
  }
  // The maps of a frame; `layers` are left in the frame.
  FrameMaps::Made mapsOf(const scene::Script& script, int frame, std::vector<std::string>* layers = nullptr) {
    ShotRenderer shot(script, renderer, progress);
    const FrameMaps maps(script, renderer.describe());
    method::FrameLayers picture = shot.render(frame, 1, maps.aovs(shot, frame));
    FrameMaps::Made made = maps.make(shot, frame, 1, picture);
    if (layers)
      for (const auto& [name, layer] : picture.aovs) layers->push_back(name);
    return made;
  }

  const Progress progress;
  AskedRenderer renderer{method::openRenderer(model().folder)};
  using Names = std::vector<std::string>;
};

const std::string blur = "shutter_deg = 180\naperture = 0.2";
const std::string ground = "[ground]\npoint = [0, -1, 0]\nnormal = [0, 1, 0]\n";

TEST_F(MapsOfSphere, ShowTheObjectSharpAndWithoutAShadow) {
  const std::string all =
      "samples = 4\naov = [\"stretch\", \"depth\"]\nmaps = [\"normal\", \"height\", \"albedo\"]";
  Names layers;
  const FrameMaps::Made plain = mapsOf(script(all), 5, &layers);
  ASSERT_EQ(plain.maps.size(), 3u);
  EXPECT_EQ(layers, (Names{"depth", "stretch"})) << "those that the script asks for";
  for (const auto& [camera, tables] : {std::pair(blur, std::string()), {"", ground}, {blur, ground}}) {
    layers.clear();
    const FrameMaps::Made maps = mapsOf(script(all, camera, tables), 5, &layers);
    EXPECT_EQ(layers, (Names{"depth", "stretch"}));
    ASSERT_EQ(maps.maps.size(), 3u);
    for (size_t i = 0; i < 3; ++i)
      EXPECT_EQ(maps.maps[i].bytes, plain.maps[i].bytes) << i << camera << tables;
  }
}

TEST_F(MapsOfSphere, TakeNoMoreLayersThanTheyShow) {
  const Names none, depth{"depth"}, normal{"normal"};
  const std::vector<std::tuple<std::string, std::string, std::vector<Names>>> cases = {
      {"height", "", {depth}},
      {"normal", "", {normal}},
      {"albedo", "", {none, none}},
      {"albedo", blur, {none, none, none}},
      {"height", blur, {none, none, depth}},
      {"normal", blur, {none, none, normal}}};
  for (const auto& [map, camera, asked] : cases) {
    renderer.asked.clear();
    mapsOf(script("samples = 2\nmaps = [\"" + map + "\"]", camera), 5);
    EXPECT_EQ(renderer.asked, asked) << map << " " << camera;
  }
}

TEST_F(MapsOfSphere, TellHeightsThatTheyClip) {
  EXPECT_FALSE(mapsOf(script("maps = [\"height\"]"), 1).beyond);
  const std::string moved = "[[warp]]\ntype = \"rigid\"\ntranslate = [1.5, 0, 0]\n";
  const auto beyond = mapsOf(script("maps = [\"height\"]", "", moved), 1).beyond;
  ASSERT_TRUE(beyond);
  EXPECT_NEAR(*beyond, 1.5 * 4 / std::sqrt(17.0) + 1, 0.05); // towards the camera, and the sphere's radius
}

TEST_F(MapsOfSphere, ThatFramesCannotGiveAreRefused) {
  method::Description model = renderer.describe();
  model.aovs = {"normal"};
  model.method = "flat";
  const scene::Script height = script("maps = [\"normal\", \"height\"]");
  EXPECT_EQ(image::errorOf([&] { FrameMaps(height, model); }),
            "shot.toml: output.maps: found \"height\", expected another map: frames of flat have no depth");
  model.isBaked = true;
  const scene::Script albedo = script("maps = [\"albedo\"]");
  EXPECT_EQ(
      image::errorOf([&] { FrameMaps(albedo, model); }),
      "shot.toml: output.maps: found \"albedo\", expected another map: a model of photographs under fixed "
      "light has no albedo");
}

} // namespace
} // namespace surflect::film
