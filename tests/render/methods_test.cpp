#include "render/methods.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace surflect::method {
namespace {

// All rows, with their method and what they are for.
struct NamedRow {
  std::string name;
  const Option& row;
};

std::vector<NamedRow> allRows() {
  std::vector<NamedRow> rows;
  for (const Method& method : methods()) {
    for (const Option& row : method.buildOptions) rows.push_back({method.tag + " pack " + row.name, row});
    for (const Option& row : method.renderOptions) rows.push_back({method.tag + " render " + row.name, row});
  }
  return rows;
}

void expectInDomain(const NamedRow& named, const Value& value) {
  EXPECT_NO_THROW(EXPECT_EQ(parseValue(named.row, value.text()), value)) << named.name << " " << value.text();
}

TEST(Methods, TagsAndTitlesAreUnique) {
  std::set<std::string> tags, titles;
  for (const Method& method : methods()) {
    EXPECT_TRUE(tags.insert(method.tag).second) << method.tag;
    EXPECT_TRUE(titles.insert(method.title).second) << method.title;
    EXPECT_EQ(&methodOf(method.tag), &method);
  }
  EXPECT_EQ(methods().front().tag, "surfels");
}

TEST(Methods, EveryMethodHasAPaperAFormatAndFunctions) {
  for (const Method& method : methods()) {
    EXPECT_FALSE(method.paper.empty()) << method.tag;
    EXPECT_FALSE(method.format.empty()) << method.tag;
    EXPECT_FALSE(method.renderOptions.empty()) << method.tag;
    EXPECT_TRUE(method.open) << method.tag;
    EXPECT_EQ(static_cast<bool>(method.build), method.isBaked) << method.tag;
  }
}

TEST(Methods, FlagsOfAMethodAreUnique) {
  for (const Method& method : methods())
    for (const auto* rows : {&method.buildOptions, &method.renderOptions}) {
      std::set<std::string> flags;
      for (const Option& row : *rows)
        EXPECT_TRUE(flags.insert(flagOf(row.name)).second) << method.tag << " " << row.name;
    }
}

TEST(Methods, EveryOptionHasAHelpOfOneLine) {
  for (const NamedRow& named : allRows()) {
    EXPECT_FALSE(named.row.help.empty()) << named.name;
    EXPECT_EQ(named.row.help.find('\n'), std::string::npos) << named.name;
    EXPECT_FALSE(named.row.help.ends_with('.')) << named.name;
  }
}

TEST(Methods, DefaultsPresetsAndSweepsAreInTheirDomains) {
  for (const NamedRow& named : allRows()) {
    for (const auto& value : {named.row.standard, named.row.paper, named.row.preview})
      if (value) expectInDomain(named, *value);
    for (const Value& value : named.row.sweep) expectInDomain(named, value);
  }
}

TEST(Methods, SweepsBeginWithTheDefaultAndRepeatNothing) {
  for (const NamedRow& named : allRows()) {
    const std::vector<Value>& sweep = named.row.sweep;
    if (sweep.empty()) continue;
    if (named.row.standard) {
      EXPECT_EQ(sweep.front().text(), named.row.standard->text()) << named.name;
    }
    std::set<std::string> texts;
    for (const Value& value : sweep) EXPECT_TRUE(texts.insert(value.text()).second) << named.name;
  }
}

TEST(Methods, PresetsDifferFromTheDefault) {
  for (const NamedRow& named : allRows())
    for (const auto& value : {named.row.paper, named.row.preview})
      if (value && named.row.standard) {
        EXPECT_NE(value->text(), named.row.standard->text()) << named.name;
      }
}

TEST(Methods, PresetsAreSettings) {
  for (const Method& method : methods())
    for (const Preset preset : {Preset::full, Preset::preview, Preset::paper}) {
      EXPECT_NO_THROW(
          requireSetting({method.tag, method.renderOptions}, settingOf(preset, method.renderOptions)))
          << method.tag << " " << kPresets[static_cast<size_t>(preset)];
      EXPECT_NO_THROW(
          requireSetting({method.tag, method.buildOptions}, settingOf(preset, method.buildOptions)))
          << method.tag << " " << kPresets[static_cast<size_t>(preset)];
    }
}

TEST(Methods, WhatAnOptionNeedsIsAnOptionWithThoseValues) {
  for (const Method& method : methods())
    for (const auto* rows : {&method.buildOptions, &method.renderOptions})
      for (const Option& row : *rows) {
        if (!row.needs) continue;
        const Option& needed = rowOf({method.tag, *rows}, row.needs->first);
        for (const Value& value : row.needs->second) expectInDomain({row.name, needed}, value);
      }
}

TEST(Methods, AnUnknownTagIsToldWithTheNearest) {
  EXPECT_EQ(image::errorOf([] { methodOf("surfel"); }),
            "found 'surfel', expected surfels, slf, lumigraph, lfm, vdtm, ulr, olfm, spherical; did you mean "
            "surfels?");
}

TEST(OpenScene, OnlyLightFieldMapsStandInOneScene) {
  const image::TemporaryFolder folder;
  image::writeBytes(folder / "manifest.json", R"({"format": "surflect lumigraph"})");
  scene::PlacedModel placed;
  placed.model = folder.path();
  EXPECT_EQ(image::errorOf([&] {
              openScene({&placed, 1});
            }),
            (folder.path()).string() +
                ": method: found lumigraph, expected a model of method lfm, as objects of one scene are");
}

} // namespace
} // namespace surflect::method
