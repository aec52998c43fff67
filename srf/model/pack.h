// From a capture to a model.
#pragma once

#include "srf/capture/capture.h"
#include "srf/model/impostor.h"
#include "srf/model/light_choice.h"
#include "srf/store/view_encoder.h"
#include "surfel/progress.h"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>

namespace surflect {

struct PackOptions {
  ImpostorOptions impostor;
  double tolerance = 0.05; // of every block, see blockErrorBound
  std::optional<size_t>
      surfels; // about so many; none: two across a pixel of the photographs, a million at most
};

struct PackEstimate {
  size_t surfels = 0;
  uint64_t diskBytes = 0, memoryBytes = 0;
  double seconds = 0;
};

struct PackReport {
  Impostor::Origin geometry = Impostor::Origin::given;
  std::vector<Impostor::Fit> fits; // as in Impostor
  size_t surfels = 0, views = 0, lights = 0, resumedViews = 0;
  double white = 0;
  LightChoice lightChoice;
  size_t invalidTexels = 0; // NaN or infinite in the photographs
  ViewSummary store;        // errors of resumed views are not in it
  double surfelSeconds = 0, fadeSeconds = 0, storeSeconds = 0;
};

// Writes the model folder. Views are read, encoded and written one after the other, so memory is bounded by
// one view's photographs; a view file that an interrupted run has finished is kept. `announce` is called
// once, after the first view has been encoded and timed. Throws Error and Cancelled.
PackReport pack(const Capture& capture, const std::filesystem::path& folder, const PackOptions& options,
                const Progress& progress, const std::function<void(const PackEstimate&)>& announce);

} // namespace surflect
