// [Gonzalez 1985] Clustering to minimize the maximum intercluster distance. Theoretical Computer Science 38.
#include "bench/doll/fewer_views.h"

#include "surfel/math/bounds.h"

#include <algorithm>
#include <cassert>

namespace surflect::bench {

std::vector<size_t> evenViews(const model::Model& model, size_t count) {
  const size_t all = model.rig.views.size();
  assert(count >= 1 && count <= all);
  const Vec3<double> middle = middleOf(model.cloud.p0).raw();
  std::vector<Vec3<double>> towards;
  for (const capture::View& view : model.rig.views)
    towards.push_back((view.camera.center().raw() - middle).normalized());
  std::vector<double> nearest(all, -1); // cosine to the nearest that is taken
  std::vector<size_t> taken{0};
  while (taken.size() < count) {
    for (size_t view = 0; view < all; ++view)
      nearest[view] = std::max(nearest[view], towards[view].dot(towards[taken.back()]));
    taken.push_back(static_cast<size_t>(std::ranges::min_element(nearest) - nearest.begin()));
  }
  std::ranges::sort(taken);
  return taken;
}

model::Model withViews(const model::Model& model, std::span<const size_t> views) {
  assert(!views.empty() && std::ranges::is_sorted(views));
  model::Model part;
  part.folder = model.folder;
  part.rig = model.rig;
  part.cloud = model.cloud;
  part.middle = model.middle;
  part.white = model.white;
  part.tolerance = model.tolerance;
  part.lightBlend = model.lightBlend;
  part.isFullProduct = model.isFullProduct;
  part.rig.views.clear();
  part.rig.frames.clear();
  for (const size_t view : views) {
    part.rig.views.push_back(model.rig.views[view]);
    part.files.emplace_back(model.files[view].path());
    part.columns.push_back(model.columns[view]);
  }
  for (capture::Frame frame : model.rig.frames) {
    const auto found = std::ranges::lower_bound(views, frame.view);
    if (found == views.end() || *found != frame.view) continue;
    frame.view = static_cast<size_t>(found - views.begin());
    part.rig.frames.push_back(frame);
  }
  part.fades.views = views.size();
  part.fades.values.reserve(model.cloud.size() * views.size());
  for (size_t surfel = 0; surfel < model.cloud.size(); ++surfel)
    for (const size_t view : views) part.fades.values.push_back(model.fades.of(surfel)[view]);
  return part;
}

} // namespace surflect::bench
