#include "srf/import/lit_view.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz_lights(std::string_view input) {
  importers::parseLights(importers::withDecimalPoints(input));
}
