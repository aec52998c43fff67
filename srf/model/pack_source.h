// Where pack has its photographs from: a capture on disk, or whatever makes them as they are asked for.
#pragma once

#include "srf/capture/capture.h"
#include "srf/codec/view_encoder.h"
#include "srf/proxy/impostor.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <span>
#include <string>

namespace surflect::model {

struct ViewPictures {
  codec::ReflectanceStack stack; // alpha is 1 where there is no matte
  bool hasMatte = false;         // some picture has alpha, or a mask
  size_t invalidTexels = 0;      // were NaN or infinite, are black now
};

// Those of frames of a capture on disk, all of one view. Throws Error and Cancelled.
ViewPictures readViewPictures(const capture::Capture& capture, std::span<const size_t> frames,
                              const Progress& progress);

class PackSource {
public:
  virtual ~PackSource() = default;

  // Cameras, lights and training frames: no view without one, and no two of one view and light.
  virtual const capture::Capture& training() const = 0;
  virtual proxy::Impostor impostor(const proxy::ImpostorOptions& options, const Progress& progress) const = 0;
  // One line, another one where pictures may be others.
  virtual std::string identity() const = 0;
  // The pictures of some frames, all of one view, by their indices in training().frames and in that order:
  // the same whenever they are asked for. A view that is surveyed is asked for once more later, with
  // `isLastTime`. Throws Error and Cancelled; progress is of this view.
  virtual ViewPictures pictures(std::span<const size_t> frames, bool isLastTime,
                                const Progress& progress) = 0;
  // How long reading takes for each frame, by reading some; 0 where pictures are made, not read.
  virtual double secondsPerPicture(const Progress&) const { return 0; }
};

// Training frames of a capture on disk.
class CaptureSource : public PackSource {
public:
  explicit CaptureSource(const capture::Capture& capture);

  const capture::Capture& training() const override { return training_; }
  proxy::Impostor impostor(const proxy::ImpostorOptions& options, const Progress& progress) const override;
  std::string identity() const override; // pictures are known by size and time of change
  ViewPictures pictures(std::span<const size_t> frames, bool isLastTime, const Progress& progress) override;
  double secondsPerPicture(const Progress& progress) const override;

private:
  capture::Capture training_;
};

} // namespace surflect::model
