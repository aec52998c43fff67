// Maps of a frame for other programs: normals, heights and albedo in PNGs of 16 bits, with straight alpha.
#pragma once

#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "srf/image/png.h"

#include <optional>

namespace surflect::film {

// RGBA of 0.5 + 0.5 n, where n is the unit normal in camera axes: x right, y up, z towards the viewer.
// `normals` is the AOV `normal`, in object space. Off the object (0.5, 0.5, 1) of alpha 0, the normal
// towards the viewer.
image::PngSamples normalMap(const image::Image& color, const image::Image& normals,
                            const capture::Camera<ObjectSpace>& camera);

// Heights along the viewing axis above the plane through `middle`, from black to white.
struct HeightRange {
  Point3<ObjectSpace, double> middle;
  double radius = 1; // black lies so far behind the plane, white so far before it
};
struct HeightMap {
  image::PngSamples samples;
  std::optional<double> farthest; // height farthest from the plane; clipped beyond the radius
};
// Grey and alpha: 0.5 + 0.5 h / radius, linear; the texts "height of black" and "height of white" state the
// range. `depth` is the AOV of that name.
HeightMap heightMap(const image::Image& color, const image::Image& depth, const HeightRange& range,
                    const capture::Camera<ObjectSpace>& camera);

// RGBA in the sRGB encoding, clipped at 1, of a frame as ShotRenderer::renderAlbedo renders it.
image::PngSamples albedoMap(const image::Image& color);

} // namespace surflect::film
