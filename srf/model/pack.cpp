#include "srf/model/pack.h"

#include "srf/capture/origin.h"
#include "srf/capture/silhouette.h"
#include "srf/model/manifest.h"
#include "srf/model/model.h"
#include "srf/model/model_files.h"
#include "srf/model/pack_folder.h"
#include "srf/model/pack_prepass.h"
#include "srf/model/pixel_grid.h"
#include "srf/model/shared_surface.h"
#include "srf/proxy/mesh/enclosed.h"
#include "srf/weights/visibility_weights.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/memory.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/bounds.h"
#include "surfel/sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace surflect::model {

namespace {

constexpr double kProbeSurfels = 10000, kLeastShare = 0.02, kMostShare = 0.1;
constexpr size_t kManyTriangles = 4096; // above this, a part is representative of the whole
constexpr size_t kRuns = 8;             // runs of triangles in the part
// Measured on two cores with the vase of examples/ at the default tolerance.
constexpr double kRatio = 5;                 // half floats to stored bytes
constexpr double kSecondsPerSurfel = 1.6e-5; // sampling
constexpr double kSecondsPerValue = 1.5e-8;  // encoding, per channel of an object pixel
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

namespace {

// Training frames of each view, in the order of the capture, which is the order of columns in the view's
// file.
std::vector<std::vector<size_t>> framesByView(const capture::Capture& capture) {
  std::vector<std::vector<size_t>> frames(capture.views.size());
  for (size_t i = 0; i < capture.frames.size(); ++i) frames[capture.frames[i].view].push_back(i);
  for (auto& ofView : frames)
    std::ranges::stable_sort(ofView, {}, [&](size_t i) { return capture.frames[i].light.value_or(0); });
  return frames;
}

// The capture as a model's rig: the picture of each frame is a column of its view's file.
capture::Capture rigOf(const capture::Capture& capture, std::span<const std::vector<size_t>> frames) {
  capture::Capture rig = capture;
  rig.geometry.clear();
  rig.colorSpace = capture::ColorSpace::linear;
  rig.response.reset();
  rig.frames.clear();
  for (size_t view = 0; view < frames.size(); ++view)
    for (const size_t i : frames[view]) {
      capture::Frame column;
      column.view = view;
      column.light = capture.frames[i].light;
      column.picture = viewFilePath(view);
      rig.frames.push_back(column);
    }
  return rig;
}

// Largest default number of surfels, which half of the memory must hold while they are sampled. An explicit
// number may be larger.
double mostSurfels() {
  constexpr double kMost = 4e6;
  return std::min(kMost, 0.5 * static_cast<double>(availableMemory()) / kBytesPerSurfel);
}

// Least alpha at which colours of a translucent object are stored. Fainter pixels continue their neighbours'
// colours, since their own are divided by a small alpha and therefore noisy.
constexpr double kFaintestStored = 1 / 16.;

// Version of the encoder and of the mattes it gets, which decide the bytes of a view; pack does not resume
// views of another version.
constexpr int kEncoderVersion = 4;

// Identity of everything that determines the files of a run: an earlier run with the same identity can be
// resumed.
std::string packIdentity(const PackSource& source, double tolerance, bool isOpaque,
                         const TriangleMesh& mesh) {
  const auto hash = [](const auto& values) { return contentHash(std::as_bytes(std::span(values))); };
  return fmt::format("format {} {} {} {:016x} {:016x} {:.17g}\n", kModelVersion, kEncoderVersion,
                     source.identity(), hash(mesh.positions), hash(mesh.triangles), tolerance) +
         (isOpaque ? "opaque\n" : "");
}

NormalsFrom normalsOf(proxy::Impostor::Origin origin) {
  if (origin == proxy::Impostor::Origin::plane) return NormalsFrom::nothing;
  return origin == proxy::Impostor::Origin::relief ? NormalsFrom::photographs : NormalsFrom::shape;
}

// How the only view of a model with a pixel grid is read: by bands of rows.
struct GridSource {
  weights::PixelGrid grid;
  std::optional<image::Image> matte; // of the view
  int width = 0, height = 0;
  int shrink = 1;   // of the survey
  int bandRows = 0; // whole blocks

  capture::ViewPart part(int top) const {
    return {.top = top, .rows = std::min(bandRows, height - top), .matte = matte ? &*matte : nullptr};
  }
  // Whole photographs, at a smaller size.
  capture::ViewPart survey() const { return {.shrink = shrink, .matte = matte ? &*matte : nullptr}; }
  int bands() const { return (height + bandRows - 1) / bandRows; }
};

constexpr double kBytesPerPixel = 12.6; // of a photograph in memory

// Memory for the photographs of a band. By default it grows with the picture, as that for reading one does.
double bandBytes(const PackOptions& options, double pixels) {
  return options.bandBytes > 0 ? options.bandBytes : std::max(1e9, 10 * kBytesPerPixel * pixels);
}

// The grid of a plane or relief, which takes over the matte; none for other geometry. Throws Error if memory
// does not hold the corners that are asked for.
std::optional<GridSource> gridSourceOf(const PackSource& source, proxy::Impostor::Origin origin,
                                       std::optional<image::Image> matte, const PackOptions& options,
                                       size_t photographs) {
  const bool isPlane = origin == proxy::Impostor::Origin::plane;
  if (!source.isOnDisk() || (!isPlane && origin != proxy::Impostor::Origin::relief)) return std::nullopt;
  // A default, which half of the memory must hold.
  const auto mostCorners =
      static_cast<size_t>(std::min(4e6, 0.5 * static_cast<double>(availableMemory()) / kBytesPerCorner));
  const capture::Lens& lens = source.training().views[0].camera.lens;
  GridSource made{.width = lens.width, .height = lens.height, .shrink = proxy::reliefShrink(lens)};
  if (options.surfels)
    made.grid = pixelGridWithin(lens, 1, *options.surfels);
  else
    made.grid =
        isPlane ? pixelGrid(lens, weights::kCoarsestGrid) : pixelGridWithin(lens, made.shrink, mostCorners);
  const auto corners = static_cast<double>(made.grid.corners());
  requireMemory(kBytesPerCorner * corners,
                fmt::format("{} corners, {} pixels apart", made.grid.corners(), made.grid.step));
  made.matte = std::move(matte);
  const double row = kBytesPerPixel * lens.width * static_cast<double>(photographs);
  const double blockRows = bandBytes(options, 1.0 * lens.width * lens.height) / (row * codec::blockSize);
  made.bandRows = codec::blockSize * static_cast<int>(std::clamp(blockRows, 1.0, 4096.0));
  return made;
}

PackEstimate estimateGrid(const PackSource& source, std::span<const size_t> frames, const GridSource& grid,
                          const PackOptions& options, double secondsSoFar, const Progress& progress) {
  const double pixels = 1.0 * grid.width * grid.height, photographs = static_cast<double>(frames.size());
  const double values = 3 * pixels * photographs, corners = static_cast<double>(grid.grid.corners());
  const double band = std::min(kBytesPerPixel * pixels * photographs, bandBytes(options, pixels));
  const double reading = std::max(capture::readingBytes(), capture::kBytesWhileRead * pixels);
  PackEstimate estimate;
  estimate.surfels = grid.grid.corners();
  estimate.diskBytes = static_cast<uint64_t>(2 * values / kRatio + 44 * corners);
  estimate.memoryBytes = static_cast<uint64_t>(std::max(
      memoryUse().peakBytes, memoryUse().anonymousBytes + kBytesPerCorner * corners + band +
                                 std::min(reading, capture::kBytesWhileRead * pixels * photographs)));
  estimate.seconds = secondsSoFar + photographs * (1 + grid.bands()) * source.secondsPerPicture(progress) +
                     kSecondsPerValue * values;
  return estimate;
}

// Encodes the only view band by band, and writes its files.
void encodeBands(const PackSource& source, std::span<const size_t> frames, const GridSource& grid,
                 const std::filesystem::path& folder, const codec::EncodeOptions& options, PackReport& report,
                 const Progress& progress) {
  codec::ViewSummary summary;
  codec::ViewFileWriter file(folder / viewFilePath(0),
                             codec::headerOf(grid.width, grid.height, frames.size(), options));
  const auto bands = static_cast<size_t>(grid.bands());
  for (size_t band = 0; band < bands; ++band) {
    const int top = static_cast<int>(band) * grid.bandRows;
    const Progress ofBand = stepOf(progress, "", band, bands), reading = stepOf(ofBand, "", 0, 2),
                   encoding = stepOf(ofBand, "", 1, 2);
    const ViewPictures pictures = readPicturePart(source.training(), frames, grid.part(top), reading);
    report.invalidTexels += pictures.invalidTexels;
    const codec::EncodedRows rows = codec::encodeRows(pictures.stack, top, options, encoding);
    file.add(rows.records);
    summary += rows.summary;
  }
  file.commit();
  summary.fileBytes = std::filesystem::file_size(folder / viewFilePath(0));
  if (report.isTranslucent && grid.matte) writeAlpha(folder, 0, codec::AlphaPlane(*grid.matte));
  writeSummary(folder, 0, summary);
  report.ofView[0] = std::move(summary);
}

} // namespace

PackReport pack(PackSource& source, const std::filesystem::path& folder, const PackOptions& options,
                const Progress& progress, const std::function<void(const PackEstimate&)>& announce) {
  const capture::Capture& capture = source.training();
  const auto frames = framesByView(capture);
  if (frames.empty()) throw Error::mismatch("training frames", "none").at("frames").in(capture.file);
  const Stopwatch surfelWatch;
  proxy::Impostor geometry = source.impostor(options.impostor, progress);
  const TriangleMesh& mesh = geometry.mesh;
  const RayCaster<AcquisitionSpace> impostor(mesh, progress);

  PackReport report;
  report.geometry = geometry.origin;
  report.fits = geometry.fits;
  report.meshNotes = geometry.notes;
  progress("surfels", 0);
  const double footprint = capture::pixelFootprint(capture, middleOf(mesh.positions));
  const auto most = static_cast<size_t>(mostSurfels());
  const auto spacingOn = [&](const TriangleMesh& surface) {
    return options.surfels ? spacingFor(surface, *options.surfels)
                           : std::max(footprint / 2, spacingFor(surface, most));
  };
  const std::optional<GridSource> gridSource =
      gridSourceOf(source, geometry.origin, std::move(geometry.matte), options, frames[0].size());
  const std::string identity = packIdentity(source, options.tolerance, options.opaque, mesh);
  if (!options.overwrite) protectFinished(folder, identity);
  claimPackFolder(folder);
  SurfelCloud cloud;
  if (gridSource) {
    if (announce)
      announce(estimateGrid(source, frames[0], *gridSource, options, surfelWatch.seconds(), progress));
    cloud = cornersOf(gridSource->grid, capture.views[0].camera, mesh, impostor, progress);
  } else {
    const TriangleMesh surface =
        proxy::withoutEnclosed(mesh, impostor, std::max(footprint, spacingFor(mesh, most)), progress);
    if (announce)
      announce(estimatePack(source, frames, surface, spacingOn(surface), impostor, surfelWatch.seconds(),
                            progress));
    cloud = sampleSurfels(surface, spacingOn(surface), 1, progress);
  }
  report.surfels = cloud.size();
  if (gridSource) report.gridStep = gridSource->grid.step;
  report.pixelsBetweenSurfels = pixelsBetween(cloud, capture);
  for (const capture::View& view : capture.views) report.views.push_back(view.identity);
  report.lights = capture.lights.size();
  report.surfelSeconds = surfelWatch.seconds();

  const Stopwatch storeWatch;
  const auto identityPath = folder / packIdentityPath();
  const bool resumes = std::filesystem::exists(identityPath) && readFile(identityPath) == identity;
  std::optional<PackPrepass> surveyed;
  if (resumes && std::filesystem::exists(folder / surveyPath()))
    surveyed = parsePackPrepass(readFile(folder / surveyPath()));
  if (!std::filesystem::exists(identityPath)) writeFileAtomically(identityPath, identity);
  if (!surveyed)
    surveyed = prepass(source, frames, mesh, normalsOf(geometry.origin), impostor,
                       gridSource ? std::optional(gridSource->survey()) : std::nullopt, progress);
  codec::EncodeOptions store;
  store.tolerance = options.tolerance;
  store.white = report.white = surveyed->white;
  report.lightChoice = surveyed->lights;
  report.isTranslucent = surveyed->isTranslucent && !options.opaque;
  if (report.isTranslucent) store.presentAlpha = kFaintestStored;
  std::filesystem::remove(folder / "manifest.json"); // marks the folder as unfinished
  if (!resumes) {
    removeViews(folder); // else an interrupted run would leave stale views to be resumed
    writeFileAtomically(identityPath, identity);
  }
  writeFileAtomically(folder / surveyPath(), packPrepassText(*surveyed));

  const Stopwatch fadeWatch;
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const auto& view : capture.views) cameras.push_back(view.camera);
  weights::VisibilityWeights visibility =
      gridSource ? weights::VisibilityWeights{1, std::vector<uint8_t>(cloud.size(), 255)}
      : report.isTranslucent && options.impostor.hull
          ? weights::opacityHullWeights(cloud, cameras, progress)
          : weights::visibilityWeights(cloud, cameras, impostor, progress);
  report.fadeSeconds = fadeWatch.seconds();

  std::vector<size_t> missing;
  report.ofView.resize(frames.size());
  for (size_t view = 0; view < frames.size(); ++view) {
    progress.checkpoint();
    const capture::Lens& lens = cameras[view].lens;
    const bool hasAlpha = !report.isTranslucent || isAlphaFinished(folder, view, lens.width, lens.height);
    if (const auto earlier = hasAlpha ? finishedView(folder, view) : std::nullopt)
      report.ofView[view] = *earlier;
    else
      missing.push_back(view);
  }
  report.resumedViews = frames.size() - missing.size();
  for (size_t i = 0; i < missing.size(); ++i) {
    const size_t view = missing[i];
    const Progress ofView = stepOf(progress, "reflectance images", i, missing.size());
    ofView("", 0);
    if (gridSource) {
      encodeBands(source, frames[view], *gridSource, folder, store, report, ofView);
      continue;
    }
    const Progress reading = stepOf(ofView, "", 0, 2), encoding = stepOf(ofView, "", 1, 2);
    const MattedView loaded =
        fillMissingMatte(source.pictures(frames[view], true, reading), cameras[view], impostor);
    const codec::EncodedView encoded = codec::encodeView(loaded.stack, store, encoding);
    if (report.isTranslucent) writeAlpha(folder, view, codec::AlphaPlane(loaded.stack.alpha));
    writeView(folder, view, encoded);
    report.ofView[view] = encoded.summary;
    report.invalidTexels += loaded.invalidTexels;
  }
  for (const codec::ViewSummary& summary : report.ofView) report.store += summary;
  Model model = makeModel(folder,
                          {rigOf(capture, frames), std::move(cloud), std::move(visibility), store.white,
                           store.tolerance, surveyed->lights.blend, report.isTranslucent,
                           gridSource ? std::optional(gridSource->grid) : std::nullopt},
                          progress);
  std::optional<SharedSample> shared;
  if (options.tables && !gridSource && canShare(model) && canLeaveOut(model)) {
    shared = shareSample(model, progress);
    // As it will be opened:
    model.shared = unpackTables(packTables(spreadOver(model, *shared, progress)), model.cloud.size());
  }
  report.interpolation = selectInterpolation(model, normalsOf(geometry.origin) != NormalsFrom::nothing,
                                             shared ? &*shared : nullptr, progress);
  model.interpolation = report.interpolation.choice;
  const std::vector<float>& trust = report.interpolation.trust;
  if (std::ranges::all_of(trust, [](float of) { return of == 0; })) model.shared.reset();
  if (model.shared) model.shared->trust = trust;
  if (report.interpolation.leftOut)
    model.lightBlend.foreshortened = report.lightChoice.blend.foreshortened =
        report.interpolation.foreshortened;
  writeModel(model, progress);
  report.storeSeconds = storeWatch.seconds() - report.fadeSeconds;
  progress("reflectance images", 1);
  return report;
}

PackReport pack(const capture::Capture& capture, const std::filesystem::path& folder,
                const PackOptions& options, const Progress& progress,
                const std::function<void(const PackEstimate&)>& announce) {
  CaptureSource source(capture);
  return pack(source, folder, options, progress, announce);
}

} // namespace surflect::model
