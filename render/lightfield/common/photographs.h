// Photographs of the training views in memory, asked for the radiance of surface points.
#pragma once

#include "render/lightfield/common/views.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace surflect::lightfield {

// Distance of pixels to edges of a picture of the mesh: outlines and depth discontinuities.
//
// Symbols: a, b neighbouring pixels; t_a distance along the ray of a to the surface; h distance of the two
// rays there; s_a slope of the surface at a, the change of t from a to b in its tangent plane, per h.

// Ray of a pixel, and where it meets the surface.
struct PixelHit {
  Point3<AcquisitionSpace, double> origin;
  Direction3<AcquisitionSpace, double> direction;             // unit
  double distance = std::numeric_limits<double>::quiet_NaN(); // NaN: the pixel shows background
  Vec3<double> normal = Vec3<double>::Zero();                 // of the surface; unit

  bool isSurface() const { return distance == distance; }
};

// Whether two neighbouring pixels show one continuous surface: (t_b - t_a) / h is s_a or s_b, up to a
// tolerance for curvature, or lies between the two, as across a crease. Slopes beyond 72 degrees do not widen
// this range: else every outline would pass for a crease.
bool isContinuous(const PixelHit& a, const PixelHit& b);

inline constexpr int kFarFromEdges = 3; // pixels
inline constexpr int kCodesPerPixel = 85;

// Distance of each pixel to the nearest pixel across an edge, in pixels times kCodesPerPixel; at most
// kFarFromEdges pixels. A pixel is at an edge if one of its eight neighbours shows background or is not
// continuous with it: its distance is 1 pixel. The distance of any other pixel is 1 more than that to the
// nearest pixel at an edge. Background has 0. Hits are those of a picture with rows of `width` pixels; beyond
// it there are no edges.
std::vector<uint8_t> edgeDistances(std::span<const PixelHit> hits, int width);

// Bytes of the training views' Photographs, if the object fills all pictures.
double photographMemory(const Views& views);

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
    float fade;           // 0..1: smooth step of the EdgeDistance
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
