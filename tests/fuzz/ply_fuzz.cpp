#include "surfel/geometry/mesh.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz(std::string_view input) { readMesh(memoryFile(input)); }
