#include "srf/image/foreign/foreign.h"

#include <OpenImageIO/color.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

namespace surflect::image {

namespace {

std::string orEmpty(const char* text) { return text ? text : ""; }

std::string inLowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// Names that configurations in use give to linear light with the primaries of Rec. 709 and sRGB.
constexpr std::array<std::string_view, 8> kLinearRec709 = {"linear rec.709 (srgb)",
                                                           "lin_rec709",
                                                           "lin_rec709_scene",
                                                           "utility - linear - rec.709",
                                                           "lin_srgb",
                                                           "linear rec.709",
                                                           "linear bt.709",
                                                           "utility - linear - srgb"};

// Colour space of our pictures: linear Rec. 709 by one of its usual names or aliases, else scene_linear.
std::string sourceOf(const OIIO::ColorConfig& config) {
  const auto isLinearRec709 = [](const std::string& name) {
    return std::ranges::find(kLinearRec709, inLowerCase(name)) != kLinearRec709.end();
  };
  for (int i = 0; i < config.getNumColorSpaces(); ++i) {
    const std::string name = config.getColorSpaceNameByIndex(i);
    if (isLinearRec709(name) || std::ranges::any_of(config.getAliases(name), isLinearRec709)) return name;
  }
  return orEmpty(config.getColorSpaceNameByRole("scene_linear"));
}

void applyProcessor(const void* processor, float* rgb, size_t pixels) {
  constexpr auto kChannel = static_cast<OIIO::stride_t>(sizeof(float));
  const auto width = static_cast<OIIO::stride_t>(pixels);
  static_cast<const OIIO::ColorProcessor*>(processor)->apply(rgb, static_cast<int>(pixels), 1, 3, kChannel,
                                                             3 * kChannel, 3 * kChannel * width);
}

bool open(ForeignView& view, std::string& problem) {
  OIIO::ColorConfig config;
  problem = config.geterror();
  if (!problem.empty()) return false;
  view.displays = config.getDisplayNames();
  if (view.display.empty()) view.display = orEmpty(config.getDefaultDisplayName());
  if (std::ranges::find(view.displays, view.display) == view.displays.end()) return true;
  view.views = config.getViewNames(view.display);
  if (view.view.empty()) view.view = orEmpty(config.getDefaultViewName(view.display));
  if (std::ranges::find(view.views, view.view) == view.views.end()) return true;
  view.source = sourceOf(config);
  if (view.source.empty()) {
    problem = "it has neither a colour space of linear Rec. 709 nor a role scene_linear";
    return false;
  }
  view.processor = config.createDisplayTransform(view.display, view.view, view.source);
  view.apply = applyProcessor;
  problem = config.geterror();
  if (!view.processor && problem.empty()) problem = "no transform from " + view.source;
  return view.processor != nullptr && problem.empty();
}

} // namespace

extern "C" bool surflectOpenForeignView(ForeignView& view, std::string& problem) {
  bool done = false;
  try {
    done = open(view, problem);
  } catch (const std::exception& e) {
    problem = e.what();
  }
  std::replace(problem.begin(), problem.end(), '\n', ' ');
  return done;
}

} // namespace surflect::image
