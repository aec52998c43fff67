// Packs a capture as a model: samples surfels, selects the light blend and encodes the views.
#pragma once

#include "srf/codec/view_encoder.h"
#include "srf/model/pack_source.h"
#include "srf/model/weights_selection.h"
#include "surfel/base/time.h"
#include "surfel/geometry/ray_caster.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::model {

// Estimates the disk space, memory and time of packing a model, by timing on part of the surface and a few
// photographs.
struct PackEstimate {
  size_t surfels = 0;
  uint64_t diskBytes = 0, memoryBytes = 0;
  double seconds = 0; // for all of pack
};

// Estimates a model with surfels `spacing` apart (scene units). `frames` are indices into
// source.training().frames, by view; `secondsSoFar` is the time pack has taken already. Takes about a
// twentieth of the time of sampling, and reads four photographs. Throws Error and Cancelled.
PackEstimate estimatePack(const PackSource& source, std::span<const std::vector<size_t>> frames,
                          const TriangleMesh& surface, double spacing,
                          const RayCaster<AcquisitionSpace>& impostor, double secondsSoFar,
                          const Progress& progress);

// Memory that sampling takes for a surfel, measured with the vase of examples/.
inline constexpr double kBytesPerSurfel = 2100;

// Memory that a corner of a pixel grid takes, with a reserve: 320 bytes were measured between planes of
// 31,000 and of 126,000 corners.
inline constexpr double kBytesPerCorner = 500;

// Largest number of surfels that can be asked for.
inline constexpr size_t kMostSurfels = 100'000'000;

struct PackOptions {
  proxy::ImpostorOptions impostor;
  double tolerance = 0.02;       // error tolerance of every block; see blockErrorBound
  std::optional<size_t> surfels; // approximate count; by default two across a pixel of the photographs, but
                                 // no more than four million, nor than half of the memory holds
  bool opaque = false;           // alpha is a mask, however many pixels are translucent
  bool tables = true;            // share reflectance over the surface, where that predicts photographs better
  bool overwrite = false;        // also replaces a finished model of another identity
  double bandBytes = 0; // memory for the photographs of a band of rows, of a model with a pixel grid;
                        // 0: ten whole photographs, at least 1 GB. Does not change the model
};

struct PackReport {
  proxy::Impostor::Origin geometry = proxy::Impostor::Origin::given;
  std::vector<std::string> meshNotes;     // see Impostor::notes
  std::vector<proxy::Impostor::Fit> fits; // as in Impostor
  size_t surfels = 0, lights = 0, resumedViews = 0;
  double pixelsBetweenSurfels = 0; // see pixelsBetween
  int gridStep = 0;                // PixelGrid::step; 0 without a grid
  std::vector<std::string> views;  // identities of the views
  double white = 0;
  LightBlendSelection lightChoice;
  InterpolationSelection interpolation;
  bool isTranslucent = false; // alpha planes are stored
  size_t invalidTexels = 0;   // NaN or infinite texels in the photographs of views that were not resumed
  std::vector<codec::ViewSummary> ofView; // one for each of `views`, resumed ones included
  codec::ViewSummary store;               // sum of `ofView`
  double surfelSeconds = 0, fadeSeconds = 0, storeSeconds = 0;
};

// Writes the model folder; replaces a finished model of another identity only if `overwrite`. Views are
// requested, encoded and written one by one, so that memory is bounded by the photographs of one view;
// finished view files of an interrupted run are kept. Calls `announce` once, when the surface is known and
// before photographs are packed. Throws Error and Cancelled.
PackReport pack(PackSource& source, const std::filesystem::path& folder, const PackOptions& options,
                const Progress& progress, const std::function<void(const PackEstimate&)>& announce);
// Packs the training frames of a capture on disk.
PackReport pack(const capture::Capture& capture, const std::filesystem::path& folder,
                const PackOptions& options, const Progress& progress,
                const std::function<void(const PackEstimate&)>& announce);

} // namespace surflect::model
