#include "surfel/base/memory.h"

#include <gtest/gtest.h>

#include <cstring>
#include <sys/mman.h>
#include <utility>

namespace surflect {

namespace {

TEST(ScratchBuffer, IsKeptWhileItIsEnoughAndNotFarTooMuch) {
  ScratchBuffer<int> room;
  int* const first = room.of(1000);
  first[999] = 7;
  EXPECT_EQ(room.of(1000), first);
  EXPECT_EQ(room.of(300), first);
  EXPECT_EQ(first[999], 7);
  room.of(100)[99] = 1; // had anew: a sanitizer would see a write beyond it
  room.of(4000)[3999] = 1;
}

TEST(ScratchBuffer, MovedAwayIsHadAnew) {
  ScratchBuffer<int> room;
  int* const first = room.of(10);
  ScratchBuffer<int> other = std::move(room);
  EXPECT_EQ(other.data(), first);
  int* const second = room.of(10);
  ASSERT_NE(second, nullptr);
  EXPECT_NE(second, first);
}

} // namespace

namespace {

constexpr size_t kBytes = size_t{64} << 20;

// Pages that nobody keeps when they are no longer used.
class Pages {
public:
  Pages() : begin_(::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) {
    EXPECT_NE(begin_, MAP_FAILED);
    std::memset(begin_, 1, kBytes);
  }
  ~Pages() { ::munmap(begin_, kBytes); }

private:
  void* begin_;
};

TEST(MemoryUse, CountsWhatIsWritten) {
  const MemoryUse before = memoryUse();
  const Pages pages;
  const MemoryUse during = memoryUse();
  EXPECT_GE(during.anonymousBytes, before.anonymousBytes + 0.9 * kBytes);
  EXPECT_GE(during.peakBytes, during.anonymousBytes);
}

TEST(MemoryUse, PeakStaysUntilItIsForgotten) {
  { const Pages pages; }
  const double peak = memoryUse().peakBytes;
  EXPECT_GE(peak, memoryUse().anonymousBytes + 0.9 * kBytes);
  forgetPeakMemory();
  EXPECT_LT(memoryUse().peakBytes, peak - 0.9 * kBytes);
}

} // namespace

} // namespace surflect
