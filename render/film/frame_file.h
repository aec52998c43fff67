// Frames as files.
#pragma once

#include "render/method/renderer.h"
#include "srf/image/exr.h"
#include "surfel/base/time.h"

#include <filesystem>
#include <string>

namespace surflect::film {

// The object over its shadow: colours as they are, alpha the sum of both.
image::Image overShadow(const method::FrameLayers& film);

// Color and AOVs as layers of one EXR: R G B A, depth.Z, normal.X normal.Y normal.Z, position.X ..., rest.X
// ..., camera_blend.R ..., stretch.V. On a ground A is that of the object over its shadow, and shadow.V the
// shadow's part of it. Depth, position and rest are single floats, all others half. Negative colours, which
// compression noise and the blending of lights can cause, become 0. The attributes are written to the header.
std::string frameBytes(const method::FrameLayers& film, const image::ExrAttributes& attributes,
                       const Progress& progress = {});
void writeFrame(const std::filesystem::path& path, const method::FrameLayers& film,
                const image::ExrAttributes& attributes);

// Colour and shadow of such a file, as in FrameLayers; without AOVs. Throws Error as ExrFile does.
method::FrameLayers readFrame(const std::filesystem::path& path);

// The 99.5th percentile of the object's pixels; 0 if there are none, or all are black.
double whiteOf(const image::Image& color);

} // namespace surflect::film
