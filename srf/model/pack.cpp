#include "srf/model/pack.h"

#include "srf/image/mask.h"
#include "srf/image/percentile.h"
#include "srf/model/manifest.h"
#include "srf/model/model.h"
#include "srf/query/enclosed.h"
#include "srf/query/ray_caster.h"
#include "surfel/error.h"
#include "surfel/file.h"
#include "surfel/hash.h"
#include "surfel/sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <chrono>
#include <cmath>
#include <locale>
#include <sstream>

namespace surflect {

namespace {

using Clock = std::chrono::steady_clock;
double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Training frames by view, in the order of the capture; columns of the view's file.
std::vector<std::vector<size_t>> framesByView(const Capture& capture) {
  std::vector<std::vector<size_t>> frames(capture.views.size());
  for (size_t i = 0; i < capture.frames.size(); ++i) frames[capture.frames[i].view].push_back(i);
  for (auto& ofView : frames)
    std::ranges::stable_sort(ofView, {}, [&](size_t i) { return capture.frames[i].light.value_or(0); });
  return frames;
}

// The capture as a model's rig: each frame's picture is a column of its view's file.
Capture rigOf(const Capture& capture, std::span<const std::vector<size_t>> frames) {
  Capture rig = capture;
  rig.geometry.clear();
  rig.colorSpace = ColorSpace::linear;
  rig.response.reset();
  rig.frames.clear();
  for (size_t view = 0; view < frames.size(); ++view)
    for (const size_t i : frames[view]) {
      Frame column;
      column.view = view;
      column.light = capture.frames[i].light;
      column.picture = viewFilePath(view);
      rig.frames.push_back(column);
    }
  return rig;
}

Point3<AcquisitionSpace, double> middleOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const auto& p : mesh.positions) box.extend(p.cast<double>().raw());
  return assume<Point3<AcquisitionSpace, double>>(box.center());
}

// What one pixel covers at the centre of the mesh, scene units; the median over views.
double pixelFootprint(const Capture& capture, const TriangleMesh& mesh) {
  const auto center = middleOf(mesh);
  std::vector<double> footprints;
  for (const auto& view : capture.views) {
    const Lens& lens = view.camera.lens;
    const double distance =
        lens.model == Lens::Model::orthographic ? 1 : length(view.camera.center() - center);
    footprints.push_back(distance / std::sqrt(lens.focalX * lens.focalY));
  }
  std::ranges::nth_element(footprints,
                           footprints.begin() + static_cast<std::ptrdiff_t>(footprints.size() / 2));
  return footprints[footprints.size() / 2];
}

// A default that no photograph justifies; asked for by number, there may be more.
constexpr size_t kMostSurfels = 1000000;

// The pictures of a view, and what they are sure to show.
struct LoadedView {
  ReflectanceStack stack;
  Mask object;
  size_t invalidTexels = 0;
};

// Without a matte the mesh's silhouette is the object. Its rim, where a mesh that is a pixel or two off would
// show background, continues what lies inside.
void matteFromMesh(LoadedView& view, const Camera<AcquisitionSpace>& camera,
                   const RayCaster<AcquisitionSpace>& impostor) {
  constexpr int kRim = 2; // pixels
  view.stack.alpha = silhouette(camera, impostor);
  const Mask outline = objectMask(view.stack.alpha);
  view.object = eroded(outline, kRim);
  const auto source = nearestSeeds(view.object, outline);
  for (Image& light : view.stack.lights)
    for (size_t texel = 0; texel < source.size(); ++texel)
      if (source[texel] != texel)
        std::copy_n(light.values.begin() + static_cast<std::ptrdiff_t>(3 * source[texel]), 3,
                    light.values.begin() + static_cast<std::ptrdiff_t>(3 * texel));
}

LoadedView withMatte(ViewPictures pictures, const Camera<AcquisitionSpace>& camera,
                     const RayCaster<AcquisitionSpace>& impostor) {
  LoadedView view{std::move(pictures.stack), {}, pictures.invalidTexels};
  if (pictures.hasMatte)
    view.object = objectMask(view.stack.alpha);
  else
    matteFromMesh(view, camera, impostor);
  return view;
}

void countRadiance(const LoadedView& view, PercentileCounter& values, const Progress& progress) {
  for (const auto& light : view.stack.lights) {
    progress.checkpoint();
    for (size_t texel = 0; texel < view.object.inside.size(); ++texel)
      if (view.object.inside[texel])
        for (size_t c = 0; c < 3; ++c) values.add(light.values[3 * texel + c]);
  }
}

// As they lie from the middle of the impostor.
LightSamples lightSamples(const Capture& capture, const TriangleMesh& mesh) {
  const auto middle = middleOf(mesh);
  std::vector<Direction3<AcquisitionSpace>> towards;
  std::vector<Rgb> irradiance;
  for (const Light& light : capture.lights) {
    towards.push_back(towardsLight(light, middle).cast<float>());
    irradiance.push_back(irradianceAt(light, middle));
  }
  return {towards, irradiance};
}

// At most so many texels of the object, evenly over the picture; those that the impostor shows, too.
void addSamples(const LoadedView& view, const Camera<AcquisitionSpace>& camera, const TriangleMesh& mesh,
                const RayCaster<AcquisitionSpace>& impostor, size_t most, LightSamples& samples) {
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const auto width = static_cast<size_t>(camera.lens.width);
  const auto object = static_cast<size_t>(std::ranges::count(view.object.inside, true));
  const size_t step = std::max(size_t{1}, (object + most - 1) / most);
  std::vector<Rgb> radiance(view.stack.lights.size());
  size_t seen = 0;
  for (size_t texel = 0; texel < view.object.inside.size(); ++texel) {
    if (!view.object.inside[texel] || seen++ % step != 0) continue;
    const auto ray = rayThrough(
        camera.lens, {static_cast<double>(texel % width) + 0.5, static_cast<double>(texel / width) + 0.5});
    if (!ray) continue;
    const auto hit = impostor.firstHit(worldFromCamera(ray->origin), worldFromCamera(ray->direction));
    if (!hit) continue;
    const Vec3<float> normal = areaVector(mesh, hit->triangle).normalized().cast<float>();
    for (size_t light = 0; light < radiance.size(); ++light) {
      const float* value = &view.stack.lights[light].values[3 * texel];
      radiance[light] = {value[0], value[1], value[2]};
    }
    samples.add(radiance, assume<Normal3<AcquisitionSpace>>(normal));
  }
}

struct Survey {
  double white = 1; // what errors and floors of the store are measured against
  LightChoice lights;
};

// How far step i of n is.
Progress partOf(const Progress& whole, std::string_view stage, size_t i, size_t n) {
  Progress part = whole;
  if (whole.report)
    part.report = [&whole, stage, i, n](std::string_view, double fraction) {
      whole.report(stage, (static_cast<double>(i) + fraction) / static_cast<double>(n));
    };
  return part;
}

// Up to eight views, evenly chosen, tell the white level, which is the 99.5th percentile of the object's
// radiance over all channels, and how lights are blended where cameras and lights are chosen apart.
Survey survey(PackSource& source, std::span<const std::vector<size_t>> frames, const TriangleMesh& mesh,
              NormalsFrom normals, const RayCaster<AcquisitionSpace>& impostor, const Progress& progress) {
  constexpr size_t kViews = 8, kTexels = 4000;
  const Capture& capture = source.training();
  // No view has two frames of one light.
  const bool isFullProduct =
      std::ranges::all_of(frames, [&](const auto& ofView) { return ofView.size() == capture.lights.size(); });
  PercentileCounter values;
  LightSamples samples = lightSamples(capture, mesh);
  const size_t count = std::min(kViews, frames.size());
  for (size_t i = 0; i < count; ++i) {
    const size_t number = i * frames.size() / count;
    const auto& camera = capture.views[number].camera;
    const Progress ofView = partOf(progress, "survey", i, count);
    ofView("", 0);
    const LoadedView view = withMatte(source.pictures(frames[number], false, ofView), camera, impostor);
    countRadiance(view, values, progress);
    if (isFullProduct) addSamples(view, camera, mesh, impostor, kTexels / count, samples);
  }
  if (values.count() == 0) throw Error("no photograph shows anything of the object").in(capture.file);
  const double white = std::clamp(values.percentile(0.995), 1e-20, 1e20);
  return {white, samples.choose(white, normals, progress)};
}

// The survey as pack keeps it, so that who resumes need not look at those views again.
std::string surveyText(const Survey& survey) {
  const auto& [blend, leftOutDb] = survey.lights;
  return fmt::format("{:.17g} {} {} {} {}\n", survey.white, blend.lights, nameOf(blend.fit),
                     blend.foreshortened ? "foreshortened" : "plain",
                     leftOutDb ? fmt::format("{:.17g}", *leftOutDb) : "unknown");
}

// Of another form than surveyText's, it is none.
std::optional<Survey> parseSurvey(const std::string& text) {
  std::istringstream words(text);
  words.imbue(std::locale::classic());
  Survey survey;
  LightBlend& blend = survey.lights.blend;
  std::string fit, shortening, leftOutDb;
  if (!(words >> survey.white >> blend.lights >> fit >> shortening >> leftOutDb)) return std::nullopt;
  if (fit == nameOf(LightFit::plane)) blend.fit = LightFit::plane;
  blend.foreshortened = shortening == "foreshortened";
  if (leftOutDb != "unknown") {
    double db = 0;
    std::from_chars(leftOutDb.data(), leftOutDb.data() + leftOutDb.size(), db);
    survey.lights.leftOutDb = db;
  }
  if (surveyText(survey) != text || !(survey.white >= 1e-20 && survey.white <= 1e20)) return std::nullopt;
  return survey;
}

// What makes files of an earlier run those that this run would write.
std::string packIdentity(const PackSource& source, double tolerance, const TriangleMesh& mesh) {
  const auto hash = [](const auto& values) { return contentHash(std::as_bytes(std::span(values))); };
  return fmt::format("format {} {} {:016x} {:016x} {:.17g}\n", kModelVersion, source.identity(),
                     hash(mesh.positions), hash(mesh.triangles), tolerance);
}

// What packing a view lost, beside its file: nothing else knows it once the photographs are gone.
std::filesystem::path errorPath(size_t view) { return viewFilePath(view).replace_extension(".error"); }

std::string errorText(std::span<const std::byte> file, const ViewSummary& summary) {
  return fmt::format("{:016x} {:.17g} {:.17g}\n", contentHash(file), summary.squaredError,
                     summary.clippedSquaredError);
}

// What a view file of an earlier run holds and lost, where it is complete.
std::optional<ViewSummary> finished(const std::filesystem::path& folder, size_t view) {
  const auto path = folder / viewFilePath(view);
  if (!std::filesystem::exists(path) || !std::filesystem::exists(folder / errorPath(view)))
    return std::nullopt;
  try {
    const std::string bytes = readFile(path), record = readFile(folder / errorPath(view), 1 << 12);
    ViewSummary summary;
    std::istringstream words(record);
    words.imbue(std::locale::classic());
    std::string hash;
    words >> hash >> summary.squaredError >> summary.clippedSquaredError;
    if (errorText(std::as_bytes(std::span(bytes)), summary) != record) return std::nullopt;
    const ViewFile file(path);
    summary.fileBytes = bytes.size();
    for (uint32_t index = 0; index < file.blockCount(); ++index) {
      const Block block = file.read(index);
      summary.objectTexels += static_cast<uint64_t>(std::popcount(block.present));
      summary.blocksOfRank.resize(std::max(summary.blocksOfRank.size(), static_cast<size_t>(block.rank) + 1));
      ++summary.blocksOfRank[static_cast<size_t>(block.rank)];
    }
    summary.values = summary.objectTexels * static_cast<uint64_t>(file.header().lights) * 3;
    return summary;
  } catch (const Error&) {
    return std::nullopt;
  }
}

// A folder in which there is nothing, or what a run leaves that was interrupted early: folders and
// temporaries.
bool isVacant(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  if (!fs::is_directory(folder)) return false;
  const auto isContent = [](const fs::directory_entry& entry) {
    return !entry.is_directory() && entry.path().extension() != ".tmp";
  };
  const fs::recursive_directory_iterator entries(folder);
  return std::none_of(begin(entries), end(entries), isContent);
}

// Only a new folder, or one that pack has begun or made, may be written into: a capture has files of the same
// names.
void claimFolder(const std::filesystem::path& folder, const std::filesystem::path& identityPath) {
  namespace fs = std::filesystem;
  if (fs::exists(folder) && !fs::exists(identityPath) && !isVacant(folder))
    throw Error("exists and is not a model: give the output a folder of its own").in(folder);
  std::error_code failure;
  fs::create_directories(identityPath.parent_path(), failure);
  if (failure) throw Error("cannot be created (" + failure.message() + ")").in(folder);
}

// Is it the name of a file that tells of one view, or of the survey?
bool isOfViews(const std::string& name) {
  size_t view = 0;
  const auto [end, status] = std::from_chars(name.data(), name.data() + name.size(), view);
  return name == "survey" || (status == std::errc() &&
                              (viewFilePath(view).filename() == name || errorPath(view).filename() == name));
}

void removeViews(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::vector<fs::path> views;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "views"))
    if (isOfViews(entry.path().filename().string())) views.push_back(entry.path());
  for (const fs::path& view : views) fs::remove(view);
}

// What an earlier run of pack left when it was killed.
void removeLitter(const std::filesystem::path& folder) {
  removeAbandoned(folder, [](const std::string& target) {
    return target == "manifest.json" || target == "transforms.json" || target == "surfels.ply" ||
           target == "fades.bin";
  });
  removeAbandoned(folder / "views",
                  [](const std::string& target) { return target == "identity" || isOfViews(target); });
}

// From sizes alone, by figures measured on two cores: shares and rates of the vase in examples/.
PackEstimate estimate(const Capture& capture, std::span<const std::vector<size_t>> frames,
                      const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& impostor, double spacing,
                      const Progress& progress) {
  constexpr double kRatio = 7;                 // half floats to stored bytes, at the default tolerance
  constexpr double kSecondsPerSurfel = 1.6e-5; // sampling
  constexpr double kSecondsPerFade = 1.3e-7;   // per surfel and view
  constexpr double kSecondsPerValue = 2.2e-8;  // reading and encoding, per channel of an object pixel
  constexpr double kBytesPerSurfel = 16 * 48;  // candidates of the sampling
  constexpr size_t kViews = 4;                 // whose silhouettes are looked at
  double shown = 0, pixelsLooked = 0, values = 0, largest = 0;
  const size_t count = std::min(kViews, capture.views.size());
  for (size_t i = 0; i < count; ++i) {
    progress.checkpoint();
    const Image outline = silhouette(capture.views[i * capture.views.size() / count].camera, impostor);
    shown += static_cast<double>(std::ranges::count(outline.values, 1.f));
    pixelsLooked += static_cast<double>(outline.values.size());
  }
  for (size_t view = 0; view < frames.size(); ++view) {
    const Lens& lens = capture.views[view].camera.lens;
    const double stack = 1.0 * lens.width * lens.height * static_cast<double>(frames[view].size());
    values += 3 * stack * shown / pixelsLooked;
    largest = std::max(largest, stack);
  }
  const double surfels = surfelsAt(mesh, spacing), fades = surfels * static_cast<double>(frames.size());
  return {
      static_cast<size_t>(surfels), static_cast<uint64_t>(2 * values / kRatio + 44 * surfels + fades / 8),
      static_cast<uint64_t>(std::max(32 * largest, kBytesPerSurfel * surfels) + 3 * fades + 100 * surfels),
      kSecondsPerSurfel * surfels + kSecondsPerFade * fades + kSecondsPerValue * values};
}

} // namespace

PackReport pack(PackSource& source, const std::filesystem::path& folder, const PackOptions& options,
                const Progress& progress, const std::function<void(const PackEstimate&)>& announce) {
  const Capture& capture = source.training();
  const auto frames = framesByView(capture);
  if (frames.empty()) throw Error::mismatch("training frames", "none").at("frames").in(capture.file);
  const auto start = Clock::now();
  const Impostor geometry = source.impostor(options.impostor, progress);
  const TriangleMesh& mesh = geometry.mesh;
  const RayCaster<AcquisitionSpace> impostor(mesh, progress);

  PackReport report;
  report.geometry = geometry.origin;
  report.fits = geometry.fits;
  progress("surfels", 0);
  const double footprint = pixelFootprint(capture, mesh);
  const TriangleMesh surface =
      withoutEnclosed(mesh, impostor, std::max(footprint, spacingFor(mesh, kMostSurfels)), progress);
  const double spacing = options.surfels ? spacingFor(surface, *options.surfels)
                                         : std::max(footprint / 2, spacingFor(surface, kMostSurfels));
  const auto identityPath = folder / "views" / "identity";
  claimFolder(folder, identityPath);
  removeLitter(folder);
  if (announce) announce(estimate(capture, frames, surface, impostor, spacing, progress));
  const SurfelCloud cloud = sampleSurfels(surface, spacing, 1, progress);
  report.surfels = cloud.size();
  for (const View& view : capture.views) report.views.push_back(view.identity);
  report.lights = capture.lights.size();
  report.surfelSeconds = secondsSince(start);

  const auto fadeStart = Clock::now();
  std::vector<Camera<AcquisitionSpace>> cameras;
  for (const auto& view : capture.views) cameras.push_back(view.camera);
  const ViewFades fades = surfelFades(cloud, cameras, impostor, progress);
  report.fadeSeconds = secondsSince(fadeStart);

  const auto storeStart = Clock::now();
  const std::string identity = packIdentity(source, options.tolerance, mesh);
  const bool resumes = std::filesystem::exists(identityPath) && readFile(identityPath) == identity;
  const auto surveyPath = folder / "views" / "survey";
  std::optional<Survey> surveyed;
  if (resumes && std::filesystem::exists(surveyPath)) surveyed = parseSurvey(readFile(surveyPath));
  if (!std::filesystem::exists(identityPath)) writeFileAtomically(identityPath, identity);
  const auto normals =
      geometry.origin == Impostor::Origin::relief ? NormalsFrom::thesePhotographs : NormalsFrom::elsewhere;
  if (!surveyed) surveyed = survey(source, frames, mesh, normals, impostor, progress);
  StoreOptions store;
  store.tolerance = options.tolerance;
  store.white = report.white = surveyed->white;
  report.lightChoice = surveyed->lights;
  std::filesystem::remove(folder / "manifest.json"); // from now on the folder is unfinished
  if (!resumes) {
    removeViews(folder); // or a run that stops here would leave them to be taken for its own
    writeFileAtomically(identityPath, identity);
  }
  writeFileAtomically(surveyPath, surveyText(*surveyed));

  std::vector<size_t> missing;
  report.ofView.resize(frames.size());
  for (size_t view = 0; view < frames.size(); ++view) {
    progress.checkpoint();
    if (const auto earlier = finished(folder, view))
      report.ofView[view] = *earlier;
    else
      missing.push_back(view);
  }
  report.resumedViews = frames.size() - missing.size();
  for (size_t i = 0; i < missing.size(); ++i) {
    const size_t view = missing[i];
    const Progress ofView = partOf(progress, "reflectance images", i, missing.size());
    ofView("", 0);
    const LoadedView loaded = withMatte(source.pictures(frames[view], true, ofView), cameras[view], impostor);
    const EncodedView encoded = encodeView(loaded.stack, store, progress);
    writeFileAtomically(folder / errorPath(view), errorText(encoded.file, encoded.summary));
    writeFileAtomically(folder / viewFilePath(view), encoded.file);
    report.ofView[view] = encoded.summary;
    report.invalidTexels += loaded.invalidTexels;
  }
  for (const ViewSummary& summary : report.ofView) report.store += summary;
  writeModel(folder,
             {rigOf(capture, frames), cloud, fades, store.white, store.tolerance, surveyed->lights.blend},
             progress);
  report.storeSeconds = secondsSince(storeStart);
  progress("reflectance images", 1);
  return report;
}

PackReport pack(const Capture& capture, const std::filesystem::path& folder, const PackOptions& options,
                const Progress& progress, const std::function<void(const PackEstimate&)>& announce) {
  CaptureSource source(capture);
  return pack(source, folder, options, progress, announce);
}

} // namespace surflect
