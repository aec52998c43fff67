// Camera and time of a frame as standard attributes of OpenEXR [ImfStandardAttributes.h], for programs that
// place things in it.
//
// The world is object space. Rows are multiplied from the left, (x y z 1) M, and divided by their fourth
// number.
#pragma once

#include "render/scene/script.h"
#include "srf/capture/camera.h"
#include "srf/image/exr.h"

#include <optional>

namespace surflect::film {

// worldToCamera: x right, y up, z ahead, left-handed.
image::RowMatrix worldToCamera(const capture::Camera<ObjectSpace>& camera);

// worldToNDC: (0, 0) is the picture's upper left corner, (1, 1) its lower right one. z is 1 - 1/depth for a
// pinhole, the depth itself for an orthographic camera. Empty for a lens that distorts.
std::optional<image::RowMatrix> worldToNdc(const capture::Camera<ObjectSpace>& camera);

// All of them: worldToCamera, worldToNDC, framesPerSecond, imageCounter, software; owner where the script
// names one. Of a pinhole without distortion: screenWindowWidth and screenWindowCenter, width and middle of
// the picture at depth 1, x right and y up from the axis; pixelAspectRatio, width of a pixel over its height.
image::ExrAttributes standardAttributes(const capture::Camera<ObjectSpace>& camera,
                                        const scene::Script& script, int frame);

// These, and texts of the program: surflect.version, surflect.frame, and surflect.exposure in stops where the
// script gives one.
image::ExrAttributes frameAttributes(const capture::Camera<ObjectSpace>& camera, const scene::Script& script,
                                     int frame);

} // namespace surflect::film
