// Framebuffers: textures that are drawn into.
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/texture.h"

#include <Eigen/Core>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace surflect::gl {

// Rectangles of pixels.

// Pixels [x, x + width) x [y, y + height); row 0 is the top of the picture.
struct Rect {
  int x = 0, y = 0, width = 0, height = 0;
};

// A plain texture, or one layer of an array texture.
struct Attachment {
  const Texture* texture = nullptr;
  int layer = 0;
};

class Framebuffer {
public:
  // Fragment output i is written to colour attachment i. Textures of one size; they must outlive the
  // framebuffer. Throws Error with the given name if the driver cannot draw into them.
  Framebuffer(const std::string& name, const std::vector<Attachment>& colors, const Attachment& depth = {});

  unsigned name() const { return handle_.name(); }
  int width() const { return width_; }
  int height() const { return height_; }

  // Fill a rectangle of an attachment, by default all of it.
  void clearColor(size_t attachment, const Eigen::Vector4f& value, const std::optional<Rect>& within = {},
                  const std::array<bool, 4>& channels = {true, true, true, true});
  void clearDepth(float value = 1, const std::optional<Rect>& within = {});

private:
  Handle handle_;
  int width_ = 0, height_ = 0;
};

} // namespace surflect::gl
