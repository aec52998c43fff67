#include "apps/film_quality.h"

#include "apps/method_options.h"
#include "render/control/knob_effects.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"

#include <fmt/format.h>

#include <algorithm>

namespace surflect {

namespace {

constexpr double kNearly = 1.2; // times the tolerance

} // namespace

void addQualityOptions(CLI::App& command, QualityOptions& options) {
  auto* tolerance =
      command
          .add_option(
              "--tolerance", options.tolerance,
              "choose faster settings while a frame's relative RMS error, against full, is at most this")
          ->check(finiteIn(0, 1));
  command
      .add_option("--budget-ms", options.budgetMs,
                  "choose the most accurate settings with which a frame takes at most so many milliseconds; "
                  "the film depends on the machine")
      ->check(finiteIn(0.01, 1e6))
      ->excludes(tolerance);
  command.add_flag("--verify", options.verifies,
                   "render each frame at full as well, and report its true error");
}

FilmQuality::FilmQuality(const QualityOptions& options, method::Setting base, method::Renderer& renderer)
    : options_(options), renderer_(renderer), base_(method::forFrames(renderer.options(), std::move(base))) {
  if (options_.budgetMs) keepsBudget_ = renderer_.keepBudget(1e-3 * *options_.budgetMs);
  setBase();
}

// Frames other than the film's do not count in a budget.
void FilmQuality::setBase() {
  renderer_.set(base_);
  if (keepsBudget_) renderer_.keepBudget(std::nullopt);
}

std::string FilmQuality::identity() const {
  if (options_.tolerance) return fmt::format(" tolerance {}", *options_.tolerance);
  if (options_.budgetMs) return fmt::format(" budget-ms {} setting ", *options_.budgetMs);
  return "";
}

std::string FilmQuality::identity(const method::Setting& setting) const {
  return identity() + (options_.budgetMs ? method::textOf(setting) : "");
}

control::Choice FilmQuality::choose(film::ShotRenderer& shot, const scene::Frames& frames, int frame,
                                    double scale) {
  control::Choice choice{base_, 0};
  if (isControlled()) {
    const Stopwatch watch;
    if (!controller_) {
      using Kind = control::Target::Kind;
      const control::Target target = options_.tolerance
                                         ? control::Target{Kind::tolerance, *options_.tolerance}
                                         : control::Target{Kind::milliseconds, *options_.budgetMs};
      const bool isTimed = target.kind == Kind::milliseconds; // with the AOVs, as the film's frames are
      controller_.emplace(
          renderer_,
          [=, &shot](int probed) {
            return isTimed ? shot.render(probed, scale) : shot.render(probed, scale, {});
          },
          control::FrameRange{frames.first, frames.last}, target, base_);
    }
    choice = controller_->choose(frame);
    chooseSeconds_ += watch.seconds();
  }
  renderer_.set(choice.setting);
  if (keepsBudget_) renderer_.keepBudget(1e-3 * *options_.budgetMs / shot.samples(frame));
  return choice;
}

void FilmQuality::report(film::ShotRenderer& shot, int frame, double scale, const control::Choice& choice,
                         const image::Image& color, Json& entry) {
  entry["setting"] = method::textOf(choice.setting);
  settings_.insert(choice.setting);
  ++frames_;
  if (isControlled()) {
    entry["predicted_error"] = choice.predictedError;
    predictedError_ = std::max(predictedError_, choice.predictedError);
  }
  if (!options_.verifies) return;
  renderer_.set(isControlled() ? base_ : method::Setting());
  if (keepsBudget_) renderer_.keepBudget(std::nullopt);
  const double error = control::relativeRms(color, shot.render(frame, scale, {}).color);
  entry["true_error"] = error;
  trueError_ = std::max(trueError_, error);
  within_ += error <= options_.tolerance.value_or(0);
  nearlyWithin_ += error <= kNearly * options_.tolerance.value_or(0);
}

void FilmQuality::report(Json& film) const {
  if (isControlled()) {
    film["probes"] = controller_ ? controller_->probes() : 0;
    film["seconds"]["choose"] = chooseSeconds_;
    film["predicted_error_most"] = predictedError_;
  }
  if (!options_.verifies) return;
  film["true_error_most"] = trueError_;
  if (!options_.tolerance) return;
  film["frames_within_tolerance"] = within_;
  film["frames_within_1.2_tolerance"] = nearlyWithin_;
}

std::string FilmQuality::summary() const {
  if (frames_ == 0) return "";
  std::string text;
  if (isControlled())
    text += fmt::format("; {}, chosen by {}; error at most {:.2g} as predicted",
                        counted(settings_.size(), "setting"),
                        counted(controller_ ? controller_->probes() : 0, "probe"), predictedError_);
  if (options_.verifies) {
    text += fmt::format("; true error at most {:.2g}", trueError_);
    if (options_.tolerance)
      text += fmt::format(", within {} in {} of {} frames and within {:.2g} in {}", *options_.tolerance,
                          within_, frames_, kNearly * *options_.tolerance, nearlyWithin_);
  }
  return text;
}

} // namespace surflect
