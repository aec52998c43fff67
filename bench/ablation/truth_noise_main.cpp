// Two captures of one stage that differ in their seeds, compared; a JSON report on stdout.
//
//   truth_noise CAPTURE AGAIN

#include "bench/ablation/truth_noise.h"

#include <nlohmann/json.hpp>

#include <cstdio>

using namespace surflect;

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: truth_noise CAPTURE AGAIN\n");
    return 2;
  }
  try {
    const evaluation::Difference both =
        differenceOf(capture::readCapture(argv[1]), capture::readCapture(argv[2]), {});
    const nlohmann::ordered_json report = {
        {"psnr_linear_db", both.psnrLinear()}, {"psnr_srgb_db", both.psnrSrgb()}, {"ssim_srgb", both.ssim()}};
    std::printf("%s\n", report.dump(2).c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "truth_noise: %s\n", error.what());
    return 1;
  }
}
