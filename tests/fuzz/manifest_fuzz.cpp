#include "srf/model/manifest.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz(std::string_view input) {
  model::identityOf(model::parseManifest(input, "manifest.json"));
}
