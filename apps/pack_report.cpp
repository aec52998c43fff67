#include "apps/pack_report.h"

#include "apps/terminal.h"
#include "surfel/base/error.h"
#include "surfel/base/memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

namespace surflect {

namespace {

const char* nameOf(validation::Finding::Severity severity) {
  return severity == validation::Finding::Severity::error ? "error" : "warning";
}

} // namespace

void announce(std::span<const validation::Finding> findings) {
  for (const validation::Finding& finding : findings)
    say(fmt::format("{}: {}", nameOf(finding.severity), finding.text));
}

Json jsonOf(std::span<const validation::Finding> findings) {
  Json list = Json::array();
  for (const validation::Finding& finding : findings)
    list.push_back({{"severity", nameOf(finding.severity)}, {"text", finding.text}});
  return list;
}

BuildFindings::BuildFindings(std::string source, std::string inspectArguments, bool force)
    : source_(std::move(source)), inspectArguments_(std::move(inspectArguments)), force_(force) {}

void BuildFindings::take(std::span<const validation::Finding> found) {
  announce(found);
  all_.insert(all_.end(), found.begin(), found.end());
  const auto errors =
      std::ranges::count(found, validation::Finding::Severity::error, &validation::Finding::severity);
  if (errors > 0 && !force_)
    throw Error(fmt::format("stopped by {} error{}, see above; no model was made. surflect inspect {} "
                            "--overlay sheet.png shows {}; --force packs anyway",
                            errors, errors == 1 ? "" : "s", inspectArguments_, errors == 1 ? "it" : "them"))
        .in(source_);
}

namespace {

// Prints "C00 0.994, C01 0.991, ..", wrapped at the line width.
void announceEach(std::span<const proxy::Impostor::Fit> fits) {
  constexpr size_t kWidth = 100;
  std::string line;
  for (const auto& fit : fits) {
    const std::string entry = fmt::format("{} {:.3f}", fit.view, fit.intersectionOverUnion);
    if (!line.empty() && line.size() + 2 + entry.size() > kWidth) {
      say(line + ",");
      line.clear();
    }
    line += (line.empty() ? "  " : ", ") + entry;
  }
  say(line);
}

constexpr double kHullFits = 0.8; // least median intersection over union of mattes that agree

// Prints how well a hull fits the mattes: the median and the worst three views, then all.
void announceFits(std::vector<proxy::Impostor::Fit> fits) {
  const std::vector<proxy::Impostor::Fit> inOrder = fits;
  std::ranges::stable_sort(fits, {}, &proxy::Impostor::Fit::intersectionOverUnion);
  std::string worst, leftOut;
  for (size_t i = 0; i < fits.size(); ++i) {
    if (i < 3) worst += fmt::format(" {} {:.3f}", fits[i].view, fits[i].intersectionOverUnion);
    if (fits[i].leftOut) leftOut += " " + fits[i].view;
  }
  const double median = fits[fits.size() / 2].intersectionOverUnion;
  say(fmt::format("geometry: visual hull of {} mattes; silhouettes agree to {:.3f} IoU (median), worst:{}",
                  fits.size(), median, worst));
  if (median < kHullFits)
    say(fmt::format(
        "warning: no hull fits the mattes: found {:.3f} IoU, expected {} or more; lenses, poses or "
        "mattes are wrong",
        median, kHullFits));
  announceEach(inOrder);
  say("a hull fills hollows, which outlines do not show, so that details slide there; "
      "a mesh of photogrammetry, such as COLMAP's, is better: --mesh");
  if (!leftOut.empty()) say("mattes left out, for they cut away what others show:" + leftOut);
}

Json jsonOfChoice(const model::LightBlendSelection& choice) {
  Json json = {{"lights", choice.blend.lights},
               {"fit", nameOf(choice.blend.fit)},
               {"foreshortened", choice.blend.foreshortened}};
  if (choice.leftOutDb) json["left_out_srgb_db"] = *choice.leftOutDb;
  return json;
}

Json jsonOfChoice(const model::InterpolationSelection& selection) {
  Json json = {{"kind", nameOf(selection.choice.kind)},
               {"half_scale", std::round(selection.choice.halfScale * 1e4) / 1e4},
               {"reciprocal", selection.choice.reciprocal},
               {"shadows", selection.choice.shadows}};
  if (selection.leftOut) {
    json["left_out_db"] = selection.leftOut->chosenDb;
    json["left_out_separate_db"] = selection.leftOut->separateDb;
  }
  return json;
}

// Errors of predicted photographs (dB) in words. Leaving one out doubles the gap that it stood in, so that
// new cameras and lights between the captured ones do better.
constexpr double kGoodDb = 30, kFairDb = 24, kDoubtfulDb = 15;
const char* gradeOf(double db) { return db >= kGoodDb ? "good" : db >= kFairDb ? "fair" : "poor"; }
// Advice at the end of a message about predicted photographs; `sparse` names what stands too far apart.
std::string adviceOf(double db, std::string_view sparse) {
  if (db >= kGoodDb) return "";
  if (db < kDoubtfulDb) return "; are lamps, poses and masks right? inspect --overlay shows them";
  return fmt::format("; {} nearer to each other would make it better", sparse);
}

void announceLights(const model::LightBlendSelection& selection) {
  if (!selection.leftOutDb) return;
  const double db = *selection.leftOutDb;
  say(fmt::format(
      "new lights: blended from {} captured ones; photographs of a light that was left out are predicted "
      "to {:.1f} dB ({}){}",
      selection.blend.lights, db, gradeOf(db), adviceOf(db, "lights")));
}

void announceInterpolation(const model::InterpolationSelection& selection) {
  if (!selection.leftOut) return;
  const auto& [chosen, separate] = *selection.leftOut;
  const auto text = [](weights::Interpolation kind) -> std::string {
    if (kind == weights::Interpolation::separate) return "camera and light separately";
    return "kriging over cameras and lights together";
  };
  const auto& [kind, half, reciprocal, shadows, otherwise] = selection.choice;
  const bool isShared = kind == weights::Interpolation::shared;
  const double db = kind == weights::Interpolation::separate ? separate : chosen;
  say(fmt::format("new views: {}; photographs that were left out are predicted to {:.1f} dB ({}){}",
                  isShared
                      ? "answered by tables that surfels of a kind share, else weighted by " + text(otherwise)
                      : "weighted by " + text(kind),
                  db, gradeOf(db), adviceOf(db, "cameras and lights")));
}

} // namespace

Json jsonOf(const model::PackReport& report) {
  Json json = {
      {"geometry", nameOf(report.geometry)},
      {"surfels", report.surfels},
      {"pixels_between_surfels", report.pixelsBetweenSurfels},
      {"grid_step", report.gridStep},
      {"views", report.views.size()},
      {"lights", report.lights},
      {"translucent", report.isTranslucent},
      {"resumed_views", report.resumedViews},
      {"invalid_texels", report.invalidTexels},
      {"white", report.white},
      {"light_blend", jsonOfChoice(report.lightChoice)},
      {"interpolation", jsonOfChoice(report.interpolation)},
      {"seconds",
       {{"surfels", report.surfelSeconds}, {"fades", report.fadeSeconds}, {"store", report.storeSeconds}}},
      {"memory_peak_bytes", memoryUse().peakBytes}};
  json["store"] = {{"bytes", report.store.fileBytes},
                   {"object_texels", report.store.objectTexels},
                   {"ratio_to_half", codec::compressionRatio(report.store)},
                   {"blocks_of_rank", report.store.blocksOfRank}};
  if (!report.meshNotes.empty()) json["mesh_notes"] = report.meshNotes;
  for (const auto& fit : report.fits)
    json["silhouettes"].push_back(
        {{"view", fit.view}, {"iou", fit.intersectionOverUnion}, {"left_out", fit.leftOut}});
  json["store"]["psnr_linear_db"] = codec::psnrDb(report.store, report.white);
  for (size_t view = 0; view < report.views.size(); ++view)
    json["store"]["views"].push_back({{"view", report.views[view]},
                                      {"bytes", report.ofView[view].fileBytes},
                                      {"ratio_to_half", codec::compressionRatio(report.ofView[view])},
                                      {"psnr_linear_db", codec::psnrDb(report.ofView[view], report.white)}});
  return json;
}

std::string sparseSurfels(size_t surfels, double pixelsBetween) {
  constexpr double kEnough = 0.75, kTwoAcross = 0.5; // pixels
  constexpr double kMost{model::kMostSurfels};
  if (!std::isfinite(pixelsBetween) || pixelsBetween <= kEnough) return "";
  const double ratio = pixelsBetween / kTwoAcross,
               wanted = std::ceil(1e-4 * static_cast<double>(surfels) * ratio * ratio) * 1e4;
  return fmt::format(
      "warning: surfels are {:.1f} pixels of the photographs apart, so that finer details blur; two "
      "across a pixel are {:.0f}, which take {:.1f} GB of memory to sample{}",
      pixelsBetween, wanted, 1e-9 * wanted * model::kBytesPerSurfel,
      wanted <= kMost ? fmt::format(": --surfels {:.0f}", wanted)
                      : fmt::format("; --surfels allows {:.0f} at most", kMost));
}

void announceEstimate(const model::PackEstimate& estimate) {
  say(fmt::format("about {:.1f} MB on disk, {:.0f} MB of memory, {:.0f} s; {} surfels",
                  static_cast<double>(estimate.diskBytes) / 1e6,
                  static_cast<double>(estimate.memoryBytes) / 1e6, estimate.seconds, estimate.surfels));
}

void announce(const model::PackReport& report, const std::string& output) {
  if (!report.fits.empty()) announceFits(report.fits);
  if (report.invalidTexels > 0)
    say(fmt::format("{} texels were not finite and are black now", report.invalidTexels));
  const std::string grid =
      report.gridStep > 0
          ? fmt::format(", at corners of {0} x {0} pixels that are drawn one by one", report.gridStep)
          : "";
  say(fmt::format("{}: {} surfels on a {}{}, {} views{}; {:.1f} MB of reflectance, {:.1f}:1 against half "
                  "floats at {:.1f} dB",
                  output, report.surfels, nameOf(report.geometry), grid, report.views.size(),
                  report.resumedViews > 0 ? fmt::format(" ({} were there already)", report.resumedViews) : "",
                  static_cast<double>(report.store.fileBytes) / 1e6, codec::compressionRatio(report.store),
                  codec::psnrDb(report.store, report.white)));
  if (report.isTranslucent) say("translucent: alpha of each view is stored, and layers are composited");
  const std::string warning =
      report.gridStep > 0 ? "" : sparseSurfels(report.surfels, report.pixelsBetweenSurfels);
  if (!warning.empty()) say(warning);
  if (report.interpolation.choice.kind == weights::Interpolation::separate)
    announceLights(report.lightChoice);
  announceInterpolation(report.interpolation);
}

} // namespace surflect
