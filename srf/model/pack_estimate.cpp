#include "srf/model/pack_estimate.h"

#include "srf/capture/silhouette.h"
#include "srf/weights/visibility_weights.h"
#include "surfel/base/evenly_spaced.h"
#include "surfel/base/memory_use.h"
#include "surfel/base/stopwatch.h"
#include "surfel/geometry/mesh.h"
#include "surfel/sampling.h"

#include <algorithm>
#include <cmath>

namespace surflect::model {

namespace {

constexpr double kProbeSurfels = 10000, kLeastShare = 0.02, kMostShare = 0.1;
constexpr size_t kManyTriangles = 4096; // above this, a part is representative of the whole
constexpr size_t kRuns = 8;             // runs of triangles in the part
// Measured on two cores with the vase of examples/ at the default tolerance.
constexpr double kRatio = 5;                 // half floats to stored bytes
constexpr double kSecondsPerSurfel = 1.6e-5; // sampling
constexpr double kSecondsPerValue = 1.5e-8;  // encoding, per channel of an object pixel
constexpr double kBytesPerSurfel = 2100;     // memory while a surfel is sampled
constexpr size_t kSurveyed = 8;              // views that the survey reads, so that they are read twice

// A part of a mesh: kRuns runs of triangles, evenly spread over the list, about `share` of them in all.
TriangleMesh partOf(const TriangleMesh& mesh, double share) {
  const size_t all = mesh.triangles.size(),
               length = static_cast<size_t>(std::ceil(share * static_cast<double>(all) / kRuns));
  constexpr uint32_t unknown = ~0u;
  std::vector<uint32_t> newIndex(mesh.positions.size(), unknown);
  TriangleMesh part;
  for (size_t run = 0; run < kRuns; ++run)
    for (size_t t = run * all / kRuns; t < run * all / kRuns + length; ++t) {
      auto& triangle = part.triangles.emplace_back(mesh.triangles[t]);
      for (uint32_t& vertex : triangle) {
        uint32_t& known = newIndex[vertex];
        if (known == unknown) {
          known = static_cast<uint32_t>(part.positions.size());
          part.positions.push_back(mesh.positions[vertex]);
        }
        vertex = known;
      }
    }
  return part;
}

struct SurfelEstimate {
  double count = 0, seconds = 0, fadeSeconds = 0;
};

// Estimates surfels from a timed sample of part of the surface; a surface of few triangles is sampled as a
// whole, but more coarsely.
SurfelEstimate estimateSurfels(const capture::Capture& capture, const TriangleMesh& surface, double spacing,
                               const RayCaster<AcquisitionSpace>& impostor, const Progress& progress) {
  const double count = surfelsAt(surface, spacing),
               share = std::clamp(kProbeSurfels / count, kLeastShare, kMostShare);
  const bool isFine = surface.triangles.size() >= kManyTriangles;
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const capture::View& view : capture.views) cameras.push_back(view.camera);
  const TriangleMesh part = isFine ? partOf(surface, share) : surface;
  const double times = isFine ? surfaceArea(surface) / surfaceArea(part) : 1 / share;
  const Stopwatch sampling;
  const SurfelCloud probe = sampleSurfels(part, isFine ? spacing : spacing / std::sqrt(share), 1, progress);
  const double samplingSeconds = sampling.seconds();
  const Stopwatch fading;
  weights::visibilityWeights(probe, cameras, impostor, progress);
  return {count, times * samplingSeconds, times * fading.seconds()};
}

// Fraction of the pictures that the object covers, in four views, by casting the rays of small pictures.
double objectShare(const capture::Capture& capture, const RayCaster<AcquisitionSpace>& impostor,
                   const Progress& progress) {
  constexpr size_t kViews = 4;
  constexpr int kSide = 256; // pixels
  double shown = 0, all = 0;
  for (const size_t i : evenlySpaced(capture.views.size(), kViews)) {
    progress.checkpoint();
    capture::Camera<AcquisitionSpace> camera = capture.views[i].camera;
    const int width = camera.lens.width, height = camera.lens.height, longer = std::max(width, height);
    if (longer > kSide)
      camera.lens = capture::resized(camera.lens, std::max(1, width * kSide / longer),
                                     std::max(1, height * kSide / longer));
    const image::Image outline = capture::silhouette(camera, impostor);
    shown += static_cast<double>(std::ranges::count(outline.values, 1.f));
    all += static_cast<double>(outline.values.size());
  }
  return shown / all;
}

} // namespace

PackEstimate estimatePack(const PackSource& source, std::span<const std::vector<size_t>> frames,
                          const TriangleMesh& surface, double spacing,
                          const RayCaster<AcquisitionSpace>& impostor, double secondsSoFar,
                          const Progress& progress) {
  const capture::Capture& capture = source.training();
  const Progress quiet{nullptr, progress.cancelled};
  double values = 0, largest = 0;
  const double shown = objectShare(capture, impostor, progress);
  for (size_t view = 0; view < frames.size(); ++view) {
    const capture::Lens& lens = capture.views[view].camera.lens;
    const double stack = 1.0 * lens.width * lens.height * static_cast<double>(frames[view].size());
    values += 3 * stack * shown;
    largest = std::max(largest, stack);
  }
  const MemoryUse memory = memoryUse();
  const SurfelEstimate surfels = estimateSurfels(capture, surface, spacing, impostor, quiet);
  const double visibility = surfels.count * static_cast<double>(frames.size());
  const double slowness = surfels.seconds / (kSecondsPerSurfel * surfels.count); // this machine
  const double readings =
      static_cast<double>(capture.frames.size()) *
      (1 + static_cast<double>(std::min(kSurveyed, frames.size())) / static_cast<double>(frames.size()));
  PackEstimate estimate;
  estimate.surfels = static_cast<size_t>(surfels.count);
  estimate.diskBytes = static_cast<uint64_t>(2 * values / kRatio + 44 * surfels.count + visibility / 8);
  estimate.memoryBytes = static_cast<uint64_t>(std::max(
      memory.peakBytes,
      memory.anonymousBytes + std::max(32 * largest, kBytesPerSurfel * surfels.count + 3 * visibility)));
  estimate.seconds = secondsSoFar + surfels.seconds + surfels.fadeSeconds +
                     readings * source.secondsPerPicture(quiet) + slowness * kSecondsPerValue * values;
  return estimate;
}

} // namespace surflect::model
