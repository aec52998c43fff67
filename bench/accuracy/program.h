// Main function of a measurement: prints JSON on stdout, or an error line on stderr. scripts/accuracy writes
// the tables.
#pragma once

#include "render/evaluation/measure.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

namespace surflect::bench {

using Json = nlohmann::ordered_json;
using Words = std::vector<std::string>;

inline Json jsonOf(const evaluation::Difference& difference) {
  return {{"psnr_linear_db", difference.psnrLinear()},
          {"psnr_srgb_db", difference.psnrSrgb()},
          {"ssim_srgb", difference.ssim()}};
}

// Runs a program and returns its exit code: 2 if the number of arguments is not among `counts`, 1 if
// `measure` throws.
inline int runProgram(int argc, char** argv, const std::string& usage, std::initializer_list<size_t> counts,
                      const std::function<Json(const Words& words)>& measure) {
  const Words words(argv + 1, argv + argc);
  if (std::ranges::find(counts, words.size()) == counts.end()) {
    std::fprintf(stderr, "usage: %s\n", usage.c_str());
    return 2;
  }
  try {
    std::printf("%s\n", measure(words).dump(2).c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", usage.substr(0, usage.find(' ')).c_str(), error.what());
    return 1;
  }
}

} // namespace surflect::bench
