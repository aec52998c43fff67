#include "render/method/renderer.h"

#include "surfel/base/error.h"

namespace surflect::method {

void Renderer::set(const Setting& setting) {
  requireSetting(optionsOf(*this), setting);
  for (const Option& row : options())
    if (const auto found = setting.find(row.name); row.atOpening && found != setting.end())
      throw Error("can be given only when a model is opened").at(flagOf(row.name));
  configure(setting);
}

} // namespace surflect::method
