#include "render/verify/page.h"

#include "surfel/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

namespace surflect::verify {

namespace {

constexpr std::string_view kPageStyle = R"(
:root { color-scheme: light dark; --page: #fdfdfc; --ink: #1c1e21; --soft: #5f656d; --rule: #dedfdc; --bad: #c0391b;
  --good: #1d7a4d; --card: #f5f5f3; }
@media (prefers-color-scheme: dark) { :root { --page: #16181b; --ink: #e8e9ea; --soft: #a2a8b0; --rule: #363a40;
  --bad: #ff7d5c; --good: #4cc38a; --card: #1f2226; } }
body { margin: 0 auto; padding: 48px 32px; max-width: 1080px; background: var(--page); color: var(--ink);
  font: 16px/1.5 system-ui, "Segoe UI", Roboto, Arial, sans-serif; font-variant-numeric: tabular-nums; }
h1 { font-size: 30px; margin: 0 0 8px; overflow-wrap: anywhere; }
h2 { font-size: 21px; margin: 48px 0 8px; }
p { max-width: 75ch; }
code { overflow-wrap: anywhere; }
table { border-collapse: collapse; width: 100%; margin: 12px 0; }
th, td { text-align: left; vertical-align: top; padding: 6px 12px 6px 0; border-bottom: 1px solid var(--rule); }
th { color: var(--soft); font-weight: 500; }
td.figure { white-space: nowrap; }
.broken { color: var(--bad); font-weight: 650; }
.kept { color: var(--good); }
.soft { color: var(--soft); }
figure { margin: 12px 0; }
img { max-width: 100%; border-radius: 4px; }
ul.legend { list-style: none; padding: 0; display: flex; flex-wrap: wrap; gap: 4px 20px; }
ul.legend i { display: inline-block; width: 14px; height: 14px; border-radius: 3px; margin-right: 6px;
  vertical-align: -2px; }
.card { background: var(--card); padding: 12px 20px; border-radius: 8px; margin: 16px 0; }
)";

std::string placeText(const FlaggedPlace& place) {
  std::string text = fmt::format("surfel {} at ({:.4g}, {:.4g}, {:.4g})", place.surfel, place.rest[0],
                                 place.rest[1], place.rest[2]);
  if (place.pixel) text += fmt::format(", pixel ({:.0f}, {:.0f})", place.pixel->x, place.pixel->y);
  return text;
}

std::string boundText(const Check& check) {
  if (!check.bound) return "";
  return fmt::format("{} {}", check.rule->isLeast ? "at least" : "at most",
                     figureText(*check.rule, *check.bound));
}

std::string tableOf(std::span<const Check> checks) {
  std::string html = "<table><tr><th></th><th>Check</th><th>Figure</th><th>Bound</th><th>Finding</th></tr>\n";
  int number = 0;
  for (const Check& check : checks) {
    const bool isBroken = check.verdict == Verdict::broken;
    const std::string verdict =
        isBroken ? fmt::format("{} broken", ++number) : std::string(nameOf(check.verdict));
    html += fmt::format("<tr><td class=\"{}\">{}</td><td>{}<br><code class=\"soft\">{}</code></td>",
                        nameOf(check.verdict),
                        check.verdict == Verdict::inapplicable ? "does not apply" : verdict,
                        escaped(check.rule->claim), check.rule->name);
    html += fmt::format(
        "<td class=\"figure\">{}</td><td class=\"figure\">{}</td><td>{}",
        check.verdict == Verdict::inapplicable ? "" : escaped(figureText(*check.rule, check.figure)),
        escaped(boundText(check)), escaped(check.finding));
    if (isBroken) {
      html += fmt::format("<br><b>{}</b>", escaped(check.rule->advice));
      for (const FlaggedPlace& place : check.places)
        html += fmt::format("<br><span class=\"soft\">{}</span>", escaped(placeText(place)));
    }
    html += "</td></tr>\n";
  }
  return html + "</table>\n";
}

std::string pictureTable(const Exactness& exactness) {
  if (exactness.pictures.empty()) return "";
  std::vector<ExactPicture> pictures = exactness.pictures;
  std::ranges::stable_sort(pictures, {}, &ExactPicture::psnrLinearDb);
  std::string html = "<details><summary>" + counted(pictures.size(), "photograph") +
                     ", the worst first</summary><table><tr><th>Camera</th><th>Light</th><th>linear dB</th>"
                     "<th>inside, dB</th><th>sRGB dB</th><th>SSIM</th></tr>\n";
  for (const ExactPicture& picture : pictures)
    html += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.4f}</td></tr>\n",
        escaped(picture.camera), escaped(picture.light), picture.psnrLinearDb, picture.psnrInteriorDb,
        picture.psnrSrgbDb, picture.ssim);
  return html + "</table></details>\n";
}

} // namespace

size_t Report::broken() const {
  size_t count = countBroken(model) + countBroken(exactness.checks);
  for (const FrameReport& frame : frames) count += countBroken(frame.findings.checks);
  return count;
}

std::string overlayName(int frame) { return fmt::format("frame.{:04}.png", frame); }

std::string pageOf(const Report& report) {
  std::string html =
      fmt::format("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title>"
                  "<style>{}</style></head><body>\n<h1>{}</h1>\n",
                  escaped("Verified: " + report.title), kPageStyle, escaped(report.title));
  const size_t broken = report.broken();
  html +=
      fmt::format("<p class=\"{}\">{}</p>\n", broken > 0 ? "broken" : "kept",
                  broken > 0 ? counted(broken, "check") + (broken == 1 ? " is" : " are") + " out of bounds"
                             : "Everything is within bounds");
  html += fmt::format("<p class=\"soft\"><code>{}</code></p>\n", escaped(report.command));
  html += "<h2>Model</h2>\n" + tableOf(report.model);
  html += fmt::format("<h2>Certificate: its own photographs come back</h2>\n<p>Compared with {}.</p>\n",
                      report.exactness.isOfCapture ? "the photographs of the capture"
                                                   : "the photographs as the model stores them");
  html += tableOf(report.exactness.checks) + pictureTable(report.exactness);
  for (const auto& [number, findings] : report.frames) {
    html += fmt::format(
        "<h2 id=\"frame{0}\">Frame {0}</h2>\n<figure><img src=\"{1}\" alt=\"Frame {0}\"></figure>\n", number,
        overlayName(number));
    html += "<ul class=\"legend\">";
    for (const FlagColor& flag : kFlagColors)
      html += fmt::format("<li><i style=\"background:{}\"></i>{}</li>", flag.color, flag.meaning);
    html += "</ul>\n<p class=\"soft\">Rings have the numbers of the broken checks below; a place may "
            "lie behind what is seen.</p>\n" +
            tableOf(findings.checks);
  }
  return html + "</body></html>\n";
}

} // namespace surflect::verify
