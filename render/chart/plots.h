// Plots of a chart: HTML figures with inline SVG.
#pragma once

#include "render/chart/view.h"

#include <string>

namespace surflect::chart {

// Time against error to full, with each model's front; errors below kVisibleError share a line below the
// axis.
std::string errorPlot(const View& view);

// Time against PSNR to the photographs, at rest and deformed, with the front and the figures of full.
std::string agreementPlot(const View& view);

// A plot of error and time for each knob that was swept while all others were at full; empty if there is
// none.
std::string knobPlots(const View& view);

} // namespace surflect::chart
