#include "surfel/base/scratch_buffer.h"

#include <gtest/gtest.h>

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
} // namespace surflect
