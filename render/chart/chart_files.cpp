#include "render/chart/chart_files.h"

#include "render/chart/report.h"
#include "surfel/base/file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>

namespace surflect::chart {

namespace {

using OrderedJson = nlohmann::ordered_json;

// A field of a CSV file, quoted where it must be.  [RFC 4180]
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string doubled;
  for (const char c : text) doubled.append(c == '"' ? 2 : 1, c);
  return fmt::format("\"{}\"", doubled);
}

std::string numberOf(double number) { return fmt::format("{}", number); }

OrderedJson agreementJson(const Agreement& agreement) {
  return {{"psnr_linear_db", agreement.psnrLinearDb},
          {"psnr_srgb_db", agreement.psnrSrgbDb},
          {"ssim_srgb", agreement.ssim},
          {"flip", agreement.flip}};
}

std::vector<std::string> fieldsOf(const std::optional<Agreement>& agreement) {
  if (!agreement) return std::vector<std::string>(4);
  return {numberOf(agreement->psnrLinearDb), numberOf(agreement->psnrSrgbDb), numberOf(agreement->ssim),
          numberOf(agreement->flip)};
}

method::Value valueOf(const method::Option& knob, const method::Setting& setting) {
  const auto found = setting.find(knob.name);
  return found == setting.end() ? knob.sweep.front() : found->second;
}

OrderedJson jsonOf(const method::Value& value) {
  return value.isNumber() ? OrderedJson(value.number()) : OrderedJson(value.text());
}

OrderedJson jsonOf(const method::Setting& setting) {
  OrderedJson json = OrderedJson::object();
  for (const auto& [name, value] : setting) json[name] = jsonOf(value);
  return json;
}

OrderedJson knobJson(const method::Option& knob) {
  OrderedJson json = {{"name", knob.name}, {"help", knob.help}, {"values", OrderedJson::array()}};
  for (const method::Value& value : knob.sweep) json["values"].push_back(jsonOf(value));
  return json;
}

} // namespace

std::string csvOf(const Chart& chart) {
  std::set<std::string> stages;
  for (const Point& point : chart.points)
    for (const auto& [stage, milliseconds] : point.stages) stages.insert(stage);
  std::vector<std::string> names = {"model", "setting", "name"};
  for (const method::Option& knob : chart.knobs) names.push_back("knob_" + knob.name);
  for (const char* frames : {"rest", "bent"})
    for (const char* measure : {"psnr_linear_db", "psnr_srgb_db", "ssim_srgb", "flip"})
      names.push_back(fmt::format("{}_{}", frames, measure));
  names.insert(names.end(), {"rms_to_full", "frame_ms"});
  for (const std::string& stage : stages) names.push_back(stage + "_ms");
  names.insert(names.end(),
               {"read_bytes_per_frame", "model_bytes", "memory_peak_bytes", "on_front", "chosen", "command"});

  std::string text;
  const auto addRow = [&](const std::vector<std::string>& fields) {
    for (size_t i = 0; i < fields.size(); ++i) text.append(i > 0 ? "," : "").append(quoted(fields[i]));
    text += "\r\n";
  };
  addRow(names);
  for (const Point& point : chart.points) {
    std::vector<std::string> row = {point.model.string(), method::textOf(point.setting), point.name};
    for (const method::Option& knob : chart.knobs) row.push_back(valueOf(knob, point.setting).text());
    for (const auto& agreement : {std::optional(point.rest), point.bent})
      std::ranges::copy(fieldsOf(agreement), std::back_inserter(row));
    row.push_back(numberOf(point.rmsToFull));
    row.push_back(numberOf(point.milliseconds));
    for (const std::string& stage : stages) {
      const auto found = point.stages.find(stage);
      row.push_back(found == point.stages.end() ? "" : numberOf(found->second));
    }
    row.push_back(numberOf(point.bytesRead));
    row.push_back(std::to_string(point.modelBytes));
    row.push_back(std::to_string(point.memoryBytes));
    row.push_back(point.isOnFront ? "1" : "0");
    row.push_back(point.isChosen ? "1" : "0");
    row.push_back(point.command);
    addRow(row);
  }
  return text;
}

std::string jsonOf(const Chart& chart) {
  OrderedJson json = {{"title", chart.title},
                      {"machine", chart.machine},
                      {"command", chart.command},
                      {"rest_frames", chart.restFrames},
                      {"bent_frames", chart.bentFrames},
                      {"rest_frames_held_out", chart.restHeldOut},
                      {"bent_frames_held_out", chart.bentHeldOut},
                      {"knobs", OrderedJson::array()},
                      {"idle_knobs", OrderedJson::object()},
                      {"points", OrderedJson::array()}};
  for (const method::Option& knob : chart.knobs) json["knobs"].push_back(knobJson(knob));
  for (const auto& [model, idle] : chart.idleKnobs) json["idle_knobs"][model.string()] = idle;
  for (const Point& point : chart.points) {
    OrderedJson entry = {{"model", point.model.string()},
                         {"setting", jsonOf(point.setting)},
                         {"name", point.name},
                         {"command", point.command},
                         {"rest", agreementJson(point.rest)}};
    if (point.bent) entry["bent"] = agreementJson(*point.bent);
    entry.update({{"rms_to_full", point.rmsToFull},
                  {"frame_ms", point.milliseconds},
                  {"stages_ms", point.stages},
                  {"read_bytes_per_frame", point.bytesRead},
                  {"model_bytes", point.modelBytes},
                  {"memory_peak_bytes", point.memoryBytes},
                  {"on_front", point.isOnFront},
                  {"chosen", point.isChosen}});
    json["points"].push_back(std::move(entry));
  }
  return json.dump(2, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

void writeChart(const Chart& chart, const std::filesystem::path& folder) {
  writeFileAtomically(folder / "chart.csv", csvOf(chart));
  writeFileAtomically(folder / "chart.json", jsonOf(chart));
  writeFileAtomically(folder / "index.html", htmlOf(chart));
}

} // namespace surflect::chart
