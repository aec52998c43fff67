// Gaussians in the PLY files that programs for 3D Gaussian splatting read.
//
// [Kerbl 2023] The fields are those of the authors' implementation (scene/gaussian_model.py): x y z,
//              nx ny nz, f_dc_0..2, f_rest_0.., opacity, scale_0..2, rot_0..3, little-endian floats, where
//                colour = 1/2 + sum_j f_j Y_j, those of f_rest by channel, in the direction from the viewer;
//                opacity = 1 / (1 + exp(-field)),  scale = exp(field),  rot = w, x, y, z.
//              Programs show the colour as it is, so that it is sRGB-encoded.
#pragma once

#include "render/gaussians/gaussians.h"
#include "surfel/base/time.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::gaussians {

// Names of the fields.
std::vector<std::string> plyFields(int degree);

// Values of the fields of a Gaussian. Opacities are kept 1e-6 away from 0 and 1, and scales above the least
// normal float, so that all values are finite.
std::vector<float> plyValues(const Shape& shape, const Look& look, int degree);

// Bytes of a file.
uint64_t plyBytes(size_t gaussians, int degree, std::string_view comment);

// Writes a file atomically, a part of the Gaussians at a time. The comment is one line. Throws Error and
// Cancelled.
void writeGaussianPly(const std::filesystem::path& path, const Gaussians& gaussians, int degree,
                      std::string_view comment, const Progress& progress = {});

} // namespace surflect::gaussians
