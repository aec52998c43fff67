// A weight for each captured light that a query needs.
#pragma once

#include "srf/model/planning.h"

#include <Eigen/Core>

#include <bit>
#include <cstdint>
#include <vector>

namespace surflect {

// Collects one row after the other. What is added is written down as it comes, unless it may be more than
// there are lights: then weights of a light are summed up first.
class LightRow {
public:
  LightRow(size_t lights, bool showsColors)
      : showsColors_(showsColors), weights_(lights, Eigen::Array4f::Zero()), inRow_(lights / 64 + 1) {
    for (const Rgb& color : indexColors(lights)) color_.emplace_back(color.r, color.g, color.b, 0);
  }

  // Of `most` weights at most, which go to the end of `rows`.
  void begin(size_t most, std::vector<LightWeight>& rows) {
    rows_ = &rows;
    colors_.setZero();
    sumsUp_ = most > weights_.size();
  }

  // A weight as (its share of the lights' colours, red, green, blue).
  void add(uint32_t light, const Eigen::Array4f& weight) {
    if (!sumsUp_) {
      put(light, weight);
      return;
    }
    inRow_[light / 64] |= uint64_t{1} << light % 64;
    weights_[light] += weight;
  }

  void end() {
    for (uint32_t word = 0; sumsUp_ && word < inRow_.size(); ++word) {
      for (uint64_t bits = inRow_[word]; bits != 0; bits &= bits - 1) {
        const auto light = 64 * word + static_cast<uint32_t>(std::countr_zero(bits));
        put(light, weights_[light]);
        weights_[light].setZero();
      }
      inRow_[word] = 0;
    }
  }

  // The lights of the last row in their colours, where these are shown.
  Rgb color() const { return {colors_[0], colors_[1], colors_[2]}; }

private:
  void put(uint32_t light, const Eigen::Array4f& weight) {
    if (showsColors_) colors_ += weight[0] * color_[light];
    rows_->push_back({light, {weight[1], weight[2], weight[3]}});
  }

  bool showsColors_, sumsUp_ = false;
  std::vector<LightWeight>* rows_ = nullptr;
  Eigen::Array4f colors_ = Eigen::Array4f::Zero();
  std::vector<Eigen::Array4f> weights_; // where they are summed up
  std::vector<uint64_t> inRow_;         // a bit for each light that was added
  std::vector<Eigen::Array4f> color_;
};

} // namespace surflect
