// Options that trade accuracy of a film for speed, and the settings of its frames that follow from them.
#pragma once

#include "apps/command.h"
#include "render/control/controller.h"
#include "render/film/shot_renderer.h"
#include "render/renderer.h"

#include <optional>
#include <set>
#include <string>

namespace surflect {

struct QualityOptions {
  std::optional<double> tolerance, budgetMs; // at most one of them
  bool isPreview = false, verifies = false;
  knobs::Setting knobs; // as given; the others follow from the options above
};

// Adds --knob, --quality, --tolerance, --budget-ms and --verify.
void addQualityOptions(CLI::App& command, QualityOptions& options);

class FilmQuality {
public:
  // Turns the renderer to the base setting: the knobs that are given, and for a preview those of
  // Renderer::preview(). Throws Error for a knob that the renderer lacks. The arguments must outlive the
  // object.
  FilmQuality(const QualityOptions& options, render::Renderer& renderer);

  // Text that follows the renderer's identity at the base setting in the identity of every frame. Under a
  // budget, which depends on a clock, the frame's setting follows this text.
  std::string identity() const;
  std::string identity(const knobs::Setting& setting) const;

  // Chooses the setting of a frame of the script, and turns the renderer to it.
  control::Choice turn(film::ShotRenderer& shot, const scene::Frames& frames, int frame, double scale);
  void turnToBase() { renderer_.turn(base_); }

  // Adds setting and errors to the report of a frame. With --verify renders it again, at full.
  void report(film::ShotRenderer& shot, int frame, double scale, const control::Choice& choice,
              const image::Image& color, Json& entry);
  // Adds totals to the report of the film.
  void report(Json& film) const;
  // Errors and settings of the film, to follow "rendered 5 frames to frames/"; empty without such options.
  std::string summary() const;

private:
  bool isControlled() const { return options_.tolerance || options_.budgetMs; }

  const QualityOptions& options_;
  render::Renderer& renderer_;
  knobs::Setting base_;
  std::optional<control::Controller> controller_;
  std::set<knobs::Setting> settings_;
  double chooseSeconds_ = 0, predictedError_ = 0, trueError_ = 0; // errors: the largest
  size_t frames_ = 0, within_ = 0, nearlyWithin_ = 0; // frames whose true error meets the tolerance
};

} // namespace surflect
