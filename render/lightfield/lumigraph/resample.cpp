#include "render/lightfield/lumigraph/resample.h"

#include "render/lightfield/common/pull_push.h"
#include "srf/image/half_float.h"
#include "srf/ulr/visibility_weights.h"
#include "surfel/base/error.h"
#include "surfel/geometry/mesh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
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

uint16_t storedHalf(float value) { return image::nearestHalf(std::clamp(value, -65504.f, 65504.f)); }

} // namespace

Resampler::Resampler(const lightfield::Views& views, const ResampleOptions& options, const Progress& progress)
    : input_(views), options_(options), photographs_(views, views.ofSplit(capture::Split::train), progress) {
  if (options.views < 1 || options.views > ulr::kMaxBlended)
    throw Error::mismatch("1.." + std::to_string(ulr::kMaxBlended), std::to_string(options.views))
        .at("views");
  for (const size_t view : views.ofSplit(capture::Split::train)) {
    const capture::Camera<AcquisitionSpace>& camera = views.camera(view);
    views_.push_back({camera.lens, capture::Projector(camera), capture::Viewpoint(camera)});
  }
}

Resampler::Look Resampler::lookAt(size_t view, const Point& p, const Vec3<double>& normal,
                                  const Direction& towards) const {
  const View& place = views_[view];
  const double cosine = normal.dot(towards.raw());
  if (!(cosine > 0)) return {};
  const auto pixel = place.project(p);
  if (!pixel || !capture::contains(place.lens, *pixel)) return {};
  const Eigen::Vector4f color = photographs_.at(view, *pixel);
  const double fade = ulr::grazingFade(cosine) * ulr::borderFade(place.lens, *pixel) *
                      ulr::smoothStep(0.5, 1, static_cast<double>(color[3]));
  if (!(fade > 0)) return {};
  const RayCaster<AcquisitionSpace>& rays = input_.rays();
  const double offset = 4 * rays.selfHitOffset();
  const auto lifted = p + assume<Direction>(offset * normal);
  if (rays.occluded(lifted, towards, offset, place.viewpoint.distance(p))) return {};
  return {fade, color.head<3>() / color[3]};
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
    size_t view;
  };
  thread_local std::vector<Order> order;
  order.clear();
  for (size_t view = 0; view < views_.size(); ++view)
    order.push_back({ulr::anglePenalty(back, views_[view].viewpoint.towards(p)), view});
  const auto later = [](const Order& a, const Order& b) {
    return std::pair(a.penalty, a.view) > std::pair(b.penalty, b.view);
  };
  std::ranges::make_heap(order, later);
  Candidates candidates{ulr::NearestCandidates(options_.views), {}};
  while (!order.empty()) {
    std::ranges::pop_heap(order, later);
    const auto [penalty, view] = order.back();
    order.pop_back();
    if (!(penalty < static_cast<double>(candidates.nearest.worst()))) break; // fades only raise penalties
    const Look look = lookAt(view, p, normal, views_[view].viewpoint.towards(p));
    if (!(look.fade > 0)) continue;
    if (options_.nearest) return {Sample::Kind::seen, look.color};
    candidates.offer(penalty / look.fade, look.color);
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
    for (int channel = 0; channel < 3; ++channel) texels[texel][channel] = storedHalf(colors[texel][channel]);
    texels[texel][3] = image::nearestHalf(kinds[texel] == Sample::Kind::missed ? 0.f : 1.f);
  }
  tally.seen += std::ranges::count(kinds, Sample::Kind::seen);
  tally.unseen += std::ranges::count(kinds, Sample::Kind::unseen);
  tally.missed += std::ranges::count(kinds, Sample::Kind::missed);
  return texels;
}

} // namespace surflect::lumigraph
