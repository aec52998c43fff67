#include "warp/skeletal_rig.h"

#include "surfel/base/error.h"
#include "surfel/base/text.h"

namespace surflect::warp {

namespace {

// Index of the named animation; throws its fault if it cannot be played.
size_t chosen(const GltfFile& file, const std::string& name) {
  std::string names;
  std::vector<std::string_view> known;
  for (size_t i = 0; i < file.animations.size(); ++i) {
    const GltfAnimation& animation = file.animations[i];
    if (!name.empty() ? animation.name == name : file.animations.size() == 1) {
      if (animation.refusal) throw *animation.refusal;
      return i;
    }
    names += (i ? ", " : "") + ('"' + animation.name + '"');
    known.push_back(animation.name);
  }
  throw Error::mismatch(names.empty() ? "a file with an animation"
                                      : "one of " + names + didYouMean(name, known),
                        name.empty() ? "no name" : '"' + name + '"')
      .at("animation");
}

MeshField boundTo(const Skeleton& skeleton) { return MeshField(pose(skeleton, {}, 0), skeleton.triangles); }

} // namespace

Rig::Rig(const std::filesystem::path& path, const std::string& animation) try
    : file_(readGltf(path)), animation_(chosen(file_, animation)), field_(boundTo(file_.skeleton)) {
} catch (Error& error) {
  throw std::move(error).in(path);
}

WarpPointer Rig::at(double seconds) const {
  return field_.follow(pose(file_.skeleton, file_.animations[animation_].channels, seconds));
}

} // namespace surflect::warp
