// Checks of the stored blocks: that all can be read, and that each keeps the error that pack allowed it.
#pragma once

#include "render/verify/check.h"
#include "srf/codec/alpha_plane.h"
#include "srf/codec/view_file.h"
#include "srf/image/image.h"
#include "srf/model/model.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace surflect::verify {

// Photographs as a model stores them, decoded from its blocks.

// Calls use(block number, block) for every stored block of a view, in order. A damaged block is left out, and
// its error message appended to `faults`. Throws Cancelled.
void forEachBlock(const codec::ViewFile& file, std::vector<std::string>& faults, const Progress& progress,
                  const std::function<void(uint32_t, const codec::Block&)>& use);

// Radiance of a texel (0..63) of a block under a light.
Vec3<float> radianceAt(const codec::Block& block, int texel, size_t light);

// Pictures of these columns of a view file: RGBA, linear, premultiplied. Where the file stores texels, alpha
// is that of the plane, or 1 without a plane; elsewhere it is 0. Throws Error as ViewFile::read, and
// Cancelled.
std::vector<image::Image> storedPictures(const codec::ViewFile& file, const codec::AlphaPlane* alpha,
                                         std::span<const uint32_t> columns, const Progress& progress = {});

// Reads every block of the model. Its errors are measured against the capture that was packed, if it is
// given. Throws Error if the capture has other views, lights or photographs than the model, or cannot be
// read; and Cancelled.
std::vector<Check> blockChecks(const model::Model& model, const capture::Capture* capture,
                               const Bounds& bounds, const Progress& progress = {});

} // namespace surflect::verify
