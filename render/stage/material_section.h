// The materials of a stage file: its [[material]] tables.
#pragma once

#include "render/scene/script_fields.h"
#include "render/stage/material/material.h"
#include "render/stage/texture.h"

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace surflect::stage {

struct MaterialTables; // what materials refer to

struct NamedMaterial {
  material::Material material;
  Textures textures;
};

struct MaterialList {
  std::map<std::string, NamedMaterial, std::less<>> materials;
  std::shared_ptr<const MaterialTables> tables; // to be kept as long as the materials
  std::vector<std::filesystem::path> files;     // that were read for them, each once

  // The one that the entry names. Throws Error.
  const NamedMaterial& named(const scene::Entry& entry) const;
};

// Throws Error naming the entry.
MaterialList asMaterials(const scene::Entry& entry);

} // namespace surflect::stage
