// Weights of the captured lights that are blended for the lights of a query.
//
//   w_l = sum over lights q of the query  f_q c_q u_ql E_q / E_l
//
// Symbols: E_q irradiance of light q on the deformed surface facing it, E_l irradiance of captured light l at
// p0, u_ql ULR weight of l for q [Weyrich 2005, §5.2] or that of a plane fitted to the lights
// (light_blend.h), c_q fade where no light was captured (light_extrapolation.h), f_q foreshortening
// (foreshortening.h). The ratio E_q / E_l is taken channel by channel and is 0 where E_l is 0. The ratio
// includes no cosine for light l, since the photograph already contains it.
#pragma once

#include "srf/shading/operations.h"
#include "srf/shading/query.h"
#include "srf/shading/reflectance_field.h"
#include "srf/ulr/light_extrapolation.h"
#include "srf/ulr/nearest_sources.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::shading {

// E_q / E_l, channel by channel; 0 where E_l is 0.
Rgb irradianceRatio(Rgb now, Rgb captured);

inline float brightness(Rgb light) { return light.r + light.g + light.b; }

// Brightness of each environment of the batch, before its strength is applied.
std::vector<float> environmentBrightness(const QueryBatch& batch);

// The light blend that the options ask for, or else the model's.
ulr::LightBlend lightBlend(const ReflectanceField& field, const ShadeOptions& options);

// The interpolation that the options ask for, or else the model's.
Interpolation interpolationOf(const ReflectanceField& field, const ShadeOptions& options);

// Number of (camera, light) pairs to blend: that of the options, or else six under kriging and four under
// ULR. Six move highlights more smoothly than four; ULR hardly gains by them.
size_t pairCount(const ReflectanceField& field, const ShadeOptions& options);

// True if camera and light of a pair are weighted together, by the distance of the pair from the requested
// one: pairs or kriging.
bool weighsPairs(const ReflectanceField& field, const ShadeOptions& options);

// True if cameras and lights are weighted separately for all lights but environments. For environments, they
// always are if every camera has every light.
bool hasSeparateWeights(const ReflectanceField& field, const ShadeOptions& options);

// Unit direction to each light of the rig, from the middle of the cloud.
std::vector<Direction3<AcquisitionSpace, double>> lightDirections(const ReflectanceField& field);

// Spacing of the rig's lights, in radians; see LightExtrapolationFade.
double lightSpacing(const ReflectanceField& field);

// Tabulated weights of captured lights for environments. Empty if the weights depend on the surfel: lights
// near the object, or a capture that is not a full product.
std::optional<ulr::LightTable> lightTable(const ReflectanceField& field, const ShadeOptions& options,
                                          ulr::LightExtrapolation extrapolation);

// Common colour of several lights: the strongest channel divided by each channel. Empty if the channels of
// two lights differ in proportion by more than rounding.
struct SharedColor {
  std::optional<Rgb> inverse;
  Eigen::Index strongest = 0; // channel
};
SharedColor sharedColor(std::span<const capture::Light> lights);

// Directions and irradiances of the captured lights at one place, evaluated on demand; values that are the
// same at every place are evaluated once.
class CapturedLights {
public:
  explicit CapturedLights(std::span<const capture::Light> lights); // lights must outlive this

  size_t size() const { return lights_.size(); }
  // Returns true if all lights have the same direction and irradiance at every place; all are then evaluated
  // from the start.
  bool areUniform() const { return areUniform_; }

  void moveTo(const Point3<AcquisitionSpace, double>& place) {
    place_ = place;
    ++current_;
  }
  void evaluate(uint32_t light) {
    if (!areUniform_ && evaluatedAt_[light] != current_) compute(light);
  }
  void evaluateAll() {
    for (uint32_t light = 0; light < lights_.size(); ++light) evaluate(light);
  }

  const Point3<AcquisitionSpace, double>& place() const { return place_; }
  Rgb irradiance(size_t light) const { return capture::irradianceAt(lights_[light], place_); }

  // The methods below require evaluated lights.
  const Direction3<AcquisitionSpace>& towards(size_t light) const { return towards_[light]; }
  std::span<const Direction3<AcquisitionSpace>> towards() const { return towards_; }
  // Replaces the last three numbers of `now` by their irradianceRatio to the captured light, up to one
  // rounding; the first number is kept. A captured irradiance below the normal floats counts as 0.
  Eigen::Array4f ratio(const Eigen::Array4f& now, size_t light) const { return now * inverse_[light]; }

  // If all lights have one colour, the ratio is now * inverseColor * inverseStrength, up to two more
  // roundings and the 2^-22 by which proportions may differ.
  const std::optional<Rgb>& inverseColor() const { return color_.inverse; }
  float inverseStrength(size_t light) const { return inverse_[light][1 + color_.strongest]; }

private:
  void compute(uint32_t light);

  std::span<const capture::Light> lights_;
  SharedColor color_;
  std::vector<Direction3<AcquisitionSpace>> towards_;
  std::vector<Eigen::Array4f> inverse_; // 1, then 1 / irradiance of each channel, 0 where that is 0
  std::vector<uint64_t> evaluatedAt_;   // number of the place at which each light was evaluated
  uint64_t current_ = 1;                // number of the current place
  bool areUniform_ = false;
  Point3<AcquisitionSpace, double> place_;
};

// Lights of a query whose weights are computed.
enum class LightSources { all, environments };

// Computes the light rows of one query after another. Has working memory of its own: use one object per
// thread. Short rows hold one BlendedLight for each light of the query; the weights of long rows are summed
// per captured light first.
class LightWeights {
public:
  // The arguments must outlive the weights. The field must be a full product of cameras and lights.
  LightWeights(const ReflectanceField& field, const ulr::LightExtrapolationFade& coverage,
               const QueryBatch& batch, const ShadeOptions& options, LightSources sources);

  // Computes ULR weights of the queries from `begin` on (1..kQueryLanes), in vector lanes. Appends the rows
  // at once if no query of the group needs anything beyond these weights.
  void prepare(size_t begin, size_t count, LightRows& rows);

  // A range of LightRows::lights.
  struct Row {
    size_t begin, end;
  };
  // Returns the row of the lane-th prepared query; appends it unless prepare has done so.
  Row append(size_t lane, LightRows& rows);

  // Mean blend colour of the lights in the last appended row, if the options show blends.
  Rgb blendColor() const { return color_; }

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

  void appendGroup(LightRows& rows);
  template <class Use> void forEachLight(size_t lane, const Use& use);
  template <class ForEach>
  void appendLight(const Rgb& now, const ForEach& forEachWeight, LightRows& rows) const;
  ulr::BlendSet blendOf(const ulr::QueryBlends& ulr, size_t lane, const Direction3<AcquisitionSpace>& towards,
                        ulr::LightExtrapolation extrapolation);
  bool isPlainUlr(ulr::LightExtrapolation extrapolation) const { // true if c_q = f_q = 1, without a plane fit
    return lightBlend_.fit == ulr::LightFit::mean && !lightBlend_.foreshortened &&
           (extrapolation == ulr::LightExtrapolation::clamp || nearest_);
  }
  void setNormal(uint32_t surfel);
  float foreshorteningOf(const ulr::BlendSet& blend, const Direction3<AcquisitionSpace>& towards) const;
  void addEnvironment(size_t query, size_t e);
  void shareEnvironment(size_t e, const Rotation<AcquisitionSpace, EnvironmentSpace, float>& rotation);
  void addToBlendColor(uint32_t light, float share) {
    if (showsColors_) color_ = color_ + share * lightColor_[light];
  }

  const ReflectanceField& field_;
  const ulr::LightExtrapolationFade& coverage_;
  const QueryBatch& batch_;
  const bool nearest_;
  const size_t lightCount_; // per query: those of the batch, or none
  const ulr::LightBlend lightBlend_;
  const bool hasShortRows_; // true if the row has so few weights that captured lights rarely repeat
  const bool showsColors_;
  CapturedLights lights_; // at the current query
  size_t begin_ = 0, count_ = 0;
  // u_ql; lanes are queries, or lights of an environment at one query.
  ulr::NearestLights ulr_, environmentUlr_;
  std::vector<ulr::QueryBlends> ulrOfLight_; // per light of a query
  ulr::QueryBlends ulrOfEnvironment_;
  bool canBeGrouped_; // rows can be appended by group, if no direction is lost
  bool isGrouped_ = false;
  // Ends of the group's rows; each row begins where the previous one ends.
  std::array<size_t, ulr::kQueryLanes + 1> rowEnds_{};
  Sums sums_;
  std::vector<Rgb> lightColor_;
  Rgb color_;
  std::vector<ulr::EnvironmentDirections> environments_;
  std::vector<float> environmentBrightness_;
  std::vector<Eigen::Array4f> share_; // per captured light: share of an environment, as in LightTable
  Normal3<AcquisitionSpace> normal_;
  std::vector<float> cosine_; // per captured light, with normal_
};

} // namespace surflect::shading
