#include "render/lightfield/lfm/joined.h"

#include "render/lightfield/lfm/map_shape.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cassert>
#include <string>
#include <vector>

namespace surflect::lfm {

namespace {

// Appends the tables of models, and the users of objects.
class TableJoiner {
public:
  explicit TableJoiner(MapTable& joined) : joined_(joined) {}

  // Models are added in order.
  void addModel(const MapSet& maps) {
    firstMap_.push_back(joined_.maps.count);
    joined_.maps.count += maps.count;
    joined_.maps.data.insert(joined_.maps.data.end(), maps.data.begin(), maps.data.end());
  }
  void addObject(size_t model, std::span<const uint32_t> mapOf) {
    for (const uint32_t map : mapOf)
      joined_.mapOf.push_back(map == kNoMap ? kNoMap : static_cast<uint32_t>(firstMap_[model] + map));
  }

private:
  MapTable& joined_;
  std::vector<size_t> firstMap_; // by model
};

const char* nameOf(Factorization method) { return method == Factorization::pca ? "pca" : "nmf"; }
const char* nameOf(SurfaceLayout layout) {
  return layout == SurfaceLayout::packed ? "without codebooks" : "with codebooks";
}

bool hasHigherTerms(const LightFieldMaps& maps) { return maps.terms.size() > 1; }

void requireFitting(const LightFieldMaps& model, const LightFieldMaps& first) {
  if (model.method != first.method)
    throw Error::mismatch(nameOf(first.method), nameOf(model.method)).at("method");
  if (model.layout != first.layout)
    throw Error::mismatch(nameOf(first.layout), nameOf(model.layout)).at("maps");
  if (model.samples != first.samples)
    throw Error::mismatch(std::to_string(first.samples), std::to_string(model.samples)).at("samples");
  if (model.viewSize != first.viewSize)
    throw Error::mismatch(std::to_string(first.viewSize), std::to_string(model.viewSize)).at("viewSize");
  const auto isEncoded = [](const MapTable& table) { return table.maps.coding == Coding::dxt1; };
  if (isEncoded(model.mean) || std::ranges::any_of(model.terms, [&](const Term& term) {
        return isEncoded(term.surface) || isEncoded(term.view);
      }))
    throw Error("has S3TC blocks, expected bytes: encode the scene instead").at("coding");
}

void appendMesh(LightFieldMaps& scene, const LightFieldMaps& model, const Placement& placement) {
  const auto first = static_cast<uint32_t>(scene.mesh.positions.size());
  for (const auto& position : model.mesh.positions) scene.mesh.positions.push_back(placement(position));
  for (const VertexFrame& frame : model.frames) scene.frames.push_back(placement(frame));
  for (const auto& [a, b, c] : model.mesh.triangles)
    scene.mesh.triangles.push_back({first + a, first + b, first + c});
}

// Term k of all objects.
Term joinedTerm(std::span<const LightFieldMaps> models, std::span<const PlacedObject> objects, size_t k) {
  Term joined;
  TableJoiner surface(joined.surface), view(joined.view);
  for (const LightFieldMaps& model : models) {
    surface.addModel(k < model.terms.size() ? model.terms[k].surface.maps : MapSet{});
    view.addModel(k < model.terms.size() ? model.terms[k].view.maps : MapSet{});
  }
  for (const PlacedObject& object : objects) {
    const LightFieldMaps& model = models[object.model];
    const size_t vertices = model.mesh.positions.size(), triangles = model.mesh.triangles.size();
    if (k < model.terms.size()) {
      const Term& term = model.terms[k];
      surface.addObject(object.model, term.surface.mapOf);
      view.addObject(object.model, term.view.mapOf);
      joined.scale.insert(joined.scale.end(), term.scale.begin(), term.scale.end());
    } else {
      const size_t users = model.layout == SurfaceLayout::packed ? triangles : 3 * triangles;
      surface.addObject(object.model, std::vector<uint32_t>(users, kNoMap));
      view.addObject(object.model, std::vector<uint32_t>(vertices, kNoMap));
      joined.scale.resize(joined.scale.size() + vertices, 0);
    }
  }
  return joined;
}

// Means of all objects, as bytes of `white`.
MapTable joinedMean(std::span<const LightFieldMaps> models, std::span<const PlacedObject> objects,
                    float white) {
  MapTable joined;
  TableJoiner mean(joined);
  for (const LightFieldMaps& model : models) {
    MapSet maps = model.mean.maps;
    if (model.meanWhite != white)
      for (uint8_t& byte : maps.data) byte = meanByte(double{model.meanWhite} * byte / 255, white);
    mean.addModel(maps);
  }
  for (const PlacedObject& object : objects) mean.addObject(object.model, models[object.model].mean.mapOf);
  return joined;
}

} // namespace

double memoryOf(std::span<const LightFieldMaps> models, std::span<const PlacedObject> objects) {
  // Per triangle: sums, codes and corrections on its edges (edge_corrections.h), their numbers, and corners.
  constexpr double kSums = 3 * 16, kEdgeNumbers = 3 * 48 + 24, kCorners = 12;
  double bytes = 0;
  for (const PlacedObject& object : objects) {
    const LightFieldMaps& model = models[object.model];
    const auto samples = static_cast<double>(model.samples), terms = static_cast<double>(model.terms.size());
    const double ofTriangle =
        samples * (kSums + 3 * (2 * terms + 4)) + kEdgeNumbers + kCorners + terms * 3 * sizeof(uint32_t);
    const double ofVertex = sizeof(VertexFrame) + terms * 2 * sizeof(float);
    bytes += ofTriangle * static_cast<double>(model.mesh.triangles.size()) +
             ofVertex * static_cast<double>(model.mesh.positions.size());
  }
  return bytes;
}

LightFieldMaps joined(std::span<const LightFieldMaps> models, std::span<const PlacedObject> objects) {
  assert(!models.empty());
  LightFieldMaps scene;
  scene.method = models[0].method;
  scene.layout = models[0].layout;
  scene.samples = models[0].samples;
  scene.viewSize = models[0].viewSize;
  const auto higher = std::ranges::find_if(models, hasHigherTerms);
  scene.higherViewSize = (higher == models.end() ? models[0] : *higher).higherViewSize;
  scene.meanWhite = 0;
  size_t terms = 0;
  for (size_t m = 0; m < models.size(); ++m) try {
      requireFitting(models[m], models[0]);
      if (hasHigherTerms(models[m]) && models[m].higherViewSize != scene.higherViewSize)
        throw Error::mismatch(std::to_string(scene.higherViewSize), std::to_string(models[m].higherViewSize))
            .at("higherViewSize");
      terms = std::max(terms, models[m].terms.size());
      scene.meanWhite = std::max(scene.meanWhite, models[m].meanWhite);
    } catch (Error& error) {
      throw std::move(error).at("model[" + std::to_string(m) + ']');
    }
  for (const PlacedObject& object : objects) appendMesh(scene, models[object.model], object.placement);
  for (size_t k = 0; k < terms; ++k) scene.terms.push_back(joinedTerm(models, objects, k));
  scene.mean = joinedMean(models, objects, scene.meanWhite);
  requireComplete(scene);
  return scene;
}

capture::Capture joinedRig(std::span<const capture::Capture* const> rigs,
                           std::span<const PlacedObject> objects) {
  capture::Capture scene;
  for (size_t i = 0; i < objects.size(); ++i) {
    const capture::Capture& rig = *rigs[objects[i].model];
    const std::string prefix = std::to_string(i) + '/';
    const size_t first = scene.views.size();
    for (const capture::View& view : rig.views)
      scene.views.push_back({prefix + view.identity, objects[i].placement(view.camera)});
    for (const capture::Frame& frame : rig.frames) {
      capture::Frame placed = frame;
      placed.view += first;
      placed.light.reset();
      placed.picture = prefix + frame.picture.string();
      scene.frames.push_back(std::move(placed));
    }
  }
  return scene;
}

} // namespace surflect::lfm
