// What planners share: where they write, and the colours by which cameras and lights are told apart.
#pragma once

#include "srf/model/model.h"
#include "srf/model/query_batch.h"
#include "srf/store/shading_queue.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

// Of some of a plan's queries; rows count from 0.
struct PlanPart {
  std::vector<ShadingOp> ops;
  std::vector<LightWeight> rows;
  size_t unseen = 0;

  void clear() {
    ops.clear();
    rows.clear();
    unseen = 0;
  }

  // An operation on the view where it shows the place; none where it does not.
  void ask(const Model& model, uint32_t view, const Point3<AcquisitionSpace, double>& place, size_t target,
           float weight, size_t rowBegin, size_t rowEnd) {
    const auto pixel = model.rig.views[view].camera.project(place);
    if (!pixel) return;
    ops.push_back({static_cast<uint32_t>(target), view, static_cast<float>(pixel->x),
                   static_cast<float>(pixel->y), weight, static_cast<uint32_t>(rowBegin),
                   static_cast<uint32_t>(rowEnd)});
  }
};

// The cameras and lights that were blended for a query, in colours of their own.
struct BlendColors {
  Rgb cameras, lights;
};

// A saturated colour for each index, which it keeps for ever.
std::vector<Rgb> indexColors(size_t count);

inline float brightness(Rgb light) { return light.r + light.g + light.b; }

// Of each environment of the batch, as it is before its strength.
std::vector<float> environmentBrightness(const QueryBatch& batch);

} // namespace surflect
