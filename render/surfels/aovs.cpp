#include "render/surfels/aovs.h"

#include "surfel/cloud.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <map>
#include <string_view>

namespace surflect::surfels {

namespace {

// An AOV that is blended like colour.
struct BlendedAov {
  int channels;
  bool isConfident; // whether weights are multiplied by the surfels' confidence
  std::function<void(size_t i, float* to)> valuesOf; // writes the values of raster.visible[i]
};

// Blends AOVs at once, with one confidence for all of them: empty, or one value per entry of raster.visible.
void developAovs(const std::map<std::string_view, BlendedAov>& aovs, const std::vector<std::string>& names,
                 const splat::SplatRaster& raster, std::span<const float> confidence,
                 const Progress& progress, method::FrameLayers& layers) {
  std::vector<image::Image*> pictures;
  size_t channels = 0;
  for (const std::string& name : names) {
    pictures.push_back(&layers.aovs[name]);
    pictures.back()->channels = aovs.at(name).channels;
    channels += static_cast<size_t>(aovs.at(name).channels);
  }
  std::vector<float> values(raster.visible.size() * channels);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, raster.visible.size(), 1024),
                    [&](const tbb::blocked_range<size_t>& range) {
                      progress.checkpoint();
                      size_t channel = 0;
                      for (const std::string& name : names) {
                        const BlendedAov& aov = aovs.at(name);
                        for (size_t i = range.begin(); i < range.end(); ++i)
                          aov.valuesOf(i, &values[i * channels + channel]);
                        channel += static_cast<size_t>(aov.channels);
                      }
                    });
  splat::blendInto(pictures, raster, values, confidence, progress);
}

} // namespace

double stretchOf(const Vec3<double>& u, const Vec3<double>& v) {
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double mean = (uu + vv) / 2, spread = std::hypot((uu - vv) / 2, uv);
  const double smaller = u.cross(v).squaredNorm() / (mean + spread); // product over the larger root
  return std::sqrt((mean + spread) / smaller);
}

void computeAovs(const std::vector<std::string>& asked, const splat::SplatRaster& raster,
                 const SurfelCloud& rest, const DeformedCloud& deformed, const shading::Shaded& shaded,
                 const Progress& progress, method::FrameLayers& layers) {
  const auto blendOf = [](const std::vector<Rgb>& blends) {
    return [&blends](size_t i, float* to) { to[0] = blends[i].r, to[1] = blends[i].g, to[2] = blends[i].b; };
  };
  const auto normal = [&](size_t i, float* to) {
    const size_t surfel = raster.visible[i];
    const auto tangents =
        polarFrame<double>(deformed.u[surfel].raw().cast<double>(), deformed.v[surfel].raw().cast<double>());
    assert(tangents); // of surfels that are not dead
    const Vec3<double> outward = static_cast<double>(deformed.handedness[surfel]) * tangents->n;
    for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(outward[k]);
  };
  const auto placeIn = [&](const auto& places) {
    return [&](size_t i, float* to) { Eigen::Map<Vec3<float>>{to} = places[raster.visible[i]].raw(); };
  };
  const auto stretch = [&](size_t i, float* to) {
    const size_t surfel = raster.visible[i];
    *to = static_cast<float>(
        stretchOf(deformed.u[surfel].raw().cast<double>(), deformed.v[surfel].raw().cast<double>()));
  };
  const std::map<std::string_view, BlendedAov> blended{
      {"normal", {3, false, normal}},
      {"position", {3, false, placeIn(deformed.p)}},
      {"rest", {3, false, placeIn(rest.p0)}},
      {"stretch", {1, false, stretch}},
      {"camera_blend", {3, true, blendOf(shaded.cameraBlend)}},
      {"light_blend", {3, true, blendOf(shaded.lightBlend)}}};
  std::erase_if(layers.aovs, [&](const auto& aov) { return std::ranges::count(asked, aov.first) == 0; });
  for (const bool isConfident : {false, true}) {
    progress.checkpoint();
    std::vector<std::string> names;
    for (const std::string& name : asked)
      if (const auto aov = blended.find(name); aov != blended.end() && aov->second.isConfident == isConfident)
        names.push_back(name);
    if (!names.empty())
      developAovs(blended, names, raster,
                  isConfident ? std::span(shaded.confidence) : std::span<const float>(), progress, layers);
  }
  if (std::ranges::count(asked, "depth") > 0)
    layers.aovs["depth"] = splat::depthImage(raster, std::move(layers.aovs["depth"]), progress);
}

} // namespace surflect::surfels
