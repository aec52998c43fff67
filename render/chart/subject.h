// A model of a chart: the settings to try, and what their pictures are compared with.
#pragma once

#include "render/chart/make_chart.h"
#include "render/chart/measurements.h"
#include "render/chart/samples.h"

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace surflect::chart {

// Size of the rendered picture that a setting asks for, as a share of the size of the photograph.
double scaleOf(const method::Setting& setting);

// The chart's own option: the scale.
const method::Option& scaleOption();

class Subject {
public:
  // Options and measurements must outlive the object. Throws Error, also for knobs that the renderer lacks
  // and for values that it cannot take, and Cancelled.
  Subject(std::filesystem::path model, const capture::Capture& capture, const std::optional<BentTruth>& bent,
          const ChartOptions& options, Measurements& measurements, const Progress& progress);
  Subject(const Subject&) = delete;
  Subject& operator=(const Subject&) = delete;

  const std::filesystem::path& model() const { return model_; }
  // Options of the model, whether they are swept or not.
  const std::vector<method::Option>& options() const { return all_; }
  const std::vector<method::Option>& knobs() const { return knobs_; } // with the values to try
  const std::vector<method::Setting>& settings() const { return settings_; }
  // As evaluation::rigMismatches says, of the model and the capture.
  const std::vector<std::string>& mismatches() const { return mismatches_; }
  const Samples& rest() const { return *rest_; }
  const std::optional<Samples>& bent() const { return bent_; }

  // Most settings that descend() adds; 0 if the settings are given, or if there is a single knob.
  size_t longestDescent() const;
  // Adds the settings of a greedy descent by estimated work, so that equal pictures give equal settings.
  void descend(const Progress& progress);

  // Measures the pictures of all settings that are not known. `done` is called after each setting. Then
  // leaves out the settings of idle knobs, unless the settings are given.
  void measureAccuracy(const std::function<void()>& done, const Progress& progress);
  // Names of knobs none of whose values, with all others at full, changes a picture, or the work of the timed
  // frames.
  const std::vector<std::string>& idleKnobs() const { return idle_; }

  size_t timedFrames() const;
  const Sample& timed(size_t i) const; // one of the timed frames, which are spread over the frames at rest
  bool isTimed(const method::Setting& setting) const;
  void keepTiming(const method::Setting& setting, const Timing& timing);

  // Result for a setting whose accuracy and time have been measured.
  Point pointOf(const method::Setting& setting) const;
  // Brightest frame at rest, and deformed, beside truth.
  std::vector<Panel> panels(const method::Setting& setting, method::Renderer& renderer,
                            const Progress& progress) const;

  std::unique_ptr<method::Renderer> open(const Progress& progress) const;
  // Sets a renderer's options, but for the scale. Throws Error for a value that cannot be taken.
  void set(method::Renderer& renderer, method::Setting setting) const;

private:
  bool isGiven() const { return options_.onlyGiven || !options_.sweep.empty(); }
  void add(const method::Setting& setting);
  std::string keyOf(method::Renderer& renderer, const method::Setting& setting) const;
  std::string timingKey(const method::Setting& setting) const;
  const std::vector<image::Image>& fullPictures(const Progress& progress);
  Accuracy accuracyOf(const method::Setting& setting, const Progress& progress);
  Cost costOf(method::Renderer& renderer, const method::Setting& setting, const Progress& progress);
  Cost measuredCost(method::Renderer& renderer, const method::Setting& setting, const Progress& progress);
  void leaveOutIdle(const Progress& progress);
  template <class Visit> void forEachSample(Visit visit) const;

  std::filesystem::path model_;
  const ChartOptions& options_;
  method::Setting held_; // options that are not swept
  Measurements& measurements_;
  capture::Capture rig_;
  std::vector<std::string> mismatches_;
  std::vector<method::Option> all_, knobs_; // of the renderer; those that are swept
  method::Setting preview_;
  std::vector<method::Setting> settings_;
  std::vector<std::string> idle_;
  std::map<method::Setting, std::string> keys_;
  std::optional<Samples> rest_, bent_;
  std::string deformation_; // names the warp of the bent samples
  std::vector<image::Image> full_;
};

} // namespace surflect::chart
