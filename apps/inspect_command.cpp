#include "apps/command.h"
#include "apps/terminal.h"
#include "srf/model/model.h"

#include <fmt/format.h>

#include <memory>

namespace surflect {

namespace {

Json describe(const Capture& capture) {
  size_t test = 0;
  for (const auto& frame : capture.frames) test += frame.split == Split::test;
  return {{"views", capture.views.size()},
          {"lights", capture.lights.size()},
          {"training_frames", capture.frames.size() - test},
          {"test_frames", test},
          {"geometry", capture.geometry.string()}};
}

Json describe(const Model& model) {
  uint64_t bytes = 0, blocks = 0;
  for (const ViewFile& file : model.files) {
    bytes += std::filesystem::file_size(file.path());
    blocks += file.blockCount();
  }
  size_t unseen = 0;
  for (size_t i = 0; i < model.cloud.size(); ++i) {
    const auto fades = model.fades.of(i);
    unseen += std::ranges::none_of(fades, [](uint8_t fade) { return fade > 0; });
  }
  return {{"surfels", model.cloud.size()},       {"unseen_surfels", unseen},
          {"views", model.rig.views.size()},     {"lights", model.rig.lights.size()},
          {"full_product", model.isFullProduct}, {"blocks", blocks},
          {"reflectance_bytes", bytes},          {"white", model.white},
          {"tolerance", model.tolerance}};
}

Json runInspect(const std::string& path) {
  const bool packed = std::filesystem::exists(std::filesystem::path(path) / "manifest.json");
  Json report = packed ? describe(openModel(path)) : describe(readCapture(path));
  for (const auto& [key, value] : report.items()) say(fmt::format("{:<20} {}", key, value.dump()));
  return report;
}

} // namespace

void addInspectCommand(CLI::App& app, CommandWork& work) {
  auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("inspect", "say what is in a capture or a model");
  command->footer("Example: surflect inspect vase.srf");
  command->add_option("path", *path, "a capture or a packed model")->required();
  command->callback([path, &work] { work = [path](const Progress&) { return runInspect(*path); }; });
}

} // namespace surflect
