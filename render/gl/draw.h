// Drawing. A draw depends on its arguments alone, not on what was drawn before.
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"

#include <array>
#include <cstddef>
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

// Makes pixels that were drawn readable as texels by the draws that follow, even by one that draws to the
// same texture, if each of its pixels reads no texel but its own.
void finishPixels();

} // namespace surflect::gl
