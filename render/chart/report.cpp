#include "render/chart/report.h"

#include "render/chart/front.h"
#include "render/chart/plots.h"
#include "render/chart/report_style.h"
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
