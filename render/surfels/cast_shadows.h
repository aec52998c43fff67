// Shadows that the deformed cloud casts on itself, by one ray for each query and light.
#pragma once

#include "render/scene/scene.h"
#include "srf/weights/query.h"
#include "srf/weights/reflectance_field.h"
#include "surfel/level_of_detail.h"
#include "surfel/occluders.h"

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace surflect::surfels {

// True if frames use shadow states (srf/weights/shadow_state.h), and so need shadow rays: under kriging, by
// the given choice or else the model's. False if the model stores no shadow states.
bool castsShadows(const weights::ReflectanceField& field, const weights::ShadeOptions& options,
                  std::optional<bool> choice = {});

// The occluders of a cloud after a warp.
class WarpedOccluders {
public:
  // The occluders are surfels of the cloud; both must outlive this.
  WarpedOccluders(const Occluders& occluders, const SurfelCloud& cloud)
      : occluders_(&occluders), rest_(subsetOf(cloud, occluders.surfels)) {}

  // Warps the occluders. Returns false if every bit of them is as it was. Throws Cancelled, and then has no
  // caster.
  bool follow(const warp::Warp& warp, const Progress& progress = {});

  double clearance() const { return occluders_->clearance; }
  const std::shared_ptr<const SplatCaster<ObjectSpace>>& caster() const { return caster_; }

private:
  const Occluders* occluders_;
  SurfelCloud rest_;
  DeformedCloud deformed_;
  std::shared_ptr<const SplatCaster<ObjectSpace>> caster_; // null: no warp was followed to its end
};

// A light as shadows see it.
struct ShadowLight {
  bool isDistant;
  Vec3<double> place; // position, or unit direction towards a distant light

  friend bool operator==(const ShadowLight& a, const ShadowLight& b) {
    return a.isDistant == b.isDistant && a.place == b.place;
  }
};

// Shadow states of surfels under occluders that stay as they are, each for the warped surfel that they were
// found at. Memory: 40 bytes for each surfel, and 4 for each surfel and light.
class KeptShadows {
public:
  // Keeps states under these lights, and no others; none if they take more than 256 MiB. Lights that were
  // kept before keep their states.
  void arrange(std::span<const ShadowLight> lights, size_t surfels);
  // Forgets all states, but not their memory.
  void forget() { isForgotten_ = true; }
  void clear() { *this = {}; }

  bool isEmpty() const { return isForgotten_ || lights_.empty(); }
  // Forgets the states of a surfel of the field unless they were found where it is now. `drawn` is its number
  // in the deformed cloud. Call before stateAt; both are safe from many threads at once for different
  // surfels.
  void pose(uint32_t surfel, const DeformedCloud& deformed, uint32_t drawn);
  // State of a surfel under one of the lights, NaN if it is not known.
  float& stateAt(uint32_t surfel, size_t light) { return states_[light][surfel]; }

private:
  struct Pose {
    Point3<ObjectSpace> p;
    Direction3<ObjectSpace> u, v;
    Handedness handedness = Handedness::dead;
  };
  std::vector<ShadowLight> lights_;
  std::vector<Pose> poses_;                // one for each surfel
  std::vector<std::vector<float>> states_; // of each light: one for each surfel
  bool isForgotten_ = false;
};

class CastShadows {
public:
  // Warps the occluders, which are surfels of the cloud. Throws Cancelled.
  CastShadows(const Occluders& occluders, const SurfelCloud& cloud, const scene::Scene& scene,
              const Progress& progress = {});
  // Shadows of occluders that have followed the scene's warp.
  CastShadows(const WarpedOccluders& occluders, const scene::Scene& scene);

  // Takes states from `kept`, of the same occluders, and brings new ones there. It must outlive this.
  // surfels: of the field; numbers: of the drawn surfels in the field, or none if all are drawn.
  void keepIn(KeptShadows& kept, size_t surfels, std::span<const uint32_t> numbers);

  // Fills batch.reached for queries at these surfels of a deformed cloud: terminatorFade, times the part of
  // the light that occluders leave.
  // Environments have no entries. No surfel is queried twice.
  void fill(const DeformedCloud& deformed, std::span<const uint32_t> surfels,
            weights::QueryBatch& batch) const;

private:
  std::vector<ShadowLight> lights_;
  double clearance_;
  std::shared_ptr<const SplatCaster<ObjectSpace>> caster_;
  KeptShadows* kept_ = nullptr; // null: every state is found by its ray
  std::span<const uint32_t> numbers_;
};

} // namespace surflect::surfels
