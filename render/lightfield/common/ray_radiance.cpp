#include "render/lightfield/common/ray_radiance.h"

#include "srf/weights/ulr.h"
#include "surfel/base/error.h"
#include "surfel/geometry/mesh.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace surflect::lightfield {

std::optional<RayCaster<AcquisitionSpace>::Hit>
firstFrontHit(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays,
              const Point3<AcquisitionSpace, double>& origin,
              const Direction3<AcquisitionSpace, double>& direction) {
  constexpr int kBacks = 1000; // crossed at most
  double start = 0;
  for (int crossed = 0; crossed < kBacks; ++crossed) {
    auto hit = rays.firstHit(origin + start * direction, direction);
    if (!hit) return std::nullopt;
    hit->distance += start;
    if (areaVector(mesh, hit->triangle).dot(direction.raw()) < 0) return hit;
    start = hit->distance + rays.selfHitOffset();
  }
  return std::nullopt;
}

namespace {

// Colours of several views at P, offered in the order of their penalties.
struct Candidates {
  weights::NearestCandidates nearest;
  std::vector<Eigen::Vector3f> colors; // by candidate's index

  void offer(double penalty, const Eigen::Vector3f& color) {
    nearest.offer({static_cast<uint32_t>(colors.size()), static_cast<float>(penalty)});
    colors.push_back(color);
  }
  Eigen::Vector3f blended() const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const weights::Blended& blended : weights::ulrWeights(nearest))
      sum += blended.weight * colors[blended.index];
    return sum;
  }
};

} // namespace

RayRadiance::RayRadiance(const Views& views, const RayBlend& blend, const Progress& progress)
    : input_(views), blend_(blend), photographs_(views, progress), sight_(photographs_, views.rays()) {
  if (blend.views < 1 || blend.views > weights::kMaxBlended)
    throw Error::mismatch("1.." + std::to_string(weights::kMaxBlended), std::to_string(blend.views))
        .at("views");
}

RaySample RayRadiance::along(const Point3<AcquisitionSpace, double>& origin,
                             const Direction3<AcquisitionSpace, double>& direction) const {
  const auto hit = input_.rays().firstHit(origin, direction);
  if (!hit) return {};
  const Point3<AcquisitionSpace, double> p = origin + hit->distance * direction;
  const Direction3<AcquisitionSpace, double> back = -direction;
  Vec3<double> normal = areaVector(input_.mesh(), hit->triangle).normalized();
  if (normal.dot(back.raw()) < 0) normal = -normal;

  struct Order {
    double penalty;
    size_t photograph;
  };
  thread_local std::vector<Order> order;
  order.clear();
  for (size_t i = 0; i < sight_.photographs(); ++i)
    order.push_back({weights::anglePenalty(back, sight_.towards(i, p)), i});
  const auto later = [](const Order& a, const Order& b) {
    return std::pair(a.penalty, a.photograph) > std::pair(b.penalty, b.photograph);
  };
  std::ranges::make_heap(order, later);
  Candidates candidates{weights::NearestCandidates(blend_.views), {}};
  while (!order.empty()) {
    std::ranges::pop_heap(order, later);
    const auto [penalty, photograph] = order.back();
    order.pop_back();
    if (!(penalty < static_cast<double>(candidates.nearest.worst()))) break; // fades only raise penalties
    const auto seen = sight_.observe(photograph, {p, normal, normal});
    if (!seen) continue;
    if (blend_.nearest) return {RaySample::Kind::seen, seen->radiance, hit->distance};
    candidates.offer(penalty / static_cast<double>(seen->fade), seen->radiance);
  }
  if (candidates.colors.empty()) return {RaySample::Kind::unseen, Eigen::Vector3f::Zero(), hit->distance};
  return {RaySample::Kind::seen, candidates.blended(), hit->distance};
}

} // namespace surflect::lightfield
