#include "apps/command.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "render/evaluation/evaluate.h"
#include "render/film/shot_renderer.h"
#include "render/surfels/surfel_method.h"
#include "render/verify/block_checks.h"
#include "render/verify/model_checks.h"
#include "render/verify/page.h"
#include "srf/image/png.h"
#include "srf/model/manifest.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"

#include <fmt/format.h>

#include <charconv>
#include <memory>

namespace surflect {

namespace {

struct VerifyArguments {
  std::string model, script, output;
  CaptureArgument capture;
  std::optional<int> frame;
  size_t frames = 5, photographs = 24;
  verify::Bounds bounds;
  MethodOptions options;
};

Json placeJson(const verify::FlaggedPlace& place) {
  Json json = {{"surfel", place.surfel},
               {"rest", {place.rest[0], place.rest[1], place.rest[2]}},
               {"figure", place.figure}};
  if (place.pixel) json["pixel"] = {place.pixel->x, place.pixel->y};
  return json;
}

Json checksJson(std::span<const verify::Check> checks) {
  Json list = Json::array();
  for (const verify::Check& check : checks) {
    Json entry = {{"name", check.rule->name}, {"verdict", nameOf(check.verdict)}};
    if (check.verdict != verify::Verdict::inapplicable) {
      entry["figure"] = check.figure;
      if (!check.rule->unit.empty()) entry["unit"] = check.rule->unit;
    }
    if (check.bound) entry["bound"] = *check.bound;
    entry["finding"] = check.finding;
    if (check.verdict == verify::Verdict::broken) entry["advice"] = check.rule->advice;
    for (const verify::FlaggedPlace& place : check.places) entry["places"].push_back(placeJson(place));
    list.push_back(std::move(entry));
  }
  return list;
}

Json picturesJson(const verify::Exactness& exactness) {
  Json list = Json::array();
  for (const verify::ExactPicture& picture : exactness.pictures)
    list.push_back({{"camera", picture.camera},
                    {"light", picture.light},
                    {"psnr_linear_db", picture.psnrLinearDb},
                    {"psnr_linear_interior_db", picture.psnrInteriorDb},
                    {"psnr_srgb_db", picture.psnrSrgbDb},
                    {"ssim_srgb", picture.ssim}});
  return list;
}

// Broken checks first, with what to do.
void sayChecks(const std::string& title, std::span<const verify::Check> checks) {
  for (const verify::Check& check : checks) {
    if (check.verdict != verify::Verdict::broken) continue;
    say(fmt::format("{}: {}: {} (bound: {} {})", title, check.rule->name, check.finding,
                    check.rule->isLeast ? "at least" : "at most", figureText(*check.rule, *check.bound)));
    if (!check.places.empty()) {
      const verify::FlaggedPlace& place = check.places.front();
      say(fmt::format("    for example surfel {} at ({:.4g}, {:.4g}, {:.4g}){}", place.surfel, place.rest[0],
                      place.rest[1], place.rest[2],
                      place.pixel ? fmt::format(", pixel ({:.0f}, {:.0f})", place.pixel->x, place.pixel->y)
                                  : ""));
    }
    say(fmt::format("    {}", check.rule->advice));
  }
}

void writeOverlay(const std::filesystem::path& path, const image::Image& overlay) {
  image::writePng(path, overlay, 8, image::PngColors::srgb);
}

std::vector<int> chosenFrames(const VerifyArguments& arguments, const scene::Frames& frames) {
  if (arguments.frame) {
    if (*arguments.frame < frames.first || *arguments.frame > frames.last)
      throw Error::mismatch(fmt::format("a frame within {}-{}", frames.first, frames.last),
                            std::to_string(*arguments.frame))
          .at("--frame");
    return {*arguments.frame};
  }
  std::vector<int> chosen;
  const auto most = static_cast<int>(std::min<size_t>(arguments.frames, 1000000));
  const int count = std::min(frames.count(), most);
  for (int i = 0; i < count; ++i)
    chosen.push_back(frames.first + (count > 1 ? (frames.count() - 1) * i / (count - 1) : 0));
  return chosen;
}

std::vector<verify::FrameReport> verifyFrames(const VerifyArguments& arguments,
                                              std::shared_ptr<const model::Model> model,
                                              surfels::SurfelRenderer& renderer, const Progress& progress) {
  scene::Script script = scene::readScript(arguments.script, model->rig.origin);
  if (script.model.empty()) script.model = arguments.model;
  scene::requireShot(script);
  const std::vector<int> frames = chosenFrames(arguments, *script.frames);
  const film::ShotRenderer shot(script, renderer, progress);
  const surfels::FrameOptions options =
      surfels::frameOptions(arguments.options.settingFor(surfels::surfelMethod()));
  surfels::FrameWorkspace workspace(*model, size_t{1} << 30);
  std::vector<verify::FrameReport> reports;
  for (size_t i = 0; i < frames.size(); ++i) {
    progress("frames", static_cast<double>(i) / static_cast<double>(frames.size()));
    const warp::ShotTime time = scene::shotTime(script, frames[i]);
    const warp::WarpPointer warp = scene::warpAt(script, time);
    const scene::Scene scene{*warp, shot.camera(frames[i], 1),
                             scene::lightsAt(script, time, shot.environments())};
    reports.push_back(
        {frames[i], verify::frameChecks(*model, scene, options, workspace, arguments.bounds, progress)});
    if (arguments.output.empty()) continue;
    image::Image& overlay = reports.back().findings.overlay;
    writeOverlay(std::filesystem::path(arguments.output) / verify::overlayName(frames[i]), overlay);
    overlay = {};
  }
  progress("frames", 1);
  return reports;
}

Json reportJson(const verify::Report& report) {
  Json json = {{"out_of_bounds", report.broken()},
               {"model", checksJson(report.model)},
               {"exactness", checksJson(report.exactness.checks)},
               {"photographs_of", report.exactness.isOfCapture ? "capture" : "model"},
               {"photographs", picturesJson(report.exactness)},
               {"frames", Json::array()}};
  for (const verify::FrameReport& frame : report.frames)
    json["frames"].push_back({{"frame", frame.frame}, {"checks", checksJson(frame.findings.checks)}});
  return json;
}

Json runVerify(const VerifyArguments& arguments, const std::string& command, const Progress& progress) {
  if (const std::string format = model::formatOf(arguments.model);
      !format.empty() && format != model::kSurfelFormat)
    throw Error::mismatch(fmt::format("\"{}\": `evaluate` measures light fields", model::kSurfelFormat),
                          "\"" + format + "\"")
        .at("format")
        .in(std::filesystem::path(arguments.model) / model::kManifestFile);
  const method::Setting setting = arguments.options.settingFor(surfels::surfelMethod());
  if (!arguments.output.empty()) requireCreatable(arguments.output);
  const auto model = std::make_shared<const model::Model>(model::openModel(arguments.model, progress));
  std::optional<capture::Capture> capture;
  if (!arguments.capture.path.empty()) capture = arguments.capture.read();
  if (!arguments.output.empty()) createFolder(arguments.output);
  const capture::Capture* photographs = capture ? &*capture : nullptr;
  const weights::ShadeOptions shade = surfels::frameOptions(setting).shade;
  surfels::SurfelRenderer renderer(model, setting);
  if (capture)
    for (const std::string& mismatch : evaluation::rigMismatches(renderer.describe(), *capture))
      say("warning: " + mismatch);

  verify::Report report;
  report.title = folderName(arguments.model);
  report.command = command;
  report.model = verify::modelChecks(*model, shade, arguments.bounds, progress);
  std::ranges::copy(verify::blockChecks(*model, photographs, arguments.bounds, progress),
                    std::back_inserter(report.model));
  report.exactness = verify::exactnessOf(*model, renderer, shade, photographs, arguments.photographs,
                                         arguments.bounds, progress);
  if (!arguments.script.empty()) report.frames = verifyFrames(arguments, model, renderer, progress);

  sayChecks("model", report.model);
  sayChecks("model", report.exactness.checks);
  for (const verify::FrameReport& frame : report.frames)
    sayChecks(fmt::format("frame {}", frame.frame), frame.findings.checks);
  for (const verify::Check& check : report.exactness.checks)
    if (check.verdict == verify::Verdict::kept) say(fmt::format("{}: {}", check.rule->name, check.finding));
  const Json json = reportJson(report);
  if (!arguments.output.empty()) {
    const std::filesystem::path folder = arguments.output;
    writeFileAtomically(folder / "verify.json",
                        json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
    writeFileAtomically(folder / "index.html", verify::pageOf(report));
    say(fmt::format("open {}", (folder / "index.html").string()));
  }
  if (const size_t broken = report.broken())
    throw FailedReport(counted(broken, "check") + (broken == 1 ? " is" : " are") + " out of bounds", json);
  say(fmt::format("everything is within bounds: {}, {}",
                  counted(report.model.size() + report.exactness.checks.size(), "check"),
                  counted(report.frames.size(), "frame")));
  return json;
}

verify::Bounds::value_type parseBound(const std::string& text) {
  const size_t equals = text.find('=');
  double bound = 0;
  const char* const end = text.data() + text.size();
  if (equals == std::string::npos || equals == 0 ||
      std::from_chars(text.data() + equals + 1, end, bound).ptr != end || equals + 1 == text.size())
    throw CLI::ValidationError("--bound", "found '" + text + "', expected NAME=NUMBER");
  return {text.substr(0, equals), bound};
}

} // namespace

void addVerifyCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<VerifyArguments>();
  CLI::App* command =
      app.add_subcommand("verify", "check a model and the frames of a script against the contract");
  command->footer("Example: surflect verify vase.srf examples/vase.toml --capture examples/vase -o report/");
  command->add_option("model", arguments->model, "a packed model")->required();
  command->add_option("script", arguments->script, "TOML: frames to check, too");
  command->add_option("-o,--output", arguments->output, "folder for a page with a picture a frame")
      ->check(notEmpty());
  command->add_option(
      "--capture", arguments->capture.path,
      "the capture that was packed: compare with its photographs, and measure errors of blocks");
  addAllowOutside(*command, arguments->capture.outside);
  command->add_option("--frames", arguments->frames, "frames of the script, at most, evenly spread")
      ->capture_default_str()
      ->check(CLI::Range(size_t{1}, size_t{1000000}));
  command->add_option("--frame", arguments->frame, "this frame alone")->check(wholeIn(0, 1000000));
  command->add_option("--photographs", arguments->photographs, "own photographs to render, at most")
      ->capture_default_str()
      ->check(CLI::Range(size_t{1}, size_t{1000000}));
  command
      ->add_option_function<std::vector<std::string>>(
          "--bound",
          [arguments](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              const auto [name, bound] = parseBound(text);
              arguments->bounds[name] = bound;
            }
            try {
              verify::requireBounds(arguments->bounds);
            } catch (const Error& error) {
              throw CLI::ValidationError(error.what());
            }
          },
          "another bound of a check, such as unseen=5")
      ->allow_extra_args(false)
      ->option_text("NAME=NUMBER ...");
  addSimd(*command);
  arguments->options.add(*command, MethodOptions::Kind::render, [] { return &surfels::surfelMethod(); });
  setWork(*command, work, "nothing was kept", [arguments](const Progress& progress) {
    std::string text = "surflect verify " + arguments->model;
    if (!arguments->script.empty()) text += " " + arguments->script;
    if (!arguments->capture.path.empty()) text += " --capture " + arguments->capture.path;
    return runVerify(*arguments, text, progress);
  });
}

} // namespace surflect
