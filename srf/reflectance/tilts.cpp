#include "srf/reflectance/tilts.h"

#include "srf/reflectance/gains.h"
#include "surfel/geometry/neighbors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace surflect::reflectance {

namespace {

constexpr float kFirstStep = 0.07f, kLeastStep = 0.015f; // 4 degrees, .9 degrees
constexpr double kReluctance = 0.02;                     // times |t|^2

// A tilt by its coordinates in a frame, where those of another frame, whose u has the given angle in it, are
// known.
Tilt carried(Tilt tilt, Angle angle) {
  const auto cosine = static_cast<float>(std::cos(angle.radians()));
  const auto sine = static_cast<float>(std::sin(angle.radians()));
  return {cosine * tilt.u - sine * tilt.v, sine * tilt.u + cosine * tilt.v};
}

Tilt bounded(Tilt tilt) {
  const float scale = kMostTilt / std::max(kMostTilt, std::hypot(tilt.u, tilt.v));
  return {scale * tilt.u, scale * tilt.v};
}

// Errors of a surfel's photographs under tilts.
class SurfelErrors {
public:
  SurfelErrors(const TiltedTables& tables, std::span<const std::vector<Rgb>> nodes,
               const Photographs& photographs)
      : tables_(tables), nodes_(nodes), photographs_(photographs) {}

  // Sum over every `step`-th photograph from the first-th on.
  double of(uint32_t surfel, Tilt tilt, size_t first = 0, size_t step = 1) const {
    const Mat3<float> inTilted = tiltRotation(tilt).transpose();
    const TableMixture& mixture = tables_.mixtures[surfel];
    double sum = 0;
    for (size_t i = photographs_.first[surfel] + first; i < photographs_.first[surfel + 1]; i += step) {
      const auto view = rotated(inTilted, photographs_.towardsView[i]);
      const auto light = rotated(inTilted, photographs_.towardsLight[i]);
      const TablePlace place =
          placeOf(tables_.tables.grid, turned(halfDifference(view, light), tables_.fibres[surfel]));
      Rgb value;
      for (size_t m = 0; m < kMixedTables; ++m)
        if (mixture.weight[m] > 0)
          value = value + mixture.weight[m] *
                              positive(lookUpNodes(tables_.tables.grid, nodes_[mixture.table[m]], place));
      sum += logError(tableLink(light.z(), view.z()) * tables_.gains[surfel] * value,
                      photographs_.reflectance[i], tables_.white);
    }
    return sum;
  }

private:
  const TiltedTables& tables_;
  std::span<const std::vector<Rgb>> nodes_; // of all tables
  const Photographs& photographs_;
};

// Errors E of patches under tilts in the frames of their centres, times the number of photographs.
class PatchErrors {
public:
  // The arguments must outlive this.
  PatchErrors(const TiltedTables& tables, const Photographs& photographs, std::span<const SurfelFrame> frames,
              const Patches& patches)
      : nodes_(nodesOf(tables.tables)), errors_(tables, nodes_, photographs), photographs_(photographs),
        frames_(frames), patches_(patches), surfelsOf_(patches.centres.size()) {
    for (uint32_t s = 0; s < patches.of.size(); ++s) surfelsOf_[patches.of[s]].push_back(s);
  }

  // Over every `step`-th photograph of each surfel from the first-th on.
  double of(size_t patch, Tilt tilt, size_t first, size_t step) const {
    const SurfelFrame& frame = frames_[patches_.centres[patch]];
    double sum = 0;
    for (const uint32_t s : surfelsOf_[patch]) {
      const size_t count = (photographs_.first[s + 1] - photographs_.first[s]) / step;
      sum += errors_.of(s, carried(tilt, carriedAngle(frame, frames_[s])), first, step) +
             kReluctance * static_cast<double>(count) * (tilt.u * tilt.u + tilt.v * tilt.v);
    }
    return sum;
  }

  // The tilt of the least error over every `step`-th photograph, by compass search.
  Tilt bestTilt(size_t patch, size_t step) const {
    Tilt best;
    double least = of(patch, best, 0, step);
    for (float length = kFirstStep; length >= kLeastStep; length /= 2) {
      const Tilt centre = best;
      for (int direction = 0; direction < 8; ++direction) {
        const double angle = std::numbers::pi / 4 * direction;
        const Tilt tilt = bounded({centre.u + length * static_cast<float>(std::cos(angle)),
                                   centre.v + length * static_cast<float>(std::sin(angle))});
        if (const double error = of(patch, tilt, 0, step); error < least) {
          best = tilt;
          least = error;
        }
      }
    }
    return best;
  }

private:
  static std::vector<std::vector<Rgb>> nodesOf(const ReflectanceTables& tables) {
    std::vector<std::vector<Rgb>> nodes;
    for (size_t table = 0; table < tables.count(); ++table) nodes.push_back(tables.nodes(table));
    return nodes;
  }

  const std::vector<std::vector<Rgb>> nodes_;
  const SurfelErrors errors_;
  const Photographs& photographs_;
  std::span<const SurfelFrame> frames_;
  const Patches& patches_;
  std::vector<std::vector<uint32_t>> surfelsOf_;
};

} // namespace

Mat3<float> tiltRotation(Tilt tilt) {
  const Vec3<float> n = Vec3<float>(tilt.u, tilt.v, 1).normalized();
  const float slope = 1 / (1 + n.z());
  Mat3<float> rotation;
  rotation << 1 - slope * n.x() * n.x(), -slope * n.x() * n.y(), n.x(), //
      -slope * n.x() * n.y(), 1 - slope * n.y() * n.y(), n.y(),         //
      -n.x(), -n.y(), n.z();
  return rotation;
}

SurfelFrame tiltedFrame(const SurfelFrame& frame, Tilt tilt) {
  return SurfelFrame(Mat3<float>(frame.matrix() * tiltRotation(tilt)));
}

std::vector<Tilt> seekTilts(const TiltedTables& tables, const Photographs& photographs,
                            std::span<const SurfelFrame> frames, const Patches& patches,
                            const Progress& progress) {
  const PatchErrors errors(tables, photographs, frames, patches);
  std::vector<Tilt> tilts(patches.centres.size());
  tbb::parallel_for(size_t{0}, tilts.size(), [&](size_t patch) {
    progress.checkpoint();
    tilts[patch] = errors.bestTilt(patch, 1);
  });
  return tilts;
}

double savedByTilts(const TiltedTables& tables, const Photographs& photographs,
                    std::span<const SurfelFrame> frames, const Patches& patches, size_t step,
                    const Progress& progress) {
  const PatchErrors errors(tables, photographs, frames, patches);
  struct Errors {
    double before = 0, after = 0;
  };
  std::vector<Errors> all(patches.centres.size());
  tbb::parallel_for(size_t{0}, all.size(), step, [&](size_t patch) {
    progress.checkpoint();
    all[patch] = {errors.of(patch, {}, 1, 2), errors.of(patch, errors.bestTilt(patch, 2), 1, 2)};
  });
  Errors sum;
  for (const auto& [before, after] : all) sum = {sum.before + before, sum.after + after};
  return sum.before > 0 ? 1 - sum.after / sum.before : 0;
}

std::vector<Tilt> tiltsNear(std::span<const Point3<AcquisitionSpace>> places,
                            std::span<const SurfelFrame> frames, std::span<const Tilt> tilts,
                            std::span<const Point3<AcquisitionSpace>> at,
                            std::span<const SurfelFrame> framesAt) {
  constexpr size_t kBlended = 6;
  const NeighborIndex index(places);
  std::vector<Tilt> mean(at.size());
  tbb::parallel_for(size_t{0}, at.size(), [&](size_t s) {
    for (const auto& [neighbor, weight] : index.blended(at[s], kBlended)) {
      const Tilt tilt = carried(tilts[neighbor], carriedAngle(frames[neighbor], framesAt[s]));
      mean[s] = {mean[s].u + weight * tilt.u, mean[s].v + weight * tilt.v};
    }
  });
  return mean;
}

} // namespace surflect::reflectance
