#include "render/methods.h"

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/lfm/lfm_method.h"
#include "render/lightfield/lumigraph/lumigraph_method.h"
#include "render/lightfield/olf/opacity_method.h"
#include "render/lightfield/slf/slf_method.h"
#include "render/lightfield/spherical/spherical_method.h"
#include "render/lightfield/traced/traced_images.h"
#include "render/surfels/surfel_method.h"
#include "srf/model/manifest.h"
#include "surfel/base/error.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

namespace surflect::method {

namespace {

// The spherical method, which also traces stages.
Method tracing(Method method) {
  method.build = [views = method.build](const BuildInput& input, const Setting& setting,
                                        const Progress& progress) {
    if (input.source.extension() != ".toml") return views(input, setting, progress);
    const Stopwatch watch;
    requireCreatable(input.output);
    lightfield::requireLightFieldFolder(input.output);
    const spherical::BuildReport report =
        traced::build(stage::readStage(input.source, input.stageScale), spherical::buildOptionsOf(setting),
                      input.output, progress);
    return spherical::reportOf(report, input, watch.seconds());
  };
  return method;
}

} // namespace

std::span<const Method> methods() {
  static const std::vector<Method> kMethods{surfels::surfelMethod(),
                                            slf::slfMethod(),
                                            lumigraph::lumigraphMethod(),
                                            lfm::lfmMethod(),
                                            olf::vdtmMethod(),
                                            olf::ulrMethod(),
                                            olf::olfmMethod(),
                                            tracing(spherical::sphericalMethod())};
  return kMethods;
}

const Method& methodOf(std::string_view tag) {
  const auto found = std::ranges::find(methods(), tag, &Method::tag);
  if (found != methods().end()) return *found;
  std::vector<std::string_view> tags;
  for (const Method& method : methods()) tags.push_back(method.tag);
  throw Error(fmt::format("found '{}', expected {}{}", tag, fmt::join(tags, ", "), didYouMean(tag, tags)));
}

const Method& methodOfModel(const std::filesystem::path& model) {
  const std::string format = model::formatOf(model);
  if (format.empty()) return methods().front();
  const auto found = std::ranges::find(methods(), format, &Method::format);
  if (found != methods().end()) return *found;
  std::vector<std::string> formats;
  for (const Method& method : methods())
    if (std::ranges::find(formats, '"' + method.format + '"') == formats.end())
      formats.push_back('"' + method.format + '"');
  throw Error::mismatch(fmt::format("one of {}", fmt::join(formats, ", ")), '"' + format + '"')
      .at("format")
      .in(model / model::kManifestFile);
}

std::unique_ptr<Renderer> openRenderer(const std::filesystem::path& model, const Setting& setting,
                                       const Progress& progress) {
  const Method& method = methodOfModel(model);
  requireSetting({method.tag, method.renderOptions}, setting);
  return method.open(model, setting, progress);
}

std::unique_ptr<Renderer> openScene(std::span<const scene::PlacedModel> objects, const Setting& setting,
                                    const Progress& progress) {
  std::vector<std::filesystem::path> models; // each once
  std::vector<lfm::PlacedObject> placed;
  for (const scene::PlacedModel& object : objects) {
    const auto known = std::ranges::find(models, object.model);
    placed.push_back(
        {static_cast<size_t>(known - models.begin()), {object.scale, object.rotation, object.position}});
    if (known != models.end()) continue;
    if (const Method& method = methodOfModel(object.model); method.tag != "lfm")
      throw Error::mismatch("a model of method lfm, as objects of one scene are", method.tag)
          .at("method")
          .in(object.model);
    models.push_back(object.model);
  }
  const Method& lfm = methodOf("lfm");
  requireSetting({lfm.tag, lfm.renderOptions}, setting);
  return lfm::openScene(models, placed, setting, progress);
}

} // namespace surflect::method
