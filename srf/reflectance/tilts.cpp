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

  double of(uint32_t surfel, Tilt tilt) const {
    const Mat3<float> inTilted = tiltRotation(tilt).transpose();
    const TableMixture& mixture = tables_.mixtures[surfel];
    double sum = 0;
    for (size_t i = photographs_.first[surfel]; i < photographs_.first[surfel + 1]; ++i) {
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

PatchTilts seekTilts(const TiltedTables& tables, const Photographs& photographs,
                     std::span<const SurfelFrame> frames, const Patches& patches, size_t step,
                     const Progress& progress) {
  std::vector<std::vector<Rgb>> nodes;
  for (size_t table = 0; table < tables.tables.count(); ++table) nodes.push_back(tables.tables.nodes(table));
  const SurfelErrors errors(tables, nodes, photographs);
  std::vector<std::vector<uint32_t>> surfelsOf(patches.centres.size());
  for (uint32_t s = 0; s < patches.of.size(); ++s) surfelsOf[patches.of[s]].push_back(s);
  struct Found {
    Tilt tilt;
    double error = 0, errorBefore = 0;
  };
  std::vector<Found> found(patches.centres.size());
  tbb::parallel_for(size_t{0}, found.size(), step, [&](size_t patch) {
    progress.checkpoint();
    const SurfelFrame& frame = frames[patches.centres[patch]];
    const auto errorAt = [&](Tilt tilt) { // E times the number of photographs
      double sum = 0;
      for (const uint32_t s : surfelsOf[patch]) {
        const size_t count = photographs.first[s + 1] - photographs.first[s];
        sum += errors.of(s, carried(tilt, carriedAngle(frame, frames[s]))) +
               kReluctance * static_cast<double>(count) * (tilt.u * tilt.u + tilt.v * tilt.v);
      }
      return sum;
    };
    Found best{{}, errorAt({}), 0};
    best.errorBefore = best.error;
    for (float length = kFirstStep; length >= kLeastStep; length /= 2) {
      const Tilt centre = best.tilt;
      for (int direction = 0; direction < 8; ++direction) {
        const double angle = std::numbers::pi / 4 * direction;
        const Tilt tilt = bounded({centre.u + length * static_cast<float>(std::cos(angle)),
                                   centre.v + length * static_cast<float>(std::sin(angle))});
        if (const double error = errorAt(tilt); error < best.error) {
          best.tilt = tilt;
          best.error = error;
        }
      }
    }
    found[patch] = best;
  });
  PatchTilts all;
  for (const auto& [tilt, error, before] : found) {
    all.tilts.push_back(tilt);
    all.error += error;
    all.errorBefore += before;
  }
  return all;
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
