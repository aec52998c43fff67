#include "apps/viewer/tabs.h"

#include <gtest/gtest.h>

namespace surflect::viewer {
namespace {

using namespace std::chrono_literals;
using Models = std::vector<size_t>;

TEST(Tabs, NoMoreThanEightAreOpenAtATime) {
  Tabs tabs;
  const auto now = Tabs::Clock::now();
  for (size_t i = 0; i < kMostTabs; ++i) EXPECT_TRUE(tabs.admit("tab " + std::to_string(i), now));
  EXPECT_FALSE(tabs.admit("another", now));
  EXPECT_TRUE(tabs.admit("tab 0", now + 40s));
  EXPECT_TRUE(tabs.admit("another", now + 46s)); // all others but tab 0 have closed
  EXPECT_TRUE(tabs.isOpen("tab 0", now + 46s));
  EXPECT_FALSE(tabs.isOpen("tab 1", now + 46s));
}

TEST(Tabs, AModelIsWatchedByItsPagesAndByNoClosedOne) {
  Tabs tabs;
  const auto now = Tabs::Clock::now();
  EXPECT_EQ(tabs.unwatched(4, now), (Models{0, 1, 2, 3}));
  tabs.admit("a", now);
  tabs.admit("b", now);
  tabs.look("a", 0);
  tabs.look("b", 0);
  tabs.look("b", 1);
  EXPECT_EQ(tabs.unwatched(4, now), (Models{2, 3}));
  tabs.look("b", 2); // A and B are the last two
  EXPECT_EQ(tabs.unwatched(4, now), (Models{3}));
  tabs.leave("a");
  EXPECT_EQ(tabs.unwatched(4, now), (Models{0, 3}));
  tabs.look("a", 3); // an answer that comes late
  EXPECT_EQ(tabs.unwatched(4, now), (Models{0, 3}));
  EXPECT_EQ(tabs.unwatched(4, now + 46s), (Models{0, 1, 2, 3}));
}

} // namespace
} // namespace surflect::viewer
