#include "tests/stability/entry.h"

#include "render/surfels/queries.h"
#include "srf/model/shared_surface.h"
#include "srf/model/weights_selection.h"
#include "srf/shading/shade.h"
#include "tests/render/films.h"
#include "tests/srf/reflectance/planted.h"
#include "tests/srf/shading/queries.h"

namespace surflect::stability {
namespace {

using studio::PackedStudio;
using studio::Studio;

constexpr float kGloss = 0.3f;
constexpr size_t kSurfels = 1200;

const PackedStudio& glossyStudio() {
  static const PackedStudio packed({.cameras = 20, .lights = 12, .gloss = kGloss}, kSurfels);
  return packed;
}

// Tilts the normals of a sphere by a smooth field of this size, RMS.
void tiltNormals(SurfelCloud& cloud, double degrees) {
  const double size = degrees * std::numbers::pi / 180;
  for (size_t i = 0; i < cloud.size(); ++i) {
    const Vec3<double> p = cloud.p0[i].raw().cast<double>(), n = p.normalized();
    Vec3<double> tilt(std::sin(5 * p.y() + 1), std::sin(5 * p.z() + 2), std::sin(5 * p.x() + 3));
    tilt -= tilt.dot(n) * n; // of mean square 1
    cloud.r0[i] = rodriguesOf(assume<Normal3<AcquisitionSpace, double>>((n + size * tilt).normalized()));
  }
}

// RMS error of random queries to a glossy sphere, relative to white.
double errorOf(const model::Model& model, const weights::QueryBatch& batch) {
  codec::BlockCache cache(model.files, size_t{256} << 20);
  shading::ShadingStats stats;
  const std::vector<Rgb> radiance = shading::shade(model, batch, {}, cache, stats).radiance;
  double sum = 0;
  for (size_t i = 0; i < batch.size(); ++i) {
    const Vec3<float> n = model.cloud.p0[batch.surfels[i]].raw().normalized();
    const Vec3<float> light = batch.towardsLight[i].raw(), view = batch.towardsView[i].raw();
    const Rgb truth = studio::lambert(Studio{}.albedo, {1, 1, 1}, n, light) +
                      kGloss * studio::highlight({1, 1, 1}, n, light, view);
    sum += std::pow(double{radiance[i].g} - truth.g, 2);
  }
  return std::sqrt(sum / static_cast<double>(batch.size())) / model.white;
}

// A model with tables of its photographs, used as far as they predict those that are left out. Naive: without
// tables.
Measured answersOf(model::Model model) {
  std::mt19937 random(9);
  weights::QueryBatch batch;
  batch.lights = 1;
  std::uniform_int_distribution<uint32_t> any(0, static_cast<uint32_t>(model.cloud.size() - 1));
  while (batch.size() < 4000) {
    const uint32_t surfel = any(random);
    const Vec3<float> n = model.cloud.p0[surfel].raw().normalized();
    const auto view = studio::randomDirection(random), light = studio::randomDirection(random);
    if (view.raw().dot(n) < 0.3f || light.raw().dot(n) < 0.3f) continue;
    batch.surfels.push_back(surfel);
    batch.towardsView.push_back(view);
    batch.towardsLight.push_back(light);
    batch.irradiance.push_back({1, 1, 1});
  }
  const model::SharedSample sample = model::shareSample(model);
  model.shared = model::spreadOver(model, sample);
  const auto [choice, foreshortened, trust, leftOut] = model::selectInterpolation(model, true, &sample);
  model.interpolation = choice;
  model.lightBlend.foreshortened = foreshortened;
  model.shared->trust = trust;
  const double ours = errorOf(model, batch);
  model.interpolation.kind = weights::Interpolation::separate;
  return {errorOf(model, batch), ours};
}

Measured normalsOff(double degrees) {
  model::Model model = model::openModel(glossyStudio().model.folder);
  tiltNormals(model.cloud, degrees);
  return answersOf(std::move(model));
}

Measured fewLights(int lights) {
  const PackedStudio packed({.cameras = 20, .lights = lights, .gloss = kGloss}, kSurfels);
  return answersOf(model::openModel(packed.model.folder));
}

// Angle between a groove across a sheared plate and the fibre that its table is asked for, radians. Naive:
// tangents by the polar factor.
Measured shearedGroove() {
  const Vec3<double> groove(0.8, 1, 0); // was (0, 1, 0)
  DeformedCloud plate;
  plate.p = {Point3<ObjectSpace>{0, 0, 0}};
  plate.u = {Direction3<ObjectSpace>{1, 0, 0}};
  plate.v = {assume<Direction3<ObjectSpace>>(Vec3<float>(groove.cast<float>()))};
  plate.handedness = {Handedness::kept};
  const auto missed = [&](const DeformedCloud& cloud) {
    const auto frame = polarFrame<double>(cloud.u[0].raw().cast<double>(), cloud.v[0].raw().cast<double>());
    return std::atan2(groove.cross(frame->v).norm(), std::abs(groove.dot(frame->v)));
  };
  return {missed(plate), missed(surfels::withCarriedLines(plate, std::array{Angle::fromDegrees(90)}))};
}

// RMS error of reflectance predicted by tables, relative to white, at the surfels of a brushed kind: the
// `rare` ones furthest to the right of a glossy disc. Naive: one table for all.
Measured brushedAmongGlossy(size_t rare) {
  namespace planted = reflectance::planted;
  constexpr size_t kDisc = 600;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-1, 1);
  std::vector<Point3<AcquisitionSpace>> places;
  while (places.size() < kDisc) {
    const float x = any(random), y = any(random);
    if (std::hypot(x, y) <= 1) places.push_back({x, y, 0});
  }
  std::ranges::sort(places, {}, [](const auto& place) { return place.x(); });
  const std::vector<reflectance::SurfelFrame> frames(kDisc,
                                                     reflectance::SurfelFrame(Mat3<float>::Identity()));
  reflectance::PhotographArrays photographs;
  for (size_t s = 0; s < kDisc; ++s)
    addSurfel(photographs, s + rare < kDisc ? planted::kGlossy : planted::kBrushed, {1, 1, 1}, 40, random);
  std::vector<Direction3<reflectance::SurfelSpace>> views, lights;
  for (int i = 0; i < 200; ++i) {
    views.push_back(planted::above(random, 0.3));
    lights.push_back(planted::above(random, 0.3));
  }
  const auto error = [&](size_t mostTables) {
    const reflectance::SharedReflectance shared =
        shareReflectance(photographs.view(), {places, frames},
                         {.white = planted::kWhite, .grid = {{17, 17, 5, 5}}, .mostTables = mostTables});
    std::vector<Rgb> got(views.size());
    double sum = 0;
    for (size_t s = kDisc - rare; s < kDisc; ++s) {
      const Eigen::AngleAxisf turn(static_cast<float>(-shared.fibres[s].radians()), Vec3<float>::UnitZ());
      const auto turned = [&](auto directions) {
        for (auto& direction : directions)
          direction = assume<Direction3<reflectance::SurfelSpace>>(turn * direction.raw());
        return directions;
      };
      predictReflectance(shared.tables, shared.mixtures[s], turned(views), turned(lights), got);
      for (size_t i = 0; i < got.size(); ++i)
        sum += std::pow(shared.gains[s].g * got[i].g -
                            planted::reflectanceOf(planted::kBrushed, views[i], lights[i]).g,
                        2);
    }
    return std::sqrt(sum / static_cast<double>(rare * got.size())) / planted::kWhite;
  };
  return {error(1), error(8)};
}

} // namespace

Group sharedGroup() {
  return {
      "Tables of reflectance",
      "three cameras and three lights apart (`separate`), without tables",
      {
          {"normals 2 degrees off", "highlights where they are", "RMS error", 0.016,
           [] { return normalsOff(2); }},
          {"normals 5 degrees off", "highlights where they are", "RMS error", 0.022,
           [] { return normalsOff(5); }},
          {"normals 10 degrees off", "better than without tables", "RMS error", 0.033,
           [] { return normalsOff(10); }},
          {"four lights", "no worse than without tables", "RMS error", 0.025, [] { return fewLights(4); }},
          {"20 brushed surfels among 580 glossy ones", "better than one table", "RMS error", 0.15,
           [] { return brushedAmongGlossy(20); }, "one table for all"},
          {"300 brushed surfels beside 300 glossy ones", "better than one table", "RMS error", 0.09,
           [] { return brushedAmongGlossy(300); }, "one table for all"},
          {"a groove across a plate that is sheared by 0.8", "the table's fibre follows it",
           "angle between them, radians", 1e-6, shearedGroove, "tangents by the polar factor"},
      }};
}

} // namespace surflect::stability
