// "This approximation may introduce a slight rotation of the principal axis of an anisotropic BRDF when the
// surface is sheared." [Weyrich 2005, §4.2]
//
// A plate with straight fibres in its plane under the shear x' = x + s y. Fibres follow the surface: a fibre
// t becomes J t. The look-up shows the captured fibre rotated by L, clockwise as seen from outside, by
//   polar factor of (u, v)        atan(s / 2), for any u0
//   Eq. 8, u0 or v0 along x       atan(s) / 2.
// Under J, fibres along x keep their direction, and fibres along y rotate by atan(s).
#include "bench/accuracy/claims.h"
#include "bench/accuracy/plate.h"
#include "bench/gallery/figures.h"
#include "render/stage/material/shading.h"
#include "render/stage/tracer.h"
#include "render/surfels/develop.h"
#include "render/surfels/frame.h"
#include "render/surfels/queries.h"
#include "srf/image/color.h"
#include "srf/image/png.h"
#include "surfel/math/sphere_sampling.h"
#include "warp/deform.h"

#include <fmt/format.h>

#include <numbers>
#include <sstream>

namespace surflect::bench {

namespace {

constexpr double kPlate = 1.6, kWindow = 0.7; // half side lengths; a shear of 1 leaves the window covered
constexpr int kPixels = 96;
constexpr Rgb kLamp{3, 3, 3};
const Vec3<double> kLampPosition(0, 0, 1);

const material::Ward kBrushed{{0.05f, 0.05f, 0.05f}, {0.3f, 0.3f, 0.3f}, {0.15, 0.5}};

warp::WarpPointer shearWarp(double shear) {
  const auto expression = [](const std::string& text) { return warp::Expression(text, warp::warpVariables); };
  return warp::expressionWarp(expression(fmt::format("x + {:.17g} * y", shear)), expression("y"),
                              expression("z"), warp::ShotTime{});
}

// Lights over the cap of 58 degrees around z, which holds all directions to the lamp.
std::vector<capture::Light> lightsAbove(size_t count) {
  std::vector<capture::Light> lights;
  for (const Vec3<double>& towards : fibonacciSphere(count, std::cos(58 * std::numbers::pi / 180), 1)) {
    const std::string name = fmt::format("L{}", lights.size());
    lights.push_back(
        {name, name,
         capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards), {1, 1, 1}}});
  }
  return lights;
}

// Photographs of the plate, each of a single colour, since plate and distant lights are uniform.
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

using FrameOf =
    std::function<std::optional<OrthonormalFrame<double>>(const Vec3<double>& u, const Vec3<double>& v)>;

constexpr double kShears[] = {0.1, 0.25, 0.5, 0.75, 1};

// Angle, counter-clockwise, by which L rotates captured directions, for tangents u0 = (cos phi, sin phi) and
// v0 perpendicular to it.
Angle turnUnderShear(const FrameOf& frameOf, double shear, Angle phi) {
  Mat3<double> jacobian = Mat3<double>::Identity(), r0 = Mat3<double>::Identity();
  jacobian(0, 1) = shear;
  r0.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(phi.radians()).toRotationMatrix();
  const auto frame = frameOf(jacobian * r0.col(0), jacobian * r0.col(1));
  const Mat3<double> objectFromAcquisition = LookUp<double>(r0, *frame, 1).matrix().transpose();
  return Angle::fromRadians(std::atan2(objectFromAcquisition(1, 0), objectFromAcquisition(0, 0)));
}

// Direction of the fibre J t after the shear, counter-clockwise from x.
Angle fibreUnderShear(double shear, Angle fibre) {
  const double c = std::cos(fibre.radians()), s = std::sin(fibre.radians());
  return Angle::fromRadians(std::atan2(s, c + shear * s));
}

// Photographs of a brushed plate from above, under lights of the upper part of the hemisphere.
class BrushedPlate {
public:
  BrushedPlate(Angle fibre, const std::filesystem::path& work);

  // Pictures of the sheared plate from above, under a point light over its middle: path traced with fibres
  // J t, and rendered from the photographs. One channel, a square of side 1.4.
  image::Image truth(double shear) const;
  image::Image rendered(const FrameOf& frameOf, double shear) const;

private:
  Angle fibre_;
  model::Model model_;
};

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
  weights::QueryBatch batch;
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
  shading::ShadingStats stats;
  weights::ShadeOptions options;
  options.lights = 3;
  options.lightFit = weights::LightFit::mean;
  return greenOf(surfels::developRadiance(coverage, shading::shade(model_, batch, options, cache, stats)));
}

// Azimuth of the fibres, 0 to 180 degrees, from the picture of a lamp over the middle: its highlight is a
// streak across the fibres. Computed from second moments within the inscribed disc.
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

struct LabelledPicture {
  std::string label;
  image::Image picture; // one channel
};

// Composes rows of three pictures; the largest value of a row's first picture is white.
void writeRows(const std::filesystem::path& file, std::span<const LabelledPicture> pictures) {
  Json cells = Json::array();
  float white = 1;
  for (const auto& [label, picture] : pictures) {
    if (cells.size() % 3 == 0) white = std::ranges::max(picture.values);
    image::Image encoded = picture;
    for (float& value : encoded.values) value = image::srgbFromLinear(std::clamp(value / white, 0.f, 1.f));
    const auto cell = file.parent_path() / fmt::format("fibres-{}.png", cells.size());
    image::writePng(cell, encoded);
    cells.push_back({{"file", cell}, {"label", label}, {"zoom", 2}});
  }
  std::istringstream layout(Json{{"out", file}, {"columns", 3}, {"cells", cells}}.dump());
  composePanels(layout);
}

} // namespace

Json fibreAzimuth(const std::filesystem::path& folder) {
  const FrameOf polar = polarFrame<double>, bisector = bisectorFrame<double>;
  Json report = Json::array();
  std::vector<LabelledPicture> pictures;
  for (const double degrees : {0.0, 90.0}) {
    const Angle fibre = Angle::fromDegrees(degrees);
    const BrushedPlate plate(fibre, folder / fmt::format("fibre-{:.0f}", degrees));
    for (const double shear : kShears) {
      const image::Image truth = plate.truth(shear), byPolar = plate.rendered(polar, shear),
                         byBisector = plate.rendered(bisector, shear);
      const auto after = [&](const FrameOf& frameOf) {
        return degrees + turnUnderShear(frameOf, shear, Angle()).degrees();
      };
      report.push_back({{"fibre_deg", degrees},
                        {"shear", shear},
                        {"truth_deg", azimuthOf(truth).degrees()},
                        {"polar_deg", azimuthOf(byPolar).degrees()},
                        {"bisector_deg", azimuthOf(byBisector).degrees()},
                        {"truth_stated_deg", fibreUnderShear(shear, fibre).degrees()},
                        {"polar_stated_deg", after(polar)},
                        {"bisector_stated_deg", after(bisector)}});
      if (shear == 1)
        pictures.insert(
            pictures.end(),
            {{degrees == 0 ? "x: truth" : "y: truth", truth}, {"polar", byPolar}, {"Eq. 8", byBisector}});
    }
  }
  writeRows(folder / "fibres.png", pictures);
  return report;
}

// RMS angle over all fibres between their rendered direction and J t, and the dependence of L on u0.
Json fibreError() {
  Json report = Json::array();
  for (const double shear : kShears) {
    double polar = 0, bisector = 0, least = 1e9, most = -1e9;
    constexpr int kCount = 180;
    for (int f = 0; f < kCount; ++f) {
      const Angle fibre = Angle::fromDegrees(f);
      const double turn = fibreUnderShear(shear, fibre).degrees() - f;
      polar +=
          material::squared(turn - turnUnderShear(polarFrame<double>, shear, Angle()).degrees()) / kCount;
      for (int u = 0; u < kCount; ++u) { // u0 may have any direction
        const double byBisector =
            turnUnderShear(bisectorFrame<double>, shear, Angle::fromDegrees(u)).degrees();
        bisector += material::squared(turn - byBisector) / kCount / kCount;
        least = std::min(least, byBisector);
        most = std::max(most, byBisector);
      }
    }
    report.push_back({{"shear", shear},
                      {"polar_rms_deg", std::sqrt(polar)},
                      {"bisector_rms_deg", std::sqrt(bisector)},
                      {"bisector_least_deg", least},
                      {"bisector_most_deg", most}});
  }
  return report;
}

} // namespace surflect::bench
