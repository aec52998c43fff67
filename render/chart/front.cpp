#include "render/chart/front.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::chart {

namespace {

bool beats(const Point& a, const Point& b) {
  const double accuracyA = a.rest.psnrLinearDb, accuracyB = b.rest.psnrLinearDb;
  return a.milliseconds <= b.milliseconds && accuracyA >= accuracyB &&
         (a.milliseconds < b.milliseconds || accuracyA > accuracyB);
}

} // namespace

void markFront(std::span<Point> points) {
  for (Point& point : points)
    point.isOnFront = std::ranges::none_of(points, [&](const Point& other) { return beats(other, point); });
}

size_t kneeOf(std::span<const Point> points) {
  std::vector<size_t> front;
  for (size_t i = 0; i < points.size(); ++i)
    if (points[i].isOnFront) front.push_back(i);
  assert(!front.empty());
  std::ranges::sort(front, {}, [&](size_t i) { return points[i].milliseconds; });
  const Point &fast = points[front.front()], &slow = points[front.back()];
  const double width = std::log(slow.milliseconds / fast.milliseconds);
  const double height = slow.rest.psnrLinearDb - fast.rest.psnrLinearDb;
  // Height above the line between the ends, which grows with the distance from it.
  const auto above = [&](size_t i) {
    const double x = std::log(points[i].milliseconds / fast.milliseconds) / width;
    const double y = (points[i].rest.psnrLinearDb - fast.rest.psnrLinearDb) / height;
    return std::isfinite(x) && std::isfinite(y) ? y - x : 0;
  };
  return *std::ranges::max_element(front, {}, above);
}

void markChosen(std::span<Point> points, const std::map<std::filesystem::path, knobs::Setting>& previews) {
  if (points.empty()) return;
  constexpr double kHardlyDifferent = 0.01;
  Point* fastest = nullptr;
  for (Point& point : points) {
    const auto preview = previews.find(point.model);
    point.isChosen = point.setting.empty() || (preview != previews.end() && point.setting == preview->second);
    if (point.rmsToFull <= kHardlyDifferent && (!fastest || point.milliseconds < fastest->milliseconds))
      fastest = &point;
  }
  if (fastest) fastest->isChosen = true;
  points[kneeOf(points)].isChosen = true;
}

} // namespace surflect::chart
