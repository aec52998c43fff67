// The Pareto front of a chart, and the points to look at.
#pragma once

#include "render/chart/chart.h"

#include <filesystem>
#include <span>

namespace surflect::chart {

// Point::name of a renderer's preview setting.
inline constexpr const char* kPreviewName = "preview";

// Sets Point::isOnFront: time against sRGB PSNR at rest. Points that are equal in both are on it together.
void markFront(std::span<Point> points);

// Sets Point::isChosen for each model: its full and preview settings, its knee, and its fastest point within
// 1 % of full.
void markChosen(std::span<Point> points);

// Index of the knee of a model's points. Candidates are the points to which no other is both faster and
// closer to full. The knee is the candidate farthest below the line from the fastest to the closest one, in a
// plot of error over the logarithm of time with equal ranges. The model has at least one point.
size_t kneeOf(std::span<const Point> points, const std::filesystem::path& model);

} // namespace surflect::chart
