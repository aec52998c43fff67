// A weight for each captured light, summed up for one query.
#pragma once

#include "srf/codec/light_rows.h"

#include <Eigen/Core>

#include <bit>
#include <cstdint>
#include <vector>

namespace surflect::model {

class LightRow {
public:
  explicit LightRow(size_t lights) : weights_(lights, Eigen::Array4f::Zero()), inRow_(lights / 64 + 1) {}

  // The first of four is not used.
  void add(uint32_t light, const Eigen::Array4f& weight) {
    inRow_[light / 64] |= uint64_t{1} << light % 64;
    weights_[light] += weight;
  }

  // Appends what was added and is not 0, in order, and begins anew.
  void take(codec::LightRows& rows) {
    for (uint32_t word = 0; word < inRow_.size(); ++word) {
      for (uint64_t bits = inRow_[word]; bits != 0; bits &= bits - 1) {
        const auto light = 64 * word + static_cast<uint32_t>(std::countr_zero(bits));
        Eigen::Array4f& weight = weights_[light];
        const Rgb rgb{weight[1], weight[2], weight[3]};
        if (rgb != Rgb{}) rows.add(light, rgb);
        weight.setZero();
      }
      inRow_[word] = 0;
    }
  }

private:
  std::vector<Eigen::Array4f> weights_;
  std::vector<uint64_t> inRow_; // a bit for each light that was added
};

} // namespace surflect::model
