// Drawing. A draw depends on its arguments alone, not on what was drawn before.
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"
#include "surfel/base/time.h"

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

namespace surflect::gl {

enum class Factor {
  zero,
  one,
  sourceAlpha,
  oneMinusSourceAlpha,
  targetColor,
  targetAlpha,
  oneMinusTargetAlpha,
};

enum class Equation {
  add,     // source * fragment + target * pixel
  subtract // target * pixel - source * fragment
};

// Blend of a fragment with its pixel, in all four channels.
struct Blend {
  Factor source = Factor::one, target = Factor::zero;
  Equation equation = Equation::add;
};

enum class Compare { always, less, lessEqual, equal, greater };
enum class Cull { none, back, front }; // corners are counter-clockwise, seen from the front

// Fixed-function state of a draw.
struct RenderState {
  Blend blend = {};
  Compare depth = Compare::always; // of the fragment's depth with the pixel's
  bool writeDepth = false;
  std::array<bool, 4> writeColor = {true, true, true, true};
  Cull cull = Cull::none;
  std::optional<Rect> viewport = {}, scissor = {}; // none: the whole framebuffer
};

enum class Primitive { triangles, points };

// Part of a vertex array: a range of its indices, or of its vertices if it has no indices.
struct Range {
  size_t first = 0, count = 0;
};

// Number of texture units that a draw sets, which every driver has. Units beyond a pass's textures read as
// black.
inline constexpr size_t kTextureUnits = 16;

// Inputs of a draw other than the mesh.
struct Pass {
  const Framebuffer& target;
  const Program& program;
  std::span<const Texture* const> textures = {}; // by unit, at most kTextureUnits
  RenderState state = {};
};

// Draws a part of a mesh. Compare::equal recognises the depths of an earlier draw only if both vertex shaders
// compute gl_Position by the same expression and declare it invariant.
void draw(const Pass& pass, const VertexArray& mesh, const Range& part,
          Primitive primitive = Primitive::triangles);
void draw(const Pass& pass, const VertexArray& mesh, Primitive primitive = Primitive::triangles);

// Draws of one program in steps of about 10 ms, between which a frame can be given up: pixels are those of
// draw(), which draws all at once. Where nobody asks for it (Progress::cancelled), there are no steps.
class SteppedDraws {
public:
  // step: work of a step, in triangles times pixels of the target; it follows the time that steps take, and
  // is to be kept from frame to frame, from kFirstStep on. Both must outlive this.
  static constexpr double kFirstStep = 3e7;
  SteppedDraws(double& step, const Progress& progress);

  // As gl::draw() of triangles, in their order. Throws Cancelled.
  void draw(const Pass& pass, const VertexArray& mesh, const Range& part);
  void draw(const Pass& pass, const VertexArray& mesh) { draw(pass, mesh, {0, mesh.size()}); }
  // Draws one triangle, which covers the target, to some rows after the other. Throws Cancelled.
  void drawRows(const Pass& pass, const VertexArray& mesh);

private:
  // Number of things that the present step still takes, at least 1, by the work of each.
  size_t room(double work) const;
  void add(double work);

  double& step_;
  const Progress& progress_;
  double queued_ = 0, before_ = 0; // work of the present step so far, and of the step before
  // Signalled when the step before has been drawn: the driver draws one step while the next one is prepared.
  std::unique_ptr<void, void (*)(void*)> drawn_;
  surflect::Stopwatch watch_;
};

// Makes pixels that were drawn readable as texels by the draws that follow, even by one that draws to the
// same texture, if each of its pixels reads no texel but its own.
void finishPixels();

} // namespace surflect::gl
