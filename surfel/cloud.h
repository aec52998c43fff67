// Surfel clouds, at rest and after a warp. Structures of arrays: all vectors have one entry per surfel.
#pragma once

#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace surflect {

// Tangent frames: storage of an orientation, and orthonormalisation of a warped tangent pair.
//
// [Weyrich 2005] Weyrich, Pfister, Gross: Rendering Deformable Surface Reflectance Fields, TVCG 11(1).
// Symbols: R0 rotation (u0, v0, n0) at acquisition; r0 its Rodrigues vector; u, v warped tangents;
//          u-bar, v-bar, n-bar the orthonormal frame nearest to them.

// r0 = k tan(theta/2)  [Weyrich 2005, Eq. 5], without its singularity at 180 degrees. In the lower hemisphere
// (n_z < 0) it describes the frame after a half turn H = diag(1,-1,-1) about x: R0 = H Rot(r). u0 is chosen
// by the shortest arc from z to n0, so the axis k lies in the xy plane, r_z is 0, |r0| <= 1, and the third
// number can hold the hemisphere.
struct Rodrigues {
  float x = 0, y = 0;
  float lower = 0; // 1 in the lower hemisphere, otherwise 0
};

// Tangent frame at a unit normal: rotation by the shortest arc, tan(theta/2) k = (z x n)/(1 + n_z).
template <class Space, class T> Rodrigues rodriguesOf(const Normal3<Space, T>& n) {
  const bool lower = n.z() < 0;
  const T ny = lower ? -n.y() : n.y(); // H n
  const T nz = lower ? -n.z() : n.z();
  return {static_cast<float>(-ny / (1 + nz)), static_cast<float>(n.x() / (1 + nz)), lower ? 1.f : 0.f};
}

// R0 = (u0, v0, n0), columns, by Cayley's formula  Rot(r) = I + 2 ([r]x + [r]x^2) / (1 + |r|^2).
template <class T> Mat3<T> rotationOf(const Rodrigues& r0) {
  const T x = r0.x, y = r0.y;
  const T c = 2 / (1 + x * x + y * y);
  Mat3<T> rotation;
  rotation << 1 - c * y * y, c * x * y, c * y, //
      c * x * y, 1 - c * x * x, -c * x,        //
      -c * y, c * x, 1 - c * (x * x + y * y);
  if (r0.lower != 0) {
    rotation.row(1) *= -1;
    rotation.row(2) *= -1;
  }
  return rotation;
}

template <class T> struct OrthonormalFrame {
  Vec3<T> u, v, n; // right-handed
};

// Polar factor of the 3x2 matrix (u v): the orthonormal pair nearest to the unnormalised tangents,
// independent of the choice of u0. With S = (u v)^T (u v) and delta = |u x v| = sqrt(det S),
//   S^(-1/2) = (adj(S) + delta I) / (tau delta),   tau = sqrt(tr S + 2 delta).
// This departs from [Weyrich 2005, Eqs. 8, 9], whose frame depends on u0 if the warp is anisotropic. Empty if
// the tangents are parallel, zero or not finite.
template <class T> std::optional<OrthonormalFrame<T>> polarFrame(const Vec3<T>& u, const Vec3<T>& v) {
  const T scale = std::max(u.cwiseAbs().maxCoeff(), v.cwiseAbs().maxCoeff());
  if (!(scale > 0) || !std::isfinite(scale)) return std::nullopt;
  const Vec3<T> us = u / scale, vs = v / scale;
  const T uu = us.squaredNorm(), uv = us.dot(vs), vv = vs.squaredNorm();
  const Vec3<T> normal = us.cross(vs);
  const T delta = normal.norm();
  if (!(delta > 8 * std::numeric_limits<T>::epsilon() * std::max(uu, vv))) return std::nullopt;
  const T tau = std::sqrt(uu + vv + 2 * delta);
  return OrthonormalFrame<T>{((vv + delta) * us - uv * vs) / (tau * delta),
                             ((uu + delta) * vs - uv * us) / (tau * delta), normal / delta};
}

// Frame of the paper: the bisector of the normalised tangents, rotated by 45 degrees either way  [Weyrich
// 2005, Eqs. 7 to 9]. The bisector comes from the unit difference, b = n x (u^ - v^), which is well
// conditioned for obtuse angles. For reference; polarFrame is the default.
template <class T> std::optional<OrthonormalFrame<T>> bisectorFrame(const Vec3<T>& u, const Vec3<T>& v) {
  const auto polar = polarFrame(u, v); // empty in the same cases
  if (!polar) return std::nullopt;
  const Vec3<T>& n = polar->n;                                             // Eq. 7
  const Vec3<T> b = n.cross(u.normalized() - v.normalized()).normalized(); // Eq. 8
  const T half = 1 / std::sqrt(T(2));
  return OrthonormalFrame<T>{half * (b + b.cross(n)), half * (b + n.cross(b)), n}; // Eq. 9
}

// Surfels at rest.  [Weyrich 2005, Table 1]
struct SurfelCloud {
  std::vector<Point3<AcquisitionSpace>> p0;
  std::vector<Rodrigues> r0; // tangent frame (u0, v0, n0)
  std::vector<float> radius; // splat radius, scene units; discs of this radius leave no hole
  std::vector<float>
      coverage; // peak of its Gaussian; the cloud's Gaussians add up to about 1, less at borders. 0: beside
                // the object, as corners of a pixel grid may be; such a surfel is no part of the object

  size_t size() const { return p0.size(); }
};

// Places of the surfels that are part of the object.
inline std::vector<Point3<AcquisitionSpace>> placesOnObject(const SurfelCloud& cloud) {
  std::vector<Point3<AcquisitionSpace>> places;
  for (size_t i = 0; i < cloud.size(); ++i)
    if (cloud.coverage[i] > 0) places.push_back(cloud.p0[i]);
  return places;
}

// Effect of a warp on a surfel: kept or mirrored, or dead if it has no frame.
enum class Handedness : int8_t { dead = 0, kept = 1, mirrored = -1 };

struct DeformedCloud {
  std::vector<Point3<ObjectSpace>> p;
  std::vector<Direction3<ObjectSpace>> u, v; // warped u0, v0: neither unit nor orthogonal
  std::vector<Handedness> handedness;        // dead surfels have no frame and are not drawn

  size_t size() const { return p.size(); }
};

// The look-up function L: takes directions at a deformed surfel back to acquisition space, where its
// reflectance was captured.  [Weyrich 2005, §4]
template <class T = float> class LookUp {
public:
  // L = R0 (u-bar, v-bar, s n-bar)^T  [Weyrich 2005, Eq. 10]. s is -1 under a mirroring warp, which the paper
  // does not treat: u x v then points inwards, s n-bar outwards, and L is a reflection (det -1).
  LookUp(const Mat3<T>& r0, const OrthonormalFrame<T>& frame, T s) : outward_(s * frame.n) {
    Mat3<T> warped;
    warped << frame.u, frame.v, outward_;
    matrix_ = r0 * warped.transpose();
  }

  Direction3<AcquisitionSpace, T> operator()(const Direction3<ObjectSpace, T>& d) const {
    return assume<Direction3<AcquisitionSpace, T>>(matrix_ * d.raw());
  }

  const Mat3<T>& matrix() const { return matrix_; }
  Normal3<ObjectSpace, T> outwardNormal() const { return assume<Normal3<ObjectSpace, T>>(outward_); }

private:
  Mat3<T> matrix_;
  Vec3<T> outward_;
};

} // namespace surflect
