#include "apps/command.h"
#include "apps/terminal.h"
#include "apps/web/annotations.h"
#include "apps/web/object_page.h"
#include "apps/web/page_folder.h"
#include "apps/web/relit_page.h"
#include "render/lightfield/lfm/lfm_method.h"
#include "render/methods.h"
#include "srf/capture/file_names.h"
#include "srf/import/output_folder.h"
#include "srf/model/manifest.h"
#include "srf/planes/stack.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace surflect {

namespace {

struct WebArguments {
  CaptureArgument source;
  std::string output, annotations, title, credit;
  std::optional<double> pixelsPerMm, mmPerUnit;
  web::PageOptions relit;
  web::ObjectPageOptions object;
  std::vector<const CLI::Option*> ofCaptures, ofModels; // options of one kind of page alone
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

std::string indexOf(const WebArguments& arguments) {
  return (std::filesystem::path(arguments.output) / "index.html").string();
}

// Refuses options of the other kind of page.
void refuse(const std::vector<const CLI::Option*>& options, std::string_view isFor) {
  for (const CLI::Option* option : options)
    if (option->count() > 0) throw UsageError(Error(fmt::format("is for {}", isFor)).at(option->get_name()));
}

void sayKept(const std::string& annotations) {
  if (!annotations.empty()) say(fmt::format("annotations of the earlier page: kept as {}", annotations));
}

// Hash of the captured cameras, which stay when a model is packed again.
std::string objectOf(const lightfield::LightFieldFolder& model) {
  return hex(contentHash(readFile(model.path() / "transforms.json", kLargestText)));
}

planes::Stack stackOf(const capture::Capture& capture) {
  try {
    return planes::stackOf(capture);
  } catch (const Error&) {
    if (capture.views.size() > 1)
      say("web shows several views as a model, which `surflect pack CAPTURE --method lfm -o MODEL.lfm` "
          "makes");
    throw;
  }
}

Json runCapture(const WebArguments& arguments, const Progress& progress) {
  refuse(arguments.ofModels, "models, not for captures of one view");
  annotationsOf(arguments); // mistakes are told before the work
  const web::PageMark earlier = web::earlierMark(arguments.output);
  const auto complete = [&](const std::string& object) {
    return web::markOf({object, arguments.title, arguments.credit, arguments.pixelsPerMm}, earlier,
                       folderName(arguments.source.path));
  };
  const planes::Stack stack = stackOf(arguments.source.read());
  for (const std::string& note : stack.notes) say(note);
  importers::OutputFolder folder(arguments.output, {web::kMarkFile, web::isOfPage});
  const std::filesystem::path& page = folder.temporaryPath();
  const web::PageReport report = web::writeRelitPage(stack, page, arguments.relit, complete, progress);
  const std::string annotations = annotationsOf(arguments); // those of now: the work may have taken minutes
  web::writeAnnotations(annotations, page);
  const std::string kept = web::keepEarlierAnnotations(arguments.output, page, annotations);
  const uint64_t bytes = bytesIn(page);
  folder.commit();
  sayKept(kept);

  const planes::Errors leftOut = planes::meanOf(report.leftOut);
  say(fmt::format(
      "{}: {} x {} pixels, {} photographs as {} planes, {:.1f} MB; photographs are shown to {:.1f} dB "
      "(sRGB), those of a light that was left out to {:.1f} dB",
      indexOf(arguments), stack.width(), stack.height(), stack.size(), report.planes,
      static_cast<double>(bytes) / 1e6, report.captured.srgbDb(), leftOut.srgbDb()));
  if (!report.hasNormals) say("the lights lie in a plane with the object: the page has no normals");
  Json lights = Json::array();
  for (const planes::LeftOutLight& light : report.leftOut)
    lights.push_back({{"light", stack.lights[light.photograph]},
                      {"psnr_linear_db", light.errors.linearDb()},
                      {"psnr_srgb_db", light.errors.srgbDb()}});
  return {{"page", indexOf(arguments)},
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

Json runModel(const WebArguments& arguments, const Progress& progress) {
  const std::filesystem::path path = arguments.source.path;
  const method::Method& method = method::methodOfModel(path);
  if (method.tag != lfm::lfmMethod().tag)
    throw Error(fmt::format("is a model of the method {}: web draws light field maps, which "
                            "`surflect pack CAPTURE --method lfm -o MODEL.lfm` makes",
                            method.tag))
        .in(path);
  refuse(arguments.ofCaptures, "captures of one view, not for models");
  const lfm::OpenedMaps model = lfm::openMaps(path, progress);
  inFile(path, [&] { web::requireHeldByPage(model.maps); });
  const web::PageMark mark = web::markOf(
      {objectOf(model.folder), arguments.title, arguments.credit, arguments.mmPerUnit},
      web::earlierMark(arguments.output), std::filesystem::path(folderName(path)).stem().string());
  importers::OutputFolder folder(arguments.output, {web::kMarkFile, web::isOfPage});
  const web::ObjectPageReport report =
      web::writeObjectPage(model, folder.temporaryPath(), arguments.object, mark, progress);
  const std::string kept =
      web::keepEarlierAnnotations(arguments.output, folder.temporaryPath(), web::noAnnotations());
  const uint64_t bytes = bytesIn(folder.temporaryPath());
  folder.commit();
  sayKept(kept);
  const Vec3<double> size = boundsOf(model.maps.mesh.positions).sizes();
  say(fmt::format(
      "{}: {} of {}, {:.1f} MB; {:.4g} x {:.4g} x {:.4g} units along x, y, z; exposed by {:+.3f} stops",
      indexOf(arguments), counted(report.triangles, "triangle"), counted(report.terms, "term"),
      static_cast<double>(bytes) / 1e6, size.x(), size.y(), size.z(), report.stops));
  return {{"page", indexOf(arguments)},
          {"triangles", report.triangles},
          {"vertices", report.vertices},
          {"terms", report.terms},
          {"exposure_stops", report.stops},
          {"bytes", bytes},
          {"size", {size.x(), size.y(), size.z()}}};
}

Json runWeb(const WebArguments& arguments, const Progress& progress) {
  for (const auto& [option, text] : {std::pair("--title", &arguments.title), {"--credit", &arguments.credit}})
    if (!capture::isUtf8(*text)) throw Error::mismatch("UTF-8", "other bytes").at(option);
  std::error_code unknown; // reported when it is read
  const bool isModel =
      std::filesystem::exists(std::filesystem::path(arguments.source.path) / model::kManifestFile, unknown);
  return isModel ? runModel(arguments, progress) : runCapture(arguments, progress);
}

} // namespace

void addWebCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<WebArguments>();
  CLI::App* command = app.add_subcommand(
      "web",
      "a page that any browser opens from its folder: one view under a lamp to drag, or an object to turn");
  command->footer("Example: surflect web cat -o page/\n"
                  "         surflect web vase.lfm -o page/");
  command
      ->add_option(
          "source", arguments->source.path,
          "capture of one view: folder with transforms.json, or a JSON file; or a model of light field "
          "maps (pack --method lfm)")
      ->required();
  addAllowOutside(*command, arguments->source.outside);
  arguments->ofCaptures.push_back(command->get_option("--allow-outside"));
  command->add_option("-o,--output", arguments->output, "folder of the page; one that is there is replaced")
      ->required();
  command->add_option("--title", arguments->title,
                      "title of the page; default: that of the object's page there, else the source's name");
  command->add_option(
      "--credit", arguments->credit,
      "line beside the title, such as who has rights; default: that of the object's page there");
  const auto captures = [&](CLI::Option* option) { arguments->ofCaptures.push_back(option); };
  const auto models = [&](CLI::Option* option) { arguments->ofModels.push_back(option); };
  captures(command
               ->add_option("--planes", arguments->relit.planes,
                            "pictures that stand for the photographs: more are closer")
               ->capture_default_str()
               ->check(CLI::Range(1, web::kMostPlanes)));
  captures(command->add_option("--quality", arguments->relit.quality, "quality of the JPEG of these pictures")
               ->capture_default_str()
               ->check(CLI::Range(1, 98))); // finer ones leave no steps to share
  captures(
      command
          ->add_option_function<double>(
              "--pixels-per-mm", [arguments](double scale) { arguments->pixelsPerMm = scale; },
              "scale of the picture, for the scale bar and lengths; default: that of the object's page there")
          ->check(CLI::Range(web::kLeastScale, web::kGreatestScale)));
  captures(command->add_flag("--ptm", arguments->relit.ptm, "write object.ptm too, for other RTI viewers"));
  captures(command->add_option("--annotations", arguments->annotations,
                               "JSON file with the page's annotations; default: those of the folder"));
  captures(command->add_flag("--read-only", arguments->relit.readOnly, "visitors write no annotations"));
  models(command
             ->add_option_function<double>(
                 "--mm-per-unit", [arguments](double scale) { arguments->mmPerUnit = scale; },
                 "millimetres of a unit of the model, for the scale bar; default: those of the object's page "
                 "there")
             ->check(CLI::Range(web::kLeastScale, web::kGreatestScale)));
  models(command
             ->add_option_function<double>(
                 "--exposure", [arguments](double stops) { arguments->object.stops = stops; },
                 "exposure in stops, as [camera] exposure; default: the brightest part of a turn is white")
             ->check(CLI::Range(-web::kMostStops, web::kMostStops)));
  setWork(*command, work, "the folder is as it was",
          [arguments](const Progress& progress) { return runWeb(*arguments, progress); });
}

} // namespace surflect
