#include "render/lightfield/slf/slf_frame.h"

#include "bench/slf/synthetic_field.h"
#include "render/lightfield/slf/reference.h"
#include "tests/render/gl/gl_test.h"
#include "tests/render/lightfield/slf/cameras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace surflect::slf {
namespace {

using namespace bench;

const SyntheticOptions kSmall{.cells = 2, .quads = 8, .texels = 16, .subdivisions = 1};
constexpr size_t kTextureBytes = size_t{16} * 16 * sizeof(Texel),
                 kSlotBytes = size_t{17} * 17 * sizeof(Texel);
constexpr std::array kMethods{Stages::fused, Stages::twoStages};
constexpr PlanOptions kNoCulling{.regionCulling = false, .directionCulling = false, .scissor = false};

class SlfFrameTest : public gl::GlTest {
protected:
  static void SetUpTestSuite() {
    GlTest::SetUpTestSuite();
    field_ = std::make_unique<Field>(syntheticField(kSmall));
    textures_ = std::make_unique<SyntheticTextures>(*field_, kSmall);
    reference_ = std::make_unique<Reference>(*field_, *textures_);
  }
  static void TearDownTestSuite() {
    reference_.reset();
    textures_.reset();
    field_.reset();
    GlTest::TearDownTestSuite();
  }
  static FrameRenderer rendererOf(const SlotOptions& options = {}) {
    return FrameRenderer(*field_, *textures_, options, context_->describe().limits);
  }

  static inline std::unique_ptr<Field> field_;
  static inline std::unique_ptr<SyntheticTextures> textures_;
  static inline std::unique_ptr<Reference> reference_;
};

// Peak signal to noise ratio of colours, with peak 1, over pixels that both pictures have on the object.
double psnrOf(const image::Image& a, const image::Image& b) {
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < a.values.size(); i += 4) {
    if (a.values[i + 3] != 1 || b.values[i + 3] != 1) continue;
    for (size_t channel = 0; channel < 3; ++channel)
      sum += std::pow(a.values[i + channel] - b.values[i + channel], 2);
    count += 3;
  }
  return -10 * std::log10(sum / static_cast<double>(count));
}

double largestDifference(const image::Image& a, const image::Image& b) {
  double largest = 0;
  for (size_t i = 0; i < a.values.size(); ++i)
    largest = std::max(largest, static_cast<double>(std::abs(a.values[i] - b.values[i])));
  return largest;
}

// Pixels that only one picture has on the object.
size_t coverageErrors(const image::Image& a, const image::Image& b) {
  size_t count = 0;
  for (size_t i = 3; i < a.values.size(); i += 4) count += a.values[i] != b.values[i];
  return count;
}

bool isFinite(const image::Image& image) {
  return std::ranges::all_of(image.values, [](float v) { return std::isfinite(v); });
}

TEST_F(SlfFrameTest, AgreesWithTheReference) {
  FrameRenderer renderer = rendererOf();
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Camera camera = randomCamera(random, 200, 160);
    const image::Image expected = reference_->render(camera).color;
    for (const Stages method : kMethods) {
      const image::Image found = renderer.render(camera, {.method = method}).color;
      // Where a silhouette passes a pixel's middle within rounding, one of them shows what is behind.
      EXPECT_GT(psnrOf(found, expected), 66);
      EXPECT_LE(coverageErrors(found, expected), 3u);
    }
    // The paper's interpolation, on directions 45 degrees apart.
    const double gouraud = psnrOf(renderer.render(camera, {.basis = Basis::gouraud}).color, expected);
    EXPECT_GT(gouraud, 40);
    EXPECT_LT(gouraud, 56);
  }
}

TEST_F(SlfFrameTest, BothMethodsAgree) {
  FrameRenderer renderer = rendererOf();
  std::mt19937 random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const Camera camera = randomCamera(random, 200, 160);
    const Frame fused = renderer.render(camera, {.observed = true});
    const Frame stages = renderer.render(camera, {.method = Stages::twoStages, .observed = true});
    EXPECT_LT(largestDifference(fused.color, stages.color), 1e-5);
    EXPECT_LT(largestDifference(fused.observed, stages.observed), 1e-5);
    EXPECT_EQ(fused.depth.values, stages.depth.values);
  }
}

// Also that hat functions sum to 1 and leave no gap between triangles.
TEST_F(SlfFrameTest, AConstantFieldIsConstant) {
  const ConstantTextures constant(*field_, {0.25f, 0.5f, 2, 1});
  FrameRenderer renderer(*field_, constant, {}, context_->describe().limits);
  std::mt19937 random(3);
  for (int trial = 0; trial < 30; ++trial) {
    const Camera camera = randomCamera(random, 120, 100);
    for (const FrameOptions& options :
         {FrameOptions{}, {.method = Stages::twoStages}, {.basis = Basis::gouraud}}) {
      const image::Image color = renderer.render(camera, options).color;
      for (size_t i = 0; i < color.values.size(); i += 4) {
        const float alpha = color.values[i + 3];
        ASSERT_NEAR(color.values[i], 0.25f * alpha, 1e-6);
        ASSERT_NEAR(color.values[i + 1], 0.5f * alpha, 1e-6);
        ASSERT_NEAR(color.values[i + 2], 2 * alpha, 4e-6);
      }
    }
  }
}

// Triangles of an octahedron reach behind the camera.
TEST_F(SlfFrameTest, SixDirectionsSuffice) {
  const SyntheticOptions options{.cells = 2, .quads = 8, .texels = 16, .subdivisions = 0};
  const Field field = syntheticField(options);
  const SyntheticTextures textures(field, options);
  const Reference reference(field, textures);
  FrameRenderer renderer(field, textures, {}, context_->describe().limits);
  std::mt19937 random(14);
  for (int trial = 0; trial < 10; ++trial) {
    const Camera camera = randomCamera(random, 80, 60);
    const image::Image expected = reference.render(camera).color;
    for (const Stages method : kMethods)
      EXPECT_GT(psnrOf(renderer.render(camera, {.method = method}).color, expected), 60);
  }
}

TEST_F(SlfFrameTest, GouraudWeightsStayWithin0And1WhereTrianglesReachBehindTheCamera) {
  const SyntheticOptions options{.cells = 2, .quads = 8, .texels = 16, .subdivisions = 0};
  const Field field = syntheticField(options);
  const SyntheticTextures textures(field, options);
  FrameRenderer renderer(field, textures, {}, context_->describe().limits);
  std::mt19937 random(16);
  for (int trial = 0; trial < 20; ++trial) {
    const Camera camera = cameraAt(1.3 * randomUnit(random), randomUnit(random), 40, 30, 6);
    const Frame frame = renderer.render(camera, {.basis = Basis::gouraud, .observed = true});
    for (const float observed : frame.observed.values) {
      ASSERT_GE(observed, 0) << trial;
      ASSERT_LE(observed, 1.0001f) << trial;
    }
  }
}

TEST_F(SlfFrameTest, CullingDoesNotChangeABit) {
  FrameRenderer renderer = rendererOf();
  std::mt19937 random(4);
  for (int trial = 0; trial < 200; ++trial) {
    Camera camera = randomCamera(random, 48, 40);
    if (trial % 4 == 3) { // near, beside and in the object
      const double distance = std::uniform_real_distribution<double>(0, 1.6)(random);
      const Vec3<double> place = distance * randomUnit(random);
      camera = cameraAt(place, randomUnit(random) - place, 48, 40, 30);
    }
    for (const Stages method : kMethods) {
      const Frame culled = renderer.render(camera, {.method = method, .observed = true});
      const Frame all = renderer.render(
          camera, {.method = method, .plan = kNoCulling, .visitedTriangles = false, .observed = true});
      ASSERT_EQ(culled.color.values, all.color.values) << trial;
      ASSERT_EQ(culled.depth.values, all.depth.values) << trial;
      ASSERT_EQ(culled.observed.values, all.observed.values) << trial;
      EXPECT_EQ(all.stats.passes, field_->textures());
      EXPECT_LT(culled.stats.passes, all.stats.passes);
    }
  }
}

TEST_F(SlfFrameTest, EachOptimisationAloneDoesNotChangeABit) {
  FrameRenderer renderer = rendererOf();
  std::mt19937 random(5);
  for (int trial = 0; trial < 5; ++trial) {
    const Camera camera = randomCamera(random, 48, 40);
    for (FrameOptions options : {FrameOptions{},
                                 {.method = Stages::twoStages},
                                 {.method = Stages::twoStages, .basis = Basis::gouraud}}) {
      const std::vector<float> expected = renderer.render(camera, options).color.values;
      for (int bits = 1; bits < 16; ++bits) {
        options.plan = {
            .regionCulling = !(bits & 1), .directionCulling = !(bits & 2), .scissor = !(bits & 4)};
        options.visitedTriangles = !(bits & 8);
        ASSERT_EQ(renderer.render(camera, options).color.values, expected) << bits;
      }
    }
  }
}

TEST_F(SlfFrameTest, DrawsOfFewOfManyDirectionsDoNotChangeABit) {
  // 512 direction triangles: without culling a region takes many draws, and with few slots still more.
  const SyntheticOptions fine{.cells = 1, .quads = 8, .texels = 8, .subdivisions = 3};
  const Field field = syntheticField(fine);
  const SyntheticTextures textures(field, fine);
  FrameRenderer ample(field, textures, {}, context_->describe().limits);
  FrameRenderer tight(field, textures, {0, CachePolicy::lru}, context_->describe().limits);
  std::mt19937 random(15);
  for (int trial = 0; trial < 3; ++trial) {
    const Camera camera = randomCamera(random, 48, 40);
    const std::vector<float> expected = ample.render(camera).color.values;
    EXPECT_EQ(ample.render(camera, {.plan = kNoCulling}).color.values, expected);
    EXPECT_EQ(tight.render(camera).color.values, expected);
  }
}

TEST_F(SlfFrameTest, BudgetsAndPoliciesDoNotChangeABit) {
  std::vector<Camera> path;
  std::mt19937 random(6);
  for (int i = 0; i < 3; ++i) path.push_back(randomCamera(random, 48, 40));
  path.push_back(path[0]);
  for (const Stages method : kMethods) {
    FrameRenderer ample = rendererOf();
    std::vector<std::vector<float>> expected;
    for (const Camera& camera : path)
      expected.push_back(ample.render(camera, {.method = method}).color.values);
    EXPECT_EQ(expected[0], expected[3]);
    for (const CachePolicy policy : {CachePolicy::lru, CachePolicy::modifiedLru, CachePolicy::planned})
      for (const size_t bytes : {size_t{0}, 5 * kSlotBytes, 40 * kSlotBytes}) {
        FrameRenderer renderer = rendererOf({bytes, policy});
        for (size_t i = 0; i < path.size(); ++i) {
          const Frame frame = renderer.render(path[i], {.method = method});
          ASSERT_EQ(frame.color.values, expected[i]);
          EXPECT_EQ(frame.stats.textures.bytes, frame.stats.textures.misses * kTextureBytes);
        }
      }
  }
}

TEST_F(SlfFrameTest, ABudgetOfLessThanThreeTexturesHasThreeSlots) {
  for (const size_t bytes : {size_t{0}, size_t{1}, kSlotBytes - 1, 2 * kSlotBytes})
    EXPECT_EQ(rendererOf({bytes, CachePolicy::lru}).slots().shape().count, kLeastSlots);
  EXPECT_EQ(rendererOf({10 * kSlotBytes, CachePolicy::lru}).slots().shape().count, 10u);
  EXPECT_EQ(rendererOf().slots().shape().count, field_->textures());
}

TEST_F(SlfFrameTest, TexturesThatFitAreUploadedOnce) {
  FrameRenderer renderer = rendererOf();
  std::mt19937 random(7);
  const Camera camera = randomCamera(random, 48, 40);
  const TextureCounts first = renderer.render(camera).stats.textures;
  EXPECT_EQ(first.hits, 0u);
  EXPECT_EQ(first.misses, renderer.render(camera).stats.passes);
  const TextureCounts second = renderer.render(camera).stats.textures;
  EXPECT_EQ(second.misses, 0u);
  EXPECT_EQ(second.bytes, 0u);
}

TEST_F(SlfFrameTest, PixelsAreFiniteFromEverywhere) {
  std::mt19937 random(8);
  const auto vertex = field_->mesh.positions[17].cast<double>().raw();
  std::vector<Camera> cameras{
      cameraAt({0, 0, 0}, {1, 2, 3}, 40, 30, 20),     // in the middle
      cameraAt(vertex, vertex, 40, 30, 20),           // on the surface, looking out
      cameraAt(vertex, -vertex, 40, 30, 20),          // looking in
      cameraAt(1.0001 * vertex, -vertex, 40, 30, 20), // the surface is nearer than the near plane
      cameraAt({1e6, 0, 0}, {-1, 0, 0}, 40, 30, 1e7), // far away
      cameraAt({0, 0, 3}, {0, 0, 1}, 40, 30, 20),     // looking away
      cameraAt({0, 0, 3}, {0, 0, -1}, 40, 30, 0.5),   // nearly all directions
      cameraAt({3, 0, 0}, {-1, 0, 0}, 1, 1, 1)};      // a single pixel
  for (int i = 0; i < 20; ++i) {
    const Vec3<double> place = 1.05 * randomUnit(random);
    cameras.push_back(cameraAt(place, randomUnit(random), 40, 30, 20));
  }
  FrameRenderer renderer = rendererOf();
  for (const Camera& camera : cameras)
    for (const FrameOptions& options : {FrameOptions{.observed = true},
                                        {.method = Stages::twoStages, .observed = true},
                                        {.basis = Basis::gouraud}}) {
      const Frame frame = renderer.render(camera, options);
      EXPECT_TRUE(isFinite(frame.color));
      EXPECT_TRUE(isFinite(frame.observed));
      for (size_t i = 0; i < frame.depth.values.size(); ++i)
        EXPECT_EQ(std::isfinite(frame.depth.values[i]), frame.color.values[4 * i + 3] == 1);
    }
}

TEST_F(SlfFrameTest, DepthIsTheDistanceAlongTheViewingAxis) {
  FrameRenderer renderer = rendererOf();
  std::mt19937 random(9);
  const Camera camera = randomCamera(random, 60, 50);
  const Frame frame = renderer.render(camera);
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  size_t compared = 0;
  for (int y = 0; y < 50; ++y)
    for (int x = 0; x < 60; ++x) {
      const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
      const auto hit = reference_->firstHit(worldFromCamera(ray->origin), worldFromCamera(ray->direction));
      const float found = frame.depth.at(x, y)[0];
      if (!hit || std::isinf(found)) continue;
      ++compared;
      EXPECT_NEAR(found, hit->distance * -ray->direction.z(), 1e-4);
    }
  EXPECT_GT(compared, 1000u);
}

TEST_F(SlfFrameTest, ObservedIsTheTexelsAlpha) {
  FrameRenderer renderer = rendererOf();
  std::mt19937 random(10);
  for (const Stages method : kMethods) {
    const Camera camera = randomCamera(random, 120, 100);
    const Frame frame = renderer.render(camera, {.method = method, .observed = true});
    const auto expected = reference_->render(camera);
    size_t different = 0, partly = 0;
    for (size_t i = 0; i < expected.observed.values.size(); ++i) {
      different += std::abs(frame.observed.values[i] - expected.observed.values[i]) > 1e-4f;
      partly += expected.observed.values[i] > 0.1f && expected.observed.values[i] < 0.9f;
    }
    EXPECT_LE(different, 3u);
    EXPECT_GT(partly, 20u);
    EXPECT_TRUE(renderer.render(camera, {.method = method}).observed.values.empty());
  }
}

TEST_F(SlfFrameTest, AFieldFarFromTheOriginLooksTheSame) {
  SyntheticOptions far = kSmall;
  far.middle = {512, -256, 1024}; // floats there have steps of 2^-13
  const Field field = syntheticField(far);
  const SyntheticTextures textures(field, far);
  FrameRenderer renderer(field, textures, {}, context_->describe().limits);
  std::mt19937 random(11);
  const Camera camera = randomCamera(random, 120, 100, far.middle);
  EXPECT_GT(psnrOf(renderer.render(camera).color, Reference(field, textures).render(camera).color), 60);
}

TEST_F(SlfFrameTest, LensesThatOpenGlDoesNotHaveAreRefused) {
  FrameRenderer renderer = rendererOf();
  std::mt19937 random(12);
  Camera camera = randomCamera(random, 40, 30);
  camera.lens.k1 = 0.1;
  EXPECT_EQ(image::errorOf([&] { renderer.render(camera); }),
            "lens: found distortion, expected none: OpenGL draws straight lines");
  camera.lens = {.model = capture::Lens::Model::orthographic, .width = 40, .height = 30};
  EXPECT_EQ(image::errorOf([&] { renderer.render(camera); }),
            "lens.model: found orthographic, expected pinhole");
}

// Fails at one read, and no more.
class FailingOnce : public Textures {
public:
  FailingOnce(const Textures& textures, int reads) : textures_(textures), reads_(reads) {}
  std::vector<Texel> read(size_t region, size_t direction) const override {
    if (reads_-- == 0) throw Error("cannot be read").in("textures.bin");
    return textures_.read(region, direction);
  }

private:
  const Textures& textures_;
  mutable int reads_;
};

TEST_F(SlfFrameTest, AfterAFailedReadTheNextFrameIsComplete) {
  std::mt19937 random(13);
  const Camera camera = randomCamera(random, 48, 40);
  const FailingOnce failing(*textures_, 20);
  FrameRenderer renderer(*field_, failing, {}, context_->describe().limits);
  EXPECT_EQ(image::errorOf([&] { renderer.render(camera); }), "textures.bin: cannot be read");
  EXPECT_EQ(renderer.render(camera).color.values, rendererOf().render(camera).color.values);
}

TEST_F(SlfFrameTest, AFieldWithoutRegionsIsEmpty) {
  Field field;
  const ConstantTextures textures(field, {1, 1, 1, 1});
  FrameRenderer renderer(field, textures, {}, context_->describe().limits);
  const Frame frame = renderer.render(cameraAt({0, 0, 3}, {0, 0, -1}, 4, 3, 4));
  EXPECT_EQ(frame.color.values, std::vector<float>(48));
}

} // namespace
} // namespace surflect::slf
