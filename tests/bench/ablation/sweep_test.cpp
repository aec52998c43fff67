#include "bench/ablation/sweep.h"

#include "bench/ablation/light_hull.h"
#include "srf/ulr/ulr.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <set>

namespace surflect::bench {
namespace {

using Towards = Direction3<AcquisitionSpace>;

TEST(Sweep, AParabolaHasItsSecondDifferenceAndALineHasNone) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    // Two pixels of the mask, with two slopes and curvatures; the third is outside and jumps.
    const double curvature = number(random), slope = number(random), step = 0.25 + std::abs(number(random));
    std::vector<image::Image> pictures;
    for (int i = 0; i < 9; ++i) {
      const double t = i * step;
      const auto bent = static_cast<float>(curvature * t * t + slope * t),
                 straight = static_cast<float>(slope * t);
      image::Image& picture = pictures.emplace_back(3, 1, 4);
      picture.values = {bent, bent, bent, 1, straight, straight, straight, 1, i % 2 ? 99.f : 0, 0, 0, 1};
    }
    image::Mask mask(3, 1);
    mask.inside = {1, 1, 0};
    const double white = 2, second = std::abs(2 * curvature * step * step) / white;
    const SecondDifferences measured = secondDifferences(pictures, mask, white);
    EXPECT_NEAR(measured.largest, second, 1e-5);
    EXPECT_NEAR(measured.rms, second / std::sqrt(2.0), 1e-5);
  }
}

// Lights all around, each with a value of its own, blended along a great circle.
class BlendSweep : public testing::TestWithParam<unsigned> {
protected:
  using Blend = std::function<ulr::BlendSet(const Towards&)>;
  using Ends = std::function<std::set<uint32_t>(const Towards&)>; // the lights that an answer depends on

  BlendSweep() : random(GetParam()) {
    std::normal_distribution<float> normal;
    const auto unit = [&] {
      return Vec3<float>(normal(random), normal(random), normal(random)).normalized();
    };
    for (const Vec3<double>& light : studio::spiral(60)) {
      lights.push_back(assume<Towards>(Vec3<float>(light.cast<float>())));
      values.push_back(normal(random));
    }
    from = unit();
    to = from.cross(unit()).normalized();
  }

  Towards at(double degrees) const {
    const double angle = degrees * std::numbers::pi / 180;
    const Vec3<double> direction =
        std::cos(angle) * from.cast<double>() + std::sin(angle) * to.cast<double>();
    return assume<Towards>(direction.normalized().cast<float>());
  }

  image::Image picture(const Blend& blend, double degrees) const {
    float value = 0;
    for (const auto& [light, weight] : blend(at(degrees))) value += weight * values[light];
    image::Image image(1, 1, 3);
    image.values = {value, value, value};
    return image;
  }

  // Along the sweep, where `counts` for the three directions.
  template <class Counts> double largest(const Blend& blend, double step, const Counts& counts) const {
    image::Mask mask(1, 1);
    mask.inside = {1};
    double found = 0;
    for (double middle = 0; middle < 360; middle += step)
      if (counts(middle - step, middle, middle + step)) {
        const image::Image pictures[] = {picture(blend, middle - step), picture(blend, middle),
                                         picture(blend, middle + step)};
        found = std::max(found, secondDifferences(pictures, mask, 1).largest);
      }
    return found;
  }

  double largest(const Blend& blend, double step) const {
    return largest(blend, step, [](double, double, double) { return true; });
  }

  double largestWithin(const Blend& blend, const Ends& ends, double step) const {
    return largest(blend, step, [&](double a, double b, double c) {
      return ends(at(a)) == ends(at(b)) && ends(at(b)) == ends(at(c));
    });
  }

  ulr::NearestCandidates nearest(size_t k, const Towards& towards) const {
    ulr::NearestCandidates candidates(k);
    for (uint32_t light = 0; light < lights.size(); ++light)
      candidates.offer({light, ulr::anglePenalty(lights[light], towards)});
    return candidates;
  }
  Blend ulr(size_t k) const {
    return [this, k](const Towards& towards) { return ulr::ulrWeights(nearest(k, towards)); };
  }

  std::mt19937 random;
  std::vector<Towards> lights;
  std::vector<float> values;
  Vec3<float> from, to;
};

// A jump stays a jump in smaller steps, a kink shrinks with the step, what is smooth with its square.
TEST_P(BlendSweep, NearestLightsJumpAndBlendsDoNot) {
  const LightHull hull(lights);
  const Blend ofHull = [&](const Towards& towards) { return hull.weights(towards); };
  EXPECT_GT(largest(ulr(1), 0.0625), 0.9 * largest(ulr(1), 1));
  EXPECT_LT(largest(ulr(3), 0.0625), largest(ulr(3), 1) / 8);
  EXPECT_LT(largest(ofHull, 0.0625), largest(ofHull, 1) / 8);
}

TEST_P(BlendSweep, TheHullHasKinksAtItsEdgesAlone) {
  const LightHull hull(lights);
  const Blend ofHull = [&](const Towards& towards) { return hull.weights(towards); };
  const Ends corners = [&](const Towards& towards) {
    std::set<uint32_t> set;
    for (const ulr::Blended& blended : hull.weights(towards)) set.insert(blended.index);
    return set;
  };
  EXPECT_GT(largest(ofHull, 0.0625), largest(ofHull, 0.25) / 8);
  EXPECT_LT(largestWithin(ofHull, corners, 0.0625), largestWithin(ofHull, corners, 0.25) / 8);
}

// The last of the k + 1 lights is the threshold: kinks are where it changes, too.
TEST_P(BlendSweep, UlrHasKinksWhereItsLightsChangeAlone) {
  constexpr uint32_t threshold = 1000;
  const Ends lightsOf = [&](const Towards& towards) {
    const ulr::NearestCandidates candidates = nearest(3, towards);
    std::set<uint32_t> set{threshold + candidates.sorted().back().index};
    for (const ulr::Candidate& candidate : candidates.sorted()) set.insert(candidate.index);
    return set;
  };
  EXPECT_GT(largest(ulr(3), 0.0625), largest(ulr(3), 0.25) / 8);
  EXPECT_LT(largestWithin(ulr(3), lightsOf, 0.0625), largestWithin(ulr(3), lightsOf, 0.25) / 8);
}

INSTANTIATE_TEST_SUITE_P(Seeds, BlendSweep, testing::Range(1u, 4u));

} // namespace
} // namespace surflect::bench
