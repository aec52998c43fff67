#include "bench/doll_report/doll_report.h"

#include "bench/doll_report/doll_marks.h"
#include "bench/doll_report/growth_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>

namespace surflect {

namespace {

using Json = nlohmann::ordered_json;

Json jsonOf(const MachineLimits& limits) {
  const auto pair = [](const MachineLimits::OneAll& of) { return Json{{"one", of.one}, {"all", of.all}}; };
  const auto maybe = [&](const auto& of) { return of ? pair(*of) : Json(); };
  return {{"threads", limits.threads},
          {"read_bytes_per_second", pair(limits.read)},
          {"copy_bytes_per_second", pair(limits.copy)},
          {"triad_bytes_per_second", pair(limits.triad)},
          {"random_lines_per_second", pair(limits.randomLines)},
          {"sse_flops", pair(limits.sse)},
          {"avx2_flops", maybe(limits.avx2)},
          {"avx512_flops", maybe(limits.avx512)},
          {"bf16_flops", maybe(limits.bf16)},
          {"cached_read_bytes_per_second", pair(limits.cachedRead)},
          {"direct_read_bytes_per_second", limits.directRead ? Json(*limits.directRead) : Json("refused")}};
}

Json jsonOf(const FrameCounts& counts) {
  return {{"surfels", counts.surfels},
          {"drawn", counts.drawn},
          {"visible", counts.visible},
          {"pixels", counts.pixels},
          {"contributions", counts.contributions},
          {"views", counts.views},
          {"rig_lights", counts.rigLights},
          {"lights", counts.lights},
          {"pairs", counts.pairs},
          {"lookups", counts.lookups},
          {"blocks", counts.blocks},
          {"block_bytes", counts.blockBytes},
          {"rank", counts.rank}};
}

Json jsonOf(const OrderCost& cost) {
  return {{"order", cost.order},
          {"images", cost.images},
          {"operations", cost.operations},
          {"us", 1e6 * cost.seconds},
          {"reads", cost.reads}};
}

Json jsonOf(const BoundedFrames& bounded) {
  return {{"cache_bytes", bounded.cacheBytes},
          {"surfel_bytes", bounded.surfelBytes},
          {"film_bytes", bounded.filmBytes},
          {"allowed_bytes", bounded.allowedBytes()},
          {"peak_bytes", bounded.peakBytes},
          {"anonymous_bytes", bounded.anonymousBytes},
          {"cold_frame_ms", 1e3 * bounded.coldSeconds},
          {"warm_frame_ms", 1e3 * bounded.warmSeconds}};
}

Json jsonOf(const PackingTimes& packing, const MachineLimits& machine) {
  const double each = packing.ours.processor / static_cast<double>(packing.blocks);
  return {{"rank", packing.rank},
          {"bytes", packing.bytes},
          {"error", packing.error},
          {"error_over_best", packing.overBest},
          {"us", 1e6 * each},
          {"blocks_per_second", 1 / each},
          {"bdcsvd_us", 1e6 * packing.svd.processor / static_cast<double>(packing.blocks)},
          {"operations", packing.operations},
          {"of_peak", packing.operations / each / (machine.flopsPerSecond() / machine.threads)}};
}

Json jsonOf(const StageDoll& doll) {
  const PackingQuality& quality = doll.quality;
  return {{"scale", doll.scale},
          {"views", doll.views},
          {"all_views", doll.allViews},
          {"every_block", doll.every},
          {"texels", quality.texels},
          {"lights", quality.lights},
          {"white", quality.white},
          {"tolerance", quality.tolerance},
          {"bytes_per_pixel_and_light", quality.bytes},
          {"psnr_linear_db", quality.db}};
}

Json jsonOf(const SplatTimes& times) {
  return {{"order", times.order == SurfelOrder::coherent ? "along the curve" : "shuffled"},
          {"threads", times.threads},
          {"way", times.way},
          {"splats", times.splats},
          {"visible", times.visible},
          {"db", times.db},
          {"flipped", times.flipped},
          {"ms", 1e3 * times.both.median},
          {"best_ms", 1e3 * times.both.best},
          {"cover_cpu_ms", 1e3 * times.cover.processor},
          {"blend_cpu_ms", 1e3 * times.blend.processor},
          {"cpu_ms", 1e3 * times.both.processor}};
}

Json jsonOf(const WarpTimes& times) {
  return {{"warp", times.warp},
          {"way", times.way},
          {"surfels", times.surfels},
          {"ns", 1e9 * times.times.processor / static_cast<double>(times.surfels)}};
}

Json jsonOf(const Mark& mark) {
  return {{"what", mark.what},
          {"value", mark.value},
          {"error", mark.error},
          {mark.isMost ? "at_most" : "at_least", mark.mark},
          {"reached", mark.isReached()}};
}

Json listOf(const auto& entries) {
  Json list = Json::array();
  for (const auto& entry : entries) list.push_back(jsonOf(entry));
  return list;
}

Json stagesOf(const DollMeasurements& m) {
  Json stages = Json::array();
  for (const StageWork& work : workOf(m.frame.counts)) {
    const Times& times = m.frame.stages.find(work.stage)->second;
    const double bound = 1e3 * boundSeconds(work, m.machine);
    stages.push_back({{"stage", work.stage},
                      {"ms", 1e3 * times.median},
                      {"best_ms", 1e3 * times.best},
                      {"cpu_ms", 1e3 * times.processor},
                      {"naive_ms", 1e3 * m.paper.seconds.find(work.stage)->second},
                      {"bytes", work.bytes},
                      {"operations", work.operations},
                      {"bound_ms", bound},
                      {"bound_by", isBoundByMemory(work, m.machine) ? "memory" : "arithmetic"},
                      {"over_bound", 1e3 * times.median / bound},
                      {"cpu_over_bound", 1e3 * times.processor / m.machine.threads / bound}});
  }
  return stages;
}

double sumOf(const Json& entries, const char* field) {
  double sum = 0;
  for (const Json& entry : entries) sum += entry[field].get<double>();
  return sum;
}

Json reportOf(const DollMeasurements& m) {
  const Json stages = stagesOf(m);
  const double frameMs = 1e3 * m.frame.frame.median,
               idealMs = 1e3 * m.frame.frame.processor / m.machine.threads;
  const double boundMs = sumOf(stages, "bound_ms"), naiveMs = 1e3 * m.paperLap.seconds,
               naiveCpuMs = 1e3 * m.paperLap.processorSeconds;
  return {{"model", m.model.string()},
          {"output", {m.width, m.height}},
          {"machine", jsonOf(m.machine)},
          {"check",
           {{"psnr_linear_db", std::min(m.check.psnrDb, 999.0)},
            {"largest_difference", m.check.largest},
            {"passed", m.check.passed()}}},
          {"counts", jsonOf(m.frame.counts)},
          {"stages", stages},
          {"frame_ms", frameMs},
          {"frame_best_ms", 1e3 * m.frame.frame.best},
          {"frame_cpu_ms", 1e3 * m.frame.frame.processor},
          {"bound_ms", boundMs},
          {"frame_over_bound", frameMs / boundMs},
          {"frame_cpu_over_bound", idealMs / boundMs},
          {"naive_ms", naiveMs},
          {"naive_cpu_ms", naiveCpuMs},
          {"naive_lookups", m.paper.lookups},
          {"naive_over_frame", naiveMs / frameMs},
          {"naive_cpu_over_frame", naiveCpuMs / idealMs},
          {"first_frame_ms", 1e3 * m.frame.firstSeconds},
          {"cold_frame_ms", 1e3 * m.frame.coldSeconds},
          {"cold_bytes_per_second", static_cast<double>(m.frame.counts.blockBytes) / m.frame.coldSeconds},
          {"bounded", jsonOf(m.bounded)},
          {"growth", Json::parse(growthJson(m.growth, m.machine))},
          {"look_up_orders", listOf(m.orders)},
          {"packing", jsonOf(m.packing, m.machine)},
          {"stage_doll", jsonOf(m.stageDoll)},
          {"splats", listOf(m.splats)},
          {"warps", listOf(m.warps)},
          {"marks", listOf(marksOf(m))}};
}

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

std::string jsonReport(const DollMeasurements& measured) { return reportOf(measured).dump(2) + "\n"; }

std::string textReport(const DollMeasurements& measured) {
  const Json report = reportOf(measured);
  std::string text = report["model"].get<std::string>() + "\n";
  writeMachine(text, report["machine"]);
  writeFrame(text, report);
  text += growthText(measured.growth, measured.machine);
  writeOrders(text, report["look_up_orders"]);
  writeParts(text, report);
  writeMarks(text, report["marks"]);
  return text;
}

} // namespace surflect
