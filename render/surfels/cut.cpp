#include "render/surfels/cut.h"

#include "warp/deform.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace surflect::surfels {

namespace {

constexpr size_t kPatchSize = 64; // surfels of one level

// Surfels of level `l` > 0, or of level 0 without positions and frames.
CutLevel cutLevel(const SurfelCloud& cloud, const LevelsOfDetail& detail, const Patches& patches, size_t l,
                  const Progress& progress) {
  CutLevel level;
  const size_t expected = (cloud.size() >> l) + kMostLevels; // each level has half the surfels, rounded up
  level.surfels.reserve(expected);
  if (l > 0) {
    level.cloud.p0.reserve(expected);
    level.cloud.r0.reserve(expected);
  }
  for (auto* numbers : {&level.cloud.radius, &level.cloud.coverage, &level.nextRadius, &level.nextCoverage})
    numbers->reserve(expected);
  level.first.push_back(0);
  for (size_t patch = 0; patch < patches.size(); ++patch) {
    progress.checkNowAndThen(patch);
    for (uint32_t surfel = patches.first[patch]; surfel < patches.first[patch + 1]; ++surfel) {
      const std::span<const DetailSplat> splats = detail.of(surfel);
      if (splats.size() <= l) continue;
      const DetailSplat next = splats.size() > l + 1 ? splats[l + 1] : DetailSplat{};
      level.surfels.push_back(surfel);
      if (l > 0) {
        level.cloud.p0.push_back(cloud.p0[surfel]);
        level.cloud.r0.push_back(cloud.r0[surfel]);
      }
      level.cloud.radius.push_back(splats[l].radius);
      level.cloud.coverage.push_back(splats[l].coverage);
      level.nextRadius.push_back(next.radius);
      level.nextCoverage.push_back(next.coverage);
    }
    level.first.push_back(static_cast<uint32_t>(level.surfels.size()));
  }
  return level;
}

// Splats between two levels, t > 0 of the way: see splatAt.
void mixSplats(const CutLevel& level, size_t begin, size_t end, float t, float* radius, float* coverage) {
  for (size_t i = begin; i < end; ++i) {
    const float r2 = level.cloud.radius[i] * level.cloud.radius[i],
                R2 = level.nextRadius[i] * level.nextRadius[i];
    const float mass = (1 - t) * level.cloud.coverage[i] * r2, nextMass = t * level.nextCoverage[i] * R2;
    const float squared = (mass * r2 + nextMass * R2) / (mass + nextMass);
    *radius++ = std::sqrt(squared);
    *coverage++ = (mass + nextMass) / squared;
  }
}

// Derivative of the pixel position of a point p in camera space, in front of the viewer, along d.
Vec2<double> pixelsAlong(const capture::Lens& lens, const Vec3<double>& p, const Vec3<double>& d) {
  Vec2<double> q(d.x(), -d.y());
  if (lens.model == capture::Lens::Model::pinhole) {
    const Vec2<double> straight(p.x() / -p.z(), -p.y() / -p.z());
    q = (q + d.z() * straight) / -p.z();
    if (lens.distorts()) q = capture::distortionJacobian(lens, straight) * q;
  }
  return {lens.focalX * q.x(), lens.focalY * q.y()};
}

} // namespace

CutLevels cutLevels(const SurfelCloud& cloud, const LevelsOfDetail& detail, const Progress& progress) {
  CutLevels result{patchesOf(cloud, kPatchSize), {}, std::vector<CutLevel>(detail.count)};
  result.middles = subsetOf(cloud, result.patches.middle);
  tbb::parallel_for(size_t{0}, detail.count, [&](size_t l) {
    result.levels[l] = cutLevel(cloud, detail, result.patches, l, progress);
  });
  return result;
}

double levelFor(double size, double wanted) {
  return size > 0 ? std::max(0.0, 2 * std::log2(wanted / size)) : 0;
}

double pixelsPerLength(const capture::Camera<ObjectSpace>& camera, const DeformedCloud& deformed,
                       size_t surfel) {
  if (deformed.handedness[surfel] == Handedness::dead) return 0;
  const capture::Lens& lens = camera.lens;
  const Mat3<double>& rotation = camera.cameraFromWorld.rotation();
  const Vec3<double> p = camera.cameraFromWorld(deformed.p[surfel].cast<double>()).raw();
  if (lens.model == capture::Lens::Model::pinhole && !(p.z() < 0)) return 0;
  const Vec2<double> u =
      pixelsAlong(lens, p, Vec3<double>(rotation * deformed.u[surfel].raw().cast<double>()));
  const Vec2<double> v =
      pixelsAlong(lens, p, Vec3<double>(rotation * deformed.v[surfel].raw().cast<double>()));
  // Stretches s1 >= s2 are the singular values of (u, v): s1 s2 = |det|, and s1^2 + s2^2 = |u|^2 + |v|^2.
  const double product = std::abs(u.x() * v.y() - u.y() * v.x());
  const double mean = (u.squaredNorm() + v.squaredNorm()) / 2;
  const double largestSquared = mean + std::sqrt(std::max(0.0, mean * mean - product * product));
  const double pixels = std::sqrt(std::max(product, kLeastTilt * largestSquared));
  return std::isfinite(pixels) ? pixels : 0;
}

Cut cutFor(const SurfelCloud& cloud, const CutLevels& levels, const warp::Warp& warp,
           const capture::Camera<ObjectSpace>& camera, double surfelSize, const Progress& progress,
           Cut kept) {
  Cut cut = std::move(kept);
  cut.middles = warp::deform(levels.middles, warp, progress, std::move(cut.middles));
  const size_t patches = levels.patches.size();
  const double coarsest = static_cast<double>(levels.levels.size()) - 1;
  const auto levelOf = [&](size_t patch) -> const CutLevel& {
    return levels.levels[static_cast<size_t>(cut.levels[patch])];
  };
  cut.wanted.resize(patches);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, patches, 256), [&](const auto& range) {
    progress.checkpoint();
    for (size_t patch = range.begin(); patch < range.end(); ++patch) {
      const double size = levels.middles.radius[patch] * pixelsPerLength(camera, cut.middles, patch);
      cut.wanted[patch] = std::min(levelFor(size, surfelSize), coarsest);
    }
  });
  cut.isNew = cut.wanted != cut.levels;
  if (!cut.isNew) return cut;
  cut.levels.swap(cut.wanted);
  cut.first.assign(1, 0);
  for (size_t patch = 0; patch < patches; ++patch) {
    const CutLevel& level = levelOf(patch);
    cut.first.push_back(cut.first.back() + level.first[patch + 1] - level.first[patch]);
  }
  const size_t count = cut.first.back();
  cut.isWhole = static_cast<double>(count) > kLargestCut * static_cast<double>(cloud.size());
  if (cut.isWhole) return cut;
  cut.surfels.resize(count);
  cut.cloud.p0.resize(count);
  cut.cloud.r0.resize(count);
  cut.cloud.radius.resize(count);
  cut.cloud.coverage.resize(count);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, patches, 64), [&](const auto& range) {
    progress.checkpoint();
    for (size_t patch = range.begin(); patch < range.end(); ++patch) {
      const CutLevel& level = levelOf(patch);
      const SurfelCloud& placed = cut.levels[patch] < 1 ? cloud : level.cloud;
      const auto t = static_cast<float>(cut.levels[patch] - std::floor(cut.levels[patch]));
      const size_t begin = level.first[patch], end = level.first[patch + 1], to = cut.first[patch];
      const auto copy = [&](const auto& from, auto& into) {
        std::copy(from.data() + begin, from.data() + end, into.data() + to);
      };
      copy(level.surfels, cut.surfels);
      copy(placed.p0, cut.cloud.p0);
      copy(placed.r0, cut.cloud.r0);
      if (t > 0)
        mixSplats(level, begin, end, t, cut.cloud.radius.data() + to, cut.cloud.coverage.data() + to);
      else {
        copy(level.cloud.radius, cut.cloud.radius);
        copy(level.cloud.coverage, cut.cloud.coverage);
      }
    }
  });
  return cut;
}

PatchQueries patchQueries(const Patches& patches, std::span<const uint32_t> visible,
                          const DeformedCloud& deformed) {
  PatchQueries queries;
  size_t next = 0; // patch after the last one that was asked
  for (uint32_t place = 0; place < visible.size(); ++place) {
    if (visible[place] < patches.first[next]) continue;
    while (patches.first[next] <= visible[place]) ++next;
    const uint32_t middle = patches.middle[next - 1];
    queries.surfels.push_back(deformed.handedness[middle] == Handedness::dead ? visible[place] : middle);
    queries.firstPlace.push_back(place);
  }
  queries.firstPlace.push_back(static_cast<uint32_t>(visible.size()));
  return queries;
}

void addPlaces(const PatchQueries& queries, std::span<const uint32_t> visible, size_t begin, size_t end,
               weights::QueryBatch& batch) {
  const uint32_t first = queries.firstPlace[begin], last = queries.firstPlace[end];
  batch.places.assign(visible.begin() + first, visible.begin() + last);
  batch.firstPlace.clear();
  for (size_t query = begin; query <= end; ++query)
    batch.firstPlace.push_back(queries.firstPlace[query] - first);
}

Patches patchesIn(const Cut& cut, const Patches& whole) {
  Patches patches;
  size_t next = 0; // patch of the whole cloud after the last one that has a piece
  for (uint32_t i = 0; i < cut.surfels.size(); ++i) {
    if (cut.surfels[i] < whole.first[next]) continue;
    while (whole.first[next] <= cut.surfels[i]) ++next;
    patches.first.push_back(i);
  }
  patches.first.push_back(static_cast<uint32_t>(cut.surfels.size()));
  for (size_t patch = 0; patch + 1 < patches.first.size(); ++patch)
    patches.middle.push_back((patches.first[patch] + patches.first[patch + 1]) / 2);
  return patches;
}

} // namespace surflect::surfels
