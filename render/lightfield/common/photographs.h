// Photographs of the training views in memory, asked for the radiance of surface points.
#pragma once

#include "render/lightfield/common/views.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace surflect::lightfield {

class Photographs {
public:
  // Reads all training views. Memory: 12 bytes per pixel of the object's rectangle in each photograph. Throws
  // Error naming a picture that cannot be read, and Cancelled.
  explicit Photographs(const Views& views, const Progress& progress = {});

  size_t size() const { return pictures_.size(); }
  const capture::Camera<AcquisitionSpace>& camera(size_t photograph) const {
    return pictures_[photograph].camera;
  }

  struct Sample {
    Vec3<float> radiance; // linear
    float fade;           // 0..1: smooth step of the distance from edges (edge_distance.h)
  };
  // Sample at the pixel position of a surface point, bilinear between pixel centres. Empty where one of the
  // four pixels is outside the picture, shows background (its alpha is below kOpaque), is not a finite
  // number, or does not show the mesh at the point's distance to the viewer, up to `tolerance`. Fades fall
  // near edges, to about a quarter at the last valid pixel.
  std::optional<Sample> at(size_t photograph, capture::Pixel position, double distance,
                           double tolerance) const;

  static constexpr float kOpaque = 0.95f;

  // Radiance that 99.5 % of the pixels that show the mesh do not exceed, in any channel; 1 if all are black.
  double whiteLevel() const;

private:
  using HalfPixel = std::array<uint16_t, 4>; // r, g, b in half floats; code of edgeDistances()

  struct Picture {
    capture::Camera<AcquisitionSpace> camera;
    int left = 0, top = 0, width = 0, height = 0; // rectangle of the opaque pixels, and a pixel around it
    std::vector<HalfPixel> pixels;                // of the rectangle
    std::vector<float> distances; // of the mesh in each pixel; NaN: not opaque, no number, or no mesh
  };
  static Picture pictureOf(const image::Image& premultiplied, capture::Camera<AcquisitionSpace> camera,
                           const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays);

  std::vector<Picture> pictures_;
};

} // namespace surflect::lightfield
