#include "render/stage/material_section.h"

#include "render/stage/stage_plan.h"
#include "surfel/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace surflect::stage {

struct MaterialTables {
  std::unique_ptr<const material::EnergyCompensation> mirror;
  std::map<double, std::unique_ptr<const material::DielectricLosses>> glass; // by eta
  std::map<double, std::unique_ptr<const material::CoatTransmission>> coat;
  std::map<std::filesystem::path, std::unique_ptr<const material::MerlTable>> measured;
};

namespace {

constexpr size_t kMostMaterials = 1000;

Rgb fractionsOr(const scene::Section& section, std::string_view key, const Rgb& otherwise) {
  const auto entry = section.find(key);
  return entry ? asColor(*entry, 0, 1) : otherwise;
}

double fraction(const scene::Section& section, std::string_view key) {
  return numberIn(section.require(key), 0, 1);
}

// Roughness as one number, or along and across the tangent.
material::Roughness asRoughness(const scene::Entry& entry) {
  try {
    const double both = scene::asNumber(entry);
    return {numberIn(entry, 0, 1), both};
  } catch (const Error&) {
    const auto parts = scene::asArray(entry, "a number in 0..1, or two: along the tangent and across");
    if (parts.size() != 2)
      throw scene::mismatch(entry, "a number in 0..1, or two: along the tangent and across");
    return {numberIn(parts[0], 0, 1), numberIn(parts[1], 0, 1)};
  }
}

// Reads materials; shared tables are made on first use.
class MaterialReader {
public:
  void read(const scene::Entry& entry) {
    const scene::Keys types = {"lambert", "rough_diffuse", "conductor", "dielectric",
                               "ward",    "measured",      "clear_coat"};
    const std::vector<scene::Keys> keys = {
        {"albedo", "texture", "repeat"},
        {"albedo", "roughness", "texture", "roughness_texture", "repeat"},
        {"color", "grazing_tint", "alpha", "texture", "roughness_texture", "repeat"},
        {"eta", "alpha", "absorption", "absorption_outside", "roughness_texture", "repeat"},
        {"diffuse", "specular", "alpha", "texture", "roughness_texture", "repeat"},
        {"file"},
        {"eta", "alpha", "base"}};
    const size_t type = scene::typeOf(entry, types);
    scene::Keys known = keys[type];
    known.insert(known.end(), {"name", "type"});
    const scene::Section section(entry, known);
    const scene::Entry nameEntry = section.require("name");
    const std::string name = scene::asText(nameEntry);
    if (list_.materials.contains(name)) throw scene::mismatch(nameEntry, "a name that no other material has");
    const std::array<material::Material (MaterialReader::*)(const scene::Section&, const scene::Entry&), 7>
        readers = {&MaterialReader::lambert,    &MaterialReader::roughDiffuse, &MaterialReader::conductor,
                   &MaterialReader::dielectric, &MaterialReader::ward,         &MaterialReader::measured,
                   &MaterialReader::clearCoat};
    const material::Material material = (this->*readers[type])(section, entry);
    const auto base = section.find("base");
    list_.materials.emplace(name,
                            NamedMaterial{material, base ? list_.named(*base).textures : textures(section)});
  }

  MaterialList finish() && {
    list_.tables = std::move(tables_);
    return std::move(list_);
  }

private:
  // Checks a material before tables are made, while its roughness, which needs tables, is still unset.
  static void check(const scene::Entry& table, const material::Material& smooth) {
    scene::at(table, [&] { material::requireValid(smooth); });
  }

  material::Material lambert(const scene::Section& s, const scene::Entry&) {
    return material::Lambert{asColor(s.require("albedo"), 0, 1)};
  }
  material::Material roughDiffuse(const scene::Section& s, const scene::Entry&) {
    return material::RoughDiffuse{asColor(s.require("albedo"), 0, 1), fraction(s, "roughness")};
  }
  material::Material conductor(const scene::Section& s, const scene::Entry&) {
    material::Conductor metal{asColor(s.require("color"), 0, 1), fractionsOr(s, "grazing_tint", {1, 1, 1}),
                              asRoughness(s.require("alpha"))};
    if (!material::isSpecular(metal)) {
      if (!tables_->mirror)
        tables_->mirror =
            std::make_unique<const material::EnergyCompensation>(material::mirrorEnergyCompensation());
      metal.mirrorLoss = tables_->mirror.get();
    }
    return metal;
  }
  material::Material dielectric(const scene::Section& s, const scene::Entry& table) {
    material::Dielectric glass{scene::asNumber(s.require("eta"))};
    if (const auto absorption = s.find("absorption")) glass.absorption = asColor(*absorption, 0, 1e9);
    if (const auto outside = s.find("absorption_outside"))
      glass.absorptionOutside = asColor(*outside, 0, 1e9);
    check(table, glass);
    if (const auto alpha = s.find("alpha")) glass.alpha = numberIn(*alpha, 0, 1);
    if (!material::isSpecular(glass)) {
      auto& losses = tables_->glass[glass.eta];
      if (!losses) losses = std::make_unique<const material::DielectricLosses>(glass.eta);
      glass.losses = losses.get();
    }
    return glass;
  }
  material::Material ward(const scene::Section& s, const scene::Entry& table) {
    const material::Ward gloss{asColor(s.require("diffuse"), 0, 1), asColor(s.require("specular"), 0, 1),
                               asRoughness(s.require("alpha"))};
    check(table, gloss);
    return gloss;
  }
  material::Material measured(const scene::Section& s, const scene::Entry&) {
    const std::filesystem::path file = scene::asPath(s.require("file"));
    auto& table = tables_->measured[file];
    if (!table) {
      table =
          scene::atFile(s.require("file"), [&] { return std::make_unique<const material::MerlTable>(file); });
      list_.files.push_back(file);
    }
    return material::Measured{table.get()};
  }
  material::Material clearCoat(const scene::Section& s, const scene::Entry& table) {
    const scene::Entry base = s.require("base");
    material::ClearCoat coat;
    coat.eta = scene::asNumber(s.require("eta"));
    std::visit(
        [&]<class Base>(const Base& material) {
          if constexpr (std::is_constructible_v<material::CoatBase, Base>)
            coat.base = material;
          else
            throw scene::mismatch(base, "a material that can be coated: neither a dielectric nor a coat");
        },
        list_.named(base).material);
    check(table, coat);
    if (const auto alpha = s.find("alpha")) coat.alpha = numberIn(*alpha, 0, 1);
    if (coat.alpha >= material::kSmooth) {
      auto& transmission = tables_->coat[coat.eta];
      if (!transmission) transmission = std::make_unique<const material::CoatTransmission>(coat.eta);
      coat.transmission = transmission.get();
    }
    return coat;
  }

  Textures textures(const scene::Section& s) {
    const auto color = s.find("texture"), roughness = s.find("roughness_texture"), repeat = s.find("repeat");
    if (repeat && !color && !roughness) throw scene::mismatch(*repeat, "a texture beside it");
    constexpr int most = 10000;
    std::array<int, 2> times{1, 1};
    if (repeat) {
      const auto parts = scene::asArray(*repeat, "[across, up]");
      if (parts.size() != 2) throw scene::mismatch(*repeat, "[across, up]");
      times = {scene::asInteger(parts[0], 1, most), scene::asInteger(parts[1], 1, most)};
    }
    const auto read = [&](const std::optional<scene::Entry>& picture, Texels what) {
      return picture ? std::make_shared<const Texture>(texelsOf(*picture, what), times[0], times[1])
                     : nullptr;
    };
    return {read(color, Texels::colors), read(roughness, Texels::factors)};
  }

  // Texels of a picture, read once for all materials.
  std::shared_ptr<const image::Image> texelsOf(const scene::Entry& picture, Texels what) {
    const std::filesystem::path file = scene::asPath(picture);
    auto& texels = texels_[{file, what}];
    if (!texels) {
      texels = scene::atFile(picture,
                             [&] { return std::make_shared<const image::Image>(readTexels(file, what)); });
      if (!std::ranges::count(list_.files, file)) list_.files.push_back(file);
    }
    return texels;
  }

  MaterialList list_;
  std::map<std::pair<std::filesystem::path, Texels>, std::shared_ptr<const image::Image>> texels_;
  std::shared_ptr<MaterialTables> tables_ = std::make_shared<MaterialTables>();
};

} // namespace

const NamedMaterial& MaterialList::named(const scene::Entry& entry) const {
  const std::string name = scene::asText(entry);
  if (const auto found = materials.find(name); found != materials.end()) return found->second;
  scene::Keys known;
  for (const auto& [other, material] : materials) known.push_back(other);
  if (known.empty()) throw scene::mismatch(entry, "a material of a table before this, and there is none");
  throw scene::mismatch(entry, "a material of a table before this: " +
                                   firstNames(std::vector<std::string>(known.begin(), known.end())) +
                                   didYouMean(name, known));
}

MaterialList asMaterials(const scene::Entry& entry) {
  MaterialReader reader;
  const std::vector<scene::Entry> tables = scene::asArray(entry, "tables under [[material]]");
  if (tables.size() > kMostMaterials)
    throw Error::mismatch(fmt::format("at most {} materials", kMostMaterials), std::to_string(tables.size()))
        .at(entry.field);
  for (const scene::Entry& table : tables) reader.read(table);
  return std::move(reader).finish();
}

} // namespace surflect::stage
