// Photographs of a capture beside a model's pictures: by camera and light, with the scores of `evaluate`.
#pragma once

#include "render/evaluation/contact_sheet.h"
#include "render/evaluation/true_frames.h"
#include "render/method/renderer.h"
#include "srf/capture/photograph.h"
#include "warp/warp.h"

#include <array>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace surflect::viewer {

// Safe from many threads.
class Photographs {
public:
  // rig: of the model that they are compared with, or null for a capture alone.
  Photographs(capture::Capture capture, const capture::Capture* rig);

  const capture::Capture& capture() const { return capture_; }

  // Index of the frame of a camera and a light (empty: fixed illumination); of several, a held-out one.
  // Throws Error naming the camera or the light that has none.
  size_t find(const std::string& camera, const std::string& light) const;

  // A photograph: RGBA radiance, premultiplied. Its matte is its own. The last ones are kept.
  std::shared_ptr<const image::Image> read(size_t frame, const Progress& progress);
  // Radiance of white: the 99.5th percentile of the object's pixels of the frame.
  double whiteOf(size_t frame, const Progress& progress);

  // A photograph as `evaluate` sees it, the scene that it shows, and the exposure of the protocol.
  struct Truth {
    image::Image picture; // RGBA, premultiplied, over black
    capture::Camera<ObjectSpace> camera;
    std::vector<scene::ShotLight> lights;
    double exposure;
  };
  // Reads all test frames once, to find the exposure. Throws Error as TrueFrames does, and Cancelled.
  Truth truth(size_t frame, const Progress& progress);

  // evaluation::outlinedPhotograph with the capture's mesh. Throws Error if it has none.
  image::Image outlined(size_t frame, image::PictureSize size, double exposure, const Progress& progress);

private:
  const capture::Capture capture_;
  const capture::Capture* const rig_;
  const warp::WarpPointer atRest_;
  std::mutex mutex_;
  std::list<std::pair<size_t, std::shared_ptr<const image::Image>>> kept_; // latest first
  std::array<std::unique_ptr<evaluation::TrueFrames>, 2> truths_;          // by split
  std::unique_ptr<evaluation::WhiteSurface> surface_;                      // of the mesh
};

} // namespace surflect::viewer
