#include "render/lightfield/slf/slf_frame.h"

#include "render/gl/draw.h"
#include "render/lightfield/slf/shaders.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"
#include "surfel/math/bounds.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>
#include <utility>

namespace surflect::slf {

namespace {

Vec3<double> middleOfField(const Field& field) {
  const Eigen::AlignedBox3d box = boundsOf(field.mesh.positions);
  return box.isEmpty() ? Vec3<double>(0, 0, 0) : Vec3<double>(box.center());
}

// Vertices of all charts, one after the other: those on borders occur in several.
gl::VertexArray meshOf(const Field& field, const Vec3<double>& middle, std::vector<gl::Range>& parts) {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 2>> texels;
  std::vector<uint32_t> indices;
  for (const Region& region : field.regions) {
    const Chart& chart = region.chart;
    const auto first = static_cast<uint32_t>(positions.size());
    parts.push_back({indices.size(), 3 * chart.triangles.size()});
    for (size_t i = 0; i < chart.vertices.size(); ++i) {
      const Vec3<float> p =
          (field.mesh.positions[chart.vertices[i]].cast<double>().raw() - middle).cast<float>();
      positions.push_back({p.x(), p.y(), p.z()});
      texels.push_back({chart.coordinates[i].x() * static_cast<float>(chart.width),
                        chart.coordinates[i].y() * static_cast<float>(chart.height)});
    }
    for (const auto& triangle : chart.triangles)
      for (const uint32_t corner : triangle) indices.push_back(first + corner);
  }
  const std::array attributes{gl::VertexAttribute{0, 3, std::as_bytes(std::span(positions))},
                              gl::VertexAttribute{1, 2, std::as_bytes(std::span(texels))}};
  return gl::VertexArray(attributes, indices);
}

} // namespace

Mat3<double> hatRows(const DirectionMesh& mesh, size_t triangle) {
  Mat3<double> corners;
  for (int corner = 0; corner < 3; ++corner)
    corners.col(corner) = mesh.directions()[mesh.triangles()[triangle][static_cast<size_t>(corner)]].raw();
  return corners.inverse();
}

FieldBuffers::FieldBuffers(const Field& field)
    : middle_(middleOfField(field)), boxCentred_(boundsOf(field.mesh.positions).translated(-middle_)),
      mesh_(meshOf(field, middle_, parts_)) {
  for (const DirectionMesh& mesh : field.directionMeshes) {
    auto& corners = corners_.emplace_back();
    auto& rows = rows_.emplace_back();
    for (size_t t = 0; t < mesh.triangles().size(); ++t) {
      const Mat3<float> inverse = hatRows(mesh, t).cast<float>();
      for (size_t c = 0; c < 3; ++c) {
        const uint32_t direction = mesh.triangles()[t][c];
        const Vec3<float> r = mesh.directions()[direction].cast<float>().raw();
        corners.emplace_back(r.x(), r.y(), r.z(), static_cast<float>(direction));
        const auto row = inverse.row(static_cast<Eigen::Index>(c));
        rows.emplace_back(row[0], row[1], row[2], 0.f);
      }
    }
    float longest = 0;
    for (const Eigen::Vector4f& row : rows) longest = std::max(longest, row.norm());
    sureHats_.push_back(1e-6f * longest);
    gl::Texture& texture = rowTextures_.emplace_back(gl::TextureShape{
        gl::Format::rgba32f, 3, static_cast<int>(mesh.triangles().size()), 0, 1, gl::Filter::nearest});
    texture.upload(std::as_bytes(std::span(rows)), 3, texture.shape().height);
  }
}

namespace {

constexpr size_t kBasisTriangles = 16; // of a draw, as in basis.glsl
constexpr size_t kFusedTriangles = 48; // as in fused.frag

Eigen::Isometry3d isometryOf(const Rigid<CameraSpace, AcquisitionSpace>& rigid) {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  isometry.linear() = rigid.rotation();
  isometry.translation() = rigid.translation();
  return isometry;
}

// Places the corners of the direction mesh around the camera, all in the middle of the depth range, so that
// neither near nor far plane cuts them.
Eigen::Matrix4f clipFromDirection(const Eigen::Matrix4d& clipFromCamera, const Mat3<double>& rotation) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Zero();
  matrix.leftCols<3>() = clipFromCamera.leftCols<3>() * rotation;
  matrix.row(2) = 0.5 * matrix.row(3);
  return matrix.cast<float>();
}

// Distance along the viewing axis of a depth 0..1.
float distanceOf(float depth, const gl::DepthRange& range) {
  const double distance = range.far * range.near / (range.far - depth * (range.far - range.near));
  return static_cast<float>(distance);
}

// Whether texel.glsl declares kMostArrays, by a single digit: units after these belong to other textures.
constexpr bool declaresMostArrays() {
  constexpr std::string_view kStart = "const int kArrays = ";
  for (const gl::ShaderFile& file : kShaders) {
    const std::string_view text(file.text);
    if (const size_t at = text.find(kStart); at != std::string_view::npos)
      return text[at + kStart.size()] == '0' + static_cast<int>(kMostArrays) &&
             text[at + kStart.size() + 1] == ';';
  }
  return false;
}
static_assert(declaresMostArrays());

} // namespace

FrameRenderer::Targets::Targets(int width, int height)
    : color({gl::Format::rgba32f, width, height}), observed({gl::Format::rgba32f, width, height}),
      depth({gl::Format::depth32f, width, height}), frame("frame", {{&color}}, {&depth}),
      frameWithObserved("frame", {{&color}, {&observed}}, {&depth}) {}

FrameRenderer::FrameRenderer(const Field& field, const Textures& textures, const SlotOptions& options,
                             const gl::Limits& limits)
    : field_(&field), buffers_(field), slots_(field, textures, options, limits), planner_(field),
      depth_(kShaders, {"depth.vert", "depth.frag"}), basis_(kShaders, {"basis.vert", "basis.frag"}),
      gouraud_(kShaders, {"gouraud.vert", "gouraud.frag"}), region_(kShaders, {"region.vert", "region.frag"}),
      fused_(kShaders, {"fused.vert", "fused.frag"}) {
  const SlotShape& shape = slots_.shape();
  for (gl::Program* program : {&region_, &fused_}) {
    program->set("slotTexelSize",
                 Eigen::Vector2f(1 / static_cast<float>(shape.width), 1 / static_cast<float>(shape.height)));
    program->set("slotLayers", static_cast<int>(shape.layers));
  }
}

FrameRenderer::Targets& FrameRenderer::targetsOf(int width, int height) {
  if (!targets_ || targets_->frame.width() != width || targets_->frame.height() != height)
    targets_.emplace(width, height);
  return *targets_;
}

void FrameRenderer::setCamera(const capture::Camera<AcquisitionSpace>& camera, const gl::DepthRange& range) {
  const Eigen::Matrix4d clipFromCamera = gl::clipFromCamera(camera.lens, range);
  const Eigen::Isometry3d cameraFromCentred =
      isometryOf(camera.cameraFromWorld) * Eigen::Translation3d(buffers_.middle());
  const Eigen::Matrix4f clipFromCentred = (clipFromCamera * cameraFromCentred.matrix()).cast<float>();
  for (gl::Program* program : {&depth_, &region_, &fused_}) program->set("clipFromCentred", clipFromCentred);
  const Eigen::Matrix4f aroundCamera = clipFromDirection(clipFromCamera, camera.cameraFromWorld.rotation());
  for (gl::Program* program : {&basis_, &gouraud_}) program->set("clipFromDirection", aroundCamera);
  fused_.set("viewerCentred", Eigen::Vector3f((camera.center().raw() - buffers_.middle()).cast<float>()));
}

// Draws of a plan in order. In the fused method as many direction triangles at once as the shader and a group
// of slots hold.
std::vector<FrameRenderer::Draw> FrameRenderer::drawsOf(const PassPlan& plan, Stages method) const {
  std::vector<Draw> draws;
  for (const RegionPasses& passes : plan.regions) {
    if (method == Stages::twoStages) {
      for (const uint32_t direction : passes.directions) draws.push_back({&passes, {direction}, {}});
      continue;
    }
    const DirectionMesh& mesh = field_->directionsOf(passes.region);
    const std::span<const uint32_t> triangles(passes.triangles);
    for (size_t first = 0; first < triangles.size();) {
      std::vector<uint32_t> directions;
      size_t count = 0;
      for (; count < kFusedTriangles && first + count < triangles.size(); ++count) {
        std::vector<uint32_t> more = directions;
        for (const uint32_t corner : mesh.triangles()[triangles[first + count]])
          if (std::ranges::find(more, corner) == more.end()) more.push_back(corner);
        if (more.size() > slots_.groupSize()) break;
        directions = std::move(more);
      }
      draws.push_back({&passes, std::move(directions), triangles.subspan(first, count)});
      first += count;
    }
  }
  return draws;
}

Frame FrameRenderer::render(const capture::Camera<AcquisitionSpace>& camera, const FrameOptions& options,
                            const Progress& progress) {
  const Eigen::AlignedBox3d& box = buffers_.boxCentred();
  const gl::DepthRange range =
      box.isEmpty() ? gl::DepthRange{}
                    : gl::depthRangeOf(box.transformed(isometryOf(camera.cameraFromWorld) *
                                                       Eigen::Translation3d(buffers_.middle())));
  setCamera(camera, range); // refuses lenses that OpenGL does not have

  FrameOptions used = options;
  if (used.basis == Basis::gouraud) used.method = Stages::twoStages;
  FrameStats stats;
  const Stopwatch planning;
  const PassPlan plan = planner_.plan(camera, used.plan);
  const std::vector<Draw> draws = drawsOf(plan, used.method);
  stats.regions = plan.regions.size();
  stats.passes = plan.passes();
  stats.allPasses = field_->textures();
  std::vector<uint32_t> needed;
  for (const RegionPasses& passes : plan.regions) {
    for (const uint32_t direction : passes.directions)
      needed.push_back(slots_.numberOf(passes.region, direction));
  }
  slots_.beginFrame(needed);
  stats.planSeconds = planning.seconds();

  Targets& targets = targetsOf(camera.lens.width, camera.lens.height);
  const gl::Stopwatch drawing;
  const bool twoTargets = used.observed && used.method == Stages::twoStages;
  gl::Framebuffer& target = twoTargets ? targets.frameWithObserved : targets.frame;
  for (size_t attachment = 0; attachment < (twoTargets ? 2 : 1); ++attachment)
    target.clearColor(attachment, {0, 0, 0, 0});
  target.clearDepth();
  drawDepth(target, progress);
  try {
    stats.triangles = drawAll(draws, target, used, progress);
  } catch (...) {
    slots_.forget();
    throw;
  }
  stats.textures = slots_.counts();
  stats.drawSeconds = drawing.seconds() - stats.textures.seconds;

  const Stopwatch reading;
  Frame frame = read(targets, range, used, progress);
  stats.readSeconds = reading.seconds();
  frame.stats = stats;
  return frame;
}

size_t FrameRenderer::drawAll(std::span<const Draw> draws, gl::Framebuffer& target,
                              const FrameOptions& options, const Progress& progress) {
  size_t triangles = 0;
  gl::SteppedDraws stepped(regionStep_, progress);
  // Uploads into textures that draws use are slow, so draws wait until a slot must be replaced.
  std::vector<PlacedDraw> waiting;
  std::vector<bool> isWaited(slots_.shape().count); // by slot
  const auto drawWaiting = [&] {
    for (const PlacedDraw& placed : waiting) drawPlaced(placed, target, options, stepped);
    waiting.clear();
    isWaited.assign(isWaited.size(), false);
  };
  for (const Draw& draw : draws) {
    progress.checkpoint();
    TextureSlots::Group group = slots_.place(draw.passes->region, draw.directions);
    if (std::ranges::any_of(group.places,
                            [&](const auto& place) { return !place.isHit && isWaited[place.slot]; }))
      drawWaiting();
    slots_.upload(group);
    for (const auto& place : group.places) isWaited[place.slot] = true;
    waiting.push_back({draw, std::move(group)});
    triangles += buffers_.partOf(draw.passes->region).count / 3;
  }
  drawWaiting();
  return triangles;
}

void FrameRenderer::drawDepth(gl::Framebuffer& target, const Progress& progress) {
  gl::SteppedDraws(depthStep_, progress)
      .draw({target,
             depth_,
             {},
             {.depth = gl::Compare::less,
              .writeDepth = true,
              .writeColor = {false, false, false, false},
              .cull = gl::Cull::back}},
            buffers_.mesh());
}

void FrameRenderer::drawPlaced(const PlacedDraw& placed, gl::Framebuffer& target, const FrameOptions& options,
                               gl::SteppedDraws& stepped) {
  if (options.method == Stages::fused) return drawFused(placed, target, stepped);
  if (options.basisStage) drawBasis(placed.draw, target, options);
  if (options.regionStage) drawRegion(placed, target, stepped);
}

// Writes the hat function into alpha; 0 at triangles that are drawn, but not at the direction.
void FrameRenderer::drawBasis(const Draw& draw, gl::Framebuffer& target, const FrameOptions& options) {
  constexpr std::array<bool, 4> kAlpha{false, false, false, true};
  const uint32_t direction = draw.directions.front();
  const DirectionMesh& mesh = field_->directionsOf(draw.passes->region);
  std::vector<uint32_t> triangles = draw.passes->triangles;
  if (!options.visitedTriangles) {
    triangles = upTo(mesh.triangles().size());
    std::erase_if(triangles, [&](uint32_t t) {
      return std::ranges::find(mesh.triangles()[t], direction) == mesh.triangles()[t].end();
    });
    for (size_t attachment = 0; attachment < (options.observed ? 2 : 1); ++attachment)
      target.clearColor(attachment, {0, 0, 0, 0}, draw.passes->scissor, kAlpha);
  }
  gl::Program& program = options.basis == Basis::gouraud ? gouraud_ : basis_;
  program.set("direction", static_cast<float>(direction));
  const auto corners = buffers_.corners(field_->regions[draw.passes->region].directionMesh);
  for (size_t first = 0; first < triangles.size(); first += kBasisTriangles) {
    const size_t count = std::min(kBasisTriangles, triangles.size() - first);
    std::vector<Eigen::Vector4f> drawn;
    for (size_t t = first; t < first + count; ++t)
      for (size_t corner = 0; corner < 3; ++corner) drawn.push_back(corners[3 * triangles[t] + corner]);
    program.set("corners[0]", drawn);
    gl::draw({target, program, {}, {.writeColor = kAlpha, .scissor = draw.passes->scissor}}, cornersOnly_,
             {0, 3 * count});
  }
}

void FrameRenderer::drawRegion(const PlacedDraw& placed, gl::Framebuffer& target, gl::SteppedDraws& stepped) {
  const RegionPasses& passes = *placed.draw.passes;
  const Chart& chart = field_->regions[passes.region].chart;
  region_.set("textureExtent",
              Eigen::Vector2f(static_cast<float>(chart.width), static_cast<float>(chart.height)));
  region_.set("slot", static_cast<float>(placed.group.places.front().slot));
  const std::vector<const gl::Texture*> textures = slots_.arrays();
  stepped.draw({target,
                region_,
                textures,
                {.blend = {gl::Factor::targetAlpha, gl::Factor::one},
                 .depth = gl::Compare::equal,
                 .writeColor = {true, true, true, false},
                 .cull = gl::Cull::back,
                 .scissor = passes.scissor}},
               buffers_.mesh(), buffers_.partOf(passes.region));
}

void FrameRenderer::drawFused(const PlacedDraw& placed, gl::Framebuffer& target, gl::SteppedDraws& stepped) {
  const Draw& draw = placed.draw;
  const Region& region = field_->regions[draw.passes->region];
  const DirectionMesh& mesh = field_->directionsOf(draw.passes->region);
  const auto rows = buffers_.rows(region.directionMesh);
  std::vector<Eigen::Vector4f> hatRows, triangleSlots;
  for (const uint32_t triangle : draw.triangles) {
    Eigen::Vector4f& slots = triangleSlots.emplace_back(0, 0, 0, static_cast<float>(triangle));
    for (size_t corner = 0; corner < 3; ++corner) {
      hatRows.push_back(rows[3 * triangle + corner]);
      const auto at = std::ranges::find(draw.directions, mesh.triangles()[triangle][corner]);
      const auto index = static_cast<size_t>(at - draw.directions.begin());
      slots[static_cast<Eigen::Index>(corner)] = static_cast<float>(placed.group.places[index].slot);
    }
  }
  const bool isAll = draw.triangles.size() == draw.passes->triangles.size();
  fused_.set("triangleCount", static_cast<int>(draw.triangles.size()));
  fused_.set("hatRows[0]", hatRows);
  fused_.set("triangleSlots[0]", triangleSlots);
  fused_.set("sureHat", buffers_.sureHat(region.directionMesh));
  fused_.set("comparedTriangles", isAll ? 0 : static_cast<int>(mesh.triangles().size()));
  fused_.set("textureExtent", Eigen::Vector2f(static_cast<float>(region.chart.width),
                                              static_cast<float>(region.chart.height)));
  std::vector<const gl::Texture*> textures = slots_.arrays();
  textures.push_back(&buffers_.rowTexture(region.directionMesh));
  stepped.draw({target,
                fused_,
                textures,
                {.depth = gl::Compare::equal, .cull = gl::Cull::back, .scissor = draw.passes->scissor}},
               buffers_.mesh(), buffers_.partOf(draw.passes->region));
}

Frame FrameRenderer::read(const Targets& targets, const gl::DepthRange& range, const FrameOptions& options,
                          const Progress& progress) const {
  Frame frame;
  progress.checkpoint();
  frame.color = targets.color.read();
  progress.checkpoint();
  frame.depth = targets.depth.read();
  if (options.observed) {
    frame.observed = image::Image(frame.color.width, frame.color.height, 1);
    const image::Image source = options.method == Stages::fused ? image::Image() : targets.observed.read();
    for (size_t i = 0; i < frame.observed.values.size(); ++i)
      frame.observed.values[i] =
          options.method == Stages::fused ? frame.color.values[4 * i + 3] : source.values[4 * i];
  }
  for (size_t i = 0; i < frame.depth.values.size(); ++i) {
    progress.checkNowAndThen(i);
    float& depth = frame.depth.values[i];
    const bool isObject = depth < 1;
    frame.color.values[4 * i + 3] = isObject ? 1.f : 0.f;
    depth = isObject ? distanceOf(depth, range) : std::numeric_limits<float>::infinity();
  }
  return frame;
}

} // namespace surflect::slf
