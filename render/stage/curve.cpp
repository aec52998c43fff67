#include "render/stage/curve.h"

#include "render/stage/material/shading.h"
#include "render/stage/random.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace surflect::stage {

using Vector = Vec3<double>;
using Vector4 = Eigen::Vector4d;

namespace {

constexpr size_t kChords = 32;

Vector4 packed(const CurvePoint& p) { return {p.position.x(), p.position.y(), p.position.z(), p.radius}; }

double distance(const Vector4& a, const Vector4& b) { return (b - a).head<3>().norm(); }

// Slope at b of the parabola through a, b and c.
Vector4 middleSlope(const Vector4& a, const Vector4& b, const Vector4& c) {
  const double before = distance(a, b), after = distance(b, c);
  return (after / before * (b - a) + before / after * (c - b)) / (before + after);
}

// Vector reflected in the plane orthogonal to `axis`.
Vector mirrored(const Vector& v, const Vector& axis) {
  return v - 2 * axis.dot(v) / axis.squaredNorm() * axis;
}

} // namespace

SmoothCurve::SmoothCurve(std::vector<CurvePoint> points, bool closed, const std::optional<CurvePoint>& before,
                         const std::optional<CurvePoint>& after) {
  const size_t least = closed ? 3 : 2;
  if (points.size() < least)
    throw Error::mismatch(std::to_string(least) + " points or more", std::to_string(points.size()));
  for (const CurvePoint& p : points) points_.push_back(packed(p));
  if (closed) points_.push_back(points_.front());
  const size_t count = points_.size(), last = count - 1;
  for (size_t i = 0; i < last; ++i) {
    steps_.push_back(distance(points_[i], points_[i + 1]));
    if (!(steps_.back() > 0))
      throw Error::mismatch("a place other than that of the point before", "the same")
          .at("[" + std::to_string((i + 1) % points.size()) + "]");
  }
  slopes_.resize(count);
  for (size_t i = 1; i < last; ++i) slopes_[i] = middleSlope(points_[i - 1], points_[i], points_[i + 1]);
  const Vector4 first = (points_[1] - points_[0]) / steps_.front(),
                final = (points_[last] - points_[last - 1]) / steps_.back();
  if (closed) {
    slopes_[0] = slopes_[last] = middleSlope(points_[last - 1], points_[0], points_[1]);
  } else { // zero second derivative, if there is a neighbour
    slopes_[0] = before     ? middleSlope(packed(*before), points_[0], points_[1])
                 : last > 1 ? Vector4((3 * first - slopes_[1]) / 2)
                            : first;
    slopes_[last] = after      ? middleSlope(points_[last - 1], points_[last], packed(*after))
                    : last > 1 ? Vector4((3 * final - slopes_[last - 1]) / 2)
                               : final;
  }
  lengths_.push_back(0);
  Vector4 previous = points_[0];
  for (size_t i = 0; i < last; ++i)
    for (size_t k = 1; k <= kChords; ++k) {
      const Vector4 next = value({i, static_cast<double>(k) / kChords});
      lengths_.push_back(lengths_.back() + distance(previous, next));
      previous = next;
    }
}

SmoothCurve::Parameter SmoothCurve::parameterAt(double fraction) const {
  if (fraction >= 1) return {steps_.size() - 1, 1};
  const double target = std::max(0.0, fraction) * length();
  const size_t chord = static_cast<size_t>(std::upper_bound(lengths_.begin(), lengths_.end() - 1, target) -
                                           lengths_.begin() - 1);
  const double chordLength = lengths_[chord + 1] - lengths_[chord];
  const double within = chordLength > 0 ? (target - lengths_[chord]) / chordLength : 0;
  return {chord / kChords, (static_cast<double>(chord % kChords) + within) / kChords};
}

// Hermite cubic.
Vector4 SmoothCurve::value(const Parameter& parameter) const {
  const auto& [i, u] = parameter;
  const double v = 1 - u, h = steps_[i];
  return v * v * (1 + 2 * u) * points_[i] + u * u * (1 + 2 * v) * points_[i + 1] +
         h * u * v * (v * slopes_[i] - u * slopes_[i + 1]);
}

Vector4 SmoothCurve::derivative(const Parameter& parameter) const {
  const auto& [i, u] = parameter;
  const double v = 1 - u;
  return 6 * u * v / steps_[i] * (points_[i + 1] - points_[i]) + v * (1 - 3 * u) * slopes_[i] +
         u * (3 * u - 2) * slopes_[i + 1];
}

CurvePoint SmoothCurve::at(double fraction) const {
  const Vector4 p = value(parameterAt(fraction));
  return {p.head<3>(), p[3]};
}

Vector SmoothCurve::direction(double fraction) const {
  return derivative(parameterAt(fraction)).head<3>().stableNormalized();
}

std::vector<CurveFrame> framesAlong(std::span<const CurvePoint> points, bool closed) {
  const size_t count = points.size(), last = count - 1;
  std::vector<CurveFrame> frames(count);
  for (size_t i = 0; i < count; ++i) {
    const auto position = [&](size_t k) -> const Vector& { return points[k].position; };
    const bool isEnd = i == 0 || i == last;
    const Vector back = i > 0 ? position(i) - position(i - 1) : position(0) - position(last - 1),
                 forth = i < last ? position(i + 1) - position(i) : position(1) - position(0);
    const Vector along = !isEnd || closed ? Vector(back.stableNormalized() + forth.stableNormalized())
                         : i == 0         ? forth
                                          : back;
    frames[i].tangent = along.stableNormalized();
  }
  if (closed) frames[last].tangent = frames[0].tangent;

  const Vector t0 = frames[0].tangent;
  const Vector upward = std::abs(t0.z()) < 0.7 ? Vector(Vector::UnitZ()) : Vector(Vector::UnitX());
  frames[0].normal = (upward - upward.dot(t0) * t0).normalized();
  for (size_t i = 0; i < last; ++i) {
    const Vector step = points[i + 1].position - points[i].position;
    const Vector normal = mirrored(frames[i].normal, step), tangent = mirrored(frames[i].tangent, step);
    const Vector turn = frames[i + 1].tangent - tangent;
    const Vector carried = turn.squaredNorm() > 0 ? mirrored(normal, turn) : normal;
    const Vector& t = frames[i + 1].tangent;
    frames[i + 1].normal = (carried - carried.dot(t) * t).stableNormalized();
  }
  if (closed) {
    const Vector binormal = t0.cross(frames[0].normal);
    const double left =
        std::atan2(frames[last].normal.dot(binormal), frames[last].normal.dot(frames[0].normal));
    for (size_t i = 1; i < count; ++i) {
      const double angle = -left * static_cast<double>(i) / static_cast<double>(last);
      const Vector n = frames[i].normal, b = frames[i].tangent.cross(n);
      frames[i].normal = std::cos(angle) * n + std::sin(angle) * b;
    }
    frames[last].normal = frames[0].normal;
  }
  for (CurveFrame& frame : frames) frame.binormal = frame.tangent.cross(frame.normal);
  return frames;
}

void addGridMesh(Surface& surface, int columns, int rows,
                 const std::function<SurfacePoint(double s, double t)>& point) {
  using Direction = Direction3<AcquisitionSpace, double>;
  auto& triangles = surface.mesh.triangles;
  requireFewTriangles(triangles.size() + 2 * static_cast<size_t>(columns) * static_cast<size_t>(rows));
  const auto first = static_cast<uint32_t>(surface.mesh.positions.size());
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column) {
      const SurfacePoint p = point(static_cast<double>(column) / columns, static_cast<double>(row) / rows);
      surface.textureCoordinates.push_back(p.st);
      surface.mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p.position));
      surface.normals.push_back(assume<Direction>(p.normal));
      surface.tangents.push_back(assume<Direction>(p.tangent));
    }
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

using Vector = Vec3<double>;

namespace {

// Derivatives along the curve, by finite differences.
struct Slopes {
  std::vector<double> radius; // dr/dl
  std::vector<Vector> turn;   // dT/dl
};

Slopes slopesAlong(std::span<const CurvePoint> points, std::span<const CurveFrame> frames, bool closed) {
  Slopes slopes;
  const size_t last = points.size() - 1;
  for (size_t i = 0; i <= last; ++i) {
    const size_t a = i > 0 ? i - 1 : closed ? last - 1 : 0, b = i < last ? i + 1 : closed ? 1 : last;
    const double length =
        (points[i].position - points[a].position).norm() + (points[b].position - points[i].position).norm();
    slopes.radius.push_back((points[b].radius - points[a].radius) / length);
    slopes.turn.push_back((frames[b].tangent - frames[a].tangent) / length);
  }
  return slopes;
}

std::vector<CurvePoint> evenlySpaced(const SmoothCurve& curve, int steps) {
  std::vector<CurvePoint> points;
  for (int i = 0; i <= steps; ++i) {
    points.push_back(curve.at(static_cast<double>(i) / steps));
    points.back().radius = std::max(0.0, points.back().radius);
  }
  return points;
}

} // namespace

void addTube(Surface& surface, std::span<const CurvePoint> points, bool closed, int sides) {
  const std::vector<CurveFrame> frames = framesAlong(points, closed);
  const Slopes slopes = slopesAlong(points, frames, closed);
  const int rows = static_cast<int>(points.size()) - 1;

  std::vector<double> lengths{closed ? 0 : material::kPi / 2 * points.front().radius};
  for (size_t i = 1; i < points.size(); ++i)
    lengths.push_back(lengths.back() + (points[i].position - points[i - 1].position).norm());
  const double whole = lengths.back() + (closed ? 0 : material::kPi / 2 * points.back().radius);

  // The last column equals the first, to the bit.
  const auto outwardAt = [](const CurveFrame& frame, double s) -> Vector {
    const double phi = s == 1 ? 0 : 2 * material::kPi * s;
    return std::cos(phi) * frame.normal + std::sin(phi) * frame.binormal;
  };
  addGridMesh(surface, sides, rows, [&](double s, double t) -> SurfacePoint {
    const auto i = static_cast<size_t>(std::lround(t * rows));
    const CurveFrame& frame = frames[i];
    const double r = points[i].radius;
    const Vector o = outwardAt(frame, s);
    // p = c + r o with dc/dl = T, do/dl = -(o.T') T; the normal is orthogonal to dp/dl and to the circle
    const double stretch = 1 - r * o.dot(slopes.turn[i]);
    const Vector n = (stretch * o - slopes.radius[i] * frame.tangent).normalized();
    return {points[i].position + r * o, n, frame.tangent - frame.tangent.dot(n) * n, {s, lengths[i] / whole}};
  });
  if (closed) return;

  const int capRows = std::max(1, sides / 4);
  const auto cap = [&](size_t i, bool isEnd) {
    const double r = points[i].radius;
    if (!(r > 0)) return;
    addGridMesh(surface, sides, capRows, [&](double s, double t) -> SurfacePoint {
      const double beta = material::kPi / 2 * (isEnd ? t : t - 1);
      const Vector o = outwardAt(frames[i], s), along = frames[i].tangent;
      const double across = beta == 0 ? 1 : std::abs(beta) == material::kPi / 2 ? 0 : std::cos(beta);
      const Vector n = across * o + std::sin(beta) * along;
      return {points[i].position + r * n,
              n,
              across * along - std::sin(beta) * o,
              {s, (lengths[i] + beta * r) / whole}};
    });
  };
  cap(0, false);
  cap(points.size() - 1, true);
}

Surface tube(std::span<const CurvePoint> points, bool closed, int segments) {
  const SmoothCurve curve({points.begin(), points.end()}, closed);
  double thickest = 0;
  for (const CurvePoint& p : points) thickest = std::max(thickest, p.radius);
  // Squares twice as long as wide, and at least 4 between two points
  const double wanted = std::min(curve.length() * segments / (4 * material::kPi * thickest), 4096.0);
  Surface surface;
  addTube(surface,
          evenlySpaced(curve, std::max(static_cast<int>(wanted), 4 * static_cast<int>(points.size()))),
          closed, segments);
  return surface;
}

Surface braid(std::span<const CurvePoint> points, bool closed, const BraidShape& shape) {
  constexpr int kStepsPerTurn = 18, kSides = 6;
  const SmoothCurve curve({points.begin(), points.end()}, closed);
  const int steps = std::max(kStepsPerTurn * shape.turns, 4 * static_cast<int>(points.size()));
  requireFewTriangles(static_cast<size_t>(steps) * 2 * kSides * 3 * (static_cast<size_t>(shape.fibres) + 2));
  const std::vector<CurvePoint> middle = evenlySpaced(curve, steps);
  const std::vector<CurveFrame> frames = framesAlong(middle, closed);

  Surface surface;
  for (int strand = 0; strand < 3; ++strand) {
    // A strand goes to and fro once while it goes in and out twice, so it passes over one of the others on
    // the way there, and under the other on the way back. Half the width is 2.5 strand radii.
    std::vector<CurvePoint> path;
    for (int i = 0; i <= steps; ++i) {
      const size_t k = static_cast<size_t>(closed && i == steps ? 0 : i);
      const double theta = 2 * material::kPi * (static_cast<double>(k) / steps * shape.turns + strand / 3.0);
      const double radius = middle[k].radius / 2.5;
      path.push_back({middle[k].position + 1.5 * radius * std::sin(theta) * frames[k].normal +
                          radius * std::sin(2 * theta) * frames[k].binormal,
                      radius});
    }
    const std::vector<CurveFrame> strandFrames = framesAlong(path, closed);
    std::vector<CurvePoint> core = path;
    const double thickness =
        1.5 * material::kPi / shape.fibres; // relative to the strand's radius; neighbours overlap
    for (CurvePoint& p : core) p.radius *= std::max(0.2, 1 - 1.3 * thickness);
    addTube(surface, core, closed, 4 * kSides);
    for (int fibre = 0; fibre < shape.fibres; ++fibre) {
      Random random{shape.seed, static_cast<uint64_t>(strand), static_cast<uint64_t>(fibre)};
      const double start = 2 * material::kPi * (fibre + 0.7 * random.next()) / shape.fibres;
      const double depth = 1 - thickness * (1.2 + 0.5 * random.next());
      const double phase = 2 * material::kPi * random.next(),
                   waves = std::round(shape.turns * (0.5 + random.next()));
      std::vector<CurvePoint> line;
      for (int i = 0; i <= steps; ++i) {
        const size_t k = static_cast<size_t>(closed && i == steps ? 0 : i);
        const double wander = std::sin(2 * material::kPi * waves * static_cast<double>(k) / steps + phase);
        const double angle = start + 0.12 * wander, r = path[k].radius;
        const Vector o =
            std::cos(angle) * strandFrames[k].normal + std::sin(angle) * strandFrames[k].binormal;
        line.push_back({path[k].position + r * (depth + 0.2 * thickness * wander) * o, r * thickness});
      }
      addTube(surface, line, closed, kSides);
    }
  }
  return surface;
}

using Vector = Vec3<double>;

Surface fur(const Surface& skin, const FurShape& shape) {
  constexpr int kSides = 5, kSteps = 8;
  const TriangleMesh& mesh = skin.mesh;
  std::vector<double> areas{0}; // cumulative, twice the area
  for (size_t i = 0; i < mesh.triangles.size(); ++i)
    areas.push_back(areas.back() + areaVector(mesh, i).norm());
  requireFewTriangles(static_cast<size_t>(shape.hairs) * 2 * kSides * (kSteps + 1));

  Surface surface;
  for (int hair = 0; hair < shape.hairs; ++hair) {
    Random random{shape.seed, static_cast<uint64_t>(hair)};
    const double wanted = random.next() * areas.back();
    const auto triangle = std::min<size_t>(
        static_cast<size_t>(std::upper_bound(areas.begin(), areas.end(), wanted) - areas.begin() - 1),
        mesh.triangles.size() - 1);
    // Uniform point on the triangle: 1 - sqrt(u), sqrt(u) (1 - v), sqrt(u) v
    const double u = std::sqrt(random.next()), v = random.next();
    const std::array<double, 3> weights{1 - u, u * (1 - v), u * v};
    Vector root = Vector::Zero(), normal = Vector::Zero();
    Vec2<double> st(0, 0);
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t corner = mesh.triangles[triangle][k];
      root += weights[k] * mesh.positions[corner].cast<double>().raw();
      normal += weights[k] * skin.normals[corner].raw();
      if (!skin.textureCoordinates.empty()) st += weights[k] * skin.textureCoordinates[corner];
    }
    normal.normalize();
    const double z = 2 * random.next() - 1, phi = 2 * std::numbers::pi * random.next();
    const double r = std::sqrt(1 - z * z);
    const Vector sideways(r * std::cos(phi), r * std::sin(phi), z);
    const Vector leaving = (normal + 0.7 * shape.disorder * sideways).normalized();
    const double length = shape.length * (1 - 0.5 * shape.disorder * random.next());
    const Vector comb = shape.comb + 0.3 * shape.disorder * sideways;

    std::vector<CurvePoint> points;
    for (int k = 0; k <= kSteps; ++k) {
      const double l = static_cast<double>(k) / kSteps;
      points.push_back({root + length * (l * leaving + l * l * comb), shape.radius * (1 - l)});
    }
    const size_t first = surface.mesh.positions.size();
    addTube(surface, points, false, kSides);
    std::fill(surface.textureCoordinates.begin() + static_cast<std::ptrdiff_t>(first),
              surface.textureCoordinates.end(), st);
  }
  return surface;
}

} // namespace surflect::stage
