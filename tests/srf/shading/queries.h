// Queries to packed studios, for tests of shading.
#pragma once

#include "srf/model/model.h"
#include "srf/shading/reference.h"
#include "srf/shading/shade.h"
#include "tests/support/random.h"
#include "tests/support/synthetic_capture.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

namespace surflect::studio {

inline Direction3<AcquisitionSpace, double> towardsViewer(const capture::View& view,
                                                          const Point3<AcquisitionSpace, double>& p0) {
  return capture::Viewpoint(view.camera).towards(p0);
}

inline Direction3<AcquisitionSpace> randomDirection(std::mt19937& random) {
  return assume<Direction3<AcquisitionSpace>>(randomUnit(random));
}

// Random surfels, viewers, lights and strengths. Viewers are outside the surface.
inline weights::QueryBatch randomBatch(const model::Model& model, size_t queries, size_t lights,
                                       std::mt19937& random) {
  std::uniform_real_distribution<float> strength(0.1f, 2);
  weights::QueryBatch batch;
  batch.lights = lights;
  for (size_t q = 0; q < queries; ++q) {
    const auto surfel = static_cast<uint32_t>(random() % model.cloud.size());
    batch.surfels.push_back(surfel);
    const auto towards = randomDirection(random);
    const bool outside = towards.raw().dot(model.cloud.p0[surfel].raw()) > 0;
    batch.towardsView.push_back(outside ? towards : -towards);
    for (size_t l = 0; l < lights; ++l) {
      batch.towardsLight.push_back(randomDirection(random));
      const float r = strength(random), g = strength(random), b = strength(random);
      batch.irradiance.push_back({r, g, b});
    }
  }
  return batch;
}

// A blended captured light and the factor of its radiance.
struct RowEntry {
  uint32_t light;
  Rgb weight;
  friend bool operator==(const RowEntry&, const RowEntry&) = default;
};

inline std::vector<RowEntry> rowOf(const shading::ShadingPlan& plan, const shading::ShadingOp& op) {
  std::vector<RowEntry> row;
  for (uint32_t i = op.rowBegin; i < op.rowEnd; ++i) {
    const auto& [color, begin, end] = plan.rows.lights[i];
    for (uint32_t j = begin; j < end; ++j)
      row.push_back({plan.rows.weights[j].light, plan.rows.weights[j].weight * color});
  }
  return row;
}

inline Rgb capturedIrradiance(const model::Model& model, const shading::ShadingOp& op, uint32_t column,
                              uint32_t surfel) {
  return capture::irradianceAt(model.rig.lights[model.columns[op.view][column]],
                               model.cloud.p0[surfel].cast<double>());
}

// Rays from each surfel to each camera that sees it unfaded, under a light of that camera.
struct CapturedRays {
  weights::QueryBatch batch;
  std::vector<std::pair<uint32_t, uint32_t>> photographs; // view and column, per query
};

inline CapturedRays capturedRays(const model::Model& model, std::mt19937& random) {
  CapturedRays rays;
  weights::QueryBatch& batch = rays.batch;
  batch.lights = 1;
  for (uint32_t surfel = 0; surfel < model.cloud.size(); ++surfel)
    for (uint32_t view = 0; view < model.rig.views.size(); ++view) {
      if (model.visibility.of(surfel)[view] < 255) continue;
      const auto p0 = model.cloud.p0[surfel].cast<double>();
      const auto column = static_cast<uint32_t>(random() % model.columns[view].size());
      const capture::Light& light = model.rig.lights[model.columns[view][column]];
      batch.surfels.push_back(surfel);
      batch.towardsView.push_back(towardsViewer(model.rig.views[view], p0).cast<float>());
      batch.towardsLight.push_back(capture::towardsLight(light, p0).cast<float>());
      batch.irradiance.push_back(capture::irradianceAt(light, p0));
      rays.photographs.emplace_back(view, column);
    }
  return rays;
}

inline Studio unevenGappyStudio() {
  Studio studio = gappyStudio();
  studio.unevenness = 0.5;
  return studio;
}

// Studio without one in eleven of its frames.
inline Studio nearlyFullStudio() {
  return {.split = [](size_t view, size_t light) {
    return (view * 5 + light) % 11 == 0 ? std::nullopt : std::optional(capture::Split::train);
  }};
}

inline Studio fullStudio() { return {}; }

// Queries to a studio that is packed once for all suites; each test opens the model anew.
template <Studio (*photographed)(), size_t surfels, unsigned seed> class Queries : public ::testing::Test {
protected:
  static const PackedStudio& packed() {
    static const PackedStudio once(photographed(), surfels);
    return once;
  }

  model::Model model = model::openModel(packed().model.folder);
  std::mt19937 random{seed};
};

inline constexpr size_t everything = size_t{1} << 30; // cache budget in bytes

// Largest difference between shaded radiance and reference, relative to white.
inline double errorOfShading(const model::Model& model, const weights::QueryBatch& batch,
                             const weights::ShadeOptions& options) {
  codec::BlockCache cache(model.files, everything);
  shading::ShadingStats stats;
  const auto fast = shading::shade(model, batch, options, cache, stats).radiance;
  const auto exact = shading::shadeReference(shading::planReference(model, batch, options), cache);
  double worst = 0;
  EXPECT_EQ(fast.size(), exact.size());
  for (size_t q = 0; q < exact.size(); ++q)
    worst = std::max({worst, std::abs(fast[q].r - exact[q][0]), std::abs(fast[q].g - exact[q][1]),
                      std::abs(fast[q].b - exact[q][2])});
  return worst / model.white;
}

inline void addEnvironment(weights::QueryBatch& batch, std::span<const weights::EnvironmentLight> lights,
                           std::mt19937& random) {
  batch.environments.push_back({lights, {0.5f, 1, 2}, weights::LightExtrapolation::fade, nullptr});
  for (size_t q = 0; q < batch.size(); ++q)
    batch.acquisitionFromEnvironment.emplace_back(turnFromZ(randomDirection(random).raw()));
}

// Gives a model two random tables, and each surfel a random tilt, fibre, mixture, gain and share of them.
inline void giveTables(model::Model& model, std::mt19937& random) {
  std::uniform_real_distribution<float> any(0, 1);
  reflectance::SharedReflectance shared{0.3f, {{{9, 9, 3, 3}}, {}}, {1, 0.75f}, {}, {}, {}, {}};
  for (size_t table = 0; table < 2; ++table) {
    std::vector<Rgb> nodes;
    for (size_t node = 0; node < shared.tables.grid.size(); ++node) {
      const float r = any(random), g = any(random), b = any(random);
      nodes.push_back({r, g, b});
    }
    shared.tables.add(nodes);
  }
  for (size_t surfel = 0; surfel < model.cloud.size(); ++surfel) {
    shared.tilts.push_back({0.2f * any(random) - 0.1f, 0.2f * any(random) - 0.1f});
    shared.fibres.push_back(Angle::fromDegrees(180 * any(random)));
    const float weight = any(random);
    shared.mixtures.push_back({{0, 1, 0}, {weight, 1 - weight, 0}});
    const float r = any(random), g = any(random), b = any(random);
    shared.gains.push_back({r + 0.5f, g + 0.5f, b + 0.5f});
  }
  model.shared = std::move(shared);
  model.interpolation.kind = weights::Interpolation::shared;
}

// A glossy studio packed with tables, once for all suites.
inline const PackedStudio& tableStudio() {
  static const PackedStudio once = [] {
    model::PackOptions options = packOptions(1500);
    options.tables = true;
    return PackedStudio(Studio{.cameras = 20, .lights = 12, .gloss = 1}, options);
  }();
  return once;
}

class TableQueries : public ::testing::Test {
protected:
  model::Model model = model::openModel(tableStudio().model.folder);
  std::mt19937 random{4};
};

using ProductQueries = Queries<fullStudio, 2000, 1>;
using PairQueries = Queries<unevenGappyStudio, 1000, 2>;    // wide gaps; lights of different strengths
using NearPairQueries = Queries<nearlyFullStudio, 1000, 3>; // a few gaps

} // namespace surflect::studio
