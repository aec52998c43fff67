// Fits the levels of a block's eigenimages to the coefficients stored with them.
//
// Rounding to the nearest level errs alike in all texels of a plain surface: a channel of 3.2 levels
// everywhere comes back as 3, and the surface changes hue under every light. Therefore some levels are
// rounded the other way, until the mean of the channel is right, at the texels where that costs least.
#pragma once

#include "srf/codec/block_factors.h"
#include "srf/codec/block_record.h"
#include "srf/codec/padded_rows.h"

#include <array>

namespace surflect::codec {

// Sum of each colour channel over texels and lights, and the error that channelMeanBound allows it.
struct ChannelSums {
  std::array<double, 3> sums{}, bounds{};
};
// Sums and bounds of the channels of x, [texels x channels][lights].
ChannelSums channelSums(const PaddedRows<float>& x, double white);

// Moves levels to lower |V (X - X') W|, then until the sum of each channel keeps its bound. Returns true if
// all sums keep it.
template <class Real>
bool fitLevels(const WeightedBlock<Real>& block, const ChannelSums& channels, StoredTerms& stored);

} // namespace surflect::codec
