#include "render/stage/material_section.h"

#include "render/stage/stage_fields.h"
#include "surfel/base/nearest_name.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace surflect {

struct MaterialTables {
  std::unique_ptr<const EnergyCompensation> mirror;
  std::map<double, std::unique_ptr<const DielectricLosses>> glass; // by eta
  std::map<double, std::unique_ptr<const CoatTransmission>> coat;
  std::map<std::filesystem::path, std::unique_ptr<const MerlTable>> measured;
};

namespace {

constexpr size_t kMostMaterials = 1000;

Rgb fractionsOr(const Section& section, std::string_view key, const Rgb& otherwise) {
  const auto entry = section.find(key);
  return entry ? asColor(*entry, 0, 1) : otherwise;
}

double fraction(const Section& section, std::string_view key) { return numberIn(section.require(key), 0, 1); }

// One number, or that along the tangent and that across.
Roughness asRoughness(const Entry& entry) {
  try {
    const double both = asNumber(entry);
    return {numberIn(entry, 0, 1), both};
  } catch (const Error&) {
    const auto parts = asArray(entry, "a number in 0..1, or two: along the tangent and across");
    if (parts.size() != 2) throw mismatch(entry, "a number in 0..1, or two: along the tangent and across");
    return {numberIn(parts[0], 0, 1), numberIn(parts[1], 0, 1)};
  }
}

// What materials share is made when the first of them asks for it.
class MaterialReader {
public:
  void read(const Entry& entry) {
    const Keys types = {"lambert", "rough_diffuse", "conductor", "dielectric",
                        "ward",    "measured",      "clear_coat"};
    const std::vector<Keys> keys = {
        {"albedo", "texture", "repeat"},
        {"albedo", "roughness", "texture", "roughness_texture", "repeat"},
        {"color", "grazing_tint", "alpha", "texture", "roughness_texture", "repeat"},
        {"eta", "alpha", "absorption", "absorption_outside", "roughness_texture", "repeat"},
        {"diffuse", "specular", "alpha", "texture", "roughness_texture", "repeat"},
        {"file"},
        {"eta", "alpha", "base"}};
    const size_t type = typeOf(entry, types);
    Keys known = keys[type];
    known.insert(known.end(), {"name", "type"});
    const Section section(entry, known);
    const Entry nameEntry = section.require("name");
    const std::string name = asText(nameEntry);
    if (list_.materials.contains(name)) throw mismatch(nameEntry, "a name that no other material has");
    const std::array<Material (MaterialReader::*)(const Section&, const Entry&), 7> readers = {
        &MaterialReader::lambert,    &MaterialReader::roughDiffuse, &MaterialReader::conductor,
        &MaterialReader::dielectric, &MaterialReader::ward,         &MaterialReader::measured,
        &MaterialReader::clearCoat};
    const Material material = (this->*readers[type])(section, entry);
    const auto base = section.find("base");
    list_.materials.emplace(name,
                            NamedMaterial{material, base ? list_.named(*base).textures : textures(section)});
  }

  MaterialList finish() && {
    list_.tables = std::move(tables_);
    return std::move(list_);
  }

private:
  // Before there are tables, and so before there is a roughness that asks for them.
  static void check(const Entry& table, const Material& smooth) {
    at(table, [&] { requireValid(smooth); });
  }

  Material lambert(const Section& s, const Entry&) { return Lambert{asColor(s.require("albedo"), 0, 1)}; }
  Material roughDiffuse(const Section& s, const Entry&) {
    return RoughDiffuse{asColor(s.require("albedo"), 0, 1), fraction(s, "roughness")};
  }
  Material conductor(const Section& s, const Entry&) {
    Conductor metal{asColor(s.require("color"), 0, 1), fractionsOr(s, "grazing_tint", {1, 1, 1}),
                    asRoughness(s.require("alpha"))};
    if (!isSpecular(metal)) {
      if (!tables_->mirror) tables_->mirror = std::make_unique<const EnergyCompensation>(mirrorEnergyCompensation());
      metal.mirrorLoss = tables_->mirror.get();
    }
    return metal;
  }
  Material dielectric(const Section& s, const Entry& table) {
    Dielectric glass{asNumber(s.require("eta"))};
    if (const auto absorption = s.find("absorption")) glass.absorption = asColor(*absorption, 0, 1e9);
    if (const auto outside = s.find("absorption_outside"))
      glass.absorptionOutside = asColor(*outside, 0, 1e9);
    check(table, glass);
    if (const auto alpha = s.find("alpha")) glass.alpha = numberIn(*alpha, 0, 1);
    if (!isSpecular(glass)) {
      auto& losses = tables_->glass[glass.eta];
      if (!losses) losses = std::make_unique<const DielectricLosses>(glass.eta);
      glass.losses = losses.get();
    }
    return glass;
  }
  Material ward(const Section& s, const Entry& table) {
    const Ward gloss{asColor(s.require("diffuse"), 0, 1), asColor(s.require("specular"), 0, 1),
                     asRoughness(s.require("alpha"))};
    check(table, gloss);
    return gloss;
  }
  Material measured(const Section& s, const Entry&) {
    const std::filesystem::path file = asPath(s.require("file"));
    auto& table = tables_->measured[file];
    if (!table) {
      table = atFile(s.require("file"), [&] { return std::make_unique<const MerlTable>(file); });
      list_.files.push_back(file);
    }
    return Measured{table.get()};
  }
  Material clearCoat(const Section& s, const Entry& table) {
    const Entry base = s.require("base");
    ClearCoat coat;
    coat.eta = asNumber(s.require("eta"));
    std::visit(
        [&]<class Base>(const Base& material) {
          if constexpr (std::is_constructible_v<CoatBase, Base>)
            coat.base = material;
          else
            throw mismatch(base, "a material that can be coated: neither a dielectric nor a coat");
        },
        list_.named(base).material);
    check(table, coat);
    if (const auto alpha = s.find("alpha")) coat.alpha = numberIn(*alpha, 0, 1);
    if (coat.alpha >= kSmooth) {
      auto& transmission = tables_->coat[coat.eta];
      if (!transmission) transmission = std::make_unique<const CoatTransmission>(coat.eta);
      coat.transmission = transmission.get();
    }
    return coat;
  }

  Textures textures(const Section& s) {
    const auto color = s.find("texture"), roughness = s.find("roughness_texture"), repeat = s.find("repeat");
    if (repeat && !color && !roughness) throw mismatch(*repeat, "a texture beside it");
    constexpr int most = 10000;
    std::array<int, 2> times{1, 1};
    if (repeat) {
      const auto parts = asArray(*repeat, "[across, up]");
      if (parts.size() != 2) throw mismatch(*repeat, "[across, up]");
      times = {asInteger(parts[0], 1, most), asInteger(parts[1], 1, most)};
    }
    const auto read = [&](const std::optional<Entry>& picture, Texels what) {
      return picture ? std::make_shared<const Texture>(texelsOf(*picture, what), times[0], times[1])
                     : nullptr;
    };
    return {read(color, Texels::colors), read(roughness, Texels::factors)};
  }

  // Of a picture that several materials show, once.
  std::shared_ptr<const Image> texelsOf(const Entry& picture, Texels what) {
    const std::filesystem::path file = asPath(picture);
    auto& texels = texels_[{file, what}];
    if (!texels) {
      texels = atFile(picture, [&] { return std::make_shared<const Image>(readTexels(file, what)); });
      if (!std::ranges::count(list_.files, file)) list_.files.push_back(file);
    }
    return texels;
  }

  MaterialList list_;
  std::map<std::pair<std::filesystem::path, Texels>, std::shared_ptr<const Image>> texels_;
  std::shared_ptr<MaterialTables> tables_ = std::make_shared<MaterialTables>();
};

} // namespace

const NamedMaterial& MaterialList::named(const Entry& entry) const {
  const std::string name = asText(entry);
  if (const auto found = materials.find(name); found != materials.end()) return found->second;
  Keys known;
  for (const auto& [other, material] : materials) known.push_back(other);
  if (known.empty()) throw mismatch(entry, "a material of a table before this, and there is none");
  throw mismatch(entry, "a material of a table before this; the nearest is " +
                            std::string(nearestName(name, known)));
}

MaterialList asMaterials(const Entry& entry) {
  MaterialReader reader;
  const std::vector<Entry> tables = asArray(entry, "tables under [[material]]");
  if (tables.size() > kMostMaterials)
    throw Error::mismatch(fmt::format("at most {} materials", kMostMaterials), std::to_string(tables.size()))
        .at(entry.field);
  for (const Entry& table : tables) reader.read(table);
  return std::move(reader).finish();
}

} // namespace surflect
