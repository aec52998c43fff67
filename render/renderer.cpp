#include "render/renderer.h"

#include "render/lightfield/common/pixel_samples.h"
#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/lfm_renderer.h"
#include "render/lightfield/lumigraph/lumigraph_file.h"
#include "render/lightfield/lumigraph/lumigraph_renderer.h"
#include "render/lightfield/olf/opacity_file.h"
#include "render/lightfield/olf/opacity_map_file.h"
#include "render/lightfield/olf/opacity_map_renderer.h"
#include "render/lightfield/olf/opacity_renderer.h"
#include "render/lightfield/slf/field_file.h"
#include "render/lightfield/slf/slf_renderer.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "render/lightfield/spherical/spherical_renderer.h"
#include "render/surfels/surfel_renderer.h"
#include "srf/model/manifest.h"
#include "surfel/base/error.h"

#include <fmt/format.h>

namespace surflect::render {

std::unique_ptr<Renderer> openRenderer(const std::filesystem::path& model, const RendererOptions& options,
                                       const Progress& progress) {
  const std::string format = model::formatOf(model);
  if (format.empty() || format == model::kSurfelFormat)
    return std::make_unique<surfels::SurfelRenderer>(model, options, progress);
  if (options.nearest) throw Error("a light field has no nearest view: only packed models have").in(model);
  if (format == slf::kFormatTag)
    return std::make_unique<slf::SlfRenderer>(
        model, slf::SlfOptions{.slots = {.bytes = options.cacheBytes}, .samples = lightfield::kSamples},
        progress);
  if (format == lumigraph::kFormat)
    return std::make_unique<lumigraph::LumigraphRenderer>(
        model, lumigraph::LumigraphOptions{.samples = lightfield::kSamples}, progress);
  if (format == lfm::kFormatTag)
    return std::make_unique<lfm::LfmRenderer>(model, lfm::LfmOptions{.samples = lightfield::kSamples},
                                              progress);
  if (format == spherical::kFormat)
    return std::make_unique<spherical::SphericalRenderer>(
        model,
        spherical::SphericalOptions{.budgets = {options.cacheBytes, options.cacheBytes},
                                    .samples = lightfield::kSamples},
        progress);
  if (format == olf::kFormat)
    return std::make_unique<olf::OpacityRenderer>(
        model, olf::OpacityOptions{.samples = lightfield::kSamples, .order = {}}, progress);
  if (format == olf::kMapFormat)
    return std::make_unique<olf::OpacityMapRenderer>(
        model, olf::OpacityMapOptions{.samples = lightfield::kSamples, .order = {}}, progress);
  throw Error::mismatch(fmt::format("\"{}\", \"{}\", \"{}\", \"{}\", \"{}\", \"{}\" or \"{}\"",
                                    model::kSurfelFormat, slf::kFormatTag, lumigraph::kFormat,
                                    lfm::kFormatTag, spherical::kFormat, olf::kFormat, olf::kMapFormat),
                        '"' + format + '"')
      .at("format")
      .in(model / model::kManifestFile);
}

} // namespace surflect::render
