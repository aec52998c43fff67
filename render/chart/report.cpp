#include "render/chart/report.h"

namespace surflect::chart {

std::string htmlOf(const Chart& chart) { return "<!doctype html><title>" + chart.title + "</title>\n"; }

} // namespace surflect::chart
