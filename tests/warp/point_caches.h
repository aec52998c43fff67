// Bytes of point caches for tests, written from the description of their layout.
#pragma once

#include "surfel/math/space.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

namespace surflect::warp {

inline std::string fourBytes(uint32_t value, bool bigFirst) {
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(value >> shift);
  if (bigFirst) std::ranges::reverse(bytes);
  return bytes;
}
inline std::string fourBytes(double value, bool bigFirst) {
  return fourBytes(std::bit_cast<uint32_t>(static_cast<float>(value)), bigFirst);
}

inline std::string pointBytes(const std::vector<std::vector<Vec3<double>>>& poses, bool bigFirst) {
  std::string bytes;
  for (const auto& pose : poses)
    for (const auto& x : pose)
      for (const double coordinate : x) bytes += fourBytes(coordinate, bigFirst);
  return bytes;
}

inline std::string mddBytes(const std::vector<double>& seconds,
                            const std::vector<std::vector<Vec3<double>>>& poses) {
  std::string bytes = fourBytes(static_cast<uint32_t>(poses.size()), true) +
                      fourBytes(static_cast<uint32_t>(poses.at(0).size()), true);
  for (const double time : seconds) bytes += fourBytes(time, true);
  return bytes + pointBytes(poses, true);
}

inline std::string pc2Bytes(double first, double step, const std::vector<std::vector<Vec3<double>>>& poses) {
  return std::string("POINTCACHE2\0", 12) + fourBytes(uint32_t{1}, false) +
         fourBytes(static_cast<uint32_t>(poses.at(0).size()), false) + fourBytes(first, false) +
         fourBytes(step, false) + fourBytes(static_cast<uint32_t>(poses.size()), false) +
         pointBytes(poses, false);
}

} // namespace surflect::warp
