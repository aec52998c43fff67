// Fits the levels of a block's eigenimages to the coefficients stored with them.
//
// Rounding to the nearest level makes the same error in all texels of a uniform surface: a channel of 3.2
// levels everywhere is decoded as 3, and the surface changes hue under every light. Therefore, at the texels
// where it costs least, levels are rounded the other way until the mean of the channel is right.
#pragma once

#include "srf/codec/block_record.h"
#include "srf/codec/weighted_block.h"
#include "surfel/math/padded_rows.h"
#include "surfel/math/truncated_svd.h"

#include <array>

namespace surflect::codec {

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

} // namespace surflect::codec
