#include "srf/weights/visibility_weights.h"

#include "srf/weights/fades.h"
#include "surfel/geometry/neighbors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace surflect::weights {

namespace {

constexpr size_t kSurfelsPerTask = 256;

// Calls work(begin, end) for fixed ranges of surfels in parallel.
template <class Work>
void forRuns(size_t surfels, std::string_view stage, const Progress& progress, const Work& work) {
  const size_t runs = (surfels + kSurfelsPerTask - 1) / kSurfelsPerTask;
  tbb::parallel_for(size_t{0}, runs, [&](size_t run) {
    progress.checkpoint();
    work(run * kSurfelsPerTask, std::min(surfels, (run + 1) * kSurfelsPerTask));
  });
  progress(stage, 1);
}

Normal3<AcquisitionSpace> normalOf(const SurfelCloud& cloud, size_t i) {
  return assume<Normal3<AcquisitionSpace>>(rotationOf<float>(cloud.r0[i]).col(2));
}

constexpr double kOctavesPerStep = 20.0 / 254; // of encoded fades

} // namespace

uint8_t VisibilityWeights::encode(double fade) {
  const double steps = 255 + std::log2(fade) / kOctavesPerStep; // -infinity for 0
  return steps < 0.5 ? 0 : static_cast<uint8_t>(std::lround(steps));
}

float VisibilityWeights::decode(uint8_t value) {
  static const auto table = [] {
    std::array<float, 256> fades{};
    for (size_t v = 1; v < fades.size(); ++v)
      fades[v] = static_cast<float>(std::exp2(kOctavesPerStep * (static_cast<double>(v) - 255)));
    return fades;
  }();
  return table[value];
}

std::vector<uint8_t> lineOfSight(const SurfelCloud& cloud,
                                 std::span<const capture::Viewpoint<AcquisitionSpace>> viewpoints,
                                 const RayCaster<AcquisitionSpace>& impostor, const Progress& progress) {
  std::vector<uint8_t> free(cloud.size() * viewpoints.size(), 0);
  const double offset = impostor.selfHitOffset();
  forRuns(cloud.size(), "visibility", progress, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const auto p = cloud.p0[i].cast<double>();
      const auto n = normalOf(cloud, i).cast<double>();
      // Lifted off the surface, since a surfel stands for a whole disc and its centre may lie inside a
      // crease.
      const double lift = std::max(offset, 0.25 * static_cast<double>(cloud.radius[i]));
      const auto lifted = p + assume<Direction3<AcquisitionSpace, double>>(lift * n.raw());
      for (size_t view = 0; view < viewpoints.size(); ++view) {
        const auto towards = viewpoints[view].towards(p);
        if (!(dot(n, towards) > 0)) continue;
        free[i * viewpoints.size() + view] =
            !impostor.occluded(lifted, towards, offset, viewpoints[view].distance(p));
      }
    }
  });
  return free;
}

struct SmoothedVisibility::Votes {
  size_t views;
  float radius;
  NeighborIndex index;
  std::vector<Vec3<float>> normals;
  std::vector<uint8_t> free, facing; // one row of a byte per view for each surfel

  Votes(const SurfelCloud& cloud, std::span<const capture::Viewpoint<AcquisitionSpace>> viewpoints,
        std::vector<uint8_t> sight, float reach, const Progress& progress)
      : views(viewpoints.size()), radius(reach), index(cloud.p0, progress), normals(cloud.size()),
        free(std::move(sight)), facing(cloud.size() * views) {
    tbb::parallel_for(size_t{0}, cloud.size(), [&](size_t i) {
      if (i % kSurfelsPerTask == 0) progress.checkpoint();
      const auto n = normalOf(cloud, i);
      normals[i] = n.raw();
      for (size_t view = 0; view < views; ++view)
        facing[i * views + view] =
            dot(n.cast<double>(), viewpoints[view].towards(cloud.p0[i].cast<double>())) > 0;
    });
  }
};

SmoothedVisibility::SmoothedVisibility(const SurfelCloud& cloud,
                                       std::span<const capture::Viewpoint<AcquisitionSpace>> views,
                                       std::vector<uint8_t> lineOfSight, float radius,
                                       const Progress& progress)
    : votes_(std::make_unique<Votes>(cloud, views, std::move(lineOfSight), radius, progress)) {}

SmoothedVisibility::~SmoothedVisibility() = default;

void SmoothedVisibility::at(const Point3<AcquisitionSpace>& p, const Normal3<AcquisitionSpace>& n,
                            std::span<float> visibility) const {
  std::vector<float> all(votes_->views, 0.f);
  std::ranges::fill(visibility, 0.f);
  for (const auto& [j, distance] : votes_->index.within(p, votes_->radius)) {
    const float x = distance / votes_->radius, falloff = 1 - x * x;
    const float vote = falloff * falloff * std::max(0.f, n.raw().dot(votes_->normals[j]));
    const uint8_t* free = votes_->free.data() + j * votes_->views;
    const uint8_t* facing = votes_->facing.data() + j * votes_->views;
    for (size_t view = 0; view < votes_->views; ++view) {
      visibility[view] += vote * free[view];
      all[view] += vote * facing[view];
    }
  }
  for (size_t view = 0; view < votes_->views; ++view)
    visibility[view] = visibility[view] > 0 ? visibility[view] / all[view] : 0;
}

double visibilityWeight(const capture::Camera<AcquisitionSpace>& camera,
                        const capture::Viewpoint<AcquisitionSpace>& viewpoint,
                        const Point3<AcquisitionSpace>& p, const Normal3<AcquisitionSpace>& n,
                        double visibility) {
  const auto point = p.cast<double>();
  const auto pixel = camera.project(point);
  if (!pixel) return 0;
  // The weight must be 0 at an occlusion edge, where half of the neighbourhood is visible, and at a convex
  // corner of the hidden part, where up to three quarters are.
  return smoothStep(0.75, 1, visibility) * grazingFade(dot(n.cast<double>(), viewpoint.towards(point))) *
         borderFade(camera.lens, *pixel);
}

float visibilityRadius(const SurfelCloud& cloud) {
  assert(cloud.size() > 0);
  std::vector<float> radii = cloud.radius;
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::ranges::nth_element(radii, middle);
  return 4 * *middle;
}

namespace {

// Rows of all surfels: rate(surfel, viewpoints, weights) writes the weights without the fade by resolution.
template <class Rate>
VisibilityWeights ratedSurfels(const SurfelCloud& cloud,
                               std::span<const capture::Camera<AcquisitionSpace>> views,
                               std::span<const capture::Viewpoint<AcquisitionSpace>> viewpoints,
                               const Progress& progress, const Rate& rate) {
  VisibilityWeights result{views.size(), std::vector<uint8_t>(cloud.size() * views.size())};
  forRuns(cloud.size(), "view fades", progress, [&](size_t begin, size_t end) {
    std::vector<double> weights(views.size()), densities(views.size());
    for (size_t i = begin; i < end; ++i) {
      rate(i, weights);
      for (size_t view = 0; view < views.size(); ++view)
        densities[view] = samplingDensity(views[view], viewpoints[view], cloud.p0[i].cast<double>());
      fadeByResolution(weights, densities);
      std::ranges::transform(weights, &result.values[i * views.size()], VisibilityWeights::encode);
    }
  });
  return result;
}

} // namespace

VisibilityWeights visibilityWeights(const SurfelCloud& cloud,
                                    std::span<const capture::Camera<AcquisitionSpace>> views,
                                    const RayCaster<AcquisitionSpace>& impostor, const Progress& progress) {
  if (cloud.size() == 0) return {views.size(), {}};
  const std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints(views.begin(), views.end());
  const SmoothedVisibility votes(cloud, viewpoints, lineOfSight(cloud, viewpoints, impostor, progress),
                                 visibilityRadius(cloud), progress);
  return ratedSurfels(cloud, views, viewpoints, progress, [&](size_t i, std::span<double> weights) {
    std::vector<float> visibility(views.size());
    const auto n = normalOf(cloud, i);
    votes.at(cloud.p0[i], n, visibility);
    for (size_t view = 0; view < views.size(); ++view)
      weights[view] = visibilityWeight(views[view], viewpoints[view], cloud.p0[i], n, visibility[view]);
  });
}

VisibilityWeights opacityHullWeights(const SurfelCloud& cloud,
                                     std::span<const capture::Camera<AcquisitionSpace>> views,
                                     const Progress& progress) {
  const std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints(views.begin(), views.end());
  return ratedSurfels(cloud, views, viewpoints, progress, [&](size_t i, std::span<double> weights) {
    for (size_t view = 0; view < views.size(); ++view) {
      const auto pixel = views[view].project(cloud.p0[i].cast<double>());
      weights[view] = pixel ? borderFade(views[view].lens, *pixel) : 0;
    }
  });
}

} // namespace surflect::weights
