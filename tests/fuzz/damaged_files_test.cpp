// Every reader keeps its contract on seeds and on damaged copies of them. The short form of scripts/fuzz,
// with a fixed seed, no sanitizer unless the build has one, and no search for new code.
#include "surfel/base/file.h"
#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <sys/resource.h>
#include <vector>

namespace surflect {
namespace {

namespace fs = std::filesystem;

constexpr size_t kInputs = 2500;      // of each target
constexpr long kMostMemory = 2 << 20; // kB, as in scripts/fuzz

struct Named {
  const char* name;
  FuzzTarget* target;
};
void PrintTo(const Named& target, std::ostream* stream) { *stream << target.name; }

#define SURFLECT_NAME_FUZZ_TARGET(NAME) Named{#NAME, fuzz_##NAME},
const Named kTargets[] = {SURFLECT_FUZZ_TARGETS(SURFLECT_NAME_FUZZ_TARGET)};
#undef SURFLECT_NAME_FUZZ_TARGET

// Contents of the target's seeds, those of the repository and those that write_seeds has made.
std::vector<std::string> seedsOf(const std::string& target) {
  std::vector<fs::path> paths;
  for (const fs::path folder : {SURFLECT_FUZZ_SEEDS, SURFLECT_MADE_FUZZ_SEEDS})
    if (fs::exists(folder / target))
      for (const auto& entry : fs::directory_iterator(folder / target)) paths.push_back(entry.path());
  std::ranges::sort(paths);
  std::vector<std::string> seeds;
  for (const fs::path& path : paths) seeds.push_back(readFile(path));
  return seeds;
}

// Changes one to eight bytes, or removes, repeats or replaces a run of bytes by one of another seed.
class Damage {
public:
  explicit Damage(std::span<const std::string> seeds) : seeds_(seeds) {}

  std::string operator()(std::string file) {
    const size_t begin = below(file.size() + 1),
                 length = below(std::min<size_t>(file.size() - begin, 64) + 1);
    switch (below(6)) {
    case 0:
      return file.erase(begin, length);
    case 1:
      return file.insert(begin, file.substr(begin, length));
    case 2: {
      const std::string& other = seeds_[below(seeds_.size())];
      return file.replace(begin, length, other.substr(below(other.size() + 1), length));
    }
    default:
      for (size_t bytes = 1 + below(8); bytes > 0 && !file.empty(); --bytes)
        changeByte(file[below(file.size())]);
      return file;
    }
  }

private:
  size_t below(size_t end) { return bits_() % end; }

  // Extreme values are as likely as a flipped bit and as any other value.
  void changeByte(char& byte) {
    constexpr std::string_view kExtreme("\0\x7f\x80\xff-09.\"", 9);
    switch (below(3)) {
    case 0:
      byte = kExtreme[below(kExtreme.size())];
      break;
    case 1:
      byte = static_cast<char>(byte ^ (1 << below(8)));
      break;
    default:
      byte = static_cast<char>(below(256));
    }
  }

  std::span<const std::string> seeds_;
  std::mt19937 bits_{1};
};

class Reader : public testing::TestWithParam<Named> {
protected:
  void SetUp() override { ASSERT_FALSE(seeds.empty()) << "write_seeds has not run"; }

  // False after a failure.
  bool keepsItsContractOn(const std::string& input) {
    try {
      requireContract(*GetParam().target, input);
      return true;
    } catch (const std::exception& error) {
      const fs::path kept = fs::path(SURFLECT_MADE_FUZZ_SEEDS) / (std::string(GetParam().name) + ".failed");
      writeFileAtomically(kept, input);
      ADD_FAILURE() << error.what() << "; the input is kept in " << kept;
      return false;
    }
  }

  const std::vector<std::string> seeds = seedsOf(GetParam().name);
};

TEST_P(Reader, KeepsItsContractOnSeedsAndTheirTruncations) {
  const size_t lengths = kInputs / 3 / seeds.size();
  for (const std::string& seed : seeds) {
    if (!keepsItsContractOn(seed)) return;
    for (size_t k = 0; k < std::min(lengths, seed.size()); ++k)
      if (!keepsItsContractOn(seed.substr(0, seed.size() <= lengths ? k : k * seed.size() / lengths))) return;
  }
}

TEST_P(Reader, KeepsItsContractOnDamagedFilesInModestMemory) {
  Damage damage(seeds);
  for (size_t k = 0; k < kInputs; ++k)
    if (!keepsItsContractOn(damage(seeds.at(k % seeds.size())))) return;
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  EXPECT_LT(used.ru_maxrss, kMostMemory);
}

INSTANTIATE_TEST_SUITE_P(Every, Reader, testing::ValuesIn(kTargets),
                         [](const auto& test) { return std::string(test.param.name); });

} // namespace
} // namespace surflect
