#include "bench/doll_report/doll_json.h"

#include "bench/doll_report/doll_marks.h"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace surflect::bench {

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
          {"film_bytes", bounded.frameBytes},
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

} // namespace

nlohmann::ordered_json jsonOf(const DollMeasurements& m) {
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
          {"growth", jsonOf(m.growth, m.machine)},
          {"look_up_orders", listOf(m.orders)},
          {"packing", jsonOf(m.packing, m.machine)},
          {"stage_doll", jsonOf(m.stageDoll)},
          {"splats", listOf(m.splats)},
          {"warps", listOf(m.warps)},
          {"marks", listOf(marksOf(m))}};
}

std::string jsonReport(const DollMeasurements& measured) { return jsonOf(measured).dump(2) + "\n"; }

} // namespace surflect::bench
