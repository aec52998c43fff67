// Measures the multipass renderer of surface light fields at the scale of [Azuma 1999, §3]: passes by kind of
// culling, pixels that the basis stage fills, frame times with each optimisation on and off, the split of a
// frame's time, and the cache policies. Frames are checked against the reference first.
#include "bench/slf/synthetic_field.h"
#include "render/lightfield/slf/reference.h"
#include "render/lightfield/slf/slf_frame.h"
#include "surfel/base/error.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace surflect::bench {
namespace {

using namespace slf;
using Json = nlohmann::ordered_json;
using Camera = capture::Camera<AcquisitionSpace>;

struct Arguments {
  // 216 regions, 209,088 triangles, 66 directions, 36 million texels
  SyntheticOptions field{.cells = 6, .quads = 22, .texels = 50, .subdivisions = 2};
  int frames = 5;
  bool json = false;
};

struct Size {
  int width = 0, height = 0;
};
constexpr std::array<Size, 2> kSizes{{{500, 500}, {1024, 768}}};
constexpr double kLeastDb = 60; // least PSNR of a frame against the reference
constexpr int kViews = 20;

// View `index` of a walk around the object, `step` degrees a view, which shows all of it.
Camera view(const Size& size, int index, double step) {
  const double azimuth = index * step * std::numbers::pi / 180, elevation = 0.4 * std::sin(2 * azimuth);
  const Vec3<double> z(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                       std::sin(elevation));
  const Vec3<double> x = Vec3<double>::UnitZ().cross(z).normalized();
  Mat3<double> rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  constexpr double kDistance = 4;
  Camera camera;
  camera.lens.width = size.width;
  camera.lens.height = size.height;
  camera.lens.focalX = camera.lens.focalY = 1.6 * size.height;
  camera.lens.centerX = size.width / 2.0;
  camera.lens.centerY = size.height / 2.0;
  camera.cameraFromWorld = {rotation, Vec3<double>(0, 0, -kDistance)};
  return camera;
}

double psnrOf(const image::Image& a, const image::Image& b) {
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < a.values.size(); i += 4) {
    if (a.values[i + 3] != 1 || b.values[i + 3] != 1) continue;
    for (size_t channel = 0; channel < 3; ++channel)
      sum += std::pow(a.values[i + channel] - b.values[i + channel], 2);
    count += 3;
  }
  return -10 * std::log10(sum / static_cast<double>(count));
}

double ms(double seconds) { return 1e3 * seconds; }

class Bench {
public:
  Bench(const Arguments& arguments, const gl::Context& context)
      : arguments_(arguments), context_(context), field_(syntheticField(arguments.field)),
        textures_(field_, arguments.field), renderer_(field_, textures_, {}, context.describe().limits) {}

  Json report() {
    Json report{{"driver", context_.describe().renderer + ", " + context_.describe().version},
                {"triangles", field_.mesh.triangles.size()},
                {"regions", field_.regions.size()},
                {"textures", field_.textures()},
                {"texels_of_a_texture", field_.regions[0].chart.texels()}};
    for (const Size& size : kSizes) {
      Json entry{{"size", fmt::format("{}x{}", size.width, size.height)}};
      entry["psnr"] = accuracy(size);
      entry["passes"] = passes(size);
      entry["basis_fill"] = fill(size);
      entry["ms"] = frames(size);
      entry["split"] = split(size);
      entry["cache"] = caches(size);
      report["sizes"].push_back(entry);
    }
    return report;
  }

private:
  // Throws Error if a method is wrong.
  Json accuracy(const Size& size) {
    const Camera camera = view(size, 0, 18);
    const image::Image expected = Reference(field_, textures_).render(camera).color;
    const auto psnr = [&](const FrameOptions& options) {
      return psnrOf(renderer_.render(camera, options).color, expected);
    };
    const double fused = psnr({}), stages = psnr({.method = Stages::twoStages});
    for (const double db : {fused, stages})
      if (!(db >= kLeastDb)) throw Error::mismatch(fmt::format("{} dB", kLeastDb), fmt::format("{} dB", db));
    return {{"fused", fused}, {"two_stages", stages}, {"gouraud", psnr({.basis = Basis::gouraud})}};
  }

  // Means over views.
  Json passes(const Size& size) const {
    PassPlanner planner(field_);
    const auto mean = [&](const PlanOptions& options) {
      double sum = 0;
      for (int i = 0; i < kViews; ++i)
        sum += static_cast<double>(planner.plan(view(size, i, 18), options).passes()) / kViews;
      return sum;
    };
    const double all = static_cast<double>(field_.textures()), both = mean({});
    return {{"all", all},
            {"direction_culling", mean({.regionCulling = false})},
            {"region_culling", mean({.directionCulling = false})},
            {"both", both},
            {"share", both / all}};
  }

  // Millions of pixels, and triangles, of a view.
  Json fill(const Size& size) const {
    const Camera camera = view(size, 0, 18);
    PassPlanner planner(field_);
    const PassPlan wide = planner.plan(camera, {.scissor = false}), tight = planner.plan(camera);
    const auto pixels = [&](const PassPlan& plan, bool visited) {
      return basisFill(field_, plan, camera, visited) / 1e6;
    };
    return {{"all_triangles", pixels(wide, false)},
            {"visited_triangles", pixels(wide, true)},
            {"scissor", pixels(tight, false)},
            {"both", pixels(tight, true)}};
  }

  // Least milliseconds of frames whose textures are there; all kinds take turns.
  Json frames(const Size& size) {
    const FrameOptions stages{.method = Stages::twoStages};
    std::vector<std::pair<std::string, FrameOptions>> kinds{{"fused", {}}, {"two_stages", stages}};
    const auto add = [&](const char* name, const auto& change) {
      kinds.emplace_back(name, stages);
      change(kinds.back().second);
    };
    add("gouraud", [](FrameOptions& o) { o.basis = Basis::gouraud; });
    add("without_scissor", [](FrameOptions& o) { o.plan.scissor = false; });
    add("without_visited_triangles", [](FrameOptions& o) { o.visitedTriangles = false; });
    add("without_both", [](FrameOptions& o) { o.plan.scissor = o.visitedTriangles = false; });
    add("without_region_culling", [](FrameOptions& o) { o.plan.regionCulling = false; });
    add("without_direction_culling", [](FrameOptions& o) { o.plan.directionCulling = false; });
    std::vector<double> least(kinds.size(), std::numeric_limits<double>::infinity());
    for (int frame = 0; frame < arguments_.frames; ++frame)
      for (size_t kind = 0; kind < kinds.size(); ++kind) {
        const FrameStats stats = renderer_.render(view(size, 0, 18), kinds[kind].second).stats;
        least[kind] = std::min(least[kind], ms(stats.planSeconds + stats.drawSeconds));
      }
    Json result;
    for (size_t kind = 0; kind < kinds.size(); ++kind) result[kinds[kind].first] = least[kind];
    return result;
  }

  // Figure 3.3 of the paper: milliseconds of the parts of a frame whose textures are all uploaded, before and
  // after the optimisations of the basis stage. A stage's time is what a frame without it lacks.
  Json split(const Size& size) {
    const auto parts = [&](bool optimised) {
      FrameOptions both{.method = Stages::twoStages, .visitedTriangles = optimised};
      both.plan.scissor = optimised;
      FrameOptions regionOnly = both, basisOnly = both, neither = both;
      regionOnly.basisStage = basisOnly.regionStage = false;
      neither.basisStage = neither.regionStage = false;
      double overhead = 1e9, all = 1e9, withoutBasis = 1e9, withoutRegion = 1e9, none = 1e9, texture = 1e9;
      for (int frame = 0; frame < arguments_.frames; ++frame) {
        FrameRenderer cold(field_, textures_, {size_t{64} << 20, CachePolicy::lru},
                           context_.describe().limits);
        texture = std::min(texture, ms(cold.render(view(size, 0, 18), neither).stats.textures.seconds));
        const auto least = [&](double& time, const FrameOptions& options) {
          const FrameStats stats = renderer_.render(view(size, 0, 18), options).stats;
          overhead = std::min(overhead, ms(stats.planSeconds));
          time = std::min(time, ms(stats.drawSeconds));
        };
        least(all, both), least(withoutBasis, regionOnly), least(withoutRegion, basisOnly);
        least(none, neither);
      }
      return Json{{"overhead", overhead},
                  {"depth", none},
                  {"basis", all - withoutBasis},
                  {"region", all - withoutRegion},
                  {"texture", texture}};
    };
    return {{"before", parts(false)}, {"after", parts(true)}};
  }

  // Hits and bytes by policy and budget, for a walking or a still camera, without the first frames.
  Json caches(const Size& size) {
    const size_t needed = PassPlanner(field_).plan(view(size, 0, 18)).passes();
    Json result = Json::array();
    for (const double step : {0.0, 2.0})
      for (const double share : {0.1, 0.5, 1.0})
        for (const auto& [policy, name] :
             {std::pair(CachePolicy::lru, "lru"), std::pair(CachePolicy::modifiedLru, "modified_lru"),
              std::pair(CachePolicy::planned, "planned")}) {
          const size_t slotBytes = renderer_.slots().shape().bytes();
          const auto slots = static_cast<size_t>(std::ceil(share * static_cast<double>(needed)));
          FrameRenderer renderer(field_, textures_, {slots * slotBytes, policy}, context_.describe().limits);
          constexpr int kWarm = 2;
          double hits = 0, misses = 0, bytes = 0, seconds = 0;
          for (int frame = 0; frame < kWarm + arguments_.frames; ++frame) {
            const FrameStats stats =
                renderer.render(view(size, frame, step), {.method = Stages::twoStages}).stats;
            if (frame < kWarm) continue;
            hits += static_cast<double>(stats.textures.hits) / arguments_.frames;
            misses += static_cast<double>(stats.textures.misses) / arguments_.frames;
            bytes += static_cast<double>(stats.textures.bytes) / arguments_.frames;
            seconds += stats.textures.seconds / arguments_.frames;
          }
          result.push_back({{"degrees_a_frame", step},
                            {"budget", share},
                            {"policy", name},
                            {"hit_share", hits / (hits + misses)},
                            {"megabytes", bytes / 1e6},
                            {"ms", ms(seconds)}});
        }
    return result;
  }

  const Arguments& arguments_;
  const gl::Context& context_;
  Field field_;
  SyntheticTextures textures_;
  FrameRenderer renderer_;
};

void printTable(const Json& report) {
  fmt::print("{}\n{} triangles, {} regions, {} textures of {} texels\n", report["driver"].get<std::string>(),
             report["triangles"].get<size_t>(), report["regions"].get<size_t>(),
             report["textures"].get<size_t>(), report["texels_of_a_texture"].get<size_t>());
  for (const Json& entry : report["sizes"]) {
    fmt::print("\n{}\n", entry["size"].get<std::string>());
    const double base = entry["ms"]["two_stages"].get<double>();
    for (const auto& [group, values] : entry.items()) {
      if (!values.is_object()) continue;
      for (const auto& [name, value] : values.items()) {
        if (value.is_object()) {
          fmt::print("  {:<10} {:<26}", group, name);
          for (const auto& [part, time] : value.items()) fmt::print(" {} {:.2f}", part, time.get<double>());
          fmt::print("\n");
          continue;
        }
        fmt::print("  {:<10} {:<26} {:>12.3f}", group, name, value.get<double>());
        if (group == "ms") fmt::print("  x {:.2f}", value.get<double>() / base);
        fmt::print("\n");
      }
    }
    fmt::print("  cache      degrees  budget  policy         hits   MB a frame     ms\n");
    for (const Json& row : entry["cache"])
      fmt::print("             {:>7.0f} {:>6.0f} %  {:<12} {:>5.1f} % {:>12.2f} {:>6.2f}\n",
                 row["degrees_a_frame"].get<double>(), 100 * row["budget"].get<double>(),
                 row["policy"].get<std::string>(), 100 * row["hit_share"].get<double>(),
                 row["megabytes"].get<double>(), row["ms"].get<double>());
  }
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  using namespace surflect;
  using namespace surflect::bench;
  Arguments arguments;
  CLI::App app("Measures the multipass renderer of surface light fields at the paper's scale.\n"
               "Example: bench_slf --json > slf.json");
  app.add_option("--frames", arguments.frames, "repetitions of each frame")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--cells", arguments.field.cells, "regions along an edge of the cube: 6 n^2 regions")
      ->capture_default_str()
      ->check(CLI::Range(1, 30));
  app.add_flag("--json", arguments.json, "one object on stdout instead of a table");
  CLI11_PARSE(app, argc, argv);
  try {
    const gl::Context context;
    const Json report = Bench(arguments, context).report();
    if (arguments.json)
      std::cout << report.dump(2) << "\n";
    else
      printTable(report);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_slf: %s\n", error.what());
    return 1;
  }
  return 0;
}
