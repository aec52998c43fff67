#include "render/stage/stage_capture.h"

#include "srf/capture/writer.h"
#include "surfel/file.h"

#include <fmt/format.h>

#include <algorithm>

namespace surflect {

namespace fs = std::filesystem;

namespace {

constexpr int kFormat = 1; // of what is written for a stage: another number makes resuming start anew

fs::path pictureOf(const View& view) { return fs::path("images") / (view.identity + ".exr"); }

constexpr const char* kGeometry = "geometry.obj";

Capture describe(const Stage& stage, bool isDeformed) {
  Capture capture;
  capture.colorSpace = ColorSpace::linear;
  capture.geometry = kGeometry;
  capture.lights = stage.rig.lights;
  const bool testOnly = isDeformed && stage.rig.trainingViews < stage.rig.views.size();
  for (size_t v = testOnly ? stage.rig.trainingViews : 0; v < stage.rig.views.size(); ++v) {
    for (size_t l = 0; l < stage.rig.lights.size(); ++l) {
      Frame frame;
      frame.view = capture.views.size();
      frame.light = l;
      frame.picture = pictureOf(stage.rig.views[v]);
      frame.layer = stage.rig.lights[l].name;
      frame.alphaLayer = "matte";
      const bool isTraining = !isDeformed && v < stage.rig.trainingViews && l < stage.rig.trainingLights;
      frame.split = isTraining ? Split::train : Split::test;
      capture.frames.push_back(frame);
    }
    capture.views.push_back(stage.rig.views[v]);
  }
  return capture;
}

// All objects as one mesh, to the bit.
std::string objOf(const std::vector<StageObject>& objects) {
  std::string vertices, faces;
  size_t first = 1;
  for (const StageObject& object : objects) {
    const TriangleMesh& mesh = object.surface.mesh;
    for (const auto& p : mesh.positions)
      vertices += fmt::format("v {:.9g} {:.9g} {:.9g}\n", p.x(), p.y(), p.z());
    for (const auto& [a, b, c] : mesh.triangles)
      faces += fmt::format("f {} {} {}\n", first + a, first + b, first + c);
    first += mesh.positions.size();
  }
  return vertices + faces;
}

// A folder is begun by its identity; what has another one, or none, is somebody else's.
void claim(const fs::path& folder, const std::string& identity) {
  const fs::path path = folder / "stage.identity";
  if (fs::exists(path)) {
    if (readFile(path, 1 << 16) != identity)
      throw Error("is of another stage file, script or frame: give the output a folder of its own")
          .in(folder);
  } else {
    if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
      throw Error::mismatch("a new folder, or an empty one", "something there already").in(folder);
    std::error_code failure;
    fs::create_directories(folder, failure);
    if (failure) throw Error("cannot be created (" + failure.message() + ")").in(folder);
    writeFileAtomically(path, identity);
  }
  std::error_code failure;
  fs::create_directories(folder / "images", failure);
  if (failure) throw Error("cannot be created (" + failure.message() + ")").in(folder / "images");
}

// Files appear whole, so that the header tells enough.
bool isFinished(const fs::path& picture) {
  if (!fs::exists(picture)) return false;
  try {
    const ExrFile file(picture);
    return true;
  } catch (const Error&) {
    return false;
  }
}

// Half floats, unless they end below what is to be written.
Precision precisionFor(const TracedView& view) {
  constexpr float kLargestHalf = 65504;
  const auto fits = [](const Image& image) {
    return std::ranges::all_of(image.values, [](float value) { return value <= kLargestHalf; });
  };
  return std::ranges::all_of(view.radiance, fits) ? Precision::half : Precision::single;
}

StageScene sceneOf(const Stage& stage, const StageDeformation* deformation) {
  std::vector<StageObject> objects = stage.objects;
  for (size_t i = 0; deformation && i < objects.size(); ++i) try {
      objects[i].surface = deformed(objects[i].surface, deformation->warp);
    } catch (Error& error) {
      throw std::move(error).at(fmt::format("object[{}]", i)).in(stage.file);
    }
  return StageScene(std::move(objects));
}

} // namespace

StageReport captureStage(const Stage& stage, const StageDeformation* deformation, const fs::path& folder,
                         const Progress& progress) {
  const Capture capture = describe(stage, deformation != nullptr);
  claim(folder,
        fmt::format("stage {} {:016x} {:016x}\n", kFormat, stage.hash, deformation ? deformation->hash : 0));
  removeAbandoned(folder, [](const std::string&) { return true; });
  removeAbandoned(folder / "images", [](const std::string&) { return true; });

  StageReport report{capture.views.size(), capture.lights.size()};
  for (const Frame& frame : capture.frames)
    ++(frame.split == Split::train ? report.trainingFrames : report.testFrames);
  std::vector<size_t> missing;
  for (size_t view = 0; view < capture.views.size(); ++view)
    if (!isFinished(folder / pictureOf(capture.views[view]))) missing.push_back(view);
  report.resumedViews = capture.views.size() - missing.size();

  const StageScene scene = sceneOf(stage, deformation);
  const size_t firstView =
      stage.rig.views.size() - capture.views.size(); // all, or the last ones: see describe()
  for (size_t i = 0; i < missing.size(); ++i) {
    const View& view = capture.views[missing[i]];
    Progress ofView = progress;
    if (progress.report)
      ofView.report = [&](std::string_view, double fraction) {
        progress.report("tracing", (static_cast<double>(i) + fraction) / static_cast<double>(missing.size()));
      };
    const TracedView traced =
        traceView(scene, view.camera, firstView + missing[i], capture.lights, stage.trace, ofView);
    std::vector<RadianceLayer> layers;
    for (size_t l = 0; l < capture.lights.size(); ++l)
      layers.push_back({capture.lights[l].name, &traced.radiance[l]});
    writeViewPictures(folder / pictureOf(view), layers, &traced.alpha, "matte", precisionFor(traced));
  }
  writeFileAtomically(folder / kGeometry, objOf(stage.objects));
  writeCapture(capture, folder);
  progress("tracing", 1);
  return report;
}

} // namespace surflect
