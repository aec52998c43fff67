// The Pareto front of a chart, and the points to look at.
#pragma once

#include "render/chart/chart.h"

#include <filesystem>
#include <map>
#include <span>

namespace surflect::chart {

// Sets Point::isOnFront: time against PSNR in linear light at rest. Of points that are equal in both, all
// are.
void markFront(std::span<Point> points);

// Sets Point::isChosen for the full and the preview setting of each model, the knee of the front, and the
// fastest point within 1 % of full. `previews` are by model.
void markChosen(std::span<Point> points, const std::map<std::filesystem::path, knobs::Setting>& previews);

// Index of the point of the front that is farthest from the line between its ends, over the logarithm of time
// and decibels scaled to equal ranges; the only point if there is one.
size_t kneeOf(std::span<const Point> points);

} // namespace surflect::chart
