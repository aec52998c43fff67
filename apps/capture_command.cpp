#include "apps/command.h"
#include "apps/terminal.h"
#include "render/shot.h"
#include "render/stage/stage_capture.h"
#include "surfel/hash.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <chrono>
#include <memory>
#include <optional>

namespace surflect {

namespace {

using Clock = std::chrono::steady_clock;

struct Arguments {
  std::string stage, output, scale, script;
  double frame = 1;
};

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Says how long it will take too.
Progress withTimeLeft(Progress progress) {
  if (!progress.report) return progress;
  progress.report = [report = progress.report, start = Clock::now()](std::string_view stage,
                                                                     double fraction) {
    const double left = fraction > 0 ? secondsSince(start) * (1 - fraction) / fraction : 0;
    report(left > 0 ? fmt::format("{}, {:.0f} s left,", stage, left) : std::string(stage), fraction);
  };
  return progress;
}

Json runCapture(const Arguments& arguments, const Progress& progress) {
  const auto start = Clock::now();
  const Stage stage = readStage(arguments.stage, arguments.scale);
  StageReport report;
  if (arguments.script.empty()) {
    report = captureStage(stage, nullptr, arguments.output, withTimeLeft(progress));
  } else {
    const Script script = readScript(arguments.script);
    const WarpPointer warp = warpAt(script, shotTime(script, arguments.frame));
    const std::array both = {script.hash, std::bit_cast<uint64_t>(arguments.frame)};
    const StageDeformation deformation{*warp, contentHash(std::as_bytes(std::span(both)))};
    report = captureStage(stage, &deformation, arguments.output, withTimeLeft(progress));
  }
  const double seconds = secondsSince(start);
  say(fmt::format("{}: {} views under {} lights, {} frames for training and {} for the test{}; {:.1f} s",
                  arguments.output, report.views, report.lights, report.trainingFrames, report.testFrames,
                  report.resumedViews > 0 ? fmt::format("; {} views were there already", report.resumedViews)
                                          : "",
                  seconds));
  return {{"views", report.views},
          {"lights", report.lights},
          {"training_frames", report.trainingFrames},
          {"test_frames", report.testFrames},
          {"resumed_views", report.resumedViews},
          {"samples", stage.trace.samples},
          {"seconds", seconds},
          {"memory_peak_bytes", memoryUse().peakBytes}};
}

} // namespace

void addCaptureCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("capture", "photograph a virtual light stage; run again to resume");
  command->footer("Example: surflect capture examples/stages/sphere.toml -o sphere");
  command->add_option("stage", arguments->stage, "TOML file: objects, cameras and lights")->required();
  command->add_option("-o,--output", arguments->output, "the capture's folder")->required();
  command->add_option("--scale", arguments->scale, "a [scale.NAME] of the stage file, such as tiny");
  CLI::Option* script = command->add_option("--script", arguments->script,
                                            "warps to bend the objects by: the truth for evaluate --script");
  command->add_option("--frame", arguments->frame, "of the script")->capture_default_str()->needs(script);
  setWork(*command, work, "the same command again goes on from here",
          [arguments](const Progress& progress) { return runCapture(*arguments, progress); });
}

} // namespace surflect
