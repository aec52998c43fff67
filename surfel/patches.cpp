#include "surfel/patches.h"

#include "surfel/math/bounds.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect {

namespace {

constexpr float kLeastCosine = 0.7f; // between the normals of a patch and of its first surfel
constexpr float kWidest = 0.02f;     // of a patch, over the diagonal of the cloud's box

Vec3<float> normalOf(const SurfelCloud& cloud, size_t surfel) {
  return rotationOf<float>(cloud.r0[surfel]).col(2);
}

uint32_t middleOf(const SurfelCloud& cloud, size_t begin, size_t end) {
  Vec3<float> mean = Vec3<float>::Zero(); // relative to the first surfel
  for (size_t i = begin; i < end; ++i) mean += cloud.p0[i].raw() - cloud.p0[begin].raw();
  mean = cloud.p0[begin].raw() + mean / static_cast<float>(end - begin);
  size_t middle = begin;
  const auto squared = [&](size_t i) { return (cloud.p0[i].raw() - mean).squaredNorm(); };
  for (size_t i = begin; i < end; ++i)
    if (squared(i) < squared(middle)) middle = i;
  return static_cast<uint32_t>(middle);
}

} // namespace

Patches patchesOf(const SurfelCloud& cloud, size_t most) {
  assert(most > 0);
  const size_t count = cloud.size();
  const float width = 1.5f * std::sqrt(static_cast<float>(most)); // of a patch, in spacings of surfels
  const float widest = kWidest * static_cast<float>(boundsOf(cloud.p0).diagonal().norm());
  Patches patches;
  for (size_t begin = 0, end = 0; begin < count; begin = end) {
    const Vec3<float> normal = normalOf(cloud, begin);
    const float farthest = std::min(width * cloud.radius[begin], widest);
    for (end = begin + 1; end < std::min(count, begin + most); ++end)
      if ((cloud.p0[end].raw() - cloud.p0[begin].raw()).norm() > farthest ||
          normal.dot(normalOf(cloud, end)) < kLeastCosine)
        break;
    patches.first.push_back(static_cast<uint32_t>(begin));
    patches.middle.push_back(middleOf(cloud, begin, end));
  }
  patches.first.push_back(static_cast<uint32_t>(count));
  return patches;
}

} // namespace surflect
