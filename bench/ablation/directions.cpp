#include "bench/ablation/directions.h"

namespace surflect::bench {

namespace {

// L = R0 (u-bar, v-bar, s n-bar)^T  [Weyrich 2005, Eq. 10], s = -1 where the warp mirrors.
std::optional<Mat3<double>> lookUp(const WarpedFrame& frame,
                                   const std::optional<OrthonormalFrame<double>>& bar) {
  if (!bar) return std::nullopt;
  const double s = frame.warped.determinant() < 0 ? -1 : 1;
  return LookUp<double>(frame.rest, *bar, s).matrix();
}

} // namespace

std::optional<OrthonormalFrame<double>> gramSchmidtFrame(const Vec3<double>& u, const Vec3<double>& v) {
  const auto polar = polarFrame<double>(u, v); // for the common refusal
  if (!polar) return std::nullopt;
  const Vec3<double> uBar = u.normalized();
  return OrthonormalFrame<double>{uBar, polar->n.cross(uBar), polar->n};
}

std::optional<Mat3<double>> byPolarFactor(const WarpedFrame& frame) {
  return lookUp(frame, polarFrame<double>(frame.warped.col(0), frame.warped.col(1)));
}

std::optional<Mat3<double>> byBisector(const WarpedFrame& frame) {
  return lookUp(frame, bisectorFrame<double>(frame.warped.col(0), frame.warped.col(1)));
}

std::optional<Mat3<double>> byGramSchmidt(const WarpedFrame& frame) {
  return lookUp(frame, gramSchmidtFrame(frame.warped.col(0), frame.warped.col(1)));
}

std::optional<Mat3<double>> byInverseJacobian(const WarpedFrame& frame) {
  if (!polarFrame<double>(frame.warped.col(0), frame.warped.col(1)) || frame.warped.determinant() == 0)
    return std::nullopt;
  return frame.rest * frame.warped.inverse();
}

} // namespace surflect::bench
