// Stages of a frame that the next one takes over where they would come out the same: a lamp that is dragged
// leaves warp and raster as they are, a camera leaves the shadows.
//
//   stage                     made of                                  taken over while
//   raster                    warped surfels, camera, splat options    none of them changes
//   shadow states             warped surfels, occluders, light         none of them changes, for each light
//   plans (plan.h)            raster, shade options                    only lights change, which are weighted
//   apart answers of lights         raster, shade options, shadow states     for each light that stays as it
//   is, where
//                                                                      pairs are weighted
//
// Warped surfels are compared bit by bit. A frame that is given up leaves nothing to take over.
#pragma once

#include "render/scene/scene.h"
#include "render/splat/splat.h"
#include "render/surfels/cast_shadows.h"
#include "render/surfels/patch_corners.h"
#include "srf/shading/shade.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::surfels {

enum class Tangents;

// What the raster of a workspace's warped surfels was made of.
struct RasterKey {
  capture::Camera<ObjectSpace> camera;
  splat::SplatOptions splats;
  bool isCut = false; // of the workspace's cut, not of the whole cloud

  friend bool operator==(const RasterKey& a, const RasterKey& b);
};

// What queries and weights are made of, beside the raster and the values of lights.
struct QueryKey {
  weights::ShadeOptions shade;
  Tangents tangents;
  size_t perQuery; // surfels
  bool blendsCorners, castsShadows;
  size_t lights, environments;

  friend bool operator==(const QueryKey&, const QueryKey&) = default;
};

// Whether two lights other than environments are the same.
bool isSameLight(const scene::ShotLight& a, const scene::ShotLight& b);

// Radiance of visible surfels, by lights that have targets of their own (plan.h).
class KeptAnswers {
public:
  // What must be asked for a frame: some lights at all corners, the others at some groups of corners. All
  // lights, unless the kept answers have this key. At least one light, as its answers hold the confidence.
  struct Missing {
    std::vector<uint32_t> lights, others;
    std::vector<uint32_t> groups;
  };
  // corners: none if every surfel asks for itself.
  Missing missing(const QueryKey& key, std::span<const scene::ShotLight> lights,
                  const PatchCorners& corners) const;

  // Makes room for answers that replace some or all of those kept. Nothing is kept before finish().
  void begin(size_t lights, size_t places, size_t targetsPerLight);
  // Takes the answers of some lights at some places.
  void take(const shading::Shaded& shaded, std::span<const uint32_t> lights,
            std::span<const uint32_t> places);
  void finish(const QueryKey& key, std::span<const scene::ShotLight> lights, PatchCorners corners);
  void clear() { *this = {}; }

  std::vector<Rgb> radiance() const; // of each place
  size_t unmatchedShadows() const;   // as in ShadingPlan

private:
  std::optional<QueryKey> key_; // none: nothing is kept
  std::vector<scene::ShotLight> lights_;
  PatchCorners corners_;
  size_t lightCount_ = 0, perPlace_ = 0; // perPlace: targets
  std::vector<Rgb> targets_; // of each place: one for each light, then with tables a second one for each
  std::vector<uint8_t> isUnmatched_; // of each place, one for each light
};

// Owned by a workspace.
struct KeptStages {
  std::optional<RasterKey> raster; // none: unfinished
  std::optional<WarpedOccluders> occluders;
  KeptShadows shadows;
  std::vector<scene::ShotLight> lights; // of the last frame
  std::optional<QueryKey> plansKey;
  shading::KeptPlans plans;
  shading::KeptLookUps lookUps;
  KeptAnswers answers;

  // Forgets what was made of the raster.
  void clearAnswers() {
    plans = {};
    answers.clear();
  }
};

} // namespace surflect::surfels
