#include "apps/capture_argument.h"
#include "apps/terminal.h"
#include "srf/model/pack.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace surflect {

namespace {

struct Arguments {
  CaptureArgument capture;
  std::string output;
  PackOptions options;
  size_t surfels = 0;
};

void announceEstimate(const PackEstimate& estimate) {
  say(fmt::format("about {:.1f} MB on disk, {:.0f} MB of memory, {:.0f} s; {} surfels",
                  static_cast<double>(estimate.diskBytes) / 1e6,
                  static_cast<double>(estimate.memoryBytes) / 1e6, estimate.seconds, estimate.surfels));
}

// How well a hull fits the mattes: the median view, and the worst three.
void announceFits(std::vector<Impostor::Fit> fits) {
  std::ranges::stable_sort(fits, {}, &Impostor::Fit::intersectionOverUnion);
  std::string worst, leftOut;
  for (size_t i = 0; i < fits.size(); ++i) {
    if (i < 3) worst += fmt::format(" {} {:.3f}", fits[i].view, fits[i].intersectionOverUnion);
    if (fits[i].leftOut) leftOut += " " + fits[i].view;
  }
  say(fmt::format("geometry: visual hull of {} mattes; silhouettes agree to {:.3f} IoU (median), worst:{}",
                  fits.size(), fits[fits.size() / 2].intersectionOverUnion, worst));
  if (!leftOut.empty()) say("mattes left out, for they cut away what others show:" + leftOut);
}

Json jsonOf(const LightChoice& choice) {
  Json json = {{"lights", choice.blend.lights}, {"fit", nameOf(choice.blend.fit)}};
  if (choice.leftOutDb) json["left_out_srgb_db"] = *choice.leftOutDb;
  return json;
}

Json reportOf(const PackReport& report) {
  Json json = {
      {"geometry", nameOf(report.geometry)},
      {"surfels", report.surfels},
      {"views", report.views},
      {"lights", report.lights},
      {"resumed_views", report.resumedViews},
      {"invalid_texels", report.invalidTexels},
      {"white", report.white},
      {"light_blend", jsonOf(report.lightChoice)},
      {"seconds",
       {{"surfels", report.surfelSeconds}, {"fades", report.fadeSeconds}, {"store", report.storeSeconds}}},
      {"memory_peak_bytes", memoryUse().peakBytes}};
  json["store"] = {{"bytes", report.store.fileBytes},
                   {"object_texels", report.store.objectTexels},
                   {"ratio_to_half", compressionRatio(report.store)},
                   {"blocks_of_rank", report.store.blocksOfRank}};
  for (const auto& fit : report.fits)
    json["silhouettes"].push_back(
        {{"view", fit.view}, {"iou", fit.intersectionOverUnion}, {"left_out", fit.leftOut}});
  if (report.resumedViews == 0) json["store"]["psnr_linear_db"] = psnrDb(report.store, report.white);
  return json;
}

Json runPack(const Arguments& arguments, const Progress& progress) {
  PackOptions options = arguments.options;
  if (arguments.surfels > 0) options.surfels = arguments.surfels;
  const PackReport report =
      pack(arguments.capture.read(), arguments.output, options, progress, announceEstimate);
  if (!report.fits.empty()) announceFits(report.fits);
  if (report.invalidTexels > 0)
    say(fmt::format("{} texels were not finite and are black now", report.invalidTexels));
  const std::string error = report.resumedViews == 0
                                ? fmt::format(" at {:.1f} dB", psnrDb(report.store, report.white))
                                : fmt::format("; {} views were there already", report.resumedViews);
  say(fmt::format(
      "{}: {} surfels on a {}, {} views; {:.1f} MB of reflectance, {:.1f}:1 against half floats{}",
      arguments.output, report.surfels, nameOf(report.geometry), report.views,
      static_cast<double>(report.store.fileBytes) / 1e6, compressionRatio(report.store), error));
  if (const auto& [blend, leftOutDb] = report.lightChoice; leftOutDb)
    say(fmt::format("lights: {} blended, by a {}; one left out is told by the others to {:.1f} dB",
                    blend.lights, nameOf(blend.fit), *leftOutDb));
  return reportOf(report);
}

} // namespace

void addPackCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("pack", "make a model from a capture; run again to resume");
  command->footer("Example: surflect pack examples/vase -o vase.srf --tolerance 0.02");
  addCaptureArgument(*command, arguments->capture);
  command->add_option("-o,--output", arguments->output, "the model's folder")->required();
  CLI::Option* mesh = command->add_option("--mesh", arguments->options.impostor.mesh,
                                          "impostor geometry (PLY or OBJ) instead of the capture's");
  command
      ->add_flag("--relief", arguments->options.impostor.relief,
                 "geometry from shading, for a capture of one view under three lights or more")
      ->excludes(mesh);
  command->add_option("--tolerance", arguments->options.tolerance, "relative error of every block")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--surfels", arguments->surfels, "how many, about; default: two across a pixel")
      ->check(CLI::Range(size_t{1}, size_t{100000000}));
  setWork(*command, work, "the same command again goes on from here",
          [arguments](const Progress& progress) { return runPack(*arguments, progress); });
}

} // namespace surflect
