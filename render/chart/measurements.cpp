#include "render/chart/measurements.h"

#include "srf/capture/shallow_json.h"
#include "surfel/base/file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <limits>
#include <ranges>

namespace surflect::chart {

namespace {

using Json = nlohmann::json;

constexpr std::array kKinds = {"accuracy", "timing", "cost"};

// JSON has no infinity, which is the PSNR of equal pictures: null stands for it.
double numberOf(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>();
}

Json jsonOf(const Agreement& agreement) {
  return {{"psnr_linear_db", agreement.psnrLinearDb},
          {"psnr_srgb_db", agreement.psnrSrgbDb},
          {"ssim", agreement.ssim},
          {"flip", agreement.flip}};
}

Agreement agreementOf(const Json& json) {
  return {numberOf(json.at("psnr_linear_db")), numberOf(json.at("psnr_srgb_db")), numberOf(json.at("ssim")),
          numberOf(json.at("flip"))};
}

Accuracy accuracyIn(const Json& json) {
  Accuracy accuracy{agreementOf(json.at("rest")), std::nullopt, numberOf(json.at("rms_to_full")),
                    numberOf(json.at("bytes_read")), json.at("memory_bytes").get<size_t>()};
  if (json.contains("bent")) accuracy.bent = agreementOf(json.at("bent"));
  return accuracy;
}

Timing timingIn(const Json& json) {
  return {json.at("milliseconds").get<double>(), json.at("stages").get<std::map<std::string, double>>()};
}

Cost costIn(const Json& json) { return {json.at("work").get<double>(), numberOf(json.at("error"))}; }

// Nothing if there is no text, or if it is not what `read` expects.
template <class Read> auto parsed(const std::string* text, Read read) {
  std::optional<decltype(read(Json()))> result;
  try {
    if (text) result = read(Json::parse(*text));
  } catch (const Json::exception&) {
  }
  return result;
}

} // namespace

Measurements::Measurements(std::filesystem::path file) : file_(std::move(file)) {
  if (!std::filesystem::exists(file_)) return;
  constexpr int kDeepest = 4; // levels of nesting
  const std::string text = readFile(file_, kLargestText);
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view whole = std::string_view(text).substr(begin, end - begin);
    const Json line = Json::parse(capture::shallowPart(whole, kDeepest), nullptr, false);
    begin = end + 1;
    if (!line.is_object() || !line.contains("of") || !line["of"].is_string()) continue;
    for (const char* kind : kKinds)
      if (line.contains(kind)) lines_.push_back({kind, line["of"].get<std::string>(), line[kind].dump()});
  }
}

const std::string* Measurements::find(std::string_view kind, const std::string& key) const {
  for (const Line& line : lines_ | std::views::reverse) // a measurement replaces an earlier one
    if (line.kind == kind && line.key == key) return &line.json;
  return nullptr;
}

std::optional<Accuracy> Measurements::accuracy(const std::string& key) const {
  return parsed(find("accuracy", key), accuracyIn);
}
std::optional<Timing> Measurements::timing(const std::string& key) const {
  return parsed(find("timing", key), timingIn);
}
std::optional<Cost> Measurements::cost(const std::string& key) const {
  return parsed(find("cost", key), costIn);
}

void Measurements::keep(const char* kind, const std::string& key, std::string json) {
  lines_.push_back({kind, key, std::move(json)});
  std::string text;
  for (const Line& line : lines_)
    text += fmt::format("{{\"of\":{},\"{}\":{}}}\n", Json(line.key).dump(), line.kind, line.json);
  writeFileAtomically(file_, text);
}

void Measurements::keep(const std::string& key, const Accuracy& accuracy) {
  Json json = {{"rest", jsonOf(accuracy.rest)},
               {"rms_to_full", accuracy.rmsToFull},
               {"bytes_read", accuracy.bytesRead},
               {"memory_bytes", accuracy.memoryBytes}};
  if (accuracy.bent) json["bent"] = jsonOf(*accuracy.bent);
  keep("accuracy", key, json.dump());
}
void Measurements::keep(const std::string& key, const Timing& timing) {
  keep("timing", key, Json{{"milliseconds", timing.milliseconds}, {"stages", timing.stages}}.dump());
}
void Measurements::keep(const std::string& key, const Cost& cost) {
  keep("cost", key, Json{{"work", cost.work}, {"error", cost.error}}.dump());
}

} // namespace surflect::chart
