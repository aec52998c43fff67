// One frame: a deformed cloud seen by a camera, asked for radiance, and put on film.
//
//   deform -> look -> queriesAt -> shade -> develop
#pragma once

#include "render/scene/shot.h"
#include "render/splat/splat_raster.h"
#include "srf/model/shade.h"
#include "surfel/lookup.h"
#include "warp/warp.h"

#include <map>
#include <string>
#include <vector>

namespace surflect::surfels {

// What a camera sees of a cloud. `kept`, a coverage that is no longer needed, gives its memory.
splat::SplatRaster look(const capture::Camera<ObjectSpace>& camera, const SurfelCloud& rest,
                        const DeformedCloud& deformed, const splat::SplatOptions& options = {},
                        const Progress& progress = {}, splat::SplatRaster kept = {});

// L of one surfel [Weyrich 2005, Eq. 10], in double precision. The surfel must not be dead.
LookUp<double> lookUpAt(const SurfelCloud& rest, const DeformedCloud& deformed, size_t surfel);

// Directions to viewer and lights, and the lights' irradiance at the deformed surfels, brought back to
// acquisition space by L; environments are turned by it. One query per entry of `surfels`, none of which may
// be dead. In double precision; the same bits for any number of threads, and for avx2 and avx512. `kept`, a
// batch that is no longer needed, gives its memory.
model::QueryBatch queriesAt(const SurfelCloud& rest, const DeformedCloud& deformed,
                            std::span<const uint32_t> surfels, const capture::Camera<ObjectSpace>& camera,
                            std::span<const scene::ShotLight> lights, const Progress& progress = {},
                            Simd simd = bestSimd(), model::QueryBatch kept = {});

// RGBA, premultiplied, from radiance per entry of coverage.visible, and its confidence if it has one. `kept`,
// a picture that is no longer needed, gives its memory.
image::Image developRadiance(const splat::SplatRaster& coverage, const model::Shaded& shaded,
                             image::Image kept = {});

// The frame's layers beside its colour, by name (script.h: aovNames).
struct FrameLayers {
  image::Image color;                       // RGBA, premultiplied
  std::map<std::string, image::Image> aovs; // premultiplied but for depth, which is infinite off the object
};

struct FrameStats {
  splat::SplatCounts splats;
  size_t visible = 0, unseen = 0;
  codec::ShadingStats shading;
  // Stages: "warp", "splat", "queries", "ulr" (of cameras and lights), "look-up", "develop", and "aov" where
  // there are any.
  std::map<std::string, double> seconds;          // per stage
  std::map<std::string, double> processorSeconds; // per stage, of all threads of the process
};

struct FrameOptions {
  model::ShadeOptions shade;
  splat::SplatOptions splats;
  std::vector<std::string> aovs;
};

// Memory that one frame leaves to the next, to be filled anew. Whoever is done with a film gives it back
// in `film`.
struct FrameMemory {
  DeformedCloud deformed;
  splat::SplatRaster coverage;
  FrameLayers film;
};

FrameLayers renderFrame(const model::Model& model, const warp::Warp& warp,
                        const capture::Camera<ObjectSpace>& camera, std::span<const scene::ShotLight> lights,
                        const FrameOptions& options, codec::BlockCache& cache, FrameStats& stats,
                        const Progress& progress = {}, FrameMemory* memory = nullptr);

// The ratio of the principal axes of a warped splat, 1 for a circle [Weyrich 2005, Fig. 15].
double stretchOf(const Vec3<double>& u, const Vec3<double>& v);

} // namespace surflect::surfels
