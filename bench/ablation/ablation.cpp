// The test frames of a capture, rendered with one thing changed at a time; a JSON report on stdout.
//
//   ablation MODEL CAPTURE [SCRIPT FRAME]
//
// The frames are scored as by `surflect evaluate`, of which the report has the figures, a variant each. With
// a script the capture is the truth of the object bent by its warps.

#include "bench/ablation/ray_cast.h"
#include "bench/ablation/variants.h"
#include "srf/proxy/mesh/mesh_mending.h"
#include "surfel/base/error.h"

#include <nlohmann/json.hpp>

#include <cstdio>
#include <cstdlib>
#include <string>

using namespace surflect;

namespace {

using Json = nlohmann::ordered_json;
using RendererOf = std::function<evaluation::Renderer(const capture::Camera<ObjectSpace>&)>;

constexpr int kRaysAcross = 3;
constexpr size_t kCacheBytes = size_t{1} << 30;

Json jsonOf(const evaluation::Score& score) {
  return {{"psnr_linear_db", score.difference.psnrLinear()},
          {"psnr_srgb_db", score.difference.psnrSrgb()},
          {"ssim_srgb", score.difference.ssim()},
          {"frame_count", score.frames}};
}

template <class ScoreOf> Json summaryOf(const evaluation::Evaluation& evaluation, const ScoreOf& scoreOf) {
  evaluation::Score all;
  std::map<std::string, evaluation::Score> groups;
  for (const evaluation::FrameScore& frame : evaluation.frames) {
    all += scoreOf(frame);
    groups[frame.group] += scoreOf(frame);
  }
  Json json = jsonOf(all);
  for (const auto& [group, score] : groups) json["groups"][group] = jsonOf(score);
  return json;
}

std::vector<std::pair<std::string, RendererOf>> variantsOf(const model::Model& model, const warp::Warp& warp,
                                                           const RayCastSurface& surface, bool isBent,
                                                           codec::BlockCache& cache) {
  const auto with = [&](auto change) -> RendererOf {
    return [&, change](const capture::Camera<ObjectSpace>& camera) {
      surfels::FrameOptions options;
      change(options.shade);
      return withDirections({model, warp, camera, options, cache}, byPolarFactor);
    };
  };
  const auto back = [&](DirectionsBack by) -> RendererOf {
    return [&, by](const capture::Camera<ObjectSpace>& camera) {
      return withDirections({model, warp, camera, {}, cache}, by);
    };
  };
  const auto rays = [&](const capture::Camera<ObjectSpace>& camera) {
    return surface.view(camera, kRaysAcross, {}, cache, {});
  };
  const auto splats = with([](model::ShadeOptions&) {});
  std::vector<std::pair<std::string, RendererOf>> variants{
      {"one_camera", with([](model::ShadeOptions& shade) { shade.cameras = 1; })},
      {"one_light", with([](model::ShadeOptions& shade) { shade.lights = 1; })},
      {"light_hull",
       [&](const capture::Camera<ObjectSpace>& camera) {
         return withLightHull({model, warp, camera, {}, cache});
       }},
      {"ray_cast", rays},
      {"ray_cast_alpha", [=](const capture::Camera<ObjectSpace>& camera) -> evaluation::Renderer {
         return [colors = splats(camera), others = rays(camera)](std::span<const scene::ShotLight> lights) {
           return underAlphaOf(colors(lights), others(lights));
         };
       }}};
  if (isBent) {
    variants.emplace_back("bisector", back(byBisector));
    variants.emplace_back("gram_schmidt", back(byGramSchmidt));
    variants.emplace_back("inverse_jacobian", back(byInverseJacobian));
  }
  return variants;
}

Json measure(int argc, char** argv) {
  const model::Model model = model::openModel(argv[1]);
  const capture::Capture capture = capture::readCapture(argv[2]);
  warp::WarpPointer warp = warp::chainWarp({});
  if (argc == 5) {
    const scene::Script script = scene::readScript(argv[3], model.rig.origin);
    warp = scene::warpAt(script, scene::shotTime(script, std::atof(argv[4])));
  }
  if (!model.isFullProduct) throw Error("a full product of cameras and lights is needed").in(model.folder);
  const TriangleMesh mesh = proxy::readMended(capture.folder() / capture.geometry, model.rig).mesh;
  const RayCastSurface surface(model, mesh, *warp, {});
  codec::BlockCache cache(model.files, kCacheBytes);
  const auto variants = variantsOf(model, *warp, surface, argc == 5, cache);
  evaluation::EvaluateOptions options;
  options.baselines = {evaluation::Baseline::nearest};
  for (const auto& [name, renderer] : variants) options.others.push_back(renderer);
  const evaluation::Evaluation evaluation = evaluation::evaluate(model, capture, *warp, options, cache, {});
  Json report;
  report["default"] = summaryOf(evaluation, [](const evaluation::FrameScore& frame) { return frame.score; });
  report["nearest"] = summaryOf(evaluation, [](const evaluation::FrameScore& frame) {
    return frame.baselines.at(evaluation::Baseline::nearest);
  });
  for (size_t i = 0; i < variants.size(); ++i)
    report[variants[i].first] =
        summaryOf(evaluation, [i](const evaluation::FrameScore& frame) { return frame.others[i]; });
  return report;
}

} // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 5) {
    std::fprintf(stderr, "usage: ablation MODEL CAPTURE [SCRIPT FRAME]\n");
    return 2;
  }
  try {
    std::printf("%s\n", measure(argc, argv).dump(2).c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "ablation: %s\n", error.what());
    return 1;
  }
}
