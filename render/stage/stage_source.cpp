#include "render/stage/stage_source.h"

#include "render/stage/stage_pictures.h"
#include "srf/capture/writer.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

namespace surflect::stage {

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
