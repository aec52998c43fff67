// Charts of speed against accuracy: renders held-out frames of a capture with many settings of the knobs, and
// measures the pictures and their time. Speaks to renderers through render/method alone.
#pragma once

#include "render/chart/chart.h"
#include "render/method/renderer.h"
#include "srf/capture/capture.h"
#include "surfel/base/time.h"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::chart {

// Knob that every chart has: the size of the rendered picture, which is enlarged before it is compared.
inline constexpr const char* kScale = "scale";

// Photographs of the object deformed by the warps of a script at one of its frames.
struct BentTruth {
  capture::Capture capture;
  std::filesystem::path script;
  double frame = 1;
};

struct ChartOptions {
  std::map<std::string, method::Setting> settings = {}; // of all frames, by method; not swept
  // Options to sweep, in all combinations. Empty: every knob alone, the preview, and a greedy descent; or,
  // with onlyGiven, the most accurate setting alone.
  std::vector<method::Sweep> sweep = {};
  bool onlyGiven = false;   // leaves out the most accurate values that `sweep` does not name
  size_t frames = 12;       // most held-out photographs at rest, and as many deformed
  size_t timedFrames = 4;   // most frames at rest that are timed
  size_t rounds = 5;        // rounds of timing
  size_t descentSteps = 20; // most steps of the greedy descent
  std::string machine;      // Chart::machine
  std::string command;      // Chart::command
  // Command that makes a chart of one setting of a model.
  std::function<std::string(const std::filesystem::path& model, const method::Setting& setting)> commandOf;
  std::function<void(std::string_view line)> announce; // tells people what will be measured
};

// Makes a chart of models that were packed of the capture. Finished measurements are kept in the folder,
// which exists, and are not made again. All settings are timed in turn, round by round, so that a slow phase
// of the machine meets all alike. Throws Error, also for knobs that a renderer lacks, and Cancelled.
Chart makeChart(const std::vector<std::filesystem::path>& models, const capture::Capture& capture,
                const std::optional<BentTruth>& bent, const std::filesystem::path& folder,
                const ChartOptions& options, const Progress& progress);

// Files of a chart, for programs.

// A table with one row per point; names of columns end in their unit. Figures that a point lacks are empty.
std::string csvOf(const Chart& chart);

// Everything but the pictures.
std::string jsonOf(const Chart& chart);

// Writes chart.csv, chart.json and index.html, each atomically, into a folder that exists. Throws Error.
void writeChart(const Chart& chart, const std::filesystem::path& folder);

} // namespace surflect::chart
