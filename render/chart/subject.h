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
double scaleOf(const knobs::Setting& setting);

// Turns a renderer's knobs; the scale is the chart's own. Throws Error for a value that cannot be taken.
void turn(render::Renderer& renderer, knobs::Setting setting);

class Subject {
public:
  // Options and measurements must outlive the object. Throws Error, also for knobs that the renderer lacks
  // and for values that it cannot take, and Cancelled.
  Subject(std::filesystem::path model, const capture::Capture& capture, const std::optional<BentTruth>& bent,
          const ChartOptions& options, Measurements& measurements, const Progress& progress);
  Subject(const Subject&) = delete;
  Subject& operator=(const Subject&) = delete;

  const std::filesystem::path& model() const { return model_; }
  const std::vector<knobs::Knob>& knobs() const { return knobs_; } // with the values to try
  const std::vector<knobs::Setting>& settings() const { return settings_; }
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
  bool isTimed(const knobs::Setting& setting) const;
  void keepTiming(const knobs::Setting& setting, const Timing& timing);

  // Result for a setting whose accuracy and time have been measured.
  Point pointOf(const knobs::Setting& setting) const;
  // Brightest frame at rest, and deformed, beside truth.
  std::vector<Panel> panels(const knobs::Setting& setting, render::Renderer& renderer,
                            const Progress& progress) const;

  std::unique_ptr<render::Renderer> open(const Progress& progress) const;

private:
  bool isGiven() const { return options_.onlyGiven || !options_.sweep.empty(); }
  void add(const knobs::Setting& setting);
  std::string keyOf(render::Renderer& renderer, const knobs::Setting& setting) const;
  std::string timingKey(const knobs::Setting& setting) const;
  const std::vector<image::Image>& fullPictures(const Progress& progress);
  Accuracy accuracyOf(const knobs::Setting& setting, const Progress& progress);
  Cost costOf(render::Renderer& renderer, const knobs::Setting& setting, const Progress& progress);
  Cost measuredCost(render::Renderer& renderer, const knobs::Setting& setting, const Progress& progress);
  void leaveOutIdle(const Progress& progress);
  template <class Visit> void forEachSample(Visit visit) const;

  std::filesystem::path model_;
  const ChartOptions& options_;
  Measurements& measurements_;
  capture::Capture rig_;
  std::vector<knobs::Knob> all_, knobs_; // of the renderer; those that are swept
  knobs::Setting preview_;
  std::vector<knobs::Setting> settings_;
  std::vector<std::string> idle_;
  std::map<knobs::Setting, std::string> keys_;
  std::optional<Samples> rest_, bent_;
  std::string deformation_; // names the warp of the bent samples
  std::vector<image::Image> full_;
};

} // namespace surflect::chart
