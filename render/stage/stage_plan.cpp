#include "render/stage/stage_plan.h"

#include <algorithm>

namespace surflect {

namespace {

// Every how-manieth training view is photographed under test lights, where not all are.
size_t stepOfTestLights(size_t trainingViews) {
  constexpr size_t kMost = 8;
  return std::max(size_t{1}, (trainingViews + kMost - 1) / kMost);
}

} // namespace

StagePlan planOf(const Stage& stage, StageFrames which) {
  const StageRig& rig = stage.rig;
  StagePlan plan;
  Capture& capture = plan.capture;
  capture.colorSpace = ColorSpace::linear;
  capture.geometry = "geometry.obj";
  capture.lights = rig.lights;
  if (which == StageFrames::training) capture.lights.resize(rig.trainingLights);
  const bool hasTestViews = rig.trainingViews < rig.views.size();
  const size_t step = stepOfTestLights(rig.trainingViews);

  const auto isTaken = [&](size_t view, size_t light) {
    const bool isTrainingView = view < rig.trainingViews;
    switch (which) {
    case StageFrames::all:
      return true;
    case StageFrames::training:
      return isTrainingView;
    case StageFrames::test:
      return !isTrainingView || (light >= rig.trainingLights && view % step == 0);
    case StageFrames::deformed:
      return !isTrainingView || !hasTestViews;
    }
    return false;
  };
  for (size_t v = 0; v < rig.views.size(); ++v) {
    const size_t before = capture.frames.size();
    for (size_t l = 0; l < capture.lights.size(); ++l) {
      if (!isTaken(v, l)) continue;
      Frame frame;
      frame.view = capture.views.size();
      frame.light = l;
      frame.picture = std::filesystem::path("images") / (rig.views[v].identity + ".exr");
      frame.layer = rig.lights[l].name;
      frame.alphaLayer = "matte";
      const bool isTraining =
          which != StageFrames::deformed && v < rig.trainingViews && l < rig.trainingLights;
      frame.split = isTraining ? Split::train : Split::test;
      capture.frames.push_back(frame);
    }
    if (capture.frames.size() == before) continue;
    capture.views.push_back(rig.views[v]);
    plan.views.push_back(v);
  }
  if (capture.frames.empty())
    throw Error("neither views nor lights are kept back: there is nothing for the test").in(stage.file);
  return plan;
}

TriangleMesh meshOf(const std::vector<StageObject>& objects) {
  TriangleMesh whole;
  for (const StageObject& object : objects) {
    const TriangleMesh& mesh = object.surface.mesh;
    const auto first = static_cast<uint32_t>(whole.positions.size());
    whole.positions.insert(whole.positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const auto& [a, b, c] : mesh.triangles) whole.triangles.push_back({first + a, first + b, first + c});
  }
  return whole;
}

} // namespace surflect
