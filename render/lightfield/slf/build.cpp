#include "render/lightfield/slf/build.h"

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/common/photographs.h"
#include "render/lightfield/common/sight.h"
#include "render/lightfield/slf/charts.h"
#include "render/lightfield/slf/field_file.h"
#include "render/lightfield/slf/regions.h"
#include "render/lightfield/slf/resample.h"
#include "render/lightfield/slf/texel_radiance.h"
#include "render/lightfield/slf/unseen_texels.h"
#include "srf/image/half_float.h"
#include "surfel/base/error.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/smooth_normals.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

namespace surflect::slf {

namespace {

// Texels of regions that are in memory together.
constexpr size_t kBatchTexels = 40'000;

// Calls work and adds the seconds it takes.
template <class Work> auto timed(double& seconds, const Work& work) {
  const Stopwatch watch;
  if constexpr (std::is_void_v<decltype(work())>) {
    work();
    seconds += watch.seconds();
  } else {
    auto result = work();
    seconds += watch.seconds();
    return result;
  }
}

// Subdivisions of an octahedron that has so many vertices: 4^n 4 + 2.
int subdivisionsOf(size_t directions) {
  for (int subdivisions = 0; subdivisions <= 4; ++subdivisions)
    if (directions == (size_t{4} << 2 * subdivisions) + 2) return subdivisions;
  throw Error::mismatch("6, 18, 66, 258 or 1026", std::to_string(directions)).at("directions");
}

DirectionMesh subdividedOctahedron(size_t directions) {
  return DirectionMesh(octahedronDirections(subdivisionsOf(directions)));
}

std::vector<capture::Camera<AcquisitionSpace>> trainingCameras(const lightfield::Views& views) {
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const size_t view : views.ofSplit(capture::Split::train)) cameras.push_back(views.camera(view));
  return cameras;
}

// Texels that a picture can show in a used direction, and those of them that were not observed.
struct Shown {
  size_t texels = 0, invented = 0;
};

Shown shownTexels(const TriangleMesh& mesh, const std::vector<TexelPoint>& points,
                  const DirectionMesh& directions, const RegionTextures& textures) {
  Shown shown;
  for (size_t texel = 0; texel < points.size(); ++texel) {
    if (points[texel].meshTriangle == TexelPoint::kNone) continue;
    const Vec3<double> normal = areaVector(mesh, points[texel].meshTriangle);
    for (size_t i = 0; i < textures.textures.size(); ++i) {
      if (textures.textures[i].empty() || !(directions.directions()[i].raw().dot(normal) > 0)) continue;
      ++shown.texels;
      shown.invented += textures.textures[i][texel][3] == 0;
    }
  }
  return shown;
}

// A region on its way to the file.
struct Work {
  std::vector<TexelPoint> points;
  std::optional<Observations> observations;
  std::optional<DirectionMesh> ownDirections; // none: the base directions
  std::vector<uint8_t> isUsed;
  RegionTextures textures;
};

class Builder {
public:
  Builder(const lightfield::Views& views, std::vector<Chart> charts, const BuildOptions& options,
          const Progress& progress)
      : views_(views), options_(options), progress_(progress), charts_(std::move(charts)),
        base_(subdividedOctahedron(
            options.directions.value_or(directionsFor(views.ofSplit(capture::Split::train).size())))),
        photographs_(
            timed(report.photographSeconds, [&] { return lightfield::Photographs(views, progress); })),
        sight_(photographs_, views.rays()), normals_(views.mesh(), progress) {
    field_.mesh = views.mesh();
    field_.directionMeshes.push_back(base_);
    meshIndices_[directionsOf(base_)] = 0;
    if (options_.tolerance > 0) whiteLevel_ = photographs_.whiteLevel();
    report.regions = charts_.size();
    report.photographs = photographs_.size();
    report.directions = base_.directions().size();
  }

  BuildReport report;

  void writeTextures(TextureWriter& file) {
    for (size_t begin = 0; begin < charts_.size();) {
      size_t end = begin;
      for (size_t texels = 0; end < charts_.size() && (end == begin || texels < kBatchTexels); ++end)
        texels += charts_[end].texels();
      progress_("textures", static_cast<double>(begin) / static_cast<double>(charts_.size()));
      std::vector<Work> works(end - begin);
      timed(report.visibilitySeconds, [&] { forEach(works, begin, &Builder::observe); });
      timed(report.textureSeconds, [&] { forEach(works, begin, &Builder::resampleWork); });
      timed(report.fileSeconds, [&] {
        for (size_t i = 0; i < works.size(); ++i) store(works[i], begin + i, file);
      });
      begin = end;
    }
    progress_("textures", 1);
    timed(report.fillSeconds, [&] { fillUnseen(file); });
    report.texels = file.texels();
    report.inventedShare =
        shown_.texels > 0 ? static_cast<double>(shown_.invented) / static_cast<double>(shown_.texels) : 0;
  }

  // Direction meshes that regions have, in the order of the first region of each.
  std::vector<std::byte> fieldContent() {
    report.directionMeshes = field_.directionMeshes.size();
    report.textures = field_.textures();
    return fieldBytes(field_, places_);
  }

private:
  using DirectionKey = std::vector<std::array<double, 3>>;

  static DirectionKey directionsOf(const DirectionMesh& mesh) {
    DirectionKey key;
    for (const Direction& direction : mesh.directions())
      key.push_back({direction.x(), direction.y(), direction.z()});
    return key;
  }

  void forEach(std::vector<Work>& works, size_t first, void (Builder::*step)(Work&, size_t) const) const {
    tbb::parallel_for(size_t{0}, works.size(), [&](size_t i) {
      progress_.checkpoint();
      (this->*step)(works[i], first + i);
    });
  }

  void observe(Work& work, size_t region) const {
    work.points = texelPoints(views_.mesh(), charts_[region]);
    work.observations.emplace(work.points, views_.mesh(), normals_, sight_);
  }

  void resampleWork(Work& work, size_t region) const {
    if (options_.tolerance > 0) {
      const auto kept = adaptedDirections(directionalRadiance(*work.observations, base_, options_.blend),
                                          base_, options_.tolerance * whiteLevel_);
      std::vector<Direction> directions;
      for (const size_t i : kept) directions.push_back(base_.directions()[i]);
      work.ownDirections.emplace(std::move(directions));
    }
    const DirectionMesh& directions = work.ownDirections ? *work.ownDirections : base_;
    work.isUsed = usedDirections(views_.mesh(), charts_[region], directions);
    work.textures =
        resample(*work.observations, charts_[region].width, directions, work.isUsed, options_.blend);
  }

  uint32_t indexOf(const DirectionMesh& directions) {
    const auto [place, isNew] = meshIndices_.try_emplace(
        directionsOf(directions), static_cast<uint32_t>(field_.directionMeshes.size()));
    if (isNew) field_.directionMeshes.push_back(directions);
    return place->second;
  }

  void store(Work& work, size_t region, TextureWriter& file) {
    report.surfaceTexels += work.textures.texels;
    report.unseenTexels += work.textures.unseenTexels;
    const DirectionMesh& directions = work.ownDirections ? *work.ownDirections : base_;
    const Shown shown = shownTexels(views_.mesh(), work.points, directions, work.textures);
    shown_.texels += shown.texels;
    shown_.invented += shown.invented;
    std::vector<uint64_t>& places = places_.emplace_back(directions.directions().size(), kNotStored);
    SeenRegion& seen = seen_.emplace_back();
    for (size_t texel = 0; texel < work.observations->texels(); ++texel)
      seen.isSeen.push_back(!work.observations->of(texel).empty());
    if (work.textures.isUnseen()) {
      // Has the base directions, and is written when its neighbours are known.
      field_.regions.push_back({charts_[region], 0});
      places.assign(base_.directions().size(), kNotStored);
      seen.isUsed = usedDirections(views_.mesh(), charts_[region], base_);
      return;
    }
    field_.regions.push_back({charts_[region], indexOf(directions)});
    seen.isUsed = work.isUsed;
    for (size_t i = 0; i < places.size(); ++i)
      if (work.isUsed[i]) places[i] = file.append(work.textures.textures[i]), ++report.texturesStored;
  }

  void fillUnseen(TextureWriter& file) {
    report.unseenRegions = static_cast<size_t>(std::ranges::count_if(seen_, &SeenRegion::isUnseen));
    const TextureStore store{[&](size_t region, size_t direction) {
                               return file.read(places_[region][direction], charts_[region].texels());
                             },
                             [&](size_t region, size_t direction, std::span<const Texel> texels) {
                               uint64_t& place = places_[region][direction];
                               if (place != kNotStored) return file.replace(place, texels);
                               place = file.append(texels); // of an unseen region
                               ++report.texturesStored;
                             }};
    // Black regions are not stored.
    const std::vector<uint8_t> isBlack = fillUnseenTexels(
        field_, seen_, base_, borderPoints(views_.mesh(), charts_, report.texelSize), store, progress_);
    report.blackRegions = static_cast<size_t>(std::ranges::count(isBlack, 1));
  }

  const lightfield::Views& views_;
  const BuildOptions& options_;
  const Progress& progress_;
  std::vector<Chart> charts_;
  DirectionMesh base_;
  lightfield::Photographs photographs_;
  lightfield::Sight sight_;
  SmoothNormals normals_;
  double whiteLevel_ = 1;
  Field field_;
  TexturePlaces places_;
  std::vector<SeenRegion> seen_;
  std::map<DirectionKey, uint32_t> meshIndices_;
  Shown shown_;
};

void requireOptions(const BuildOptions& options) {
  if (options.regions < 1) throw Error::mismatch("at least 1", "0").at("regions");
  if (!(options.tolerance >= 0 && std::isfinite(options.tolerance)))
    throw Error::mismatch("a number not below 0", numberText(options.tolerance)).at("tolerance");
  if (options.directions) subdivisionsOf(*options.directions);
}

size_t texelsOf(std::span<const Chart> charts) {
  size_t texels = 0;
  for (const Chart& chart : charts) texels += chart.texels();
  return texels;
}

} // namespace

size_t directionsFor(size_t photographs) {
  const auto ratio = [&](size_t directions) {
    const auto a = static_cast<double>(directions), b = static_cast<double>(std::max<size_t>(1, photographs));
    return std::max(a / b, b / a);
  };
  constexpr std::array<size_t, 3> kChoices{18, 66, 258};
  return *std::ranges::min_element(kChoices, {}, ratio);
}

BuildReport buildWithCharts(const lightfield::Views& views, std::vector<Chart> charts,
                            const BuildOptions& options, const std::filesystem::path& path,
                            const Progress& progress) {
  requireOptions(options);
  lightfield::LightFieldWriter folder(path, kFormatTag, kFormatVersion);
  const double area = surfaceArea(views.mesh());
  const double texelSize = std::sqrt(area / static_cast<double>(std::max<size_t>(1, texelsOf(charts))));
  Builder builder(views, std::move(charts), options, progress);
  builder.report.texelSize = texelSize;
  builder.report.pixelFootprint = lightfield::pixelFootprint(views.mesh(), trainingCameras(views));
  TextureWriter textures(folder.file(kTexturesFile));
  builder.writeTextures(textures);
  timed(builder.report.fileSeconds, [&] {
    textures.commit();
    const std::vector<std::byte> field = builder.fieldContent();
    writeFileAtomically(folder.file(kFieldFile), field);
    const capture::Capture training = capture::subset(
        views.capture(), [](const capture::Frame& frame) { return frame.split == capture::Split::train; });
    folder.commit(training, views.mesh(),
                  {{"regions", static_cast<double>(builder.report.regions)},
                   {"textures", static_cast<double>(builder.report.textures)},
                   {"texels", static_cast<double>(builder.report.texels)},
                   {"surface_texels", static_cast<double>(builder.report.surfaceTexels)}},
                  progress);
  });
  builder.report.bytes = lightfield::LightFieldFolder(path, kFormatTag, kFormatVersion, progress).bytes();
  return builder.report;
}

BuildReport build(const lightfield::Views& views, const BuildOptions& options,
                  const std::filesystem::path& folder, const Progress& progress) {
  requireOptions(options);
  const Stopwatch watch;
  const TriangleMesh& mesh = views.mesh();
  const double footprint = lightfield::pixelFootprint(mesh, trainingCameras(views));
  const size_t most = options.texels > 0 ? options.texels : kMostTexels;
  double texelSize = std::sqrt(surfaceArea(mesh) / static_cast<double>(most));
  if (options.texels == 0) texelSize = std::max(texelSize, footprint);
  const Regions regions = regionsOf(mesh, {.regions = options.regions}, progress);
  // Rectangles have more texels than the surface needs.
  FittedCharts fitted = fittedCharts(mesh, regions, texelSize, most, progress);
  texelSize = fitted.texelSize;
  const double seconds = watch.seconds();
  BuildReport report = buildWithCharts(views, std::move(fitted.charts), options, folder, progress);
  report.texelSize = texelSize;
  report.regionSeconds = seconds;
  return report;
}

} // namespace surflect::slf
