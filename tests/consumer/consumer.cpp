// Renders a model by its first captured camera under a light beside that camera; prints the size of the
// picture and the pixel in its middle: R G B A.
#include <render/methods.h>

#include <cstdio>

int main(int, char** argv) {
  using namespace surflect;
  const auto renderer = method::openRenderer(argv[1]);
  const auto still = warp::chainWarp({});
  const auto camera = scene::inObjectSpace(renderer->describe().rig.views[0].camera);
  const scene::ShotPointLight light{camera.center(), {10, 10, 10}};
  const image::Image color = renderer->render({*still, camera, {light}}).color;
  const auto pixel = color.at(color.width / 2, color.height / 2);
  std::printf("%d %d %g %g %g %g\n", color.width, color.height, pixel[0], pixel[1], pixel[2], pixel[3]);
}
