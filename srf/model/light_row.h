// A weight for each captured light, summed up for one query.
#pragma once

#include "srf/model/plan_part.h"

#include <Eigen/Core>

#include <bit>
#include <cstdint>
#include <vector>

namespace surflect {

class LightRow {
public:
  explicit LightRow(size_t lights) : weights_(lights, Eigen::Array4f::Zero()), inRow_(lights / 64 + 1) {
    for (const Rgb& color : indexColors(lights)) color_.emplace_back(color.r, color.g, color.b, 0);
  }

  // A weight as (its share of the lights' colours, red, green, blue).
  void add(uint32_t light, const Eigen::Array4f& weight) {
    inRow_[light / 64] |= uint64_t{1} << light % 64;
    weights_[light] += weight;
  }

  // Appends those that are not 0, in order, and begins anew. Returns the lights in their colours.
  Rgb take(std::vector<LightWeight>& rows) {
    Eigen::Array4f colors = Eigen::Array4f::Zero();
    for (uint32_t word = 0; word < inRow_.size(); ++word) {
      uint64_t bits = inRow_[word];
      inRow_[word] = 0;
      size_t count = rows.size();
      rows.resize(count + static_cast<size_t>(std::popcount(bits)));
      for (; bits != 0; bits &= bits - 1) {
        const auto light = 64 * word + static_cast<uint32_t>(std::countr_zero(bits));
        Eigen::Array4f& weight = weights_[light];
        colors += weight[0] * color_[light];
        const float r = weight[1], g = weight[2], b = weight[3];
        weight.setZero();
        if (r == 0 && g == 0 && b == 0) continue;
        rows[count++] = {light, {r, g, b}};
      }
      rows.resize(count);
    }
    return {colors[0], colors[1], colors[2]};
  }

private:
  std::vector<Eigen::Array4f> weights_;
  std::vector<uint64_t> inRow_; // a bit for each light that was added
  std::vector<Eigen::Array4f> color_;
};

} // namespace surflect
