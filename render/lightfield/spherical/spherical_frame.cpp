#include "render/lightfield/spherical/spherical_frame.h"

#include "render/gl/buffers.h"
#include "render/gl/draw.h"
#include "render/gl/projection.h"
#include "render/lightfield/spherical/reprojection.h"
#include "render/lightfield/spherical/shaders.h"
#include "render/lightfield/spherical/visible_pencils.h"
#include "srf/image/resize.h"
#include "surfel/math/bounds.h"

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

// Matrix from column, row and 1 to the ray that goes one metre along the viewing axis, in diameters of the
// object's sphere along world axes.
Mat3<double> rayOfPixel(const capture::Camera<AcquisitionSpace>& camera, const Sphere& sphere) {
  const capture::Lens& lens = camera.lens;
  Mat3<double> inCamera;
  inCamera << 1 / lens.focalX, 0, -lens.centerX / lens.focalX, //
      0, -1 / lens.focalY, lens.centerY / lens.focalY,         //
      0, 0, -1;
  return camera.cameraFromWorld.rotation().transpose() * inCamera / (2 * sphere.radius);
}

// Corners of all triangles in rows, in diameters of the sphere from its middle.
gl::Texture cornersOf(const TriangleMesh& mesh, const Sphere& sphere) {
  constexpr int kRow = 3 * 1024;
  const auto count = static_cast<int>(3 * mesh.triangles.size());
  image::Image corners(kRow, (count + kRow - 1) / kRow, 4);
  for (int i = 0; i < count; ++i) {
    const uint32_t vertex = mesh.triangles[static_cast<size_t>(i / 3)][static_cast<size_t>(i % 3)];
    const Vec3<double> corner =
        (mesh.positions[vertex].raw().cast<double>() - sphere.middle) / (2 * sphere.radius);
    for (int axis = 0; axis < 3; ++axis)
      corners.at(i % kRow, i / kRow)[static_cast<size_t>(axis)] = static_cast<float>(corner[axis]);
  }
  return gl::textureOf(gl::Format::rgba32f, corners, gl::Filter::nearest);
}

// A mesh whose triangles have their numbers at their last corners, for flat inputs of shaders; vertices that
// are last already are repeated. With gl_PrimitiveID instead, Mesa's software renderer is slow.
gl::VertexArray numberedTriangles(const TriangleMesh& mesh) {
  constexpr float kNone = -1;
  std::vector<std::array<float, 4>> vertices;
  std::vector<uint32_t> indices;
  for (const auto& p : mesh.positions) vertices.push_back({p.raw().x(), p.raw().y(), p.raw().z(), kNone});
  for (size_t number = 0; number < mesh.triangles.size(); ++number) {
    const auto& triangle = mesh.triangles[number];
    const auto* const free =
        std::ranges::find_if(triangle, [&](uint32_t vertex) { return vertices[vertex][3] == kNone; });
    const size_t last = free != triangle.end() ? static_cast<size_t>(free - triangle.begin()) : 2;
    uint32_t vertex = triangle[last];
    if (free == triangle.end()) {
      vertex = static_cast<uint32_t>(vertices.size());
      vertices.push_back(vertices[triangle[last]]);
    }
    vertices[vertex][3] = static_cast<float>(number);
    indices.insert(indices.end(), {triangle[(last + 1) % 3], triangle[(last + 2) % 3], vertex});
  }
  const gl::VertexAttribute attribute{0, 4, std::as_bytes(std::span(vertices))};
  return gl::VertexArray({&attribute, 1}, indices);
}

// Vertices of triangles, by attribute of pencils.vert.
struct Vertices {
  std::vector<float> rays, rights, ups, viewers;

  void push(const WeightedTriangle& part, size_t corner, const ImageAxes& axes, uint32_t slot,
            const Vec3<double>& e) {
    append(rays, -part.corners[corner]);
    rays.push_back(static_cast<float>(part.weights[corner]));
    append(rights, axes.u);
    rights.push_back(static_cast<float>(slot));
    append(ups, axes.v);
    append(viewers, e);
  }
  static void append(std::vector<float>& values, const Vec3<double>& vector) {
    for (const double value : vector) values.push_back(static_cast<float>(value));
  }
};

} // namespace

SphericalFrame::Sums::Sums(const gl::Texture& depth)
    : color({gl::Format::rgba32f, depth.shape().width, depth.shape().height}),
      weightOrDepth({gl::Format::r32f, depth.shape().width, depth.shape().height}),
      framebuffer("spherical", {{&color}, {&weightOrDepth}}, {&depth}) {}

SphericalFrame::Target::Target(int width, int height)
    : surface({gl::Format::rgba32f, width, height}), surfaceDepth({gl::Format::depth32f, width, height}),
      surfaceFramebuffer("surface of a spherical light field", {{&surface}}, {&surfaceDepth}),
      levels{Sums(surfaceDepth), Sums(surfaceDepth)} {}

SphericalFrame::SphericalFrame(const DirectionTree& tree, const FieldShape& shape, size_t slots,
                               const TriangleMesh& surface)
    : shape_(shape), colors_(textureShape(gl::Format::rgba16f, shape.size, slots)),
      heights_(textureShape(gl::Format::r32f, shape.size, slots)),
      program_(kShaders, {"pencils.vert", "pencils.frag"}),
      surfaceProgram_(kShaders, {"surface.vert", "surface.frag"}),
      textureBytes_(slots * imageBytes(shape.size)) {
  for (ImageNumber image = 0; image < shape.images(); ++image) axes_.push_back(axesOf(tree.direction(image)));
  if (!surface.triangles.empty())
    surface_ =
        Surface{numberedTriangles(surface), cornersOf(surface, shape.sphere), boundsOf(surface.positions)};
}

void SphericalFrame::upload(uint32_t slot, const PencilImage& image) {
  for (size_t level = 0; level < image.mips.size(); ++level) {
    const MipLevel& mip = image.mips[level];
    const gl::Place place{.layer = static_cast<int>(slot), .level = static_cast<int>(level)};
    colors_.upload(std::as_bytes(std::span(mip.colors)), mip.size, mip.size, place);
    heights_.upload(std::as_bytes(std::span(mip.heights)), mip.size, mip.size, place);
  }
}

void SphericalFrame::begin(const capture::Camera<AcquisitionSpace>& camera, const Look& look, int samples,
                           const Progress& progress) {
  assert(samples >= 1);
  windowOf(camera, shape_.sphere); // refuses cameras
  samples_ = samples;
  camera_ = camera;
  const int width = samples * camera.lens.width, height = samples * camera.lens.height;
  camera_.lens = capture::resized(camera.lens, width, height);
  if (!target_ || target_->surface.shape().width != width || target_->surface.shape().height != height) {
    target_.reset();
    target_.emplace(width, height);
  }
  shares_ = levelShares(look.detail, shape_.levels);
  for (size_t level = 0; level < shares_.size(); ++level)
    for (const unsigned attachment : {0u, 1u})
      target_->levels[level].framebuffer.clearColor(attachment, {0, 0, 0, 0});
  showsSurface_ = look.depth;
  if (showsSurface_) drawSurface(progress);
  const double distance = (camera.center().raw() - shape_.sphere.middle).norm();
  const double focal = std::min(camera_.lens.focalX, camera_.lens.focalY);
  const double mip =
      std::max(look.mip, look.coarser + mipFor(shape_.sphere, shape_.size, distance, 1 / focal));
  program_.set("clipFromRay", clipFromRay(camera_));
  program_.set("rayOfPixel", Eigen::Matrix3f(rayOfPixel(camera_, shape_.sphere).cast<float>()));
  program_.set("mip", static_cast<float>(mip));
  program_.set("texel", static_cast<float>(std::exp2(mip) / shape_.size));
  program_.set("depthCorrected", look.depth ? 1 : 0);
}

void SphericalFrame::drawSurface(const Progress& progress) {
  target_->surfaceFramebuffer.clearColor(0, {0, 0, 0, 0});
  target_->surfaceFramebuffer.clearDepth();
  if (!surface_) return;
  const double diameter = 2 * shape_.sphere.radius;
  const Vec3<double> viewer = (camera_.center().raw() - shape_.sphere.middle) / diameter;
  const Vec3<double> axis = -diameter * camera_.cameraFromWorld.rotation().row(2).transpose();
  surfaceProgram_.set("clipFromWorld", gl::clipFromWorld(camera_, surface_->box));
  surfaceProgram_.set("viewer", Eigen::Vector3f(viewer.cast<float>()));
  surfaceProgram_.set("rayOfPixel", Eigen::Matrix3f(rayOfPixel(camera_, shape_.sphere).cast<float>()));
  surfaceProgram_.set("axis", Eigen::Vector3f(axis.cast<float>()));
  const gl::Texture* const corners = &surface_->corners;
  gl::SteppedDraws(surfaceStep_, progress)
      .draw({target_->surfaceFramebuffer,
             surfaceProgram_,
             {&corners, 1},
             {.depth = gl::Compare::less, .writeDepth = true}},
            surface_->triangles);
}

void SphericalFrame::add(std::span<const TexturedTriangle> triangles, const Progress& progress) {
  for (size_t level = 0; level < shares_.size(); ++level) addLevel(triangles, level, progress);
}

void SphericalFrame::addLevel(std::span<const TexturedTriangle> triangles, size_t level,
                              const Progress& progress) {
  Vertices vertices;
  const Vec3<double> viewer = camera_.center().raw();
  for (const TexturedTriangle& triangle : triangles) {
    if (triangle.part.pencil.level != shares_[level].level) continue;
    const ImageAxes& axes = axes_[triangle.image];
    const Vec3<double> e = placeOf(shape_.sphere, axes, viewer);
    if (!showsSurface_ && !(e[2] > 0)) continue; // the image plane is behind the viewer
    for (size_t i = 0; i < 3; ++i) vertices.push(triangle.part, i, axes, triangle.slot, e);
  }
  if (vertices.rays.empty()) return;
  const auto bytes = [](const std::vector<float>& values) { return std::as_bytes(std::span(values)); };
  const std::array<gl::VertexAttribute, 4> attributes{{{0, 4, bytes(vertices.rays)},
                                                       {1, 4, bytes(vertices.rights)},
                                                       {2, 3, bytes(vertices.ups)},
                                                       {3, 3, bytes(vertices.viewers)}}};
  const gl::VertexArray mesh(attributes);
  const std::array<const gl::Texture*, 3> textures{&colors_, &heights_, &target_->surface};
  gl::SteppedDraws(pencilStep_, progress)
      .draw({target_->levels[level].framebuffer,
             program_,
             textures,
             {.blend = {gl::Factor::one, gl::Factor::one, gl::Equation::add},
              .depth = showsSurface_ ? gl::Compare::greater : gl::Compare::always}}, // on the object alone
            mesh);
}

Picture SphericalFrame::read(bool depth, const Progress& progress) {
  const gl::TextureShape& shape = target_->surface.shape();
  image::Image color(shape.width, shape.height, 4), distances(shape.width, shape.height, 1);
  const size_t pixels = distances.values.size();
  for (size_t level = 0; level < shares_.size(); ++level) {
    progress.checkpoint();
    const image::Image sums = target_->levels[level].color.read();
    if (!showsSurface_ && !depth) {
      for (size_t i = 0; i < sums.values.size(); ++i) color.values[i] += sums.values[i];
      continue;
    }
    progress.checkpoint();
    const image::Image others = target_->levels[level].weightOrDepth.read();
    for (size_t i = 0; i < pixels; ++i) {
      progress.checkNowAndThen(i);
      const float sum = others.values[i];
      const float factor = !showsSurface_ ? 1 : sum > 0 ? static_cast<float>(shares_[level].weight) / sum : 0;
      for (size_t channel = 4 * i; channel < 4 * i + 4; ++channel)
        color.values[channel] += factor * sums.values[channel];
      if (!showsSurface_) distances.values[i] += sum;
    }
  }
  progress.checkpoint();
  Picture picture{image::squareMeans(color, samples_), {}};
  if (!depth) return picture;
  progress.checkpoint();
  const image::Image surface = showsSurface_ ? target_->surface.read() : image::Image();
  for (size_t i = 0; i < pixels; ++i) {
    progress.checkNowAndThen(i);
    const float alpha = color.values[4 * i + 3];
    float& distance = distances.values[i];
    if (!(alpha > 0))
      distance = std::numeric_limits<float>::infinity();
    else
      distance = showsSurface_ ? surface.values[4 * i + 3] : distance / alpha;
  }
  progress.checkpoint();
  picture.depth = image::squareMinima(distances, samples_);
  return picture;
}

} // namespace surflect::spherical
