// Damage to files of our own formats.
#pragma once

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace surflect {

// Gives damaged content to read(bytes), which checks what it accepts: every truncation and a further byte,
// which must be Errors; and every byte replaced by others. Every Error must name a field in one line.
template <class Read> void tryDamage(std::span<const std::byte> content, const Read& read) {
  const auto isRefused = [&](std::span<const std::byte> damaged) {
    try {
      read(damaged);
      return false;
    } catch (const Error& error) {
      EXPECT_FALSE(error.field().empty()) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return true;
    }
  };
  for (size_t size = 0; size < content.size(); ++size)
    EXPECT_TRUE(isRefused(content.first(size))) << size << " bytes";
  std::vector<std::byte> damaged(content.begin(), content.end());
  damaged.push_back(std::byte{0});
  EXPECT_TRUE(isRefused(damaged)) << "a further byte";
  damaged.pop_back();
  for (size_t i = 0; i < damaged.size(); ++i) {
    for (const std::byte other :
         {std::byte{1}, std::byte{2}, std::byte{0xff}, content[i] ^ std::byte{0x10}}) {
      damaged[i] = other;
      isRefused(damaged);
    }
    damaged[i] = content[i];
  }
}

} // namespace surflect
