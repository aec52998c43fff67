#include "apps/command.h"
#include "apps/terminal.h"
#include "apps/web/annotations.h"
#include "apps/web/relit_page.h"
#include "srf/capture/file_names.h"
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
  std::string output, annotations;
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
  if (!capture::isUtf8(arguments.page.title)) throw Error::mismatch("UTF-8", "other bytes").at("--title");
  annotationsOf(arguments); // mistakes are told before the work
  web::PageOptions options = arguments.page;
  options.name = folderName(arguments.capture.path);
  options.earlier = web::earlierPage(arguments.output);
  const planes::Stack stack = planes::stackOf(arguments.capture.read());
  for (const std::string& note : stack.notes) say(note);
  importers::OutputFolder folder(arguments.output, {web::kMarkFile, web::isOfRelitPage});
  const std::filesystem::path& page = folder.temporaryPath();
  const web::PageReport report = web::writeRelitPage(stack, page, options, progress);
  const std::string annotations = annotationsOf(arguments); // those of now: the work may have taken minutes
  web::writeAnnotations(annotations, page);
  const std::string kept = web::keepEarlierAnnotations(arguments.output, page, annotations);
  const uint64_t bytes = bytesIn(page);
  folder.commit();
  if (!kept.empty()) say(fmt::format("annotations of the earlier page: kept as {}", kept));

  const planes::Errors leftOut = planes::meanOf(report.leftOut);
  say(fmt::format(
      "{}: {} x {} pixels, {} photographs as {} planes, {:.1f} MB; photographs are shown to {:.1f} dB "
      "(sRGB), those of a light that was left out to {:.1f} dB",
      (std::filesystem::path(arguments.output) / "index.html").string(), stack.width(), stack.height(),
      stack.size(), report.planes, static_cast<double>(bytes) / 1e6, report.captured.srgbDb(),
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
          {"bytes", bytes},
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
  command->add_option("--title", arguments->page.title,
                      "title of the page; default: that of the object's page there, else the capture's name");
  command
      ->add_option("--planes", arguments->page.planes,
                   "pictures that stand for the photographs: more are closer")
      ->capture_default_str()
      ->check(CLI::Range(1, web::kMostPlanes));
  command->add_option("--quality", arguments->page.quality, "quality of the JPEG of these pictures")
      ->capture_default_str()
      ->check(CLI::Range(1, 98)); // finer ones leave no steps to share
  command
      ->add_option_function<double>(
          "--pixels-per-mm", [arguments](double scale) { arguments->page.pixelsPerMm = scale; },
          "scale of the picture, for the scale bar and lengths; default: that of the object's page there")
      ->check(CLI::Range(web::kLeastScale, web::kGreatestScale));
  command->add_flag("--ptm", arguments->page.ptm, "write object.ptm too, for other RTI viewers");
  command->add_option("--annotations", arguments->annotations,
                      "JSON file with the page's annotations; default: those of the folder");
  setWork(*command, work, "the folder is as it was",
          [arguments](const Progress& progress) { return runWeb(*arguments, progress); });
}

} // namespace surflect
