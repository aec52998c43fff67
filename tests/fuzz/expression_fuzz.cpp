#include "tests/fuzz/fuzz.h"
#include "warp/motion.h"

#include <vector>

void surflect::fuzz_expression(std::string_view input) {
  const warp::Expression expression(std::string(input), warp::warpVariables);
  for (const double value : {0., -1.5, 1e300})
    expression(std::vector<double>(warp::warpVariables.size(), value));
}
