#include "render/gl/draw.h"

#include "render/gl/projection.h"
#include "surfel/math/bounds.h"
#include "tests/render/clouds.h"
#include "tests/render/gl/gl_test.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace surflect::gl {
namespace {

class DrawTest : public GlTest {};

constexpr int kSide = 64;
constexpr RenderState kAdded{.blend = {Factor::one, Factor::one}};

VertexArray arrayOf(std::span<const float> positions) {
  const VertexAttribute attribute{0, 3, std::as_bytes(positions)};
  return VertexArray({&attribute, 1});
}

// Pixels whose centres are in a triangle, by the signs of edge functions; corners in sixteenths of pixels,
// relative to pixel centres. Empty if a centre is within 1/256 of a pixel of an edge, where drivers may
// choose.
std::optional<image::Image> filled(const std::array<std::array<int, 2>, 3>& corners) {
  image::Image picture(kSide, kSide, 1);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      int positive = 0, negative = 0;
      for (size_t i = 0; i < 3; ++i) {
        const auto [ax, ay] = corners[i];
        const auto [bx, by] = corners[(i + 1) % 3];
        const int edge = (bx - ax) * (16 * y - ay) - (by - ay) * (16 * x - ax);
        if (std::abs(edge) < std::hypot(bx - ax, by - ay) / 16) return std::nullopt;
        ++(edge > 0 ? positive : negative);
      }
      picture.at(x, y)[0] = positive == 3 || negative == 3;
    }
  return picture;
}

TEST_F(DrawTest, ATriangleCoversThePixelsWhoseCentresAreInIt) {
  const Texture color({Format::r32f, kSide, kSide});
  Framebuffer target("target", {{&color}});
  const Program program = colorProgram({1, 1, 1, 1});
  Rng rng(1);
  std::uniform_int_distribution<int> sixteenths(-64, 16 * kSide + 64);
  int compared = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::array<std::array<int, 2>, 3> corners{};
    std::vector<float> positions;
    for (auto& [x, y] : corners) {
      x = sixteenths(rng);
      y = sixteenths(rng);
      // Pixel centres are at +1/2, and rows count downwards. All of this is exact in float.
      for (float v : {(static_cast<float>(x) + 8) / (8 * kSide) - 1,
                      1 - (static_cast<float>(y) + 8) / (8 * kSide), 0.5f})
        positions.push_back(v);
    }
    const auto expected = filled(corners);
    if (!expected) continue;
    target.clearColor(0, {0, 0, 0, 0});
    draw({target, program}, arrayOf(positions));
    EXPECT_EQ(color.read().values, expected->values);
    ++compared;
  }
  EXPECT_GT(compared, 30);
}

// A bumpy closed surface that hides parts of itself, triangles counter-clockwise from outside.
Mesh<ObjectSpace> bumpySphere(int around, int along) {
  Mesh<ObjectSpace> mesh;
  for (int j = 0; j <= along; ++j)
    for (int i = 0; i < around; ++i) {
      const double theta = std::numbers::pi * j / along, phi = 2 * std::numbers::pi * i / around;
      const double r = 1 + 0.4 * std::sin(5 * theta) * std::cos(4 * phi) * std::sin(theta);
      mesh.positions.push_back(assume<Point3<ObjectSpace>>(Vec3<double>(
          r * std::sin(theta) * std::cos(phi), r * std::sin(theta) * std::sin(phi), r * std::cos(theta))));
    }
  const auto at = [&](int i, int j) { return static_cast<uint32_t>(j * around + i % around); };
  for (int j = 0; j < along; ++j)
    for (int i = 0; i < around; ++i) {
      mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  return mesh;
}

struct MeshView {
  Mesh<ObjectSpace> mesh = bumpySphere(60, 40);
  VertexArray array = vertexArrayOf(mesh);
  Eigen::Matrix4f clipFromObject =
      clipFromWorld(testing::lookAt({2, 1, 2.5}, {0, 0, 0}, 100, 80, 90), boundsOf(mesh.positions));
  Texture color{{Format::rgba32f, 100, 80}}, depth{{Format::depth32f, 100, 80}};
  Framebuffer target{"target", {{&color}}, {&depth}};

  MeshView() {
    target.clearColor(0, {0, 0, 0, 0});
    target.clearDepth();
  }
  double sum() const {
    double sum = 0;
    for (float v : color.read().values) sum += v;
    return sum;
  }
};

TEST_F(DrawTest, AfterADepthPrepassEachVisiblePixelIsDrawnOnce) {
  MeshView view;
  Program prepass(kShaders, {"mesh.vert", "depth.frag"});
  prepass.set("clipFromObject", view.clipFromObject);
  draw({view.target,
        prepass,
        {},
        {.depth = Compare::less, .writeDepth = true, .writeColor = {}, .cull = Cull::back}},
       view.array);
  EXPECT_EQ(view.sum(), 0);
  RenderState state = kAdded;
  state.depth = Compare::equal;
  state.cull = Cull::back;
  const Program counting = colorProgram({1, 0, 0, 0}, view.clipFromObject); // another program
  const size_t half = view.array.size() / 6 * 3;
  draw({view.target, counting, {}, state}, view.array, {0, half});
  draw({view.target, counting, {}, state}, view.array, {half, view.array.size() - half});
  const image::Image count = view.color.read(), depth = view.depth.read();
  double drawn = 0;
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 100; ++x) {
      EXPECT_EQ(count.at(x, y)[0], depth.at(x, y)[0] < 1 ? 1 : 0) << x << " " << y;
      drawn += count.at(x, y)[0];
    }
  EXPECT_GT(drawn, 1000);

  // Without the depth test, hidden fronts are drawn, too.
  view.target.clearColor(0, {0, 0, 0, 0});
  state.depth = Compare::always;
  draw({view.target, counting, {}, state}, view.array);
  EXPECT_GT(view.sum(), drawn + 100);
}

TEST_F(DrawTest, FrontsAreCounterClockwise) {
  MeshView view;
  const Program program = colorProgram({1, 0, 0, 0}, view.clipFromObject);
  const RenderState nearest{.depth = Compare::less, .writeDepth = true};
  draw({view.target, program, {}, nearest}, view.array);
  const image::Image both = view.depth.read();
  const auto with = [&](Cull cull) {
    view.target.clearDepth();
    RenderState state = nearest;
    state.cull = cull;
    draw({view.target, program, {}, state}, view.array);
    return view.depth.read();
  };
  EXPECT_EQ(with(Cull::back).values, both.values); // only fronts are visible on a closed surface
  EXPECT_NE(with(Cull::front).values, both.values);
}

TEST_F(DrawTest, WeightedLayersAddUp) {
  constexpr int kLayers = 8;
  Texture layers({Format::rgba32f, kSide, kSide, kLayers, 1, Filter::nearest});
  std::vector<float> expected(kSide * kSide * 4);
  for (int layer = 0; layer < kLayers; ++layer) {
    const image::Image picture = image::randomImage(kSide, kSide, 4, 0, 1, static_cast<unsigned>(layer));
    layers.upload(picture, {.layer = layer});
    // Weights are powers of two, so that products are exact; sums are rounded in the same order.
    for (size_t i = 0; i < expected.size(); ++i) expected[i] += std::ldexp(1.f, -layer) * picture.values[i];
  }
  const Texture* textures[] = {&layers};
  Program program(kShaders, {"everywhere.vert", "layer.frag"});
  const VertexArray none({});
  for (Format format : {Format::rgba32f, Format::rgba16f}) {
    const Texture color({format, kSide, kSide});
    Framebuffer target("target", {{&color}});
    target.clearColor(0, {0, 0, 0, 0});
    for (int layer = 0; layer < kLayers; ++layer) {
      program.set("layer", layer);
      program.set("weight", std::ldexp(1.f, -layer));
      draw({target, program, textures, kAdded}, none, {0, 3});
    }
    const std::vector<float> sums = color.read().values;
    if (format == Format::rgba32f) {
      EXPECT_EQ(sums, expected);
    }
    // Drivers may truncate each sum to a half; those below 2 are multiples of 2^-10.
    for (size_t i = 0; i < sums.size(); ++i) ASSERT_NEAR(sums[i], expected[i], kLayers * 0x1p-10);
  }
}

TEST_F(DrawTest, ColoursAreWeightedByTheTargetsAlpha) {
  const Texture color({Format::rgba32f, 2, 1});
  Framebuffer target("target", {{&color}});
  target.clearColor(0, {0.5f, 0.5f, 0.5f, 0.25f});
  target.clearColor(0, {0, 0, 0, 0.75f}, Rect{1, 0, 1, 1}, {false, false, false, true});
  Program program(kShaders, {"everywhere.vert", "color.frag"});
  program.set("color", Eigen::Vector4f(1, 2, 4, 1));
  draw({target,
        program,
        {},
        {.blend = {Factor::targetAlpha, Factor::one}, .writeColor = {true, true, true, false}}},
       VertexArray({}), {0, 3});
  EXPECT_EQ(color.read().values, (std::vector<float>{0.75f, 1, 1.5f, 0.25f, 1.25f, 2, 3.5f, 0.75f}));
}

// In a target of 8 bits the difference is cut off at 0.
TEST_F(DrawTest, ColoursAreSubtracted) {
  for (const Format format : {Format::rgba32f, Format::rgba8}) {
    const Texture color({format, 1, 1});
    Framebuffer target("target", {{&color}});
    target.clearColor(0, {0.6f, 0.2f, 1, 1});
    Program program(kShaders, {"everywhere.vert", "color.frag"});
    program.set("color", Eigen::Vector4f(0.2f, 0.6f, 0.4f, 0));
    draw({target, program, {}, {.blend = {Factor::one, Factor::one, Equation::subtract}}}, VertexArray({}),
         {0, 3});
    const std::vector<float> found = color.read().values;
    const std::array expected{0.4f, format == Format::rgba8 ? 0 : -0.4f, 0.6f, 1.f};
    for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(found[i], expected[i], 1e-6);
  }
}

TEST_F(DrawTest, NothingIsLeftOfTheDrawBefore) {
  const Texture color({Format::rgba32f, 4, 4}), depth({Format::depth32f, 4, 4});
  Framebuffer target("target", {{&color}}, {&depth});
  Program program(kShaders, {"everywhere.vert", "color.frag"});
  program.set("color", Eigen::Vector4f(1, 1, 1, 1));
  const VertexArray none({});
  const RenderState narrow{.blend = {Factor::zero, Factor::zero},
                           .depth = Compare::equal,
                           .writeDepth = true,
                           .writeColor = {},
                           .cull = Cull::front,
                           .viewport = Rect{1, 1, 1, 1},
                           .scissor = Rect{2, 2, 1, 1}};
  draw({target, program, {}, narrow}, none, {0, 3});
  target.clearColor(0, {0.5f, 0.5f, 0.5f, 0.5f});
  EXPECT_EQ(color.read().values, std::vector<float>(64, 0.5f));
  draw({target, program, {}, narrow}, none, {0, 3});
  draw({target, program}, none, {0, 3});
  EXPECT_EQ(color.read().values, std::vector<float>(64, 1));
}

TEST_F(DrawTest, TexturesOfTheDrawBeforeAreNotSampled) {
  Texture white({Format::rgba32f, 1, 1, 1});
  white.upload(image::randomImage(1, 1, 4, 1, 1, 0));
  const Texture color({Format::rgba32f, 2, 2});
  Framebuffer target("target", {{&color}});
  Program program(kShaders, {"everywhere.vert", "layer.frag"});
  program.set("layer", 0);
  program.set("weight", 1.f);
  const Texture* textures[] = {&white};
  draw({target, program, textures}, VertexArray({}), {0, 3});
  EXPECT_EQ(color.read().values, std::vector<float>(16, 1));
  draw({target, program}, VertexArray({}), {0, 3});
  EXPECT_EQ(color.read().at(1, 1)[0], 0);
}

TEST_F(DrawTest, AMeshWithoutTrianglesDrawsNothing) {
  MeshView view;
  view.mesh.triangles.clear();
  const VertexArray array = vertexArrayOf(view.mesh);
  EXPECT_EQ(array.size(), 0u);
  draw({view.target, colorProgram({1, 1, 1, 1}, view.clipFromObject)}, array);
  draw({view.target, colorProgram({1, 1, 1, 1})}, vertexArrayOf(Mesh<ObjectSpace>()));
  EXPECT_EQ(view.sum(), 0);
}

TEST_F(DrawTest, ScissorsCountRowsFromTheTop) {
  const Texture color({Format::r32f, 3, 3});
  Framebuffer target("target", {{&color}});
  target.clearColor(0, {0, 0, 0, 0});
  Program program(kShaders, {"everywhere.vert", "color.frag"});
  program.set("color", Eigen::Vector4f(1, 1, 1, 1));
  draw({target, program, {}, {.scissor = Rect{1, 0, 2, 1}}}, VertexArray({}), {0, 3});
  EXPECT_EQ(color.read().values, (std::vector<float>{0, 1, 1, 0, 0, 0, 0, 0, 0}));
}

TEST_F(DrawTest, LayersOfAnArrayAreDrawnInto) {
  Texture layers({Format::r32f, 2, 2, 3});
  for (int layer = 0; layer < 3; ++layer)
    Framebuffer("layer", {{&layers, layer}}).clearColor(0, {static_cast<float>(layer), 0, 0, 0});
  for (int layer = 0; layer < 3; ++layer)
    EXPECT_EQ(layers.read(layer).values, std::vector<float>(4, static_cast<float>(layer)));
}

TEST_F(DrawTest, AnIncompleteFramebufferIsNamed) {
  const Texture compressed({Format::dxt1, 4, 4});
  EXPECT_EQ(
      image::errorOf([&] { Framebuffer("sum of passes", {{&compressed}}); }),
      "OpenGL: framebuffer 'sum of passes': found an attachment that cannot be drawn into, expected textures "
      "that can be drawn into together");
  EXPECT_EQ(
      image::errorOf([&] { Framebuffer("none", {}); }),
      "OpenGL: framebuffer 'none': found no attachment, expected textures that can be drawn into together");
}

// Whatever a step can do, and whether or not the draw is given up at last.
TEST_F(DrawTest, StepsDrawThePixelsOfOneDraw) {
  const Mesh<ObjectSpace> mesh = bumpySphere(40, 20);
  const VertexArray array = vertexArrayOf(mesh);
  const Texture color({Format::rgba32f, kSide, kSide});
  Framebuffer target("target", {{&color}});
  const Program program = colorProgram({0.1f, 0.2f, 0.3f, 0.4f});
  const auto drawn = [&](auto&& draws) {
    target.clearColor(0, {0, 0, 0, 0});
    draws();
    return color.read().values;
  };
  const RenderState overlaid{.blend = {Factor::one, Factor::oneMinusSourceAlpha}};
  const std::vector<float> expected = drawn([&] { draw({target, program, {}, overlaid}, array); });
  Progress progress;
  size_t calls = 0;
  progress.cancelled = [&] { return ++calls > 1000000; };
  for (double step : {1.0, 1e5, 3e7, 1e15}) {
    calls = 0;
    EXPECT_EQ(drawn([&] {
                SteppedDraws(step, progress).draw({target, program, {}, overlaid}, array);
              }),
              expected);
  }
  EXPECT_EQ(calls, 0u); // no work fills the last step
  double step = 1;
  progress.cancelled = [&] { return true; };
  EXPECT_THROW(SteppedDraws(step, progress).draw({target, program, {}, overlaid}, array), Cancelled);
  step = 1;
  EXPECT_EQ(drawn([&] { SteppedDraws(step, {}).draw({target, program, {}, overlaid}, array); }), expected);

  const std::array<float, 9> corners{-1, -1, 0, 3, -1, 0, -1, 3, 0}; // covers the target
  const VertexArray picture = arrayOf(corners);
  const std::vector<float> filled = drawn([&] { draw({target, program, {}, overlaid}, picture); });
  EXPECT_GT(std::ranges::min(filled), 0);
  progress.cancelled = [&] { return false; };
  for (double rows : {1.0, 3.0 * kSide, 1e15})
    EXPECT_EQ(drawn([&] {
                SteppedDraws(rows, progress).drawRows({target, program, {}, overlaid}, picture);
              }),
              filled);
}

} // namespace
} // namespace surflect::gl
