// Files of a chart, for programs.
#pragma once

#include "render/chart/chart.h"

#include <filesystem>
#include <string>

namespace surflect::chart {

// A table with one row per point; names of columns end in their unit. Figures that a point lacks are empty.
std::string csvOf(const Chart& chart);

// Everything but the pictures.
std::string jsonOf(const Chart& chart);

// Writes chart.csv, chart.json and index.html, each atomically, into a folder that exists. Throws Error.
void writeChart(const Chart& chart, const std::filesystem::path& folder);

} // namespace surflect::chart
