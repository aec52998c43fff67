#include "apps/command.h"
#include "apps/fixed_light.h"
#include "apps/method_options.h"
#include "apps/pack_report.h"
#include "apps/terminal.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/surfels/surfel_method.h"
#include "srf/model/manifest.h"
#include "srf/model/pack.h"
#include "surfel/base/error.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <memory>
#include <optional>
#include <string>
#include <sys/file.h>
#include <unistd.h>

namespace surflect {

namespace {

constexpr const char* kSurfels = "surfels";

struct PackArguments {
  CaptureArgument capture; // or a stage file
  std::string output, mesh, stageScale;
  std::optional<std::string> method; // default: surfels, or that of a finished light field
  FixedLight light;
  MethodOptions options;
  bool force = false;

  bool isStage() const { return std::filesystem::path(capture.path).extension() == ".toml"; }
};

// The method of a finished light field in the capture's place, which may be compressed; null for a capture.
const method::Method* methodOfLightField(const std::string& path) {
  const auto made = std::ranges::find_if(method::methods(), [&](const method::Method& candidate) {
    return candidate.build && lightfield::isFinished(path, candidate.format);
  });
  return made == method::methods().end() ? nullptr : &*made;
}

// Throws UsageError unless a finished light field, `made`, is compressed by its method and nothing else.
void requireCompressible(const PackArguments& arguments, const method::Method& made) {
  if (made.compressOptions.empty())
    throw UsageError(Error(fmt::format("is a finished {}, which cannot be compressed", made.tag))
                         .in(arguments.capture.path));
  if (arguments.method && *arguments.method != made.tag)
    throw UsageError(
        Error::mismatch(fmt::format("{}, as {} is", made.tag, arguments.capture.path), *arguments.method)
            .at("--method"));
  for (const method::Option& option : made.buildOptions)
    if (arguments.options.isGiven(option.name) &&
        std::ranges::find(made.compressOptions, option.name) == made.compressOptions.end())
      throw UsageError(
          Error("is for photographs; finished maps can only be compressed").at(method::flagOf(option.name)));
}

// Throws UsageError for arguments that do not go together.
void requireMatching(const PackArguments& arguments, const method::Method& method,
                     const method::Setting& setting, bool isLightField) {
  const bool isStage = arguments.isStage();
  if (isStage && method.tag != "spherical")
    throw UsageError(Error("is a stage file, of which only --method spherical is made; `surflect capture` "
                           "photographs it")
                         .in(arguments.capture.path));
  const bool hasPhotographs = !isStage && !isLightField;
  if (!hasPhotographs &&
      (!arguments.mesh.empty() || setting.contains("nearest") || arguments.light.isGiven()))
    throw UsageError(Error("--mesh, --nearest, --lights and --environment are for photographs")
                         .in(arguments.capture.path));
  if (!isStage && !arguments.stageScale.empty())
    throw UsageError(Error("is for a stage file, FILE.toml").at("--scale"));
  if (arguments.light.incomplete != lightfield::Incomplete::refused && !arguments.light.isGiven())
    throw UsageError(Error("--skip-incomplete and --common-lights are for --lights and --environment"));
  if (arguments.force && !hasPhotographs)
    throw UsageError(Error("is for photographs, which are checked").at("--force"));
}

// A capture whose checks may stop `pack` before anything is written.
class CheckedSource : public model::CaptureSource {
public:
  CheckedSource(capture::Capture capture, BuildFindings& findings)
      : CaptureSource(std::move(capture)), findings_(findings) {}

  proxy::Impostor impostor(const proxy::ImpostorOptions& options, const Progress& progress) const override {
    const auto take = [&](auto found) { findings_.take(found); };
    validation::checkBeforeGeometry(training(), validation::kQuickChecks, take, progress);
    proxy::Impostor impostor = model::CaptureSource::impostor(options, progress);
    for (const std::string& note : impostor.notes) say(note); // before the findings, which they may explain
    validation::checkGeometry(training(), impostor, validation::kQuickChecks, take, progress);
    return impostor;
  }

private:
  BuildFindings& findings_;
};

Json packSurfels(const PackArguments& arguments, const method::Setting& setting, BuildFindings& findings,
                 const Progress& progress) {
  if (arguments.light.isGiven())
    throw UsageError(Error("surfels keep their light free: --lights and --environment are for methods with "
                           "fixed light"));
  model::PackOptions options = surfels::packOptions(setting);
  options.impostor.mesh = arguments.mesh;
  if (!arguments.mesh.empty() && (options.impostor.hull || options.impostor.relief))
    throw UsageError(Error("excludes --hull and --relief").at("--mesh"));
  CheckedSource source(arguments.capture.read(), findings);
  const model::PackReport report = model::pack(source, arguments.output, options, progress, announceEstimate);
  announce(report, arguments.output);
  return jsonOf(report);
}

// The source of a method with fixed light: the capture itself, or its views under the given light, which are
// kept in the model's folder.
std::filesystem::path viewsOf(const PackArguments& arguments, const method::Method& method, Json& json,
                              const Progress& progress) {
  const capture::Capture capture = capture::readCapture(arguments.capture.path, arguments.capture.outside);
  if (!arguments.light.isGiven()) {
    if (capture.lights.size() > 1)
      throw UsageError(Error(fmt::format("has {} lights, and the light of {} is fixed: give --lights FILE or "
                                         "--environment MAP",
                                         capture.lights.size(), method.tag))
                           .in(capture.file));
    return arguments.capture.path;
  }
  const std::filesystem::path views = std::filesystem::path(arguments.output) / method::kViewsFolder;
  json["views"] = relitViews(capture, arguments.light, views, progress,
                             [&] { lightfield::beginLightFieldFolder(arguments.output); });
  return views;
}

// The folder of a model while it is made: no other process may write there.
class OutputFolder {
public:
  // Makes the folder if it is not there. Throws Error if another process holds it, or it cannot be made.
  explicit OutputFolder(std::filesystem::path path) : path_(std::move(path)) {
    requireCreatable(path_);
    std::error_code unknown; // reported when creating
    isNew_ = !std::filesystem::exists(path_, unknown);
    createFolder(path_);
    descriptor_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor_ < 0) throw Error(std::string("cannot open (") + std::strerror(errno) + ")").in(path_);
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)
      return; // some systems have no locks
    ::close(descriptor_);
    throw Error("another process writes there").in(path_);
  }
  // Removes a folder that it has made, if it is still empty.
  ~OutputFolder() {
    if (isNew_) ::rmdir(path_.c_str());
    ::close(descriptor_);
  }
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

private:
  std::filesystem::path path_;
  bool isNew_ = false;
  int descriptor_ = -1;
};

// Throws Error if a finished model of another method would be lost.
void requireSameMethod(const std::filesystem::path& output, const method::Method& method) {
  std::error_code unknown; // reported when writing
  if (!std::filesystem::exists(output / model::kManifestFile, unknown)) return;
  if (const method::Method& found = method::methodOfModel(output); found.format != method.format)
    throw Error(fmt::format("is a finished model of method {}: remove it, or give another -o", found.tag))
        .in(output);
}

Json runPack(const PackArguments& arguments, const Progress& progress) {
  const method::Method* const made = methodOfLightField(arguments.capture.path);
  if (made) requireCompressible(arguments, *made);
  const method::Method& method = made ? *made : method::methodOf(arguments.method.value_or(kSurfels));
  method::Setting setting = arguments.options.settingFor(method);
  requireMatching(arguments, method, setting, made != nullptr);
  if (made)
    std::erase_if(setting, [&](const auto& entry) { // those of a preset
      return std::ranges::find(made->compressOptions, entry.first) == made->compressOptions.end();
    });
  Json json = {{"method", method.tag}, {"options", jsonOf(setting)}};
  const std::string checked = arguments.light.isGiven()
                                  ? (std::filesystem::path(arguments.output) / method::kViewsFolder).string()
                                  : arguments.capture.path;
  BuildFindings findings(checked, checked + (arguments.mesh.empty() ? "" : " --mesh " + arguments.mesh),
                         arguments.force);
  if (method.build) requireSameMethod(arguments.output, method);
  const OutputFolder output(arguments.output);
  if (!method.build) {
    json.update(packSurfels(arguments, setting, findings, progress));
    json["findings"] = findings.json();
    return json;
  }
  const bool isCapture = !arguments.isStage() && !made;
  method::BuildInput input{.source = isCapture ? viewsOf(arguments, method, json, progress)
                                               : std::filesystem::path(arguments.capture.path),
                           .mesh = arguments.mesh,
                           .paths = arguments.capture.outside,
                           .stageScale = arguments.stageScale,
                           .output = arguments.output,
                           .say = say,
                           .take = [&](auto found) { findings.take(found); }};
  const method::BuildReport report = [&] {
    try {
      return method.build(input, setting, progress);
    } catch (const Cancelled&) {
      throw Interrupted("interrupted; the same command again builds from the start");
    }
  }();
  json.update(countsJson(report.counts));
  for (const auto& [name, values] : report.lists) json[name] = values;
  if (isCapture) json["findings"] = findings.json();
  json["seconds"] = report.seconds;
  json["memory_peak_bytes"] = memoryUse().peakBytes;
  return json;
}

} // namespace

void addPackCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<PackArguments>();
  CLI::App* command =
      app.add_subcommand("pack", "make a model of any method from a capture; run again to resume");
  command->footer(
      "Example: surflect pack examples/vase -o vase.srf --tolerance 0.05\n"
      "         surflect pack examples/vase --method lfm --environment examples/environments/studio.exr "
      "--up 0 0 1 \\\n           --common-lights -o vase.lfm --terms 3 --vq 8 --s3tc");
  command
      ->add_option(
          "capture", arguments->capture.path,
          "capture folder or JSON file; a stage file for spherical; or a finished lfm or olfm to compress")
      ->required();
  addAllowOutside(*command, arguments->capture.outside);
  command->add_option("-o,--output", arguments->output, "the model's folder")->required()->check(notEmpty());
  std::vector<std::string> tags;
  for (const method::Method& method : method::methods()) tags.push_back(method.tag);
  command
      ->add_option("--method", arguments->method,
                   fmt::format("representation of the object: {}; default: surfels", fmt::join(tags, ", ")))
      ->option_text("METHOD")
      ->check([](const std::string& tag) -> std::string {
        try {
          method::methodOf(tag);
          return "";
        } catch (const Error& error) {
          return error.what();
        }
      });
  command->add_option("--mesh", arguments->mesh, "geometry (PLY or OBJ) instead of the capture's")
      ->check(notEmpty());
  command->add_option("--scale", arguments->stageScale, "a [scale.NAME] of a stage file, such as tiny");
  command->add_flag("--force", arguments->force,
                    "pack in spite of errors that the checks of the capture find");
  addFixedLight(*command, arguments->light, false);
  arguments->options.add(*command, MethodOptions::Kind::build,
                         [arguments] { return &method::methodOf(arguments->method.value_or(kSurfels)); });
  setWork(*command, work, "the same command again keeps the views that were finished",
          [arguments](const Progress& progress) { return runPack(*arguments, progress); });
}

} // namespace surflect
