#include "render/gl/program.h"

#include "tests/render/gl/gl_test.h"

namespace surflect::gl {
namespace {

class ProgramTest : public GlTest {};

constexpr ShaderFile kFolder[] = {{"a/one.vert", "1\n#include \"two.glsl\"\n3\n#include \"three.glsl\"\n5"},
                                  {"a/two.glsl", "#include \"three.glsl\"\n22\n"},
                                  {"a/three.glsl", "31\n"},
                                  {"a/lost.frag", "1\n#include \"none.glsl\"\n"}};

TEST(CompleteShader, HasEachIncludedFileOnceAndItsLines) {
  const CompleteShader shader = completeShader(kFolder, "one.vert");
  EXPECT_EQ(shader.text, "1\n31\n22\n3\n5\n");
  EXPECT_EQ(
      shader.lines,
      (std::vector<ShaderLine>{
          {"a/one.vert", 1}, {"a/three.glsl", 1}, {"a/two.glsl", 2}, {"a/one.vert", 3}, {"a/one.vert", 5}}));
}

TEST(CompleteShader, TellsWhoIncludesAMissingFile) {
  EXPECT_EQ(image::errorOf([] { completeShader(kFolder, "lost.frag"); }),
            "a/lost.frag: line 2: found 'none.glsl', expected a shader of this folder");
}

TEST(LineOfFirstError, IsFoundInTheLogsOfDrivers) {
  EXPECT_EQ(lineOfFirstError("0:7(2): warning: unused\n0:12(5): error: undeclared\n0:1(1): error: also\n"),
            12);
  EXPECT_EQ(lineOfFirstError("0(34) : error C1503: undefined variable\n"), 34);
  EXPECT_EQ(lineOfFirstError("error: too complex"), 0);
}

std::string errorOfShader(const char* vertex, const char* fragment) {
  return image::errorOf([&] { Program(kShaders, {vertex, fragment}); });
}

TEST_F(ProgramTest, ABadShaderIsAnErrorWithFileAndLine) {
  const std::string line = errorOfShader("mesh.vert", "bad.frag");
  EXPECT_TRUE(line.starts_with("tests/render/gl/bad.frag: line 5: ")) << line;
  EXPECT_NE(line.find("undeclared"), std::string::npos) << line;
}

TEST_F(ProgramTest, ABadIncludedShaderIsAnErrorWithItsOwnFileAndLine) {
  const std::string line = errorOfShader("mesh.vert", "bad_include.frag");
  EXPECT_TRUE(line.starts_with("tests/render/gl/bad.glsl: line 2: ")) << line;
}

TEST_F(ProgramTest, ShadersThatDoNotLinkAreAnErrorWithTheirNames) {
  const std::string line = errorOfShader("unlinked.vert", "color.frag");
  EXPECT_TRUE(line.starts_with("unlinked.vert, color.frag: does not link: ")) << line;
  EXPECT_NE(line.find("place"), std::string::npos) << line;
}

TEST_F(ProgramTest, AnUnknownUniformIsAnError) {
  Program program(kShaders, {"mesh.vert", "color.frag"});
  EXPECT_EQ(image::errorOf([&] { program.set("colour", 1.f); }),
            "mesh.vert, color.frag: found 'colour', expected a uniform that the program uses");
}

TEST_F(ProgramTest, ElementsOfAnArrayAreSetByName) {
  const Texture color({Format::rgba32f, 1, 1});
  const Framebuffer target("target", {{&color}});
  Program program(kShaders, {"everywhere.vert", "array.frag"});
  for (int i = 0; i < 3; ++i) program.set("terms[" + std::to_string(i) + "]", 2.f + static_cast<float>(i));
  draw({target, program}, VertexArray({}), {0, 3});
  EXPECT_EQ(color.read().values, std::vector<float>(4, 2 + 3 * 4));
  EXPECT_THROW(program.set("terms[3]", 1.f), Error);
}

TEST_F(ProgramTest, MembersOfArraysOfStructuresAreSetByName) {
  constexpr ShaderFile folder[] = {
      {"a/place.vert", "#version 450 core\nvoid main() { gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }\n"},
      {"a/lamps.frag",
       "#version 450 core\nstruct Lamp { float power[2]; };\nuniform Lamp lamps[2];\n"
       "out vec4 result;\nvoid main() { result = vec4(lamps[0].power[1] * lamps[1].power[0]); }\n"}};
  const Texture color({Format::rgba32f, 1, 1});
  const Framebuffer target("target", {{&color}});
  Program program(folder, {"place.vert", "lamps.frag"});
  program.set("lamps[0].power[1]", 3.f);
  program.set("lamps[1].power[0]", 5.f);
  draw({target, program}, VertexArray({}), {0, 1}, Primitive::points);
  EXPECT_EQ(color.read().values, std::vector<float>(4, 15));
}

TEST_F(ProgramTest, AFileThatIsNoShaderIsAnError) {
  constexpr ShaderFile folder[] = {{"a/empty.vert", ""}, {"a/text.glsl", "void main() {}"}};
  EXPECT_THROW(Program(folder, {"empty.vert"}), Error);
  EXPECT_EQ(image::errorOf([&] { Program(folder, {"text.glsl"}); }),
            "found 'text.glsl', expected a shader .vert or .frag");
}

TEST_F(ProgramTest, AUniformOfAnotherTypeIsAnError) {
  Program program(kShaders, {"mesh.vert", "color.frag"});
  program.set("color", 1.f);
  EXPECT_THROW(requireNoErrors(), Error);
}

} // namespace
} // namespace surflect::gl
