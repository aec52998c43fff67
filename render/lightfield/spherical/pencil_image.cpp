#include "render/lightfield/spherical/pencil_image.h"

#include "srf/image/half_float.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <utility>

namespace surflect::spherical {

namespace {

size_t texelsOf(int size) { return static_cast<size_t>(size) * static_cast<size_t>(size); }

MipLevel halved(const MipLevel& fine) {
  MipLevel coarse{fine.size / 2, {}, {}};
  coarse.colors.resize(texelsOf(coarse.size));
  coarse.heights.resize(texelsOf(coarse.size));
  for (int y = 0; y < coarse.size; ++y)
    for (int x = 0; x < coarse.size; ++x) {
      Eigen::Vector4f color = Eigen::Vector4f::Zero();
      float height = 0, plainHeight = 0;
      for (int corner = 0; corner < 4; ++corner) {
        const int row = 2 * y + corner / 2, column = 2 * x + corner % 2;
        const size_t texel = static_cast<size_t>(row * fine.size + column);
        const Texel& halfs = fine.colors[texel];
        for (int channel = 0; channel < 4; ++channel)
          color[channel] += 0.25f * image::floatOfHalf(halfs[static_cast<size_t>(channel)]);
        height += 0.25f * image::floatOfHalf(halfs[3]) * fine.heights[texel];
        plainHeight += 0.25f * fine.heights[texel];
      }
      const size_t texel = static_cast<size_t>(y * coarse.size + x);
      for (int channel = 0; channel < 4; ++channel)
        coarse.colors[texel][static_cast<size_t>(channel)] = image::finiteHalf(color[channel]);
      coarse.heights[texel] = color[3] > 0 ? height / color[3] : plainHeight;
    }
  return coarse;
}

// Bilinear sample of a level of values that `at` returns by texel.
template <class Value, class At>
Value bilinear(const MipLevel& level, const Vec2<double>& place, const At& at) {
  const Vec2<double> texel = level.size * place - Vec2<double>(0.5, 0.5);
  const double left = std::floor(texel[0]), top = std::floor(texel[1]);
  const double right = texel[0] - left, down = texel[1] - top;
  const auto clamped = [&](double coordinate) {
    return static_cast<int>(std::clamp(coordinate, 0.0, level.size - 1.0));
  };
  const int x0 = clamped(left), x1 = clamped(left + 1), y0 = clamped(top), y1 = clamped(top + 1);
  const auto value = [&](int x, int y) -> Value { return at(static_cast<size_t>(y * level.size + x)); };
  const Value upper = (1 - right) * value(x0, y0) + right * value(x1, y0);
  const Value lower = (1 - right) * value(x0, y1) + right * value(x1, y1);
  return (1 - down) * upper + down * lower;
}

template <class Value, class At>
Value trilinear(const PencilImage& image, const Vec2<double>& place, double mip, const At& at) {
  const double last = static_cast<double>(image.mips.size() - 1);
  const double clamped = std::clamp(mip, 0.0, last), fine = std::floor(clamped), share = clamped - fine;
  const auto of = [&](double level) -> Value {
    const MipLevel& mipLevel = image.mips[static_cast<size_t>(level)];
    return bilinear<Value>(mipLevel, place, [&](size_t texel) { return at(mipLevel, texel); });
  };
  if (share == 0) return of(fine);
  return (1 - share) * of(fine) + share * of(fine + 1);
}

} // namespace

Height heightOf(double value) {
  return static_cast<Height>(std::lround(65535 * (std::clamp(value, -0.5, 0.5) + 0.5)));
}

PencilImage mipmapped(int size, std::vector<Texel> colors, std::vector<Height> heights) {
  assert(std::has_single_bit(static_cast<unsigned>(size)));
  assert(colors.size() == texelsOf(size) && heights.size() == texelsOf(size));
  MipLevel largest{size, std::move(colors), {}};
  largest.heights.reserve(heights.size());
  for (const Height height : heights) largest.heights.push_back(static_cast<float>(valueOf(height)));
  PencilImage image;
  image.mips.push_back(std::move(largest));
  while (image.mips.back().size > 1) image.mips.push_back(halved(image.mips.back()));
  return image;
}

size_t imageBytes(int size) {
  size_t bytes = 0;
  for (; size >= 1; size /= 2) bytes += texelsOf(size) * (sizeof(Texel) + sizeof(float));
  return bytes;
}

ImageAxes axesOf(const Vec3<double>& direction) {
  const Vec3<double> up = std::abs(direction[1]) < 0.9 ? Vec3<double>(0, 1, 0) : Vec3<double>(0, 0, 1);
  const Vec3<double> u = up.cross(direction).normalized();
  return {u, direction.cross(u), direction};
}

Vec3<double> placeOf(const Sphere& sphere, const ImageAxes& axes, const Vec3<double>& point) {
  return vectorOf(sphere, axes, point - sphere.middle) + Vec3<double>(0.5, 0.5, 0);
}

Vec3<double> vectorOf(const Sphere& sphere, const ImageAxes& axes, const Vec3<double>& direction) {
  return Vec3<double>(axes.u.dot(direction), -axes.v.dot(direction), axes.d.dot(direction)) /
         (2 * sphere.radius);
}

Vec3<double> pointOf(const Sphere& sphere, const ImageAxes& axes, const Vec3<double>& place) {
  return sphere.middle +
         2 * sphere.radius * ((place[0] - 0.5) * axes.u - (place[1] - 0.5) * axes.v + place[2] * axes.d);
}

Eigen::Vector4d colorAt(const PencilImage& image, const Vec2<double>& place, double mip) {
  return trilinear<Eigen::Vector4d>(image, place, mip, [](const MipLevel& level, size_t texel) {
    Eigen::Vector4d color;
    for (int channel = 0; channel < 4; ++channel)
      color[channel] =
          static_cast<double>(image::floatOfHalf(level.colors[texel][static_cast<size_t>(channel)]));
    return color;
  });
}

double heightAt(const PencilImage& image, const Vec2<double>& place, double mip) {
  return trilinear<double>(image, place, mip, [](const MipLevel& level, size_t texel) {
    return static_cast<double>(level.heights[texel]);
  });
}

} // namespace surflect::spherical
