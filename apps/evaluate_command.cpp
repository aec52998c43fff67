#include "apps/command.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "render/evaluation/diagnostics.h"
#include "render/evaluation/evaluate.h"
#include "render/evaluation/true_frames.h"
#include "render/method/timed_renderer.h"
#include "render/scene/scene.h"
#include "surfel/math/median.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

namespace surflect {

namespace {

struct EvaluateArguments {
  std::vector<std::string> models;
  std::string script, split = "test";
  CaptureArgument capture;
  std::vector<std::string> baselines;
  bool confidence = false;
  double frame = 1;
  MethodOptions options;
};

// Keys of the report by the names of baselines.
const std::map<std::string, std::string> kBaselines = {{"nearest", "baseline"},
                                                       {"lambert", "baseline_lambert"}};

Json scoreJson(const evaluation::Score& score) {
  return {{"psnr_linear_db", score.difference.psnrLinear()},
          {"psnr_srgb_db", score.difference.psnrSrgb()},
          {"ssim_srgb", score.difference.ssim()},
          {"psnr_linear_interior_db", evaluation::psnr(score.interiorError.mean())},
          {"truth_noise_db", evaluation::psnr(score.truthNoise.mean())},
          {"ape_srgb", 255 * score.difference.absoluteErrorSrgb.mean()},
          {"alpha_error", score.difference.absoluteErrorAlpha.mean()},
          {"frame_count", score.frames}};
}

// Scores pooled over all frames and by group; front- and back-lit frames form groups of their own.
Json summaryOf(const evaluation::Evaluation& evaluation,
               const std::function<const evaluation::Score&(const evaluation::FrameScore&)>& scoreOf) {
  evaluation::Score all;
  std::map<std::string, evaluation::Score> groups;
  for (const evaluation::FrameScore& frame : evaluation.frames) {
    all += scoreOf(frame);
    groups[frame.group] += scoreOf(frame);
    if (frame.frontLit) groups[*frame.frontLit ? "front_lit" : "back_lit"] += scoreOf(frame);
  }
  Json json = scoreJson(all);
  for (const auto& [group, score] : groups) json["groups"][group] = scoreJson(score);
  return json;
}

double rootMeanSquare(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

// How well predicted errors order the tiles of all frames, and how large they are beside the true ones. A
// correlation is null where there is no order, as all tiles have one error.
Json confidenceJson(const evaluation::Evaluation& evaluation) {
  constexpr size_t kSteps = 20;
  evaluation::TileErrors tiles;
  for (const evaluation::FrameScore& frame : evaluation.frames) tiles += frame.tiles;
  const evaluation::TileErrors relative = evaluation::relativeErrors(tiles);
  const auto correlation = [](const std::vector<double>& measured, const std::vector<double>& prediction) {
    const auto rank = evaluation::rankCorrelation(measured, prediction);
    return rank ? Json(*rank) : Json();
  };
  const evaluation::Sparsification curves = evaluation::sparsify(tiles.measured, tiles.predicted, kSteps);
  return {{"tiles", tiles.measured.size()},
          {"rank_correlation", correlation(tiles.measured, tiles.predicted)},
          {"rank_correlation_of_brightness", correlation(tiles.measured, tiles.brightness)},
          {"rank_correlation_relative", correlation(relative.measured, relative.predicted)},
          {"measured_rms", rootMeanSquare(tiles.measured)},
          {"predicted_rms", rootMeanSquare(tiles.predicted)},
          {"sparsification_error", evaluation::sparsificationError(curves)},
          {"rms_left", {{"by_prediction", curves.byPrediction}, {"best", curves.best}}}};
}

void sayConfidence(const Json& json) {
  const Json& correlation = json["rank_correlation"];
  say(fmt::format("confidence: rank correlation {} with the true error over {} tiles; predicted error {:.4f} "
                  "of white, true {:.4f}",
                  correlation.is_null() ? "none" : fmt::format("{:.3f}", correlation.get<double>()),
                  json["tiles"].get<size_t>(), json["predicted_rms"].get<double>(),
                  json["measured_rms"].get<double>()));
}

void sayTable(const Json& report) {
  const auto row = [](const std::string& name, const Json& score) {
    say(fmt::format("{:<12} {:>6} frames   linear {:6.2f} dB (interior {:6.2f})   sRGB {:6.2f} dB   SSIM "
                    "{:.4f}   alpha {:.4f}",
                    name, score["frame_count"].get<size_t>(), score["psnr_linear_db"].get<double>(),
                    score["psnr_linear_interior_db"].get<double>(), score["psnr_srgb_db"].get<double>(),
                    score["ssim_srgb"].get<double>(), score["alpha_error"].get<double>()));
  };
  const auto table = [&](const std::string& title, const Json& summary) {
    row(title, summary);
    for (const auto& [group, score] : summary["groups"].items()) row("  " + group, score);
  };
  table("surflect", report);
  for (const auto& [name, key] : kBaselines)
    if (report.contains(key)) table(name, report[key]);
}

// Mean of a count over all frames; null if the renderer does not report it.
Json meanCount(const std::vector<method::FrameReport>& reports, const std::string& name) {
  double sum = 0;
  for (const method::FrameReport& report : reports) {
    const auto found = report.counts.find(name);
    if (found == report.counts.end()) return {};
    sum += found->second;
  }
  return reports.empty() ? Json() : Json(sum / static_cast<double>(reports.size()));
}

// Several models, a line each.
void sayComparison(const Json& rows) {
  size_t width = 5;
  for (const Json& row : rows) width = std::max(width, row["model"].get<std::string>().size());
  say(fmt::format("{:<{}}  linear dB  interior  sRGB dB    SSIM       MiB  ms a frame  passes", "model",
                  width));
  for (const Json& row : rows)
    say(fmt::format("{:<{}}  {:>9.2f}  {:>8.2f}  {:>7.2f}  {:.4f}  {:>8.1f}  {:>10.1f}  {:>6}",
                    row["model"].get<std::string>(), width, row["psnr_linear_db"].get<double>(),
                    row["psnr_linear_interior_db"].get<double>(), row["psnr_srgb_db"].get<double>(),
                    row["ssim_srgb"].get<double>(), row["model_bytes"].get<double>() / (1 << 20),
                    row["frame_ms"].get<double>(),
                    row["passes"].is_null() ? "" : fmt::format("{:.0f}", row["passes"].get<double>())));
}

// Scores of one model.
// `photographs` returns the capture, once the model is open.
Json evaluated(const EvaluateArguments& arguments, const std::string& model, const method::Setting& setting,
               const std::function<const capture::Capture&()>& photographs, const Progress& progress) {
  method::TimedRenderer timed(method::openRenderer(model, setting, progress));
  const capture::Capture& capture = photographs();
  method::Renderer* const renderer = &timed;
  evaluation::EvaluateOptions options;
  warp::WarpPointer warp = warp::chainWarp({});
  const capture::Capture& rig = renderer->describe().rig;
  if (!arguments.script.empty()) {
    const scene::Script script = scene::readScript(arguments.script, rig.origin);
    const warp::ShotTime time = scene::shotTime(script, arguments.frame);
    warp = scene::warpAt(script, time);
    if (!rig.lights.empty() &&
        std::ranges::any_of(capture.frames, [](const auto& frame) { return !frame.light; }))
      options.lights = scene::lightsAt(script, time, scene::readEnvironments(script, progress));
  }
  options.split = arguments.split == "train" ? capture::Split::train : capture::Split::test;
  const auto isAsked = [&](const char* baseline) {
    return std::ranges::count(arguments.baselines, baseline) > 0;
  };
  options.lambert = isAsked("lambert");
  if (options.lambert && !arguments.script.empty())
    throw Error("the Lambert baseline does not bend: no --script with it");
  options.confidence = arguments.confidence;
  std::unique_ptr<method::Renderer> nearest;
  if (isAsked("nearest")) {
    if (renderer->describe().isBaked)
      throw Error("a light field has no nearest photograph: only surfels have").in(model);
    method::Setting nearestSetting = setting;
    nearestSetting["interpolation"] = "nearest";
    for (const char* dependent : {"reciprocity", "shadows"}) nearestSetting.erase(dependent);
    nearest = method::openRenderer(model, nearestSetting, progress);
    options.others["nearest"] = nearest.get();
  }
  std::vector<std::string> mismatches = evaluation::rigMismatches(renderer->describe(), capture);
  const evaluation::Evaluation evaluation =
      evaluation::evaluate(*renderer, capture, *warp, options, progress);
  if (auto mismatch = evaluation::silhouetteMismatch(evaluation)) mismatches.push_back(std::move(*mismatch));

  Json report = {{"model", model},
                 {"method", renderer->describe().method},
                 {"options", jsonOf(setting)},
                 {"exposure", evaluation.exposure},
                 {"model_bytes", method::modelBytes(model)},
                 {"frame_ms", 1e3 * median(timed.seconds())},
                 {"passes", meanCount(timed.reports(), "passes")}};
  report.update(summaryOf(evaluation, [](const evaluation::FrameScore& frame) -> const evaluation::Score& {
    return frame.score;
  }));
  for (const auto& name : arguments.baselines)
    report[kBaselines.at(name)] =
        summaryOf(evaluation, [&](const evaluation::FrameScore& frame) -> const evaluation::Score& {
          return frame.others.at(name);
        });
  size_t invalidTexels = 0;
  for (const evaluation::FrameScore& frame : evaluation.frames) {
    invalidTexels += frame.invalidTexels;
    Json entry = {{"camera", frame.camera},
                  {"light", frame.light},
                  {"group", frame.group},
                  {"mask_iou", frame.maskIou}};
    if (frame.frontLit) entry["lit"] = *frame.frontLit ? "front" : "back";
    entry.update(scoreJson(frame.score));
    for (const auto& [name, score] : frame.others) entry[kBaselines.at(name)] = scoreJson(score);
    report["frames"].push_back(std::move(entry));
  }
  report["invalid_texels"] = invalidTexels;
  report["mismatches"] = mismatches;
  const size_t unknown = capture.frames.size() - evaluation::withKnownObject(capture).frames.size();
  report["photographs_without_mask"] = unknown;
  if (arguments.confidence) report["predicted_error"] = confidenceJson(evaluation);
  if (arguments.models.size() == 1) sayTable(report);
  if (arguments.confidence) sayConfidence(report["predicted_error"]);
  for (const std::string& mismatch : mismatches) say(fmt::format("warning: {}: {}", model, mismatch));
  if (unknown > 0)
    say(fmt::format("{} photographs have no mask, as others have, and are in no score", unknown));
  if (invalidTexels > 0)
    say(fmt::format("{} texels of the photographs are NaN or infinite, and in no score", invalidTexels));
  return report;
}

Json runEvaluate(const EvaluateArguments& arguments, const Progress& progress) {
  if (arguments.capture.path.empty()) throw UsageError(Error("give one or more models, then a capture"));
  std::vector<const method::Method*> methods;
  for (const std::string& model : arguments.models) methods.push_back(&method::methodOfModel(model));
  const std::map<std::string, method::Setting> settings = arguments.options.settingsFor(methods);
  std::optional<capture::Capture> capture;
  const auto photographs = [&]() -> const capture::Capture& {
    return capture ? *capture : capture.emplace(arguments.capture.read());
  };
  Json reports = Json::array();
  for (size_t i = 0; i < methods.size(); ++i)
    reports.push_back(
        evaluated(arguments, arguments.models[i], settings.at(methods[i]->tag), photographs, progress));
  if (reports.size() == 1) return reports.front();
  sayComparison(reports);
  return {{"capture", arguments.capture.path}, {"split", arguments.split}, {"models", std::move(reports)}};
}

} // namespace

void addEvaluateCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* command =
      app.add_subcommand("evaluate", "compare renderings of models with a capture's photographs");
  command->footer("Example: surflect evaluate vase.srf examples/vase --baseline nearest --json\n"
                  "         surflect evaluate vase.slf vase.lfm vase.lfm/views");
  command
      ->add_option_function<std::vector<std::string>>(
          "paths",
          [arguments](const std::vector<std::string>& paths) {
            arguments->models.assign(paths.begin(), paths.end() - (paths.size() > 1 ? 1 : 0));
            arguments->capture.path = paths.size() > 1 ? paths.back() : "";
          },
          "one or more models of one object, then a capture with its photographs")
      ->option_text("MODEL... CAPTURE")
      ->required();
  addAllowOutside(*command, arguments->capture.outside);
  command->add_option("--split", arguments->split, "which photographs")
      ->capture_default_str()
      ->check(oneOf({"test", "train"}));
  command
      ->add_option(
          "--baseline", arguments->baselines,
          "also score simpler renderings: nearest (no interpolation), lambert (a matte surface fitted to the "
          "same camera's photographs), or nearest,lambert")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(oneOf({"nearest", "lambert"}));
  command->add_flag("--predicted-error", arguments->confidence,
                    "also compare the AOV predicted_error with the true errors");
  CLI::Option* script = command->add_option(
      "--script", arguments->script,
      "warps that the photographed object went through, and lights of photographs that name none");
  command->add_option("--frame", arguments->frame, "frame of the script")
      ->capture_default_str()
      ->check(frameNumber())
      ->needs(script);
  addSimd(*command);
  arguments->options.add(*command, MethodOptions::Kind::render, [arguments] {
    return arguments->models.empty() ? nullptr : methodAt(arguments->models.front());
  });
  setWork(*command, work, "nothing was kept",
          [arguments](const Progress& progress) { return runEvaluate(*arguments, progress); });
}

} // namespace surflect
