// Symbols: o origin and d direction of a ray, in units of an ellipsoid about 0; t distance along it.
#include "bench/doll/doll_shape.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace surflect::bench {

namespace {

const std::array kParts = {
    Ellipsoid{{0, 0, 0.86}, {0.115, 0.12, 0.14}},       // head
    Ellipsoid{{0, 0, 0.56}, {0.16, 0.12, 0.2}},         // body
    Ellipsoid{{0, 0, 0.22}, {0.29, 0.26, 0.22}},        // skirt
    Ellipsoid{{0.24, -0.05, 0.56}, {0.15, 0.06, 0.06}}, // arms
    Ellipsoid{{-0.24, -0.05, 0.56}, {0.15, 0.06, 0.06}},
    Ellipsoid{{0, -0.12, 0.84}, {0.02, 0.025, 0.03}}, // nose
};

// First intersection with an ellipsoid: |o + t d|^2 = 1  <=>  dd t^2 + 2 od t + (oo - 1) = 0.
std::optional<double> entry(const Ellipsoid& part, const Vec3<double>& origin,
                            const Vec3<double>& direction) {
  const Vec3<double> o = (origin - part.center).cwiseQuotient(part.radii),
                     d = direction.cwiseQuotient(part.radii);
  const double dd = d.squaredNorm(), od = o.dot(d), rest = od * od - dd * (o.squaredNorm() - 1);
  if (!(rest > 0) || !(od < 0)) return std::nullopt;
  return (-od - std::sqrt(rest)) / dd;
}

bool isInsideOfAnother(size_t part, const Vec3<double>& p) {
  for (size_t other = 0; other < kParts.size(); ++other)
    if (other != part && excessOf(kParts[other], p) < 0) return true;
  return false;
}

} // namespace

std::span<const Ellipsoid> dollParts() { return kParts; }

double excessOf(const Ellipsoid& part, const Vec3<double>& p) {
  return (p - part.center).cwiseQuotient(part.radii).squaredNorm() - 1;
}

TriangleMesh dollMesh(int segments) {
  assert(segments >= 4);
  TriangleMesh mesh;
  const int across = 2 * segments; // meridians
  for (size_t part = 0; part < kParts.size(); ++part) {
    const auto base = static_cast<uint32_t>(mesh.positions.size());
    for (int row = 0; row <= segments; ++row)
      for (int column = 0; column < across; ++column) {
        const double theta = std::numbers::pi * row / segments, phi = 2 * std::numbers::pi * column / across;
        const Vec3<double> unit(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                std::cos(theta));
        mesh.positions.push_back(
            assume<Point3<AcquisitionSpace>>(kParts[part].center + kParts[part].radii.cwiseProduct(unit)));
      }
    const auto vertex = [&](int row, int column) {
      return base + static_cast<uint32_t>(row * across + column % across);
    };
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
      for (const uint32_t corner : {a, b, c})
        if (!isInsideOfAnother(part, mesh.positions[corner].raw().cast<double>())) {
          mesh.triangles.push_back({a, b, c});
          return;
        }
    };
    for (int row = 0; row < segments; ++row)
      for (int column = 0; column < across; ++column) {
        const uint32_t a = vertex(row, column), b = vertex(row + 1, column), c = vertex(row + 1, column + 1),
                       d = vertex(row, column + 1);
        if (row + 1 < segments) add(a, b, c); // at the poles the quadrangle is a triangle
        if (row > 0) add(a, c, d);
      }
  }
  return mesh;
}

std::optional<DollHit> firstHit(const Vec3<double>& origin, const Vec3<double>& direction) {
  std::optional<DollHit> first;
  for (const Ellipsoid& part : kParts) {
    const auto distance = entry(part, origin, direction);
    if (!distance || (first && first->distance <= *distance)) continue;
    const Vec3<double> p = origin + *distance * direction;
    const Vec3<double> gradient = (p - part.center).cwiseQuotient(part.radii.cwiseAbs2());
    first = {*distance, gradient.normalized()};
  }
  return first;
}

std::vector<uint8_t> dollOutline(const capture::Camera<AcquisitionSpace>& camera) {
  const capture::Lens& lens = camera.lens;
  assert(lens.model == capture::Lens::Model::pinhole && !lens.distorts());
  const Mat3<double> worldFromCamera = camera.cameraFromWorld.rotation().transpose();
  const Vec3<double> center = camera.center().raw();
  std::vector<uint8_t> outline(static_cast<size_t>(lens.width) * static_cast<size_t>(lens.height), 0);
  for (const Ellipsoid& part : kParts) {
    const Vec3<double> o = (center - part.center).cwiseQuotient(part.radii);
    const double k = o.squaredNorm() - 1;
    assert(k > 0);
    // Along a row the direction is a + x b. A ray meets the unit ball if (o d)^2 - k d^2 >= 0:
    //   A x^2 + 2 B x + C >= 0,   A = (ob)^2 - k bb,   B = (oa)(ob) - k ab,   C = (oa)^2 - k aa.
    const Vec3<double> b = (worldFromCamera.col(0) / lens.focalX).cwiseQuotient(part.radii);
    const double ob = o.dot(b), A = ob * ob - k * b.squaredNorm();
    for (int y = 0; y < lens.height; ++y) {
      const Vec3<double> start(-lens.centerX / lens.focalX, -(y + 0.5 - lens.centerY) / lens.focalY, -1);
      const Vec3<double> a = (worldFromCamera * start).cwiseQuotient(part.radii);
      const double oa = o.dot(a), B = oa * ob - k * a.dot(b), C = oa * oa - k * a.squaredNorm();
      const double discriminant = B * B - A * C;
      if (!(A < 0) || !(discriminant > 0)) continue;
      const double root = std::sqrt(discriminant);
      const auto pixel = [&](double x) { // first pixel with its centre at or after x
        return static_cast<int>(std::ceil(std::clamp(x - 0.5, 0.0, static_cast<double>(lens.width))));
      };
      const int first = pixel((-B + root) / A), end = pixel((-B - root) / A);
      if (first >= end) continue;
      std::fill_n(outline.begin() + static_cast<std::ptrdiff_t>(y) * lens.width + first, end - first,
                  uint8_t{1});
    }
  }
  return outline;
}

} // namespace surflect::bench
