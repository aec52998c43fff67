#include "srf/model/view_chooser.h"

#include <algorithm>

namespace surflect::model {

ViewChooser::ViewChooser(const Model& model, const QueryBatch& batch, const ShadeOptions& options)
    : model_(model), batch_(batch), options_(options), all_(model, options.nearest, options.simd),
      lanes_(sourcesOf(model.rig.views), model.fades, options.simd) {}

void ViewChooser::choose(size_t begin, size_t count) {
  begin_ = begin;
  if (options_.nearest) return;
  std::array<Point3<AcquisitionSpace>, ulr::kChoiceLanes> places;
  const std::span surfels(batch_.surfels.data() + begin, count);
  for (size_t lane = 0; lane < count; ++lane) places[lane] = model_.cloud.p0[surfels[lane]];
  blends_ = &lanes_.blend(surfels, {places.data(), count}, {batch_.towardsView.data() + begin, count},
                          options_.cameras);
  const size_t next = begin + count, ahead = std::min(ulr::kChoiceLanes, batch_.surfels.size() - next);
  lanes_.fetchFades({batch_.surfels.data() + next, ahead});
}

} // namespace surflect::model
