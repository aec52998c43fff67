// Measures the claims of [Weyrich 2005] and prints them as JSON:
//
//   claims FOLDER    FOLDER, which is not there yet, gets captures, models and pictures
#include "bench/claims/fibre_azimuth.h"
#include "bench/claims/impostor_limit.h"
#include "bench/claims/texture_parallax.h"
#include "render/evaluation/label.h"
#include "render/stage/material/shading.h"
#include "srf/image/color.h"
#include "srf/image/png.h"
#include "surfel/base/error.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstdio>

namespace surflect::bench {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kFibreShears[] = {0.1, 0.25, 0.5, 0.75, 1};
constexpr double kDistances[] = {0.2, 0.1, 0.05, 0.025, 0.0125, 0};

Json impostorLimit() {
  const Vec3<double> middle(0, 0, 0), z(0, 0, 1);
  const std::pair<const char*, warp::WarpPointer> warps[] = {
      {"rigid",
       warp::rigidWarp(Vec3<double>(1, 2, 3).normalized(), Angle::fromDegrees(70), middle, {1, -2, 0.5})},
      {"twist", warp::twistWarp(z, Angle::fromDegrees(40), middle)},
      {"bend", warp::bendWarp(z, Vec3<double>(1, 0, 0), Angle::fromDegrees(25), middle)},
      {"stretch", warp::scaleWarp({1, 1, 1.5}, middle)}};
  Json report;
  for (const auto& [name, warp] : warps)
    for (const double distance : kDistances) {
      const LimitError error = limitError(*warp, distance, 4000, 1);
      report[name].push_back({{"distance", distance},
                              {"error", error.radiance},
                              {"shift", error.shift},
                              {"turn_deg", Angle::fromRadians(error.turn).degrees()},
                              {"queries", error.queries}});
    }
  return report;
}

Json textureParallax(const fs::path& folder) {
  const Angle theta = Angle::fromDegrees(35);
  Json report = Json::array();
  for (const double height : {0.05, 0.1, 0.2})
    for (const Vec3<double>& factors :
         {Vec3<double>(1.25, 1, 1), Vec3<double>(1.5, 1, 1), Vec3<double>(1.5, 1.5, 1.5)})
      report.push_back({{"height", height},
                        {"stretch", {factors.x(), factors.y(), factors.z()}},
                        {"stated", statedParallax(height, theta, factors)},
                        {"measured", measuredParallax(height, theta, factors,
                                                      folder / fmt::format("parallax-{}", report.size()))}});
  return report;
}

// Rows of pictures, each twice as large, white at its row's first picture's largest value.
void writeRows(const fs::path& path,
               const std::vector<std::vector<std::pair<std::string, image::Image>>>& rows) {
  constexpr int kZoom = 2, kHead = 3 * evaluation::kLabelHeight, kGap = 4;
  const int side = kZoom * rows[0][0].second.width;
  image::Image sheet(static_cast<int>(rows[0].size()) * (side + kGap) - kGap,
                     static_cast<int>(rows.size()) * (side + kHead), 3);
  std::ranges::fill(sheet.values, 1.f);
  for (size_t row = 0; row < rows.size(); ++row) {
    const int top = static_cast<int>(row) * (side + kHead);
    const float white = *std::ranges::max_element(rows[row][0].second.values);
    int left = 0;
    for (const auto& [label, picture] : rows[row]) {
      evaluation::drawLabel(sheet, left, top + evaluation::kLabelHeight / 2, label, {0, 0, 0}, 2);
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
          std::ranges::fill(
              sheet.at(left + x, top + kHead + y),
              image::srgbFromLinear(std::clamp(picture.at(x / kZoom, y / kZoom)[0] / white, 0.f, 1.f)));
      left += side + kGap;
    }
  }
  image::writePng(path, sheet);
}

Json fibreAzimuth(const fs::path& folder) {
  const FrameOf polar = polarFrame<double>, bisector = bisectorFrame<double>;
  Json report = Json::array();
  std::vector<std::vector<std::pair<std::string, image::Image>>> rows;
  for (const double degrees : {0.0, 90.0}) {
    const Angle fibre = Angle::fromDegrees(degrees);
    const BrushedPlate plate(fibre, folder / fmt::format("fibre-{:.0f}", degrees));
    for (const double shear : kFibreShears) {
      const image::Image truth = plate.truth(shear), byPolar = plate.rendered(polar, shear),
                         byBisector = plate.rendered(bisector, shear);
      const auto after = [&](const FrameOf& frameOf) {
        return degrees + turnUnderShear(frameOf, shear, Angle()).degrees();
      };
      report.push_back({{"fibre_deg", degrees},
                        {"shear", shear},
                        {"truth_deg", azimuthOf(truth).degrees()},
                        {"polar_deg", azimuthOf(byPolar).degrees()},
                        {"bisector_deg", azimuthOf(byBisector).degrees()},
                        {"truth_stated_deg", fibreUnderShear(shear, fibre).degrees()},
                        {"polar_stated_deg", after(polar)},
                        {"bisector_stated_deg", after(bisector)}});
      if (shear == 1)
        rows.push_back(
            {{degrees == 0 ? "x: truth" : "y: truth", truth}, {"polar", byPolar}, {"Eq. 8", byBisector}});
    }
  }
  writeRows(folder / "fibres.png", rows);
  return report;
}

// RMS, over all fibres, of how far they are from J t; and how far u0 turns L.
Json fibreError() {
  Json report = Json::array();
  for (const double shear : kFibreShears) {
    double polar = 0, bisector = 0, least = 1e9, most = -1e9;
    constexpr int kCount = 180;
    for (int f = 0; f < kCount; ++f) {
      const Angle fibre = Angle::fromDegrees(f);
      const double turn = fibreUnderShear(shear, fibre).degrees() - f;
      polar +=
          material::squared(turn - turnUnderShear(polarFrame<double>, shear, Angle()).degrees()) / kCount;
      for (int u = 0; u < kCount; ++u) { // u0 stands anywhere
        const double byBisector =
            turnUnderShear(bisectorFrame<double>, shear, Angle::fromDegrees(u)).degrees();
        bisector += material::squared(turn - byBisector) / kCount / kCount;
        least = std::min(least, byBisector);
        most = std::max(most, byBisector);
      }
    }
    report.push_back({{"shear", shear},
                      {"polar_rms_deg", std::sqrt(polar)},
                      {"bisector_rms_deg", std::sqrt(bisector)},
                      {"bisector_least_deg", least},
                      {"bisector_most_deg", most}});
  }
  return report;
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  using namespace surflect;
  try {
    if (argc != 2 || !fs::create_directory(argv[1])) throw Error("usage: claims FOLDER, a new one");
    const Json report{{"impostor_limit", impostorLimit()},
                      {"texture_parallax", textureParallax(argv[1])},
                      {"fibre_azimuth", fibreAzimuth(argv[1])},
                      {"fibre_error", fibreError()}};
    fmt::print("{}\n", report.dump(2));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "claims: %s\n", error.what());
    return 1;
  }
}
