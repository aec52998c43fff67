// A renderer that times its frames.
#pragma once

#include "render/method/renderer.h"
#include "surfel/base/time.h"

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace surflect::method {

class TimedRenderer : public Renderer {
public:
  explicit TimedRenderer(std::unique_ptr<Renderer> renderer) : renderer_(std::move(renderer)) {}

  const Description& describe() const override { return renderer_->describe(); }
  std::span<const Option> options() const override { return renderer_->options(); }
  EnvironmentReport prepare(const scene::ShotEnvironment& environment, const Progress& progress) override {
    return renderer_->prepare(environment, progress);
  }
  PhotographBlend blendedAt(const scene::Scene& scene, capture::Pixel pixel,
                            const Progress& progress) override {
    return renderer_->blendedAt(scene, pixel, progress);
  }
  FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                     const Progress& progress, FrameLayers memory) override {
    const Stopwatch watch;
    FrameLayers layers = renderer_->render(scene, aovs, progress, std::move(memory));
    seconds_.push_back(watch.seconds());
    reports_.push_back(layers.report);
    return layers;
  }

  bool keepBudget(std::optional<double> seconds) override { return renderer_->keepBudget(seconds); }

  // Time and report of each frame so far.
  const std::vector<double>& seconds() const { return seconds_; }
  const std::vector<FrameReport>& reports() const { return reports_; }

private:
  void configure(const Setting& setting) override { renderer_->set(setting); }

  std::unique_ptr<Renderer> renderer_;
  std::vector<double> seconds_;
  std::vector<FrameReport> reports_;
};

} // namespace surflect::method
