#include "render/lightfield/spherical/spherical_frame.h"

#include "render/gl/buffers.h"
#include "render/gl/draw.h"
#include "render/gl/projection.h"
#include "render/lightfield/spherical/reprojection.h"
#include "render/lightfield/spherical/shaders.h"
#include "render/lightfield/spherical/visible_pencils.h"
#include "srf/image/resize.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::spherical {

namespace {

int levelsOf(int size) { return std::bit_width(static_cast<unsigned>(size)); }

gl::TextureShape textureShape(gl::Format format, int size, size_t slots) {
  return {format, size, size, static_cast<int>(slots), levelsOf(size)};
}

Eigen::Matrix4f clipFromRay(const capture::Camera<AcquisitionSpace>& camera) {
  Eigen::Matrix4d rotation = Eigen::Matrix4d::Identity();
  rotation.topLeftCorner<3, 3>() = camera.cameraFromWorld.rotation();
  return (gl::clipFromCamera(camera.lens, {}) * rotation).cast<float>();
}

// Vertices of triangles, by attribute of pencils.vert.
struct Vertices {
  std::vector<float> rays, crossings, viewers, ranges;

  void push(const Vec3<double>& direction, const Vec3<double>& e, const Vec3<double>& w, double weight,
            uint32_t slot, const HeightRange& range) {
    for (const double value : {-direction[0], -direction[1], -direction[2]})
      rays.push_back(static_cast<float>(value));
    const double descent = -w[2];
    const Vec2<double> crossing = descent * atPlane(e, w);
    for (const double value : {crossing[0], crossing[1], descent, weight})
      crossings.push_back(static_cast<float>(value));
    for (const double value : {e[0], e[1], e[2]}) viewers.push_back(static_cast<float>(value));
    viewers.push_back(static_cast<float>(slot));
    for (const float value : {range.lowest, range.highest}) ranges.push_back(value);
  }
};

} // namespace

SphericalFrame::Target::Target(int width, int height)
    : color({gl::Format::rgba32f, width, height}), depth({gl::Format::r32f, width, height}),
      framebuffer("spherical", {{&color}, {&depth}}) {}

SphericalFrame::SphericalFrame(const DirectionTree& tree, const FieldShape& shape, size_t slots)
    : shape_(shape), ranges_(slots), colors_(textureShape(gl::Format::rgba16f, shape.size, slots)),
      heights_(textureShape(gl::Format::r32f, shape.size, slots)),
      program_(kShaders, {"pencils.vert", "pencils.frag"}), textureBytes_(slots * imageBytes(shape.size)) {
  for (ImageNumber image = 0; image < shape.images(); ++image) axes_.push_back(axesOf(tree.direction(image)));
}

void SphericalFrame::upload(uint32_t slot, const PencilImage& image) {
  ranges_[slot] = image.range;
  for (size_t level = 0; level < image.mips.size(); ++level) {
    const MipLevel& mip = image.mips[level];
    const gl::Place place{.layer = static_cast<int>(slot), .level = static_cast<int>(level)};
    colors_.upload(std::as_bytes(std::span(mip.colors)), mip.size, mip.size, place);
    heights_.upload(std::as_bytes(std::span(mip.heights)), mip.size, mip.size, place);
  }
}

void SphericalFrame::begin(const capture::Camera<AcquisitionSpace>& camera, const Look& look, int samples) {
  assert(samples >= 1);
  windowOf(camera, shape_.sphere); // refuses cameras
  samples_ = samples;
  camera_ = camera;
  const int width = samples * camera.lens.width, height = samples * camera.lens.height;
  camera_.lens = capture::resized(camera.lens, width, height);
  if (!target_ || target_->color.shape().width != width || target_->color.shape().height != height) {
    target_.reset();
    target_.emplace(width, height);
  }
  target_->framebuffer.clearColor(0, {0, 0, 0, 0});
  target_->framebuffer.clearColor(1, {0, 0, 0, 0});
  const double distance = (camera.center().raw() - shape_.sphere.middle).norm();
  const double focal = std::min(camera_.lens.focalX, camera_.lens.focalY);
  program_.set("clipFromRay", clipFromRay(camera_));
  program_.set(
      "mip", static_cast<float>(std::max(look.mip, mipFor(shape_.sphere, shape_.size, distance, 1 / focal))));
  program_.set("imageSize", static_cast<float>(shape_.size));
  program_.set("depthCorrected", look.depth ? 1 : 0);
}

void SphericalFrame::add(std::span<const TexturedTriangle> triangles) {
  Vertices vertices;
  const Vec3<double> viewer = camera_.center().raw();
  for (const TexturedTriangle& triangle : triangles) {
    const ImageAxes& axes = axes_[triangle.image];
    const Vec3<double> e = placeOf(shape_.sphere, axes, viewer);
    if (!(e[2] > 0)) continue; // the image plane is behind the viewer
    for (size_t i = 0; i < 3; ++i) {
      const Vec3<double>& corner = triangle.part.corners[i];
      vertices.push(corner, e, vectorOf(shape_.sphere, axes, -corner), triangle.part.weights[i],
                    triangle.slot, ranges_[triangle.slot]);
    }
  }
  if (vertices.rays.empty()) return;
  const auto bytes = [](const std::vector<float>& values) { return std::as_bytes(std::span(values)); };
  const std::array<gl::VertexAttribute, 4> attributes{{{0, 3, bytes(vertices.rays)},
                                                       {1, 4, bytes(vertices.crossings)},
                                                       {2, 4, bytes(vertices.viewers)},
                                                       {3, 2, bytes(vertices.ranges)}}};
  const gl::VertexArray mesh(attributes);
  const std::array<const gl::Texture*, 2> textures{&colors_, &heights_};
  gl::draw({target_->framebuffer,
            program_,
            textures,
            {.blend = {gl::Factor::one, gl::Factor::one, gl::Equation::add}}},
           mesh);
}

Picture SphericalFrame::read(bool depth) {
  const image::Image color = target_->color.read();
  Picture picture{image::squareMeans(color, samples_), {}};
  if (!depth) return picture;
  image::Image distances = target_->depth.read();
  for (size_t i = 0; i < distances.values.size(); ++i) {
    const float alpha = color.values[4 * i + 3];
    distances.values[i] = alpha > 0 ? distances.values[i] / alpha : std::numeric_limits<float>::infinity();
  }
  picture.depth = image::squareMinima(distances, samples_);
  return picture;
}

} // namespace surflect::spherical
