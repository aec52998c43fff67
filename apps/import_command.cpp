#include "apps/command.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "srf/import/import.h"

#include <fmt/format.h>

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
  std::string source, output, images, lights, cameraPlaces;
  std::vector<double> flash;
  importers::ImportFormat format{};
  capture::ColorSpace colorSpace{};
  double fieldOfViewDegrees = 0, maskThreshold = 0;
  importers::ImportOptions options;
};

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
  command->footer("Example: surflect import temple/templeSR_par.txt -o temple --test-every 8");
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
                      "--pattern \"name x y z\" lines");
  command
      ->add_option(
          "--camera-places", arguments->cameraPlaces,
          "known places of cameras, \"name x y z\" lines: poses are brought to their world and units")
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
          "each photograph is lit from the camera: place of the flash, right, up and backwards, scene units")
      ->expected(3)
      ->option_text("X Y Z")
      ->excludes(pattern);
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
  CLI::Option* threshold =
      command
          ->add_option("--mask-threshold", arguments->maskThreshold,
                       "make masks: brighter than this share of the view's 99.5th percentile, linear")
          ->check(finiteIn(0, 1));
  command->add_flag("--invert-masks", options.invertMasks, "of the source: black is the object, not white")
      ->excludes(threshold);
  command->add_flag("--fix-premult", options.fixPremult,
                    "of PNG with alpha: their colours are multiplied by it, and are divided");
  CLI::Option* colorSpace =
      command
          ->add_option("--color-space", arguments->colorSpace,
                       "of all pictures; default: what each file says, else 8 bits are sRGB")
          ->transform(CLI::Transformer(kColorSpaces))
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
    if (*threshold) chosen.maskThreshold = arguments->maskThreshold;
    if (*colorSpace) chosen.colorSpace = arguments->colorSpace;
    chosen.images = arguments->images;
    chosen.lights = arguments->lights;
    chosen.cameraPlaces = arguments->cameraPlaces;
    chosen.lamps.lights = arguments->lights;
    chosen.lamps.positions = chosen.litView.positions;
    if (const auto& at = arguments->flash; !at.empty()) chosen.lamps.flash = {at[0], at[1], at[2]};
    return runImport(*arguments, progress);
  });
}

} // namespace surflect
