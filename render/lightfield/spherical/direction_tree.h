// Directions of space as a tree of pencils: the faces of an icosahedron, each cut into four, level by level.
//
// [Domingo 2007, §3.1] Domingo, Escriva, Abad, Lluch, Camahort: Continuous LODs and Adaptive Frame-Rate
// Control for Spherical Light Fields.
//
// A direction points from the object towards a viewer. Level l has 20 * 4^l pencils. Children 4 i .. 4 i + 3
// of pencil i are the child at its centre, and those at its corners a, b, c. A centre child shows the image
// of its parent; the other three have images of their own: 20 * 4^l images for levels 0..l together.
#pragma once

#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::spherical {

inline constexpr size_t kMostLevels = 6; // level 5 has 20,480 pencils

struct Pencil {
  uint32_t level = 0, index = 0;

  friend bool operator==(const Pencil&, const Pencil&) = default;
};

// Number of an image, from 0; images of coarser levels have lower numbers.
using ImageNumber = uint32_t;

constexpr size_t pencilsOf(size_t level) { return size_t{20} << 2 * level; }
// Images of all levels up to this one: as many as it has pencils.
constexpr size_t imagesUpTo(size_t level) { return pencilsOf(level); }
// The first image that belongs to a level.
constexpr size_t firstImageOf(size_t level) { return level == 0 ? 0 : imagesUpTo(level - 1); }

// Parent of a pencil of level 1 or above.
constexpr Pencil parentOf(const Pencil& pencil) { return {pencil.level - 1, pencil.index / 4}; }
// Image that a pencil shows.
ImageNumber imageOf(Pencil pencil);
// The coarsest pencil that shows an image.
Pencil pencilOf(ImageNumber image);

// Corners, counter-clockwise seen from outside; unit vectors.
using Corners = std::array<Vec3<double>, 3>;

class DirectionTree {
public:
  // Levels 0..levels-1; 1..kMostLevels of them.
  explicit DirectionTree(size_t levels);

  size_t levels() const { return meshes_.size(); }
  Corners corners(const Pencil& pencil) const;
  const std::array<uint32_t, 3>& vertices(const Pencil& pencil) const {
    return meshes_[pencil.level].triangles[pencil.index];
  }
  const Vec3<double>& vertex(size_t level, uint32_t vertex) const { return meshes_[level].positions[vertex]; }
  // Pencils of a level that meet at a vertex, five or six.
  std::span<const uint32_t> around(size_t level, uint32_t vertex) const;

  // Unit vector to the middle of a pencil.
  Vec3<double> middle(const Pencil& pencil) const;
  // Direction along which an image is projected: the middle of the coarsest pencil that shows it.
  Vec3<double> direction(ImageNumber image) const { return middle(pencilOf(image)); }

  // Pencil of a level that holds a direction, which need not be of unit length.
  Pencil find(size_t level, const Vec3<double>& direction) const;

private:
  struct LevelMesh {
    std::vector<Vec3<double>> positions;
    std::vector<std::array<uint32_t, 3>> triangles;
    std::vector<uint32_t> firstAround, around; // pencils by vertex
  };
  static LevelMesh icosahedron();
  static LevelMesh subdivided(const LevelMesh& coarse);
  static void listAround(LevelMesh& mesh);

  std::vector<LevelMesh> meshes_; // by level
};

// Options of a picture of a spherical light field.

// Level of detail of a picture, and how its rays are looked up.
struct Look {
  double detail = 0;        // continuous level of detail, 0..levels-1
  double mip = 0;           // least mip level of the images
  bool depth = true;        // points of the object's mesh, rather than of an image's plane, are shown
  bool interpolated = true; // between neighbouring pencils
  int coarser = 0;          // mip levels above the one whose texels are as wide as pixels
  friend bool operator==(const Look&, const Look&) = default;
};

} // namespace surflect::spherical
