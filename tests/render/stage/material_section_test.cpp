#include "render/stage/material_section.h"

#include "srf/image/png.h"
#include "tests/render/stage/material/zoo.h"
#include "tests/render/stage/stage_example.h"

#include <fmt/format.h>

namespace surflect::stage {
namespace {

using namespace stage_example;

TEST(MaterialSection, GlassSaysWhatLiesOnItsOtherSide) {
  const std::string media = with("type = \"conductor\"\ncolor = [0.6, 0.6, 0.5]\nalpha = [0, 0]",
                                 "type = \"dielectric\"\neta = 0.9\nabsorption = [1, 2, 3]\n"
                                 "absorption_outside = [4, 5, 6]");
  const auto glass = std::get<material::Dielectric>(parse(media).objects[1].material);
  EXPECT_EQ(glass.absorption, (Rgb{1, 2, 3}));
  EXPECT_EQ(glass.absorptionOutside, (Rgb{4, 5, 6}));
  expectError(with("[4, 5, 6]", "[4, -5, 6]", media), {"absorption_outside[1]"});
}

TEST(MaterialSection, MaterialsRefuseWhatIsOutOfRange) {
  expectError(with("roughness = 0.5", "roughness = -0.5"), {"material[0].roughness", "-0.5", "line"});
  expectError(with("alpha = [0, 0]", "alpha = -0.1"), {"material[1].alpha", "-0.1"});
  expectError(with("alpha = [0, 0]", "alpha = [0.1, -0.1]"), {"material[1].alpha[1]", "-0.1"});
  expectError(with("0.8, 0.4, 0.2", "0.8, nan, 0.2"), {"material[0].albedo[1]", "nan"});
  expectError(with("0.8, 0.4, 0.2", "0.8, 1.4, 0.2"), {"material[0].albedo[1]", "1.4"});
  expectError(with("\"rough_diffuse\"", "\"velvet\""), {"material[0].type", "velvet", "lambert"});
  expectError(with("roughness = 0.5", "rougness = 0.5"), {"rougness", "did you mean roughness?"});
  expectError(with("\"steel\"", "\"clay\""), {"material[1].name", "clay"});
  const std::string metal = "type = \"conductor\"\ncolor = [0.6, 0.6, 0.5]\nalpha = [0, 0]";
  expectError(with(metal, "type = \"dielectric\"\neta = 1"), {"material[1].eta"});
  expectError(with(metal, "type = \"clear_coat\"\neta = 1.5\nbase = \"clai\""), {"material[1].base", "clay"});
  expectError(with(metal, "type = \"ward\"\ndiffuse = [1,1,1]\nspecular = [1,1,1]\nalpha = 0.1"),
              {"material[1].diffuse + specular"});
  EXPECT_NE(image::errorOf([&] {
              parse(with(metal, "type = \"measured\"\nfile = \"nothing.binary\""));
            }).find("nothing.binary"),
            std::string::npos);
}

TEST(MaterialSection, MaterialsAreAThousandAtMost) {
  std::string many = example; // of two
  for (int i = 0; i < 998; ++i)
    many += fmt::format("[[material]]\nname = \"m{}\"\ntype = \"lambert\"\nalbedo = [1, 1, 1]\n", i);
  parse(many);
  expectError(many + "[[material]]\nname = \"one\"\ntype = \"lambert\"\nalbedo = [1, 1, 1]\n",
              {"material: ", "found 1001", "at most 1000"});
}

TEST(MaterialSection, GlassCannotBeCoated) {
  const std::string metal = "type = \"conductor\"\ncolor = [0.6, 0.6, 0.5]\nalpha = [0, 0]";
  const std::string text = with(metal, "type = \"clear_coat\"\neta = 1.5\nbase = \"clay\"");
  parse(text);
  const std::string clay = "type = \"rough_diffuse\"\nalbedo = [0.8, 0.4, 0.2]\nroughness = 0.5";
  expectError(with(clay, "type = \"dielectric\"\neta = 1.5", text),
              {"material[1].base", "clay", "dielectric"});
}

TEST(MaterialSection, TexturesAreFoundAndCounted) {
  const image::TemporaryFolder folder;
  const auto textured = [&](const std::string& more) {
    return with("roughness = 0.5",
                "roughness = 0.5\ntexture = \"" + (folder / "cloth.png").string() + "\"\n" + more);
  };
  expectError(textured(""), {"material[0].texture: ", "cloth.png"});
  image::writePng(folder / "cloth.png", image::Image(4, 4, 3));
  const Stage stage = parse(textured("repeat = [3, 2]"));
  EXPECT_TRUE(stage.objects[0].textures.color);
  EXPECT_FALSE(stage.objects[1].textures.any());
  const Stage rough = parse(textured("roughness_texture = \"" + (folder / "cloth.png").string() + "\""));
  EXPECT_TRUE(rough.objects[0].textures.roughness);
  EXPECT_NE(rough.objects[0].textures.roughness, rough.objects[0].textures.color);
  expectError(textured("repeat = [3, 0]"), {"material[0].repeat[1]"});
  expectError(with("roughness = 0.5", "roughness = 0.5\nrepeat = [3, 1]"), {"material[0].repeat"});
  image::writeBytes(folder / "flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  expectError(with("type = \"sphere\"\nmaterial = \"clay\"\ncenter = [0, 0, 1]\nradius = 0.5\nsegments = 16",
                   "type = \"mesh\"\nmaterial = \"clay\"\nfile = \"" + (folder / "flat.obj").string() + "\"",
                   textured("")),
              {"object[0].material", "texture coordinates"});
  image::writePng(folder / "cloth.png", image::Image(4, 5, 3));
  EXPECT_NE(parse(textured("repeat = [3, 2]")).hash, stage.hash);
}

TEST(MaterialSection, WhatMaterialsShareIsReadOnce) {
  const image::TemporaryFolder folder;
  image::writePng(folder / "cloth.png", image::Image(4, 4, 3));
  image::writeBytes(folder / "gloss.binary", material::zoo::merlFile([](double, double, double) {
                      return std::array{0.1, 0.1, 0.1};
                    }));
  std::string text;
  for (const char* name : {"a", "b"})
    text += fmt::format("[[material]]\nname = \"{0}\"\ntype = \"measured\"\nfile = \"gloss.binary\"\n"
                        "[[material]]\nname = \"cloth {0}\"\ntype = \"lambert\"\nalbedo = [1, 1, 1]\n"
                        "texture = \"cloth.png\"\nrepeat = [{1}, 1]\n",
                        name, name[0] - 'a' + 1);
  const scene::ScriptDocument document(text, folder / "stage.toml");
  const MaterialList list = asMaterials(scene::Section(document.root(), {"material"}).require("material"));
  EXPECT_EQ(list.files, (std::vector{folder / "gloss.binary", folder / "cloth.png"}));
  const auto table = [&](const char* name) {
    return std::get<material::Measured>(list.materials.find(name)->second.material).table;
  };
  EXPECT_TRUE(table("a"));
  EXPECT_EQ(table("a"), table("b"));
  EXPECT_NE(list.materials.find("cloth a")->second.textures.color,
            list.materials.find("cloth b")->second.textures.color);
}

TEST(MaterialSection, RoughMaterialsHaveTheirTables) {
  const Stage stage = parse(with("alpha = [0, 0]", "alpha = 0.3"));
  material::requireValid(stage.objects[1].material);
  EXPECT_TRUE(std::get<material::Conductor>(stage.objects[1].material).mirrorLoss);
}

} // namespace
} // namespace surflect::stage
