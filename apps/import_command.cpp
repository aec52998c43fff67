#include "apps/command.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "srf/import/import.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>

namespace surflect {

namespace {

const std::map<std::string, importers::ImportFormat> kFormats{
    {"colmap", importers::ImportFormat::colmap},
    {"metashape", importers::ImportFormat::metashape},
    {"json", importers::ImportFormat::transforms},
    {"middlebury", importers::ImportFormat::middlebury},
    {"lights", importers::ImportFormat::lights}};
const std::map<std::string, capture::ColorSpace> kColorSpaces{{"linear", capture::ColorSpace::linear},
                                                              {"srgb", capture::ColorSpace::srgb}};

struct ImportArguments {
  std::string source, output, images, mesh, lights, cameraPlaces, chromeBall;
  std::vector<std::string> flash;
  importers::ImportFormat format{};
  capture::ColorSpace colorSpace{};
  std::string maskFrom;
  double fieldOfViewDegrees = 0, maskMargin = 0;
  importers::ImportOptions options;
};

template <class Value> std::vector<std::string> namesIn(const std::map<std::string, Value>& words) {
  std::vector<std::string> names;
  for (const auto& [name, value] : words) names.push_back(name);
  return names;
}

// Reads the values of --flash: "auto", or three numbers.
void readFlash(const std::vector<std::string>& words, importers::LampOptions& lamps) {
  if (words.empty()) return;
  if (words.size() == 1 && words[0] == "auto") {
    lamps.findFlash = true;
    return;
  }
  Vec3<double> at;
  size_t numbers = 0;
  for (const std::string& word : words) {
    const char* const end = word.data() + word.size();
    double value = 0;
    const auto [rest, problem] = std::from_chars(word.data(), end, value);
    if (problem == std::errc() && rest == end && std::isfinite(value))
      at[static_cast<int>(numbers++)] = value;
  }
  if (words.size() != 3 || numbers != 3) {
    std::string found;
    for (const std::string& word : words) found += (found.empty() ? "" : " ") + word;
    throw UsageError(Error::mismatch("three numbers X Y Z, or auto", found).at("--flash"));
  }
  lamps.flash = at;
}

// Whether a source has poses of its own; a folder of photographs alone has no format.
bool hasPoses(const std::string& source) {
  try {
    return importers::formatOfSource(source, {}) != importers::ImportFormat::lights;
  } catch (const Error&) {
    return false;
  }
}

// Throws UsageError for options that contradict each other about the lights.
void requireOneTelling(const ImportArguments& arguments, bool hasFormat) {
  const importers::ImportOptions& options = arguments.options;
  const bool hasBall = !arguments.chromeBall.empty(), hasPattern = !options.lamps.pattern.empty();
  const bool hasLights = !arguments.lights.empty();
  if (hasLights + hasBall + !options.lamps.lampImages.empty() > 1)
    throw UsageError(Error("only one of --lights, --chrome-ball and --lamp-images tells the lamps"));
  if (!arguments.flash.empty() && (hasLights || hasBall))
    throw UsageError(Error(std::string("the camera carries the light; ") +
                           (hasBall ? "--chrome-ball" : "--lights") + " tells others")
                         .at("--flash"));
  if (options.litView.positions && hasBall)
    throw UsageError(
        Error("a mirror ball has no light file whose numbers could be positions").at("--positions"));
  if (!hasBall || hasPattern || hasFormat) return;
  std::error_code ignored; // a missing source is reported by the import
  if (!std::filesystem::exists(arguments.source, ignored)) return;
  if (!std::filesystem::is_directory(arguments.source, ignored))
    throw UsageError(Error::mismatch("a folder of photographs, or --pattern beside poses", arguments.source)
                         .at("--chrome-ball"));
  if (hasPoses(arguments.source))
    throw UsageError(
        Error("needs --pattern, which tells cameras and lights, as " + arguments.source + " has poses")
            .at("--chrome-ball"));
}

std::string nameOf(importers::ImportFormat format) {
  for (const auto& [name, named] : kFormats)
    if (named == format) return name;
  return "";
}

Json runImport(const ImportArguments& arguments, const Progress& progress) {
  const importers::ImportReport report =
      importers::importCapture(arguments.source, arguments.output, arguments.options, progress);
  for (const std::string& note : report.notes) say(note);
  say(fmt::format("{}: {} views, {} lights, {} photographs to train and {} to test with; {:.1f} MB",
                  arguments.output, report.views, report.lights, report.trainingFrames, report.testFrames,
                  static_cast<double>(report.bytes) / 1e6));
  return {{"format", nameOf(report.format)},
          {"views", report.views},
          {"lights", report.lights},
          {"training_frames", report.trainingFrames},
          {"test_frames", report.testFrames},
          {"pictures", report.pictures},
          {"masks", report.masks},
          {"bytes", report.bytes},
          {"notes", report.notes}};
}

} // namespace

void addImportCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<ImportArguments>();
  importers::ImportOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand("import", "make a capture folder of other people's formats");
  command->footer("Example: surflect import templeSparseRing/templeSR_par.txt -o temple --test-every 8");
  command
      ->add_option(
          "source", arguments->source,
          "COLMAP, Metashape XML, NeRF JSON, Middlebury, RTI (.lp) or photometric stereo: a folder or file")
      ->required();
  command->add_option("-o,--output", arguments->output, "the capture's folder; new, or empty")
      ->required()
      ->check(notEmpty());
  CLI::Option* format = command->add_option("--format", arguments->format, "instead of a guess")
                            ->transform(CLI::Transformer(kFormats))
                            ->transform(oneOf(namesIn(kFormats)))
                            ->option_text("colmap, metashape, json, middlebury or lights");
  command->add_option("--images", arguments->images,
                      "pictures of COLMAP or Metashape; default: SOURCE/images");
  command
      ->add_option("--chunks", options.chunks,
                   "Metashape: labels of chunks that it has aligned with each other: NAME,NAME..; default: "
                   "the largest")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--lights", arguments->lights,
                      "light file of a folder of photographs: .lp, or \"x y z\" lines or columns; beside "
                      "--pattern \"name x y z\" lines, or auto: from the shading of the mesh");
  command
      ->add_option(
          "--camera-places", arguments->cameraPlaces,
          "known places of cameras, \"name x y z\" lines: poses are brought to their world and units")
      ->check(notEmpty());
  command->add_option("--mesh", arguments->mesh, "the object's mesh (PLY or OBJ), in the world of the poses")
      ->check(notEmpty());
  CLI::Option* pattern =
      command
          ->add_option(
              "--pattern", options.lamps.pattern,
              "how names of pictures tell camera and light: {camera}/{light}.jpg; poses are those of "
              "registered pictures, lights those of --lights")
          ->check(notEmpty());
  command
      ->add_option(
          "--flash", arguments->flash,
          "each photograph is lit from the camera: place of the flash, right, up and backwards, scene units; "
          "or auto: from the shading of the mesh")
      ->expected(1, 3)
      ->option_text("X Y Z | auto")
      ->excludes(pattern);
  command
      ->add_option("--lamp-images", options.lamps.lampImages,
                   "beside --pattern: names of registered pictures that were taken where a lamp stands, "
                   "lamps/{light}.jpg")
      ->check(notEmpty())
      ->needs(pattern);
  command
      ->add_option(
          "--chrome-ball", arguments->chromeBall,
          "pictures of a mirror ball under the same lights: instead of a light file, in the order of "
          "the photographs, or named as these beside --pattern")
      ->check(notEmpty());
  command->add_flag("--positions", options.litView.positions,
                    "the light file gives positions in scene units, not directions");
  CLI::Option* fieldOfView =
      command
          ->add_option(
              "--fov", arguments->fieldOfViewDegrees,
              "vertical field of view in degrees of the one view of a light file; default: orthographic")
          ->check(finiteIn(0.01, 179));
  command
      ->add_option("--height", options.litView.height,
                   "what the picture of a light file shows at the object, scene units")
      ->capture_default_str()
      ->check(finiteIn(1e-6, 1e6));
  command->add_option("--test", options.test, "cameras or lights to hold out: NAME,NAME..")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option("--test-every", options.testEvery,
                   "hold out each Nth camera, or light where there is one view")
      ->check(wholeIn(1, 1000000000));
  CLI::Option* maskFrom =
      command
          ->add_option(
              "--mask-from", arguments->maskFrom,
              "make masks: brightness:SHARE of the view's 99.5th percentile, linear; plate:PICTURE or "
              "plate:FOLDER of the empty scene; key: a background of the borders' colour, or key:#rrggbb, "
              "key:r,g,b; mesh: that of --mesh, of the source, or beside it")
          ->check([](const std::string& text) -> std::string {
            try {
              importers::parseMaskMaking(text);
              return "";
            } catch (const Error& error) {
              return error.what();
            }
          })
          ->option_text("brightness:SHARE, plate:PATH, key[:COLOR] or mesh");
  command
      ->add_option("--mask-margin", arguments->maskMargin,
                   "pixels by which made masks grow; negative: shrink, as against fringes of the background")
      ->capture_default_str()
      ->check(finiteIn(-100, 100))
      ->needs(maskFrom);
  command->add_flag("--invert-masks", options.invertMasks, "of the source: black is the object, not white")
      ->excludes(maskFrom);
  command->add_flag("--fix-premult", options.fixPremult,
                    "of PNG with alpha: their colours are multiplied by it, and are divided");
  CLI::Option* colorSpace =
      command
          ->add_option("--color-space", arguments->colorSpace,
                       "of all pictures; default: what each file says, else 8 bits are sRGB")
          ->transform(CLI::Transformer(kColorSpaces))
          ->transform(oneOf(namesIn(kColorSpaces)))
          ->option_text("linear or srgb");
  command
      ->add_flag("--recover-response", options.recoverResponse,
                 "tell the camera's response from exposure brackets [Debevec and Malik 1997]")
      ->excludes(colorSpace);
  command->add_flag("--uneven-lights", options.unevenLights,
                    "where strengths are estimated: also how each light falls off over the object");
  command->add_flag("--allow-outside", options.allowOutside, "follow paths that leave the source's folder");
  setWork(*command, work, "nothing was kept; the same command starts afresh", [=](const Progress& progress) {
    importers::ImportOptions& chosen = arguments->options;
    if (*format) chosen.format = arguments->format;
    if (*fieldOfView) chosen.litView.fieldOfView = Angle::fromDegrees(arguments->fieldOfViewDegrees);
    if (*maskFrom) {
      chosen.masks = importers::parseMaskMaking(arguments->maskFrom);
      chosen.masks->margin = arguments->maskMargin;
    }
    if (*colorSpace) chosen.colorSpace = arguments->colorSpace;
    chosen.images = arguments->images;
    chosen.lights = arguments->lights;
    chosen.cameraPlaces = arguments->cameraPlaces;
    chosen.lamps.lights = arguments->lights;
    chosen.lamps.positions = chosen.litView.positions;
    chosen.mesh = arguments->mesh;
    if (arguments->lights == "auto") {
      if (chosen.lamps.pattern.empty())
        throw UsageError(
            Error("auto needs --pattern, which tells the lamps of the photographs").at("--lights"));
      chosen.lamps.findLamps = true;
      chosen.lights.clear();
      chosen.lamps.lights.clear();
    }
    chosen.lamps.chromeBall = chosen.litView.chromeBall = arguments->chromeBall;
    requireOneTelling(*arguments, !format->empty());
    readFlash(arguments->flash, chosen.lamps);
    return runImport(*arguments, progress);
  });
}

} // namespace surflect
