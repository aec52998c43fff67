#include "render/renderer.h"

#include "render/surfels/surfel_renderer.h"
#include "srf/model/manifest.h"
#include "surfel/base/error.h"

namespace surflect::render {

std::unique_ptr<Renderer> openRenderer(const std::filesystem::path& model, const RendererOptions& options,
                                       const Progress& progress) {
  const std::string format = model::formatOf(model);
  if (format.empty() || format == model::kSurfelFormat)
    return std::make_unique<surfels::SurfelRenderer>(model, options, progress);
  throw Error::mismatch('"' + std::string(model::kSurfelFormat) + '"', '"' + format + '"')
      .at("format")
      .in(model / model::kManifestFile);
}

} // namespace surflect::render
