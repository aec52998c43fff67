// The failure atlas: measures every entry, and exits with 1 if one of ours exceeds its bound.
//
//   stability              one line an entry
//   stability --markdown   the tables of docs/results/stability.md, which scripts/stability puts there
//   stability --pictures FOLDER
//                          NAME-naive.exr, NAME-ours.exr and NAME-truth.exr of entries that have pictures,
//                          and their names on stdout

#include "render/film/frame_file.h"
#include "tests/stability/entry.h"

#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string_view>

namespace surflect::stability {
namespace {

std::string numberText(double value) {
  if (std::isnan(value)) return "none";
  if (std::isinf(value)) return "infinite";
  if (value == 0) return "0";
  char text[32];
  if (std::abs(value) >= 100 && std::abs(value) < 1e5) {
    std::snprintf(text, sizeof text, "%.0f", value);
    return text;
  }
  std::snprintf(text, sizeof text, std::abs(value) >= 0.01 && std::abs(value) < 1e5 ? "%.3g" : "%.1e", value);
  return text;
}

std::vector<Group> groups() {
  return {lookUpGroup(), ulrGroup(),         krigingGroup(),    lightGroup(),         codecGroup(),
          splatGroup(),  environmentGroup(), lightFieldGroup(), extrapolationGroup(), sharedGroup()};
}

void draw(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const Group& group : groups())
    for (const auto& [name, draw] : group.illustrations) {
      const Pictures pictures = draw();
      for (const auto& [form, picture] :
           {std::pair("naive", &pictures.naive), {"ours", &pictures.ours}, {"truth", &pictures.truth}})
        film::writeFrame(folder / (name + "-" + form + ".exr"), {*picture, {}}, {});
      std::printf("%s\n", name.c_str());
    }
}

int run(bool isMarkdown) {
  int failed = 0, entries = 0;
  for (const Group& group : groups()) {
    if (isMarkdown)
      std::printf("## %s\n\nNaive: %s.\n\n| input | expected | measured | naive | ours | bound "
                  "|\n|---|---|---|---|---|---|\n",
                  group.name.c_str(), group.naive.c_str());
    for (const Entry& entry : group.entries) {
      ++entries;
      Measured measured{kNoAnswer, kNoAnswer};
      std::string thrown;
      try {
        measured = entry.measure();
      } catch (const std::exception& error) {
        thrown = error.what();
      }
      const bool isKept = thrown.empty() && measured.ours <= entry.bound;
      failed += !isKept;
      const std::string naive =
          numberText(measured.naive) + (entry.naive.empty() ? "" : " (" + entry.naive + ")");
      if (isMarkdown)
        std::printf("| %s | %s | %s | %s | %s | %s |\n", entry.input.c_str(), entry.expected.c_str(),
                    entry.figure.c_str(), naive.c_str(), numberText(measured.ours).c_str(),
                    numberText(entry.bound).c_str());
      else
        std::printf("%s %s: %s: %s: naive %s, ours %s, bound %s%s%s\n", isKept ? "kept  " : "BROKEN",
                    group.name.c_str(), entry.input.c_str(), entry.figure.c_str(), naive.c_str(),
                    numberText(measured.ours).c_str(), numberText(entry.bound).c_str(),
                    thrown.empty() ? "" : ": ", thrown.c_str());
    }
    if (isMarkdown) std::printf("\n");
  }
  std::fprintf(stderr, "%d entries, %d broken\n", entries, failed);
  return failed > 0;
}

} // namespace
} // namespace surflect::stability

int main(int argc, char** argv) {
  if (argc == 3 && std::string_view(argv[1]) == "--pictures") {
    surflect::stability::draw(argv[2]);
    return 0;
  }
  return surflect::stability::run(argc > 1 && std::string_view(argv[1]) == "--markdown");
}
