// Options that trade accuracy of a film for speed, and the settings of its frames that follow from them.
#pragma once

#include "apps/command.h"
#include "render/control/controller.h"
#include "render/film/shot_renderer.h"
#include "render/method/renderer.h"

#include <optional>
#include <set>
#include <string>

namespace surflect {

struct QualityOptions {
  std::optional<double> tolerance, budgetMs; // at most one of them
  bool verifies = false;
};

// Adds --tolerance, --budget-ms and --verify.
void addQualityOptions(CLI::App& command, QualityOptions& options);

class FilmQuality {
public:
  // Sets the renderer's options: `base` holds those that are given, or of a preset; a controller chooses
  // others. Throws Error for a setting that the renderer cannot take. Options and renderer must outlive the
  // object.
  FilmQuality(const QualityOptions& options, method::Setting base, method::Renderer& renderer);

  // Text that follows the renderer's identity at the base setting in the identity of every frame. Under a
  // budget, which depends on a clock, the frame's setting follows this text.
  std::string identity() const;
  std::string identity(const method::Setting& setting) const;

  // Chooses the setting of a frame of the script, and sets it, for that frame alone.
  control::Choice choose(film::ShotRenderer& shot, const scene::Frames& frames, int frame, double scale);
  void setBase();

  // Adds setting and errors to the report of a frame. With --verify renders it again, at full.
  void report(film::ShotRenderer& shot, int frame, double scale, const control::Choice& choice,
              const image::Image& color, Json& entry);
  // Adds totals to the report of the film.
  void report(Json& film) const;
  // Errors and settings of the film, to follow "rendered 5 frames to frames/"; empty without such options.
  std::string summary() const;

private:
  // By settings of frames; a renderer that keeps a budget by itself needs none.
  bool isControlled() const { return options_.tolerance || (options_.budgetMs && !keepsBudget_); }

  const QualityOptions& options_;
  method::Renderer& renderer_;
  method::Setting base_;
  bool keepsBudget_ = false;
  std::optional<control::Controller> controller_;
  std::set<method::Setting> settings_;
  double chooseSeconds_ = 0, predictedError_ = 0, trueError_ = 0; // errors: the largest
  size_t frames_ = 0, within_ = 0, nearlyWithin_ = 0; // frames whose true error meets the tolerance
};

} // namespace surflect
