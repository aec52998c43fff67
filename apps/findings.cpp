#include "apps/findings.h"

#include "apps/terminal.h"

#include <fmt/format.h>

#include <algorithm>

namespace surflect {

namespace {

const char* nameOf(Finding::Severity severity) {
  return severity == Finding::Severity::error ? "error" : "warning";
}

} // namespace

void announce(std::span<const Finding> findings) {
  for (const Finding& finding : findings) say(fmt::format("{}: {}", nameOf(finding.severity), finding.text));
}

Json jsonOf(std::span<const Finding> findings) {
  Json list = Json::array();
  for (const Finding& finding : findings)
    list.push_back({{"severity", nameOf(finding.severity)}, {"text", finding.text}});
  return list;
}

size_t countErrors(std::span<const Finding> findings) {
  return static_cast<size_t>(std::ranges::count(findings, Finding::Severity::error, &Finding::severity));
}

} // namespace surflect
