// View of a chart: look-ups that several parts of its report share, and figures as text.
#pragma once

#include "render/chart/chart.h"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::chart {

inline constexpr size_t kHues = 7; // of the style sheet

// A chart with look-ups that several parts of the page share.
struct View {
  const Chart& chart;
  std::vector<std::filesystem::path> models = {};
  std::vector<size_t> modelOf = {};             // by point: index in `models`
  std::vector<method::Setting> settings = {};   // by point: knobs that are not at full
  std::vector<std::optional<size_t>> full = {}; // by model: the point at full
  std::vector<size_t> byTime = {};              // points, the fastest first
  std::vector<size_t> chosen = {};              // points, the slowest first
  std::vector<std::string> letters = {};        // by point; empty unless it is chosen

  const Point& at(size_t point) const { return chart.points[point]; }
  const Point* fullOf(size_t point) const {
    const auto& found = full[modelOf[point]];
    return found ? &chart.points[*found] : nullptr;
  }
  bool isFull(size_t point) const { return settings[point].empty(); }
  bool hasBent() const;
};

View viewOf(const Chart& chart);

// Name of a model for readers: its folder, or the whole path where folders of the same name occur.
std::string modelName(const View& view, size_t model);
// "cameras=2 lights=1"; "full"
std::string settingText(const View& view, size_t point);
// "preview", "full"; empty for a setting without a name
std::string nameOf(const View& view, size_t point);

// Least visible error to full, as a share. Smaller errors above 0 are all shown as "< 0.001" (percent).
inline constexpr double kVisibleError = 1e-5;

// Whether the point can be drawn over time.
bool hasTime(const Point& point);

// Figures with their units. A figure that is not finite is shown as a dash or as infinity.
std::string fixedText(double number, int decimals); // "38.20"
std::string millisecondsText(double milliseconds);  // "44.0 ms"
std::string errorText(double share);                // to full, in percent without the sign: "1.8", "< 0.001"
std::string percentText(double share);              // "1.8 %"
std::string decibelText(double decibel);            // "38.2 dB"
std::string fasterText(double ratio);               // "3.1 times faster than at full"
// "0.3 dB below full"
std::string againstFullText(double decibel, double full);

// Setting, figures and command in lines, not escaped.
std::string tooltip(const View& view, size_t point);

// HTML of a chosen point: its letter; its letter, name, setting and model.
std::string badge(const View& view, size_t point);
std::string heading(const View& view, size_t point);

} // namespace surflect::chart
