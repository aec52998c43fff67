#include "bench/doll_report/growth_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <iterator>

namespace surflect {

namespace {

using Json = nlohmann::ordered_json;

template <class... Values>
void add(std::string& to, fmt::format_string<Values...> format, Values&&... values) {
  fmt::format_to(std::back_inserter(to), format, std::forward<Values>(values)...);
}

double number(const Json& value) { return value.get<double>(); }

Json jsonOf(const TimeRatio& ratio) { return {{"median", ratio.median}, {"error", ratio.error}}; }

// What is above 1 by no more than it is uncertain is not known to be above.
const char* verdictOn(const TimeRatio& timeOverSize) {
  if (timeOverSize.median <= 1) return "no worse than linear";
  return timeOverSize.median - timeOverSize.error <= 1 ? "no worse than linear within the error"
                                                       : "worse than linear";
}

Json jsonOf(const GrowthRow& row, const MachineLimits& machine) {
  Json stages;
  double bound = 0;
  for (const StageWork& work : workOf(row.times.counts)) {
    const double ofStage = boundSeconds(work, machine);
    stages[std::string(work.stage)] = {{"cpu_ms", 1e3 * row.times.stages.find(work.stage)->second.processor},
                                       {"bound_ms", 1e3 * ofStage}};
    bound += ofStage;
  }
  const double processor = row.times.frame.processor;
  const FrameCounts& counts = row.times.counts;
  return {{"name", row.name},
          {"captured_lights", static_cast<double>(counts.lookups) / static_cast<double>(counts.pairs)},
          {"frame_ms", 1e3 * row.times.frame.median},
          {"frame_cpu_ms", 1e3 * processor},
          {"bound_ms", 1e3 * bound},
          {"cpu_over_bound", processor / machine.threads / bound},
          {"stages", stages}};
}

Json jsonOf(const GrowthStep& step, const Growth& growth) {
  Json stages;
  for (const std::string_view stage : kStages) {
    const auto processor = [&](size_t row) {
      return growth.rows[row].times.stages.find(stage)->second.processor;
    };
    stages[std::string(stage)] = processor(step.to) / processor(step.from) / step.size();
  }
  return {{"from", growth.rows[step.from].name},
          {"to", growth.rows[step.to].name},
          {"from_size", step.fromSize},
          {"to_size", step.toSize},
          {"size", step.size()},
          {"time", jsonOf(step.frame)},
          {"stages_over_size", stages}};
}

Json jsonOf(const GrowthSweep& sweep, const Growth& growth) {
  Json steps = Json::array();
  for (const GrowthStep& step : sweep.steps) steps.push_back(jsonOf(step, growth));
  const TimeRatio worst = sweep.worst();
  return {{"what", sweep.what},
          {"steps", steps},
          {"exponent", sweep.exponent()},
          {"worst_over_size", jsonOf(worst)},
          {"verdict", verdictOn(worst)}};
}

Json jsonOf(const Growth& growth, const MachineLimits& machine) {
  Json rows = Json::array(), sweeps = Json::array();
  for (const GrowthRow& row : growth.rows) rows.push_back(jsonOf(row, machine));
  for (const GrowthSweep& sweep : growth.sweeps) sweeps.push_back(jsonOf(sweep, growth));
  return {{"rows", rows},
          {"sweeps", sweeps},
          {"look_ups",
           {{"60_lights_over_5", jsonOf(growth.sixtyLights)},
            {"environment_over_5", jsonOf(growth.environment)}}}};
}

} // namespace

std::string growthJson(const Growth& growth, const MachineLimits& machine) {
  return jsonOf(growth, machine).dump();
}

std::string growthText(const Growth& measured, const MachineLimits& machine) {
  const Json growth = jsonOf(measured, machine);
  std::string to, stages, rule;
  for (const std::string_view stage : kStages) {
    add(stages, " {} |", stage);
    rule += "---:|";
  }
  add(to, "\n| cpu ms | frame | bound | cpu over bound |{}\n|---|---:|---:|---:|{}\n", stages, rule);
  for (const Json& row : growth["rows"]) {
    add(to, "| {} | {:.1f} | {:.2f} | {:.1f} |", row["name"].get<std::string>(), number(row["frame_cpu_ms"]),
        number(row["bound_ms"]), number(row["cpu_over_bound"]));
    for (const auto& [stage, times] : row["stages"].items()) add(to, " {:.1f} |", number(times["cpu_ms"]));
    to += "\n";
  }
  add(to, "\n| time over size | | size | frame |{}\n|---|---|---:|---:|{}\n", stages, rule);
  for (const Json& sweep : growth["sweeps"])
    for (const Json& step : sweep["steps"]) {
      const double size = number(step["size"]);
      add(to, "| {} | {} to {} | {:.3g} | {:.3f} ± {:.3f} |", sweep["what"].get<std::string>(),
          step["from_size"].dump(), step["to_size"].dump(), size, number(step["time"]["median"]) / size,
          number(step["time"]["error"]) / size);
      for (const auto& [stage, overSize] : step["stages_over_size"].items())
        add(to, " {:.2f} |", number(overSize));
      to += "\n";
    }
  to += "\n";
  for (const Json& sweep : growth["sweeps"])
    add(to, "{}: as the power {:.2f}, at most {:.3f} ± {:.3f} of in proportion: {}\n",
        sweep["what"].get<std::string>(), number(sweep["exponent"]),
        number(sweep["worst_over_size"]["median"]), number(sweep["worst_over_size"]["error"]),
        sweep["verdict"].get<std::string>());
  const auto ratio = [](const Json& of) {
    return fmt::format("{:.3f} ± {:.3f}", number(of["median"]), number(of["error"]));
  };
  add(to, "look-ups: 60 lights over 5 {}, environment over 5 {}; flat is 1\n",
      ratio(growth["look_ups"]["60_lights_over_5"]), ratio(growth["look_ups"]["environment_over_5"]));
  return to;
}

} // namespace surflect
