#include "apps/command.h"
#include "apps/frame_range.h"
#include "apps/method_options.h"
#include "apps/terminal.h"
#include "render/film/shot_renderer.h"
#include "render/gaussians/gaussian_ply.h"
#include "render/gaussians/particle_field.h"
#include "render/methods.h"
#include "render/scene/turntable.h"
#include "render/surfels/surfel_method.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory.h"
#include "surfel/base/text.h"
#include "surfel/base/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

namespace surflect {

namespace {

struct ExportArguments {
  std::string script, model, output, frames; // script: or a model
  MethodOptions options;
  int every = 1, degree = gaussians::kHighestDegree;
  std::optional<int64_t> surfels;
};

enum class ExportFormat { ply, usda };

// Format and pattern of the output's name. Throws UsageError.
struct ExportName {
  explicit ExportName(const std::filesystem::path& output)
      : folder(output.parent_path().empty() ? "." : output.parent_path()) {
    const std::string name = output.filename().string(), ending = lowerCase(output.extension().string());
    const auto complain = [&](std::string_view expected) {
      return UsageError(Error::mismatch(expected, "'" + name + "'").at("--output"));
    };
    if (ending != ".ply" && ending != ".usda")
      throw complain("a name that ends in .ply (3D Gaussian splatting) or .usda (OpenUSD)");
    format = ending == ".ply" ? ExportFormat::ply : ExportFormat::usda;
    pattern.path = name;
    const size_t hashes = std::ranges::count(name, '#');
    isSequence = hashes > 0;
    if (isSequence && format == ExportFormat::usda)
      throw complain("a name without #: one .usda file holds all frames");
    if (hashes > 16 || name.find(std::string(hashes, '#')) == std::string::npos)
      throw complain("one run of at most 16 # for the frame's number");
  }

  std::filesystem::path file(int frame) const {
    return (isSequence ? scene::framePath(pattern, folder, frame) : folder / pattern.path).lexically_normal();
  }

  ExportFormat format = ExportFormat::ply;
  std::filesystem::path folder;
  scene::Output pattern; // its path alone
  bool isSequence = false;
};

// The frames that are written, ascending. Throws UsageError if one file cannot hold them.
std::vector<int> framesOf(const ExportArguments& arguments, const ExportName& name,
                          const scene::Frames& frames, bool isTurntable) {
  const bool holdsOne = name.format == ExportFormat::ply && !name.isSequence;
  if (arguments.frames.empty() && (holdsOne || isTurntable)) return {frames.first}; // a camera alone moves
  const FrameRange range = parseRange(arguments.frames, frames);
  std::vector<int> chosen;
  for (int frame = range.first; frame <= range.last; frame += arguments.every) chosen.push_back(frame);
  if (holdsOne && chosen.size() > 1)
    throw UsageError(
        Error::mismatch("one frame, or a name such as doll.####.ply for a file a frame", arguments.frames)
            .at("--frames"));
  return chosen;
}

// Throws Error unless the model is one of surfels.
void requireSurfels(const std::filesystem::path& model) {
  const method::Method& method = method::methodOfModel(model);
  if (method.tag == surfels::surfelMethod().tag) return;
  throw Error(
      fmt::format("is a model of the method {}, which has no surfels: export takes surfels", method.tag))
      .in(model);
}

// A shot whose model is open.
struct OpenShot {
  std::shared_ptr<const model::Model> model;
  std::unique_ptr<surfels::SurfelRenderer> renderer;
  scene::Script script;
  std::vector<int> frames;
  method::Setting setting;
};

OpenShot openShot(const ExportArguments& arguments, const ExportName& name, const Progress& progress) {
  OpenShot shot;
  const auto open = [&](const std::filesystem::path& model) {
    requireSurfels(model);
    shot.setting = arguments.options.settingFor(surfels::surfelMethod());
    shot.model = std::make_shared<const model::Model>(model::openModel(model, progress));
    shot.renderer = std::make_unique<surfels::SurfelRenderer>(shot.model, shot.setting);
  };
  if (std::filesystem::is_directory(arguments.script)) {
    if (!arguments.model.empty()) throw UsageError(Error("is for a script").at("--model"));
    open(arguments.script);
    const method::Description& described = shot.renderer->describe();
    shot.script =
        scene::parseScript(scene::turntableScript({std::filesystem::absolute(arguments.script).string(),
                                                   described.rig, described.points, described.isBaked}),
                           std::filesystem::path(arguments.script) / "turntable.toml");
    shot.frames = framesOf(arguments, name, *shot.script.frames, true);
    return shot;
  }
  const scene::ScriptHead head = scene::readScriptHead(arguments.script, arguments.model);
  if (!head.objects.empty())
    throw Error("shows a scene of light field maps, which have no surfels: export takes surfels")
        .at("object")
        .in(arguments.script);
  shot.frames = framesOf(arguments, name, head.frames, false);
  open(head.model);
  shot.script = scene::readScript(arguments.script, shot.model->rig.origin);
  shot.script.model = head.model;
  scene::requireShot(shot.script);
  return shot;
}

std::string megabytes(uint64_t bytes) { return fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes)); }

// Throws Error where files of this size cannot be: a file is too large, or the disk too full.
void requireSpace(const ExportName& name, uint64_t perFile, size_t files) {
  const std::string_view smaller = "; --surfels N, --sh N, --frames A-B and --every N make it smaller";
  if (perFile > kLargestFile)
    throw Error(fmt::format("would have about {}, more than {}{}", megabytes(perFile),
                            megabytes(kLargestFile), smaller))
        .in(name.file(0));
  std::filesystem::path folder = std::filesystem::absolute(name.folder);
  std::error_code unknown;
  while (!std::filesystem::exists(folder, unknown) && folder.has_relative_path())
    folder = folder.parent_path();
  const std::filesystem::space_info space = std::filesystem::space(folder, unknown);
  if (!unknown && perFile * files > space.available)
    throw Error(fmt::format("needs about {}, and {} has {} left{}", megabytes(perFile * files),
                            folder.string(), megabytes(space.available), smaller))
        .in(name.file(0));
}

// Surfels of one frame, as Gaussians.
struct PosedFrame {
  PosedFrame(const OpenShot& shot, const film::ShotRenderer& renderer, const surfels::DrawnSurfels& drawn,
             const surfels::FrameOptions& options, surfels::FrameWorkspace& workspace, int frame,
             const Progress& progress)
      : time(scene::shotTime(shot.script, frame)), warp(scene::warpAt(shot.script, time)),
        radiance(*shot.model, drawn, {*warp, {}, scene::lightsAt(shot.script, time, renderer.environments())},
                 options, workspace, progress),
        gaussians(radiance) {}

  warp::ShotTime time;
  warp::WarpPointer warp;
  surfels::OutgoingRadiance radiance;
  gaussians::Gaussians gaussians;
};

// Whether z is up, rather than y, by the cameras of the rig.
bool isZUp(const capture::Capture& rig) {
  const Vec3<double> up = scene::upOf(rig);
  return std::abs(up[2]) > std::abs(up[1]);
}

// Throws UsageError for options of pictures, which Gaussians cannot have.
void requireNoPictureOptions(const MethodOptions& options) {
  for (const char* name : {"low_pass", "layer_search", "surfel_size", "patch"})
    if (options.isGiven(name))
      throw UsageError(Error("is for pictures, not for export").at(method::flagOf(name)));
}

Json runExport(const ExportArguments& arguments, const Progress& progress) {
  requireNoPictureOptions(arguments.options);
  const ExportName name(arguments.output);
  requireCreatable(name.folder);
  if (!name.isSequence) requireReplaceable(name.file(0));
  const OpenShot shot = openShot(arguments, name, progress);
  if (name.isSequence)
    for (const int frame : shot.frames) requireReplaceable(name.file(frame));

  const surfels::FrameOptions options = surfels::frameOptions(shot.setting);
  const size_t most = arguments.surfels ? static_cast<size_t>(*arguments.surfels) : shot.model->cloud.size();
  const surfels::DrawnSurfels drawn = surfels::drawnSurfels(*shot.model, most, progress);
  const std::string comment =
      fmt::format("surflect {}, {}", kVersion, std::filesystem::path(arguments.script).filename().string());
  const gaussians::ParticleFieldFrames field{shot.frames, shot.script.frames->fps, drawn.cloud.size(),
                                             isZUp(shot.model->rig), comment};
  const bool isPly = name.format == ExportFormat::ply;
  const size_t files = isPly ? shot.frames.size() : 1;
  const uint64_t perFile = isPly ? gaussians::plyBytes(drawn.cloud.size(), arguments.degree, comment)
                                 : gaussians::particleFieldBytes(field, arguments.degree);
  requireSpace(name, perFile, files);
  say(fmt::format("{} of {} with {} of degree {}: {}about {}", counted(files, "file"),
                  counted(shot.frames.size(), "frame"), counted(drawn.cloud.size(), "Gaussian"),
                  arguments.degree, files > 1 ? "each " : "", megabytes(perFile)));

  film::ShotRenderer renderer(shot.script, *shot.renderer, progress);
  const gaussians::LookOptions look{arguments.degree, renderer.previewExposure()};
  createFolder(name.folder);
  removeAbandoned(name.folder, [&](const std::string& target) {
    return std::ranges::any_of(shot.frames,
                               [&](int frame) { return name.file(frame).filename().string() == target; });
  });
  constexpr size_t kCacheBytes = size_t{1} << 30;
  surfels::FrameWorkspace workspace(*shot.model, kCacheBytes);
  const auto posed = [&](int frame) {
    return std::make_shared<const PosedFrame>(shot, renderer, drawn, options, workspace, frame, progress);
  };

  Json report = {{"model", shot.model->folder.string()},
                 {"surfels", drawn.cloud.size()},
                 {"degree", arguments.degree},
                 {"exposure", look.exposure},
                 {"files", Json::array()}};
  const Stopwatch watch;
  uint64_t bytes = 0;
  const auto add = [&](const std::filesystem::path& file, Json entry) {
    entry["file"] = file.string();
    entry["bytes"] = std::filesystem::file_size(file);
    bytes += std::filesystem::file_size(file);
    event("file", entry);
    report["files"].push_back(std::move(entry));
  };
  if (isPly) {
    for (size_t k = 0; k < shot.frames.size(); ++k) {
      const int frame = shot.frames[k];
      const auto pose = posed(frame);
      if (pose->gaussians.size() == 0)
        throw Error(fmt::format("frame {}: no surfel has a place and an area once warped", frame))
            .in(arguments.script);
      writeGaussianPly(name.file(frame), pose->gaussians, look, comment,
                       stepOf(progress, gaussians::kStage, k, shot.frames.size()));
      add(name.file(frame), {{"frame", frame}, {"gaussians", pose->gaussians.size()}});
    }
  } else {
    const gaussians::GaussiansAt at = [&](size_t k) {
      const auto pose = posed(shot.frames[k]);
      return std::shared_ptr<const gaussians::Gaussians>(pose, &pose->gaussians);
    };
    writeParticleField(name.file(0), field, at, look, progress);
    add(name.file(0), {{"frames", shot.frames}, {"gaussians", drawn.cloud.size()}});
  }
  report["bytes"] = bytes;
  report["seconds"] = watch.seconds();
  progress(gaussians::kStage, 1);
  say(fmt::format("exported {} to {}: {}", counted(shot.frames.size(), "frame"), arguments.output,
                  megabytes(bytes)));
  return report;
}

} // namespace

void addExportCommand(CLI::App& app, CommandWork& work) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand(
      "export", "write surfels as Gaussians that other programs draw: PLY for splatting, or OpenUSD");
  command->footer(
      "Example: surflect export vase.srf -o vase.ply\n"
      "         surflect export examples/vase.toml -o splats/vase.####.ply --frames 1-12\n"
      "         surflect export examples/vase.toml -o vase.usda --every 4 --surfels 20000 --sh 1");
  command
      ->add_option("script", arguments->script,
                   "TOML: model, lights and warps over time; or a model, at rest under a turn-table's lamps")
      ->required();
  command
      ->add_option("-o,--output", arguments->output,
                   "NAME.ply for one frame, NAME.####.ply for a file a frame, or NAME.usda for all frames")
      ->required()
      ->check(notEmpty());
  command->add_option("--model", arguments->model, "another model than the script's")->check(notEmpty());
  command->add_option("--frames", arguments->frames,
                      "a frame A, or frames A-B; default: all, or the first where a file holds one");
  command->add_option("--every", arguments->every, "every N-th of these frames")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  command->add_option("--sh", arguments->degree, "degree of the colours' spherical harmonics, 0..3")
      ->capture_default_str()
      ->check(CLI::Range(0, gaussians::kHighestDegree));
  command
      ->add_option("--surfels", arguments->surfels,
                   "at most N: the finest level of detail that has no more; default: all")
      ->check(wholeIn(1, std::numeric_limits<int64_t>::max()));
  addSimd(*command);
  arguments->options.add(*command, MethodOptions::Kind::render, [] { return &surfels::surfelMethod(); });
  setWork(*command, work, "the files that are there are whole",
          [arguments](const Progress& progress) { return runExport(*arguments, progress); });
}

} // namespace surflect
