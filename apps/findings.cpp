#include "apps/findings.h"

#include "apps/terminal.h"

#include <fmt/format.h>

#include <algorithm>

namespace surflect {

namespace {

const char* nameOf(validation::Finding::Severity severity) {
  return severity == validation::Finding::Severity::error ? "error" : "warning";
}

} // namespace

void announce(std::span<const validation::Finding> findings) {
  for (const validation::Finding& finding : findings)
    say(fmt::format("{}: {}", nameOf(finding.severity), finding.text));
}

Json jsonOf(std::span<const validation::Finding> findings) {
  Json list = Json::array();
  for (const validation::Finding& finding : findings)
    list.push_back({{"severity", nameOf(finding.severity)}, {"text", finding.text}});
  return list;
}

size_t countErrors(std::span<const validation::Finding> findings) {
  return static_cast<size_t>(
      std::ranges::count(findings, validation::Finding::Severity::error, &validation::Finding::severity));
}

} // namespace surflect
