#include "bench/doll/machine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

namespace surflect::bench {
namespace {

TEST(Machine, LimitsAreFinite) {
  const MachineLimits limits = measureMachine(testing::TempDir());
  EXPECT_EQ(limits.threads, allThreads());
  const auto expectRate = [](const char* name, const MachineLimits::OneAll& rate) {
    for (const double value : {rate.one, rate.all}) {
      EXPECT_TRUE(std::isfinite(value)) << name;
      EXPECT_GT(value, 0) << name;
    }
  };
  expectRate("read", limits.read);
  expectRate("copy", limits.copy);
  expectRate("triad", limits.triad);
  expectRate("random lines", limits.randomLines);
  expectRate("sse", limits.sse);
  if (limits.avx2) expectRate("avx2", *limits.avx2);
  if (limits.avx512) expectRate("avx512", *limits.avx512);
  if (limits.bf16) expectRate("bf16", *limits.bf16);
  expectRate("cached read", limits.cachedRead);
  EXPECT_GT(limits.directRead.value_or(1), 0);
  EXPECT_GE(limits.bytesPerSecond(), limits.read.all);
  EXPECT_GE(limits.flopsPerSecond(), limits.sse.all);
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::path(testing::TempDir()) / "machine.scratch"));
}

// Wider registers do more at once; a second thread takes nothing from the first, or the measure is wrong.
// Others may use the machine meanwhile: one of a few attempts must show it.
TEST(Machine, ArithmeticGrowsWithLanesAndThreads) {
  bool shown = false;
  for (int attempt = 0; attempt < 20 && !shown; ++attempt) {
    const double one = sseFlopsPerSecond(1), two = sseFlopsPerSecond(2);
    const double wider = avx2FlopsPerSecond(1).value_or(2 * one);
    shown = two >= 0.8 * one && wider >= 1.5 * one;
  }
  EXPECT_TRUE(shown);
}

TEST(Machine, TwoThreadsReadAsMuchAsOne) {
  bool shown = false;
  for (int attempt = 0; attempt < 20 && !shown; ++attempt)
    shown = readBytesPerSecond(2) >= 0.8 * readBytesPerSecond(1);
  EXPECT_TRUE(shown);
}

} // namespace
} // namespace surflect::bench
