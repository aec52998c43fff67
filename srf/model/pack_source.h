// Source of the photographs that pack encodes: a capture on disk, or one rendered on demand.
#pragma once

#include "srf/capture/capture.h"
#include "srf/capture/photograph.h"
#include "srf/codec/view_encoder.h"
#include "srf/proxy/impostor.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <span>
#include <string>

namespace surflect::model {

struct ViewPictures {
  codec::ReflectanceStack stack; // alpha is 1 without a matte
  bool hasMatte = false;         // at least one picture has alpha or a mask
  size_t invalidTexels = 0;      // NaN or infinite texels, replaced by black
};

// Reads the pictures of `frames` (indices into capture.frames), all of one view. Throws Error and Cancelled.
ViewPictures readViewPictures(const capture::Capture& capture, std::span<const size_t> frames,
                              const Progress& progress);

// Part of the pictures of the only view; its alpha is 1 without a matte.
ViewPictures readPicturePart(const capture::Capture& capture, std::span<const size_t> frames,
                             const capture::ViewPart& part, const Progress& progress);

class PackSource {
public:
  virtual ~PackSource() = default;

  // Cameras, lights and training frames. Every view has a frame, and no two frames share both view and light.
  virtual const capture::Capture& training() const = 0;
  virtual proxy::Impostor impostor(const proxy::ImpostorOptions& options, const Progress& progress) const = 0;
  // Single-line identity that changes whenever the pictures may change.
  virtual std::string identity() const = 0;
  // Pictures of frames (indices into training().frames) of one view, in the given order; always the same for
  // the same frames. Surveyed views are requested twice, the second time with `isLastTime`. `progress` covers
  // this view. Throws Error and Cancelled.
  virtual ViewPictures pictures(std::span<const size_t> frames, bool isLastTime,
                                const Progress& progress) = 0;
  // Whether training() names files, so that parts of the pictures can be read (readViewPart).
  virtual bool isOnDisk() const { return false; }
  // Measured time of reading one frame; 0 if pictures are not read from disk.
  virtual double secondsPerPicture(const Progress&) const { return 0; }
};

// Training frames of a capture on disk.
class CaptureSource : public PackSource {
public:
  explicit CaptureSource(const capture::Capture& capture);

  const capture::Capture& training() const override { return training_; }
  proxy::Impostor impostor(const proxy::ImpostorOptions& options, const Progress& progress) const override;
  std::string identity() const override; // includes size and modification time of the pictures
  ViewPictures pictures(std::span<const size_t> frames, bool isLastTime, const Progress& progress) override;
  bool isOnDisk() const override { return true; }
  double secondsPerPicture(const Progress& progress) const override;

private:
  capture::Capture training_;
};

} // namespace surflect::model
