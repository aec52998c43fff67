// Report of a chart: one HTML file for reading, which needs no other file and no network.
#pragma once

#include "render/chart/chart.h"

#include <string>

namespace surflect::chart {

// The page. It is also well-formed XML behind its first line. Points without finite figures are in its table
// but not in its plots.
std::string htmlOf(const Chart& chart);

} // namespace surflect::chart
