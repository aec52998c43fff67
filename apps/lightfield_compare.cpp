#include "apps/capture_argument.h"
#include "apps/lightfield_command.h"
#include "apps/model_options.h"
#include "apps/option_values.h"
#include "apps/terminal.h"
#include "apps/timed_renderer.h"
#include "render/evaluation/evaluate.h"
#include "surfel/base/folder.h"
#include "surfel/math/median.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace surflect {

namespace {

struct CompareArguments {
  std::vector<std::string> models;
  CaptureArgument views;
  bool nearest = false, train = false;
  render::RendererOptions options;
};

// Mean of a count over all frames; empty if the renderer does not report it.
std::optional<double> meanCount(const std::vector<render::FrameReport>& reports, const std::string& name) {
  double sum = 0;
  for (const render::FrameReport& report : reports) {
    const auto found = report.counts.find(name);
    if (found == report.counts.end()) return std::nullopt;
    sum += found->second;
  }
  return reports.empty() ? std::nullopt : std::optional(sum / static_cast<double>(reports.size()));
}

// Scores one model on the photographs of the views.
Json scored(const std::string& name, const std::filesystem::path& model,
            const render::RendererOptions& rendererOptions, const capture::Capture& views,
            const evaluation::EvaluateOptions& options, const Progress& progress) {
  TimedRenderer renderer(render::openRenderer(model, rendererOptions, progress));
  const evaluation::Evaluation evaluation =
      evaluation::evaluate(renderer, views, *warp::chainWarp({}), options, progress);
  evaluation::Score score;
  size_t invalidTexels = 0;
  for (const evaluation::FrameScore& frame : evaluation.frames) {
    score += frame.score;
    invalidTexels += frame.invalidTexels;
  }
  Json row = {{"name", name},
              {"psnr_linear_db", score.difference.psnrLinear()},
              {"psnr_srgb_db", score.difference.psnrSrgb()},
              {"ssim_srgb", score.difference.ssim()},
              {"ape_srgb", 255 * score.difference.absoluteErrorSrgb.mean()},
              {"alpha_error", score.difference.absoluteErrorAlpha.mean()},
              {"psnr_linear_interior_db", evaluation::psnr(score.interiorError.mean())},
              {"invalid_texels", invalidTexels},
              {"bytes", bytesIn(model)},
              {"frame_ms", 1e3 * median(renderer.seconds())}};
  if (const auto passes = meanCount(renderer.reports(), "passes")) row["passes"] = *passes;
  for (const evaluation::FrameScore& frame : evaluation.frames)
    row["frames"].push_back({{"camera", frame.camera},
                             {"psnr_linear_db", frame.score.difference.psnrLinear()},
                             {"psnr_srgb_db", frame.score.difference.psnrSrgb()},
                             {"ssim_srgb", frame.score.difference.ssim()}});
  return row;
}

void sayComparison(const Json& rows) {
  size_t width = 5;
  for (const Json& row : rows) width = std::max(width, row["name"].get<std::string>().size());
  say(fmt::format("{:<{}}  linear dB  interior  sRGB dB    SSIM       MiB  ms a frame  passes", "model",
                  width));
  for (const Json& row : rows)
    say(fmt::format("{:<{}}  {:>9.2f}  {:>8.2f}  {:>7.2f}  {:.4f}  {:>8}  {:>10.1f}  {:>6}",
                    row["name"].get<std::string>(), width, row["psnr_linear_db"].get<double>(),
                    row["psnr_linear_interior_db"].get<double>(), row["psnr_srgb_db"].get<double>(),
                    row["ssim_srgb"].get<double>(),
                    row.contains("bytes") ? fmt::format("{:.1f}", row["bytes"].get<double>() / (1 << 20))
                                          : "",
                    row["frame_ms"].get<double>(),
                    row.contains("passes") ? fmt::format("{:.0f}", row["passes"].get<double>()) : ""));
}

render::RendererOptions nearestOf(render::RendererOptions options) {
  options.nearest = true;
  return options;
}

Json runCompare(const CompareArguments& arguments, const Progress& progress) {
  const capture::Capture views = arguments.views.read();
  evaluation::EvaluateOptions options;
  options.split = arguments.train ? capture::Split::train : capture::Split::test;
  if (arguments.nearest)
    render::openRenderer(arguments.models.front(), nearestOf(arguments.options), progress);
  Json rows = Json::array();
  for (const std::string& model : arguments.models)
    rows.push_back(scored(model, model, arguments.options, views, options, progress));
  if (arguments.nearest) {
    rows.push_back(scored("nearest view", arguments.models.front(), nearestOf(arguments.options), views,
                          options, progress));
    rows.back().erase("bytes"); // the photographs', not the model's
  }
  sayComparison(rows);
  if (const size_t invalid = rows.front()["invalid_texels"].get<size_t>(); invalid > 0)
    say(fmt::format("{} texels of the photographs are NaN or infinite, and in no score", invalid));
  return {{"views", arguments.views.path},
          {"split", arguments.train ? "train" : "test"},
          {"models", std::move(rows)}};
}

} // namespace

void addLightFieldCompare(CLI::App& lightField, CommandWork& work) {
  auto arguments = std::make_shared<CompareArguments>();
  CLI::App* command = lightField.add_subcommand(
      "compare", "accuracy on held-out views, size and speed of light fields and other models");
  command->footer(
      "Example: surflect lightfield compare vase.srf vase.slf vase.lum --views views/ --nearest --json");
  command->add_option("models", arguments->models, "light fields and packed models of one object")
      ->required();
  command->add_option("--views", arguments->views.path, "capture under fixed light with held-out views")
      ->required();
  addAllowOutside(*command, arguments->views.outside);
  command->add_flag("--train", arguments->train,
                    "compare with the training views instead of the held-out ones");
  command->add_flag("--nearest", arguments->nearest,
                    "also the nearest view alone, by the first model, which must be a packed one");
  addModelOptions(*command, arguments->options);
  setWork(*command, work, "nothing was kept",
          [arguments](const Progress& progress) { return runCompare(*arguments, progress); });
}

} // namespace surflect
