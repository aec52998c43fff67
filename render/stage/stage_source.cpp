#include "render/stage/stage_source.h"

#include "render/stage/stage_pictures.h"
#include "srf/capture/writer.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

namespace surflect {

namespace fs = std::filesystem;

namespace {

class StageSource : public PackSource {
public:
  StageSource(const Stage& stage, const fs::path& scratch)
      : stage_(stage), plan_(planOf(stage, StageFrames::training)), scratch_(scratch), scene_(stage.objects),
        training_(parseCapture(captureText(plan_.capture, scratch), scratch / "transforms.json",
                               PathRule::unmade)) {}

  const Capture& training() const override { return training_; }

  Impostor impostor(const ImpostorOptions& options, const Progress& progress) const override {
    if (!options.mesh.empty()) return impostorOf(training_, options, progress);
    return {withoutFlat(meshOf(stage_.objects), progress), Impostor::Origin::given};
  }

  std::string identity() const override {
    return fmt::format("stage {} {:016x}", kPictureFormat, stage_.hash);
  }

  ViewPictures pictures(std::span<const size_t> frames, bool isLastTime, const Progress& progress) override {
    const Frame& first = training_.frames[frames[0]];
    if (isScratchOurs() && isFinished(plan_, first.view, scratch_))
      return readViewPictures(training_, frames, progress);
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
  // What another stage left there goes.
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
  Capture training_; // as one on disk is read
};

} // namespace

PackReport packStage(const Stage& stage, const fs::path& folder, const PackOptions& options,
                     const Progress& progress, const std::function<void(const PackEstimate&)>& announce) {
  if (stage.exposure)
    throw Error("brackets of photographs are captured, and packed then: not in one pass")
        .at("exposure")
        .in(stage.file);
  const fs::path scratch = folder / "traced";
  StageSource source(stage, scratch);
  const PackReport report = pack(source, folder, options, progress, announce);
  removeFolder(scratch);
  return report;
}

} // namespace surflect
