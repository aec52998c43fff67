// A renderer that times its frames.
#pragma once

#include "render/renderer.h"
#include "surfel/base/stopwatch.h"

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace surflect {

class TimedRenderer : public render::Renderer {
public:
  explicit TimedRenderer(std::unique_ptr<render::Renderer> renderer) : renderer_(std::move(renderer)) {}

  const render::Description& describe() const override { return renderer_->describe(); }
  std::vector<knobs::Knob> knobs() const override { return renderer_->knobs(); }
  knobs::Setting preview() const override { return renderer_->preview(); }
  void turn(const knobs::Setting& setting) override { renderer_->turn(setting); }
  render::EnvironmentReport prepare(const scene::ShotEnvironment& environment,
                                    const Progress& progress) override {
    return renderer_->prepare(environment, progress);
  }
  render::FrameLayers render(const scene::Scene& scene, const std::vector<std::string>& aovs,
                             const Progress& progress, render::FrameLayers memory) override {
    const Stopwatch watch;
    render::FrameLayers layers = renderer_->render(scene, aovs, progress, std::move(memory));
    seconds_.push_back(watch.seconds());
    reports_.push_back(layers.report);
    return layers;
  }

  // Time and report of each frame so far.
  const std::vector<double>& seconds() const { return seconds_; }
  const std::vector<render::FrameReport>& reports() const { return reports_; }

private:
  std::unique_ptr<render::Renderer> renderer_;
  std::vector<double> seconds_;
  std::vector<render::FrameReport> reports_;
};

} // namespace surflect
