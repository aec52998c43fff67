#include "render/stage/stage_capture.h"

#include "render/stage/stage_pictures.h"
#include "srf/capture/writer.h"
#include "surfel/file.h"
#include "surfel/folder.h"
#include "surfel/step_progress.h"

#include <fmt/format.h>

#include <cassert>

namespace surflect {

namespace fs = std::filesystem;

namespace {

std::string objOf(const TriangleMesh& mesh) {
  std::string text;
  for (const auto& p : mesh.positions) text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", p.x(), p.y(), p.z());
  for (const auto& [a, b, c] : mesh.triangles) text += fmt::format("f {} {} {}\n", 1 + a, 1 + b, 1 + c);
  return text;
}

// A folder is begun by its identity; what has another one, or none, is somebody else's.
void claim(const fs::path& folder, const std::string& identity) {
  const fs::path path = folder / "stage.identity";
  if (fs::exists(path)) {
    if (readFile(path, 1 << 16) != identity)
      throw Error("is of another stage file, script or frame: give the output a folder of its own")
          .in(folder);
  } else {
    removeAbandoned(folder, [&](const std::string& name) { return name == path.filename(); });
    if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
      throw Error::mismatch("a new folder, or an empty one", "something there already").in(folder);
    createFolder(folder);
    writeFileAtomically(path, identity);
  }
  createFolder(folder / "images");
}

StageScene sceneOf(const Stage& stage, const StageDeformation* deformation) {
  std::vector<StageObject> objects = stage.objects;
  for (size_t i = 0; deformation && i < objects.size(); ++i) {
    try {
      objects[i].surface = deformed(objects[i].surface, deformation->warp);
    } catch (Error& error) {
      throw std::move(error).at(fmt::format("object[{}]", i)).in(stage.file);
    }
  }
  return StageScene(std::move(objects));
}

} // namespace

StageReport captureStage(const Stage& stage, const StageDeformation* deformation, StageFrames which,
                         const fs::path& folder, const Progress& progress) {
  assert((deformation != nullptr) == (which == StageFrames::deformed));
  const StagePlan plan = planOf(stage, which);
  const Capture& capture = plan.capture;
  claim(folder, fmt::format("stage {} {} {:016x} {:016x}\n", kPictureFormat, static_cast<int>(which),
                            stage.hash, deformation ? deformation->hash : 0));
  removeAbandoned(folder, [](const std::string&) { return true; });
  removeAbandoned(folder / "images", [](const std::string&) { return true; });

  StageReport report{capture.views.size(), capture.lights.size()};
  for (const Frame& frame : capture.frames)
    ++(frame.split == Split::train ? report.trainingFrames : report.testFrames);
  std::vector<size_t> missing;
  for (size_t view = 0; view < capture.views.size(); ++view)
    if (!isFinished(plan, view, folder)) missing.push_back(view);
  report.resumedViews = capture.views.size() - missing.size();

  const StageScene scene = sceneOf(stage, deformation);
  for (size_t i = 0; i < missing.size(); ++i) {
    const Progress ofView = stepOf(progress, "tracing", i, missing.size());
    write(trace(scene, stage, plan, missing[i], ofView), stage, plan, missing[i], folder, ofView);
  }
  writeFileAtomically(folder / capture.geometry, objOf(meshOf(stage.objects)));
  writeCapture(capture, folder);
  progress("tracing", 1);
  return report;
}

} // namespace surflect
