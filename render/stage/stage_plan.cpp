#include "render/stage/stage_plan.h"

#include <fmt/format.h>

#include <algorithm>

namespace surflect::stage {

namespace {

// Step between training views that are photographed under test lights, if not all are.
size_t stepOfTestLights(size_t trainingViews) {
  constexpr size_t kMost = 8;
  return std::max(size_t{1}, (trainingViews + kMost - 1) / kMost);
}

namespace fs = std::filesystem;

// images/C000.exr, or with an exposure images/C000.L00.0.png, ...
void setPictures(capture::Frame& frame, const capture::View& view, const capture::Light& light,
                 const std::optional<StageExposure>& camera) {
  const fs::path folder = "images";
  if (!camera) {
    frame.picture = folder / (view.identity + ".exr");
    frame.layer = light.name;
    frame.alphaLayer = "matte";
    return;
  }
  for (size_t shot = 0; shot < camera->seconds.size(); ++shot) {
    const fs::path picture = folder / fmt::format("{}.{}.{}.png", view.identity, light.name, shot);
    const double seconds = camera->seconds[shot];
    if (shot > 0) {
      frame.further.push_back({picture, "", "", seconds});
    } else {
      frame.picture = picture;
      frame.exposure = seconds;
    }
  }
}

} // namespace

StagePlan planOf(const Stage& stage, StageFrames which) {
  const StageRig& rig = stage.rig;
  StagePlan plan;
  capture::Capture& capture = plan.capture;
  capture.colorSpace = stage.exposure ? capture::ColorSpace::srgb : capture::ColorSpace::linear;
  if (stage.exposure && !stage.exposure->isSrgb) {
    capture.colorSpace.reset();
    capture.response = stage.exposure->response;
  }
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
      capture::Frame frame;
      frame.view = capture.views.size();
      frame.light = l;
      setPictures(frame, rig.views[v], rig.lights[l], stage.exposure);
      const bool isTraining =
          which != StageFrames::deformed && v < rig.trainingViews && l < rig.trainingLights;
      frame.split = isTraining ? capture::Split::train : capture::Split::test;
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

double positive(const scene::Entry& entry) {
  const double number = scene::asNumber(entry);
  if (!(number >= 1e-9 && number <= 1e9)) throw scene::mismatch(entry, "a number above 0, in 1e-9..1e9");
  return number;
}

int integerOr(const scene::Section& section, std::string_view key, int least, int most, int otherwise) {
  const auto entry = section.find(key);
  return entry ? scene::asInteger(*entry, least, most) : otherwise;
}

Point3<AcquisitionSpace, double> pointOr0(const scene::Section& section, std::string_view key) {
  const auto entry = section.find(key);
  return assume<Point3<AcquisitionSpace, double>>(entry ? asVector(*entry) : Vec3<double>(0, 0, 0));
}

Rgb asColor(const scene::Entry& entry, double least, double most) {
  const auto parts = scene::asArray(entry, "an array of 3 numbers");
  if (parts.size() != 3) throw scene::mismatch(entry, "an array of 3 numbers");
  const auto channel = [&](size_t i) { return static_cast<float>(numberIn(parts[i], least, most)); };
  return {channel(0), channel(1), channel(2)};
}

} // namespace surflect::stage
