#include "srf/model/manifest.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz_manifest(std::string_view input) {
  model::identityOf(model::parseManifest(input, "manifest.json"));
}
