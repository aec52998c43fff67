#include "render/lightfield/slf/reference.h"

#include "render/lightfield/common/ray_radiance.h"
#include "srf/image/half_float.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace surflect::slf {

namespace {

Eigen::Vector4d valueOf(const Texel& texel) {
  return {image::floatOfHalf(texel[0]), image::floatOfHalf(texel[1]), image::floatOfHalf(texel[2]),
          image::floatOfHalf(texel[3])};
}

// Texels by region and direction, as hits need them.
using TextureSet = std::map<std::pair<uint32_t, uint32_t>, std::vector<Texel>>;

void forRows(int height, const Progress& progress, const auto& work) {
  tbb::parallel_for(0, height, [&](int y) {
    progress.checkpoint();
    work(y);
  });
}

} // namespace

Eigen::Vector4d texelAt(std::span<const Texel> texels, int width, int height, const Vec2<double>& place) {
  const double x = std::clamp(place.x() - 0.5, 0.0, width - 1.0);
  const double y = std::clamp(place.y() - 0.5, 0.0, height - 1.0);
  const int x0 = std::min(static_cast<int>(x), std::max(0, width - 2));
  const int y0 = std::min(static_cast<int>(y), std::max(0, height - 2));
  const int x1 = std::min(x0 + 1, width - 1), y1 = std::min(y0 + 1, height - 1);
  const double a = x - x0, b = y - y0;
  const auto at = [&](int i, int j) {
    return valueOf(texels[static_cast<size_t>(j) * static_cast<size_t>(width) + static_cast<size_t>(i)]);
  };
  return (1 - b) * ((1 - a) * at(x0, y0) + a * at(x1, y0)) + //
         b * ((1 - a) * at(x0, y1) + a * at(x1, y1));
}

Reference::Reference(const Field& field, const Textures& textures, const Progress& progress)
    : field_(&field), textures_(&textures), rays_(field.mesh, progress),
      places_(field.mesh.triangles.size()) {
  for (uint32_t region = 0; region < field.regions.size(); ++region) {
    const Chart& chart = field.regions[region].chart;
    for (uint32_t triangle = 0; triangle < chart.triangles.size(); ++triangle)
      places_[chart.meshTriangles[triangle]] = {region, triangle};
  }
}

std::optional<Reference::Hit>
Reference::firstHit(const Point3<AcquisitionSpace, double>& origin,
                    const Direction3<AcquisitionSpace, double>& direction) const {
  const auto found = lightfield::firstFrontHit(field_->mesh, rays_, origin, direction);
  if (!found) return std::nullopt;
  const auto [region, triangle] = places_[found->triangle];
  const Chart& chart = field_->regions[region].chart;
  Hit hit;
  hit.region = region;
  hit.distance = found->distance;
  // A chart's triangle may start at another corner, and has one vertex for all at one position.
  const std::array<double, 3> barycentrics{1 - found->b - found->c, found->b, found->c};
  const auto& ofMesh = field_->mesh.triangles[found->triangle];
  for (const uint32_t corner : chart.triangles[triangle]) {
    const auto isHere = [&](uint32_t vertex) {
      return field_->mesh.positions[vertex] == field_->mesh.positions[chart.vertices[corner]];
    };
    const auto at = static_cast<size_t>(std::ranges::find_if(ofMesh, isHere) - ofMesh.begin());
    const Vec2<double> coordinates = chart.coordinates[corner].cast<double>();
    hit.place += barycentrics[at] * coordinates.cwiseProduct(Vec2<double>(chart.width, chart.height));
  }
  hit.hats = field_->directionsOf(region).weightsAt(-direction);
  return hit;
}

Reference::Picture Reference::render(const capture::Camera<AcquisitionSpace>& camera,
                                     const Progress& progress) const {
  const capture::Lens& lens = camera.lens;
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const auto width = static_cast<size_t>(lens.width);
  std::vector<std::optional<Hit>> hits(width * static_cast<size_t>(lens.height));
  forRows(lens.height, progress, [&](int y) {
    for (int x = 0; x < lens.width; ++x)
      if (const auto ray = capture::rayThrough(lens, {x + 0.5, y + 0.5}))
        hits[static_cast<size_t>(y) * width + static_cast<size_t>(x)] =
            firstHit(worldFromCamera(ray->origin), normalized(worldFromCamera(ray->direction)));
  });

  TextureSet textures;
  for (const auto& hit : hits)
    if (hit)
      for (const uint32_t direction : hit->hats.directions) textures[{hit->region, direction}];
  size_t done = 0;
  for (auto& [key, texels] : textures) {
    progress.checkNowAndThen(done++);
    texels = textures_->read(key.first, key.second);
  }

  Picture picture{image::Image(lens.width, lens.height, 4), image::Image(lens.width, lens.height, 1)};
  forRows(lens.height, progress, [&](int y) {
    for (int x = 0; x < lens.width; ++x) {
      const auto& hit = hits[static_cast<size_t>(y) * width + static_cast<size_t>(x)];
      if (!hit) continue;
      const Chart& chart = field_->regions[hit->region].chart;
      Eigen::Vector4d sum = Eigen::Vector4d::Zero();
      for (size_t i = 0; i < 3; ++i)
        sum += hit->hats.weights[i] * texelAt(textures.at({hit->region, hit->hats.directions[i]}),
                                              chart.width, chart.height, hit->place);
      for (int channel = 0; channel < 3; ++channel)
        picture.color.at(x, y)[static_cast<size_t>(channel)] = static_cast<float>(sum[channel]);
      picture.color.at(x, y)[3] = 1;
      picture.observed.at(x, y)[0] = static_cast<float>(sum[3]);
    }
  });
  return picture;
}

} // namespace surflect::slf
