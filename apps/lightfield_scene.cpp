#include "apps/lightfield_build.h"
#include "apps/lightfield_command.h"
#include "apps/option_values.h"
#include "apps/terminal.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/lfm/joined.h"
#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/scene_file.h"
#include "render/lightfield/lfm/tile.h"
#include "surfel/base/error.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace surflect {

namespace {

struct SceneArguments {
  std::string scene, output;
  bool s3tc = false;
};

Json runScene(const SceneArguments& arguments, const Progress& progress) {
  requireCreatable(arguments.output);
  lightfield::requireLightFieldFolder(arguments.output);
  const lfm::SceneFile file = lfm::readSceneFile(arguments.scene);
  std::vector<lfm::LightFieldMaps> models;
  std::vector<lightfield::LightFieldFolder> folders;
  std::vector<const capture::Capture*> rigs;
  for (const std::filesystem::path& path : file.models) {
    if (std::error_code failure; std::filesystem::equivalent(path, arguments.output, failure))
      throw Error("is a model of the scene: give the output a folder of its own").in(arguments.output);
    lfm::OpenedMaps opened = lfm::openMaps(path, progress);
    models.push_back(std::move(opened.maps));
    folders.push_back(std::move(opened.folder));
  }
  for (const lightfield::LightFieldFolder& folder : folders) rigs.push_back(&folder.rig());
  lfm::LightFieldMaps scene = lfm::joined(models, file.objects);
  if (arguments.s3tc) scene = lfm::encoded(std::move(scene));
  lfm::writeMaps(scene, lfm::joinedRig(rigs, file.objects), arguments.output, progress);
  const lfm::MapBytes bytes = lfm::bytesOf(scene);
  say(fmt::format("{}: {} objects of {} models, {} triangles, maps of {}", arguments.output,
                  file.objects.size(), models.size(), scene.mesh.triangles.size(), mebibytes(bytes.total())));
  return {{"format", "lfm"},
          {"objects", file.objects.size()},
          {"models", models.size()},
          {"triangles", scene.mesh.triangles.size()},
          {"vertices", scene.mesh.positions.size()},
          {"terms", scene.terms.size()},
          {"map_bytes", bytes.total()},
          {"bytes", bytesIn(arguments.output)}};
}

} // namespace

void addLightFieldScene(CLI::App& lightField, CommandWork& work) {
  auto arguments = std::make_shared<SceneArguments>();
  CLI::App* command = lightField.add_subcommand("scene", "light field maps of several objects as one");
  command->footer("Example: surflect lightfield scene SCENE.toml -o scene.lfm --s3tc");
  command->add_option("scene", arguments->scene, "TOML file with an [[object]] for each")->required();
  command->add_option("-o,--output", arguments->output, "folder of the light field")
      ->required()
      ->check(notEmpty());
  command->add_flag("--s3tc", arguments->s3tc, "store maps as S3TC (DXT1) blocks, which the GPU reads");
  setWork(*command, work, "run it again to join from the start",
          [arguments](const Progress& progress) { return runScene(*arguments, progress); });
}

} // namespace surflect
