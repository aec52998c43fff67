// Finished measurements of a chart, in a file, so that an interrupted chart goes on where it stopped.
#pragma once

#include "render/chart/chart.h"
#include "render/chart/settings.h"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::chart {

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
