#include "surfel/memory_use.h"

#include <vector>

namespace surflect {
namespace {

TEST(MemoryUse, CountsWhatIsWritten) {
  constexpr size_t kBytes = size_t{64} << 20;
  const MemoryUse before = memoryUse();
  std::vector<char> bytes(kBytes, 1);
  const MemoryUse during = memoryUse();
  EXPECT_GE(during.anonymousBytes, before.anonymousBytes + 0.9 * kBytes);
  EXPECT_GE(during.peakBytes, during.anonymousBytes);
}

TEST(MemoryUse, PeakStaysUntilItIsForgotten) {
  constexpr size_t kBytes = size_t{64} << 20;
  { const std::vector<char> bytes(kBytes, 1); }
  const double peak = memoryUse().peakBytes;
  EXPECT_GE(peak, memoryUse().anonymousBytes + 0.9 * kBytes);
  forgetPeakMemory();
  EXPECT_LT(memoryUse().peakBytes, peak - 0.9 * kBytes);
}

} // namespace
} // namespace surflect
