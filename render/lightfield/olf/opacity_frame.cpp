#include "render/lightfield/olf/opacity_frame.h"

#include "render/gl/context.h"
#include "render/gl/draw.h"
#include "render/gl/projection.h"
#include "render/lightfield/olf/frame_parts.h"
#include "render/lightfield/olf/shaders.h"
#include "surfel/base/error.h"
#include "surfel/math/bounds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <numeric>
#include <vector>

namespace surflect::olf {

namespace {

// As in the shaders.
constexpr size_t kPieceWords = 16;
static_assert(sizeof(TriangleBlend) == 37 * 4);

uint32_t bitsOf(double value) { return std::bit_cast<uint32_t>(static_cast<float>(value)); }

std::vector<uint32_t> wordsOf(std::span<const Piece> pieces, const Vec3<double>& middle) {
  std::vector<uint32_t> words;
  words.reserve(kPieceWords * pieces.size());
  for (const Piece& piece : pieces) {
    words.push_back(piece.triangle);
    for (size_t i = 0; i < 3; ++i) {
      const Vec3<double> p = piece.corners[i] - middle;
      for (const double value : {p[0], p[1], p[2], piece.barycentrics[i][1], piece.barycentrics[i][2]})
        words.push_back(bitsOf(value));
    }
  }
  return words;
}

// Rows of the matrix from points relative to the middle to homogeneous texels; then the size that is used,
// and white.
std::vector<float> placesOf(const OpacityField& field, const Vec3<double>& middle) {
  std::vector<float> values;
  for (size_t view = 0; view < field.cameras.size(); ++view) {
    const capture::Lens& lens = field.cameras[view].lens;
    const PackedView& packed = field.packed.views[view];
    const auto& pose = field.cameras[view].cameraFromWorld;
    Mat3<double> texelFromCamera;
    texelFromCamera << packed.scale[0] * lens.focalX, 0, -packed.scale[0] * (lens.centerX - packed.low[0]), 0,
        -packed.scale[1] * lens.focalY, -packed.scale[1] * (lens.centerY - packed.low[1]), 0, 0, -1;
    const Mat3<double> linear = texelFromCamera * pose.rotation();
    const Vec3<double> offset = texelFromCamera * (pose.rotation() * middle + pose.translation());
    for (Eigen::Index row = 0; row < 3; ++row)
      for (const double value : {linear(row, 0), linear(row, 1), linear(row, 2), offset[row]})
        values.push_back(static_cast<float>(value));
    values.insert(values.end(),
                  {static_cast<float>(packed.width), static_cast<float>(packed.height), packed.white, 0});
  }
  return values;
}

gl::Texture pictureTexture(const PackedViews& packed) {
  const gl::Limits& limits = gl::contextOfThread()->describe().limits;
  if (packed.width > limits.textureSize || packed.height > limits.textureSize)
    throw Error::mismatch("views of " + std::to_string(limits.textureSize) +
                              " texels at most (lower --budget)",
                          std::to_string(packed.width) + " x " + std::to_string(packed.height))
        .in("OpenGL");
  if (packed.views.size() > static_cast<size_t>(limits.arrayLayers))
    throw Error::mismatch(std::to_string(limits.arrayLayers) + " views at most",
                          std::to_string(packed.views.size()))
        .in("OpenGL");
  gl::Texture texture({packed.isCompressed() ? gl::Format::dxt5 : gl::Format::rgba16f, packed.width,
                       packed.height, static_cast<int>(packed.views.size())});
  for (size_t view = 0; view < packed.views.size(); ++view)
    texture.upload(packed.isCompressed() ? std::as_bytes(packed.layerBlocks(view))
                                         : std::as_bytes(packed.layer(view)),
                   packed.width, packed.height, {.layer = static_cast<int>(view)});
  return texture;
}

const char* fragmentShaderOf(Order order) {
  switch (order) {
  case Order::list:
    return "list.frag";
  case Order::peel:
    return "peel.frag";
  case Order::bsp:
    return "over.frag";
  }
  return "";
}

capture::Camera<AcquisitionSpace> centredAt(const Vec3<double>& origin,
                                            capture::Camera<AcquisitionSpace> camera) {
  const auto& pose = camera.cameraFromWorld;
  camera.cameraFromWorld = {pose.rotation(), pose.translation() + pose.rotation() * origin};
  return camera;
}

} // namespace

OpacityFrame::Target::Target(int width, int height, Order order)
    : color({gl::Format::rgba32f, width, height}), whole("opacity", {{&color}}) {
  if (order == Order::peel) layers.emplace(width, height);
}

OpacityFrame::OpacityFrame(const OpacityField& field, Order order, const Progress& progress)
    : field_(field), order_(order),
      tree_(order == Order::bsp ? std::optional<BspTree>(std::in_place, field.mesh, progress) : std::nullopt),
      pieceCount_(tree_ ? tree_->pieces().size() : field.mesh.triangles.size()),
      middle_(boundsOf(field.mesh.positions).center()),
      box_(boundsOf(field.mesh.positions).translated(-middle_)), pictures_(pictureTexture(field.packed)),
      pieces_(4 * kPieceWords * pieceCount_), drawn_(4 * pieceCount_),
      blends_(sizeof(TriangleBlend) * field.mesh.triangles.size()), places_(64 * field.cameras.size()),
      none_({}), shade_(kShaders, {"piece.vert", fragmentShaderOf(order)}),
      textureBytes_(field.packed.bytes()) {
  const std::vector<Piece> whole = tree_ ? std::vector<Piece>() : wholePieces(field.mesh);
  const std::vector<uint32_t> words = wordsOf(tree_ ? tree_->pieces() : whole, middle_);
  pieces_.upload(std::as_bytes(std::span(words)));
  std::vector<uint32_t> drawn(pieceCount_);
  std::iota(drawn.begin(), drawn.end(), 0u);
  drawn_.upload(std::as_bytes(std::span(drawn)));
  const std::vector<float> places = placesOf(field, middle_);
  places_.upload(std::as_bytes(std::span(places)));
  if (order == Order::list) lists_.emplace();
  if (order == Order::peel)
    compose_.emplace(kShaders, std::initializer_list<std::string_view>{"picture.vert", "compose.frag"});
}

void OpacityFrame::drawLists(FrameCounts& counts, const Progress& progress) {
  const std::array<const gl::Texture*, 1> textures{&pictures_};
  lists_->draw(target_->whole, shade_, textures, none_, {0, 3 * pieceCount_}, counts, progress);
}

void OpacityFrame::drawLayers(FrameCounts& counts, const Progress& progress) {
  constexpr size_t kAll = std::numeric_limits<size_t>::max();
  target_->layers->draw(
      target_->whole, target_->color, *compose_, kAll, counts,
      [&](const PeeledLayer& layer) {
        const std::array<const gl::Texture*, 2> textures{&pictures_, &layer.before};
        shade_.set("isFirst", layer.isFirst ? 1 : 0);
        gl::SteppedDraws(step_, progress)
            .draw({layer.target,
                   shade_,
                   textures,
                   {.depth = gl::Compare::less, .writeDepth = true, .cull = gl::Cull::back}},
                  none_, {0, 3 * pieceCount_});
        ++counts.passes;
        return layer.fragments.read(0);
      },
      progress);
}

void OpacityFrame::drawSorted(FrameCounts& counts, const Progress& progress) {
  const std::array<const gl::Texture*, 1> textures{&pictures_};
  gl::SteppedDraws(step_, progress)
      .draw({target_->whole,
             shade_,
             textures,
             {.blend = {gl::Factor::one, gl::Factor::oneMinusSourceAlpha}, .cull = gl::Cull::back}},
            none_, {0, 3 * pieceCount_});
  ++counts.passes;
}

std::map<std::string, size_t> OpacityFrame::auxiliaryBytes() const {
  return {{"bsp_tree_bytes", tree_ ? tree_->bytes() : 0},
          {"piece_bytes", pieces_.bytes() + drawn_.bytes()},
          {"blend_bytes", blends_.bytes()},
          {"matrix_bytes", places_.bytes()}};
}

image::Image OpacityFrame::render(const capture::Camera<AcquisitionSpace>& camera,
                                  std::span<const TriangleBlend> blends,
                                  std::map<std::string, double>& seconds, FrameCounts& counts, int side,
                                  const Progress& progress) {
  const int width = camera.lens.width, height = camera.lens.height;
  if (!target_ || target_->color.shape().width != width || target_->color.shape().height != height) {
    target_.reset();
    target_.emplace(width, height, order_);
  }
  gl::Stopwatch stopwatch;
  const auto lap = [&](const char* stage) {
    seconds[stage] += stopwatch.seconds();
    stopwatch = {};
  };
  progress.checkpoint();
  if (tree_) {
    const std::vector<uint32_t> order = tree_->backToFront(camera.center().raw());
    lap("order");
    drawn_.upload(std::as_bytes(std::span(order)));
  }
  shade_.set("clipFromObject", gl::clipFromWorld(centredAt(middle_, camera), box_));
  blends_.upload(std::as_bytes(blends));
  pieces_.bind(kPieces), drawn_.bind(kDrawn), blends_.bind(kBlends), places_.bind(kPlaces);
  target_->whole.clearColor(0, {0, 0, 0, 0});
  lap("upload");
  if (order_ == Order::list)
    drawLists(counts, progress);
  else if (order_ == Order::peel)
    drawLayers(counts, progress);
  else
    drawSorted(counts, progress);
  lap("draw");
  image::Image color = means_.read(target_->color, side, progress);
  lap("read");
  return color;
}

} // namespace surflect::olf
