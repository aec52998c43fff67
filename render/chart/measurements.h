// Finished measurements of a chart, in a file, so that an interrupted chart goes on where it stopped.
#pragma once

#include "render/chart/chart.h"
#include "render/method/option.h"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::chart {

// Settings that a chart tries.

// The setting without knobs that have their most accurate value, so that equal settings compare equal.
method::Setting withoutFull(std::span<const method::Option> knobs, method::Setting setting);

// Every combination of the knobs' values; each setting names every knob.
std::vector<method::Setting> combinations(std::span<const method::Option> knobs);

// Every value of every knob while the others have their most accurate values. The first setting has all knobs
// at their most accurate values.
std::vector<method::Setting> oneByOne(std::span<const method::Option> knobs);

struct Cost {
  double work = 0;  // of a frame, in any unit
  double error = 0; // against the most accurate setting
};
// Greedy descent from the most accurate setting. Each step moves one knob to its next value: the knob that
// saves most work for the error that it adds. Ends when no step saves 2 % of the work, or after `most` steps.
// Returns the settings that it passes, without the first. `cost` is called once for each setting that is
// compared.
std::vector<method::Setting> descent(std::span<const method::Option> knobs, size_t most,
                                     const std::function<Cost(const method::Setting&)>& cost);

// The largest number of steps that descent() can take.
size_t longestDescent(std::span<const method::Option> knobs, size_t most);

struct Accuracy {
  Agreement rest;
  std::optional<Agreement> bent;
  double rmsToFull = 0;
  double bytesRead = 0;
  size_t memoryBytes = 0;
};

struct Timing {
  double milliseconds = 0;
  std::map<std::string, double> stages; // milliseconds
};

// One JSON object a line: { "of": key, "accuracy" or "timing" or "cost": { .. } }. A key names everything
// that the figures depend on. Lines that cannot be understood are dropped: their measurements are made again.
class Measurements {
public:
  // Reads the file if there is one. Throws Error if it cannot be read.
  explicit Measurements(std::filesystem::path file);

  std::optional<Accuracy> accuracy(const std::string& key) const;
  std::optional<Timing> timing(const std::string& key) const;
  std::optional<Cost> cost(const std::string& key) const;

  // Keep a measurement: the file is replaced as a whole. Throw Error.
  void keep(const std::string& key, const Accuracy& accuracy);
  void keep(const std::string& key, const Timing& timing);
  void keep(const std::string& key, const Cost& cost);

private:
  const std::string* find(std::string_view kind, const std::string& key) const;
  void keep(const char* kind, const std::string& key, std::string json);

  std::filesystem::path file_;
  struct Line {
    std::string kind, key, json;
  };
  std::vector<Line> lines_; // in the order of measurement
};

} // namespace surflect::chart
