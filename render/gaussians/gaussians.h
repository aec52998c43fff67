// Surfels at one instant as flat Gaussians with fixed light, as programs for 3D Gaussian splatting draw them.
//
// [Kerbl 2023] Kerbl, Kopanas, Leimkuehler, Drettakis: 3D Gaussian Splatting for Real-Time Radiance Field
//              Rendering, TOG 42(4).
//
// Such programs blend Gaussians from front to back, o exp(-x^T Sigma^-1 x / 2) being the alpha of one with
// the opacity o, while splats of surfels add up to 1. Gaussians are therefore nearly opaque, and a bit
// narrower.
#pragma once

#include "render/gaussians/spherical_harmonics.h"
#include "render/surfels/outgoing_radiance.h"
#include "surfel/base/time.h"
#include "surfel/cloud.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::gaussians {

// Standard deviation of a Gaussian over the radius of its surfel, its opacity, and its thickness over the
// shorter of its other two deviations.
inline constexpr double kDeviationPerRadius = 0.55, kOpacity = 0.99, kThickness = 0.05;

// An ellipsoid: Sigma = R diag(scale)^2 R^T, R of the quaternion.
struct Shape {
  Vec3<float> center = Vec3<float>::Zero(), normal = Vec3<float>::Zero(); // normal: outwards, unit
  std::array<float, 3> scale{};                                           // along the axes; thickness last
  std::array<float, 4> rotation{1, 0, 0, 0};                              // w, x, y, z; unit, w >= 0
};

// Ellipsoid of a warped surfel of a radius: its axes are the principal axes of the ellipse a u + b v, a^2 +
// b^2 = 1, whose half-axes are the singular values of (u v), the longer one first. The surfel must not be
// dead.
Shape shapeOf(const Point3<ObjectSpace>& p, const Direction3<ObjectSpace>& u,
              const Direction3<ObjectSpace>& v, Handedness handedness, float radius);

// Returns the ellipsoid of `shape` described so that it can be interpolated with `other`: its frame is turned
// about its normal by the multiple of 90 degrees, and its quaternion has the sign, nearest to those of
// `other`.
Shape nearestTo(const Shape& other, const Shape& shape);

// Look of a Gaussian.
struct Look {
  Coefficients color{}; // of the sRGB-encoded colour, in the direction from the viewer to the Gaussian
  float opacity = 0;    // 0..1
};

// Gaussians of the surfels that are not dead.
class Gaussians {
public:
  // `exposure`: factor on radiance; 1 then is white. The radiance must outlive this.
  Gaussians(const surfels::OutgoingRadiance& radiance, double exposure);

  size_t size() const { return alive_.size(); }
  // Entries of the drawn cloud, ascending.
  std::span<const uint32_t> alive() const { return alive_; }
  Shape shape(size_t i) const;
  // Looks of the Gaussians [begin, end): radiance towards well-spread directions in front of a surfel,
  // exposed, clamped to 0..1 and sRGB-encoded, and fitted by harmonics of a degree. The weight of a direction
  // is its cosine to the normal, times the surfel's alpha in it. Directions differ between surfels, so that
  // highlights that fall between them do not vanish from whole areas. Throws Error as shade, and Cancelled.
  std::vector<Look> looks(size_t begin, size_t end, int degree, const Progress& progress = {}) const;

private:
  const surfels::OutgoingRadiance& radiance_;
  double exposure_;
  std::vector<uint32_t> alive_;
};

// Gaussians whose looks are computed at a time, and the stage that their progress is reported as.
inline constexpr size_t kAtOnce = 1 << 16;
inline constexpr const char* kStage = "export";

} // namespace surflect::gaussians
