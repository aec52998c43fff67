#include "render/lightfield/lfm/maps.h"

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/tile.h"
#include "surfel/base/error.h"

#include <cmath>
#include <string>
#include <utility>

namespace surflect::lfm {

namespace {

std::string text(size_t number) { return std::to_string(number); }

void require(size_t found, size_t expected, const char* field) {
  if (found != expected) throw Error::mismatch(text(expected), text(found)).at(field);
}

void requireWithin(size_t found, size_t lowest, size_t highest, const char* field) {
  if (found < lowest || found > highest)
    throw Error::mismatch(text(lowest) + ".." + text(highest), text(found)).at(field);
}

void requireTable(const MapTable& table, size_t users, const MapShape& shape) {
  require(table.mapOf.size(), users, "mapOf");
  for (size_t i = 0; i < users; ++i)
    if (table.mapOf[i] != kNoMap && table.mapOf[i] >= table.maps.count)
      throw Error::mismatch("below " + text(table.maps.count), text(table.mapOf[i]))
          .at("mapOf[" + text(i) + ']');
  if (table.maps.coding != Coding::bytes && table.maps.coding != compressedCoding(shape))
    throw Error("is not that of maps with so many channels").at("coding");
  require(table.maps.data.size(), bytesOf(shape, table.maps.coding, table.maps.count), "data");
}

void requireNumber(double number, double lowest, const std::string& field) {
  if (!std::isfinite(number) || number < lowest)
    throw Error::mismatch("a number from " + numberText(lowest), numberText(number)).at(field);
}

void requireTerm(const LightFieldMaps& maps, const Term& term) {
  const size_t triangles = maps.mesh.triangles.size(), vertices = maps.mesh.positions.size();
  const bool isPacked = maps.layout == SurfaceLayout::packed;
  try {
    requireTable(term.surface, isPacked ? triangles : 3 * triangles, surfaceShape(maps));
  } catch (Error& error) {
    throw std::move(error).at("surface");
  }
  try {
    requireTable(term.view, vertices, viewShape(maps));
  } catch (Error& error) {
    throw std::move(error).at("view");
  }
  if (term.surface.maps.coding != maps.terms[0].surface.maps.coding ||
      term.view.maps.coding != maps.terms[0].view.maps.coding)
    throw Error("differs from the first term's").at("coding");
  require(term.scale.size(), vertices, "scale");
  for (size_t v = 0; v < vertices; ++v) requireNumber(term.scale[v], 0, "scale[" + text(v) + ']');
}

} // namespace

MapBytes bytesOf(const LightFieldMaps& maps) {
  MapBytes bytes;
  const auto indices = [](const MapTable& table) {
    return isIdentity(table) ? 0 : table.mapOf.size() * indexBytes(table);
  };
  for (const Term& term : maps.terms) {
    bytes.surface += term.surface.maps.data.size();
    bytes.view += term.view.maps.data.size();
    bytes.indices += indices(term.surface) + indices(term.view);
    bytes.scales += term.scale.size() * sizeof(float);
  }
  bytes.mean = maps.mean.maps.data.size();
  bytes.indices += indices(maps.mean);
  return bytes;
}

bool isIdentity(const MapTable& table) {
  if (table.mapOf.size() != table.maps.count) return false;
  for (size_t i = 0; i < table.mapOf.size(); ++i)
    if (table.mapOf[i] != i) return false;
  return true;
}

void requireComplete(const LightFieldMaps& maps) {
  require(maps.frames.size(), maps.mesh.positions.size(), "frames");
  requireWithin(static_cast<size_t>(maps.samples), 2, PatchGrid::kMostPerEdge, "samples");
  requireWithin(static_cast<size_t>(maps.viewSize), kLeastViewSize, kLargestViewSize, "viewSize");
  requireWithin(maps.channels, 3, 4, "channels");
  requireWithin(maps.terms.size(), 0, kMostTerms, "terms");
  for (size_t k = 0; k < maps.terms.size(); ++k) try {
      requireTerm(maps, maps.terms[k]);
    } catch (Error& error) {
      throw std::move(error).at("terms[" + text(k) + ']');
    }
  try {
    requireTable(maps.mean, maps.method == Method::pca ? maps.mesh.triangles.size() : 0, meanShape(maps));
  } catch (Error& error) {
    throw std::move(error).at("mean");
  }
  requireNumber(maps.meanWhite, 1e-30, "meanWhite");
}

} // namespace surflect::lfm
