// Weights of the captured lights that are blended for the lights of a query.
//
//   w_l = sum over lights q of the query  f_q c_q u_ql E_q / E_l
//
// Symbols: u_ql ULR weight of captured light l for q [Weyrich 2005, §5.2] or its weight in a plane fitted to
// the lights (light_blend.h), c_q fade where no light was captured (fades.h), E_q / E_l and f_q irradiance
// ratio and foreshortening (irradiance_ratio.h).
//
// The plain form is blendOfLights (light_blend.h) for each light of a query in turn.
#pragma once

#include "srf/weights/fades.h"
#include "srf/weights/irradiance_ratio.h"
#include "srf/weights/light_table.h"
#include "srf/weights/nearest_sources.h"
#include "srf/weights/query.h"
#include "srf/weights/reflectance_field.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::weights {

// A saturated colour for each index, which distinguishes cameras and lights in pictures of their blends
// [Weyrich 2005, Fig. 16]. Independent of `count`. Hue advances by sqrt(2) turns: steps of the golden section
// would give neighbours on a Fibonacci spiral, a common layout of rigs, the same colour.
std::vector<Rgb> blendColors(size_t count);

// Brightness of each environment of the batch, before its strength is applied.
std::vector<float> environmentBrightness(const QueryBatch& batch);

// Unit direction to each light of the rig, from the middle of the cloud.
std::vector<Direction3<AcquisitionSpace, double>> lightDirections(const ReflectanceField& field);

// Spacing of the rig's lights, in radians; see LightExtrapolationFade.
double lightSpacing(const ReflectanceField& field);

// Tabulated weights of captured lights for environments. Empty if the weights depend on the surfel: lights
// near the object, or a capture that is not a full product.
std::optional<LightTable> lightTable(const ReflectanceField& field, const ShadeOptions& options,
                                     LightExtrapolation extrapolation);

// Lights of a query whose weights are computed.
enum class LightSources { all, environments };

// Computes the light rows of one query after another. Has working memory of its own: use one object per
// thread. Short rows hold one BlendedLight for each light of the query; the weights of long rows are summed
// per captured light first.
class LightWeights {
public:
  // The arguments must outlive the weights. The field must be a full product of cameras and lights.
  LightWeights(const ReflectanceField& field, const LightExtrapolationFade& coverage, const QueryBatch& batch,
               const ShadeOptions& options, LightSources sources);

  // Replaces the batch's irradiance from a query on (#lights a query); it must outlive the next rows.
  void setIrradiance(std::span<const Rgb> irradiance, size_t firstQuery) {
    irradiance_ = irradiance;
    firstQuery_ = firstQuery;
  }

  // Computes ULR weights of the queries from `begin` on (1..kQueryLanes), in vector lanes. Appends the rows
  // at once if no query of the group needs anything beyond these weights.
  void prepare(size_t begin, size_t count, LightRows& rows);

  // A range of LightRows::lights.
  struct Row {
    size_t begin, end;
  };
  // Returns the row of the lane-th prepared query; appends it unless prepare has done so. asksReached:
  // whether tables answer its environments.
  Row append(size_t lane, LightRows& rows, bool asksReached = false);

  // Mean blend colour of the lights in the last appended row, if the options show blends.
  Rgb blendColor() const { return color_; }

  // Shares of an environment in the last appended row, before its strength is applied: irradiance that each
  // captured light represents (r, g, b, unused); if tables answer, the part of each light of the environment
  // that reaches the surfel.
  struct Environment {
    std::span<const Eigen::Array4f> shares;
    std::span<const float> reached;
  };
  Environment environment(size_t e) const { return {shares_[e], reached_[e]}; }

private:
  // w_l of one query, summed per captured light. The first of the four numbers is unused.
  class Sums {
  public:
    explicit Sums(size_t lights) : weights_(lights, Eigen::Array4f::Zero()), isSet_(lights / 64 + 1) {}
    void add(uint32_t light, const Eigen::Array4f& weight) {
      isSet_[light / 64] |= uint64_t{1} << light % 64;
      weights_[light] += weight;
    }
    void moveTo(LightRows& rows); // appends the nonzero sums in order and clears them

  private:
    std::vector<Eigen::Array4f> weights_;
    std::vector<uint64_t> isSet_; // one bit for each light
  };

  const Rgb& irradianceOf(size_t query, size_t light) const {
    return irradiance_.empty() ? batch_.irradiance[query * batch_.lights + light]
                               : irradiance_[(query - firstQuery_) * batch_.lights + light];
  }
  void appendGroup(LightRows& rows);
  void appendLight(const Rgb& now, const BlendSet& blend, LightRows& rows) const;
  BlendSet blendOf(const QueryBlends& ulr, size_t lane, const Direction3<AcquisitionSpace>& towards,
                   LightExtrapolation extrapolation);
  bool isPlainUlr(LightExtrapolation extrapolation) const { // true if c_q = f_q = 1, without a plane fit
    return lightBlend_.fit == LightFit::mean && !lightBlend_.foreshortened &&
           (extrapolation == LightExtrapolation::clamp || nearest_);
  }
  void setNormal(uint32_t surfel);
  void setStates(uint32_t surfel);
  float foreshorteningOf(const BlendSet& blend, const Direction3<AcquisitionSpace>& towards) const;
  void addEnvironment(size_t query, size_t e);
  void shareEnvironment(size_t e, const Rotation<AcquisitionSpace, EnvironmentSpace, float>& rotation);
  void addToBlendColor(uint32_t light, float share) {
    if (showsColors_) color_ = color_ + share * lightColor_[light];
  }

  const ReflectanceField& field_;
  const LightExtrapolationFade& coverage_;
  const QueryBatch& batch_;
  const bool nearest_;
  const size_t lightCount_; // per query: those of the batch, or none
  const LightBlend lightBlend_;
  const bool hasShortRows_; // true if the row has so few weights that captured lights rarely repeat
  const bool showsColors_;
  CapturedLights lights_;           // at the current query
  std::span<const Rgb> irradiance_; // empty: that of the batch
  size_t firstQuery_ = 0;
  size_t begin_ = 0, count_ = 0;
  // u_ql; lanes are queries, or lights of an environment at one query.
  NearestLights ulr_, environmentUlr_;
  std::vector<QueryBlends> ulrOfLight_; // per light of a query
  QueryBlends ulrOfEnvironment_;
  bool canBeGrouped_; // rows can be appended by group, if no direction is lost
  bool isGrouped_ = false;
  // Ends of the group's rows; each row begins where the previous one ends.
  std::array<size_t, kQueryLanes + 1> rowEnds_{};
  Sums sums_;
  std::vector<Rgb> lightColor_;
  Rgb color_;
  std::vector<EnvironmentDirections> environments_;
  std::vector<float> environmentBrightness_;
  // Per environment: share of each captured light, as in LightTable; part of each of its lights that reaches
  // the surfel, if tables answer.
  std::vector<std::vector<Eigen::Array4f>> shares_;
  std::vector<std::vector<float>> reached_;
  const bool asksReached_;
  bool asksNow_ = false; // of the current query
  Normal3<AcquisitionSpace> normal_;
  std::vector<float> cosine_; // per captured light, with normal_
  std::vector<float> state_;  // per captured light; 1 without shadow states
};

} // namespace surflect::weights
