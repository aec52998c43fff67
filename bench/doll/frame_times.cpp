#include "bench/doll/frame_times.h"

#include "bench/doll/spiral.h"
#include "bench/plain_splats/slow_coverage.h"
#include "surfel/base/file.h"
#include "surfel/math/bounds.h"
#include "warp/deform.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include <fcntl.h>
#include <unistd.h>

namespace surflect::bench {

namespace {

// Pairs of pixel and surfel: the splatter does not store them, the plain one does.
size_t contributionsOf(const Shot& shot, const splat::Splats& splats) {
  size_t count = 0;
  for (const auto& tile : slow::rasterize(shot.camera, splats, shot.options.splats).tiles)
    count += tile.size();
  return count;
}

// The batch's queries under no light at all: what is left of planning is the choice of views.
model::QueryBatch unlit(const model::QueryBatch& batch) {
  model::QueryBatch dark;
  dark.surfels = batch.surfels;
  dark.towardsView = batch.towardsView;
  dark.environments.emplace_back(); // of no texel
  dark.acquisitionFromEnvironment.resize(batch.size());
  return dark;
}

// The part of planning that is the choice of views.
double viewShare(const model::Model& model, const model::QueryBatch& batch,
                 const model::ShadeOptions& options, int runs) {
  const model::QueryBatch dark = unlit(batch);
  const auto plan = [&](const model::QueryBatch& queries) {
    model::ShadingPlanner planner(model, queries, options);
    for (size_t begin = 0; begin < queries.size(); begin += model::kTargetsAtOnce)
      tbb::parallel_for(size_t{0},
                        planner.split(begin, std::min(queries.size(), begin + model::kTargetsAtOnce)),
                        [&](size_t i) { planner.plan(i); });
  };
  std::vector<Lap> lit, views;
  for (int i = 0; i < runs; ++i) {
    lit.push_back(lapOf([&] { plan(batch); }));
    views.push_back(lapOf([&] { plan(dark); }));
  }
  return std::min(1.0, timesOf(views).processor / timesOf(lit).processor);
}

} // namespace

Shot dollShot(const model::Model& model, int width, int height, size_t lights) {
  const Eigen::AlignedBox3d box = boundsOf(model.cloud.p0);
  const Vec3<double> middle = box.center(), up(0, 0, 1);
  const double side = box.sizes().maxCoeff(), distance = 4 * side;

  Shot shot;
  shot.warp = warp::twistWarp(up, Angle::fromDegrees(40 / side), middle);
  capture::Lens& lens = shot.camera.lens;
  lens.width = width;
  lens.height = height;
  lens.focalX = lens.focalY = 0.5 * std::min(width, height) * distance / (0.56 * side);
  lens.centerX = 0.5 * width;
  lens.centerY = 0.5 * height;
  const Vec3<double> backwards = Vec3<double>(0.35, -1, 0.25).normalized();
  const Vec3<double> right = up.cross(backwards).normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), backwards.cross(right).transpose(), backwards.transpose();
  shot.camera.cameraFromWorld = {rotation, -rotation * (middle + distance * backwards)};
  const double reach = 2.5 * side;
  const auto strength = static_cast<float>(1.5 * reach * reach / static_cast<double>(lights));
  for (const Vec3<double>& towards : spiral(lights, -0.2, 1)) {
    scene::ShotPointLight light;
    light.position = assume<Point3<ObjectSpace, double>>(middle + reach * towards);
    const Vec3<double> color = (Vec3<double>::Ones() + 0.5 * towards) * strength;
    light.intensity = {static_cast<float>(color[0]), static_cast<float>(color[1]),
                       static_cast<float>(color[2])};
    shot.lights.emplace_back(light);
  }
  shot.options.shade.cameras = 4;
  shot.options.shade.lights = 4;
  shot.options.shade.lightFit = ulr::LightFit::mean;
  shot.options.shade.foreshortened = false;
  return shot;
}

void forgetFiles(const model::Model& model) {
  for (const codec::ViewFile& file : model.files) {
    const int descriptor = openForReading(file.path());
    ::posix_fadvise(descriptor, 0, 0, POSIX_FADV_DONTNEED);
    ::close(descriptor);
  }
}

FrameTimer::FrameTimer(const model::Model& model, const Shot& shot, codec::BlockCache& cache, int runs)
    : model_(model), shot_(shot), cache_(cache) {
  surfels::FrameStats stats;
  firstSeconds_ = lapOf([&] { render(stats); }).seconds;
  counts_.surfels = model.cloud.size();
  counts_.drawn = stats.splats.drawn;
  counts_.visible = stats.visible;
  counts_.pixels =
      static_cast<size_t>(shot_.camera.lens.width) * static_cast<size_t>(shot_.camera.lens.height);
  counts_.views = model.rig.views.size();
  counts_.rigLights = model.rig.lights.size();
  for (const scene::ShotLight& light : shot_.lights)
    if (const auto* environment = std::get_if<scene::ShotEnvironment>(&light)) {
      ++counts_.environments;
      counts_.directions += environment->environment->lights.size();
    } else {
      ++counts_.lights;
    }
  counts_.pairs = stats.shading.operations;
  counts_.lookups = stats.shading.lookups;
  counts_.blocks = stats.shading.blocksRead;
  counts_.blockBytes = stats.shading.bytesRead;
  counts_.rank = static_cast<double>(stats.shading.taskRanks) / static_cast<double>(stats.shading.tasks);
  const DeformedCloud deformed = warp::deform(model.cloud, *shot_.warp);
  const splat::SplatRaster coverage =
      surfels::look(shot_.camera, model.cloud, deformed, shot_.options.splats);
  counts_.contributions = contributionsOf(shot_, splat::splatsOf(model.cloud, deformed));
  const model::QueryBatch batch =
      surfels::queriesAt(model.cloud, deformed, coverage.visible, shot_.camera, shot_.lights);
  ofViews_ = viewShare(model, batch, shot_.options.shade, runs);
}

void FrameTimer::render(surfels::FrameStats& stats) {
  memory_.film = surfels::renderFrame(model_, *shot_.warp, shot_.camera, shot_.lights, shot_.options, cache_,
                                      stats, {}, &memory_);
}

void FrameTimer::lap() {
  surfels::FrameStats stats;
  frames_.push_back(lapOf([&] { render(stats); }));
  for (const auto& [stage, seconds] : stats.seconds)
    ofStage_[stage].push_back({seconds, stats.processorSeconds.at(stage)});
}

FrameTimes FrameTimer::times() const {
  const auto part = [](const Times& times, double share) {
    return Times{share * times.best, share * times.median, share * times.processor};
  };
  const auto whole = [&](const char* stage) { return timesOf(ofStage_.find(stage)->second); };
  const Times ulr = whole("ulr");
  FrameTimes result;
  result.counts = counts_;
  result.firstSeconds = firstSeconds_;
  result.frame = timesOf(frames_);
  result.stages = {{"warp", whole("warp")},
                   {"splat", whole("splat")},
                   {"queries", whole("queries")},
                   {"camera ulr", part(ulr, ofViews_)},
                   {"light ulr", part(ulr, 1 - ofViews_)},
                   {"look-up", whole("look-up")},
                   {"develop", whole("develop")}};
  return result;
}

FrameTimes timeFrames(const model::Model& model, const Shot& shot, codec::BlockCache& cache,
                      size_t cacheBytes, int frames) {
  double coldSeconds = 0;
  {
    surfels::FrameStats stats;
    codec::BlockCache other(model.files, cacheBytes);
    forgetFiles(model);
    coldSeconds =
        lapOf([&] {
          surfels::renderFrame(model, *shot.warp, shot.camera, shot.lights, shot.options, other, stats);
        }).seconds;
  }
  FrameTimer timer(model, shot, cache, frames);
  for (int i = 0; i < frames; ++i) timer.lap();
  FrameTimes result = timer.times();
  result.coldSeconds = coldSeconds;
  return result;
}

} // namespace surflect::bench
