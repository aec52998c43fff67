#include "apps/capture_argument.h"
#include "apps/option_values.h"
#include "apps/pack_report.h"
#include "apps/terminal.h"
#include "srf/checks/checks.h"
#include "srf/model/pack.h"

#include <memory>

namespace surflect {

namespace {

struct Arguments {
  CaptureArgument capture;
  std::string output;
  PackOptions options;
};

Json runPack(const Arguments& arguments, const Progress& progress) {
  const Capture capture = arguments.capture.read();
  const auto training = subset(capture, [](const Frame& frame) { return frame.split == Split::train; });
  for (const Finding& finding : checkMattes(training, progress)) say("warning: " + finding.text);
  const PackReport report = pack(capture, arguments.output, arguments.options, progress, announceEstimate);
  announce(report, arguments.output);
  return jsonOf(report);
}

} // namespace

void addPackCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("pack", "make a model from a capture; run again to resume");
  command->footer("Example: surflect pack examples/vase -o vase.srf --tolerance 0.05");
  addCaptureArgument(*command, arguments->capture);
  command->add_option("-o,--output", arguments->output, "the model's folder")->required()->check(notEmpty());
  CLI::Option* mesh = command->add_option("--mesh", arguments->options.impostor.mesh,
                                          "impostor geometry (PLY or OBJ) instead of the capture's");
  command
      ->add_flag("--relief", arguments->options.impostor.relief,
                 "geometry from shading, for a capture of one view under three lights or more")
      ->excludes(mesh);
  addStoreOptions(*command, arguments->options);
  setWork(*command, work, "the same command again goes on from here",
          [arguments](const Progress& progress) { return runPack(*arguments, progress); });
}

} // namespace surflect
