#include "render/chart/plots.h"

#include "render/chart/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

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

} // namespace surflect::chart
