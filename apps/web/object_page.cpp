#include "apps/web/object_page.h"

#include "render/lightfield/lfm/edge_corrections.h"
#include "render/lightfield/lfm/map_drawing.h"
#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/radiance.h"
#include "render/lightfield/lfm/tile.h"
#include "render/scene/turntable.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace surflect::web {

namespace {

using lfm::LightFieldMaps, lfm::MapTable, lfm::MapShape, lfm::Coding;

// Sizes that every browser with WebGL 2 has [WebGL 2, section 3.7.2]: texels of a texture's side, layers; and
// texels of the page's table of places, a texel for each map of a triangle.
constexpr int kSide = 2048, kLayers = 256;
constexpr size_t kMostPlaces = size_t{kSide} * kSide;
constexpr double kWhitePercentile = 0.995; // as of films (film::whiteOf)
// Shares of a turn that are looked at: five of the 48 frames of a turn-table.
constexpr std::array kExposedShares{0 / 48.0, 11 / 48.0, 23 / 48.0, 35 / 48.0, 47 / 48.0};
// Barycentrics of the middles of a triangle's four equal parts.
constexpr std::array<std::array<double, 2>, 4> kQuarters{
    {{1 / 3.0, 1 / 3.0}, {1 / 6.0, 1 / 6.0}, {2 / 3.0, 1 / 6.0}, {1 / 6.0, 2 / 3.0}}};
constexpr size_t kMostBytes = size_t{256} << 20; // of all maps

template <class Number> std::string base64Of(std::span<const Number> numbers) {
  return base64({reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()});
}

Json tableOf(const MapTable& table) {
  Json json = {{"count", table.maps.count}, {"data", base64Of(std::span(table.maps.data))}};
  if (lfm::isIdentity(table)) return json;
  const size_t bytes = lfm::indexBytes(table);
  json["indexBytes"] = bytes;
  const std::vector<uint16_t> narrow(table.mapOf.begin(), table.mapOf.end()); // kNoMap: all bits 1
  json["mapOf"] = bytes == 2 ? base64Of(std::span<const uint16_t>(narrow))
                             : base64Of(std::span<const uint32_t>(table.mapOf));
  return json;
}

const char* nameOf(Coding coding) { return coding == Coding::bytes ? "bytes" : "dxt1"; }

// A channel of radiance that a viewer sees, and the area that has it.
struct SeenRadiance {
  double radiance, area;
};

// Area-weighted percentile of radiance, of a share in 0..1.
double percentileOf(std::vector<SeenRadiance> seen, double share) {
  std::ranges::sort(seen, {}, &SeenRadiance::radiance);
  double all = 0, sum = 0;
  for (const SeenRadiance& each : seen) all += each.area;
  for (const SeenRadiance& each : seen)
    if ((sum += each.area) >= share * all) return each.radiance;
  return 0;
}

// Radiance that is shown as white: the largest 99.5th percentile over five views of a turn. Near that of
// films (within 0.3 stops), which leave out hidden surfaces and add corrections on edges.
double whiteOf(const LightFieldMaps& maps, const scene::TurntableOrbit& orbit, const Progress& progress) {
  double white = 0;
  for (size_t i = 0; i < kExposedShares.size(); ++i) {
    progress("exposure", static_cast<double>(i) / kExposedShares.size());
    const double share = kExposedShares[i];
    const double azimuth = orbit.firstAzimuthDeg + (orbit.lastAzimuthDeg - orbit.firstAzimuthDeg) * share;
    const Vec3<double> eye =
        orbit.center + orbit.distance * scene::towardsOrbit(orbit.up, Angle::fromDegrees(azimuth),
                                                            Angle::fromDegrees(orbit.elevationDeg));
    std::vector<SeenRadiance> seen;
    for (size_t t = 0; t < maps.mesh.triangles.size(); ++t) {
      std::array<Vec3<double>, 3> corners;
      for (size_t corner = 0; corner < 3; ++corner)
        corners[corner] = maps.mesh.positions[maps.mesh.triangles[t][corner]].raw().cast<double>();
      const Vec3<double> side = corners[1] - corners[0], other = corners[2] - corners[0];
      for (const auto& [b, c] : kQuarters) {
        const Vec3<double> d = (eye - corners[0] - b * side - c * other).normalized();
        const double area = side.cross(other).dot(d);
        if (area <= 0) continue;
        const lfm::Channels radiance =
            lfm::radianceAt(maps, {t, b, c}, assume<lfm::Direction>(d), maps.terms.size());
        for (Eigen::Index channel = 0; channel < 3; ++channel) seen.push_back({radiance[channel], area});
      }
    }
    white = std::max(white, percentileOf(std::move(seen), kWhitePercentile));
  }
  return white;
}

double stopsOf(double white) {
  if (!(white > 0)) return 0;
  return std::clamp(std::round(-1000 * std::log2(white)) / 1000, -kMostStops, kMostStops);
}

std::string meshNumbers(const TriangleMesh& mesh) {
  std::vector<float> numbers;
  for (const auto& position : mesh.positions)
    for (Eigen::Index i = 0; i < 3; ++i) numbers.push_back(position.raw()[i]);
  return base64Of(std::span<const float>(numbers));
}

std::string triangleNumbers(const TriangleMesh& mesh, bool isNarrow) {
  std::vector<uint32_t> wide;
  for (const auto& triangle : mesh.triangles) wide.insert(wide.end(), triangle.begin(), triangle.end());
  const std::vector<uint16_t> narrow(wide.begin(), wide.end());
  return isNarrow ? base64Of(std::span<const uint16_t>(narrow)) : base64Of(std::span<const uint32_t>(wide));
}

// x and y axes of the vertices' frames.
std::string frameNumbers(std::span<const lfm::VertexFrame> frames) {
  std::vector<float> numbers;
  for (const lfm::VertexFrame& frame : frames)
    for (const Vec3<double>& axis : {frame.x, frame.y})
      for (Eigen::Index i = 0; i < 3; ++i) numbers.push_back(static_cast<float>(axis[i]));
  return base64Of(std::span<const float>(numbers));
}

Json list(const Vec3<double>& v) { return {v.x(), v.y(), v.z()}; }

} // namespace

void requireHeldByPage(const LightFieldMaps& maps) {
  atField("maps", [&] {
    if (maps.channels != 3)
      throw Error::mismatch("3 channels, as pages draw opaque objects", std::to_string(maps.channels))
          .at("channels");
    if (maps.higherViewSize != maps.viewSize)
      throw Error::mismatch(
          fmt::format("{}, as in the first term: pack without --higher-view-size", maps.viewSize),
          std::to_string(maps.higherViewSize))
          .at("cells of higher view maps");
    const size_t triangles = maps.mesh.triangles.size(), terms = maps.terms.size();
    if (triangles == 0) throw Error::mismatch("at least one", "none").at("triangles");
    const size_t placesOfTerm = maps.layout == lfm::SurfaceLayout::packed ? 4 : 6,
                 places = triangles * (1 + terms * placesOfTerm);
    if (places > kMostPlaces)
      throw Error(fmt::format("{} of {} are more than a page holds: pack with fewer --triangles or --terms",
                              counted(triangles, "triangle"), counted(terms, "term")));
    if (const size_t bytes = lfm::bytesOf(maps).total(); bytes > kMostBytes)
      throw Error(fmt::format(
          "{:.3f} MB are more than the {:.3f} MB that a page holds: pack with --s3tc, --vq or fewer "
          "--triangles",
          static_cast<double>(bytes) / 1e6, static_cast<double>(kMostBytes) / 1e6));
    const auto requireLayers = [&](const MapShape& shape, const lfm::MapSet& set) {
      const lfm::TilingLimits limits{.side = kSide,
                                     .layers = kLayers / static_cast<int>(std::max<size_t>(1, terms)),
                                     .largestSide = kSide};
      lfm::tilingOf(lfm::tileShapeOf(shape, set.coding), lfm::tilesOf(shape, set.coding, set.count), limits);
    };
    for (const lfm::Term& term : maps.terms) {
      requireLayers(lfm::surfaceShape(maps), term.surface.maps);
      requireLayers(lfm::viewShape(maps, 0), term.view.maps);
    }
    requireLayers(lfm::meanShape(maps), maps.mean.maps);
  });
}

ObjectPageReport writeObjectPage(const lfm::OpenedMaps& model, const std::filesystem::path& folder,
                                 const ObjectPageOptions& options, const PageMark& mark,
                                 const Progress& progress) {
  const LightFieldMaps& maps = model.maps;
  const TriangleMesh& mesh = maps.mesh;
  const scene::TurntableOrbit orbit = scene::turntableOrbit(
      {.model = "", .rig = model.folder.rig(), .points = mesh.positions, .isBaked = true});
  const LightFieldMaps decoded = lfm::decoded(maps);
  ObjectPageReport report{mesh.triangles.size(), mesh.positions.size(), maps.terms.size(),
                          options.stops ? *options.stops : stopsOf(whiteOf(decoded, orbit, progress))};
  const lfm::EdgeCorrections edges = lfm::edgeCorrections(decoded);

  const bool isNarrow = mesh.positions.size() <= UINT16_MAX;
  Json data = {{"object", mark.object},
               {"samples", maps.samples},
               {"viewSize", maps.viewSize},
               {"packed", maps.layout == lfm::SurfaceLayout::packed},
               {"isSigned", maps.method == lfm::Factorization::pca},
               {"meanWhite", maps.meanWhite},
               {"fadeSteps", lfm::kFadeSteps},
               {"stops", report.stops}};
  if (mark.scale) data["mmPerUnit"] = *mark.scale;
  data["camera"] = {
      {"center", list(orbit.center)},   {"up", list(orbit.up)}, {"radius", orbit.ballRadius},
      {"distance", orbit.distance},     {"fov", orbit.fovDeg},  {"azimuth", orbit.firstAzimuthDeg},
      {"elevation", orbit.elevationDeg}};
  if (!orbit.isWhole) { // visitors start in the middle of the photographed sector, and are told outside of it
    data["camera"]["azimuth"] = 0.5 * (orbit.firstAzimuthDeg + orbit.lastAzimuthDeg);
    data["camera"]["sector"] = {orbit.firstAzimuthDeg, orbit.lastAzimuthDeg};
  }
  data["coding"] = {
      {"surface", nameOf(maps.terms.empty() ? Coding::bytes : maps.terms[0].surface.maps.coding)},
      {"view", nameOf(maps.terms.empty() ? Coding::bytes : maps.terms[0].view.maps.coding)},
      {"mean", nameOf(maps.mean.maps.coding)}};
  data["edges"] = {{"surface", !edges.surface.empty()}, {"mean", !edges.mean.empty()}};
  Json& counts = data["counts"] = Json::array();
  for (const lfm::Term& term : maps.terms)
    counts.push_back({{"surface", term.surface.maps.count}, {"view", term.view.maps.count}});
  data["positions"] = meshNumbers(mesh);
  data["triangleBytes"] = isNarrow ? 2 : 4;
  data["triangles"] = triangleNumbers(mesh, isNarrow);
  data["frames"] = frameNumbers(maps.frames);
  if (maps.mean.maps.count > 0) data["mean"] = tableOf(maps.mean);

  writePage("object.html", mark, folder);
  writeScript(folder / "data.js", "data", data);
  for (size_t k = 0; k < maps.terms.size(); ++k) {
    progress("terms", static_cast<double>(k) / static_cast<double>(maps.terms.size()));
    const lfm::Term& term = maps.terms[k];
    writeText(folder / fmt::format("term{}.js", k),
              fmt::format("surflect.term({},{});\n", k,
                          Json{{"scale", base64Of(std::span(term.scale))},
                               {"surface", tableOf(term.surface)},
                               {"view", tableOf(term.view)}}
                              .dump()));
  }
  return report;
}

} // namespace surflect::web
