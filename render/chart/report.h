// A chart as a page.
#pragma once

#include "render/chart/chart.h"

#include <string>

namespace surflect::chart {

std::string htmlOf(const Chart& chart);

} // namespace surflect::chart
