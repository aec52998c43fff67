// Ablation study: test frames of a capture, scored as by `surflect evaluate`, with one setting changed at a
// time. With a script, the capture is the ground truth of the deformed object, and alternative maps of
// directions (directions.h) are compared too.
#include "bench/accuracy/directions.h"
#include "bench/accuracy/program.h"
#include "render/evaluation/evaluate.h"
#include "render/methods.h"

#include <cstdlib>
#include <map>
#include <memory>
#include <string>

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

Json ablation(const Words& words) {
  const model::Model model = model::openModel(words[0]);
  const capture::Capture capture = capture::readCapture(words[1]);
  const bool isBent = words.size() == 4;
  warp::WarpPointer warp = warp::chainWarp({});
  if (isBent) {
    const scene::Script script = scene::readScript(words[2], model.rig.origin);
    warp = scene::warpAt(script, scene::shotTime(script, std::atof(words[3].c_str())));
  }
  const auto opened = [&](const method::Setting& setting) { return method::openRenderer(words[0], setting); };
  std::map<std::string, std::unique_ptr<method::Renderer>> variants;
  variants["nearest"] = opened({{"interpolation", "nearest"}});
  if (isBent) {
    variants["bisector"] = opened({{"tangents", "bisector"}});
    variants["gram_schmidt"] = withDirections(model, byGramSchmidt);
    variants["inverse_jacobian"] = withDirections(model, byInverseJacobian);
  }
  evaluation::EvaluateOptions options;
  for (const auto& [name, renderer] : variants) options.others[name] = renderer.get();
  const evaluation::Evaluation evaluation = evaluation::evaluate(*opened({}), capture, *warp, options);
  Json report;
  report["default"] = summaryOf(evaluation, [](const evaluation::FrameScore& frame) { return frame.score; });
  for (const auto& [name, renderer] : variants)
    report[name] =
        summaryOf(evaluation, [&](const evaluation::FrameScore& frame) { return frame.others.at(name); });
  return report;
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  return surflect::bench::runProgram(argc, argv, "ablation MODEL CAPTURE [SCRIPT FRAME]", {2, 4},
                                     surflect::bench::ablation);
}
