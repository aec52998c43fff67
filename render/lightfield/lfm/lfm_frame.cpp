#include "render/lightfield/lfm/lfm_frame.h"

#include "render/gl/draw.h"
#include "render/lightfield/lfm/root_radiance.h"
#include "render/lightfield/lfm/shaders.h"
#include "surfel/base/stopwatch.h"
#include "surfel/math/bounds.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

Vec3<double> middleOfMesh(const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = boundsOf(mesh.positions);
  return box.isEmpty() ? Vec3<double>(0, 0, 0) : Vec3<double>(box.center());
}

// Three vertices for each triangle. Attributes: 0 position; 1 to 3 x axis, 4 to 6 y axis of the frames of the
// triangle's corners.
gl::VertexArray vertexArrayOf(const LightFieldMaps& maps, const Vec3<double>& middle) {
  std::array<std::vector<Vec3<float>>, 7> values;
  for (const auto& triangle : maps.mesh.triangles)
    for (const uint32_t vertex : triangle) {
      const Vec3<double> p = maps.mesh.positions[vertex].cast<double>().raw() - middle;
      values[0].push_back(p.cast<float>());
      for (size_t corner = 0; corner < 3; ++corner) {
        values[1 + corner].push_back(maps.frames[triangle[corner]].x.cast<float>());
        values[4 + corner].push_back(maps.frames[triangle[corner]].y.cast<float>());
      }
    }
  std::vector<gl::VertexAttribute> attributes;
  for (unsigned location = 0; location < values.size(); ++location)
    attributes.push_back({location, 3, std::as_bytes(std::span(values[location]))});
  return gl::VertexArray(attributes);
}

// Factor and summand that give the value of a texel as OpenGL reads it.
Eigen::Vector2f valueOf(Coding coding, bool isSigned) {
  // 8-bit textures are signed themselves; signed bytes of dxt1 are stored plus 128.
  return isSigned && coding == Coding::dxt1 ? Eigen::Vector2f(255.f / 127, -128.f / 127)
                                            : Eigen::Vector2f(1, 0);
}

Eigen::Isometry3d cameraFromCentred(const capture::Camera<AcquisitionSpace>& camera,
                                    const Vec3<double>& middle) {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  isometry.linear() = camera.cameraFromWorld.rotation();
  isometry.translation() = camera.cameraFromWorld.translation();
  return isometry * Eigen::Translation3d(middle);
}

// Distance along the viewing axis of a depth 0..1.
float distanceOf(float depth, const gl::DepthRange& range) {
  const double distance = range.far * range.near / (range.far - depth * (range.far - range.near));
  return static_cast<float>(distance);
}

} // namespace

FrameRenderer::Targets::Targets(gl::Format format, int width, int height)
    : color({format, width, height}), depth({gl::Format::depth32f, width, height}),
      framebuffer("light field maps", {{&color}}, {&depth}) {}

FrameRenderer::FrameRenderer(const LightFieldMaps& maps, const gl::Limits& limits)
    : middle_(middleOfMesh(maps.mesh)), boxCentred_(boundsOf(maps.mesh.positions).translated(-middle_)),
      isSigned_(maps.method == Method::pca), hasMean_(maps.mean.maps.count > 0), terms_(maps.terms.size()),
      textures_(maps, limits), mesh_(vertexArrayOf(maps, middle_)),
      depth_(kShaders, {"depth.vert", "depth.frag"}), maps_(kShaders, {"maps.vert", "maps.frag"}) {
  maps_.set("samples", maps.samples);
  maps_.set("viewSize", static_cast<float>(maps.viewSize));
  maps_.set("isPacked", maps.layout == SurfaceLayout::packed ? 1 : 0);
  const Coding none = Coding::bytes;
  maps_.set("surfaceValue", valueOf(terms_ ? maps.terms[0].surface.maps.coding : none, isSigned_));
  maps_.set("viewValue", valueOf(terms_ ? maps.terms[0].view.maps.coding : none, isSigned_));
  maps_.set("meanWhite", maps.meanWhite);
  maps_.set("termCount", static_cast<int>(terms_));
}

FrameRenderer::Targets& FrameRenderer::targetsOf(gl::Format format, int width, int height) {
  if (targets_) {
    const gl::TextureShape& shape = targets_->color.shape();
    if (shape.format == format && shape.width == width && shape.height == height) return *targets_;
    targets_.reset();
  }
  return targets_.emplace(format, width, height);
}

void FrameRenderer::setCamera(const capture::Camera<AcquisitionSpace>& camera, const gl::DepthRange& range) {
  const Eigen::Matrix4d clipFromCamera = gl::clipFromCamera(camera.lens, range);
  const Eigen::Matrix4f clipFromCentred =
      (clipFromCamera * cameraFromCentred(camera, middle_).matrix()).cast<float>();
  for (gl::Program* program : {&depth_, &maps_}) program->set("clipFromCentred", clipFromCentred);
  maps_.set("viewerCentred", Eigen::Vector3f((camera.center().raw() - middle_).cast<float>()));
}

Frame FrameRenderer::render(const capture::Camera<AcquisitionSpace>& camera, const FrameOptions& options) {
  const gl::DepthRange range =
      boxCentred_.isEmpty() ? gl::DepthRange{}
                            : gl::depthRangeOf(boxCentred_.transformed(cameraFromCentred(camera, middle_)));
  setCamera(camera, range); // refuses lenses that OpenGL does not have
  const bool isClamped = options.passes == Passes::clamped;
  Targets& targets =
      targetsOf(isClamped ? gl::Format::rgba8 : gl::Format::rgba32f, camera.lens.width, camera.lens.height);
  Frame frame;
  gl::Stopwatch stopwatch;
  const auto lap = [&] { return std::exchange(stopwatch, {}).seconds(); };
  targets.framebuffer.clearColor(0, {0, 0, 0, 0});
  targets.framebuffer.clearDepth();
  gl::draw({targets.framebuffer,
            depth_,
            {},
            {.depth = gl::Compare::less,
             .writeDepth = true,
             .writeColor = {false, false, false, false},
             .cull = gl::Cull::back}},
           mesh_);
  frame.stats.depthSeconds = lap();
  drawAll(options, frame.stats);
  frame.stats.drawSeconds = lap();

  frame.color = targets.color.read();
  frame.depth = targets.depth.read();
  const float white = isClamped ? static_cast<float>(options.white) : 1;
  for (size_t i = 0; i < frame.depth.values.size(); ++i) {
    float& depth = frame.depth.values[i];
    const bool isObject = depth < 1;
    for (size_t channel = 0; channel < 3; ++channel) {
      float& value = frame.color.values[4 * i + channel];
      value = isObject ? white * radianceOf(value) : 0.f;
    }
    frame.color.values[4 * i + 3] = isObject ? 1.f : 0.f;
    depth = isObject ? distanceOf(depth, range) : std::numeric_limits<float>::infinity();
  }
  frame.stats.readSeconds = lap();
  return frame;
}

void FrameRenderer::drawAll(const FrameOptions& options, FrameStats& stats) {
  const size_t terms = stats.terms = std::min(options.terms.value_or(terms_), terms_);
  const auto draw = [&](const Part& part, float factor, bool isSubtracted = false) {
    drawPart(part, factor, isSubtracted, options);
    ++stats.passes;
  };
  if (options.passes == Passes::single) return draw({hasMean_, 0, terms}, 1);
  const bool isClamped = options.passes == Passes::clamped;
  const float factor = isClamped ? static_cast<float>(1 / rootOf(options.white)) : 1;
  if (hasMean_) draw({true, 0, 0}, factor);
  for (size_t k = 0; k < terms; ++k) {
    draw({false, k, k + 1}, factor);
    if (isClamped && isSigned_) draw({false, k, k + 1}, -factor, true);
  }
}

void FrameRenderer::drawPart(const Part& part, float factor, bool isSubtracted, const FrameOptions& options) {
  maps_.set("withMean", part.withMean ? 1 : 0);
  maps_.set("firstTerm", static_cast<int>(part.first));
  maps_.set("endTerm", static_cast<int>(part.end));
  maps_.set("factor", factor);
  maps_.set("cutsNegative", options.passes == Passes::clamped ? 1 : 0);
  const std::array<const gl::Texture*, 4> textures{&textures_.surface(), &textures_.view(), &textures_.mean(),
                                                   &textures_.places()};
  gl::draw({targets_->framebuffer,
            maps_,
            textures,
            {.blend = {gl::Factor::one, gl::Factor::one,
                       isSubtracted ? gl::Equation::subtract : gl::Equation::add},
             .depth = gl::Compare::equal,
             .writeColor = {true, true, true, false},
             .cull = gl::Cull::back}},
           mesh_);
}

} // namespace surflect::lfm
