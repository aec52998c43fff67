// What bench_doll has measured as one JSON object, of which doll_text.cpp makes tables.
#pragma once

#include "bench/doll_report/doll_report.h"

#include <nlohmann/json_fwd.hpp>

namespace surflect::bench {

nlohmann::ordered_json jsonOf(const DollMeasurements& measured);

} // namespace surflect::bench
