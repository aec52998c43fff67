#include "srf/import/lit_view.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz(std::string_view input) { parseLights(input); }
