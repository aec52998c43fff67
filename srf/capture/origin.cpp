#include "srf/capture/origin.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>

namespace surflect::capture {

namespace {

using Point = Point3<AcquisitionSpace, double>;

constexpr double kAxisSpread = 1e-3;  // mean squared sine of the angles between axes: two degrees
constexpr double kMostRounding = 0.1; // pixels
constexpr double kOnePlace = 1e-9;    // relative rounding error of camera coordinates

Vec3<double> middleOfCameras(const Capture& capture) {
  Vec3<double> sum = Vec3<double>::Zero();
  for (const View& view : capture.views) sum += view.camera.center().raw();
  return sum / static_cast<double>(capture.views.size());
}

// Largest distance of a camera from a point.
double farthest(const Capture& capture, const Vec3<double>& point) {
  double most = 0;
  for (const View& view : capture.views) most = std::max(most, (view.camera.center().raw() - point).norm());
  return most;
}

} // namespace

std::optional<Point> whereAxesMeet(const Capture& capture) {
  if (capture.views.size() < 3) return std::nullopt;
  const Vec3<double> middle = middleOfCameras(capture); // subtracted first, to avoid cancellation
  Mat3<double> sum = Mat3<double>::Zero();
  Vec3<double> weighted = Vec3<double>::Zero();
  for (const View& view : capture.views) {
    const Vec3<double> axis = view.camera.cameraFromWorld.rotation().row(2);
    const Mat3<double> aside = Mat3<double>::Identity() - axis * axis.transpose();
    sum += aside;
    weighted += aside * (view.camera.center().raw() - middle);
  }
  const Eigen::SelfAdjointEigenSolver<Mat3<double>> solver(sum);
  if (!(solver.eigenvalues()[0] > kAxisSpread * static_cast<double>(capture.views.size())))
    return std::nullopt;
  const Vec3<double> offset = solver.eigenvectors() * solver.eigenvalues().cwiseInverse().cwiseProduct(
                                                          solver.eigenvectors().transpose() * weighted);
  return assume<Point>(middle + offset);
}

double pixelFootprint(const Capture& capture, const Point& point) {
  std::vector<double> footprints;
  for (const View& view : capture.views) {
    const Lens& lens = view.camera.lens;
    const double distance =
        lens.model == Lens::Model::orthographic ? 1 : length(view.camera.center() - point);
    footprints.push_back(distance / std::sqrt(lens.focalX * lens.focalY));
  }
  const auto quartile = footprints.begin() + static_cast<std::ptrdiff_t>((footprints.size() - 1) / 4);
  std::ranges::nth_element(footprints, quartile);
  return *quartile;
}

double roundingInPixels(const Capture& capture, const Point& point) {
  const auto largest = static_cast<float>(point.raw().cwiseAbs().maxCoeff());
  const double spacing = std::nextafter(largest, std::numeric_limits<float>::infinity()) - largest;
  return spacing / 2 / pixelFootprint(capture, point);
}

std::optional<Point> middleOfScene(const Capture& capture) {
  const Vec3<double> cameras = middleOfCameras(capture);
  if (capture.views.size() < 2 || farthest(capture, cameras) <= kOnePlace * cameras.norm())
    return std::nullopt;
  const auto meeting = whereAxesMeet(capture);
  return meeting ? meeting : assume<Point>(cameras);
}

std::optional<Vec3<double>> nearerOrigin(const Capture& capture) {
  const auto middle = middleOfScene(capture);
  if (!middle || roundingInPixels(capture, *middle) <= kMostRounding) return std::nullopt;
  const double size = farthest(capture, middle->raw());
  const double unit = std::min(1., std::pow(10, std::floor(std::log10(size))));
  return capture.origin + unit * (middle->raw() / unit).array().round().matrix();
}

Capture countedFrom(Capture capture, const Vec3<double>& origin) {
  const Vec3<double> shift = origin - capture.origin;
  for (View& view : capture.views) {
    const auto& old = view.camera.cameraFromWorld;
    view.camera.cameraFromWorld = {old.rotation(), old.translation() + old.rotation() * shift};
  }
  for (Light& light : capture.lights) {
    if (auto* point = std::get_if<PointLight>(&light.kind))
      point->position = assume<Point>(point->position.raw() - shift);
    else
      std::get<DirectionalLight>(light.kind).irradiance = irradianceAt(light, assume<Point>(shift));
  }
  capture.origin = origin;
  return capture;
}

} // namespace surflect::capture
