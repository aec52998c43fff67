#include "apps/command.h"
#include "apps/terminal.h"
#include "render/film/video.h"
#include "render/scene/script_edit.h"
#include "srf/model/manifest.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <memory>
#include <system_error>

namespace surflect {

namespace {

constexpr const char *kModel = "doll.srf", *kFilm = "film.mp4";

struct DemoArguments {
  std::string output = "demo";
  bool quick = false;
};

// The examples beside the program, where it is installed or was built.
std::filesystem::path examplesFolder() {
  std::error_code unreadable;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unreadable).parent_path();
  for (const char* const place : {"../share/surflect/examples", "../../../examples"}) {
    const std::filesystem::path folder = (program / place).lexically_normal();
    if (std::filesystem::exists(folder / "doll" / "transforms.json", unreadable)) return folder;
  }
  throw Error("the examples are not beside the program: share/surflect/examples is missing").in(program);
}

// Runs another command by its words, as the command line would.
Json run(void (*add)(CLI::App&, CommandWork&), std::vector<std::string> words, const Progress& progress) {
  CLI::App app;
  CommandWork work;
  add(app, work);
  std::ranges::reverse(words); // as CLI11 takes them
  app.parse(words);
  return work(progress);
}

// A text of a table; empty if there is none.
std::string textAt(const Json& table, const char* key) {
  const auto found = table.find(key);
  return found != table.end() && found->is_string() ? found->get<std::string>() : "";
}

Json runDemo(const DemoArguments& arguments, const Progress& progress) {
  const std::filesystem::path examples = examplesFolder(), folder = arguments.output;
  const std::filesystem::path model = folder / kModel, script = folder / "film.toml";
  createFolder(folder);
  if (std::filesystem::exists(model / model::kManifestFile))
    say(fmt::format("{} is there already", model.string()));
  else
    run(addPackCommand, // fewer leave gaps between skirt and base
        {"pack", (examples / "doll").string(), "-o", model.string(), "--surfels", "400000", "--tables",
         "off"},
        progress);
  Json values;
  if (std::filesystem::exists(script)) {
    values = Json::parse(scene::scriptValues(readFile(script), script));
    const std::string model = textAt(values, "model");
    if (model != kModel) throw Error::mismatch(std::string(kModel), model).at("model").in(script);
  } else {
    const std::string text = readFile(examples / "doll.toml");
    values = Json::parse(scene::scriptValues(text, script));
    values["model"] = kModel;
    values["output"]["background"] = {0.1, 0.1, 0.11};
    values["output"]["video"] = kFilm;
    writeFileAtomically(script, std::string_view(scene::withValues(text, script, values.dump())));
  }
  const std::filesystem::path frames = folder / (arguments.quick ? "quick" : "frames");
  std::vector<std::string> words = {"render", script.string(), "-o", frames.string(), "--resume"};
  const std::string video = arguments.quick ? "" : textAt(values.value("output", Json::object()), "video");
  const bool hasEncoder = film::canEncodeVideo();
  if (arguments.quick) words.insert(words.end(), {"--every", "8", "--scale", "0.5", "--no-video"});
  if (!video.empty() && !hasEncoder) words.push_back("--no-video");
  const Json rendered = run(addRenderCommand, words, progress);
  Json report = {{"model", model.string()}, {"script", script.string()}, {"frames", frames.string()}};
  if (rendered.contains("video")) report["film"] = rendered["video"];
  if (!video.empty() && !hasEncoder)
    say(fmt::format(
        "no {}: ffmpeg is not installed (apt install ffmpeg); the same command again then makes it",
        (frames / video).string()));
  if (!arguments.quick && video.empty())
    say(fmt::format(
        "no film, frames alone: {} has no video; [output] video = \"{}\" and the same command make it",
        script.string(), kFilm));
  say(fmt::format("{}: frames; EXR beside each PNG holds linear light, alpha, depth, normals, and what was "
                  "blended and stretched",
                  (frames / "").string()));
  say(fmt::format("next: surflect view {0} moves its lamps and bends it by hand; {0} is the film's script",
                  script.string()));
  return report;
}

} // namespace

void addDemoCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<DemoArguments>();
  CLI::App* command =
      app.add_subcommand("demo", "pack an example, a doll, and render a film of it, bent and relit");
  command->footer("Example: surflect demo -o demo/");
  command->add_option("-o,--output", arguments->output, "folder for model, script and frames")
      ->capture_default_str();
  command->add_flag("--quick", arguments->quick, "every eighth frame, at half the size");
  setWork(*command, work, "the same command goes on from here",
          [arguments](const Progress& progress) { return runDemo(*arguments, progress); });
}

} // namespace surflect
