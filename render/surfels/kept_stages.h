// Stages of a frame that the next one takes over where they would come out the same: a lamp that is dragged
// leaves warp and raster as they are, a camera leaves the shadows.
//
//   stage             made of                         taken over while these stay, and
//   raster            warped surfels, camera, splats
//   shadow states     warped surfels, occluders       a light stays: those of the light
//   plans             raster, shade options           cameras and lights are weighted apart
//   look-ups          warped surfels, lights          likewise: those of blended views
//   answers of lights raster, shade options, shadows  pairs are weighted, and a light stays: those of the
//   light
//
// Warped surfels and directions to lights are compared bit by bit, all else by value. A frame that is given
// up leaves no answers and no unfinished plans; what it finished before stays. The parts take at most 1 GiB:
// KeptShadows 256 MiB, KeptLookUps 256 MiB and plans 224 MiB; or, with answers, KeptShadows and 12 bytes for
// each of 2^24 answers, as many for those of the current frame, and corners.
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

// Inputs of a raster, other than the warped surfels of its workspace.
struct RasterKey {
  capture::Camera<ObjectSpace> camera;
  splat::SplatOptions splats;
  bool isCut = false; // of the workspace's cut, not of the whole cloud

  friend bool operator==(const RasterKey& left, const RasterKey& right);
};

// Inputs of queries and weights, other than the raster and the values of lights.
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
  // Queries that a frame has to ask: some lights at all corners, the others at some groups of corners. All
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
  bool isEmpty() const { return !key_; }

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

  void forgetShadows() {
    occluders.reset();
    shadows.clear();
  }
  // Forgets what was made of the raster.
  void clearAnswers() {
    plans = {};
    answers.clear();
  }
};

} // namespace surflect::surfels
