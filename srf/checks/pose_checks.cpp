#include "srf/checks/checks.h"

#include "srf/checks/names.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <optional>

namespace surflect {

namespace {

constexpr double kAxisSpread = 1e-3; // mean squared sine of the angles between axes: two degrees
constexpr double kOtherScale = 30;

// Where a camera stands, and where it looks; unit.
struct Axis {
  Vec3<double> center, forward;
};

Axis axisOf(const Camera<AcquisitionSpace>& camera) {
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  return {camera.center().raw(), -worldFromCamera.rotation().col(2)};
}

// The point nearest to all axes, by least squares; none where they look along one line.
std::optional<Vec3<double>> meetingPoint(const std::vector<Axis>& axes) {
  Mat3<double> sum = Mat3<double>::Zero();
  Vec3<double> weighted = Vec3<double>::Zero();
  for (const Axis& axis : axes) {
    const Mat3<double> aside = Mat3<double>::Identity() - axis.forward * axis.forward.transpose();
    sum += aside;
    weighted += aside * axis.center;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3<double>> solver(sum);
  if (!(solver.eigenvalues()[0] > kAxisSpread * static_cast<double>(axes.size()))) return std::nullopt;
  return solver.eigenvectors() *
         solver.eigenvalues().cwiseInverse().cwiseProduct(solver.eigenvectors().transpose() * weighted);
}

} // namespace

std::vector<Finding> checkPoses(const Capture& capture) {
  std::vector<Axis> axes;
  for (const View& view : capture.views) axes.push_back(axisOf(view.camera));
  const auto middle = axes.size() < 3 ? std::nullopt : meetingPoint(axes);
  if (!middle) return {};

  const auto ahead = [&](const Axis& axis) { return (*middle - axis.center).dot(axis.forward); };
  const auto away =
      static_cast<size_t>(std::ranges::count_if(axes, [&](const Axis& a) { return ahead(a) < 0; }));
  if (2 * away > axes.size())
    return {
        {Finding::Severity::error,
         fmt::format("{} of {} cameras look away from where their axes meet; expected are camera-to-world "
                     "matrices with OpenGL's axes: x right, y up, looking along -z",
                     away, axes.size())}};

  std::vector<double> distances;
  for (const Axis& axis : axes) distances.push_back((*middle - axis.center).norm());
  std::vector<double> sorted = distances;
  std::ranges::sort(sorted);
  const double median = sorted[sorted.size() / 2];
  std::vector<Offender> apart;
  for (size_t v = 0; v < axes.size(); ++v) {
    const bool isPinhole = capture.views[v].camera.lens.model == Lens::Model::pinhole;
    if (isPinhole && distances[v] > kOtherScale * median)
      apart.push_back(
          {distances[v], fmt::format("{} ({:.3g} times)", capture.views[v].identity, distances[v] / median)});
  }
  if (apart.empty()) return {};
  return {{Finding::Severity::warning, fmt::format("{} of {} cameras are much farther away than most: {}",
                                                   apart.size(), axes.size(), worst(apart))}};
}

} // namespace surflect
