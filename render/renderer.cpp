#include "render/renderer.h"

#include "render/lightfield/lumigraph/lumigraph_file.h"
#include "render/lightfield/lumigraph/lumigraph_renderer.h"
#include "render/lightfield/slf/field_file.h"
#include "render/lightfield/slf/slf_renderer.h"
#include "render/surfels/surfel_renderer.h"
#include "srf/model/manifest.h"
#include "surfel/base/error.h"

#include <fmt/format.h>

namespace surflect::render {

namespace {

// Samples of a light field along each side of a pixel: edges are as smooth as those of splats.
constexpr int kSamples = 2;

} // namespace

std::unique_ptr<Renderer> openRenderer(const std::filesystem::path& model, const RendererOptions& options,
                                       const Progress& progress) {
  const std::string format = model::formatOf(model);
  if (format.empty() || format == model::kSurfelFormat)
    return std::make_unique<surfels::SurfelRenderer>(model, options, progress);
  if (options.nearest) throw Error("a light field has no nearest view: only packed models have").in(model);
  if (format == slf::kFormatTag)
    return std::make_unique<slf::SlfRenderer>(
        model, slf::SlfOptions{.slots = {.bytes = options.cacheBytes}, .samples = kSamples}, progress);
  if (format == lumigraph::kFormat)
    return std::make_unique<lumigraph::LumigraphRenderer>(
        model, lumigraph::LumigraphOptions{.triangles = {}, .samples = kSamples}, progress);
  throw Error::mismatch(
      fmt::format("\"{}\", \"{}\" or \"{}\"", model::kSurfelFormat, slf::kFormatTag, lumigraph::kFormat),
      '"' + format + '"')
      .at("format")
      .in(model / model::kManifestFile);
}

} // namespace surflect::render
