#include "apps/lightfield_build.h"

#include "apps/lightfield_command.h"
#include "apps/option_values.h"
#include "apps/terminal.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/lumigraph/build.h"
#include "render/lightfield/lumigraph/depth_error.h"
#include "render/lightfield/lumigraph/quota.h"
#include "render/lightfield/lumigraph/slab.h"
#include "render/lightfield/slf/build.h"
#include "render/lightfield/slf/field_file.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory_use.h"
#include "surfel/base/stopwatch.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

namespace surflect {

namespace {

// ---------------------------------------------------------------------------------------------------------
// slf

struct SlfArguments {
  BuildArguments common;
  slf::BuildOptions options;
};

Json atlasJson(const slf::AtlasReport& atlas) {
  return {{"regions", atlas.regions},
          {"worst_cone_deg", atlas.worstCone},
          {"mean_cone_deg", atlas.meanCone},
          {"smallest_share", atlas.smallestShare},
          {"largest_share", atlas.largestShare},
          {"mean_stretch", atlas.meanStretch},
          {"high_stretch", atlas.highStretch},
          {"redundancy", atlas.redundancy},
          {"cost", atlas.cost}};
}

Json runSlf(const SlfArguments& arguments, const Progress& progress) {
  const Stopwatch watch;
  const lightfield::Views views = arguments.common.read(progress);
  sayNotes(views);
  const slf::BuildReport report = slf::build(views, arguments.options, arguments.common.output, progress);
  const slf::AtlasReport& atlas = report.atlas;
  say(fmt::format(
      "{} regions: normals within {:.0f} degrees of a region's axis on average, {:.0f} at worst; "
      "stretch {:.2f}, at most {:.1f} on 99 % of the surface; {:.2f} texels stored for each that is needed",
      atlas.regions, atlas.meanCone, atlas.worstCone, atlas.meanStretch, atlas.highStretch,
      atlas.redundancy));
  if (report.unseenRegions > 0)
    say(fmt::format("{} regions are seen by no photograph: filled from their neighbours, {} left black",
                    report.unseenRegions, report.blackRegions));
  say(fmt::format("{}: {} textures of {} in {} directions, {} texels of the surface, {}; {:.1f} s",
                  arguments.common.output, report.texturesStored, atlas.regions, arguments.options.directions,
                  report.surfaceTexels, mebibytes(report.bytes), watch.seconds()));
  return {{"format", "slf"},
          {"atlas", atlasJson(atlas)},
          {"photographs", report.photographs},
          {"texel_size", report.texelSize},
          {"pixel_footprint", report.pixelFootprint},
          {"direction_meshes", report.directionMeshes},
          {"textures", report.textures},
          {"textures_stored", report.texturesStored},
          {"surface_texels", report.surfaceTexels},
          {"texels", report.texels},
          {"unseen_texels", report.unseenTexels},
          {"unseen_regions", report.unseenRegions},
          {"black_regions", report.blackRegions},
          {"invented_share", report.inventedShare},
          {"bytes", report.bytes},
          {"seconds",
           {{"regions", report.regionSeconds},
            {"photographs", report.photographSeconds},
            {"visibility", report.visibilitySeconds},
            {"textures", report.textureSeconds},
            {"files", report.fileSeconds},
            {"all", watch.seconds()}}},
          {"memory_peak_bytes", memoryUse().peakBytes}};
}

void addSlf(CLI::App& build, CommandWork& work) {
  auto arguments = std::make_shared<SlfArguments>();
  slf::BuildOptions& options = arguments->options;
  CLI::App* command = build.add_subcommand("slf", "surface light field: textures of the mesh by direction");
  command->footer("Example: surflect lightfield build slf views/ -o vase.slf --directions 258");
  addBuildArguments(*command, arguments->common);
  command->add_option("--regions", options.regions, "texture regions that the mesh is cut into, about")
      ->capture_default_str()
      ->check(CLI::Range(size_t{1}, size_t{100'000}));
  command
      ->add_option(
          "--texels", options.texels,
          "texels of the surface in one direction; default: as fine as the photographs, 500000 at most")
      ->check(CLI::Range(size_t{1}, size_t{100'000'000}));
  command->add_option("--directions", options.directions, "sample directions of each region")
      ->capture_default_str()
      ->check(CLI::IsMember({size_t{6}, size_t{18}, size_t{66}, size_t{258}, size_t{1026}}));
  command
      ->add_option("--tolerance", options.tolerance,
                   "leave out directions that the others reproduce within this error, relative to white")
      ->check(finiteIn(1e-6, 1));
  command
      ->add_option(
          "--blend", options.blend,
          "photographs of a texel and direction: nearest one; ulr, the nearest ones by their angles; "
          "fitted, all by least squares")
      ->option_text("nearest, ulr or fitted")
      ->transform(CLI::Transformer(std::map<std::string, slf::Blend>{
          {"nearest", slf::Blend::nearest}, {"ulr", slf::Blend::ulr}, {"fitted", slf::Blend::fitted}}));
  setWork(*command, work, "run it again to build from the start",
          [arguments](const Progress& progress) { return runSlf(*arguments, progress); });
}

// ---------------------------------------------------------------------------------------------------------
// lumigraph

struct LumigraphArguments {
  BuildArguments common;
  lumigraph::BuildOptions options;
  std::string like; // folder of a surface light field
  double redundancy = 1;
};

// Texels of all slabs that match a surface light field.
size_t quotaOf(const LumigraphArguments& arguments, const Progress& progress) {
  if (arguments.like.empty()) return arguments.options.slabs.texels;
  const lightfield::LightFieldFolder field(arguments.like, slf::kFormatTag, slf::kFormatVersion, progress);
  const size_t texels = field.count("texels", 1, size_t{1} << 50);
  return lumigraph::kSlabs * lumigraph::slabQuota(texels, arguments.redundancy);
}

Json depthErrorsJson(const lumigraph::DepthErrors& errors) {
  return {{"lines", errors.lines},
          {"mean", errors.meanDepth},
          {"worst", errors.worstDepth},
          {"mean_offset_texels", errors.meanOffset},
          {"worst_offset_texels", errors.worstOffset}};
}

Json runLumigraph(LumigraphArguments& arguments, const Progress& progress) {
  const Stopwatch watch;
  arguments.options.slabs.texels = quotaOf(arguments, progress);
  const lightfield::Views views = arguments.common.read(progress);
  sayNotes(views);
  const lumigraph::BuildReport report =
      lumigraph::build(views, arguments.options, arguments.common.output, progress);
  size_t texels = 0;
  Json slabs = Json::array();
  for (const lumigraph::Slab& slab : report.slabs) {
    texels += slab.texels();
    slabs.push_back({{"axis", fmt::format("{}{}", slab.sign > 0 ? '+' : '-', "xyz"[slab.axis])},
                     {"st", slab.nodes},
                     {"uv", {slab.width, slab.height}}});
  }
  const auto total = static_cast<double>(report.texels.seen + report.texels.unseen + report.texels.missed);
  say(fmt::format(
      "{}: 6 slabs of {} x {} pictures, {} texels of {} at most, {:.0f} % of them on the object, {}; "
      "{:.1f} s",
      arguments.common.output, arguments.options.slabs.nodes, arguments.options.slabs.nodes, texels,
      arguments.options.slabs.texels, 100 * (1 - static_cast<double>(report.texels.missed) / total),
      mebibytes(report.bytes), watch.seconds()));
  if (report.blackPictures > 0)
    say(fmt::format("{} of {} pictures are black: no photograph sees the side of the object that they show",
                    report.blackPictures, 6 * arguments.options.slabs.nodes * arguments.options.slabs.nodes));
  if (report.errors)
    say(fmt::format("depth by {} triangles is wrong by {:.3g} on average, {:.3g} at worst: neighbouring "
                    "pictures show a point up to {:.2f} texels apart on average, {:.1f} at worst",
                    report.triangles, report.errors->meanDepth, report.errors->worstDepth,
                    report.errors->meanOffset, report.errors->worstOffset));
  return {{"format", "lumigraph"},
          {"slabs", slabs},
          {"texels", texels},
          {"texel_quota", arguments.options.slabs.texels},
          {"texels_seen", report.texels.seen},
          {"texels_unseen", report.texels.unseen},
          {"texels_missed", report.texels.missed},
          {"black_pictures", report.blackPictures},
          {"depth_triangles", report.triangles},
          {"depth_errors", report.errors ? depthErrorsJson(*report.errors) : Json()},
          {"bytes", report.bytes},
          {"seconds", report.seconds},
          {"memory_peak_bytes", memoryUse().peakBytes}};
}

void addLumigraph(CLI::App& build, CommandWork& work) {
  auto arguments = std::make_shared<LumigraphArguments>();
  lumigraph::BuildOptions& options = arguments->options;
  CLI::App* command =
      build.add_subcommand("lumigraph", "lumigraph: six slabs of two planes around the object");
  command->footer("Example: surflect lightfield build lumigraph views/ -o vase.lum --like vase.slf --st 7");
  addBuildArguments(*command, arguments->common);
  command->add_option("--st", options.slabs.nodes, "pictures of a slab along each side of its st grid")
      ->capture_default_str()
      ->check(CLI::Range(2, lumigraph::kMostNodes));
  CLI::Option* texels =
      command->add_option("--texels", options.slabs.texels, "of all slabs together, at most")
          ->capture_default_str()
          ->check(CLI::Range(size_t{1}, size_t{1} << 33));
  CLI::Option* like = command
                          ->add_option("--like", arguments->like,
                                       "a surface light field whose number of texels is the limit instead")
                          ->check(notEmpty())
                          ->excludes(texels);
  command
      ->add_option("--redundancy", arguments->redundancy,
                   "with --like: how often it counts as storing each texel; Azuma (1999) has 2")
      ->capture_default_str()
      ->check(finiteIn(1, 100))
      ->needs(like);
  command
      ->add_option("--triangles", options.triangles,
                   "simplify the geometry that corrects depth to so many; default: the whole mesh")
      ->check(CLI::Range(size_t{4}, size_t{1} << 31));
  command->add_flag("--nearest", options.resampling.nearest,
                    "take the nearest view for each ray, do not blend");
  setWork(*command, work, "run it again to build from the start",
          [arguments](const Progress& progress) { return runLumigraph(*arguments, progress); });
}

} // namespace

lightfield::Views BuildArguments::read(const Progress& progress, bool plainPinholes) const {
  requireCreatable(output);
  lightfield::requireLightFieldFolder(output);
  return lightfield::Views(views.path, {.mesh = mesh, .paths = views.outside, .plainPinholes = plainPinholes},
                           progress);
}

void sayNotes(const lightfield::Views& views) {
  for (const std::string& note : views.capture().notes) say(note);
  for (const std::string& note : views.geometry().notes) say(note);
}

void addBuildArguments(CLI::App& command, BuildArguments& arguments) {
  command
      .add_option("views", arguments.views.path,
                  "capture under fixed light: folder with transforms.json, or a JSON file")
      ->required();
  addAllowOutside(command, arguments.views.outside);
  command.add_option("--mesh", arguments.mesh, "mesh that replaces the capture's")->check(notEmpty());
  command.add_option("-o,--output", arguments.output, "folder of the light field")
      ->required()
      ->check(notEmpty());
}

void addCoarseMesh(CLI::App& command, bool& hull, size_t& triangles) {
  command.add_flag("--hull", hull, "an opacity hull from the views' alpha, instead of the capture's mesh");
  command.add_option("--triangles", triangles, "simplify the mesh to so many, around it; default: as it is")
      ->check(CLI::Range(size_t{4}, size_t{1} << 31));
}

void addVisible(CLI::App& command, std::optional<olf::Visible>& visible) {
  command
      .add_option("--visible", visible,
                  "views of a vertex: ring, those that see all triangles around it; all, hidden or not; "
                  "default: all for an opacity hull, ring for a mesh")
      ->option_text("ring or all")
      ->transform(CLI::Transformer(
          std::map<std::string, olf::Visible>{{"ring", olf::Visible::ring}, {"all", olf::Visible::all}}));
}

void addMapSizes(CLI::App& command, int& samples, int& viewSize) {
  command
      .add_option("--samples", samples,
                  "samples along an edge of a triangle; default: as fine as the photographs")
      ->check(CLI::Range(2, 256));
  command.add_option("--view-size", viewSize, "cells of a view map along each side")
      ->capture_default_str()
      ->check(CLI::Range(lfm::kLeastViewSize, lfm::kLargestViewSize));
}

std::string mebibytes(uint64_t bytes) {
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / (1 << 20));
}

uint64_t pictureBytes(const lightfield::Views& views) {
  uint64_t bytes = 0;
  for (const size_t view : views.ofSplit(capture::Split::train)) {
    std::error_code failure;
    const uint64_t size = std::filesystem::file_size(views.picture(view), failure);
    if (!failure) bytes += size;
  }
  return bytes;
}

double ratioOf(uint64_t whole, size_t part) {
  return part > 0 ? static_cast<double>(whole) / static_cast<double>(part) : 0;
}

Json mapBytesJson(const lfm::MapBytes& bytes) {
  return {{"surface", bytes.surface}, {"view", bytes.view},     {"mean", bytes.mean},
          {"indices", bytes.indices}, {"scales", bytes.scales}, {"all", bytes.total()}};
}

void addLightFieldBuild(CLI::App& lightField, CommandWork& work) {
  CLI::App* command = lightField.add_subcommand("build", "make a light field from views under fixed light");
  command->require_subcommand(1);
  addSlf(*command, work);
  addLumigraph(*command, work);
  addLightFieldMaps(*command, work);
  addSphericalLightField(*command, work);
  addOpacityLightFields(*command, work);
  addOpacityLightFieldMaps(*command, work);
}

} // namespace surflect
