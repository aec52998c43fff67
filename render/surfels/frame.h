// One frame: a deformed cloud, splatted for a camera and shaded.
//
//   deform -> look -> queriesAt -> shade -> develop
#pragma once

#include "render/scene/shot.h"
#include "render/splat/splat_raster.h"
#include "srf/model/model.h"
#include "srf/shading/shade.h"
#include "surfel/lookup.h"
#include "warp/warp.h"

#include <map>
#include <string>
#include <vector>

namespace surflect::surfels {

// The splats of a cloud that a camera sees.
splat::SplatRaster look(const capture::Camera<ObjectSpace>& camera, const SurfelCloud& rest,
                        const DeformedCloud& deformed, const splat::SplatOptions& options = {},
                        const Progress& progress = {});

// L of one surfel [Weyrich 2005, Eq. 10], in double precision. The surfel must not be dead.
LookUp<double> lookUpAt(const SurfelCloud& rest, const DeformedCloud& deformed, size_t surfel);

// Directions to viewer and lights, and the lights' irradiance at the deformed surfels, brought back to
// acquisition space by L; environments are turned by it. One query per entry of `surfels`, none of which may
// be dead. In double precision; the same bits for any number of threads, and for AVX2 and AVX-512.
shading::QueryBatch queriesAt(const SurfelCloud& rest, const DeformedCloud& deformed,
                              std::span<const uint32_t> surfels, const capture::Camera<ObjectSpace>& camera,
                              std::span<const scene::ShotLight> lights, const Progress& progress = {});

// RGBA, premultiplied, from radiance per entry of coverage.visible, and its confidence if it has one.
image::Image developRadiance(const splat::SplatRaster& coverage, const shading::Shaded& shaded);

struct FrameLayers {
  image::Image color; // RGBA, premultiplied
  // By name (script.h: aovNames); premultiplied but for depth, which is infinite off the object.
  std::map<std::string, image::Image> aovs;
};

struct FrameStats {
  splat::SplatCounts splats;
  size_t visible = 0, unseen = 0;
  shading::ShadingStats shading;
  // Stages: "warp", "splat", "queries", "ulr" (of cameras and lights), "look-up", "develop", and "aov" where
  // there are any.
  std::map<std::string, double> seconds;          // per stage
  std::map<std::string, double> processorSeconds; // per stage, of all threads of the process
};

struct FrameOptions {
  shading::ShadeOptions shade;
  splat::SplatOptions splats;
  std::vector<std::string> aovs;
};

// The content of one frame.
struct FrameScene {
  const warp::Warp& warp;
  const capture::Camera<ObjectSpace>& camera;
  std::span<const scene::ShotLight> lights;
};

// Blocks and memory that one frame leaves to the next. Owned by the caller; one frame uses it at a time.
struct FrameWorkspace {
  // Keeps up to cacheBytes of decoded blocks. The field must outlive the workspace.
  FrameWorkspace(const shading::ReflectanceField& field, size_t cacheBytes)
      : cache(field.files, cacheBytes) {}

  codec::BlockCache cache;
  DeformedCloud deformed;
  splat::SplatRaster coverage;
  FrameLayers layers; // memory for the next frame: a caller that is done with a frame may put it here
  FrameStats stats;   // of the last frame
};

// Throws Error as shade does, and Cancelled.
FrameLayers renderFrame(const shading::ReflectanceField& field, const FrameScene& scene,
                        const FrameOptions& options, FrameWorkspace& workspace,
                        const Progress& progress = {});

// The ratio of the principal axes of a warped splat, 1 for a circle [Weyrich 2005, Fig. 15].
double stretchOf(const Vec3<double>& u, const Vec3<double>& v);

} // namespace surflect::surfels
