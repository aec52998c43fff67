#include "srf/model/manifest.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz(std::string_view input) { identityOf(parseManifest(input, "manifest.json")); }
