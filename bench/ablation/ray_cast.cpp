#include "bench/ablation/ray_cast.h"

#include "srf/ulr/visibility_weights.h"
#include "surfel/geometry/smooth_normals.h"

#include <tbb/parallel_for.h>

namespace surflect::bench {

namespace {

std::vector<capture::Camera<AcquisitionSpace>> camerasOf(const model::Model& model) {
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const capture::View& view : model.rig.views) cameras.push_back(view.camera);
  return cameras;
}

} // namespace

struct RayCastSurface::Scene {
  const model::Model& model;
  const TriangleMesh& mesh;
  const warp::Warp& warp;
  RayCaster<ObjectSpace> deformed;
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  ulr::SmoothedVisibility visibility;
  SmoothNormals normals;

  Scene(const model::Model& from, const TriangleMesh& rest, const warp::Warp& bent, const Progress& progress)
      : model(from), mesh(rest), warp(bent), deformed(warp::deform(rest, bent), progress),
        cameras(camerasOf(from)),
        visibility(
            from.cloud, cameras,
            ulr::lineOfSight(from.cloud, cameras, RayCaster<AcquisitionSpace>(rest, progress), progress),
            ulr::visibilityRadius(from.cloud), progress),
        normals(rest, progress) {}

  // Where on the mesh at rest a ray meets the deformed one.
  void append(const RayCaster<ObjectSpace>::Hit& hit, SurfelCloud& cloud) const {
    const auto& [a, b, c] = mesh.triangles[hit.triangle];
    const Vec3<double> p = (1 - hit.b - hit.c) * mesh.positions[a].cast<double>().raw() +
                           hit.b * mesh.positions[b].cast<double>().raw() +
                           hit.c * mesh.positions[c].cast<double>().raw();
    const Vec3<double> normal = normals.at(hit.triangle, p);
    cloud.p0.push_back(assume<Point3<AcquisitionSpace, double>>(p).cast<float>());
    cloud.r0.push_back(rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(normal)));
  }

  ulr::VisibilityWeights fadesAt(const SurfelCloud& cloud) const {
    ulr::VisibilityWeights fades{cameras.size(), std::vector<uint8_t>(cloud.size() * cameras.size())};
    const std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints(cameras.begin(), cameras.end());
    tbb::parallel_for(size_t{0}, cloud.size(), [&](size_t i) {
      std::vector<float> open(cameras.size());
      const auto n = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(cloud.r0[i]).col(2));
      visibility.at(cloud.p0[i], n, open);
      for (size_t view = 0; view < cameras.size(); ++view)
        fades.values[i * cameras.size() + view] = ulr::VisibilityWeights::encode(ulr::visibilityWeight(
            cameras[view], viewpoints[view], cloud.p0[i], n, static_cast<double>(open[view])));
    });
    return fades;
  }
};

RayCastSurface::RayCastSurface(const model::Model& model, const TriangleMesh& mesh, const warp::Warp& warp,
                               const Progress& progress)
    : scene_(std::make_unique<const Scene>(model, mesh, warp, progress)) {}

RayCastSurface::~RayCastSurface() = default;

std::function<image::Image(std::span<const scene::ShotLight>)>
RayCastSurface::view(const capture::Camera<ObjectSpace>& camera, int raysAcross,
                     const model::ShadeOptions& options, codec::BlockCache& cache,
                     const Progress& progress) const {
  // The model as it would be with a surfel where each ray meets the mesh.
  auto model = std::make_shared<model::Model>();
  model->folder = scene_->model.folder;
  model->rig = scene_->model.rig;
  model->columns = scene_->model.columns;
  model->lightBlend = scene_->model.lightBlend;
  model->isFullProduct = scene_->model.isFullProduct;
  std::vector<size_t> pixels; // of each surfel
  const auto objectFromCamera = camera.cameraFromWorld.inverse();
  for (int y = 0; y < camera.lens.height; ++y)
    for (int x = 0; x < camera.lens.width; ++x)
      for (int s = 0; s < raysAcross * raysAcross; ++s) {
        const auto ray = capture::rayThrough(
            camera.lens, {x + (s % raysAcross + 0.5) / raysAcross, y + (s / raysAcross + 0.5) / raysAcross});
        if (!ray) continue;
        const auto hit =
            scene_->deformed.firstHit(objectFromCamera(ray->origin), objectFromCamera(ray->direction));
        if (!hit) continue;
        scene_->append(*hit, model->cloud);
        pixels.push_back(static_cast<size_t>(y) * static_cast<size_t>(camera.lens.width) +
                         static_cast<size_t>(x));
      }
  model->fades = scene_->fadesAt(model->cloud);
  const DeformedCloud deformed = warp::deform(model->cloud, scene_->warp, progress);
  std::vector<uint32_t> alive;
  for (uint32_t i = 0; i < deformed.size(); ++i)
    if (deformed.handedness[i] != Handedness::dead) alive.push_back(i);

  return [=, &cache](std::span<const scene::ShotLight> lights) {
    const model::QueryBatch batch =
        surfels::queriesAt(model->cloud, deformed, alive, camera, lights, progress);
    codec::ShadingStats stats;
    const auto radiance = model::shade(*model, batch, options, cache, stats, progress).radiance;
    image::Image image(camera.lens.width, camera.lens.height, 4);
    const float share = 1 / static_cast<float>(raysAcross * raysAcross);
    for (size_t i = 0; i < alive.size(); ++i) {
      float* pixel = &image.values[4 * pixels[alive[i]]];
      const Rgb shared = share * radiance[i];
      pixel[0] += shared.r;
      pixel[1] += shared.g;
      pixel[2] += shared.b;
      pixel[3] += share;
    }
    return image;
  };
}

} // namespace surflect::bench
