#include "srf/model/model_files.h"
#include "tests/fuzz/fuzz.h"

#include <cstring>
#include <string>

// The first eight bytes say of how many surfels and views.
void surflect::fuzz_fades(std::string_view input) {
  uint32_t surfels = 0, views = 0;
  if (input.size() < 8) return;
  std::memcpy(&surfels, input.data(), 4);
  std::memcpy(&views, input.data() + 4, 4);
  model::unpackVisibility(std::as_bytes(std::span(input.substr(8))), surfels, views);
}
