#include "render/chart/report.h"

#include "render/chart/svg.h"
#include "surfel/base/text.h"

#include <cmath>
#include <regex>

namespace surflect::chart {
namespace {

Point pointOf(const method::Setting& setting, double milliseconds, double rmsToFull) {
  Point point;
  point.model = "vase.srf";
  point.setting = setting;
  point.command = "surflect chart " + method::textOf(setting);
  point.milliseconds = milliseconds;
  point.rmsToFull = rmsToFull;
  point.rest = {39, 38 - 20 * rmsToFull, 0.98, 0.02};
  return point;
}

// Full, three settings on the front and one behind it.
Chart chartOf() {
  Chart chart;
  chart.title = "vase.srf on examples/vase";
  chart.machine = "a machine";
  chart.command = "surflect chart";
  chart.restFrames = 1;
  chart.idleKnobs["vase.srf"] = {"environment_error", "patch"};
  chart.knobs = {{.name = "cameras", .sweep = {3, 2, 1}, .help = "cameras blended per surfel"},
                 {.name = "lights", .sweep = {4, 1}, .help = "lights blended"}};
  chart.points = {pointOf({}, 90, 0), pointOf({{"cameras", 1}}, 40, 0.02),
                  pointOf({{"cameras", 2}}, 60, 0.01), pointOf({{"cameras", 1}, {"lights", 1}}, 30, 0.05),
                  pointOf({{"lights", 1}}, 80, 0.04)};
  for (size_t i = 0; i < 4; ++i) chart.points[i].isOnFront = true;
  chart.points[0].isChosen = chart.points[3].isChosen = true;
  chart.points[3].name = "preview";
  for (Point& point : chart.points) point.stages = {{"splat", 10}, {"ulr", 20}};
  for (const size_t point : {size_t{0}, size_t{3}})
    chart.panels.push_back({point, "camera 1, light 2", "truth", "rendered", "error"});
  return chart;
}

size_t countOf(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// Whether each element behind the first line is closed where the elements in it are, attributes are quoted
// and texts have no bare & or <.
bool isWellFormed(const std::string& page) {
  std::vector<std::string> open;
  size_t at = page.find('\n');
  while (at < page.size()) {
    const size_t next = std::min(page.find('<', at), page.size());
    for (size_t k = page.find('&', at); k < next; k = page.find('&', k + 1)) {
      const size_t end = page.find(';', k);
      if (end == std::string::npos || end - k > 8) return false;
    }
    if (next == page.size()) break;
    const size_t end = page.find('>', next);
    if (end == std::string::npos) return false;
    const std::string tag = page.substr(next + 1, end - next - 1);
    if (countOf(tag, "\"") % 2 != 0 || tag.find('<') != std::string::npos) return false;
    const std::string name = tag.substr(0, tag.find_first_of(" /", 1));
    if (tag.starts_with('/')) {
      if (open.empty() || "/" + open.back() != tag) return false;
      open.pop_back();
    } else if (!tag.ends_with('/')) {
      open.push_back(name);
    }
    at = end + 1;
  }
  return open.empty();
}

TEST(Report, IsOneWellFormedFileThatNeedsNoOther) {
  const std::string page = htmlOf(chartOf());
  EXPECT_TRUE(isWellFormed(page));
  EXPECT_EQ(page.find("http:"), std::string::npos);
  EXPECT_EQ(page.find("https:"), std::string::npos);
  EXPECT_EQ(page.find("nan"), std::string::npos);
  for (const char* content : {"truth", "rendered", "error"})
    EXPECT_NE(page.find("data:image/png;base64," + base64(content)), std::string::npos);
  EXPECT_EQ(countOf(page, base64("truth")), 1u) << "one photograph for all settings";
}

TEST(Report, SaysWhatThePreviewBuys) {
  const std::string page = htmlOf(chartOf());
  EXPECT_NE(
      page.find("At <b>preview</b>, a frame takes 30.0 ms: 3.0 times faster than at full (90.0 ms). Its "
                "pictures differ from those at full by 5.0 % (relative RMS). Against held-out photographs it "
                "reaches 37.0 dB PSNR, 1.0 dB below full."),
      std::string::npos);
}

TEST(Report, EveryPointIsOnceInTheTableWithItsCommand) {
  const Chart chart = chartOf();
  const std::string page = htmlOf(chart), table = page.substr(page.find("<tbody>"));
  for (size_t i = 0; i < chart.points.size(); ++i) {
    EXPECT_EQ(countOf(table, "<tr id=\"p" + std::to_string(i) + "\""), 1u);
    EXPECT_EQ(countOf(table, "<code>" + chart.points[i].command + "</code>"), 1u);
  }
  EXPECT_EQ(countOf(table, "<tr "), chart.points.size());
}

// Places of the front's line behind a heading of the page.
std::vector<Place> frontBehind(const std::string& page, const std::string& heading) {
  const std::string rest = page.substr(page.find(heading));
  std::smatch found;
  if (!std::regex_search(rest, found, std::regex("polyline class=\"front s0\" points=\"([^\"]*)\"")))
    return {};
  std::istringstream words(found[1].str());
  std::vector<Place> places;
  for (std::string word; words >> word;)
    places.push_back({std::stod(word), std::stod(word.substr(word.find(',') + 1))});
  return places;
}

TEST(Report, FrontsAreJoinedInOrderOfTime) {
  Chart chart = chartOf();
  // A faster setting is closer to full, but none is closer to the photographs.
  chart.points.push_back(pointOf({{"cameras", 2}, {"lights", 1}}, 70, 0.015));
  chart.points.back().rest.psnrSrgbDb = 37.9;
  chart.points.back().isOnFront = true;
  const std::string page = htmlOf(chart);
  const std::vector<Place> error = frontBehind(page, "Time and error"),
                           agreement = frontBehind(page, "Time and agree");
  EXPECT_EQ(error.size(), 4u);
  EXPECT_TRUE(std::ranges::is_sorted(error, std::less_equal(), &Place::x));
  EXPECT_TRUE(std::ranges::is_sorted(error, std::less_equal(), &Place::y)) << "less error is lower";
  EXPECT_EQ(agreement.size(), 5u);
  EXPECT_TRUE(std::ranges::is_sorted(agreement, std::less_equal(), &Place::x));
  EXPECT_TRUE(std::ranges::is_sorted(agreement, std::greater_equal(), &Place::y))
      << "more decibels are higher";
}

TEST(Report, AKnobAloneIsShownWithAllOthersAtFull) {
  Chart chart = chartOf();
  chart.points[1].setting["lights"] = 4; // which is full
  const std::string page = htmlOf(chart), knobs = page.substr(page.find("Each knob alone"));
  EXPECT_NE(knobs.find("cameras blended per surfel"), std::string::npos);
  EXPECT_NE(knobs.find("Without effect on vase.srf: environment_error, patch."), std::string::npos);
  EXPECT_NE(knobs.find(">0.44</text>"), std::string::npos) << "40 of 90 ms";
  EXPECT_EQ(knobs.find(">0.33</text>"), std::string::npos) << "30 of 90 ms, with both knobs";
}

TEST(Report, TextsFromOutsideStayTexts) {
  const std::string hostile = "</script><img src=x onerror=\"a('b')\">&{}{0}";
  Chart chart = chartOf();
  chart.title = chart.machine = chart.command = chart.knobs[0].name = chart.knobs[0].help = hostile;
  for (Point& point : chart.points) {
    point.command = point.name = hostile;
    point.stages[hostile] = 1;
  }
  chart.points[0].setting = {{hostile, 1}};
  chart.points[1].model = hostile;
  chart.panels[0].frame = hostile;
  const std::string page = htmlOf(chart);
  EXPECT_TRUE(isWellFormed(page));
  EXPECT_EQ(page.find("<img src=x"), std::string::npos);
  EXPECT_EQ(page.find("onerror=\"a"), std::string::npos);
}

TEST(Report, APageNeedsNeitherPicturesNorManyPoints) {
  Chart chart = chartOf();
  chart.panels.clear();
  for (const size_t count : {5, 1, 0}) {
    chart.points.resize(count);
    EXPECT_TRUE(isWellFormed(htmlOf(chart))) << count;
  }
}

TEST(Report, FiguresThatAreNotFiniteAreInTheTableAlone) {
  Chart chart = chartOf();
  chart.points[0].rest.psnrSrgbDb = INFINITY;
  chart.points[1].milliseconds = 0;
  chart.points[2].rmsToFull = NAN;
  chart.points[4].bent = Agreement{NAN, NAN, NAN, NAN};
  const std::string page = htmlOf(chart);
  EXPECT_TRUE(isWellFormed(page));
  EXPECT_TRUE(std::regex_search(page, std::regex("<td data-key=\"[^\"]*\">∞</td>")));
  const std::string plots = page.substr(page.find("<svg"), page.rfind("</svg>") - page.find("<svg"));
  EXPECT_EQ(countOf(plots, "\"nan") + countOf(plots, "\"inf") + countOf(plots, ",nan") +
                countOf(plots, "\"-nan"),
            0u);
}

TEST(Report, ErrorsThatNobodySeesAreShort) {
  Chart chart = chartOf();
  chart.points[1].rmsToFull = chart.points[3].rmsToFull = chart.points[4].rmsToFull = 1e-12;
  const std::string page = htmlOf(chart);
  EXPECT_TRUE(isWellFormed(page));
  EXPECT_NE(page.find("class=\"value\""), std::string::npos);
  EXPECT_NE(page.find("differ from those at full by &lt; 0.001 %"), std::string::npos);
  EXPECT_EQ(page.find("0.0000"), std::string::npos);
}

TEST(Report, ModelsOfOneNameAreToldApart) {
  Chart chart = chartOf();
  chart.points[1].model = "other/vase.srf";
  const std::string page = htmlOf(chart);
  EXPECT_NE(page.find("data-key=\"other/vase.srf\""), std::string::npos);
  EXPECT_NE(page.find("5 of 2 models"), std::string::npos);
}

} // namespace
} // namespace surflect::chart
