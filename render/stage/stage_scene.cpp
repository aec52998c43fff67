#include "render/stage/stage_scene.h"

#include "srf/image/image_file.h"
#include "surfel/base/error.h"
#include "surfel/geometry/embree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>

namespace surflect::stage {

namespace {

// i modulo n, non-negative also for negative i.
int wrapped(int i, int n) { return ((i % n) + n) % n; }

// Decoder by the picture's own statement; by default floating point is linear, all else sRGB.
image::ColorDecoder decoderOf(const image::Picture& picture, const std::filesystem::path& path) {
  const image::Transfer usual{picture.isFloat() ? image::Transfer::Curve::linear
                                                : image::Transfer::Curve::srgb};
  if (!picture.color) return {{}, usual};
  if (!picture.color->problem.empty()) throw Error(picture.color->problem).at(picture.color->source).in(path);
  return {picture.color->encoding, usual};
}

bool isUnit(float value) { return value >= 0 && value <= 1; }

Error inPixel(Error e, int x, int y, const std::filesystem::path& path) {
  return std::move(e).at("pixel[" + std::to_string(x) + ", " + std::to_string(y) + "]").in(path);
}

} // namespace

image::Image readTexels(const std::filesystem::path& path, Texels what) {
  const image::Picture picture = image::readPicture(path);
  const image::Image& image = picture.image;
  if (picture.hasAlpha() && picture.alphaPremultiplied)
    throw Error::mismatch("a texture without alpha", "colours multiplied by it").in(path);
  image::Image stored(image.width, image.height, image.channels < 3 ? 1 : 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < stored.channels; ++c) {
        const float value = image.at(x, y)[static_cast<size_t>(c)];
        if (!isUnit(value)) throw inPixel(Error::mismatch("0 to 1", numberText(value)), x, y, path);
        stored.at(x, y)[static_cast<size_t>(c)] = value;
      }
  constexpr float kRounding = 1e-4f; // tolerance for colour conversion, including a profile's white
  image::Image linear =
      image::decoded(stored, what == Texels::factors ? image::ColorDecoder() : decoderOf(picture, path));
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (float& value : linear.at(x, y)) {
        const float inside = std::clamp(value, 0.f, 1.f);
        if (!(std::abs(value - inside) <= kRounding))
          throw inPixel(Error("the colour lies outside of Rec. 709's gamut (" + numberText(value) +
                              ", linear); convert the texture to sRGB"),
                        x, y, path);
        value = inside;
      }
  return linear;
}

Texture::Texture(std::shared_ptr<const image::Image> texels, int columns, int rows)
    : texels_(std::move(texels)), columns_(columns), rows_(rows) {
  assert(texels_ && texels_->channels == 3);
}

Rgb Texture::at(const Vec2<double>& st) const {
  const auto fraction = [](double x) { return x - std::floor(x); };
  const double x = fraction(st[0] * columns_) * texels_->width - 0.5,
               y = (1 - fraction(st[1] * rows_)) * texels_->height - 0.5;
  const double left = std::floor(x), top = std::floor(y);
  const auto texel = [&](int dx, int dy) {
    const auto t = texels_->at(wrapped(static_cast<int>(left) + dx, texels_->width),
                               wrapped(static_cast<int>(top) + dy, texels_->height));
    return Rgb{t[0], t[1], t[2]};
  };
  const auto a = static_cast<float>(x - left), b = static_cast<float>(y - top);
  return (1 - b) * ((1 - a) * texel(0, 0) + a * texel(1, 0)) + b * ((1 - a) * texel(0, 1) + a * texel(1, 1));
}

using Vector = Vec3<double>;

namespace {

void tint(material::Lambert& material, const Rgb& factor) { material.albedo = material.albedo * factor; }
void tint(material::RoughDiffuse& material, const Rgb& factor) { material.albedo = material.albedo * factor; }
void tint(material::Conductor& material, const Rgb& factor) { material.color = material.color * factor; }
void tint(material::Ward& material, const Rgb& factor) { material.diffuse = material.diffuse * factor; }

material::Roughness scaled(const material::Roughness& alpha, double factor) {
  return {factor * alpha.x, factor * alpha.y};
}
void smooth(material::RoughDiffuse& material, double factor) { material.roughness *= factor; }
void smooth(material::Conductor& material, double factor) { material.alpha = scaled(material.alpha, factor); }
void smooth(material::Dielectric& material, double factor) { material.alpha *= factor; }
void smooth(material::Ward& material, double factor) { material.alpha = scaled(material.alpha, factor); }

template <class Kind> void vary(Kind& kind, const Rgb& colorFactor, double roughnessFactor) {
  if constexpr (requires { tint(kind, colorFactor); }) tint(kind, colorFactor);
  if constexpr (requires { smooth(kind, roughnessFactor); }) smooth(kind, roughnessFactor);
}
void vary(material::ClearCoat& coated, const Rgb& colorFactor, double roughnessFactor) {
  std::visit([&](auto& base) { vary(base, colorFactor, roughnessFactor); }, coated.base);
}

} // namespace

material::Material varied(const material::Material& material, const Rgb& colorFactor,
                          double roughnessFactor) {
  material::Material result = material;
  std::visit([&](auto& kind) { vary(kind, colorFactor, roughnessFactor); }, result);
  return result;
}

struct StageScene::Rays {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  bool has16 = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
  Vector center;
  double offset = 0;

  Rays() = default;
  Rays(const Rays&) = delete;
  Rays& operator=(const Rays&) = delete;
  ~Rays() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  void add(const TriangleMesh& mesh, unsigned id) {
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.positions.size()));
    for (const auto& p : mesh.positions) {
      const Vec3<float> recentred = (p.cast<double>().raw() - center).cast<float>();
      vertices = std::copy_n(recentred.data(), 3, vertices);
    }
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(uint32_t), mesh.triangles.size());
    std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * sizeof mesh.triangles[0]);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
  }

  RTCRay ray(const Vector& origin, const Vector& direction, double distance) const {
    const Vec3<float> o = (origin - center).cast<float>(), d = direction.cast<float>();
    RTCRay ray{};
    ray.org_x = o[0], ray.org_y = o[1], ray.org_z = o[2];
    ray.dir_x = d[0], ray.dir_y = d[1], ray.dir_z = d[2];
    ray.tfar = static_cast<float>(distance);
    ray.mask = ~0u;
    return ray;
  }
};

StageScene::StageScene(std::vector<StageObject> objects) : objects_(std::move(objects)) {
  auto rays = std::make_unique<Rays>();
  Eigen::AlignedBox3d bounds;
  for (const auto& object : objects_)
    for (const auto& p : object.surface.mesh.positions) bounds.extend(p.cast<double>().raw());
  assert(!bounds.isEmpty());
  rays->center = bounds.center();
  rays->offset = 1e-5 * bounds.sizes().maxCoeff();
  rtcSetSceneFlags(rays->scene, RTC_SCENE_FLAG_ROBUST);
  for (size_t i = 0; i < objects_.size(); ++i) rays->add(objects_[i].surface.mesh, static_cast<unsigned>(i));
  rtcCommitScene(rays->scene);
  rays_ = std::move(rays);
}

StageScene::~StageScene() = default;

std::optional<SurfaceHit> StageScene::firstHit(const Point3<AcquisitionSpace, double>& origin,
                                               const Direction3<AcquisitionSpace, double>& direction) const {
  RTCRayHit query{rays_->ray(origin.raw(), direction.raw(), std::numeric_limits<double>::infinity()), {}};
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  intersectRay(rays_->scene, query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  const StageObject& object = objects_[query.hit.geomID];
  const Surface& surface = object.surface;
  const auto& corners = surface.mesh.triangles[query.hit.primID];
  const double v = query.hit.u, w = query.hit.v;
  const auto interpolated = [&](const auto& values) -> Vector {
    return (1 - v - w) * values[corners[0]].raw().template cast<double>() +
           v * values[corners[1]].raw().template cast<double>() +
           w * values[corners[2]].raw().template cast<double>();
  };
  const auto material = [&] {
    if (!object.textures.any()) return object.material;
    const auto& st = surface.textureCoordinates;
    const Vec2<double> place = (1 - v - w) * st[corners[0]] + v * st[corners[1]] + w * st[corners[2]];
    const auto& [color, roughness] = object.textures;
    return varied(object.material, color ? color->at(place) : Rgb{1, 1, 1},
                  roughness ? roughness->at(place).r : 1);
  };
  using Direction = Direction3<AcquisitionSpace, double>;
  return SurfaceHit{assume<Point3<AcquisitionSpace, double>>(interpolated(surface.mesh.positions)),
                    query.ray.tfar,
                    assume<Direction>(areaVector(surface.mesh, query.hit.primID).stableNormalized()),
                    assume<Direction>(interpolated(surface.normals)),
                    assume<Direction>(interpolated(surface.tangents)),
                    material()};
}

ShadowRay StageScene::shadowRay(const Point3<AcquisitionSpace, double>& origin,
                                const Direction3<AcquisitionSpace, double>& direction,
                                double distance) const {
  const Vec3<float> o = (origin.raw() - rays_->center).cast<float>(), d = direction.raw().cast<float>();
  return {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}, static_cast<float>(distance)};
}

namespace {

// Casts at most as many rays as the packet holds.
template <class Packet>
uint32_t occludedIn(RTCScene scene, std::span<const ShadowRay> rays, bool isCoherent) {
  constexpr size_t kMost = std::extent_v<decltype(Packet::tfar)>;
  // Embree ignores `valid` for packet sizes that are not native. Rays that end before they begin are always
  // inactive.
  Packet packet{};
  std::ranges::fill(packet.tnear, 1.f);
  alignas(64) std::array<int, kMost> valid{};
  for (size_t i = 0; i < rays.size(); ++i) {
    const auto& [o, d, distance] = rays[i];
    packet.org_x[i] = o[0], packet.org_y[i] = o[1], packet.org_z[i] = o[2];
    packet.dir_x[i] = d[0], packet.dir_y[i] = d[1], packet.dir_z[i] = d[2];
    packet.tnear[i] = packet.time[i] = 0;
    packet.tfar[i] = distance;
    packet.mask[i] = ~0u;
    valid[i] = -1;
  }
  occludePacket(scene, valid.data(), packet, isCoherent);
  uint32_t bits = 0; // Embree marks a hit by a negative tfar
  for (size_t i = 0; i < rays.size(); ++i) bits |= static_cast<uint32_t>(packet.tfar[i] < 0) << i;
  return bits;
}

} // namespace

uint32_t StageScene::occluded(std::span<const ShadowRay> rays, Beam beam) const {
  assert(rays.size() <= kMostRays);
  const bool isCoherent = beam == Beam::narrow;
  if (rays_->has16) return occludedIn<RTCRay16>(rays_->scene, rays, isCoherent);
  const size_t half = std::min(rays.size(), kMostRays / 2);
  const uint32_t first = occludedIn<RTCRay8>(rays_->scene, rays.first(half), isCoherent);
  if (rays.size() == half) return first;
  return first | occludedIn<RTCRay8>(rays_->scene, rays.subspan(half), isCoherent) << half;
}

Point3<AcquisitionSpace, double>
StageScene::leaving(const SurfaceHit& hit, const Direction3<AcquisitionSpace, double>& direction) const {
  return hit.position + (dot(hit.facet, direction) < 0 ? -rays_->offset : rays_->offset) * hit.facet;
}

bool isInside(const StageScene& scene, const Point3<AcquisitionSpace, double>& point) {
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const int axes = std::abs(x) + std::abs(y) + std::abs(z);
        if (axes != 1 && axes != 3) continue; // along the axes, and along the diagonals
        const auto direction = normalized(Direction3<AcquisitionSpace, double>(x, y, z));
        const auto hit = scene.firstHit(point, direction);
        if (!hit || dot(hit->facet, direction) < 0) return false;
      }
  return true;
}

} // namespace surflect::stage
