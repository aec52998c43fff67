#include "srf/validation/validation.h"

#include "srf/capture/origin.h"
#include "srf/validation/small_view.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"
#include "surfel/math/bounds.h"
#include "surfel/math/median.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace surflect::validation {

namespace {

using WorldPoint = Point3<AcquisitionSpace, double>;
using Severity = Finding::Severity;

constexpr size_t kVertices = 5000; // evenly chosen vertices that represent the mesh
constexpr double kSpeck = 0.01;    // of the picture's larger side
constexpr double kFarLight = 1000; // times the mesh's size
constexpr size_t kCompared = 48;   // maximum number of views compared in brightness, all in memory

std::vector<WorldPoint> someVertices(const TriangleMesh& mesh) {
  std::vector<WorldPoint> vertices;
  for (const size_t i : evenlySpaced(mesh.positions.size(), kVertices))
    vertices.push_back(mesh.positions[i].cast<double>());
  return vertices;
}

double degreesAside(const capture::Camera<AcquisitionSpace>& camera, const WorldPoint& point) {
  const Vec3<double> seen = camera.cameraFromWorld(point).raw();
  return std::acos(std::clamp(-seen[2] / seen.norm(), -1., 1.)) * 180 / std::numbers::pi;
}

// Larger side of the vertices' bounding box in the picture, over the picture's; empty if no vertex is in
// front of the camera.
std::optional<double> shareOfPicture(const capture::Camera<AcquisitionSpace>& camera,
                                     const std::vector<WorldPoint>& vertices) {
  Eigen::AlignedBox2d box;
  for (const WorldPoint& vertex : vertices)
    if (const auto pixel = camera.project(vertex)) box.extend(Eigen::Vector2d(pixel->x, pixel->y));
  if (box.isEmpty()) return std::nullopt;
  return box.sizes().maxCoeff() / std::max(camera.lens.width, camera.lens.height);
}

} // namespace

std::vector<Finding> checkCameras(const capture::Capture& capture, const TriangleMesh& mesh) {
  const std::vector<WorldPoint> vertices = someVertices(mesh);
  const WorldPoint center = middleOf(mesh.positions);
  std::vector<Offender> blind;
  for (const capture::View& view : capture.views) {
    const auto seen = [&](const WorldPoint& vertex) {
      const auto pixel = view.camera.project(vertex);
      return pixel && capture::contains(view.camera.lens, *pixel);
    };
    if (std::ranges::any_of(vertices, seen)) continue;
    const double aside = degreesAside(view.camera, center);
    blind.push_back({aside, fmt::format("{} ({:.0f} degrees)", view.identity, aside)});
  }
  if (blind.empty()) return {};
  const bool most = 2 * blind.size() > capture.views.size();
  return {
      {most ? Severity::error : Severity::warning,
       fmt::format("{} of {} cameras have none of the mesh in their picture; aside from where they look it "
                   "is for {}",
                   blind.size(), capture.views.size(), worst(blind))}};
}

std::vector<Finding> checkUnits(const capture::Capture& capture, const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = boundsOf(mesh.positions);
  const auto center = assume<WorldPoint>(box.center());
  const double size = box.diagonal().norm();
  std::vector<Finding> findings;

  const std::vector<WorldPoint> vertices = someVertices(mesh);
  std::vector<Offender> inside;
  std::vector<double> distances, shares;
  for (const capture::View& view : capture.views) {
    if (const auto share = shareOfPicture(view.camera, vertices)) shares.push_back(*share);
    if (view.camera.lens.model == capture::Lens::Model::orthographic)
      continue; // an orthographic camera has no position
    const double distance = length(view.camera.center() - center);
    distances.push_back(distance);
    if (box.contains(view.camera.center().raw())) inside.push_back({-distance, view.identity});
  }
  if (!inside.empty()) {
    const bool most = 2 * inside.size() > distances.size();
    findings.push_back(
        {most ? Severity::error : Severity::warning,
         fmt::format(
             "{} of {} cameras stand within the box of the mesh, which is {:.3g} across: {}; is the mesh "
             "in other units?",
             inside.size(), distances.size(), size, worst(inside))});
  } else if (!shares.empty() && median(shares) < kSpeck) {
    findings.push_back(
        {Severity::error,
         fmt::format("the mesh, {:.3g} across, is {:.2g} % of a picture's side: is it in other "
                     "units?",
                     size, 100 * median(shares))});
  } else if (!shares.empty() && median(shares) > 1 / kSpeck) {
    findings.push_back(
        {Severity::error,
         fmt::format("the mesh, {:.3g} across, is {:.3g} times as large as a picture: is it in "
                     "other units?",
                     size, median(shares))});
  }

  std::vector<Offender> within, far;
  size_t points = 0;
  for (const capture::Light& light : capture.lights) {
    const auto* point = std::get_if<capture::PointLight>(&light.kind);
    if (!point) continue;
    ++points;
    const double distance = length(point->position - center);
    if (box.contains(point->position.raw()))
      within.push_back({-distance, light.name});
    else if (distance > kFarLight * size)
      far.push_back({distance, fmt::format("{} ({:.2g} times)", light.name, distance / size)});
  }
  const auto severity = [&](size_t count) {
    return 2 * count > points ? Severity::error : Severity::warning;
  };
  if (!within.empty())
    findings.push_back(
        {severity(within.size()), fmt::format("{} of {} point lights stand within the box of the mesh: {}",
                                              within.size(), points, worst(within))});
  if (!far.empty())
    findings.push_back(
        {severity(far.size()),
         fmt::format("{} of {} point lights are more than {:.0f} times as far away as the mesh is "
                     "large: {}; are their positions in other units?",
                     far.size(), points, kFarLight, worst(far))});
  return findings;
}

std::vector<Finding> checkCapture(const capture::Capture& capture, const TriangleMesh& mesh,
                                  const CheckEffort& effort, const Progress& progress) {
  std::vector<Finding> findings = checkCameras(capture, mesh);
  const auto append = [&](const std::vector<Finding>& more) {
    findings.insert(findings.end(), more.begin(), more.end());
  };
  append(checkUnits(capture, mesh));
  const WorldPoint middle = middleOf(mesh.positions);
  if (!capture::middleOfScene(capture))
    if (auto imprecise = checkPrecision(capture, middle)) findings.push_back(std::move(*imprecise));
  if (std::ranges::any_of(findings, [](const Finding& f) { return f.severity == Severity::error; }))
    return findings;
  const RayCaster<AcquisitionSpace> caster(mesh, progress);
  const bool hasFixedLight = capture.lights.empty();
  std::vector<ViewMeasures> measures;
  std::vector<SmallView> kept;
  size_t nextKept = 0;
  const size_t count = std::min(effort.views, capture.views.size());
  const std::vector<size_t> compared = evenlySpaced(count, kCompared);
  forEachSmallView(capture, caster, middle, effort.views, progress, [&](SmallView view) {
    const size_t number = measures.size();
    measures.push_back(measure(capture, view));
    if (nextKept == compared.size() || number != compared[nextKept]) return;
    ++nextKept;
    if (hasFixedLight && !view.matte) kept.push_back(std::move(view));
  });
  if (effort.masks) append(checkMasks(capture, measures));
  const auto contrast = outlineContrast(measures);
  if (hasFixedLight && contrast) append(checkPlacement(*contrast, kept, mesh, caster, progress));
  append(checkThinness(measures));
  append(checkExposures(capture, measures));
  const std::vector<Finding> ofOneView = checkLightsOfOneView(capture, middle, effort, progress);
  append(ofOneView);
  if (ofOneView.empty()) append(checkLights(capture, mesh, caster, effort, contrast, progress));
  return findings;
}

void requireNoError(std::span<const Finding> findings) {
  for (const Finding& finding : findings)
    if (finding.severity == Severity::error) throw Error(finding.text);
}

void checkBeforeGeometry(const capture::Capture& training, const CheckEffort& effort,
                         const TakeFindings& take, const Progress& progress) {
  take(checkPoses(training));
  take(checkMattes(training, effort, progress));
}

void checkGeometry(const capture::Capture& training, const proxy::Impostor& impostor, CheckEffort effort,
                   const TakeFindings& take, const Progress& progress) {
  using Origin = proxy::Impostor::Origin;
  effort.masks = impostor.origin == Origin::given; // a hull was carved from the masks
  if (impostor.origin == Origin::given || impostor.origin == Origin::hull)
    take(checkCapture(training, impostor.mesh, effort, progress));
  else
    take(checkLightsOfOneView(training, middleOf(impostor.mesh.positions), effort, progress));
}

} // namespace surflect::validation
