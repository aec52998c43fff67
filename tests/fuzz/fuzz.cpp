#include "tests/fuzz/fuzz.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

namespace surflect {

TwoFiles twoFilesOf(std::string_view input) {
  if (input.size() < 4) return {};
  size_t split = 0;
  for (const char digit : input.substr(0, 3)) split = 10 * split + static_cast<uint8_t>(digit - '0') % 10;
  const std::string_view files = input.substr(4);
  split = std::min(split, files.size());
  return {input[3], files.substr(0, split), files.substr(split)};
}

std::filesystem::path memoryFile(std::string_view content) {
  static const int descriptor = ::memfd_create("input", 0);
  const auto size = static_cast<off_t>(content.size());
  if (::ftruncate(descriptor, size) != 0 || ::pwrite(descriptor, content.data(), content.size(), 0) != size)
    std::abort();
  return "/proc/self/fd/" + std::to_string(descriptor);
}

void requireContract(FuzzTarget& target, std::string_view input) {
  try {
    target(input);
  } catch (const Error& error) {
    if (!std::strpbrk(error.what(), "\n\r")) return;
    std::fprintf(stderr, "more than one line: %s\n", error.what());
    std::abort();
  }
}

} // namespace surflect

#ifdef SURFLECT_FUZZ_TARGET // libFuzzer's entry
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  surflect::requireContract(surflect::SURFLECT_FUZZ_TARGET, {reinterpret_cast<const char*>(bytes), size});
  return 0;
}
#endif
