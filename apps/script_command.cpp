#include "apps/command.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "render/methods.h"
#include "render/scene/turntable.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <memory>

namespace surflect {

namespace {

struct ScriptArguments {
  std::string model, output;
  bool overwrite = false;
};

Json runScript(const ScriptArguments& arguments, const Progress& progress) {
  const std::filesystem::path file = arguments.output;
  requireReplaceable(file);
  if (std::filesystem::exists(file) && !arguments.overwrite)
    throw Error("is there already; --overwrite replaces it").in(file);
  const auto renderer = method::openRenderer(arguments.model, {}, progress);
  const method::Description& model = renderer->describe();
  // The model as the script finds it, from its own folder.
  const std::filesystem::path folder = std::filesystem::absolute(file).lexically_normal().parent_path();
  const std::filesystem::path whole = std::filesystem::absolute(arguments.model).lexically_normal();
  const std::filesystem::path relative = whole.lexically_relative(folder);
  const std::filesystem::path& named = relative.empty() ? whole : relative;
  writeFileAtomically(
      file, std::string_view(scene::starterScript({named.string(), model.rig, model.points, model.isBaked})));
  say(fmt::format(
      "{0}: a turn-table to start from; surflect render {0} -o frames/ makes its film, surflect view {0} "
      "edits it by hand",
      file.string()));
  return {{"script", file.string()}, {"model", named.string()}};
}

} // namespace

void addScriptCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<ScriptArguments>();
  CLI::App* command = app.add_subcommand("script", "write a commented script for a model, to start from");
  command->footer("Example: surflect script vase.srf -o shot.toml && surflect render shot.toml -o frames/");
  command->add_option("model", arguments->model, "folder of a model, of any method")->required();
  command->add_option("-o,--output", arguments->output, "the script")->required()->check(notEmpty());
  command->add_flag("--overwrite", arguments->overwrite, "replace a file that is there");
  setWork(*command, work, "nothing was written",
          [arguments](const Progress& progress) { return runScript(*arguments, progress); });
}

} // namespace surflect
