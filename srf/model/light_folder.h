// All lights of a query, each spread over its nearest captured lights, folded into one row of weights.
#pragma once

#include "srf/model/light_row.h"
#include "srf/model/rig_lights.h"
#include "srf/model/shading_plan.h"
#include "srf/ulr/choice_lanes.h"
#include "srf/ulr/light_extrapolation.h"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace surflect {

// Folds for one query after the other; holds what it would otherwise allocate anew.
class LightFolder {
public:
  // All must outlive the folder. The model is a full product of cameras and lights.
  LightFolder(const Model& model, const LightCoverage& coverage, const QueryBatch& batch,
              const ShadeOptions& options);

  // Chooses for the queries from `begin` on, 1..kChoiceLanes. Appends their rows where all can be made
  // together.
  void choose(size_t begin, size_t count, LightRows& rows);

  // Of the lights of `rows`.
  struct Row {
    size_t begin, end;
  };
  // Of the lane-th query that was chosen for; appended where it was not.
  Row fold(size_t lane, LightRows& rows);

  // The blended lights of that row in their colours, where these are shown.
  Rgb blendColor() const { return color_; }

private:
  void foldOne(size_t lane, LightRows& rows);
  void foldTogether(LightRows& rows);
  bool isPlain(LightExtrapolation extrapolation) const {
    return how_.fit == LightFit::mean && !how_.foreshortened &&
           (extrapolation == LightExtrapolation::clamp || nearest_);
  }
  template <class Use> void foldLights(size_t lane, const Use& use);
  template <class ForEach>
  void addBlend(const Rgb& now, const ForEach& forEachOfBlend, LightRows& rows) const;
  void show(uint32_t light, float share) {
    if (showsColors_) color_ = color_ + share * lightColor_[light];
  }
  BlendSet finish(const LaneBlends& blends, size_t lane, const Direction3<AcquisitionSpace>& towards,
                  LightExtrapolation extrapolation);
  void faceLights(uint32_t surfel);
  float foreshorteningOf(const BlendSet& blend, const Direction3<AcquisitionSpace>& towards) const;
  void foldEnvironment(size_t query, size_t e);
  void shareEnvironment(size_t e,
                        const Rotation<AcquisitionSpace, EnvironmentSpace, float>& acquisitionFromEnvironment);

  const Model& model_;
  const LightCoverage& coverage_;
  const QueryBatch& batch_;
  bool nearest_;
  LightBlend how_;
  RigLights lights_;      // of the current query
  LightLanes rig_, near_; // the lanes of the first are queries, those of the other directions of one query
  size_t begin_ = 0, count_ = 0;                // queries that were chosen for
  bool mayBeTogether_;                          // rows, where all have all their weights
  bool areTogether_ = false;                    // they were made together
  std::array<size_t, kChoiceLanes + 1> ends_{}; // of these; one begins where the one before ends
  std::vector<LaneBlends> chosen_;              // one per light of a query
  LaneBlends blends_;
  LightRow row_;
  bool isShort_; // rows have so few weights that hardly any captured light has two
  bool showsColors_;
  std::vector<Rgb> lightColor_;
  Rgb color_;
  std::vector<EnvironmentLanes> environments_;
  std::vector<float> environmentBrightness_;
  std::vector<Eigen::Array4f> share_; // per light: what it takes over of an environment, see LightTable
  std::vector<float> cosine_;         // per light, to normal_; where light is foreshortened
  Normal3<AcquisitionSpace> normal_;
};

} // namespace surflect
