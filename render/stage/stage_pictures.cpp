#include "render/stage/stage_pictures.h"

#include "srf/capture/writer.h"
#include "srf/image/png.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/time.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <memory>
#include <span>

namespace surflect::stage {

namespace {

// Frames of a view, which are contiguous in a plan.
std::span<const capture::Frame> framesOf(const StagePlan& plan, size_t view) {
  return std::ranges::equal_range(plan.capture.frames, view, {}, &capture::Frame::view);
}

image::Precision precisionFor(const TracedView& view) {
  constexpr float kLargestHalf = 65504;
  const auto fits = [](const image::Image& image) {
    return std::ranges::all_of(image.values, [](float value) { return value <= kLargestHalf; });
  };
  return std::ranges::all_of(view.radiance, fits) ? image::Precision::half : image::Precision::single;
}

} // namespace

TracedView trace(const StageScene& scene, const Stage& stage, const StagePlan& plan, size_t view,
                 const Progress& progress) {
  std::vector<capture::Light> lights;
  for (const capture::Frame& frame : framesOf(plan, view))
    lights.push_back(plan.capture.lights[*frame.light]);
  const size_t number = plan.views[view];
  return traceView(scene, stage.rig.views[number].camera, number, lights, stage.trace, progress);
}

void write(const TracedView& traced, const Stage& stage, const StagePlan& plan, size_t view,
           const std::filesystem::path& folder, const Progress& progress) {
  const std::span<const capture::Frame> frames = framesOf(plan, view);
  if (stage.exposure) {
    for (size_t i = 0; i < frames.size(); ++i) {
      const std::vector<capture::Exposure> bracket = capture::bracketOf(frames[i]);
      for (size_t shot = 0; shot < bracket.size(); ++shot) {
        progress.checkpoint();
        image::writePng(folder / bracket[shot].picture,
                        exposed(traced.radiance[i], traced.alpha, *stage.exposure,
                                {stage.trace.seed, plan.views[view], *frames[i].light, shot}),
                        8, stage.exposure->isSrgb ? image::PngColors::srgb : image::PngColors::unstated);
      }
    }
    return;
  }
  std::vector<capture::RadianceLayer> layers;
  for (size_t i = 0; i < frames.size(); ++i) layers.push_back({frames[i].layer, &traced.radiance[i]});
  capture::writeViewPictures(folder / frames[0].picture, layers, &traced.alpha, frames[0].alphaLayer,
                             precisionFor(traced), progress);
}

model::ViewPictures asRead(TracedView traced, const Progress& progress) {
  const image::Precision precision = precisionFor(traced);
  model::ViewPictures view;
  view.hasMatte = true;
  view.stack.width = traced.alpha.width;
  view.stack.height = traced.alpha.height;
  view.stack.alpha = traced.alpha;
  image::roundTo(precision, view.stack.alpha.values);
  const std::vector<float>&whole = traced.alpha.values, &kept = view.stack.alpha.values;
  std::vector<size_t> invalid(traced.radiance.size());
  tbb::parallel_for(size_t{0}, traced.radiance.size(), [&](size_t light) {
    progress.checkpoint();
    std::vector<float>& values = traced.radiance[light].values;
    for (size_t i = 0; i < values.size(); ++i) values[i] *= whole[i / 3];
    image::roundTo(precision, values);
    for (size_t i = 0; i < kept.size(); ++i) {
      bool isValid = true;
      for (float* value = &values[3 * i]; value != &values[3 * i] + 3; ++value) {
        *value = kept[i] > 0 ? *value / kept[i] : 0;
        isValid = isValid && std::isfinite(*value);
      }
      if (isValid) continue;
      std::fill_n(&values[3 * i], 3, 0.f);
      ++invalid[light];
    }
  });
  for (const size_t count : invalid) view.invalidTexels += count;
  view.stack.lights = std::move(traced.radiance);
  return view;
}

bool isFinished(const StagePlan& plan, size_t view, const std::filesystem::path& folder) {
  try {
    std::filesystem::path last; // frames may share a file
    for (const capture::Frame& frame : framesOf(plan, view))
      for (const capture::Exposure& shot : capture::bracketOf(frame)) {
        if (shot.picture == last) continue;
        last = shot.picture;
        if (!std::filesystem::exists(folder / last)) return false;
        if (last.extension() == ".exr")
          const image::ExrFile header(folder / last);
        else
          image::readPngHeader(folder / last);
      }
    return true;
  } catch (const Error&) {
    return false;
  }
}

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

namespace fs = std::filesystem;

namespace {

class StageSource : public model::PackSource {
public:
  StageSource(const Stage& stage, const fs::path& scratch)
      : stage_(stage), plan_(planOf(stage, StageFrames::training)), scratch_(scratch), scene_(stage.objects),
        training_(capture::parseCapture(capture::captureText(plan_.capture, scratch),
                                        scratch / "transforms.json", capture::PathRule::unmade)) {}

  const capture::Capture& training() const override { return training_; }

  proxy::Impostor impostor(const proxy::ImpostorOptions& options, const Progress& progress) const override {
    if (!options.mesh.empty()) return proxy::impostorOf(training_, options, progress);
    return {withoutFlat(meshOf(stage_.objects), progress), proxy::Impostor::Origin::given};
  }

  std::string identity() const override {
    return fmt::format("stage {} {:016x}", kPictureFormat, stage_.hash);
  }

  model::ViewPictures pictures(std::span<const size_t> frames, bool isLastTime,
                               const Progress& progress) override {
    const capture::Frame& first = training_.frames[frames[0]];
    if (isScratchOurs() && isFinished(plan_, first.view, scratch_))
      return model::readViewPictures(training_, frames, progress);
    TracedView traced = trace(scene_, stage_, plan_, first.view, progress);
    if (!isLastTime) {
      claimScratch();
      write(traced, stage_, plan_, first.view, scratch_, progress);
    }
    return asRead(std::move(traced), progress);
  }

private:
  fs::path scratchIdentity() const { return scratch_ / "identity"; }
  bool isScratchOurs() const {
    return fs::exists(scratchIdentity()) && readFile(scratchIdentity(), 1 << 12) == identity();
  }
  // Removes scratch files of another stage.
  void claimScratch() const {
    if (isScratchOurs()) return;
    removeFolder(scratch_);
    createFolder(scratch_ / "images");
    writeFileAtomically(scratchIdentity(), identity());
  }

  const Stage& stage_;
  StagePlan plan_;
  fs::path scratch_;
  StageScene scene_;
  capture::Capture training_; // as if read from disk
};

} // namespace

model::PackReport packStage(const Stage& stage, const fs::path& folder, const model::PackOptions& options,
                            const Progress& progress,
                            const std::function<void(const model::PackEstimate&)>& announce) {
  if (stage.exposure)
    throw Error("brackets of photographs are captured, and packed then: not in one pass")
        .at("exposure")
        .in(stage.file);
  const fs::path scratch = folder / "traced";
  StageSource source(stage, scratch);
  const model::PackReport report = model::pack(source, folder, options, progress, announce);
  removeFolder(scratch);
  return report;
}

} // namespace surflect::stage
