// How a picture is compared with the truth, the same everywhere:
//
// one exposure for the whole set; values clipped to [0, 1]; both over black; over the union of the two object
// masks; PSNR in linear light and after the sRGB curve, SSIM of the sRGB luma. Sets are pooled: figures of
// several pictures are those of their pixels together, never means of decibels.
//
// [Immerkaer 1996] Immerkaer: Fast Noise Variance Estimation, CVIU 64(2).
// [Wang 2004] Wang, Bovik, Sheikh, Simoncelli: Image Quality Assessment: From Error Visibility to Structural
//             Similarity.
#pragma once

#include "srf/image/image.h"
#include "srf/image/mask.h"

#include <cstddef>

namespace surflect::evaluation {

// A mean over any number of pictures: add the parts up, divide at the end.
struct PooledMean {
  double sum = 0;
  size_t count = 0;

  double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
  PooledMean& operator+=(const PooledMean& other) {
    sum += other.sum;
    count += other.count;
    return *this;
  }
};

// Decibels of a mean squared error for a peak of 1; infinite for none.
double psnr(double meanSquaredError);

// Values times exposure, clipped to [0, 1]; what is no number becomes 0. All channels alike.
image::Image exposed(const image::Image& linear, double exposure);
// The sRGB curve on every channel, for values in [0, 1].
image::Image srgbEncoded(const image::Image& linear);

// Squared differences of the first three channels over the mask.
PooledMean squaredError(const image::Image& a, const image::Image& b, const image::Mask& mask);

// The variance of pixel noise, averaged over the mask and three channels: the mean square of the response to
//   1 -2 1 / -2 4 -2 / 1 -2 1, over 36  [Immerkaer 1996],
// which is blind to planes but not to edges and texture: an upper bound. Pixels whose neighbours are not all
// in the mask are left out.
PooledMean noiseVariance(const image::Image& image, const image::Mask& mask);

// Structural similarity of the luma of two sRGB-encoded images, each of three or more channels, at the pixels
// of the mask: 11 x 11 Gaussian window of sigma 1.5, C1 = 0.01^2, C2 = 0.03^2  [Wang 2004, Eq. 13]. Windows
// see the pixels outside the mask too; at the border of the image they are cut and renormalised.
PooledMean structuralSimilarity(const image::Image& a, const image::Image& b, const image::Mask& mask);

struct Difference {
  PooledMean squaredErrorLinear, squaredErrorSrgb, similaritySrgb;

  double psnrLinear() const { return psnr(squaredErrorLinear.mean()); }
  double psnrSrgb() const { return psnr(squaredErrorSrgb.mean()); }
  double ssim() const { return similaritySrgb.mean(); }
  Difference& operator+=(const Difference& other);
};

// The whole protocol for one picture. Both images linear RGBA of one size, premultiplied; alpha is not
// exposed.
Difference compare(const image::Image& truth, const image::Image& rendered, double exposure);

} // namespace surflect::evaluation
