#include "render/chart/front.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

namespace surflect::chart {

namespace {

// Whether a is at least as good as b in time and error, and better in one.
bool beats(double timeA, double errorA, double timeB, double errorB) {
  return timeA <= timeB && errorA <= errorB && (timeA < timeB || errorA < errorB);
}

} // namespace

void markFront(std::span<Point> points) {
  for (Point& point : points)
    point.isOnFront = std::ranges::none_of(points, [&](const Point& other) {
      return beats(other.milliseconds, -other.rest.psnrSrgbDb, point.milliseconds, -point.rest.psnrSrgbDb);
    });
}

size_t kneeOf(std::span<const Point> points, const std::filesystem::path& model) {
  std::vector<size_t> front;
  for (size_t i = 0; i < points.size(); ++i)
    if (points[i].model == model && std::ranges::none_of(points, [&](const Point& other) {
          return other.model == model &&
                 beats(other.milliseconds, other.rmsToFull, points[i].milliseconds, points[i].rmsToFull);
        }))
      front.push_back(i);
  assert(!front.empty());
  const auto [fast, slow] = std::ranges::minmax(front, {}, [&](size_t i) { return points[i].milliseconds; });
  const double width = std::log(points[slow].milliseconds / points[fast].milliseconds);
  const double height = points[fast].rmsToFull - points[slow].rmsToFull;
  // Depth below the line, which grows with the distance from it.
  const auto below = [&](size_t i) {
    const double x = std::log(points[i].milliseconds / points[fast].milliseconds) / width;
    const double y = (points[i].rmsToFull - points[slow].rmsToFull) / height;
    return std::isfinite(x) && std::isfinite(y) ? 1 - x - y : 0;
  };
  return *std::ranges::max_element(front, {}, below);
}

void markChosen(std::span<Point> points) {
  constexpr double kHardlyDifferent = 0.01;
  std::set<std::filesystem::path> models;
  for (Point& point : points) {
    models.insert(point.model);
    point.isChosen = point.setting.empty() || point.name == kPreviewName;
  }
  for (const std::filesystem::path& model : models) {
    Point* fastest = nullptr;
    for (Point& point : points)
      if (point.model == model && point.rmsToFull > 0 && // equal pictures: the knob has no effect here
          point.rmsToFull <= kHardlyDifferent && (!fastest || point.milliseconds < fastest->milliseconds))
        fastest = &point;
    if (fastest) fastest->isChosen = true;
    points[kneeOf(points, model)].isChosen = true;
  }
}

} // namespace surflect::chart
