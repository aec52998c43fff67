#include "render/stage/tube_mesh.h"

#include "render/stage/grid_mesh.h"
#include "render/stage/material/shading.h"
#include "render/stage/random.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>

namespace surflect::stage {

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

} // namespace surflect::stage
