#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ply.h"
#include "tests/fuzz/fuzz.h"

#include <cmath>
#include <cstdlib>

// Both readers of plain columns must agree.
void surflect::fuzz_ply(std::string_view input) {
  constexpr std::string_view kNames[] = {"x", "y"};
  if (const auto columns = parseWrittenPly(input, "vertex", kNames)) {
    const PlyFile ply = parsePly(input);
    for (size_t c = 0; c < std::size(kNames); ++c) {
      const auto values = ply.find("vertex")->scalars(kNames[c]);
      const std::vector<float>& column = (*columns)[c];
      if (column.size() != values.size()) std::abort();
      for (size_t i = 0; i < values.size(); ++i)
        if (column[i] != values[i] && !(std::isnan(column[i]) && std::isnan(values[i]))) std::abort();
    }
  }
  readMesh(memoryFile(input));
}
