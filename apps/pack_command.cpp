#include "apps/capture_argument.h"
#include "apps/findings.h"
#include "apps/option_values.h"
#include "apps/pack_report.h"
#include "apps/terminal.h"
#include "srf/model/pack.h"
#include "surfel/base/error.h"

#include <fmt/format.h>

#include <memory>

namespace surflect {

namespace {

struct PackArguments {
  CaptureArgument capture;
  std::string output;
  model::PackOptions options;
  bool force = false;
};

// A capture whose checks stop `pack` before anything is written, if they find errors.
class CheckedSource : public model::CaptureSource {
public:
  // Adds findings to `findings`.
  CheckedSource(const PackArguments& arguments, std::vector<validation::Finding>& findings)
      : model::CaptureSource(arguments.capture.read()), arguments_(arguments), findings_(findings) {}

  proxy::Impostor impostor(const proxy::ImpostorOptions& options, const Progress& progress) const override {
    tell(validation::checkPoses(training()));
    tell(validation::checkMattes(training(), validation::kQuickChecks, progress));
    proxy::Impostor impostor = model::CaptureSource::impostor(options, progress);
    for (const std::string& note : impostor.notes) say(note); // before the findings, which they may explain
    // Other geometry was derived from the masks or shading that it would be compared with.
    validation::CheckEffort effort = validation::kQuickChecks;
    effort.masks = impostor.origin == proxy::Impostor::Origin::given;
    if (effort.masks || impostor.origin == proxy::Impostor::Origin::hull)
      tell(validation::checkCapture(training(), impostor.mesh, effort, progress));
    return impostor;
  }

private:
  std::string inspectArguments() const {
    const std::string mesh = arguments_.options.impostor.mesh.string();
    return arguments_.capture.path + (mesh.empty() ? "" : " --mesh " + mesh);
  }

  void tell(const std::vector<validation::Finding>& found) const {
    announce(found);
    findings_.insert(findings_.end(), found.begin(), found.end());
    if (const size_t errors = countErrors(found); errors > 0 && !arguments_.force)
      throw Error(fmt::format("stopped by {} error{}, see above; nothing was written. surflect inspect {} "
                              "--overlay sheet.png shows {}; --force packs anyway",
                              errors, errors == 1 ? "" : "s", inspectArguments(),
                              errors == 1 ? "it" : "them"))
          .in(training().file);
  }

  const PackArguments& arguments_;
  std::vector<validation::Finding>& findings_;
};

Json runPack(const PackArguments& arguments, const Progress& progress) {
  std::vector<validation::Finding> findings;
  CheckedSource source(arguments, findings);
  const model::PackReport report =
      model::pack(source, arguments.output, arguments.options, progress, announceEstimate);
  announce(report, arguments.output);
  Json json = jsonOf(report);
  json["findings"] = jsonOf(findings);
  return json;
}

} // namespace

void addPackCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<PackArguments>();
  CLI::App* command = app.add_subcommand("pack", "make a model from a capture; run again to resume");
  command->footer("Example: surflect pack examples/vase -o vase.srf --tolerance 0.05");
  addCaptureArgument(*command, arguments->capture);
  command->add_option("-o,--output", arguments->output, "the model's folder")->required()->check(notEmpty());
  CLI::Option* mesh = command->add_option("--mesh", arguments->options.impostor.mesh,
                                          "impostor geometry (PLY or OBJ) instead of the capture's");
  command
      ->add_flag("--hull", arguments->options.impostor.hull,
                 "an opacity hull, of all pixels with alpha above 0, instead of the capture's mesh")
      ->excludes(mesh);
  command
      ->add_flag("--relief", arguments->options.impostor.relief,
                 "geometry from shading, for a capture of one view under three lights or more")
      ->excludes(mesh);
  addStoreOptions(*command, arguments->options);
  command->add_flag("--force", arguments->force,
                    "pack in spite of errors that the checks of the capture find");
  setWork(*command, work, "the same command again goes on from here",
          [arguments](const Progress& progress) { return runPack(*arguments, progress); });
}

} // namespace surflect
