// Fixture of tests that draw: a context of the software renderer for all tests of a suite. Any error that
// OpenGL reports fails the test.
#pragma once

#include "render/gl/context.h"
#include "render/gl/draw.h"
#include "tests/render/gl/shaders.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>

namespace surflect::gl {

class GlTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() { context_ = std::make_unique<Context>(ContextOptions{.software = true}); }
  static void TearDownTestSuite() { context_.reset(); }
  void TearDown() override { EXPECT_NO_THROW(requireNoErrors()); }

  static inline std::unique_ptr<Context> context_;
};

using Rng = std::mt19937;

inline float uniform(Rng& rng, float low, float high) {
  return std::uniform_real_distribution<float>(low, high)(rng);
}

// A mesh in clip space: positions are drawn as they are.
inline Program colorProgram(const Eigen::Vector4f& color,
                            const Eigen::Matrix4f& clipFromObject = Eigen::Matrix4f::Identity()) {
  Program program(kShaders, {"mesh.vert", "color.frag"});
  program.set("color", color);
  program.set("clipFromObject", clipFromObject);
  return program;
}

} // namespace surflect::gl
