#include "render/stage/surface.h"

#include "surfel/error.h"
#include "warp/deform.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

namespace surflect {

namespace {

using Vector = Vec3<double>;
using Direction = Direction3<AcquisitionSpace, double>;

constexpr double kPi = std::numbers::pi;

struct SurfacePoint {
  Vector position, normal, tangent;
};

// A net of columns x rows squares over (s, t) in [0,1]^2, without triangles that have no area. Seen from
// outside, t points to the left of s.
void addNet(Surface& surface, int columns, int rows,
            const std::function<SurfacePoint(double s, double t)>& point) {
  const auto first = static_cast<uint32_t>(surface.mesh.positions.size());
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column) {
      const double s = static_cast<double>(column) / columns, t = static_cast<double>(row) / rows;
      const SurfacePoint p = point(s, t);
      surface.textureCoordinates.emplace_back(s, t);
      surface.mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p.position));
      surface.normals.push_back(assume<Direction>(p.normal));
      surface.tangents.push_back(assume<Direction>(p.tangent));
    }
  auto& triangles = surface.mesh.triangles;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const uint32_t a = first + static_cast<uint32_t>(row * (columns + 1) + column), b = a + 1,
                     d = a + static_cast<uint32_t>(columns + 1), c = d + 1;
      for (const auto& triangle : {std::array{a, b, c}, std::array{a, c, d}}) {
        triangles.push_back(triangle);
        if (!(areaVector(surface.mesh, triangles.size() - 1).norm() > 0)) triangles.pop_back();
      }
    }
}

// The last column of a round net is the first one, to the bit.
Vector aroundAxis(double s) {
  const double phi = s == 1 ? 0 : 2 * kPi * s;
  return {std::cos(phi), std::sin(phi), 0};
}
Vector eastOf(const Vector& outward) { return {-outward.y(), outward.x(), 0}; }

Vector sphereDirection(double s, double t) {
  const bool isPole = t == 0 || t == 1;
  const double latitude = kPi * (t - 0.5);
  return (isPole ? 0 : std::cos(latitude)) * aroundAxis(s) + std::sin(latitude) * Vector::UnitZ();
}

// rho(d), see bumpySphere().
double bumpyRadius(const Vector& d, double radius, double amplitude, double f) {
  return radius * (1 + amplitude * std::sin(f * d.x()) * std::sin(f * d.y()) * std::sin(f * d.z()));
}

// Gradient of |p| - rho(p / |p|), by central differences: error 1e-10, relative.
Vector bumpyNormal(const Vector& p, double radius, double amplitude, double f) {
  const double h = 1e-5 * radius;
  const auto height = [&](const Vector& x) {
    return x.norm() - bumpyRadius(x.normalized(), radius, amplitude, f);
  };
  Vector gradient;
  for (int i = 0; i < 3; ++i)
    gradient[i] = (height(p + h * Vector::Unit(i)) - height(p - h * Vector::Unit(i))) / (2 * h);
  return gradient.normalized();
}

int rowsOf(int segments) { return std::max(2, segments / 2); }

Direction roundTheAxis(const Direction& normal) { return assume<Direction>(eastOf(normal.raw())); }

// Every corner becomes a vertex.
TriangleMesh unshared(const TriangleMesh& mesh) {
  TriangleMesh corners;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<uint32_t>(corners.positions.size());
    for (const uint32_t vertex : triangle) corners.positions.push_back(mesh.positions[vertex]);
    corners.triangles.push_back({first, first + 1, first + 2});
  }
  return corners;
}

} // namespace

Surface sphere(const Point3<AcquisitionSpace, double>& center, double radius, int segments) {
  Surface surface;
  addNet(surface, segments, rowsOf(segments), [&](double s, double t) -> SurfacePoint {
    const Vector d = sphereDirection(s, t);
    return {center.raw() + radius * d, d, eastOf(aroundAxis(s))};
  });
  return surface;
}

Surface bumpySphere(const Point3<AcquisitionSpace, double>& center, double radius, double amplitude,
                    double frequency, int segments) {
  Surface surface;
  addNet(surface, segments, rowsOf(segments), [&](double s, double t) -> SurfacePoint {
    const Vector d = sphereDirection(s, t), p = bumpyRadius(d, radius, amplitude, frequency) * d,
                 n = bumpyNormal(p, radius, amplitude, frequency), east = eastOf(aroundAxis(s));
    return {center.raw() + p, n, east - east.dot(n) * n};
  });
  return surface;
}

Surface cylinder(const Point3<AcquisitionSpace, double>& center, double radius, double height, int segments) {
  Surface surface;
  const Vector c = center.raw(), up = height / 2 * Vector::UnitZ();
  const int rings = std::max(1, segments / 8);
  const auto net = [&](int rows, const std::function<Vector(double t, const Vector& outward)>& position,
                       const std::function<Vector(const Vector& outward)>& normal) {
    addNet(surface, segments, rows, [&](double s, double t) -> SurfacePoint {
      const Vector outward = aroundAxis(s);
      return {c + position(t, outward), normal(outward), eastOf(outward)};
    });
  };
  net(
      rowsOf(segments),
      [&](double t, const Vector& outward) -> Vector { return radius * outward + (2 * t - 1) * up; },
      [](const Vector& outward) { return outward; });
  net(
      rings, [&](double t, const Vector& outward) -> Vector { return (1 - t) * radius * outward + up; },
      [](const Vector&) -> Vector { return Vector::UnitZ(); });
  net(
      rings, [&](double t, const Vector& outward) -> Vector { return t * radius * outward - up; },
      [](const Vector&) -> Vector { return -Vector::UnitZ(); });
  return surface;
}

Surface box(const Point3<AcquisitionSpace, double>& center, const Vec3<double>& size, int segments) {
  Surface surface;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1., 1.}) {
      const Vector normal = side * Vector::Unit(axis);
      const Vector along = axis == 2 ? Vector(Vector::UnitX()) : eastOf(normal);
      const Vector across = normal.cross(along);
      addNet(surface, segments, segments, [&](double s, double t) -> SurfacePoint {
        const Vector p = normal + (2 * s - 1) * along + (2 * t - 1) * across;
        return {center.raw() + Vector(p.cwiseProduct(size / 2)), normal, along};
      });
    }
  return surface;
}

Surface readSurface(const std::filesystem::path& path, bool smooth) {
  Surface surface;
  const TriangleMesh mesh = readMesh(path);
  surface.mesh = smooth ? mesh : unshared(mesh);
  std::vector<Vector> sums(surface.mesh.positions.size(), Vector::Zero());
  for (size_t i = 0; i < surface.mesh.triangles.size(); ++i)
    for (const uint32_t vertex : surface.mesh.triangles[i]) sums[vertex] += areaVector(surface.mesh, i);
  for (const Vector& sum : sums) {
    surface.normals.push_back(assume<Direction>(sum.stableNormalized()));
    surface.tangents.push_back(roundTheAxis(surface.normals.back()));
  }
  return surface;
}

Surface deformed(const Surface& rest, const Warp& warp) {
  SurfelCloud points;
  points.p0 = rest.mesh.positions;
  const double step = differenceStep(points);
  Surface surface = rest;
  std::vector<char> mirrors(rest.mesh.positions.size());
  tbb::parallel_for(size_t{0}, rest.mesh.positions.size(), [&](size_t i) {
    const Vector x = rest.mesh.positions[i].cast<double>().raw();
    const auto exact = warp.jacobian(x);
    const Mat3<double> j = exact ? *exact : centralDifferences(warp, x, Mat3<double>::Identity(), step);
    // det(J) J^-T, which exists where J has no inverse
    Mat3<double> cofactors;
    cofactors << j.col(1).cross(j.col(2)), j.col(2).cross(j.col(0)), j.col(0).cross(j.col(1));
    const double determinant = j.determinant();
    mirrors[i] = determinant < 0;
    surface.mesh.positions[i] = assume<Point3<AcquisitionSpace>>(warp.position(x));
    surface.normals[i] = assume<Direction>((mirrors[i] ? -1. : 1.) * (cofactors * rest.normals[i].raw()));
    surface.tangents[i] = assume<Direction>(j * rest.tangents[i].raw());
    if (!surface.mesh.positions[i].raw().allFinite() || !j.allFinite())
      throw Error("the warp has no value there").at("vertex[" + std::to_string(i) + "]");
  });
  for (auto& [a, b, c] : surface.mesh.triangles)
    if (mirrors[a]) std::swap(b, c);
  return surface;
}

} // namespace surflect
