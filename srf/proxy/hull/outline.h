// Outline of a matte, where alpha crosses 1/2, as a distance field.
#pragma once

#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "srf/image/mask.h"

#include <memory>

namespace surflect::hull {

// Copies share their pixels.
class Outline {
public:
  // alpha: one channel, bilinear between pixel centres. The contour is straight within each square of four
  // centres; it has sub-pixel accuracy where alpha has values between 0 and 1. The image border is not part
  // of the outline.
  explicit Outline(const image::Image& alpha);

  int width() const { return distances_->width; }
  int height() const { return distances_->height; }
  // Mask of the pixels whose alpha is above 1/2.
  image::Mask mask() const;
  // Returns whether no pixel's alpha is above 1/2.
  bool isEmpty() const { return isEmpty_; }
  // Centre of mass of the pixels whose alpha is above 1/2; the image centre if there are none.
  capture::Pixel centroid() const { return centroid_; }

  // Returns whether a pixel on the image border is inside, so that the object may continue outside.
  bool isCropped() const { return isCropped_; }

  // Distance to the outline in pixels, positive inside; without an outline, width + height. Bilinear between
  // pixel centres, constant up to the border. Outside of the image, reduced by the distance to the image.
  double signedDistance(capture::Pixel pixel) const;

private:
  std::shared_ptr<const image::Image> distances_;
  capture::Pixel centroid_;
  bool isEmpty_ = true, isCropped_ = false;
};

} // namespace surflect::hull
