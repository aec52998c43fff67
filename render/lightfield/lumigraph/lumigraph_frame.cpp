#include "render/lightfield/lumigraph/lumigraph_frame.h"

#include "render/gl/context.h"
#include "render/gl/draw.h"
#include "render/gl/projection.h"
#include "render/lightfield/lumigraph/reconstruction.h"
#include "render/lightfield/lumigraph/shaders.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"
#include "surfel/math/bounds.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace surflect::lumigraph {

namespace {

// A camera in coordinates relative to a point.
capture::Camera<AcquisitionSpace> relativeTo(const Vec3<double>& origin,
                                             capture::Camera<AcquisitionSpace> camera) {
  const auto& pose = camera.cameraFromWorld;
  camera.cameraFromWorld = {pose.rotation(), pose.translation() + pose.rotation() * origin};
  return camera;
}

// Geometry and fringe in one mesh, the fringe last.
TriangleMesh joined(const Lumigraph& lumigraph, const Vec3<double>& origin) {
  TriangleMesh result = lumigraph.geometry.mesh;
  const auto shift = static_cast<uint32_t>(result.positions.size());
  result.positions.insert(result.positions.end(), lumigraph.geometry.fringe.positions.begin(),
                          lumigraph.geometry.fringe.positions.end());
  for (const auto& [a, b, c] : lumigraph.geometry.fringe.triangles)
    result.triangles.push_back({a + shift, b + shift, c + shift});
  for (auto& p : result.positions)
    p = assume<Point3<AcquisitionSpace>>(Vec3<double>(p.cast<double>().raw() - origin));
  return result;
}

gl::VertexArray vertexArrayOf(const TriangleMesh& joined, size_t geometryVertices) {
  std::vector<float> fringe(joined.positions.size(), 1);
  std::fill_n(fringe.begin(), geometryVertices, 0.f);
  const gl::VertexAttribute attribute{1, 1, std::as_bytes(std::span(fringe))};
  return gl::vertexArrayOf(joined, {&attribute, 1});
}

gl::Texture textureOf(const Lumigraph& lumigraph, size_t slab) {
  const Slab& shape = lumigraph.slabs[slab];
  gl::Texture texture({gl::Format::rgba16f, shape.width, shape.height, shape.nodes * shape.nodes});
  for (int j = 0; j < shape.nodes; ++j)
    for (int i = 0; i < shape.nodes; ++i)
      texture.upload(std::as_bytes(lumigraph.picture(slab, i, j)), shape.width, shape.height,
                     {.layer = i + j * shape.nodes});
  return texture;
}

void setSlabs(gl::Program& program, const Lumigraph& lumigraph, const Vec3<double>& middle) {
  const auto pair = [](double x, double y) {
    return Eigen::Vector2f(static_cast<float>(x), static_cast<float>(y));
  };
  for (size_t k = 0; k < kSlabs; ++k) {
    const Slab& slab = lumigraph.slabs[k];
    const auto name = [&](std::string array) {
      return array.append("[").append(std::to_string(k)).append("]");
    };
    const double u = middle[slab.uAxis()], v = middle[slab.vAxis()], n = middle[slab.axis];
    program.set(name("stPlane"), static_cast<float>(slab.stPlane - n));
    program.set(name("uvPlane"), static_cast<float>(slab.uvPlane - n));
    program.set(name("stLow"), pair(slab.stLow[0] - u, slab.stLow[1] - v));
    program.set(name("stSpacing"), pair(slab.stSpacing[0], slab.stSpacing[1]));
    program.set(name("uvLow"), pair(slab.uvLow[0] - u, slab.uvLow[1] - v));
    program.set(name("uvSize"), pair(slab.uvSpacing * slab.width, slab.uvSpacing * slab.height));
  }
  program.set("nodes", lumigraph.slabs[0].nodes);
  program.set("weightSlope",
              lumigraph.overlap > 0 ? static_cast<float>(weightSlope(lumigraph.overlap)) : 0.f);
  program.set("filledWeight", static_cast<float>(kFilledWeight));
  program.set("exactOutline", lumigraph.geometry.exactOutline ? 1 : 0);
}

// Range of depths of what is drawn.
gl::DepthRange rangeOf(const Eigen::AlignedBox3d& box, const capture::Camera<AcquisitionSpace>& camera) {
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();
  cameraFromWorld.linear() = camera.cameraFromWorld.rotation();
  cameraFromWorld.translation() = camera.cameraFromWorld.translation();
  return gl::depthRangeOf(box.transformed(cameraFromWorld));
}

} // namespace

LumigraphFrame::Target::Target(int width, int height)
    : color({gl::Format::rgba32f, width, height}), depth({gl::Format::depth32f, width, height}),
      framebuffer("lumigraph", {{&color}}, {&depth}) {}

LumigraphFrame::LumigraphFrame(const Lumigraph& lumigraph)
    : middle_(boundsOf(lumigraph.geometry.mesh.positions).center()),
      box_(boundsOf(joined(lumigraph, middle_).positions)),
      geometry_(vertexArrayOf(joined(lumigraph, middle_), lumigraph.geometry.mesh.positions.size())),
      depth_(kShaders, {"depth.vert", "depth.frag"}), shade_(kShaders, {"lumigraph.vert", "lumigraph.frag"}) {
  for (size_t k = 0; k < kSlabs; ++k) {
    pictures_.push_back(textureOf(lumigraph, k));
    textureBytes_ += std::span(lumigraph.texels[k]).size_bytes();
  }
  setSlabs(shade_, lumigraph, middle_);
}

image::Image LumigraphFrame::distances(const gl::DepthRange& range, const image::Image& color) const {
  image::Image result = target_->depth.read();
  for (size_t i = 0; i < result.values.size(); ++i) {
    // The geometry's depths are in the first half, the fringe's in the second (position.glsl).
    const double stored = static_cast<double>(result.values[i]),
                 depth = stored < 0.5 ? 2 * stored : 2 * stored - 1;
    const double distance = range.far * range.near / (range.far - depth * (range.far - range.near));
    result.values[i] =
        color.values[4 * i + 3] > 0 ? static_cast<float>(distance) : std::numeric_limits<float>::infinity();
  }
  return result;
}

LumigraphFrame::Picture LumigraphFrame::render(const capture::Camera<AcquisitionSpace>& camera,
                                               const Options& options, std::map<std::string, double>& seconds,
                                               const Progress& progress) {
  const int samples = options.samples;
  assert(samples >= 1);
  capture::Camera<AcquisitionSpace> sampled = relativeTo(middle_, camera);
  const int width = samples * camera.lens.width, height = samples * camera.lens.height;
  sampled.lens = capture::resized(camera.lens, width, height);
  const Eigen::Matrix4f clipFromObject = gl::clipFromWorld(sampled, box_);
  if (!target_ || target_->color.shape().width != width || target_->color.shape().height != height) {
    target_.reset();
    target_.emplace(width, height);
  }
  gl::Stopwatch stopwatch;
  const auto lap = [&](const char* stage) {
    seconds[stage] += stopwatch.seconds();
    stopwatch = {};
  };
  gl::Framebuffer& framebuffer = target_->framebuffer;
  framebuffer.clearColor(0, {0, 0, 0, 0});
  framebuffer.clearDepth();
  depth_.set("clipFromObject", clipFromObject);
  gl::SteppedDraws(depthStep_, progress)
      .draw({framebuffer,
             depth_,
             {},
             {.depth = gl::Compare::less, .writeDepth = true, .writeColor = {false, false, false, false}}},
            geometry_);
  lap("depth");
  shade_.set("clipFromObject", clipFromObject);
  shade_.set("viewerObject", Eigen::Vector3f(sampled.center().raw().cast<float>()));
  std::array<const gl::Texture*, kSlabs> pictures{};
  for (size_t k = 0; k < kSlabs; ++k) pictures[k] = &pictures_[k];
  gl::SteppedDraws(shadeStep_, progress)
      .draw({framebuffer, shade_, pictures, {.depth = gl::Compare::equal}}, geometry_);
  lap("shade");
  progress.checkpoint();
  const image::Image color = target_->color.read();
  progress.checkpoint();
  Picture picture{image::squareMeans(color, samples), {}};
  progress.checkpoint();
  if (options.depth) picture.depth = image::squareMinima(distances(rangeOf(box_, sampled), color), samples);
  lap("read");
  return picture;
}

} // namespace surflect::lumigraph
