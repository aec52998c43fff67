#include "render/lightfield/lfm/lfm_frame.h"

#include "render/lightfield/lfm/reference.h"
#include "render/lightfield/lfm/tile.h"
#include "tests/render/gl/gl_test.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/render/lightfield/slf/cameras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace surflect::lfm {
namespace {

using namespace lfm::testing;
using slf::Camera;
using slf::randomCamera;

class LfmFrameTest : public gl::GlTest {
protected:
  static FrameRenderer rendererOf(const LightFieldMaps& maps) {
    return FrameRenderer(maps, context_->describe().limits);
  }
};

LightFieldMaps sphereMaps(const SyntheticOptions& options = {}) {
  return syntheticMaps(bumpySphere(6, 8, 0.1), options);
}

// Table in which users share maps, and one has none.
void shareMaps(MapTable& table) {
  for (size_t i = 0; i < table.mapOf.size(); ++i)
    table.mapOf[i] = i == 3 ? kNoMap : static_cast<uint32_t>(i * 5 % table.maps.count / 2);
}

LightFieldMaps codebookMaps(LightFieldMaps maps) {
  for (Term& term : maps.terms) {
    shareMaps(term.surface);
    shareMaps(term.view);
  }
  if (maps.method == Factorization::pca) shareMaps(maps.mean);
  return maps;
}

// Radiance up to about 1, with terms that are weaker than the mean, as of a photographed object.
LightFieldMaps darkened(LightFieldMaps maps) {
  for (Term& term : maps.terms)
    for (float& scale : term.scale) scale *= 0.2f;
  maps.meanWhite = 0.8f;
  return maps;
}

LightFieldMaps scalarMaps(LightFieldMaps maps) {
  for (Term& term : maps.terms) term.surface = scalarTable(term.surface, maps.samples);
  maps.layout = SurfaceLayout::scalar;
  return maps;
}

// Peak signal to noise ratio of colours, with peak 1, over pixels that both pictures have on the object; 0 if
// they are few or a colour is not finite.
double psnrOf(const image::Image& a, const image::Image& b) {
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < a.values.size(); i += 4) {
    if (a.values[i + 3] != 1 || b.values[i + 3] != 1) continue;
    for (size_t channel = 0; channel < 3; ++channel)
      sum += std::pow(a.values[i + channel] - b.values[i + channel], 2);
    count += 3;
  }
  if (count < 300 || !std::isfinite(sum)) return 0;
  return -10 * std::log10(sum / static_cast<double>(count));
}

double largestDifference(const image::Image& a, const image::Image& b) {
  double largest = 0;
  for (size_t i = 0; i < a.values.size(); ++i)
    if (const auto difference = static_cast<double>(std::abs(a.values[i] - b.values[i]));
        !(difference <= largest))
      largest = std::isfinite(difference) ? difference : std::numeric_limits<double>::infinity();
  return largest;
}

// Pixels that only one picture has on the object.
size_t coverageErrors(const image::Image& a, const image::Image& b) {
  size_t count = 0;
  for (size_t i = 3; i < a.values.size(); i += 4) count += a.values[i] != b.values[i];
  return count;
}

TEST_F(LfmFrameTest, AgreesWithTheReference) {
  const std::map<std::string, LightFieldMaps> models{
      {"pca", sphereMaps()},
      {"nmf", sphereMaps({.method = Factorization::nmf, .seed = 2})},
      {"least sizes", sphereMaps({.samples = 2, .viewSize = 2, .terms = 1})},
      {"an open patch", syntheticMaps(squarePatch(3), {.samples = 9, .viewSize = 16})},
      {"scalar maps", scalarMaps(sphereMaps())},
      {"small view maps of higher terms", withHigherViewSize(sphereMaps(), 5)},
  };
  for (const auto& [name, maps] : models) {
    FrameRenderer renderer = rendererOf(maps);
    const Reference reference(maps);
    std::mt19937 random(1);
    double worst = 1000;
    for (int trial = 0; trial < (name == "pca" ? 20 : 3); ++trial) {
      const Camera camera = randomCamera(random, 80, 60);
      const image::Image expected = reference.render(camera), found = renderer.render(camera).color;
      worst = std::min(worst, psnrOf(found, expected));
      // Where a silhouette passes a pixel's middle within rounding, one of them shows what is behind.
      EXPECT_LE(coverageErrors(found, expected), 3u) << name;
    }
    EXPECT_GT(worst, 80) << name;
  }
}

// OpenGL places edges of triangles, at which corrections change their slope, within a 256th of a pixel.
TEST_F(LfmFrameTest, CodebooksAgreeWithTheReference) {
  for (const LightFieldMaps& maps : {codebookMaps(sphereMaps()), codebookMaps(scalarMaps(sphereMaps()))}) {
    FrameRenderer renderer = rendererOf(maps);
    const Reference reference(maps);
    EXPECT_TRUE(renderer.textures().hasSurfaceEdges() && renderer.textures().hasMeanEdges());
    std::mt19937 random(7);
    for (int trial = 0; trial < 10; ++trial) {
      const Camera camera = randomCamera(random, 80, 60);
      const image::Image expected = reference.render(camera), found = renderer.render(camera).color;
      size_t different = 0, covered = 0;
      for (size_t i = 0; i < found.values.size(); i += 4) {
        covered += found.values[i + 3] > 0;
        different += !(std::abs(found.values[i] - expected.values[i]) <= 1e-4f);
      }
      EXPECT_GT(covered, 900u);
      EXPECT_LE(different, 10u);
    }
  }
}

TEST_F(LfmFrameTest, CompressedTexturesAgreeWithTheReference) {
  for (const Factorization method : {Factorization::pca, Factorization::nmf})
    for (const bool isScalar : {false, true}) {
      LightFieldMaps maps = darkened(sphereMaps({.method = method, .samples = 7}));
      maps = isScalar ? scalarMaps(std::move(maps)) : withHigherViewSize(std::move(maps), 5);
      maps = encoded(std::move(maps));
      FrameRenderer renderer = rendererOf(maps);
      const Reference reference(maps);
      std::mt19937 random(2);
      double worst = 1000;
      for (int trial = 0; trial < 5; ++trial) {
        const Camera camera = randomCamera(random, 80, 60);
        worst = std::min(worst, psnrOf(renderer.render(camera).color, reference.render(camera)));
      }
      EXPECT_GT(worst, method == Factorization::pca ? 46 : 58);
    }
}

TEST_F(LfmFrameTest, OnePassAndManyAgree) {
  for (const Factorization method : {Factorization::pca, Factorization::nmf}) {
    const LightFieldMaps maps = sphereMaps({.method = method, .terms = 4});
    FrameRenderer renderer = rendererOf(maps);
    std::mt19937 random(3);
    for (int trial = 0; trial < 10; ++trial) {
      const Camera camera = randomCamera(random, 80, 60);
      const Frame single = renderer.render(camera);
      const Frame many = renderer.render(camera, {.passes = Passes::perTerm});
      EXPECT_LT(largestDifference(single.color, many.color), 2e-6);
      EXPECT_EQ(single.depth.values, many.depth.values);
      EXPECT_EQ(single.stats.passes, 1u);
      EXPECT_EQ(many.stats.passes, method == Factorization::pca ? 5u : 4u);
    }
  }
}

// Terms that stay within 0..1 at all times: each pass rounds by half a step.
TEST_F(LfmFrameTest, AClampedTargetAddsAndSubtractsSignedTerms) {
  const LightFieldMaps maps = darkened(sphereMaps());
  FrameRenderer renderer = rendererOf(maps);
  std::mt19937 random(4);
  double largest = 0;
  for (int trial = 0; trial < 5; ++trial) {
    const Camera camera = randomCamera(random, 80, 60);
    const Frame clamped = renderer.render(camera, {.passes = Passes::clamped, .white = 1.5});
    EXPECT_EQ(clamped.stats.passes, 7u);
    largest = std::max(largest, largestDifference(clamped.color, renderer.render(camera).color));
  }
  EXPECT_LE(largest, 1.5 * 7 * 0.5 / 255);
}

TEST_F(LfmFrameTest, TheFirstTermsAreThePictureOfAShorterModel) {
  const LightFieldMaps maps = sphereMaps({.terms = 4});
  FrameRenderer renderer = rendererOf(maps);
  std::mt19937 random(5);
  const Camera camera = randomCamera(random, 80, 60);
  std::vector<float> last;
  for (size_t k = 0; k <= 4; ++k) {
    LightFieldMaps shorter = maps;
    shorter.terms.resize(k);
    const std::vector<float> expected = rendererOf(shorter).render(camera).color.values;
    EXPECT_EQ(renderer.render(camera, {.terms = k}).color.values, expected);
    EXPECT_NE(expected, last);
    last = expected;
  }
  EXPECT_EQ(renderer.render(camera, {.terms = 9}).color.values, last);
}

TEST_F(LfmFrameTest, EarlierFramesDoNotChangeABit) {
  const LightFieldMaps maps = sphereMaps();
  FrameRenderer renderer = rendererOf(maps);
  std::mt19937 random(6);
  const Camera camera = randomCamera(random, 100, 80), other = randomCamera(random, 40, 60);
  const std::vector<float> expected = renderer.render(camera).color.values;
  for (const Passes passes : {Passes::single, Passes::perTerm, Passes::clamped})
    renderer.render(other, {.passes = passes});
  EXPECT_EQ(renderer.render(camera).color.values, expected);
}

} // namespace
} // namespace surflect::lfm
