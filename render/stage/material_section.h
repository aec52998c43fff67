// Reads the [[material]] tables of a stage file.
#pragma once

#include "render/scene/script_fields.h"
#include "render/stage/material/material.h"
#include "render/stage/stage_scene.h"

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace surflect::stage {

struct MaterialTables; // tables that materials refer to

struct NamedMaterial {
  material::Material material;
  Textures textures;
};

struct MaterialList {
  std::map<std::string, NamedMaterial, std::less<>> materials;
  std::shared_ptr<const MaterialTables> tables; // must live as long as the materials
  std::vector<std::filesystem::path> files;     // files that were read, each once

  // Material that the entry names. Throws Error.
  const NamedMaterial& named(const scene::Entry& entry) const;
};

// Throws Error naming the entry.
MaterialList asMaterials(const scene::Entry& entry);

} // namespace surflect::stage
