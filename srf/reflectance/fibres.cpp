#include "srf/reflectance/fibres.h"

#include "srf/reflectance/gains.h"
#include "srf/reflectance/shared_table.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace surflect::reflectance {

namespace {

// Angles of each surfel's patch frame in its own.
std::vector<Angle> patchAngles(std::span<const SurfelFrame> frames, const Patches& patches) {
  std::vector<Angle> angles;
  for (size_t s = 0; s < frames.size(); ++s)
    angles.push_back(carriedAngle(frames[patches.centres[patches.of[s]]], frames[s]));
  return angles;
}

Angle sum(Angle a, Angle b) { return Angle::fromRadians(a.radians() + b.radians()); }

// Means of a patch's photographs: of p_u^2 - p_v^2, 2 p_u p_v, and |p|^2.
struct Moments {
  double difference = 0, product = 0, square = 0, weight = 0;

  void add(const HalfDifference<>& at, double by) {
    const double u = at.halfU, v = at.halfV;
    difference += by * (u * u - v * v);
    product += by * 2 * u * v;
    square += by * (u * u + v * v);
    weight += by;
  }
  double mean(double Moments::*which) const { return weight > 0 ? this->*which / weight : 0; }
};

// Angles that a patch tries, evenly over half a turn.
constexpr size_t kTries = 12;
constexpr double kTryStep = std::numbers::pi / kTries;

// Place of the least of evenly spaced errors around a circle, by a parabola through it and its neighbours, in
// steps.
double leastBetween(std::span<const double, kTries> errors) {
  const auto least = static_cast<size_t>(std::ranges::min_element(errors) - errors.begin());
  const double before = errors[(least + kTries - 1) % kTries], after = errors[(least + 1) % kTries];
  const double bend = before - 2 * errors[least] + after;
  return static_cast<double>(least) + (bend > 0 ? (before - after) / (2 * bend) : 0);
}

float squaredDistance(const Point3<AcquisitionSpace>& a, const Point3<AcquisitionSpace>& b) {
  return (a.raw() - b.raw()).squaredNorm();
}

} // namespace

Angle carriedAngle(const SurfelFrame& from, const SurfelFrame& to) {
  constexpr float kOpposite = 1e-3f;
  const Mat3<float> a = from.matrix(), b = to.matrix();
  const Vec3<float> between = a.col(2) + b.col(2);
  const float slope = b.col(2).dot(a.col(0)) / std::max(1 + a.col(2).dot(b.col(2)), kOpposite);
  const Vec3<float> u = a.col(0) - slope * between;
  return Angle::fromRadians(std::atan2(u.dot(b.col(1)), u.dot(b.col(0))));
}

SurfelFrame turnedFrame(const SurfelFrame& frame, Angle angle) {
  const auto cosine = static_cast<float>(std::cos(angle.radians()));
  const auto sine = static_cast<float>(std::sin(angle.radians()));
  const Mat3<float> old = frame.matrix();
  Mat3<float> turned;
  turned << cosine * old.col(0) + sine * old.col(1), cosine * old.col(1) - sine * old.col(0), old.col(2);
  return SurfelFrame(turned);
}

Patches patchesOf(std::span<const Point3<AcquisitionSpace>> places, size_t count) {
  assert(count > 0);
  Patches patches{std::vector<uint32_t>(places.size()), {}};
  std::vector<float> nearest(places.size(), std::numeric_limits<float>::infinity());
  uint32_t centre = 0;
  while (patches.centres.size() < std::min(count, places.size())) {
    const auto patch = static_cast<uint32_t>(patches.centres.size());
    patches.centres.push_back(centre);
    for (size_t s = 0; s < places.size(); ++s)
      if (const float squared = squaredDistance(places[s], places[centre]); squared < nearest[s]) {
        nearest[s] = squared;
        patches.of[s] = patch;
      }
    centre = static_cast<uint32_t>(std::ranges::max_element(nearest) - nearest.begin());
    if (nearest[centre] == 0) break;
  }
  return patches;
}

std::vector<Fibre> highlightFibres(const Photographs& photographs, std::span<const SurfelFrame> frames,
                                   const Patches& patches, float white) {
  constexpr double kWindow = 0.08, kBright = 2, kLeastLink = 0.1;
  const std::vector<Angle> toPatch = patchAngles(frames, patches);
  std::vector<Moments> bright(patches.centres.size()), all(patches.centres.size());
  for (size_t s = 0; s < photographs.surfels(); ++s)
    for (size_t i = photographs.first[s]; i < photographs.first[s + 1]; ++i) {
      const HalfDifference<> at = turned(photographs.directions[i], toPatch[s]);
      const double squared = double{at.halfU} * at.halfU + double{at.halfV} * at.halfV;
      const double window = std::exp(-squared / kWindow);
      const Rgb& y = photographs.reflectance[i];
      const double link = std::max(kLeastLink, double{photographs.links[i]});
      all[patches.of[s]].add(at, window);
      bright[patches.of[s]].add(at, window * std::min(kBright, (y.r + y.g + y.b) / (3 * white * link)));
    }
  std::vector<Fibre> fibres;
  for (size_t patch = 0; patch < all.size(); ++patch) {
    const auto excess = [&](double Moments::*which) {
      return bright[patch].mean(which) - all[patch].mean(which);
    };
    const double q1 = excess(&Moments::difference), q2 = excess(&Moments::product);
    const double size = all[patch].mean(&Moments::square);
    fibres.push_back({Angle::fromRadians((std::atan2(q2, q1) + std::numbers::pi) / 2),
                      size > 0 ? static_cast<float>(std::min(1.0, std::hypot(q1, q2) / size)) : 0});
  }
  return fibres;
}

std::vector<Fibre> refinedFibres(const TableGrid& grid, const Photographs& photographs,
                                 std::span<const SurfelFrame> frames, const Patches& patches,
                                 std::vector<Fibre> fibres, const FitOptions& options, size_t rounds,
                                 const Progress& progress) {
  assert(fibres.size() == patches.centres.size());
  const std::vector<Angle> toPatch = patchAngles(frames, patches);
  std::vector<std::vector<uint32_t>> surfelsOf(fibres.size());
  for (uint32_t s = 0; s < patches.of.size(); ++s) surfelsOf[patches.of[s]].push_back(s);
  const std::vector<float> everySurfel(photographs.surfels(), 1.f);
  std::vector<HalfDifference<>> directions(photographs.size());
  Photographs along = photographs;
  along.directions = directions;
  for (size_t round = 0; round < rounds; ++round) {
    for (size_t s = 0; s < photographs.surfels(); ++s)
      for (size_t i = photographs.first[s]; i < photographs.first[s + 1]; ++i)
        directions[i] = turned(photographs.directions[i], sum(toPatch[s], fibres[patches.of[s]].angle));
    const SharedTable table =
        fitSharedTable(grid, along, placesOf(grid, directions), everySurfel, options, 2, progress);
    tbb::parallel_for(size_t{0}, fibres.size(), [&](size_t patch) {
      std::array<double, kTries> errors{};
      for (size_t t = 0; t < kTries; ++t) {
        const Angle turn = Angle::fromRadians(static_cast<double>(t) * kTryStep);
        for (const uint32_t s : surfelsOf[patch])
          for (size_t i = photographs.first[s]; i < photographs.first[s + 1]; ++i) {
            const Rgb value = lookUpNodes(grid, table.nodes, placeOf(grid, turned(directions[i], turn)));
            errors[t] += logError(photographs.links[i] * table.gains[s] * value, photographs.reflectance[i],
                                  options.white);
          }
      }
      double mean = 0;
      for (const double error : errors) mean += error / kTries;
      if (mean <= 0) return; // no photographs
      fibres[patch] = {sum(fibres[patch].angle, Angle::fromRadians(leastBetween(errors) * kTryStep)),
                       static_cast<float>(1 - *std::ranges::min_element(errors) / mean)};
    });
  }
  return fibres;
}

Angle meanLine(std::span<const Angle> angles, std::span<const float> weights) {
  assert(angles.size() == weights.size());
  double cosine = 0, sine = 0;
  for (size_t i = 0; i < angles.size(); ++i) {
    cosine += weights[i] * std::cos(2 * angles[i].radians());
    sine += weights[i] * std::sin(2 * angles[i].radians());
  }
  return Angle::fromRadians(std::atan2(sine, cosine) / 2);
}

std::vector<Angle> fibreAngles(std::span<const Point3<AcquisitionSpace>> places,
                               std::span<const SurfelFrame> frames, const Patches& patches,
                               std::span<const Fibre> fibres) {
  constexpr size_t kBlended = 4;
  constexpr float kLeastStrength = 1e-6f;
  std::vector<Angle> angles(places.size());
  tbb::parallel_for(size_t{0}, places.size(), [&](size_t s) {
    struct Near {
      float distance;
      uint32_t patch;
    };
    std::vector<Near> near;
    for (uint32_t patch = 0; patch < fibres.size(); ++patch)
      near.push_back({std::sqrt(squaredDistance(places[s], places[patches.centres[patch]])), patch});
    const size_t count = std::min(kBlended, near.size());
    std::ranges::partial_sort(near,
                              near.begin() + static_cast<std::ptrdiff_t>(std::min(count + 1, near.size())),
                              {}, &Near::distance);
    const float end = near.size() > count ? near[count].distance : std::numeric_limits<float>::infinity();
    std::vector<Angle> lines;
    std::vector<float> weights;
    for (size_t i = 0; i < count; ++i) {
      const auto [distance, patch] = near[i];
      const float nearness = std::max(0.f, 1 - distance / end);
      lines.push_back(sum(carriedAngle(frames[patches.centres[patch]], frames[s]), fibres[patch].angle));
      weights.push_back(nearness * nearness * (fibres[patch].strength + kLeastStrength));
    }
    angles[s] = meanLine(lines, weights);
  });
  return angles;
}

} // namespace surflect::reflectance
