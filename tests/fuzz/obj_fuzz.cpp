#include "surfel/geometry/obj.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz_obj(std::string_view input) {
  parseObj(input);
  parseTexturedObj(input);
}
