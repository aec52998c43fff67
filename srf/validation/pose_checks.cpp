#include "srf/validation/validation.h"

#include "srf/capture/origin.h"
#include "srf/capture/rig.h"
#include "srf/validation/small_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace surflect::validation {

namespace {

constexpr double kOtherScale = 30;

// Position of a camera and its unit viewing direction.
struct Axis {
  Vec3<double> center, forward;
};

Axis axisOf(const capture::Camera<AcquisitionSpace>& camera) {
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  return {camera.center().raw(), -worldFromCamera.rotation().col(2)};
}

// Rounding in pixels above which a warning, and an error, is reported.
constexpr double kTold = 0.1, kWrong = 1;

// Returns whether all cameras are at one place, as when poses lack positions. Distant cameras have no
// position.
bool standAtOnePlace(const capture::Capture& capture) {
  return capture.views.size() > 1 && !capture::middleOfScene(capture) &&
         std::ranges::all_of(capture.views, [](const capture::View& view) {
           return view.camera.lens.model == capture::Lens::Model::pinhole;
         });
}

std::vector<Finding> checkAxes(const capture::Capture& capture) {
  const auto meeting = capture::whereAxesMeet(capture);
  if (!meeting) return {};

  const Vec3<double> middle = meeting->raw();
  std::vector<Axis> axes;
  for (const capture::View& view : capture.views) axes.push_back(axisOf(view.camera));
  const auto ahead = [&](const Axis& axis) { return (middle - axis.center).dot(axis.forward); };
  const auto away =
      static_cast<size_t>(std::ranges::count_if(axes, [&](const Axis& a) { return ahead(a) < 0; }));
  if (2 * away > axes.size())
    return {
        {Finding::Severity::error,
         fmt::format("{} of {} cameras look away from where their axes meet; expected are camera-to-world "
                     "matrices with OpenGL's axes: x right, y up, looking along -z",
                     away, axes.size())}};

  std::vector<double> distances;
  for (const Axis& axis : axes) distances.push_back((middle - axis.center).norm());
  std::vector<double> sorted = distances;
  std::ranges::sort(sorted);
  const double median = sorted[sorted.size() / 2];
  std::vector<Offender> apart;
  for (size_t v = 0; v < axes.size(); ++v) {
    const bool isPinhole = capture.views[v].camera.lens.model == capture::Lens::Model::pinhole;
    if (isPinhole && distances[v] > kOtherScale * median)
      apart.push_back(
          {distances[v], fmt::format("{} ({:.3g} times)", capture.views[v].identity, distances[v] / median)});
  }
  if (apart.empty()) return {};
  return {{Finding::Severity::warning, fmt::format("{} of {} cameras are much farther away than most: {}",
                                                   apart.size(), axes.size(), worst(apart))}};
}

// Lights that all stand in one direction, within a degree, seen from the middle of the scene.
std::optional<Finding> checkLightSpread(const capture::Capture& capture) {
  const auto known = capture::middleOfScene(capture);
  const auto isPoint = [](const capture::Light& light) {
    return std::holds_alternative<capture::PointLight>(light.kind);
  };
  if (capture.lights.size() < 2 || (!known && std::ranges::any_of(capture.lights, isPoint)))
    return std::nullopt;
  const auto middle = known.value_or(Point3<AcquisitionSpace, double>(0, 0, 0));
  const double oneDegree = std::cos(std::numbers::pi / 180);
  const auto first = capture::towardsLight(capture.lights.front(), middle);
  if (std::ranges::any_of(capture.lights, [&](const capture::Light& light) {
        return !(dot(capture::towardsLight(light, middle), first) >= oneDegree);
      }))
    return std::nullopt;
  return Finding{
      Finding::Severity::warning,
      fmt::format("all {} lights stand in one direction, within a degree: no photograph tells how the "
                  "object looks under other light",
                  capture.lights.size())};
}

} // namespace

std::optional<Finding> checkPrecision(const capture::Capture& capture,
                                      const Point3<AcquisitionSpace, double>& middle) {
  const double pixels = capture::roundingInPixels(capture, middle);
  if (!(pixels > kTold)) return std::nullopt;
  return Finding{
      pixels > kWrong ? Finding::Severity::error : Finding::Severity::warning,
      fmt::format("the scene lies at ({:.8g}, {:.8g}, {:.8g}), where single precision is off by up "
                  "to {:.2g} pixels; surflect import shifts the origin",
                  middle.x(), middle.y(), middle.z(), pixels)};
}

std::vector<Finding> checkPoses(const capture::Capture& capture) {
  if (standAtOnePlace(capture))
    return {{Finding::Severity::warning,
             fmt::format("all {} cameras stand at one place: are their positions missing?",
                         capture.views.size())}};
  std::vector<Finding> findings = checkAxes(capture);
  if (auto alike = checkLightSpread(capture)) findings.push_back(std::move(*alike));
  if (const auto middle = capture::middleOfScene(capture))
    if (auto imprecise = checkPrecision(capture, *middle)) findings.push_back(std::move(*imprecise));
  return findings;
}

} // namespace surflect::validation
