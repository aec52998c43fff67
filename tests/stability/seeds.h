// Command line of the programs that fuzz frames.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace surflect::stability {

// Calls run(COUNT, FIRST) with the arguments `COUNT [FIRST]`; returns its exit code, or 2 without arguments.
inline int runSeeds(int argc, char** argv, int (*run)(unsigned count, unsigned first)) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s COUNT [FIRST]\n", argv[0]);
    return 2;
  }
  const auto number = [](const char* text) { return static_cast<unsigned>(std::strtoul(text, nullptr, 10)); };
  return run(number(argv[1]), argc > 2 ? number(argv[2]) : 0);
}

} // namespace surflect::stability
