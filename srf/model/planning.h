// What planners share: how they ask for a look-up, and the colours by which cameras and lights are told
// apart.
#pragma once

#include "srf/model/shading_plan.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect::model {

using ViewProjectors = std::vector<capture::Projector<AcquisitionSpace>>;
ViewProjectors projectorsOf(std::span<const capture::View> views);

// A look-up for a target.
struct Question {
  size_t target;
  uint32_t view;
  float weight;
  size_t rowBegin, rowEnd;
};

// Adds an operation on the view where it shows the place; none where it does not.
inline void ask(const ViewProjectors& projectors, const Point3<AcquisitionSpace, double>& place,
                const Question& question, ShadingPlan& plan) {
  const auto pixel = projectors[question.view](place);
  if (!pixel) return;
  plan.ops.push_back({static_cast<uint32_t>(question.target), question.view, static_cast<float>(pixel->x),
                      static_cast<float>(pixel->y), question.weight, static_cast<uint32_t>(question.rowBegin),
                      static_cast<uint32_t>(question.rowEnd)});
}

// A saturated colour for each index, which it keeps for ever.
std::vector<Rgb> indexColors(size_t count);

inline float brightness(Rgb light) { return light.r + light.g + light.b; }

// Of each environment of the batch, as it is before its strength.
std::vector<float> environmentBrightness(const QueryBatch& batch);

} // namespace surflect::model
