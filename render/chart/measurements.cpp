#include "render/chart/measurements.h"

#include "srf/capture/json_fields.h"
#include "surfel/base/file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <ranges>

namespace surflect::chart {

method::Setting withoutFull(std::span<const method::Option> knobs, method::Setting setting) {
  for (const method::Option& knob : knobs) {
    const auto found = setting.find(knob.name);
    if (found == setting.end()) continue;
    const std::optional<method::Value> full =
        knob.sweep.empty() ? knob.standard : std::optional(knob.sweep.front());
    if (found->second == full) setting.erase(found);
  }
  return setting;
}

std::vector<method::Setting> combinations(std::span<const method::Option> knobs) {
  std::vector<method::Setting> settings{{}};
  for (const method::Option& knob : knobs) {
    std::vector<method::Setting> longer;
    for (const method::Setting& setting : settings)
      for (const method::Value& value : knob.sweep) {
        longer.push_back(setting);
        longer.back()[knob.name] = value;
      }
    settings = std::move(longer);
  }
  return settings;
}

std::vector<method::Setting> oneByOne(std::span<const method::Option> knobs) {
  std::vector<method::Setting> settings{{}};
  for (const method::Option& knob : knobs)
    for (const method::Value& value : knob.sweep)
      if (value != knob.sweep.front()) settings.push_back({{knob.name, value}});
  return settings;
}

std::vector<method::Setting> descent(std::span<const method::Option> knobs, size_t most,
                                     const std::function<Cost(const method::Setting&)>& cost) {
  constexpr double kLeastGain = 0.02;          // of the work; less is not worth a step
  constexpr double kLeastError = 1e-6;         // so that steps without any error are ranked by work
  std::vector<size_t> places(knobs.size(), 0); // in Option::sweep
  const auto settingAt = [&](const std::vector<size_t>& at) {
    method::Setting setting;
    for (size_t k = 0; k < knobs.size(); ++k) setting[knobs[k].name] = knobs[k].sweep[at[k]];
    return withoutFull(knobs, std::move(setting));
  };
  std::vector<method::Setting> path;
  Cost here = cost({});
  while (path.size() < most) {
    struct Step {
      size_t knob;
      Cost cost;
      double worth;
    };
    std::optional<Step> best;
    for (size_t k = 0; k < knobs.size(); ++k) {
      if (places[k] + 1 == knobs[k].sweep.size()) continue;
      std::vector<size_t> next = places;
      ++next[k];
      const Cost there = cost(settingAt(next));
      const double gain = here.work - there.work;
      if (gain < kLeastGain * here.work) continue;
      const double worth = gain / std::max(there.error - here.error, kLeastError);
      if (!best || worth > best->worth) best = Step{k, there, worth};
    }
    if (!best) break;
    ++places[best->knob];
    here = best->cost;
    path.push_back(settingAt(places));
  }
  return path;
}

size_t longestDescent(std::span<const method::Option> knobs, size_t most) {
  size_t steps = 0;
  for (const method::Option& knob : knobs) steps += knob.sweep.size() - 1;
  return std::min(steps, most);
}

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
