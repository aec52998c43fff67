// From a capture to a model.
#pragma once

#include "srf/codec/view_encoder.h"
#include "srf/model/light_blend_selection.h"
#include "srf/model/pack_estimate.h"
#include "srf/model/pack_source.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace surflect::model {

struct PackOptions {
  proxy::ImpostorOptions impostor;
  double tolerance = 0.02; // of every block, see blockErrorBound
  std::optional<size_t>
      surfels;            // about so many; none: two across a pixel of the photographs, a million at most
  bool overwrite = false; // a finished model of other photographs, geometry or tolerance
};

struct PackReport {
  proxy::Impostor::Origin geometry = proxy::Impostor::Origin::given;
  std::vector<std::string> meshNotes;     // see Impostor::notes
  std::vector<proxy::Impostor::Fit> fits; // as in Impostor
  size_t surfels = 0, lights = 0, resumedViews = 0;
  std::vector<std::string> views; // identities
  double white = 0;
  LightBlendSelection lightChoice;
  size_t invalidTexels = 0;               // NaN or infinite in the photographs of views that were not resumed
  std::vector<codec::ViewSummary> ofView; // as `views`, also of resumed ones
  codec::ViewSummary store;               // their sum
  double surfelSeconds = 0, fadeSeconds = 0, storeSeconds = 0;
};

// Writes the model folder; over a finished model of another identity only if `overwrite`. Views are asked
// for, encoded and written one after the other, so memory is bounded by one view's photographs; a view file
// that an interrupted run has finished is kept. `announce` is called once, when the surface is known, before
// photographs are packed. Throws Error and Cancelled.
PackReport pack(PackSource& source, const std::filesystem::path& folder, const PackOptions& options,
                const Progress& progress, const std::function<void(const PackEstimate&)>& announce);
// Of the training frames of a capture on disk.
PackReport pack(const capture::Capture& capture, const std::filesystem::path& folder,
                const PackOptions& options, const Progress& progress,
                const std::function<void(const PackEstimate&)>& announce);

} // namespace surflect::model
