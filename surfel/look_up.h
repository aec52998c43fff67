// The look-up function L: takes directions at a deformed surfel back to acquisition space, where its
// reflectance was captured.  [Weyrich 2005, §4]
#pragma once

#include "surfel/tangent_frame.h"

namespace surflect {

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
