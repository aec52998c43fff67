// Reports shared by `pack` and `capture --pack`.
#pragma once

#include "apps/command.h"
#include "srf/model/pack.h"
#include "srf/validation/validation.h"

#include <span>
#include <string>
#include <vector>

namespace surflect {

// Findings of a capture's checks, as printed lines and as JSON.

// Prints each finding on a line.
void announce(std::span<const validation::Finding> findings);
Json jsonOf(std::span<const validation::Finding> findings);

// Findings of a build: printed as they come. Errors stop it, unless it is forced.
class BuildFindings {
public:
  // `inspectArguments` are those with which surflect inspect shows what was found.
  BuildFindings(std::string source, std::string inspectArguments, bool force);

  // Throws Error for an error among the findings.
  void take(std::span<const validation::Finding> found);
  Json json() const { return jsonOf(all_); }

private:
  std::string source_, inspectArguments_;
  bool force_;
  std::vector<validation::Finding> all_;
};

// Warning that surfels so many pixels apart blur details, with the number that would not; empty if they do
// not.
std::string sparseSurfels(size_t surfels, double pixelsBetween);
void announceEstimate(const model::PackEstimate& estimate);
void announce(const model::PackReport& report, const std::string& output);
Json jsonOf(const model::PackReport& report);

} // namespace surflect
