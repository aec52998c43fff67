#include "bench/doll_report/doll_marks.h"

#include "surfel/math/simd.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

namespace surflect::bench {

namespace {

constexpr double kMs = 1e-3;

template <class Entry> const Entry& only(const std::vector<Entry>& entries, const auto& isIt) {
  const auto found = std::ranges::find_if(entries, isIt);
  assert(found != entries.end());
  return *found;
}

double fastestFlops(const MachineLimits& machine) { return machine.flopsPerSecond() / machine.threads; }

void addStages(std::vector<Mark>& marks, const DollMeasurements& m) {
  const auto paper = [&](std::string_view stage) { return m.paper.seconds.find(stage)->second; };
  const auto ours = [&](std::string_view stage) { return m.frame.stages.find(stage)->second.processor; };
  const std::vector<StageWork> works = workOf(m.frame.counts);
  const StageWork& lookUp = only(works, [](const StageWork& w) { return w.stage == "look-up"; });
  marks.push_back({"look-ups: arithmetic over the highest rate of multiply-adds",
                   lookUp.operations / ours("look-up") / fastestFlops(m.machine), 0.35});
  marks.push_back({"look-ups: single ones over ours, one thread", paper("look-up") / ours("look-up"), 25});
  marks.push_back({"camera ULR: one surfel after the other over ours, one thread",
                   paper("camera ulr") / ours("camera ulr"), 50});
  marks.push_back({"light ULR: one surfel after the other over ours, one thread",
                   paper("light ulr") / ours("light ulr"), 40});
}

void addSplats(std::vector<Mark>& marks, const DollMeasurements& m) {
  for (const auto& [order, name] :
       {std::pair{SurfelOrder::coherent, "along the curve"}, std::pair{SurfelOrder::shuffled, "shuffled"}})
    for (const auto& [threads, most] : {std::pair{1, 10.0}, std::pair{2, 6.0}}) {
      const SplatTimes& times = only(m.splats, [&](const SplatTimes& s) {
        return s.order == order && s.threads == threads && s.way == nameOf(bestSimd());
      });
      marks.push_back(
          {fmt::format("splats {}, {} thread{}: ms at best", name, threads, threads == 1 ? "" : "s"),
           times.both.best / kMs, most, true});
      if (threads == 1)
        marks.push_back({fmt::format("splats {}: dB from double precision", name), times.db, 50});
    }
}

void addWarps(std::vector<Mark>& marks, const DollMeasurements& m) {
  for (const char* warp : {"twist", "lattice"}) {
    const auto processor = [&](std::string_view way) {
      return only(m.warps, [&](const WarpTimes& w) { return w.warp == warp && w.way == way; })
          .times.processor;
    };
    marks.push_back({fmt::format("{}: differences over ours, one thread", warp),
                     processor("differences") / processor(nameOf(bestSimd())), 25});
  }
}

void addDisk(std::vector<Mark>& marks, const DollMeasurements& m) {
  if (m.machine.directRead)
    marks.push_back(
        {"cold frame: bytes of blocks a second over random reads",
         static_cast<double>(m.frame.counts.blockBytes) / m.frame.coldSeconds / *m.machine.directRead, 0.8});
  const auto cost = [&](std::string_view order) {
    return only(m.orders, [&](const OrderCost& c) { return c.images == 3 && c.order == order; }).seconds;
  };
  marks.push_back({"sorting: shuffled single look-ups over ours, three images in the cache",
                   cost("shuffled, one by one") / cost("sorted, as frames are"), 10});
  marks.push_back({"memory: most over allowed", m.bounded.peakBytes / m.bounded.allowedBytes(), 1, true});
}

void addGrowth(std::vector<Mark>& marks, const Growth& growth) {
  const auto atMostOne = [&](std::string what, const TimeRatio& ratio) {
    marks.push_back({std::move(what), ratio.median, 1, true, ratio.error});
  };
  for (const GrowthSweep& sweep : growth.sweeps)
    atMostOne(fmt::format("growth with {}: time over size", sweep.what), sweep.worst());
  atMostOne("look-ups: 60 lights over 5", growth.sixtyLights);
  atMostOne("look-ups: an environment over 5 lights", growth.environment);
}

} // namespace

std::vector<Mark> marksOf(const DollMeasurements& m) {
  double bound = 0;
  for (const StageWork& work : workOf(m.frame.counts)) bound += boundSeconds(work, m.machine);
  std::vector<Mark> marks{{"frame over bound", m.frame.frame.median / bound, 2.5, true},
                          {"the paper's frame over ours", m.paperLap.seconds / m.frame.frame.median, 100}};
  addStages(marks, m);
  addSplats(marks, m);
  addWarps(marks, m);
  addDisk(marks, m);
  marks.push_back(
      {"packing: BDCSVD over ours, one thread", m.packing.svd.processor / m.packing.ours.processor, 8});
  assert(m.stageDoll.quality.bytes <= StageDoll::kBytes);
  marks.push_back(
      {fmt::format("packing: dB of the light stage's doll at {} bytes a pixel and light", StageDoll::kBytes),
       m.stageDoll.quality.db, 48});
  addGrowth(marks, m.growth);
  return marks;
}

} // namespace surflect::bench
