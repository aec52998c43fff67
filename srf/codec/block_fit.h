// The terms of a block rounded to what a record can hold, and how well they then fit.
//
// Coefficients are solved for once more, now that the eigenimages are what will be stored, through the normal
// equations of the stored images: these, and their products with the block, are kept from choice to choice,
// so that a choice of K terms costs K^2 multiplications for each light and none for a texel.
#pragma once

#include "srf/codec/block_factors.h"
#include "srf/codec/block_record.h"

#include <Eigen/Core>

#include <array>

namespace surflect::codec {

struct ChosenTerm {
  size_t term = 0;
  int bits = 0;
};

template <class Real> class BlockFit {
public:
  // All are used as long as this is.
  BlockFit(const WeightedBlock<Real>& block, const BlockFactors<Real>& factors);

  // What rounding the image and the coefficients of a term leaves of it, in parts of its energy.
  double imageError(size_t term, int bits) const { return images_[at(bits)].squaredErrors[term]; }
  double lightError(size_t term, int bits) const { return lights_[at(bits)].squaredErrors[term]; }

  struct Solution {
    StoredTerms stored;      // without levels of images
    double squaredError = 0; // |V (X - X') W|_F^2
  };
  // Bits falling.
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
  // Places of the images at these precisions, made where there were none.
  std::vector<size_t> placed(const std::vector<ChosenTerm>& terms);
  PaddedRows<Real> levelsOfImage(const ChosenTerm& term) const;
  size_t placeOf(const ChosenTerm& term) const; // or how many there are

  const WeightedBlock<Real>& block_;
  const BlockFactors<Real>& factors_;
  AtPrecisions images_, lights_;
  // Of stored images as many as there are places: levels, and weighted S, S' S and S' (V X W).
  std::vector<ChosenTerm> places_;
  std::vector<PaddedRows<Real>> levels_;
  PaddedRows<Real> stored_, products_;
  Eigen::MatrixXd gram_;
};

} // namespace surflect::codec
