// Reflectance shared over the surface of a model (srf/reflectance), from the photographs in its view files.
#pragma once

#include "srf/model/model.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace surflect::model {

// True if tables can be made: the object is opaque, and there are lights that reach it.
bool canShare(const Model& model);

// Shared reflectance of a sample of a model's surfels.
struct SharedSample {
  std::vector<uint32_t> surfels; // ascending
  reflectance::SharedReflectance shared;
};

// Whether the photograph of a view and a light may be used.
using IsUsed = std::function<bool(size_t view, size_t light)>;

// Tables from photographs in which evenly chosen surfels are seen and lit well; canShare(model). Throws Error
// as ViewFile::read, and Cancelled.
SharedSample shareSample(const Model& model, const Progress& progress = {});

// Tables of the same kinds of surface, from fewer photographs. Throws as shareSample.
reflectance::SharedReflectance refitSample(const Model& model, const SharedSample& sample,
                                           const IsUsed& isUsed, const Progress& progress = {});

// The tables of a sample, spread over all surfels of its model. Throws as shareSample.
reflectance::SharedReflectance spreadOver(const Model& model, const SharedSample& sample,
                                          const Progress& progress = {});

} // namespace surflect::model
