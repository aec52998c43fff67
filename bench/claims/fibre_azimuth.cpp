#include "bench/claims/fibre_azimuth.h"

#include "bench/claims/plate.h"
#include "render/stage/tracer.h"
#include "warp/deform.h"

#include <fmt/format.h>

#include <numbers>

namespace surflect::bench {

namespace {

constexpr double kPlate = 1.6, kWindow = 0.7; // half their sides: a shear of 1 leaves the window covered
constexpr int kPixels = 96;
constexpr Rgb kLamp{3, 3, 3};
const Vec3<double> kLampPosition(0, 0, 1);

const material::Ward kBrushed{{0.05f, 0.05f, 0.05f}, {0.3f, 0.3f, 0.3f}, {0.15, 0.5}};

warp::WarpPointer shearWarp(double shear) {
  const auto expression = [](const std::string& text) { return warp::Expression(text, warp::warpVariables); };
  return warp::expressionWarp(expression(fmt::format("x + {:.17g} * y", shear)), expression("y"),
                              expression("z"), warp::ShotTime{});
}

// Evenly spread over the cap of 58 degrees round z, to which the lamp's directions keep.
std::vector<capture::Light> lightsAbove(int count) {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const double lowest = std::cos(58 * std::numbers::pi / 180);
  std::vector<capture::Light> lights;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (1 - lowest) * (i + 0.5) / count, r = std::sqrt(1 - z * z);
    const std::string name = fmt::format("L{}", i);
    lights.push_back(
        {name, name,
         capture::DirectionalLight{{r * std::cos(golden * i), r * std::sin(golden * i), z}, {1, 1, 1}}});
  }
  return lights;
}

// The plate is even, and the camera far away: each photograph is of one colour.
std::vector<image::Image> photographsUnder(std::span<const capture::Light> lights, Angle fibre) {
  const double c = std::cos(fibre.radians()), s = std::sin(fibre.radians());
  std::vector<image::Image> photographs;
  for (const capture::Light& light : lights) {
    const Vec3<double> l = std::get<capture::DirectionalLight>(light.kind).towards.raw();
    const Rgb radiance =
        material::evaluate(kBrushed, {c * l.x() + s * l.y(), c * l.y() - s * l.x(), l.z()}, {0, 0, 1});
    image::Image& image = photographs.emplace_back(16, 16, 3);
    for (int i = 0; i < 256; ++i)
      std::ranges::copy(std::array{radiance.r, radiance.g, radiance.b}, image.at(i % 16, i / 16).begin());
  }
  return photographs;
}

image::Image greenOf(const image::Image& image) {
  image::Image green(image.width, image.height, 1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) green.at(x, y)[0] = image.at(x, y)[1];
  return green;
}

model::Model packed(Angle fibre, const std::filesystem::path& work) {
  const std::vector<capture::Light> lights = lightsAbove(500);
  return packPlate(work, cameraAbove<AcquisitionSpace>(Angle(), 16, 1.05 * kPlate), lights,
                   photographsUnder(lights, fibre), kPlate, 0, 25000);
}

} // namespace

Angle turnUnderShear(const FrameOf& frameOf, double shear, Angle phi) {
  Mat3<double> jacobian = Mat3<double>::Identity(), r0 = Mat3<double>::Identity();
  jacobian(0, 1) = shear;
  r0.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(phi.radians()).toRotationMatrix();
  const auto frame = frameOf(jacobian * r0.col(0), jacobian * r0.col(1));
  const Mat3<double> objectFromAcquisition = LookUp<double>(r0, *frame, 1).matrix().transpose();
  return Angle::fromRadians(std::atan2(objectFromAcquisition(1, 0), objectFromAcquisition(0, 0)));
}

Angle fibreUnderShear(double shear, Angle fibre) {
  const double c = std::cos(fibre.radians()), s = std::sin(fibre.radians());
  return Angle::fromRadians(std::atan2(s, c + shear * s));
}

BrushedPlate::BrushedPlate(Angle fibre, const std::filesystem::path& work)
    : fibre_(fibre), model_(packed(fibre, work)) {}

image::Image BrushedPlate::truth(double shear) const {
  stage::Surface plate;
  for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
    plate.mesh.positions.emplace_back(static_cast<float>(kPlate * x), static_cast<float>(kPlate * y), 0.f);
  plate.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  plate.normals.assign(4, {0, 0, 1});
  plate.tangents.assign(4, {std::cos(fibre_.radians()), std::sin(fibre_.radians()), 0});
  std::vector<stage::StageObject> objects;
  objects.push_back({stage::deformed(plate, *shearWarp(shear)), kBrushed});
  const std::vector<capture::Light> lamp{
      {"lamp", "lamp", capture::PointLight{assume<Point3<AcquisitionSpace, double>>(kLampPosition), kLamp}}};
  stage::TraceOptions options;
  options.samples = 4;
  options.transport = stage::Transport::local;
  const auto camera = cameraAbove<AcquisitionSpace>(Angle(), kPixels, kWindow);
  return greenOf(
      stage::traceView(stage::StageScene(std::move(objects)), camera, 0, lamp, options, {}).radiance[0]);
}

image::Image BrushedPlate::rendered(const FrameOf& frameOf, double shear) const {
  const auto camera = cameraAbove<ObjectSpace>(Angle(), kPixels, kWindow);
  const SurfelCloud& rest = model_.cloud;
  const DeformedCloud bent = warp::deform(rest, *shearWarp(shear));
  const splat::SplatRaster coverage = surfels::look(camera, rest, bent);
  model::QueryBatch batch;
  batch.lights = 1;
  batch.surfels = coverage.visible;
  for (const uint32_t surfel : coverage.visible) {
    const auto frame = frameOf(bent.u[surfel].raw().cast<double>(), bent.v[surfel].raw().cast<double>());
    const LookUp<double> lookUp(rotationOf<double>(rest.r0[surfel]), *frame, 1);
    const auto toLamp = assume<Direction3<ObjectSpace, double>>(
        Vec3<double>(kLampPosition - bent.p[surfel].raw().cast<double>()));
    batch.towardsView.push_back(lookUp(Direction3<ObjectSpace, double>(0, 0, 1)).cast<float>());
    batch.towardsLight.push_back(lookUp(normalized(toLamp)).cast<float>());
    batch.irradiance.push_back(static_cast<float>(1 / dot(toLamp, toLamp)) * kLamp);
  }
  codec::BlockCache cache(model_.files, size_t{1} << 26);
  codec::ShadingStats stats;
  model::ShadeOptions options;
  options.lights = 3;
  options.lightFit = ulr::LightFit::mean;
  return greenOf(surfels::developRadiance(coverage, model::shade(model_, batch, options, cache, stats)));
}

Angle azimuthOf(const image::Image& picture) {
  const double middle = picture.width / 2.0;
  double xx = 0, xy = 0, yy = 0;
  for (int j = 0; j < picture.height; ++j)
    for (int i = 0; i < picture.width; ++i) {
      const double x = i + 0.5 - middle, y = middle - j - 0.5;
      if (x * x + y * y > middle * middle) continue;
      const double w = picture.at(i, j)[0];
      xx += w * x * x;
      xy += w * x * y;
      yy += w * y * y;
    }
  const double streak = std::atan2(2 * xy, xx - yy) / 2; // -90 to 90 degrees
  return Angle::fromRadians(streak + (streak < std::numbers::pi / 2 ? std::numbers::pi / 2 : 0));
}

} // namespace surflect::bench
