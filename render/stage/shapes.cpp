#include "render/stage/shapes.h"

#include "render/stage/curve.h"
#include "render/stage/material/shading.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace surflect::stage {

namespace {

using Vector = Vec3<double>;

// Direction around the axis; the last column of a closed grid equals the first, to the bit.
Vector aroundAxis(double s) {
  const double phi = s == 1 ? 0 : 2 * material::kPi * s;
  return {std::cos(phi), std::sin(phi), 0};
}
Vector eastOf(const Vector& outward) { return {-outward.y(), outward.x(), 0}; }

Vector sphereDirection(double s, double t) {
  const bool isPole = t == 0 || t == 1;
  const double latitude = material::kPi * (t - 0.5);
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

// Pieces of a profile between its creases.
std::vector<SmoothCurve> smoothPieces(std::span<const ProfilePoint> profile) {
  const auto onPlane = [](const ProfilePoint& p) { return CurvePoint{{p.radius, 0, p.height}}; };
  const auto isSame = [](const ProfilePoint& a, const ProfilePoint& b) {
    return a.radius == b.radius && a.height == b.height;
  };
  std::vector<SmoothCurve> pieces;
  for (size_t first = 0; first < profile.size();) {
    size_t last = first;
    while (last + 1 < profile.size() && !isSame(profile[last], profile[last + 1])) ++last;
    std::vector<CurvePoint> points;
    for (size_t i = first; i <= last; ++i) points.push_back(onPlane(profile[i]));
    if (points.size() < 2)
      throw Error::mismatch("another point between creases", "one alone")
          .at("[" + std::to_string(first) + "]");
    // Profiles that reach the axis are extended behind it by reflection.
    const auto beyond = [&](const ProfilePoint& end, const ProfilePoint& next) -> std::optional<CurvePoint> {
      if (end.radius > 0 || !(next.radius > 0)) return std::nullopt;
      return CurvePoint{{-next.radius, 0, next.height}};
    };
    pieces.emplace_back(std::move(points), false, beyond(profile[first], profile[first + 1]),
                        beyond(profile[last], profile[last - 1]));
    first = last + 1;
  }
  return pieces;
}

} // namespace

Surface sphere(const Point3<AcquisitionSpace, double>& center, double radius, int segments) {
  Surface surface;
  addGridMesh(surface, segments, rowsOf(segments), [&](double s, double t) -> SurfacePoint {
    const Vector d = sphereDirection(s, t);
    return {center.raw() + radius * d, d, eastOf(aroundAxis(s)), {s, t}};
  });
  return surface;
}

Surface bumpySphere(const Point3<AcquisitionSpace, double>& center, double radius, double amplitude,
                    double frequency, int segments) {
  Surface surface;
  addGridMesh(surface, segments, rowsOf(segments), [&](double s, double t) -> SurfacePoint {
    const Vector d = sphereDirection(s, t), p = bumpyRadius(d, radius, amplitude, frequency) * d,
                 n = bumpyNormal(p, radius, amplitude, frequency), east = eastOf(aroundAxis(s));
    return {center.raw() + p, n, east - east.dot(n) * n, {s, t}};
  });
  return surface;
}

Surface cylinder(const Point3<AcquisitionSpace, double>& center, double radius, double height, int segments) {
  Surface surface;
  const Vector c = center.raw(), up = height / 2 * Vector::UnitZ();
  const int rings = std::max(1, segments / 8);
  const auto net = [&](int rows, const std::function<Vector(double t, const Vector& outward)>& position,
                       const std::function<Vector(const Vector& outward)>& normal) {
    addGridMesh(surface, segments, rows, [&](double s, double t) -> SurfacePoint {
      const Vector outward = aroundAxis(s);
      return {c + position(t, outward), normal(outward), eastOf(outward), {s, t}};
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
      addGridMesh(surface, segments, segments, [&](double s, double t) -> SurfacePoint {
        const Vector p = normal + (2 * s - 1) * along + (2 * t - 1) * across;
        return {center.raw() + Vector(p.cwiseProduct(size / 2)), normal, along, {s, t}};
      });
    }
  return surface;
}

Surface lathe(std::span<const ProfilePoint> profile, bool closed, int segments) {
  std::vector<ProfilePoint> outline(profile.begin(), profile.end());
  if (outline.size() < 2) throw Error::mismatch("two points or more", std::to_string(outline.size()));
  const ProfilePoint bottom = outline.front(), top = outline.back();
  std::vector<SmoothCurve> pieces = smoothPieces(outline);
  const auto disc = [](const ProfilePoint& from, const ProfilePoint& to) {
    return SmoothCurve({{{from.radius, 0, from.height}}, {{to.radius, 0, to.height}}}, false);
  };
  if (closed && bottom.radius > 0) pieces.insert(pieces.begin(), disc({0, bottom.height}, bottom));
  if (closed && top.radius > 0) pieces.push_back(disc(top, {0, top.height}));

  double widest = 0, whole = 0;
  for (const ProfilePoint& p : outline) widest = std::max(widest, p.radius);
  for (const SmoothCurve& piece : pieces) whole += piece.length();
  Surface surface;
  double before = 0;
  for (const SmoothCurve& piece : pieces) {
    const double squares = piece.length() * segments / (2 * material::kPi * widest);
    const int rows = static_cast<int>(std::clamp(std::ceil(squares), 1.0, 4.0 * segments));
    addGridMesh(surface, segments, rows, [&](double s, double t) -> SurfacePoint {
      const Vector p = piece.at(t).position, along = piece.direction(t), outward = aroundAxis(s);
      return {std::max(0.0, p.x()) * outward + p.z() * Vector::UnitZ(),
              along.z() * outward - along.x() * Vector::UnitZ(),
              eastOf(outward),
              {s, (before + t * piece.length()) / whole}};
    });
    before += piece.length();
  }
  return surface;
}

} // namespace surflect::stage
