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

namespace surflect::model {

// Folds for one query after the other; holds what it would otherwise allocate anew.
class LightFolder {
public:
  // All must outlive the folder. The model is a full product of cameras and lights.
  LightFolder(const Model& model, const ulr::LightCoverage& coverage, const QueryBatch& batch,
              const ShadeOptions& options);

  // Chooses for the queries from `begin` on, 1..kChoiceLanes. Appends their rows where all can be made
  // together.
  void choose(size_t begin, size_t count, codec::LightRows& rows);

  // Of the lights of `rows`.
  struct Row {
    size_t begin, end;
  };
  // Of the lane-th query that was chosen for; appended where it was not.
  Row fold(size_t lane, codec::LightRows& rows);

  // The blended lights of that row in their colours, where these are shown.
  Rgb blendColor() const { return color_; }

private:
  void foldOne(size_t lane, codec::LightRows& rows);
  void foldTogether(codec::LightRows& rows);
  bool isPlain(ulr::LightExtrapolation extrapolation) const {
    return how_.fit == ulr::LightFit::mean && !how_.foreshortened &&
           (extrapolation == ulr::LightExtrapolation::clamp || nearest_);
  }
  template <class Use> void foldLights(size_t lane, const Use& use);
  template <class ForEach>
  void addBlend(const Rgb& now, const ForEach& forEachOfBlend, codec::LightRows& rows) const;
  void show(uint32_t light, float share) {
    if (showsColors_) color_ = color_ + share * lightColor_[light];
  }
  ulr::BlendSet finish(const ulr::LaneBlends& blends, size_t lane,
                       const Direction3<AcquisitionSpace>& towards, ulr::LightExtrapolation extrapolation);
  void faceLights(uint32_t surfel);
  float foreshorteningOf(const ulr::BlendSet& blend, const Direction3<AcquisitionSpace>& towards) const;
  void foldEnvironment(size_t query, size_t e);
  void
  shareEnvironment(size_t e,
                   const Rotation<AcquisitionSpace, EnvironmentSpace, float>& acquisitionFromEnvironment);

  const Model& model_;
  const ulr::LightCoverage& coverage_;
  const QueryBatch& batch_;
  bool nearest_;
  ulr::LightBlend how_;
  RigLights lights_; // of the current query
  ulr::LightLanes rig_,
      near_; // the lanes of the first are queries, those of the other directions of one query
  size_t begin_ = 0, count_ = 0;                     // queries that were chosen for
  bool mayBeTogether_;                               // rows, where all have all their weights
  bool areTogether_ = false;                         // they were made together
  std::array<size_t, ulr::kChoiceLanes + 1> ends_{}; // of these; one begins where the one before ends
  std::vector<ulr::LaneBlends> chosen_;              // one per light of a query
  ulr::LaneBlends blends_;
  LightRow row_;
  bool isShort_; // rows have so few weights that hardly any captured light has two
  bool showsColors_;
  std::vector<Rgb> lightColor_;
  Rgb color_;
  std::vector<ulr::EnvironmentLanes> environments_;
  std::vector<float> environmentBrightness_;
  std::vector<Eigen::Array4f> share_; // per light: what it takes over of an environment, see LightTable
  std::vector<float> cosine_;         // per light, to normal_; where light is foreshortened
  Normal3<AcquisitionSpace> normal_;
};

} // namespace surflect::model
