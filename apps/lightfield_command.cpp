#include "apps/lightfield_command.h"

namespace surflect {

void addLightFieldCommand(CLI::App& app, CommandWork& work) {
  CLI::App* command =
      app.add_subcommand("lightfield", "light fields of an object under fixed light: build them, put several "
                                       "into a scene, compare, time and fly around them");
  command->footer("Example: surflect lightfield build slf views/ -o vase.slf\n"
                  "         surflect lightfield compare vase.slf vase.lum --views views/");
  command->require_subcommand(1);
  command->fallthrough(); // --json may stand after the whole command; subcommands inherit this
  addLightFieldBuild(*command, work);
  addLightFieldScene(*command, work);
  addLightFieldCompare(*command, work);
  addLightFieldBenchmark(*command, work);
  addLightFieldFly(*command, work);
}

} // namespace surflect
