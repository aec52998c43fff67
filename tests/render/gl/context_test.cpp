#include "render/gl/context.h"

#include "tests/render/gl/gl_test.h"

#include <cstdlib>
#include <memory>
#include <thread>

namespace surflect::gl {
namespace {

class ContextTest : public GlTest {};

TEST_F(ContextTest, OffersTheCoreOfVersion45) {
  const Description& description = context_->describe();
  EXPECT_GE(description.version, "4.5");
  EXPECT_NE(description.version.find("Core"), std::string::npos) << description.version;
  EXPECT_NE(description.renderer.find("llvmpipe"), std::string::npos) << description.renderer;
  EXPECT_GE(description.limits.textureSize, 16384);
  EXPECT_GE(description.limits.arrayLayers, 2048);
  EXPECT_GE(description.limits.textureUnits, 16);
  EXPECT_GE(description.limits.colorAttachments, 8);
}

TEST_F(ContextTest, MistakesAreReportedOnce) {
  Texture texture({Format::r32f, 4, 4});
  texture.upload(image::Image(4, 4, 1), {.x = 1});
  texture.upload(image::Image(4, 4, 1), {.x = 2});
  const std::string line = image::errorOf([] { finish(); });
  EXPECT_TRUE(line.starts_with("OpenGL: found GL_INVALID_VALUE")) << line;
  EXPECT_TRUE(line.ends_with(", expected no error")) << line;
  EXPECT_NO_THROW(finish());
}

TEST_F(ContextTest, TooLargeATextureIsAnError) {
  const int tooLarge = context_->describe().limits.textureSize + 1;
  EXPECT_EQ(image::errorOf([&] {
              Texture({Format::rgba8, tooLarge, 1});
            }),
            "OpenGL: found a picture of " + std::to_string(tooLarge) + " x 1 texels, expected at most " +
                std::to_string(tooLarge - 1) +
                " each way, the limit of this OpenGL; a smaller picture or fewer samples for each pixel "
                "(--samples 1) may fit");
}

TEST_F(ContextTest, TheStopwatchWaitsForTheWork) {
  const Texture color({Format::rgba32f, 256, 256});
  const Framebuffer target("target", {{&color}});
  const Program program(kShaders, {"everywhere.vert", "depth.frag"});
  const VertexArray none({});
  const auto secondsOf = [&](int draws) {
    const Stopwatch stopwatch;
    const Pass pass{target, program, {}, {.blend = {Factor::one, Factor::one}}};
    for (int i = 0; i < draws; ++i) draw(pass, none, {0, 3});
    return stopwatch.seconds();
  };
  double once = secondsOf(1);
  for (int i = 0; i < 5; ++i) once = std::min(once, secondsOf(1));
  EXPECT_GT(secondsOf(1000), 10 * once);
}

// Blended triangles at random places.
std::vector<float> randomPixels() {
  const Context context({.software = true});
  const Texture color({Format::rgba16f, 61, 47});
  Framebuffer target("target", {{&color}});
  target.clearColor(0, {0, 0, 0, 0});
  Rng rng(1);
  Program program = colorProgram({1, 1, 1, 1});
  for (int i = 0; i < 100; ++i) {
    std::vector<float> positions(9);
    for (float& v : positions) v = uniform(rng, -1, 1);
    program.set("color", Eigen::Vector4f(uniform(rng, 0, 1), uniform(rng, 0, 1), uniform(rng, 0, 1), 1));
    const VertexAttribute attribute{0, 3, std::as_bytes(std::span(positions))};
    draw({target, program, {}, {.blend = {Factor::one, Factor::one}}}, VertexArray({&attribute, 1}));
  }
  return color.read().values;
}

TEST(TwoContexts, GiveTheSameBitsOneAfterAnother) {
  const std::vector<float> first = randomPixels();
  EXPECT_GT(std::ranges::max(first), 1);
  EXPECT_EQ(first, randomPixels());
}

TEST(TwoContexts, MayBeCurrentOnTwoThreads) {
  std::vector<float> here, there;
  std::thread other([&] { there = randomPixels(); });
  here = randomPixels();
  other.join();
  EXPECT_EQ(here, there);
}

TEST(TwoContexts, AreOneForAllWhoShareTheThread) {
  std::weak_ptr<const Context> first;
  {
    const std::shared_ptr<const Context> a = contextOfThread(), b = contextOfThread();
    EXPECT_EQ(a, b);
    first = a;
  }
  EXPECT_TRUE(first.expired());
  EXPECT_FALSE(contextOfThread()->describe().renderer.empty());
}

// Expects that a context fails with an Error that matches `line` where the environment variable is set. Runs
// in a process of its own, because libEGL reads its environment once; the process ends with 3.
void expectNoContext(const char* variable, const char* value, const char* line) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto openAndTell = [&] {
    setenv(variable, value, 1);
    const std::string told = image::errorOf([] { Context context; });
    std::fprintf(stderr, "%s\n", told.c_str());
    std::exit(3);
  };
  EXPECT_EXIT(openAndTell(), ::testing::ExitedWithCode(3), line);
}

TEST(NoContext, WithoutADriver) {
  expectNoContext("__EGL_VENDOR_LIBRARY_DIRS", "/nowhere", "^OpenGL: EGL: found none, expected a driver");
}

TEST(NoContext, OfAnOlderVersion) {
  expectNoContext("MESA_GL_VERSION_OVERRIDE", "3.3", "^OpenGL: version: found 3[.]3 .*, expected 4[.]5 core");
}

} // namespace
} // namespace surflect::gl
