// The outline of a matte, where alpha crosses 1/2, as a distance field.
#pragma once

#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"

#include <memory>

namespace surflect::hull {

// Copies share their pixels.
class Outline {
public:
  // alpha: one channel. It is taken as bilinear between pixel centres, and its contour as straight within
  // each square of four centres: sub-pixel where alpha has values between 0 and 1. The border of the image is
  // no outline.
  explicit Outline(const image::Image& alpha);

  int width() const { return distances_->width; }
  int height() const { return distances_->height; }
  // The pixels whose alpha is above 1/2.
  image::Mask mask() const;
  // Is no pixel's alpha above 1/2?
  bool isEmpty() const { return isEmpty_; }
  // The centre of mass of the pixels whose alpha is above 1/2; of the image where it is empty.
  capture::Pixel centroid() const { return centroid_; }

  // Is a pixel on the border of the image inside? Then there may be more beyond.
  bool isCropped() const { return isCropped_; }

  // Distance to the outline in pixels, positive inside; without an outline, width + height. Bilinear between
  // pixel centres, and beyond the outermost as on them. Beyond the image, less the way to it.

  double signedDistance(capture::Pixel pixel) const;

private:
  std::shared_ptr<const image::Image> distances_;
  capture::Pixel centroid_;
  bool isEmpty_ = true, isCropped_ = false;
};

} // namespace surflect::hull
