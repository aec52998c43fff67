// Photographs that renderings should equal, each with the scene that it shows, under the exposure of the
// protocol (measure.h).
#pragma once

#include "render/scene/scene.h"
#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <memory>
#include <span>
#include <vector>

namespace surflect::evaluation {

// Frames of the split; keeps the views and lights that they use.
capture::Capture ofSplit(const capture::Capture& capture, capture::Split split);

// Indices of the frames of each view.
std::vector<std::vector<size_t>> framesByView(const capture::Capture& capture);

// Frames whose object pixels are known: all frames, unless the capture has no geometry but masks for some of
// its frames; then the frames with a mask.
capture::Capture withKnownObject(const capture::Capture& capture);

class TrueFrames {
public:
  // Frames of a capture's split with a known object, which show the object after `warp`; it acts in the
  // coordinates of the rig, whose origin may differ from the capture's. Reads all test frames to find the
  // exposure. Rig and warp must outlive the object. Throws Error if the split is empty or a picture cannot be
  // read, and Cancelled.
  TrueFrames(const capture::Capture& asRead, const capture::Capture& rig, const warp::Warp& warp,
             capture::Split split, const Progress& progress);
  ~TrueFrames();
  TrueFrames(const TrueFrames&) = delete;
  TrueFrames& operator=(const TrueFrames&) = delete;

  // The split's frames, in coordinates of the rig.
  const capture::Capture& capture() const { return capture_; }
  // Maps the 99.5th percentile of the true object pixels of all test frames to 1, for any split; of the
  // split's frames if there are no test frames.
  double exposure() const { return exposure_; }
  // Scene that a frame shows: its camera, its light and the warp.
  scene::Scene sceneOf(size_t frame) const;
  // Frames of one view over black: linear RGBA, premultiplied. Without a matte, alpha is the silhouette of
  // the capture's mesh after the warp, repaired by the views of the rig as pack did, or 1 in a capture of one
  // view without a mesh. Texels of a photograph that are not finite are NaN in red, green and blue. Throws
  // Error and Cancelled.
  std::vector<image::Image> read(std::span<const size_t> frames, const Progress& progress);

private:
  class TruthReader;

  const warp::Warp& warp_;
  capture::Capture capture_;
  double exposure_ = 1;
  std::unique_ptr<TruthReader> truths_;
};

} // namespace surflect::evaluation
