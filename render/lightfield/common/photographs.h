// Photographs of views in memory, to be asked at places between pixels.
#pragma once

#include "render/lightfield/common/views.h"
#include "srf/capture/camera.h"
#include "surfel/base/progress.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lightfield {

// Pictures of some views as half floats, 8 bytes a pixel.
class Photographs {
public:
  // Reads the views of these indices. Throws Error and Cancelled.
  Photographs(const Views& views, std::span<const size_t> indices, const Progress& progress = {});

  size_t size() const { return pictures_.size(); }
  // Linear RGBA, premultiplied, bilinear between pixel centres; beyond those at the border it is constant.
  Eigen::Vector4f at(size_t photograph, capture::Pixel pixel) const;

private:
  struct Picture {
    int width = 0, height = 0;
    std::vector<std::array<uint16_t, 4>> pixels;
  };

  std::vector<Picture> pictures_;
};

} // namespace surflect::lightfield
