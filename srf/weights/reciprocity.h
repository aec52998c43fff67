// Reciprocity: reflectance stays the same when the directions to light and viewer are exchanged [Helmholtz
// 1867]. Under kriging, the photograph of camera a under light b thus also answers for a light in the
// direction of a and a viewer in the direction of b.
//
// The pixel of an exchanged pair holds the cosine of b, which foreshortening (irradiance_ratio.h) replaces by
// that of the requested light; without foreshortening there is no reciprocity. An exchanged pair
// answers for a lit surfel only: confidence in the pair falls as the cosine of b does, and the more the
// surfel is in shadow under b or under the requested light.
//
// [Helmholtz 1867] Helmholtz: Handbuch der physiologischen Optik.
#pragma once

#include "srf/weights/irradiance_ratio.h"
#include "srf/weights/nearest_pairs.h"
#include "srf/weights/nearest_sources.h"
#include "srf/weights/query.h"
#include "srf/weights/reflectance_field.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace surflect::weights {

// The rig as a surfel sees it: directions to cameras and lights, which cameras see the surfel, and which
// lights reach it.
class RigAtSurfel {
public:
  // The field must outlive this.
  explicit RigAtSurfel(const ReflectanceField& field)
      : field_(field), viewpoints_(viewpointsOf(field.rig.views)), lights_(field.rig.lights) {}

  // Turns to another surfel; call before the methods below.
  void moveTo(uint32_t surfel) {
    surfel_ = surfel;
    lights_.moveTo(field_.cloud.p0[surfel].cast<double>());
    lights_.evaluateAll();
    normal_ = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(field_.cloud.r0[surfel]).col(2));
  }

  const CapturedLights& lights() const { return lights_; }
  Direction3<AcquisitionSpace> towardsView(size_t view) const {
    return viewpoints_[view].towards(lights_.place()).cast<float>();
  }
  // Visibility weight of a view, 0..1.
  float seenBy(size_t view) const { return VisibilityWeights::decode(field_.visibility.of(surfel_)[view]); }
  // Shadow state under a captured light, 0..1, for a field with lightVisibility.
  float reachedBy(size_t light) const {
    return VisibilityWeights::decode(field_.lightVisibility->of(surfel_)[light]);
  }
  // Foreshortened cosine of a direction.
  float cosine(const Direction3<AcquisitionSpace>& towards) const {
    return foreshortenedCosine(normal_, towards);
  }

private:
  const ReflectanceField& field_;
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  CapturedLights lights_;
  uint32_t surfel_ = 0;
  Normal3<AcquisitionSpace> normal_;
};

// Nugget of an exchanged pair in addition to nuggetOf (kriging.h).
inline constexpr float kReciprocalNugget = 0.02f;

// True if photographs also answer for camera and light exchanged.
bool isReciprocal(const ReflectanceField& field, const ShadeOptions& options);

// Confidence in a captured light as the viewer of an exchanged pair, from its cosine at the surfel, its
// shadow state there, and that of the requested light; empty: states are not used.
float exchangedConfidence(float cosine, float reached, std::optional<float> requested);
float exchangedConfidence(const RigAtSurfel& rig, uint32_t light, std::optional<float> requested);

// Exchanged pairs for one query after another. Has working memory of its own: use one object per thread.
class ExchangedPairs {
public:
  // Field and batch must outlive this.
  ExchangedPairs(const ReflectanceField& field, const QueryBatch& batch);

  // Finds the lights of the rig nearest to the viewers, and the views nearest to the lights, of the queries
  // from `begin` on (1..kQueryLanes). `lights` is set to their places.
  void prepare(size_t begin, size_t count, NearestLights& lights);

  // The near pairs for the l-th light of the lane-th prepared query: the nearest lights of the rig as viewers
  // and the nearest views as lights. None if single precision lost a direction.
  NearPairs near(size_t lane, size_t l, std::optional<float> requested, const RigAtSurfel& rig) const;

private:
  const ReflectanceField& field_;
  const QueryBatch& batch_;
  QueryBlends lightsNearViewer_;
  std::vector<NearestViews> nearestViews_; // one per light of a query
  std::vector<const QueryBlends*> viewsNearLight_;
};

} // namespace surflect::weights
