#include "apps/command.h"
#include "apps/terminal.h"
#include "apps/web/annotations.h"
#include "apps/web/relit_page.h"
#include "srf/import/output_folder.h"
#include "srf/planes/stack.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

namespace surflect {

namespace {

struct WebArguments {
  CaptureArgument capture;
  std::string output, title, annotations;
  web::PageOptions page;
};

// Annotations of the page: those given, else those of the page that is there already.
std::string annotationsOf(const WebArguments& arguments) {
  std::filesystem::path file = arguments.annotations;
  if (file.empty()) {
    const std::filesystem::path there = std::filesystem::path(arguments.output) / web::kAnnotationsFile;
    std::error_code unknown; // reported when it is read
    if (!std::filesystem::exists(there, unknown)) return web::noAnnotations();
    file = there;
  }
  std::string text = readFile(file, kLargestText);
  web::checkAnnotations(text, file);
  return text;
}

Json runWeb(const WebArguments& arguments, const Progress& progress) {
  web::PageOptions options = arguments.page;
  options.annotations = annotationsOf(arguments);
  options.title = arguments.title.empty() ? folderName(arguments.capture.path) : arguments.title;
  const planes::Stack stack = planes::stackOf(arguments.capture.read());
  for (const std::string& note : stack.notes) say(note);
  importers::OutputFolder folder(arguments.output, web::kMarkFile);
  const web::PageReport report = web::writeRelitPage(stack, folder.temporaryPath(), options, progress);
  folder.commit();

  const planes::Errors leftOut = planes::meanOf(report.leftOut);
  say(fmt::format(
      "{}: {} x {} pixels, {} photographs as {} planes, {:.1f} MB; photographs are shown to {:.1f} dB "
      "(sRGB), those of a light that was left out to {:.1f} dB",
      (std::filesystem::path(arguments.output) / "index.html").string(), stack.width(), stack.height(),
      stack.size(), report.planes, static_cast<double>(report.bytes) / 1e6, report.captured.srgbDb(),
      leftOut.srgbDb()));
  if (!report.hasNormals) say("the lights lie in a plane with the object: the page has no normals");
  Json lights = Json::array();
  for (const planes::LeftOutLight& light : report.leftOut)
    lights.push_back({{"light", stack.lights[light.photograph]},
                      {"psnr_linear_db", light.errors.linearDb()},
                      {"psnr_srgb_db", light.errors.srgbDb()}});
  return {{"page", (std::filesystem::path(arguments.output) / "index.html").string()},
          {"width", stack.width()},
          {"height", stack.height()},
          {"photographs", stack.size()},
          {"planes", report.planes},
          {"normals", report.hasNormals},
          {"levels", report.levels},
          {"tiles", report.tiles},
          {"bytes", report.bytes},
          {"white", report.white},
          {"captured",
           {{"psnr_linear_db", report.captured.linearDb()}, {"psnr_srgb_db", report.captured.srgbDb()}}},
          {"left_out",
           {{"psnr_linear_db", leftOut.linearDb()}, {"psnr_srgb_db", leftOut.srgbDb()}, {"lights", lights}}}};
}

} // namespace

void addWebCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<WebArguments>();
  CLI::App* command = app.add_subcommand(
      "web", "a page that any browser opens from its folder: one view under a lamp to drag");
  command->footer("Example: surflect web cat -o page/");
  addCaptureArgument(*command, arguments->capture);
  command->add_option("-o,--output", arguments->output, "folder of the page; one that is there is replaced")
      ->required();
  command->add_option("--title", arguments->title, "title of the page; default: the capture's name");
  command
      ->add_option("--planes", arguments->page.planes,
                   "pictures that stand for the photographs: more are closer")
      ->capture_default_str()
      ->check(CLI::Range(1, web::kMostPlanes));
  command->add_option("--quality", arguments->page.quality, "of their JPEG")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  command
      ->add_option_function<double>(
          "--pixels-per-mm", [arguments](double scale) { arguments->page.pixelsPerMm = scale; },
          "scale of the picture, for the scale bar and lengths")
      ->check(CLI::Range(1e-6, 1e6));
  command->add_flag("--ptm", arguments->page.ptm, "write object.ptm too, for other RTI viewers");
  command->add_option("--annotations", arguments->annotations,
                      "JSON file with the page's annotations; default: those of the folder");
  setWork(*command, work, "the folder is as it was",
          [arguments](const Progress& progress) { return runWeb(*arguments, progress); });
}

} // namespace surflect
