// Error measures of an image against the truth: PSNR and SSIM, by one protocol for all results.
//
// One exposure for the whole set; values clipped to [0, 1]; both images over black; measured over the union
// of both object masks. PSNR is computed in linear light and after the sRGB curve, SSIM on the sRGB luma.
// Texels of the truth that are NaN are left out: no mask has them, and SSIM sees black in both images.
// Figures of several images pool their pixels; decibels are never averaged.
//
// [Immerkaer 1996] Immerkaer: Fast Noise Variance Estimation, CVIU 64(2).
// [Wang 2004] Wang, Bovik, Sheikh, Simoncelli: Image Quality Assessment: From Error Visibility to Structural
//             Similarity.
#pragma once

#include "srf/image/image.h"
#include "srf/image/mask.h"

#include <cstddef>

namespace surflect::evaluation {

// Mean over any number of images: sums are added up, and divided at the end.
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

// PSNR in decibels of a mean squared error, for a peak of 1; infinite for 0.
double psnr(double meanSquaredError);

// Multiplies all channels by the exposure and clips to [0, 1]; NaN becomes 0.
image::Image applyExposure(const image::Image& linear, double exposure);
// Applies the sRGB curve to every channel, for values in [0, 1].
image::Image srgbEncoded(const image::Image& linear);

// Whether a texel of a true image is a number in its first three channels. TrueFrames::read() has NaN where
// the photograph is not finite.
bool isValid(const image::Image& truth, size_t texel);
// Number of texels that are not valid.
size_t invalidTexels(const image::Image& truth);
// The mask without texels that are not valid in the true image.
image::Mask validPart(image::Mask mask, const image::Image& truth);
// Makes texels black that are not valid in the true image: measures that look at neighbourhoods then see no
// difference there.
void blackenInvalid(image::Image& image, const image::Image& truth);

// Squared differences of the first three channels over the mask.
PooledMean squaredError(const image::Image& a, const image::Image& b, const image::Mask& mask);

// Absolute differences of the first three channels over the mask.
PooledMean absoluteError(const image::Image& a, const image::Image& b, const image::Mask& mask);

// Absolute differences of alpha, the last channel of both images, over the pixels where 8 bits tell alpha
// from 0 in either.
PooledMean alphaError(const image::Image& a, const image::Image& b);

// Variance of pixel noise, averaged over the mask and three channels: the mean square of the response to
//   1 -2 1 / -2 4 -2 / 1 -2 1, over 36  [Immerkaer 1996].
// The filter cancels planes but not edges and texture, so the result is an upper bound. Pixels without all
// neighbours in the mask are left out.
PooledMean noiseVariance(const image::Image& image, const image::Mask& mask);

// SSIM of the luma of two sRGB-encoded images with at least three channels, at the pixels of the mask: 11 x
// 11 Gaussian window of sigma 1.5, C1 = 0.01^2, C2 = 0.03^2  [Wang 2004, Eq. 13]. Windows include pixels
// outside the mask; at the border of the image they are clipped and renormalised.
PooledMean structuralSimilarity(const image::Image& a, const image::Image& b, const image::Mask& mask);

struct Difference {
  PooledMean squaredErrorLinear, squaredErrorSrgb, similaritySrgb, absoluteErrorSrgb;
  PooledMean absoluteErrorAlpha;

  double psnrLinear() const { return psnr(squaredErrorLinear.mean()); }
  double psnrSrgb() const { return psnr(squaredErrorSrgb.mean()); }
  double ssim() const { return similaritySrgb.mean(); }
  Difference& operator+=(const Difference& other);
};

// Applies the whole protocol to one image. Both images are linear RGBA of the same size, premultiplied; alpha
// is not scaled by the exposure.
Difference compare(const image::Image& truth, const image::Image& rendered, double exposure);

} // namespace surflect::evaluation
