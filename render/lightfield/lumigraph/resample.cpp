#include "render/lightfield/lumigraph/resample.h"

#include "render/lightfield/common/pull_push.h"
#include "srf/image/half_float.h"
#include "surfel/base/error.h"
#include "surfel/geometry/mesh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <string>
#include <utility>

namespace surflect::lumigraph {

namespace {

// Colours of several views at P, offered in the order of their penalties.
struct Candidates {
  ulr::NearestCandidates nearest;
  std::vector<Eigen::Vector3f> colors; // by candidate's index

  void offer(double penalty, const Eigen::Vector3f& color) {
    nearest.offer({static_cast<uint32_t>(colors.size()), static_cast<float>(penalty)});
    colors.push_back(color);
  }
  Eigen::Vector3f blended() const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const ulr::Blended& blended : ulr::ulrWeights(nearest))
      sum += blended.weight * colors[blended.index];
    return sum;
  }
};

} // namespace

Resampler::Resampler(const lightfield::Views& views, const ResampleOptions& options, const Progress& progress)
    : input_(views), options_(options), photographs_(views, progress), sight_(photographs_, views.rays()) {
  if (options.views < 1 || options.views > ulr::kMaxBlended)
    throw Error::mismatch("1.." + std::to_string(ulr::kMaxBlended), std::to_string(options.views))
        .at("views");
}

Sample Resampler::at(const Line& line) const {
  const auto hit = input_.rays().firstHit(line.origin, line.direction);
  if (!hit) return {};
  const Point p = line.origin + hit->distance * line.direction;
  const Direction back = -line.direction;
  Vec3<double> normal = areaVector(input_.mesh(), hit->triangle).normalized();
  if (normal.dot(back.raw()) < 0) normal = -normal;

  struct Order {
    double penalty;
    size_t photograph;
  };
  thread_local std::vector<Order> order;
  order.clear();
  for (size_t i = 0; i < sight_.photographs(); ++i)
    order.push_back({ulr::anglePenalty(back, sight_.towards(i, p)), i});
  const auto later = [](const Order& a, const Order& b) {
    return std::pair(a.penalty, a.photograph) > std::pair(b.penalty, b.photograph);
  };
  std::ranges::make_heap(order, later);
  Candidates candidates{ulr::NearestCandidates(options_.views), {}};
  while (!order.empty()) {
    std::ranges::pop_heap(order, later);
    const auto [penalty, photograph] = order.back();
    order.pop_back();
    if (!(penalty < static_cast<double>(candidates.nearest.worst()))) break; // fades only raise penalties
    const auto seen = sight_.observe(photograph, {p, normal, normal});
    if (!seen) continue;
    if (options_.nearest) return {Sample::Kind::seen, seen->radiance};
    candidates.offer(penalty / static_cast<double>(seen->fade), seen->radiance);
  }
  if (candidates.colors.empty()) return {Sample::Kind::unseen, {}};
  return {Sample::Kind::seen, candidates.blended()};
}

std::vector<Texel> Resampler::picture(const Slab& slab, int i, int j, Tally& tally,
                                      const Progress& progress) const {
  std::vector<Eigen::Vector4f> colors(slab.nodeTexels());
  std::vector<Sample::Kind> kinds(slab.nodeTexels());
  tbb::parallel_for(0, slab.height, [&](int row) {
    progress.checkpoint();
    for (int column = 0; column < slab.width; ++column) {
      const Sample sample =
          at(slab.lineOf({static_cast<double>(i), static_cast<double>(j), column + 0.5, row + 0.5}));
      const size_t texel = static_cast<size_t>(row) * slab.width + column;
      kinds[texel] = sample.kind;
      colors[texel] << sample.color, sample.kind == Sample::Kind::seen ? 1.f : 0.f;
    }
  });
  lightfield::pullPush(colors, slab.width, slab.height);
  std::vector<Texel> texels(slab.nodeTexels());
  for (size_t texel = 0; texel < texels.size(); ++texel) {
    for (int channel = 0; channel < 3; ++channel)
      texels[texel][channel] = image::finiteHalf(colors[texel][channel]);
    texels[texel][3] = image::nearestHalf(kinds[texel] == Sample::Kind::missed ? 0.f : 1.f);
  }
  tally.seen += std::ranges::count(kinds, Sample::Kind::seen);
  tally.unseen += std::ranges::count(kinds, Sample::Kind::unseen);
  tally.missed += std::ranges::count(kinds, Sample::Kind::missed);
  return texels;
}

} // namespace surflect::lumigraph
