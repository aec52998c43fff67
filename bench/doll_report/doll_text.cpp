// Tables of what doll_json.h has.
#include "bench/doll_report/doll_report.h"

#include "bench/doll_report/doll_json.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <iterator>

namespace surflect::bench {

namespace {

using Json = nlohmann::ordered_json;

double number(const Json& value) { return value.get<double>(); }
std::string text(const Json& value) { return value.get<std::string>(); }

template <class... Values>
void add(std::string& to, fmt::format_string<Values...> format, Values&&... values) {
  fmt::format_to(std::back_inserter(to), format, std::forward<Values>(values)...);
}

void writeMachine(std::string& to, const Json& machine) {
  add(to, "{} threads", machine["threads"].get<int>());
  for (const auto& [name, unit] : {std::pair{"read", "_bytes_per_second"},
                                   {"copy", "_bytes_per_second"},
                                   {"triad", "_bytes_per_second"},
                                   {"cached_read", "_bytes_per_second"},
                                   {"random_lines", "_per_second"},
                                   {"sse", "_flops"},
                                   {"avx2", "_flops"},
                                   {"avx512", "_flops"},
                                   {"bf16", "_flops"}}) {
    const Json& limit = machine[std::string(name) + unit];
    if (!limit.is_null())
      add(to, "; {} {:.3g} {:.3g} G", name, number(limit["one"]) / 1e9, number(limit["all"]) / 1e9);
  }
  const Json& direct = machine["direct_read_bytes_per_second"];
  if (direct.is_number())
    add(to, "; direct read {:.3g} G\n", number(direct) / 1e9);
  else
    add(to, "; direct read: the file system refuses\n");
}

void writeFrame(std::string& to, const Json& report) {
  const Json& counts = report["counts"];
  add(to,
      "{} surfels, {} visible, {} pairs, {} look-ups, {:.1f} MB of blocks of rank {:.1f}, {} contributions\n",
      counts["surfels"].dump(), counts["visible"].dump(), counts["pairs"].dump(), counts["lookups"].dump(),
      number(counts["block_bytes"]) / 1e6, number(counts["rank"]), counts["contributions"].dump());
  add(to, "{:.1f} dB from the paper's pipeline, largest difference {:.2g} of white\n\n",
      number(report["check"]["psnr_linear_db"]), number(report["check"]["largest_difference"]));
  add(to, "| stage | ms | best ms | cpu ms | naive ms | MB | Mop | bound ms | by | over bound | cpu over "
          "bound |\n"
          "|---|---:|---:|---:|---:|---:|---:|---:|---|---:|---:|\n");
  for (const Json& stage : report["stages"])
    add(to, "| {} | {:.2f} | {:.2f} | {:.2f} | {:.0f} | {:.1f} | {:.0f} | {:.2f} | {} | {:.1f} | {:.1f} |\n",
        text(stage["stage"]), number(stage["ms"]), number(stage["best_ms"]), number(stage["cpu_ms"]),
        number(stage["naive_ms"]), number(stage["bytes"]) / 1e6, number(stage["operations"]) / 1e6,
        number(stage["bound_ms"]), text(stage["bound_by"]), number(stage["over_bound"]),
        number(stage["cpu_over_bound"]));
  add(to, "| frame | {:.2f} | {:.2f} | {:.2f} | {:.0f} | | | {:.2f} | | {:.1f} | {:.1f} |\n",
      number(report["frame_ms"]), number(report["frame_best_ms"]), number(report["frame_cpu_ms"]),
      number(report["naive_ms"]), number(report["bound_ms"]), number(report["frame_over_bound"]),
      number(report["frame_cpu_over_bound"]));
  add(to, "\nfirst frame {:.1f} ms; cold, from the disk, {:.1f} ms, {:.0f} MB/s of blocks\n",
      number(report["first_frame_ms"]), number(report["cold_frame_ms"]),
      number(report["cold_bytes_per_second"]) / 1e6);
  const Json& bounded = report["bounded"];
  add(to,
      "with a cache of {:.0f} MB cold {:.1f} ms, again {:.1f} ms, at most {:.0f} MB resident, of "
      "{:.0f} allowed; "
      "{:.0f} MB anonymous afterwards\n",
      number(bounded["cache_bytes"]) / 1e6, number(bounded["cold_frame_ms"]),
      number(bounded["warm_frame_ms"]), number(bounded["peak_bytes"]) / 1e6,
      number(bounded["allowed_bytes"]) / 1e6, number(bounded["anonymous_bytes"]) / 1e6);
}

void writeGrowth(std::string& to, const Json& growth) {
  std::string stages, rule;
  for (const std::string_view stage : kStages) {
    add(stages, " {} |", stage);
    rule += "---:|";
  }
  add(to, "\n| cpu ms | frame | bound | cpu over bound |{}\n|---|---:|---:|---:|{}\n", stages, rule);
  for (const Json& row : growth["rows"]) {
    add(to, "| {} | {:.1f} | {:.2f} | {:.1f} |", text(row["name"]), number(row["frame_cpu_ms"]),
        number(row["bound_ms"]), number(row["cpu_over_bound"]));
    for (const auto& [stage, times] : row["stages"].items()) add(to, " {:.1f} |", number(times["cpu_ms"]));
    to += "\n";
  }
  add(to, "\n| time over size | | size | frame |{}\n|---|---|---:|---:|{}\n", stages, rule);
  for (const Json& sweep : growth["sweeps"])
    for (const Json& step : sweep["steps"]) {
      const double size = number(step["size"]);
      add(to, "| {} | {} to {} | {:.3g} | {:.3f} ± {:.3f} |", text(sweep["what"]), step["from_size"].dump(),
          step["to_size"].dump(), size, number(step["time"]["median"]) / size,
          number(step["time"]["error"]) / size);
      for (const auto& [stage, overSize] : step["stages_over_size"].items())
        add(to, " {:.2f} |", number(overSize));
      to += "\n";
    }
  to += "\n";
  for (const Json& sweep : growth["sweeps"])
    add(to, "{}: as the power {:.2f}, at most {:.3f} ± {:.3f} of in proportion: {}\n", text(sweep["what"]),
        number(sweep["exponent"]), number(sweep["worst_over_size"]["median"]),
        number(sweep["worst_over_size"]["error"]), text(sweep["verdict"]));
  const auto ratio = [](const Json& of) {
    return fmt::format("{:.3f} ± {:.3f}", number(of["median"]), number(of["error"]));
  };
  add(to, "look-ups: 60 lights over 5 {}, environment over 5 {}; flat is 1\n",
      ratio(growth["look_ups"]["60_lights_over_5"]), ratio(growth["look_ups"]["environment_over_5"]));
}

void writeOrders(std::string& to, const Json& orders) {
  add(to, "\n| images in the cache | order of the look-ups | us each | blocks read each "
          "|\n|---:|---|---:|---:|\n");
  for (const Json& cost : orders)
    add(to, "| {} | {} | {:.2f} | {:.3f} |\n", cost["images"].dump(), text(cost["order"]), number(cost["us"]),
        number(cost["reads"]));
}

void writeParts(std::string& to, const Json& report) {
  const Json& packing = report["packing"];
  add(to,
      "\nblocks of rank {:.1f}, {:.0f} bytes, error {:.4f}, {:.2f} times the best of their rank: {:.0f} us, "
      "{:.0f} a second, {:.0f} % of the highest rate; BDCSVD {:.0f} us\n",
      number(packing["rank"]), number(packing["bytes"]), number(packing["error"]),
      number(packing["error_over_best"]), number(packing["us"]), number(packing["blocks_per_second"]),
      100 * number(packing["of_peak"]), number(packing["bdcsvd_us"]));
  const Json& doll = report["stage_doll"];
  add(to,
      "the light stage's doll ({}), one block in {} of {} views of {}, {} pixels under {} lights: {:.2f} dB "
      "linear at {:.4f} bytes a pixel and light (tolerance {:.4f})\n",
      text(doll["scale"]), doll["every_block"].dump(), doll["views"].dump(), doll["all_views"].dump(),
      doll["texels"].dump(), doll["lights"].dump(), number(doll["psnr_linear_db"]),
      number(doll["bytes_per_pixel_and_light"]), number(doll["tolerance"]));
  add(to, "\n| splats | threads | way | ms | best ms | cover cpu ms | blend cpu ms | dB |\n"
          "|---|---:|---|---:|---:|---:|---:|---:|\n");
  for (const Json& s : report["splats"])
    add(to, "| {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", text(s["order"]),
        s["threads"].dump(), text(s["way"]), number(s["ms"]), number(s["best_ms"]), number(s["cover_cpu_ms"]),
        number(s["blend_cpu_ms"]), number(s["db"]));
  add(to, "\n| warp | way | ns a surfel |\n|---|---|---:|\n");
  for (const Json& warp : report["warps"])
    add(to, "| {} | {} | {:.1f} |\n", text(warp["warp"]), text(warp["way"]), number(warp["ns"]));
}

void writeMarks(std::string& to, const Json& marks) {
  add(to, "\n| | measured | mark | |\n|---|---:|---:|---|\n");
  for (const Json& mark : marks) {
    const bool isMost = mark.contains("at_most");
    const double error = number(mark["error"]);
    add(to, "| {} | {:.3g}{} | {} {:g} | {} |\n", text(mark["what"]), number(mark["value"]),
        error > 0 ? fmt::format(" ± {:.2g}", error) : "",
        isMost ? "<=" : ">=", number(mark[isMost ? "at_most" : "at_least"]),
        mark["reached"] == true ? "reached" : "missed");
  }
}

} // namespace

std::string textReport(const DollMeasurements& measured) {
  const Json report = jsonOf(measured);
  std::string text = report["model"].get<std::string>() + "\n";
  writeMachine(text, report["machine"]);
  writeFrame(text, report);
  writeGrowth(text, report["growth"]);
  writeOrders(text, report["look_up_orders"]);
  writeParts(text, report);
  writeMarks(text, report["marks"]);
  return text;
}

} // namespace surflect::bench
