// Times what light field renderers ask of OpenGL, after checking the pixels: multipass sums over the regions
// of a mesh of 100,000 triangles, switches of framebuffer, fill, uploads and read-backs.
#include "bench/gl/shaders.h"
#include "render/gl/context.h"
#include "render/gl/draw.h"
#include "render/gl/projection.h"
#include "surfel/base/error.h"
#include "surfel/math/bounds.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

namespace surflect::bench {
namespace {

using namespace gl;

constexpr int kRegions = 200, kDirections = 3, kPasses = kRegions * kDirections;
constexpr int kSide = 500;       // of the picture, as in [Azuma 1999, 3.2]
constexpr int kTextureSide = 64; // of a region's texture
constexpr float kWeight = 0.25f;

// Registers a benchmark of commands, of which each run makes `items`.
void add(const std::string& name, size_t items, std::function<void()> commands) {
  benchmark::RegisterBenchmark(name.c_str(),
                               [items, commands = std::move(commands)](benchmark::State& state) {
                                 finish();
                                 for (auto _ : state) {
                                   commands();
                                   finish();
                                 }
                                 state.SetItemsProcessed(static_cast<int64_t>(items) * state.iterations());
                               })
      ->Unit(benchmark::kMillisecond)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

// Triangles row by row, so that regions are bands; counter-clockwise from outside.
Mesh<ObjectSpace> sphere(int around, int along) {
  Mesh<ObjectSpace> mesh;
  for (int j = 0; j <= along; ++j)
    for (int i = 0; i < around; ++i) {
      const double theta = std::numbers::pi * j / along, phi = 2 * std::numbers::pi * i / around;
      mesh.positions.push_back(assume<Point3<ObjectSpace>>(
          Vec3<double>(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta))));
    }
  const auto at = [&](int i, int j) { return static_cast<uint32_t>(j * around + i % around); };
  for (int j = 0; j < along; ++j)
    for (int i = 0; i < around; ++i) {
      mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  return mesh;
}

capture::Camera<ObjectSpace> camera() {
  capture::Camera<ObjectSpace> camera;
  camera.lens.width = camera.lens.height = kSide;
  camera.lens.focalX = camera.lens.focalY = 600;
  camera.lens.centerX = camera.lens.centerY = kSide / 2.0;
  camera.cameraFromWorld = {Mat3<double>::Identity(), Vec3<double>(0, 0, -3)};
  return camera;
}

void check(const char* what, double found, double expected) {
  if (!(std::abs(found - expected) <= 1e-3 * expected))
    throw Error::mismatch(fmt::format("{}", expected), fmt::format("{}", found)).at(what);
}

// A multipass frame: depth first, then each region once per direction.
class Multipass {
public:
  explicit Multipass(Format format)
      : color_({format, kSide, kSide}), depth_({Format::depth32f, kSide, kSide}),
        target_("multipass", {{&color_}}, {&depth_}) {
    image::Image white(kTextureSide, kTextureSide, 4);
    std::ranges::fill(white.values, 1.f);
    for (int region = 0; region < kRegions; ++region) textures_.upload(white, {.layer = region});
    const Mesh<ObjectSpace> mesh = sphere(320, 157);
    mesh_ = vertexArrayOf(mesh);
    const Eigen::Matrix4f clipFromObject = clipFromWorld(camera(), boundsOf(mesh.positions));
    for (Program* program : {&prepass_, &basis_, &region_}) program->set("clipFromObject", clipFromObject);
  }

  void prepass() {
    target_.clearColor(0, {0, 0, 0, 0});
    target_.clearDepth();
    draw({target_,
          prepass_,
          {},
          {.depth = Compare::less, .writeDepth = true, .writeColor = {}, .cull = Cull::back}},
         mesh_);
  }

  // Weight and texture in one draw.
  void oneStage() {
    prepass();
    region_.set("weight", kWeight);
    forEachPass([&](int region, int direction, const Range& part) {
      region_.set("layer", (region + direction) % kRegions);
      draw({target_,
            region_,
            texture_,
            {.blend = {Factor::one, Factor::one}, .depth = Compare::equal, .cull = Cull::back}},
           mesh_, part);
    });
  }

  // The weight into alpha, then the texture weighted by alpha. [Azuma 1999, 2.3]
  void twoStages() {
    prepass();
    region_.set("weight", 1.f);
    basis_.set("weight", kWeight);
    forEachPass([&](int region, int direction, const Range& part) {
      region_.set("layer", (region + direction) % kRegions);
      draw({target_,
            basis_,
            {},
            {.depth = Compare::equal, .writeColor = {false, false, false, true}, .cull = Cull::back}},
           mesh_, part);
      draw({target_,
            region_,
            texture_,
            {.blend = {Factor::targetAlpha, Factor::one},
             .depth = Compare::equal,
             .writeColor = {true, true, true, false},
             .cull = Cull::back}},
           mesh_, part);
    });
  }

  double redOver(const std::function<void()>& frame) {
    frame();
    double red = 0;
    const image::Image picture = color_.read();
    for (size_t i = 0; i < picture.values.size(); i += 4) red += picture.values[i];
    return red;
  }
  double visiblePixels() {
    prepass();
    const std::vector<float> depths = depth_.read().values;
    return static_cast<double>(std::ranges::count_if(depths, [](float depth) { return depth < 1; }));
  }

private:
  template <class DrawPass> void forEachPass(const DrawPass& drawPass) {
    const size_t triangles = mesh_.size() / 3;
    for (int region = 0; region < kRegions; ++region) {
      const size_t first = triangles * static_cast<size_t>(region) / kRegions;
      const size_t end = triangles * (static_cast<size_t>(region) + 1) / kRegions;
      for (int direction = 0; direction < kDirections; ++direction)
        drawPass(region, direction, Range{3 * first, 3 * (end - first)});
    }
  }

  Texture color_, depth_, textures_{{Format::rgba8, kTextureSide, kTextureSide, kRegions}};
  const Texture* texture_[1] = {&textures_};
  Framebuffer target_;
  VertexArray mesh_{{}};
  Program prepass_{kShaders, {"mesh.vert", "depth.frag"}}, basis_{kShaders, {"mesh.vert", "basis.frag"}},
      region_{kShaders, {"mesh.vert", "region.frag"}};
};

void registerMultipass(Format format, const std::string& name) {
  const auto scene = std::make_shared<Multipass>(format);
  const double expected = kDirections * kWeight * scene->visiblePixels();
  check("red of one stage", scene->redOver([&] { scene->oneStage(); }), expected);
  check("red of two stages", scene->redOver([&] { scene->twoStages(); }), expected);
  add("prepass/" + name, 1, [scene] { scene->prepass(); });
  add("passes/" + name, kPasses, [scene] { scene->oneStage(); });
  add("two_stage_passes/" + name, kPasses, [scene] { scene->twoStages(); });
}

// Blended rectangles: pixels a second, and the cost of a draw and of a switch of framebuffer.
struct Fill {
  Texture color{{Format::rgba32f, kSide, kSide}}, other{{Format::rgba32f, kSide, kSide}};
  Framebuffer target{"fill", {{&color}}}, otherTarget{"other", {{&other}}};
  Program program{kShaders, {"everywhere.vert", "basis.frag"}};
  VertexArray none{{}};

  Fill() { program.set("weight", 1.f); }

  void rectangles(int count, int side, bool alternating) {
    for (int i = 0; i < count; ++i) {
      const Framebuffer& place = alternating && i % 2 ? otherTarget : target;
      const Rect rect{i * 37 % (kSide - side + 1), i * 53 % (kSide - side + 1), side, side};
      draw({place, program, {}, {.blend = {Factor::one, Factor::one}, .scissor = rect}}, none, {0, 3});
    }
  }
};

void registerFill() {
  const auto fill = std::make_shared<Fill>();
  fill->target.clearColor(0, {0, 0, 0, 0});
  fill->rectangles(kPasses, 50, false);
  double sum = 0;
  for (float value : fill->color.read().values) sum += value / 4;
  check("filled pixels", sum, kPasses * 50. * 50);
  for (int side : {8, 50, 250})
    add(fmt::format("fill/{0}x{0}", side), static_cast<size_t>(kPasses * side * side),
        [=] { fill->rectangles(kPasses, side, false); });
  add("framebuffer_switches", kPasses, [=] { fill->rectangles(kPasses, 8, true); });
}

void registerTransfers() {
  for (const auto& [format, name] :
       {std::pair(Format::rgba8, "rgba8"), std::pair(Format::rgba16f, "rgba16f"),
        std::pair(Format::rgba32f, "rgba32f"), std::pair(Format::dxt1, "dxt1")}) {
    constexpr int kCount = 256;
    const auto textures = std::make_shared<Texture>(TextureShape{format, kTextureSide, kTextureSide, kCount});
    const std::vector<std::byte> texels(bytesOf(format, kTextureSide, kTextureSide));
    add(fmt::format("upload/{}", name), kCount * static_cast<size_t>(kTextureSide * kTextureSide), [=] {
      for (int layer = 0; layer < kCount; ++layer)
        textures->upload(texels, kTextureSide, kTextureSide, {.layer = layer});
    });
    if (isCompressed(format)) continue;
    const image::Image picture(1024, 768, 4);
    const auto texture = std::make_shared<Texture>(TextureShape{format, 1024, 768});
    add(fmt::format("upload_picture/{}", name), 1024 * 768, [=] { texture->upload(picture); });
    add(fmt::format("read_picture/{}", name), 1024 * 768, [=] { benchmark::DoNotOptimize(texture->read()); });
  }
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  try {
    const surflect::gl::Context context;
    std::printf("%s, %s\n", context.describe().renderer.c_str(), context.describe().version.c_str());
    surflect::bench::registerMultipass(surflect::gl::Format::rgba16f, "rgba16f");
    surflect::bench::registerMultipass(surflect::gl::Format::rgba32f, "rgba32f");
    surflect::bench::registerFill();
    surflect::bench::registerTransfers();
    benchmark::RunSpecifiedBenchmarks();
    benchmark::ClearRegisteredBenchmarks(); // which own objects of the context
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_gl: %s\n", error.what());
    return 1;
  }
  return 0;
}
