// Rounds the terms of a block to the precisions of a record, and measures the error that remains.
//
// After rounding, the coefficients are solved again for the stored eigenimages, by the normal equations
// G A = B with G = S' S and B = S' (V X W). G and B are kept from one choice of terms to the next, so that a
// choice of K terms costs K^2 multiplications for each light and none for each texel.
#pragma once

#include "srf/codec/block_record.h"
#include "surfel/math/padded_rows.h"
#include "surfel/math/truncated_svd.h"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace surflect::codec {

// A block with weighted errors, as it is factored and rounded.

// V X W, with V and W the weights of rows and lights, scaled so that |V X W|_F^2 is about 1.
template <class Real> struct WeightedBlock {
  PaddedRows<Real> values;        // [texels x channels][lights]
  std::vector<Real> rows, lights; // the diagonals of V and W
  double squaredBound = 0;        // bound on the squared error
};

// Fits the levels of a block's eigenimages to the coefficients stored with them.
// Rounding to the nearest level makes the same error in all texels of a uniform surface: a channel of 3.2
// levels everywhere is decoded as 3, and the surface changes hue under every light. Therefore, at the texels
// where it costs least, levels are rounded the other way until the mean of the channel is right.

// Sum of each colour channel over texels and lights, and the error that channelMeanBound allows it.
struct ChannelSums {
  std::array<double, 3> sums{}, bounds{};
};
// Sums and bounds of the channels of x, [texels x channels][lights].
ChannelSums channelSums(const PaddedRows<float>& x, double white);

// Changes levels, first to lower |V (X - X') W|, then until the sum of each channel keeps its bound. Returns
// true if all sums keep their bounds.
template <class Real>
bool fitLevels(const WeightedBlock<Real>& block, const ChannelSums& channels, StoredTerms& stored);

struct ChosenTerm {
  size_t term = 0;
  int bits = 0;
};

template <class Real> class BlockFit {
public:
  // Keeps references to both, which must outlive it.
  BlockFit(const WeightedBlock<Real>& block, const TruncatedSvd<Real>& factors);

  // Squared error from rounding the image, or the coefficients, of a term, as a fraction of the term's
  // energy.
  double imageError(size_t term, int bits) const { return images_[at(bits)].squaredErrors[term]; }
  double lightError(size_t term, int bits) const { return lights_[at(bits)].squaredErrors[term]; }

  struct Solution {
    StoredTerms stored;      // without the levels of images
    double squaredError = 0; // |V (X - X') W|_F^2
  };
  // Coefficients of `terms`, which are ordered by descending bits, and the error that they leave.
  Solution solved(const std::vector<ChosenTerm>& terms, CoefficientType type);
  void addLevels(const std::vector<ChosenTerm>& terms, StoredTerms& stored) const;

private:
  struct Rounded {
    std::vector<Real> squaredErrors, clips; // [terms]
  };
  static size_t at(int bits) { return bits == 16 ? 0 : bits == 8 ? 1 : 2; }
  using AtPrecisions = std::array<Rounded, precisions.size()>;
  AtPrecisions rounded(const PaddedRows<Real>& values, const std::vector<Real>& weights,
                       size_t clippings) const;
  // Indices of the terms' stored images, which are added if absent.
  std::vector<size_t> placed(const std::vector<ChosenTerm>& terms);
  PaddedRows<Real> levelsOfImage(const ChosenTerm& term) const;
  size_t placeOf(const ChosenTerm& term) const; // places_.size() if absent

  const WeightedBlock<Real>& block_;
  const TruncatedSvd<Real>& factors_;
  AtPrecisions images_, lights_;
  // Stored images, by place: term and bits, levels, weighted S, B = S' (V X W), and G = S' S.
  std::vector<ChosenTerm> places_;
  std::vector<PaddedRows<Real>> levels_;
  PaddedRows<Real> stored_, products_;
  Eigen::MatrixXd gram_;
};

} // namespace surflect::codec
