// write_doll_model FOLDER SURFELS VIEWS: a model of that many surfels, and of the paper's pictures and
// lights.
#include "bench/doll/doll_model.h"

#include <cstdio>
#include <exception>
#include <string>

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  try {
    surflect::bench::writeDollModel(argv[1], {.surfels = std::stoul(argv[2]), .views = std::stoul(argv[3])});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "write_doll_model: %s\n", error.what());
    return 1;
  }
}
