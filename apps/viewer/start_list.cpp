#include "apps/viewer/start_list.h"

#include "render/evaluation/evaluate.h"
#include "render/methods.h"
#include "render/scene/turntable.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <algorithm>

namespace surflect::viewer {

namespace {

// Text of a starter script, with the model's absolute path.
std::string starterOf(const std::filesystem::path& model, const method::Renderer& renderer) {
  const method::Description& of = renderer.describe();
  return scene::starterScript(
      {std::filesystem::absolute(model).lexically_normal().string(), of.rig, of.points, of.isBaked});
}

// Text of a script for a capture alone, of which only the camera is used.
std::string emptyShot(const DescribedModel& capture) {
  return fmt::format(
      "model = \"none\"\n[frames]\nfirst = 1\nlast = 1\n[output]\nsize = [960, 720]\npath = "
      "\"frame.####.exr\"\n[camera]\nposition = [{}, {}, {}]\nlook_at = [{}, {}, {}]\nup = {}\n"
      "fov_deg = 30\n",
      capture.middle.raw().x() + 3 * capture.radius, capture.middle.raw().y() + capture.radius,
      capture.middle.raw().z() + 2 * capture.radius, capture.middle.raw().x(), capture.middle.raw().y(),
      capture.middle.raw().z(), capture.json["up"].dump());
}

// Environments by the names of their files, with paths from the script's folder.
std::vector<StartList::Environment> named(const std::vector<std::filesystem::path>& pictures,
                                          const std::filesystem::path& script) {
  std::vector<StartList::Environment> environments;
  const std::filesystem::path folder =
      script.empty() ? script : std::filesystem::absolute(script).lexically_normal().parent_path();
  for (const std::filesystem::path& picture : pictures) {
    const std::filesystem::path whole = std::filesystem::absolute(picture).lexically_normal();
    const std::filesystem::path relative = script.empty() ? whole : whole.lexically_relative(folder);
    environments.push_back(
        {picture.filename().string(), relative.empty() ? whole.string() : relative.string()});
  }
  return environments;
}

// A file for the script of a model that has none, which is not there yet.
std::filesystem::path freeScript(const std::filesystem::path& folder, const std::string& model) {
  const std::string stem = std::filesystem::path(model).stem().string();
  std::filesystem::path path = folder / (stem + ".toml");
  for (int number = 2; std::filesystem::exists(path); ++number)
    path = folder / fmt::format("{}_{}.toml", stem, number);
  return path;
}

} // namespace

StartList openStartList(const ViewerInput& input, const Progress& progress) {
  StartList list;
  list.environments = named(input.environments, input.script);
  const auto add = [&](DescribedModel model, bool hasPhotographs, bool isCapture) {
    list.models.push_back(std::make_unique<DescribedModel>(std::move(model)));
    list.photographs.emplace_back();
    if (!hasPhotographs) return;
    addPhotographs(*input.capture, *list.models.back());
    list.photographs.back() =
        std::make_unique<Photographs>(*input.capture, isCapture ? nullptr : &list.models.back()->rig);
  };
  std::string text;
  for (const std::filesystem::path& model : input.models) {
    const auto renderer = method::openRenderer(model, input.setting, progress);
    if (list.models.empty()) text = starterOf(model, *renderer);
    add(described(folderName(model), *renderer, input.setting),
        input.capture && evaluation::rigMismatches(renderer->describe(), *input.capture).empty(), false);
  }
  if (input.models.empty()) {
    add(described(*input.capture), true, true);
    text = emptyShot(*list.models.front());
  }
  std::filesystem::path path = input.script;
  if (path.empty())
    path = freeScript(input.snapshots, list.models.front()->name);
  else
    text = readFile(path);
  std::vector<std::string> images;
  for (const StartList::Environment& environment : list.environments) images.push_back(environment.image);
  const Vec3<double> origin = input.models.empty() ? Vec3<double>(0, 0, 0) : list.models.front()->rig.origin;
  list.document = std::make_unique<ShotDocument>(text, path, origin, images);
  if (list.document->script(text)->coordinates == scene::Coordinates::original && !origin.isZero(0))
    throw Error(
        "\"original\" cannot be edited by hand, as pages count from the model's origin; render makes its "
        "frames, and the model alone can be viewed")
        .at("coordinates")
        .in(input.script);
  return list;
}

} // namespace surflect::viewer
