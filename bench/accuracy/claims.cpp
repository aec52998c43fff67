#include "bench/accuracy/claims.h"

#include "surfel/base/error.h"

int main(int argc, char** argv) {
  using namespace surflect;
  using namespace surflect::bench;
  return runProgram(argc, argv, "claims FOLDER", {1}, [](const Words& words) -> Json {
    if (!std::filesystem::create_directory(words[0])) throw Error("expected a new folder").in(words[0]);
    return {{"impostor_limit", impostorLimit()},
            {"texture_parallax", textureParallax(words[0])},
            {"fibre_azimuth", fibreAzimuth(words[0])},
            {"fibre_error", fibreError()}};
  });
}
