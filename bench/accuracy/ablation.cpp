// Ablation study: test frames of a capture, scored as by `surflect evaluate`, with one setting changed at a
// time. With a script, the capture is the ground truth of the deformed object, and alternative maps of
// directions (directions.h) are compared too.
#include "bench/accuracy/directions.h"
#include "bench/accuracy/program.h"

#include <cstdlib>
#include <map>

namespace surflect::bench {
namespace {

template <class ScoreOf> Json summaryOf(const evaluation::Evaluation& evaluation, const ScoreOf& scoreOf) {
  std::map<std::string, evaluation::Score> groups;
  evaluation::Score all;
  for (const evaluation::FrameScore& frame : evaluation.frames) {
    all += scoreOf(frame);
    groups[frame.group] += scoreOf(frame);
  }
  const auto json = [](const evaluation::Score& score) {
    Json figures = jsonOf(score.difference);
    figures["frame_count"] = score.frames;
    return figures;
  };
  Json summary = json(all);
  for (const auto& [group, score] : groups) summary["groups"][group] = json(score);
  return summary;
}

struct Variant {
  const char* name;
  shading::ShadeOptions options;
  DirectionsBack back;
};

Json ablation(const Words& words) {
  const model::Model model = model::openModel(words[0]);
  const capture::Capture capture = capture::readCapture(words[1]);
  const bool isBent = words.size() == 4;
  warp::WarpPointer warp = warp::chainWarp({});
  if (isBent) {
    const scene::Script script = scene::readScript(words[2], model.rig.origin);
    warp = scene::warpAt(script, scene::shotTime(script, std::atof(words[3].c_str())));
  }
  shading::ShadeOptions oneCamera, oneLight;
  oneCamera.cameras = 1;
  oneLight.lights = 1;
  std::vector<Variant> variants{{"one_camera", oneCamera, byPolarFactor},
                                {"one_light", oneLight, byPolarFactor}};
  if (isBent)
    variants.insert(variants.end(), {{"bisector", {}, byBisector},
                                     {"gram_schmidt", {}, byGramSchmidt},
                                     {"inverse_jacobian", {}, byInverseJacobian}});
  codec::BlockCache cache(model.files, size_t{1} << 30);
  evaluation::EvaluateOptions options;
  options.baselines = {evaluation::Baseline::nearest};
  for (const Variant& variant : variants)
    options.others.push_back([&](const capture::Camera<ObjectSpace>& camera) {
      return withDirections(model, *warp, camera, variant.options, cache, variant.back);
    });
  const evaluation::Evaluation evaluation = evaluation::evaluate(model, capture, *warp, options, cache, {});
  Json report;
  report["default"] = summaryOf(evaluation, [](const evaluation::FrameScore& frame) { return frame.score; });
  report["nearest"] = summaryOf(evaluation, [](const evaluation::FrameScore& frame) {
    return frame.baselines.at(evaluation::Baseline::nearest);
  });
  for (size_t i = 0; i < variants.size(); ++i)
    report[variants[i].name] =
        summaryOf(evaluation, [i](const evaluation::FrameScore& frame) { return frame.others[i]; });
  return report;
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  return surflect::bench::runProgram(argc, argv, "ablation MODEL CAPTURE [SCRIPT FRAME]", {2, 4},
                                     surflect::bench::ablation);
}
