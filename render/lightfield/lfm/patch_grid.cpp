#include "render/lightfield/lfm/patch_grid.h"

#include "surfel/base/error.h"

#include <cassert>
#include <string>

namespace surflect::lfm {

PatchGrid::PatchGrid(int samplesPerEdge) : n_(samplesPerEdge) {
  if (samplesPerEdge < 2 || samplesPerEdge > kMostPerEdge)
    throw Error::mismatch("2 to " + std::to_string(kMostPerEdge), std::to_string(samplesPerEdge))
        .at("samples");
}

PatchPlace PatchGrid::place(size_t sample) const {
  int left = static_cast<int>(sample), j = 0;
  while (left >= n_ - j) left -= n_ - j++;
  return {left, j};
}

std::array<int, 3> PatchGrid::steps(size_t sample) const {
  const auto [i, j] = place(sample);
  return {n_ - 1 - i - j, i, j};
}

Vec3<double> PatchGrid::barycentrics(size_t sample) const {
  const auto [a, b, c] = steps(sample);
  return Vec3<double>(a, b, c) / (n_ - 1);
}

size_t PatchGrid::besideFarEdge(size_t sample, size_t corner) const {
  std::array<int, 3> to = steps(sample);
  assert(to[corner] == 0);
  int& second = to[(corner + 1) % 3];
  int& third = to[(corner + 2) % 3];
  ++to[corner];
  --(second >= third ? second : third);
  return index({to[1], to[2]});
}

int samplesPerEdgeFor(double pixels) {
  constexpr std::array kPerEdge{4, 6, 8, 12, 16, 24, 32};
  for (const int n : kPerEdge)
    if (static_cast<double>(PatchGrid::samples(n)) >= pixels) return n;
  return kPerEdge.back();
}

} // namespace surflect::lfm
