#include "bench/doll/doll_model.h"

#include "bench/doll/doll_blocks.h"
#include "bench/doll/doll_shape.h"
#include "srf/model/manifest.h"
#include "srf/model/model.h"
#include "srf/model/pack_folder.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/math/sphere_sampling.h"
#include "surfel/sampling.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <random>

namespace surflect::bench {

namespace {

constexpr double kDistance = 4;
const Vec3<double> kMiddle(0, 0, 0.5);

std::vector<capture::Light> dollLights(size_t count) {
  std::vector<capture::Light> lights;
  for (const Vec3<double>& towards : fibonacciSphere(count)) {
    const std::string name = fmt::format("L{}", lights.size());
    lights.push_back(
        {name, name,
         capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards), {1, 1, 1}}});
  }
  return lights;
}

capture::Capture rigOf(const DollSize& size, std::span<const capture::Camera<AcquisitionSpace>> cameras) {
  capture::Capture rig;
  rig.colorSpace = capture::ColorSpace::linear;
  rig.lights = dollLights(size.lights);
  for (size_t view = 0; view < cameras.size(); ++view) {
    rig.views.push_back({fmt::format("C{}", view), cameras[view]});
    for (size_t light = 0; light < size.lights; ++light) {
      capture::Frame frame;
      frame.view = view;
      frame.light = light;
      frame.picture = model::viewFilePath(view);
      rig.frames.push_back(frame);
    }
  }
  return rig;
}

// Number of segments for which triangles are about as large as the spacing of surfels.
int segmentsFor(size_t surfels) {
  return static_cast<int>(std::clamp(std::sqrt(static_cast<double>(surfels)) / 3.8, 32.0, 192.0));
}

// Mask of the block's texels that show the doll.
uint64_t presentTexels(std::span<const uint8_t> outline, const codec::ViewHeader& header,
                       codec::BlockPosition block) {
  uint64_t present = 0;
  for (int texel = 0; texel < codec::blockTexels; ++texel) {
    const int x = block.x * codec::blockSize + texel % codec::blockSize,
              y = block.y * codec::blockSize + texel / codec::blockSize;
    if (x < header.width && y < header.height && outline[static_cast<size_t>(y * header.width + x)] != 0)
      present |= uint64_t{1} << texel;
  }
  return present;
}

// Normal of the doll at the middle of a block, or at its first present texel if the middle is background.
Vec3<double> normalShown(const capture::Camera<AcquisitionSpace>& camera, codec::BlockPosition block,
                         uint64_t present) {
  constexpr int kMiddleTexel = codec::blockTexels / 2 + codec::blockSize / 2;
  const int texel = present >> kMiddleTexel & 1 ? kMiddleTexel : std::countr_zero(present);
  const capture::Pixel pixel{block.x * codec::blockSize + texel % codec::blockSize + 0.5,
                             block.y * codec::blockSize + texel / codec::blockSize + 0.5};
  const auto ray = capture::rayThrough(camera.lens, pixel); // exists, as there is no distortion
  const auto direction = camera.cameraFromWorld.inverse()(ray->direction);
  const auto hit = firstHit(camera.center().raw(), direction.raw());
  return hit ? hit->normal : Vec3<double>(-direction.raw()); // missed by rounding at grazing incidence
}

std::vector<std::byte> viewFile(const capture::Camera<AcquisitionSpace>& camera, size_t view,
                                const DollSize& size, const DollBlocks& blocks) {
  const codec::ViewHeader header{size.width, size.height, static_cast<int>(size.lights), DollBlocks::kWhite,
                                 DollBlocks::kTolerance};
  const auto outline = dollOutline(camera);
  std::vector<codec::PlacedRecord> records;
  for (codec::BlockPosition at; at.y < header.blocksDown(); ++at.y)
    for (at.x = 0; at.x < header.blocksAcross(); ++at.x) {
      const uint64_t present = presentTexels(outline, header, at);
      if (present == 0) continue;
      const uint64_t variant =
          (view * 31 + static_cast<uint64_t>(at.y) * 17 + static_cast<uint64_t>(at.x)) / 3;
      records.push_back({at, blocks.record(normalShown(camera, at, present), variant, present)});
    }
  return codec::viewFileBytes(header, records);
}

} // namespace

std::string nameOf(const DollSize& size) {
  return fmt::format("doll-{}-{}x{}-{}x{}-{}.v{}", size.surfels, size.views, size.lights, size.width,
                     size.height, size.seed, model::kModelVersion);
}

std::vector<capture::Camera<AcquisitionSpace>> dollCameras(const DollSize& size) {
  // A ball of radius 0.55 around the middle touches the shorter side of the picture.
  const double focal = 0.5 * std::min(1.32 * size.width, 1.0 * size.height) * kDistance / 0.55;
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const Vec3<double>& backwards : fibonacciSphere(size.views, std::sin(-0.26), std::sin(1.31))) {
    capture::Camera<AcquisitionSpace> camera;
    camera.lens.width = size.width;
    camera.lens.height = size.height;
    camera.lens.focalX = camera.lens.focalY = focal;
    camera.lens.centerX = 0.5 * size.width;
    camera.lens.centerY = 0.5 * size.height;
    const Vec3<double> right = Vec3<double>(0, 0, 1).cross(backwards).normalized();
    Mat3<double> cameraFromWorld;
    cameraFromWorld << right.transpose(), backwards.cross(right).transpose(), backwards.transpose();
    camera.cameraFromWorld = {cameraFromWorld, -cameraFromWorld * (kMiddle + kDistance * backwards)};
    cameras.push_back(camera);
  }
  return cameras;
}

SurfelCloud dollCloud(size_t surfels, uint64_t seed, const Progress& progress) {
  const TriangleMesh mesh = dollMesh(segmentsFor(surfels));
  return sampleSurfels(mesh, spacingFor(mesh, surfels), seed, progress);
}

SurfelCloud shuffled(const SurfelCloud& cloud) {
  std::vector<size_t> places(cloud.size());
  std::iota(places.begin(), places.end(), size_t{0});
  std::ranges::shuffle(places, std::mt19937(1));
  SurfelCloud other;
  for (const size_t i : places) {
    other.p0.push_back(cloud.p0[i]);
    other.r0.push_back(cloud.r0[i]);
    other.radius.push_back(cloud.radius[i]);
    other.coverage.push_back(cloud.coverage[i]);
  }
  return other;
}

std::vector<float> dollColors(const SurfelCloud& cloud) {
  std::vector<float> colors;
  for (const auto& p : cloud.p0)
    for (const float frequency : {34.f, 40.f, 46.f})
      colors.push_back(0.5f + 0.25f * std::sin(frequency * p.x()) + 0.2f * std::sin(frequency * p.z()));
  return colors;
}

DollSurface dollSurface(size_t surfels, uint64_t seed,
                        std::span<const capture::Camera<AcquisitionSpace>> cameras,
                        const Progress& progress) {
  const TriangleMesh mesh = dollMesh(segmentsFor(surfels));
  DollSurface surface{dollCloud(surfels, seed, progress), {}};
  surface.visibility = weights::visibilityWeights(surface.cloud, cameras,
                                                  RayCaster<AcquisitionSpace>(mesh, progress), progress);
  return surface;
}

void writeDollModel(const std::filesystem::path& folder, const DollSize& size, const Progress& progress) {
  namespace fs = std::filesystem;
  const bool isOfPack = fs::exists(folder / model::packIdentityPath());
  if (fs::exists(folder) && !fs::is_empty(folder) && (isOfPack || !fs::exists(folder / "views")))
    throw Error("exists and is not a model: give the doll a folder of its own").in(folder);
  createFolder(folder / "views");
  const auto cameras = dollCameras(size);
  const capture::Capture rig = rigOf(size, cameras);
  const DollBlocks blocks(rig.lights, size.seed);
  tbb::parallel_for(size_t{0}, cameras.size(), [&](size_t view) {
    progress.checkpoint();
    writeFileAtomically(folder / model::viewFilePath(view), viewFile(cameras[view], view, size, blocks));
  });
  progress("view files", 1);
  const auto [cloud, visibility] = dollSurface(size.surfels, size.seed, cameras, progress);
  const weights::LightBlend blend{4, weights::LightFit::mean, false};
  model::writeModel(
      model::makeModel(folder, {rig, cloud, visibility, DollBlocks::kWhite, DollBlocks::kTolerance, blend},
                       progress),
      progress);
}

} // namespace surflect::bench
