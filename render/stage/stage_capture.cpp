#include "render/stage/stage_capture.h"

#include "render/stage/stage_pictures.h"
#include "srf/capture/writer.h"
#include "surfel/base/file.h"
#include "surfel/base/resumable_folder.h"
#include "surfel/base/step_progress.h"

#include <fmt/format.h>

#include <cassert>
#include <iterator>
#include <memory>

namespace surflect::stage {

namespace fs = std::filesystem;

namespace {

std::string objOf(const TriangleMesh& mesh) {
  std::string text;
  const auto end = std::back_inserter(text);
  for (const auto& p : mesh.positions) fmt::format_to(end, "v {:.9g} {:.9g} {:.9g}\n", p.x(), p.y(), p.z());
  for (const auto& [a, b, c] : mesh.triangles) fmt::format_to(end, "f {} {} {}\n", 1 + a, 1 + b, 1 + c);
  return text;
}

std::unique_ptr<const StageScene> sceneOf(const Stage& stage, const StageDeformation* deformation) {
  std::vector<StageObject> objects = stage.objects;
  for (size_t i = 0; deformation && i < objects.size(); ++i) {
    try {
      objects[i].surface = deformed(objects[i].surface, deformation->warp);
      requireVisible(objects[i].surface);
    } catch (const Error& error) {
      throw Error(fmt::format("bent by the script: {}", error.what()))
          .at(fmt::format("object[{}]", i))
          .in(stage.file);
    }
  }
  return std::make_unique<const StageScene>(std::move(objects));
}

FolderIdentity identityOf(const Stage& stage, const StageDeformation* deformation, StageFrames which) {
  assert((deformation != nullptr) == (which == StageFrames::deformed));
  return {"stage.identity",
          fmt::format("stage {} {} {:016x} {:016x}\n", kPictureFormat, static_cast<int>(which), stage.hash,
                      deformation ? deformation->hash : 0),
          "is of another stage file, script or frame"};
}

} // namespace

void requireCapturable(const Stage& stage, const StageDeformation* deformation, StageFrames which,
                       const fs::path& folder) {
  planOf(stage, which);
  requireResumable(folder, identityOf(stage, deformation, which));
}

StageReport captureStage(const Stage& stage, const StageDeformation* deformation, StageFrames which,
                         const fs::path& folder, const Progress& progress) {
  const StagePlan plan = planOf(stage, which);
  const capture::Capture& capture = plan.capture;
  const FolderIdentity identity = identityOf(stage, deformation, which);
  requireResumable(folder, identity);
  StageReport report{capture.views.size(), capture.lights.size()};
  for (const capture::Frame& frame : capture.frames)
    ++(frame.split == capture::Split::train ? report.trainingFrames : report.testFrames);
  std::vector<size_t> missing;
  for (size_t view = 0; view < capture.views.size(); ++view)
    if (!isFinished(plan, view, folder)) missing.push_back(view);
  report.resumedViews = capture.views.size() - missing.size();

  progress("scene", 0);
  std::unique_ptr<const StageScene>
      scene; // before the folder is begun, because the script may leave nothing visible
  if (!missing.empty()) scene = sceneOf(stage, deformation);
  claimFolder(folder, identity);
  for (size_t i = 0; i < missing.size(); ++i) {
    const Progress ofView = stepOf(progress, "tracing", i, missing.size());
    write(trace(*scene, stage, plan, missing[i], ofView), stage, plan, missing[i], folder, ofView);
  }
  if (!fs::exists(folder / capture.geometry))
    writeFileAtomically(folder / capture.geometry, objOf(meshOf(stage.objects)));
  capture::writeCapture(capture, folder);
  progress("tracing", 1);
  return report;
}

} // namespace surflect::stage
