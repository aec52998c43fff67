// Names of cameras and lights in findings.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace surflect::validation {

// A faulty camera or light, with the size of its fault.
struct Offender {
  double badness;
  std::string text;
};

// The worst three: "C03 (31 %), C07 (12 %), C01 (9 %)".
inline std::string worst(std::vector<Offender> offenders) {
  std::ranges::stable_sort(offenders, std::ranges::greater(), &Offender::badness);
  std::string list;
  for (size_t i = 0; i < std::min<size_t>(3, offenders.size()); ++i)
    list += (i > 0 ? ", " : "") + offenders[i].text;
  return list;
}

} // namespace surflect::validation
