// Masks of an object by subtracting its background: by a photograph of the empty scene, the plate, or by a
// plate that is fitted to a background of one colour.
//
// Photographs and plates have 3 channels of linear light and one size per view. The border of a picture is
// its outer eighth: the background must show in most of it. Noise is measured there, after a square root that
// makes shot noise equally large everywhere [Anscombe 1948].
#pragma once

#include "srf/image/image.h"
#include "srf/image/mask.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"

#include <array>
#include <optional>
#include <vector>

namespace surflect::calibration {

// Background of one colour.

// Most frequent chromaticity in the border of photographs.
class BorderColor {
public:
  void add(const image::Image& photograph);
  // Mean colour of the border pixels of the most frequent chromaticity; that of the dark pixels if they are
  // more.
  Rgb color() const;
  // Share of the border pixels that this chromaticity holds, 0..1.
  double share() const;

private:
  static constexpr size_t kCells = 20; // per axis, of r and g of the chromaticity
  struct Cell {
    double pixels = 0, r = 0, g = 0, b = 0; // sums
  };
  Cell fullest() const; // sum over 3 x 3 cells

  std::array<Cell, kCells* kCells + 1> cells_ = {}; // the last: dark pixels, without chromaticity
};

// Plate of a background whose chromaticity is that of the key colour: per channel a quadratic function of the
// position, fitted robustly to the pixels of that chromaticity, beginning at the border. A dark key colour
// (luma below 0.02) takes the pixels below a twentieth of the photograph's 99.5th percentile. Empty if less
// than a fifth of the border has the key colour.
std::optional<image::Image> fittedPlate(const image::Image& photograph, Rgb key);

// Spill: the key colour that an object's rim reflects, as a share of the key's chroma. It is the mean of the
// pixels one to three inside of the outline beyond that of the pixels five to nine inside; 0 if the object is
// thinner, or the key is gray. Chroma: the roots of the channels minus their mean.
double spillOf(const image::Image& photograph, const image::Mask& object, Rgb key);

// Subtraction.

// A fitted plate is known less exactly than a photographed one: noise then counts as 1.2 % of the root of the
// 99.5th percentile at least, and pixels that are below a twentieth of that percentile in photograph and
// plate are background.
enum class PlateKind { photographed, fitted };

// Object pixels of a view by the majority of its photographs, each beside its plate. In a photograph a pixel
// is object if it differs from the plate by more than noise, and is no shadow on it: in its neighbourhood the
// plate times 0.2 to 1.1, with the plate's texture, or where it has none, with its saturated hue. Shadows on
// an even background of little colour count as object, and an object of an even screen's hue as shadow.
// Photographs whose pixel and plate are both dark do not vote.
class PlateVote {
public:
  PlateVote(int width, int height);

  // Adds a photograph, whose exposure may differ from the plate's by up to a stop. Returns the share of the
  // border that the plate explains, 0..1; below kExplained, the photograph is not counted. Throws Cancelled.
  double add(const image::Image& photograph, const image::Image& plate, PlateKind kind,
             const Progress& progress = {});
  static constexpr double kExplained = 0.25;

  // The largest group of pixels and every group of at least a tenth of it, without holes of less than a
  // thousandth of it.
  image::Mask outcome() const;

private:
  image::Mask shape_;
  std::vector<uint16_t> object_, votes_; // photographs, per pixel
};

// Share of each pixel that the object covers. Inside of the mask, up to two pixels from its outline, alpha is
// the least-squares solution of
//   I = alpha F + (1 - alpha) B
// over channels and photographs; F is the mean of the object's pixels nearby, B the plate [Smith and Blinn
// 1996, Eq. 1]. Alpha from 0.05 to 0.95 is then stretched to 0..1, so that noise does not make the object's
// pixels translucent or the plate's faint.
class EdgeCoverage {
public:
  explicit EdgeCoverage(image::Mask object);

  // Throws Cancelled.
  void add(const image::Image& photograph, const image::Image& plate, PlateKind kind,
           const Progress& progress = {});
  // One channel, 0..1; near the outline the median of 3 x 3 pixels, as an object's pixel may have the plate's
  // colour. Lines of one pixel are lost.
  image::Image outcome() const;

private:
  struct RingPixel {
    size_t pixel = 0;
    double along = 0, length = 0; // sums of (I - B) . (F - B) and |F - B|^2 over sigma^2
  };

  image::Mask object_, core_, middle_; // core and middle are two pixels and one pixel inside
  std::vector<RingPixel> ring_;        // of object without core
};

} // namespace surflect::calibration
