#include "render/chart/view.h"

#include "render/chart/svg.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace surflect::chart {

namespace {

// 0 -> "A", 25 -> "Z", 26 -> "AA"
std::string letterOf(size_t index) {
  std::string letters;
  for (size_t left = index + 1; left > 0; left = (left - 1) / 26)
    letters.insert(letters.begin(), static_cast<char>('A' + (left - 1) % 26));
  return letters;
}

std::string agreementText(const Agreement& agreement, std::string_view pose) {
  return fmt::format("{}: PSNR {}, SSIM {}, FLIP {}", pose, decibelText(agreement.psnrSrgbDb),
                     fixedText(agreement.ssim, 3), fixedText(agreement.flip, 3));
}

} // namespace

bool View::hasBent() const {
  return std::ranges::any_of(chart.points, [](const Point& point) { return point.bent.has_value(); });
}

View viewOf(const Chart& chart) {
  View view{.chart = chart};
  for (const Point& point : chart.points) {
    const auto found = std::ranges::find(view.models, point.model);
    view.modelOf.push_back(static_cast<size_t>(found - view.models.begin()));
    if (found == view.models.end()) view.models.push_back(point.model);
    method::Setting setting = point.setting;
    for (const method::Option& knob : chart.knobs) {
      const auto value = setting.find(knob.name);
      if (value != setting.end() && !knob.sweep.empty() && value->second == knob.sweep.front())
        setting.erase(value);
    }
    view.settings.push_back(std::move(setting));
  }
  view.full.resize(view.models.size());
  view.byTime.resize(chart.points.size());
  std::iota(view.byTime.begin(), view.byTime.end(), size_t{0});
  std::ranges::stable_sort(view.byTime, {}, [&](size_t i) {
    const auto known = [](double figure) { return std::isnan(figure) ? HUGE_VAL : figure; };
    return std::pair(known(view.at(i).milliseconds), known(view.at(i).rmsToFull));
  });
  view.letters.resize(chart.points.size());
  for (size_t i = view.byTime.size(); i-- > 0;) {
    const size_t point = view.byTime[i];
    if (view.isFull(point)) view.full[view.modelOf[point]] = point;
    if (!view.at(point).isChosen) continue;
    view.letters[point] = letterOf(view.chosen.size());
    view.chosen.push_back(point);
  }
  return view;
}

std::string modelName(const View& view, size_t model) {
  const std::string name = folderName(view.models[model]);
  return std::ranges::count(view.models, name, folderName) > 1 ? view.models[model].string() : name;
}

std::string millisecondsText(double milliseconds) { return rounded(milliseconds, 3) + " ms"; }
std::string errorText(double share) {
  if (share > 0 && share < kVisibleError) return "< " + shortest(100 * kVisibleError, 1);
  return rounded(100 * share, 2);
}
std::string percentText(double share) { return errorText(share) + " %"; }
std::string fixedText(double number, int decimals) {
  if (!std::isfinite(number)) return rounded(number, 1);
  const std::string text = fmt::format("{:.{}f}", number, decimals);
  return text.starts_with('-') ? "−" + text.substr(1) : text;
}
std::string decibelText(double decibel) { return fixedText(decibel, 1) + " dB"; }

std::string fasterText(double ratio) {
  if (ratio < 1) return rounded(1 / ratio, 2) + " times slower than at full";
  return rounded(ratio, 2) + " times faster than at full";
}

std::string againstFullText(double decibel, double full) {
  const double lost = full - decibel;
  if (!std::isfinite(lost)) return "full has " + decibelText(full);
  if (std::abs(lost) < 0.05) return "the same as full";
  return decibelText(std::abs(lost)) + (lost > 0 ? " below full" : " above full");
}

std::string settingText(const View& view, size_t point) { return method::textOf(view.settings[point]); }

std::string nameOf(const View& view, size_t point) {
  if (!view.at(point).name.empty()) return view.at(point).name;
  return view.isFull(point) ? "full" : "";
}

std::string tooltip(const View& view, size_t i) {
  const Point& point = view.at(i);
  std::string words = settingText(view, i);
  if (!point.name.empty()) words = point.name + ": " + words;
  if (!view.letters[i].empty()) words = view.letters[i] + "  " + words;
  if (view.models.size() > 1) words += fmt::format("\nModel {}", modelName(view, view.modelOf[i]));
  words += fmt::format("\n{} per frame", millisecondsText(point.milliseconds));
  if (const Point* full = view.fullOf(i); full && !view.isFull(i))
    words += fmt::format(", {}\nError to full {}", fasterText(full->milliseconds / point.milliseconds),
                         percentText(point.rmsToFull));
  words += fmt::format("\n{}", agreementText(point.rest, "At rest"));
  if (point.bent) words += fmt::format("\n{}", agreementText(*point.bent, "Deformed"));
  return fmt::format("{}\n{}", words, point.command);
}

std::string badge(const View& view, size_t point) {
  return fmt::format(R"(<span class="badge">{}</span>)", view.letters[point]);
}

std::string heading(const View& view, size_t point) {
  const std::string name = nameOf(view, point), setting = settingText(view, point);
  std::string html = badge(view, point);
  if (!name.empty()) html += " <b>" + escaped(name) + "</b>";
  if (name != setting) html += " <code>" + escaped(setting) + "</code>";
  if (view.models.size() > 1)
    html += " <span class=\"note\">" + escaped(modelName(view, view.modelOf[point])) + "</span>";
  return html;
}

bool hasTime(const Point& point) { return std::isfinite(point.milliseconds) && point.milliseconds > 0; }

} // namespace surflect::chart
