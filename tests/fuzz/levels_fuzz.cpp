#include "srf/model/model_files.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz_levels(std::string_view input) {
  SurfelCloud cloud;
  for (int i = 0; i < 4; ++i) cloud.p0.emplace_back(0.f, 0.f, 0.f);
  cloud.radius = cloud.coverage = {1, 1, 1, 1};
  model::unpackLevels(std::as_bytes(std::span(input)), cloud);
}
