#include "render/chart/report.h"

#include "render/chart/front.h"
#include "render/chart/svg.h"
#include "render/chart/view.h"
#include "surfel/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace surflect::chart {

namespace {

constexpr double kWidth = 500, kHeight = 400, kLeft = 56, kRight = 490, kTop = 30, kBottom = 352;

std::string svgOpening(double width, double height, std::string_view description) {
  return fmt::format(R"(<svg viewBox="0 0 {} {}" role="img" aria-label="{}">)", width, height,
                     escaped(description));
}

std::string segment(Place a, Place b, std::string_view classes) {
  const Place both[] = {a, b};
  return line(both, classes);
}

// Vertical lines at round values, and these values below.
std::string horizontalAxis(const Axis& x, double top, double bottom, std::string_view title) {
  std::string svg;
  for (const double tick : ticks(x, 8)) {
    const double at = x.position(tick);
    svg += segment({at, top}, {at, bottom}, "grid");
    svg += text({at, bottom + 17}, "middle", shortest(tick, 6), "tick");
  }
  svg += segment({x.first, bottom}, {x.last, bottom}, "edge");
  svg += text({x.last, bottom + 37}, "end", title, "title");
  return svg;
}

// Horizontal lines at round values, and these values on the left; the title stands above.
std::string verticalAxis(const Axis& y, double left, double right, std::string_view title, size_t most) {
  std::string svg;
  for (const double tick : ticks(y, most)) {
    const double at = y.position(tick);
    svg += segment({left, at}, {right, at}, "grid");
    svg += text({left - 7, at + 4}, "end", shortest(tick, 6), "tick");
  }
  svg += text({0, y.last - 14}, "start", title, "title");
  return svg;
}

struct Spot {
  size_t point = 0;
  Place place;
  bool isOnFront = false; // of the plot
  bool isBent = false;
};

// Mark with a tooltip, which leads to the row of the table.
std::string spotMark(const View& view, const Spot& spot, double radius) {
  const Point& point = view.at(spot.point);
  const size_t model = view.modelOf[spot.point];
  std::string classes =
      fmt::format("mark f{0} {1}", model % kHues, spot.isBent ? fmt::format("bent s{}", model % kHues) : "");
  if (spot.isOnFront) classes += " best";
  if (point.isChosen) classes += " chosen";
  return fmt::format(R"(<a href="#p{0}" data-point="{0}"{1}><title>{2}</title>{3}</a>)", spot.point,
                     point.isChosen ? "" : R"( tabindex="-1")", escaped(tooltip(view, spot.point)),
                     mark(model, spot.place, radius, classes));
}

// "B preview"
std::string labelOf(const View& view, size_t point) {
  const std::string name = nameOf(view, point);
  return view.letters[point] + (name.empty() || name.size() > 14 ? "" : " " + name);
}

// Places along a line, near enough to keep labels off it.
void addPlaces(std::vector<Place>& places, Place from, Place to) {
  const double steps = std::max(1.0, std::ceil(std::hypot(to.x - from.x, to.y - from.y) / 6));
  for (double k = 0; k <= steps; ++k)
    places.push_back({std::lerp(from.x, to.x, k / steps), std::lerp(from.y, to.y, k / steps)});
}

// Marks, the chosen ones on top, and the labels of the chosen ones, which keep off `occupied`, too.
std::string spotMarks(const View& view, std::vector<Spot> spots, std::vector<Place> occupied) {
  const auto rank = [&](const Spot& spot) { return 2 * view.at(spot.point).isChosen + spot.isOnFront; };
  std::ranges::stable_sort(spots, {}, rank);
  const double radius = spots.size() > 150 ? 4 : 5;
  std::string svg;
  std::vector<Place> labelled;
  std::vector<std::array<double, 2>> sizes;
  std::vector<size_t> points;
  for (const Spot& spot : spots) {
    const bool isChosen = view.at(spot.point).isChosen;
    svg += spotMark(view, spot, isChosen ? 6.5 : radius);
    occupied.push_back(spot.place);
    if (!isChosen) continue;
    labelled.push_back(spot.place);
    points.push_back(spot.point);
    sizes.push_back({7.2 * static_cast<double>(labelOf(view, spot.point).size()) + 4, 15});
  }
  const std::vector<Box> boxes =
      placeLabels(labelled, sizes, occupied, {kLeft + 2, kTop - 10, kRight - kLeft - 4, kBottom - kTop + 8});
  for (size_t i = 0; i < boxes.size(); ++i) {
    const auto& [x, y, width, height] = boxes[i];
    const Place from = labelled[i],
                to = {std::clamp(from.x, x + 2, x + width - 2), std::clamp(from.y, y + 2, y + height - 2)};
    const double distance = std::hypot(to.x - from.x, to.y - from.y);
    if (distance > 14) {
      const double start = 8 / distance;
      svg += segment({from.x + start * (to.x - from.x), from.y + start * (to.y - from.y)}, to, "leader");
    }
    svg += text({x + width / 2, y + height - 3.5}, "middle", labelOf(view, points[i]), "label");
  }
  return svg;
}

Axis timeAxis(const View& view) {
  std::vector<double> times;
  for (const Point& point : view.chart.points) times.push_back(point.milliseconds);
  return axisAround(times, true, kLeft, kRight);
}

std::string legendItem(std::string_view sample, std::string_view words) {
  return fmt::format(R"(<li><svg viewBox="0 0 18 18" aria-hidden="true">{}</svg>{}</li>)", sample,
                     escaped(words));
}

std::string modelLegend(const View& view) {
  std::string html;
  for (size_t model = 0; view.models.size() > 1 && model < view.models.size(); ++model)
    html += legendItem(mark(model, {9, 9}, 5, fmt::format("mark best f{}", model % kHues)),
                       modelName(view, model));
  return html;
}

// Points that differ from full in one knob alone.
struct Alone {
  std::vector<std::string> values;                    // of the knob, from full to the fastest
  std::vector<std::vector<std::optional<size_t>>> of; // points by model and value
};

Alone aloneOf(const View& view, const method::Option& knob) {
  Alone alone;
  alone.of.resize(view.models.size());
  for (size_t v = 0; v < knob.sweep.size(); ++v) {
    const method::Setting wanted = v == 0 ? method::Setting{} : method::Setting{{knob.name, knob.sweep[v]}};
    std::vector<std::optional<size_t>> found(view.models.size());
    for (size_t i = 0; i < view.settings.size(); ++i)
      if (view.settings[i] == wanted && hasTime(view.at(i)) && view.fullOf(i)) found[view.modelOf[i]] = i;
    if (std::ranges::none_of(found, [](const auto& point) { return point.has_value(); })) continue;
    alone.values.push_back(knob.sweep[v].text());
    for (size_t model = 0; model < found.size(); ++model) alone.of[model].push_back(found[model]);
  }
  return alone;
}

double timeShare(const View& view, size_t point) {
  return view.at(point).milliseconds / view.fullOf(point)->milliseconds;
}

// Error and time of one knob alone, in two panels. All knobs share the scales.
std::string knobPlot(const View& view, const method::Option& knob, const Alone& alone, double mostError,
                     double mostTime) {
  constexpr double left = 34, right = 218, width = 220;
  const Axis errors{false, 0, 1.2 * mostError, 104, 24}, times{false, 0, 1.2 * mostTime, 226, 146};
  const double step = (right - left) / static_cast<double>(alone.values.size());
  std::string html = fmt::format("<figure><figcaption><h3>{}</h3><p class=\"note\">{}</p></figcaption>",
                                 escaped(knob.name), escaped(knob.help));
  html += svgOpening(width, 250, knob.name + ": error and time");
  html += verticalAxis(errors, left, right, "error to full, %", 4) +
          verticalAxis(times, left, right, "time, full = 1", 4) +
          segment({left, errors.first}, {right, errors.first}, "edge") +
          segment({left, times.first}, {right, times.first}, "edge");
  std::string marks;
  for (size_t model = 0; model < alone.of.size(); ++model) {
    for (const bool isTime : {false, true}) {
      std::vector<Place> places;
      for (size_t v = 0; v < alone.values.size(); ++v) {
        const auto& point = alone.of[model][v];
        if (!point) continue;
        const double figure = isTime ? timeShare(view, *point) : 100 * view.at(*point).rmsToFull;
        if (!std::isfinite(figure)) continue;
        places.push_back(
            {left + (static_cast<double>(v) + 0.5) * step, (isTime ? times : errors).position(figure)});
        marks += fmt::format(R"(<a href="#p{0}" data-point="{0}" tabindex="-1"><title>{1}</title>{2}</a>)",
                             *point, escaped(tooltip(view, *point)),
                             mark(model, places.back(), 4, fmt::format("mark best f{}", model % kHues)));
        if (view.models.size() == 1 && v > 0 && v + 1 == alone.values.size())
          marks += text({places.back().x, places.back().y - 9}, "middle",
                        isTime ? rounded(figure, 2) : errorText(view.at(*point).rmsToFull), "value");
      }
      html += line(places, fmt::format("front s{}", model % kHues));
    }
  }
  html += marks;
  // Values are left out where they would overlap.
  size_t longest = 0;
  for (const std::string& value : alone.values) longest = std::max(longest, value.size());
  const auto every = static_cast<size_t>(std::ceil((7.0 * static_cast<double>(longest) + 4) / step));
  for (size_t v = 0; v < alone.values.size(); v += every)
    html += text({left + (static_cast<double>(v) + 0.5) * step, times.first + 17}, "middle", alone.values[v],
                 "tick");
  return html + "</svg></figure>";
}

} // namespace

std::string errorPlot(const View& view) {
  // Errors that nobody sees are drawn below the axis, together with 0, at a line of their own.
  constexpr double lowest = kBottom - 40, invisible = kBottom - 12;
  const Axis x = timeAxis(view);
  std::vector<double> errors;
  for (const Point& point : view.chart.points)
    if (point.rmsToFull >= kVisibleError) errors.push_back(100 * point.rmsToFull);
  const Axis y = axisAround(errors, true, lowest, kTop);
  std::vector<Spot> spots;
  std::vector<std::vector<Place>> fronts(view.models.size());
  std::vector<double> least(view.models.size(), HUGE_VAL); // error of the points so far, by model
  for (const size_t i : view.byTime) {
    const Point& point = view.at(i);
    if (!hasTime(point) || !std::isfinite(point.rmsToFull) || point.rmsToFull < 0) continue;
    const double error = point.rmsToFull >= kVisibleError ? point.rmsToFull : 0;
    const Place place{x.position(point.milliseconds), error > 0 ? y.position(100 * error) : invisible};
    const size_t model = view.modelOf[i];
    const bool isOnFront = error < least[model];
    spots.push_back({i, place, isOnFront});
    if (!isOnFront) continue;
    fronts[model].push_back(place);
    least[model] = error;
  }
  std::string html =
      "<figure><figcaption><h3>Time and error to full</h3><p class=\"note\">Lower left is better: "
      "faster, and closer to the pictures at full.";
  if (view.models.size() > 1) html += " Each model is compared with its own full.";
  html += "</p></figcaption>";
  html += svgOpening(kWidth, kHeight, "Time per frame against error to full");
  html += horizontalAxis(x, kTop, kBottom, "time per frame, ms");
  html += verticalAxis(y, kLeft, kRight, "error to full (relative RMS), %", 7);
  html += segment({kLeft, invisible}, {kRight, invisible}, "grid");
  html += text({kLeft - 7, invisible + 4}, "end", errorText(kVisibleError / 2), "tick");
  std::vector<Place> occupied;
  for (size_t model = 0; model < fronts.size(); ++model) {
    html += line(fronts[model], fmt::format("front s{}", model % kHues));
    for (size_t i = 1; i < fronts[model].size(); ++i)
      addPlaces(occupied, fronts[model][i - 1], fronts[model][i]);
  }
  html += spotMarks(view, std::move(spots), std::move(occupied)) + "</svg><ul class=\"legend\">";
  html += legendItem(R"(<path class="front s0" d="M0 9h18"/>)",
                     "front: no other setting is both faster and closer to full");
  return html + modelLegend(view) + "</ul></figure>";
}

std::string agreementPlot(const View& view) {
  const Axis x = timeAxis(view);
  const auto each = [&](auto visit) { // visits finite figures, deformed ones first
    for (const bool isBent : {true, false})
      for (const size_t i : view.byTime) {
        const Point& point = view.at(i);
        if (isBent && !point.bent) continue;
        const double decibel = isBent ? point.bent->psnrSrgbDb : point.rest.psnrSrgbDb;
        if (hasTime(point) && std::isfinite(decibel)) visit(i, isBent, decibel);
      }
  };
  std::vector<double> figures;
  each([&](size_t, bool, double decibel) { figures.push_back(decibel); });
  if (!figures.empty()) { // at least 2 dB, so that differences which nobody sees look small
    const auto [low, high] = std::ranges::minmax(figures);
    figures.insert(figures.end(), {(low + high) / 2 - 1, (low + high) / 2 + 1});
  }
  const Axis y = axisAround(figures, false, kBottom, kTop);
  std::string lines;
  std::vector<Spot> spots;
  std::vector<Place> front, occupied;
  each([&](size_t i, bool isBent, double decibel) {
    const Place place{x.position(view.at(i).milliseconds), y.position(decibel)};
    spots.push_back({i, place, view.at(i).isOnFront, isBent});
    if (view.at(i).isOnFront && !isBent) {
      if (!front.empty()) addPlaces(occupied, front.back(), place);
      front.push_back(place);
    }
    if (view.full[view.modelOf[i]] != i) return;
    const double at = y.position(decibel);
    lines += segment({kLeft, at}, {kRight, at}, fmt::format("full s{}", view.modelOf[i] % kHues));
    addPlaces(occupied, {kLeft, at}, {kRight, at});
  });
  std::string html =
      "<figure><figcaption><h3>Time and agreement with photographs</h3><p class=\"note\">Upper left "
      "is better. A setting at the dashed line loses nothing against full.</p></figcaption>";
  html += svgOpening(kWidth, kHeight, "Time per frame against PSNR to held-out photographs");
  html += horizontalAxis(x, kTop, kBottom, "time per frame, ms");
  html += verticalAxis(y, kLeft, kRight, "PSNR to held-out photographs (sRGB), dB", 7);
  const std::string_view ofFront = view.models.size() > 1 ? "front across" : "front s0";
  html += lines + line(front, ofFront) + spotMarks(view, std::move(spots), std::move(occupied)) +
          "</svg><ul class=\"legend\">";
  html += legendItem(fmt::format(R"(<path class="{}" d="M0 9h18"/>)", ofFront),
                     "front: no other setting is both faster and closer to photographs at rest");
  html += legendItem(R"(<path class="full s0" d="M0 9h18"/>)", "full");
  if (view.hasBent()) {
    html += legendItem(mark(0, {9, 9}, 5, "mark best f0"), "object at rest");
    html += legendItem(mark(0, {9, 9}, 5, "mark best bent f0 s0"), "object deformed");
  }
  return html + modelLegend(view) + "</ul></figure>";
}

std::string knobPlots(const View& view) {
  std::vector<std::pair<const method::Option*, Alone>> plots;
  double mostError = 0, mostTime = 1;
  for (const method::Option& knob : view.chart.knobs) {
    Alone alone = aloneOf(view, knob);
    if (alone.values.size() < 2) continue;
    for (const auto& points : alone.of)
      for (const auto& point : points) {
        if (!point) continue;
        if (std::isfinite(view.at(*point).rmsToFull))
          mostError = std::max(mostError, 100 * view.at(*point).rmsToFull);
        if (std::isfinite(timeShare(view, *point))) mostTime = std::max(mostTime, timeShare(view, *point));
      }
    plots.emplace_back(&knob, std::move(alone));
  }
  if (plots.empty()) return "";
  std::string html;
  for (const auto& [knob, alone] : plots)
    html += knobPlot(view, *knob, alone, mostError > 0 ? mostError : 1, mostTime);
  return html;
}

namespace {

std::string knobSection(const View& view) {
  const std::string plots = knobPlots(view);
  if (plots.empty()) return "";
  std::string html =
      "<section><h2>Each knob alone</h2><p>One knob goes from full, on the left, to its fastest value; all "
      "others stay at full. The scales are the same in all plots.";
  for (size_t model = 0; model < view.models.size(); ++model) {
    const auto idle = view.chart.idleKnobs.find(view.models[model]);
    if (idle != view.chart.idleKnobs.end())
      html += fmt::format(" Without effect on {}: {}.", escaped(modelName(view, model)),
                          escaped(fmt::format("{}", fmt::join(idle->second, ", "))));
  }
  return html + "</p><div class=\"knobs\">" + plots + "</div></section>";
}

std::string stageSection(const View& view) {
  std::map<std::string, double> sums;
  double longest = 0;
  for (const size_t i : view.chosen) {
    double sum = 0;
    for (const auto& [stage, milliseconds] : view.at(i).stages) {
      if (!(milliseconds > 0 && std::isfinite(milliseconds))) continue;
      sums[stage] += milliseconds;
      sum += milliseconds;
    }
    longest = std::max({longest, sum, hasTime(view.at(i)) ? view.at(i).milliseconds : 0});
  }
  if (sums.empty()) return "";
  // The longest stages have hues of their own; the others share the last one.
  std::vector<std::string> stages;
  for (const auto& [stage, sum] : sums) stages.push_back(stage);
  std::ranges::stable_sort(stages, std::greater(), [&](const std::string& stage) { return sums[stage]; });
  if (stages.size() > kHues - 1) stages.resize(kHues - 1);

  std::string html =
      "<section><h2>Where the time goes</h2><p>Milliseconds per frame by stage of the renderer, for "
      "the chosen settings.</p><div class=\"bars\">";
  bool hasOther = false;
  for (const size_t i : view.chosen) {
    const Point& point = view.at(i);
    html += fmt::format(R"(<div class="name">{}</div><div class="bar">)", heading(view, i));
    double sum = 0;
    const auto part = [&](size_t hue, std::string_view stage, double milliseconds) {
      sum += milliseconds;
      html += fmt::format(R"(<i class="b{}" style="width:{:.2f}%" title="{}: {}">{}</i>)", hue,
                          80 * milliseconds / longest, escaped(stage), millisecondsText(milliseconds),
                          milliseconds > 0.06 * longest ? rounded(milliseconds, 2) : "");
    };
    for (size_t s = 0; s < stages.size(); ++s)
      if (const auto found = point.stages.find(stages[s]);
          found != point.stages.end() && found->second > 0 && std::isfinite(found->second))
        part(s, stages[s], found->second);
    if (const double other = point.milliseconds - sum; hasTime(point) && other > 0.01 * point.milliseconds) {
      part(kHues - 1, "other", other);
      hasOther = true;
    }
    html += fmt::format("<b>{}</b></div>", millisecondsText(point.milliseconds));
  }
  html += "</div><ul class=\"legend\">";
  for (size_t s = 0; s < stages.size(); ++s)
    html += fmt::format(R"(<li><i class="b{}"></i>{}</li>)", s, escaped(stages[s]));
  if (hasOther) html += fmt::format(R"(<li><i class="b{}"></i>other</li>)", kHues - 1);
  return html + "</ul></section>";
}

std::string pngUri(const std::string& png) { return "data:image/png;base64," + base64(png); }

std::string pictureSection(const View& view) {
  const std::vector<Panel>& panels = view.chart.panels;
  std::vector<std::string> frames;
  for (const Panel& panel : panels)
    if (panel.point < view.chart.points.size() && std::ranges::find(frames, panel.frame) == frames.end())
      frames.push_back(panel.frame);
  if (frames.empty()) return "";
  std::string html =
      "<section><h2>Pictures</h2><p>A held-out photograph, the pictures of the chosen settings, and below "
      "each "
      "its FLIP map: how strongly a viewer notices the difference when the two alternate. Point at a picture "
      "to see the photograph in its place.</p>";
  for (size_t f = 0; f < frames.size(); ++f) {
    std::vector<const Panel*> shown;
    for (const Panel& panel : panels)
      if (panel.point < view.chart.points.size() && panel.frame == frames[f]) shown.push_back(&panel);
    std::ranges::stable_sort(shown, std::greater(),
                             [&](const Panel* panel) { return view.at(panel->point).milliseconds; });
    html += fmt::format(R"(<h3>{}</h3><div class="pictures">)", escaped(frames[f]));
    html += fmt::format(
        "<figure><figcaption>Photograph</figcaption><img id=\"truth{}\" alt=\"Photograph\" src=\"{}\"/>"
        "<div class=\"scale\"></div><div class=\"ends\"><span>0</span><span>FLIP</span><span>1</span></div>"
        "<p class=\"note\">Black: no visible difference. Pale yellow: black against white.</p></figure>",
        f, pngUri(shown.front()->truthPng));
    for (const Panel* panel : shown) {
      html += fmt::format(
          R"(<figure><figcaption title="{0}">{1}</figcaption><img data-truth="truth{2}" alt="Rendered)"
          R"( at {0}" src="{3}"/>)",
          escaped(settingText(view, panel->point)),
          view.letters[panel->point].empty() ? "<code>" + escaped(settingText(view, panel->point)) + "</code>"
                                             : heading(view, panel->point),
          f, pngUri(panel->renderedPng));
      if (!panel->errorPng.empty())
        html += fmt::format(R"(<img alt="FLIP map" src="{}"/>)", pngUri(panel->errorPng));
      html += "</figure>";
    }
    html += "</div>";
  }
  return html + "</section>";
}

// Table

struct Column {
  std::string name, unit;
  int decimals = 0; // negative: three digits for the least figure, at most -decimals of them after the point
  std::function<std::optional<double>(size_t)> figure;
};

std::vector<Column> columnsOf(const View& view) {
  std::vector<Column> columns{
      {"Time", "ms", -3, [&](size_t i) { return view.at(i).milliseconds; }},
      {"Speed", "full = 1", 2,
       [&](size_t i) -> std::optional<double> {
         if (const Point* full = view.fullOf(i)) return full->milliseconds / view.at(i).milliseconds;
         return {};
       }},
      {"Error to full", "%", -3, [&](size_t i) { return 100 * view.at(i).rmsToFull; }}};
  const auto add = [&](const std::string& pose, auto agreementOf) {
    const auto column = [&](const char* name, const std::string& unit, int decimals,
                            double Agreement::*field) {
      columns.push_back(
          {name, unit, decimals, [&view, agreementOf, field](size_t i) -> std::optional<double> {
             const std::optional<Agreement> agreement = agreementOf(view.at(i));
             return agreement ? std::optional((*agreement).*field) : std::nullopt;
           }});
    };
    column("PSNR", "sRGB, dB" + pose, 2, &Agreement::psnrSrgbDb);
    column("PSNR", "linear, dB" + pose, 2, &Agreement::psnrLinearDb);
    column("SSIM", pose.empty() ? "" : pose.substr(2), 4, &Agreement::ssim);
    column("FLIP", pose.empty() ? "" : pose.substr(2), 4, &Agreement::flip);
  };
  add(view.hasBent() ? ", at rest" : "", [](const Point& point) { return std::optional(point.rest); });
  if (view.hasBent()) add(", deformed", [](const Point& point) { return point.bent; });
  const auto bytes = [&](const char* name, auto field) {
    if (std::ranges::any_of(view.chart.points, [&](const Point& point) { return point.*field > 0; }))
      columns.push_back({name, "MB", -1, [&view, field](size_t i) {
                           return std::optional(1e-6 * static_cast<double>(view.at(i).*field));
                         }});
  };
  bytes("Read", &Point::bytesRead);
  bytes("Model", &Point::modelBytes);
  bytes("Memory", &Point::memoryBytes);
  for (Column& column : columns) {
    if (column.decimals >= 0) continue;
    double least = HUGE_VAL;
    for (size_t i = 0; i < view.chart.points.size(); ++i)
      if (const auto figure = column.figure(i); figure && *figure > 0) least = std::min(least, *figure);
    column.decimals = std::isfinite(least) ? std::clamp(2 - static_cast<int>(std::floor(std::log10(least))),
                                                        0, -column.decimals)
                                           : 0;
  }
  return columns;
}

std::string tableSection(const View& view) {
  const std::vector<Column> columns = columnsOf(view);
  const bool hasModels = view.models.size() > 1;
  std::string html = "<section><h2>All settings</h2><p>Settings on the front of the photographs are bold. "
                     "Each command reproduces its "
                     "row alone. Headings sort the table.</p><div class=\"scroll\"><table><thead><tr>"
                     "<th class=\"left\" scope=\"col\"><button>Setting</button></th>";
  if (hasModels) html += "<th class=\"left\" scope=\"col\"><button>Model</button></th>";
  for (const Column& column : columns)
    html += fmt::format("<th scope=\"col\"{}><button>{}</button><small>{}</small></th>",
                        &column == &columns.front() ? " aria-sort=\"ascending\"" : "", column.name,
                        column.unit.empty() ? "&#160;" : column.unit);
  html += "<th class=\"left\" scope=\"col\">Command</th></tr></thead><tbody>";
  for (const size_t i : view.byTime) {
    const Point& point = view.at(i);
    const std::string setting = settingText(view, i);
    html += fmt::format(R"(<tr id="p{0}" data-point="{0}"{1}><td class="left setting" data-key="{2}">)", i,
                        point.isOnFront ? R"( class="front-row")" : "", escaped(setting));
    if (point.isChosen) html += badge(view, i) + " ";
    if (!point.name.empty()) html += escaped(point.name) + " ";
    html += "<code>" + escaped(setting) + "</code></td>";
    if (hasModels) {
      const std::string model = escaped(modelName(view, view.modelOf[i]));
      html += fmt::format(R"(<td class="left" data-key="{0}">{0}</td>)", model);
    }
    for (const Column& column : columns) {
      const std::optional<double> figure = column.figure(i);
      const double key = figure && !std::isnan(*figure) ? std::clamp(*figure, -1e300, 1e300) : -1e300;
      html += fmt::format(R"(<td data-key="{:.9g}">{}</td>)", key,
                          figure ? fixedText(*figure, column.decimals) : "–");
    }
    html += fmt::format("<td class=\"left\"><div class=\"command\"><button class=\"copy\">Copy</button>"
                        "<code>{}</code></div></td></tr>\n",
                        escaped(point.command));
  }
  return html + "</tbody></table></div></section>";
}

// Head of the page

// The sentence that says what a chosen point buys.
std::string boughtSentence(const View& view, size_t i) {
  const Point& point = view.at(i);
  const Point* full = view.fullOf(i);
  const std::string name = nameOf(view, i);
  std::string html = "At <b>" + escaped(name.empty() ? settingText(view, i) : name) + "</b>";
  if (view.models.size() > 1) html += " of " + escaped(modelName(view, view.modelOf[i]));
  html += ", a frame takes " + millisecondsText(point.milliseconds);
  if (!full || view.isFull(i))
    return html + fmt::format(" and reaches {} PSNR against held-out photographs.",
                              decibelText(point.rest.psnrSrgbDb));
  html += fmt::format(": {} ({}). Its pictures differ from those at full by {} (relative RMS).",
                      fasterText(full->milliseconds / point.milliseconds),
                      millisecondsText(full->milliseconds), escaped(percentText(point.rmsToFull)));
  return html + fmt::format(" Against held-out photographs it reaches {} PSNR, {}.",
                            decibelText(point.rest.psnrSrgbDb),
                            againstFullText(point.rest.psnrSrgbDb, full->rest.psnrSrgbDb));
}

// The chosen point that the page opens with: the preview, or the fastest.
std::optional<size_t> leadingPoint(const View& view) {
  for (const size_t i : view.chosen)
    if (view.at(i).name == kPreviewName) return i;
  return view.chosen.empty() ? std::nullopt : std::optional(view.chosen.back());
}

std::string card(const View& view, size_t i) {
  const Point& point = view.at(i);
  const Point* full = view.fullOf(i);
  const auto entry = [](std::string_view name, std::string_view value) {
    return fmt::format("<dt>{}</dt><dd>{}</dd>", name, value);
  };
  std::string html =
      fmt::format(R"(<div class="card"><h3>{}</h3><p class="big">{} <small>per frame</small></p><dl>)",
                  heading(view, i), millisecondsText(point.milliseconds));
  if (full && !view.isFull(i)) {
    html += entry("speed", fixedText(full->milliseconds / point.milliseconds, 2) + " × full");
    html += entry("error to full", escaped(percentText(point.rmsToFull)));
  }
  const auto agreement = [&](std::string_view pose, const Agreement& own, const Agreement* best) {
    html += entry(fmt::format("PSNR, {}", pose), decibelText(own.psnrSrgbDb));
    if (best)
      html += fmt::format(R"(<dd class="note">{}</dd>)", againstFullText(own.psnrSrgbDb, best->psnrSrgbDb));
  };
  const bool hasFull = full && !view.isFull(i);
  agreement("at rest", point.rest, hasFull ? &full->rest : nullptr);
  if (point.bent) agreement("deformed", *point.bent, hasFull && full->bent ? &*full->bent : nullptr);
  return html + "</dl></div>";
}

std::string headSection(const View& view) {
  const Chart& chart = view.chart;
  std::string html =
      fmt::format("<header><p class=\"kicker\">Speed against accuracy</p><h1>{}</h1>", escaped(chart.title));
  if (const auto leading = leadingPoint(view))
    html += fmt::format("<p class=\"lead\">{}</p>", boughtSentence(view, *leading));
  const auto entry = [](std::string_view name, const std::string& value) {
    return fmt::format("<dt>{}</dt><dd>{}</dd>", name, value);
  };
  const auto onFront = static_cast<size_t>(std::ranges::count_if(chart.points, &Point::isOnFront));
  std::string frames = fmt::format("{} of {} of the object at rest", chart.restFrames,
                                   counted(chart.restHeldOut, "held-out photograph"));
  if (chart.bentFrames > 0)
    frames += fmt::format(", {} of {} of it deformed", chart.bentFrames, chart.bentHeldOut);
  html += "<dl>" + entry("Machine", escaped(chart.machine)) + entry("Frames", frames);
  html += entry("Settings",
                fmt::format("{}{}, of which {} on the front", chart.points.size(),
                            view.models.size() > 1 ? " of " + counted(view.models.size(), "model") : "",
                            onFront));
  html += entry("Command", "<code>" + escaped(chart.command) + "</code>") + "</dl></header>";
  if (!view.chosen.empty()) {
    html += "<div class=\"cards\">";
    for (const size_t i : view.chosen) html += card(view, i);
    html += "</div>";
  }
  return html;
}

constexpr std::string_view kTerms = R"(<section><h2>Terms</h2><dl class="terms">
<dt>Knob</dt><dd>A parameter of the renderer that trades accuracy for speed.</dd>
<dt>Setting</dt><dd>Values of knobs; a knob that is not named is at its most accurate value.</dd>
<dt>Full</dt><dd>The setting with every knob at its most accurate value, which is the default.</dd>
<dt>Time</dt><dd>Median time of a frame.</dd>
<dt>Error to full</dt><dd>Relative RMS: the root of the mean squared difference between the pictures of a setting and
those at full, divided by the root mean square of those at full.</dd>
<dt>Front</dt><dd>The Pareto front: settings to which no other is both faster and more accurate. Each plot draws the
front of its own measure; the table marks that of the photographs at rest.</dd>
<dt>PSNR</dt><dd>Peak signal-to-noise ratio in decibels, from the mean squared difference to held-out photographs, which
the model has not seen; more is better, and 1 dB is hard to see.</dd>
<dt>SSIM</dt><dd>Structural similarity: agreement of local means, contrasts and patterns with the photograph; 1 is
equality.</dd>
<dt>FLIP</dt><dd>Difference that a viewer perceives when picture and photograph alternate in the same place; 0 is none,
1 is the most.</dd>
<dt>Read, model, memory</dt><dd>Bytes that a frame reads from the model's files with an empty cache, the size of these
files, and the most memory that the program took.</dd>
</dl></section>)";

} // namespace

std::string htmlOf(const Chart& chart) {
  const View view = viewOf(chart);
  // The policy keeps the page from loading anything, whatever its texts are.
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'; script-src 'unsafe-inline'\"/>"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/><title>" +
      escaped(chart.title) + ": speed against accuracy</title><style>";
  html += kStyle;
  html += "</style></head><body>\n" + headSection(view);
  if (!chart.points.empty()) {
    html += "<section><h2>Speed against accuracy</h2><p>Each mark is a setting of the renderer's knobs. "
            "Point at one "
            "for its figures and its command; click it for its row in the table.</p><div class=\"plots\">\n" +
            errorPlot(view) + "\n" + agreementPlot(view) + "</div></section>\n";
    html += knobSection(view) + "\n" + stageSection(view) + "\n" + pictureSection(view) + "\n" +
            tableSection(view);
  }
  html += kTerms;
  html += "<script>";
  html += kScript;
  html += "</script></body></html>\n";
  return html;
}

} // namespace surflect::chart
