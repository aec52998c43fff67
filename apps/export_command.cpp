#include "apps/command.h"
#include "apps/frame_range.h"
#include "apps/method_options.h"
#include "apps/open_shot.h"
#include "apps/terminal.h"
#include "render/film/shot_renderer.h"
#include "render/gaussians/gaussian_ply.h"
#include "render/gaussians/particle_field.h"
#include "render/methods.h"
#include "render/scene/scene.h"
#include "render/scene/turntable.h"
#include "render/surfels/surfel_method.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/memory.h"
#include "surfel/base/text.h"
#include "surfel/base/version.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <variant>
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

OpenShot opened(const ExportArguments& arguments, const ExportName& name, const Progress& progress) {
  OpenShot shot;
  const bool isTurntable = std::filesystem::is_directory(arguments.script);
  const auto check = [&](const scene::ScriptHead& head, const scene::Script&) {
    if (!head.objects.empty())
      throw Error("shows a scene of light field maps, which have no surfels: export takes surfels")
          .at("object")
          .in(arguments.script);
    shot.frames = framesOf(arguments, name, head.frames, isTurntable);
  };
  const auto open = [&](const scene::ScriptHead& head) -> const method::Description& {
    requireSurfels(head.model);
    shot.setting = arguments.options.settingFor(surfels::surfelMethod());
    shot.model = std::make_shared<const model::Model>(model::openModel(head.model, progress));
    if (shot.model->grid)
      say(fmt::format(
          "one view: Gaussians stand at its surfels, {0} pixels apart; `pack --surfels N` makes more",
          shot.model->grid->step));
    shot.renderer = std::make_unique<surfels::SurfelRenderer>(shot.model, shot.setting);
    return shot.renderer->describe();
  };
  shot.script = openShot({arguments.script, arguments.model}, check, open);
  scene::requireShot(shot.script);
  return shot;
}

// Keys of a script that shape pictures and that Gaussians cannot show; empty if there are none.
std::vector<std::string> lostOf(const scene::Script& script, const std::vector<int>& frames) {
  std::vector<std::string> lost;
  if (script.ground) lost.emplace_back("[ground]");
  bool moves = false, defocuses = false;
  for (const int frame : frames) {
    const scene::ShotBlur blur = scene::blurAt(script, scene::shotTime(script, frame));
    moves = moves || blur.shutter > 0;
    defocuses = defocuses || blur.aperture > 0;
  }
  if (moves) lost.emplace_back("shutter_deg");
  if (defocuses) lost.emplace_back("aperture");
  if (script.output->finish.tone != scene::Tone::none) lost.emplace_back("tone");
  if (!std::holds_alternative<std::monostate>(script.output->finish.background))
    lost.emplace_back("background");
  return lost;
}

// Line of text for files of others: nothing in it ends a line or a string.
std::string plainText(std::string text) {
  for (char& c : text)
    if (const auto byte = static_cast<unsigned char>(c); byte < 0x20 || byte == 0x7f || c == '"' || c == '\\')
      c = '_';
  return text;
}

std::string megabytes(uint64_t bytes) {
  const double count = static_cast<double>(bytes);
  return count < 1e9 ? fmt::format("{:.1f} MB", 1e-6 * count) : fmt::format("{:.1f} GB", 1e-9 * count);
}

// Throws Error where files of about this size cannot be: one is too large, or the disk too full. A file that
// is there is replaced when its successor is complete.
void requireSpace(const ExportName& name, const std::vector<int>& frames, uint64_t perFile, size_t files) {
  const std::string_view smaller = "; --surfels N, --sh N, --frames A-B and --every N make it smaller";
  if (perFile > kLargestFile)
    throw Error(fmt::format("would have about {}, more than {}{}", megabytes(perFile),
                            megabytes(kLargestFile), smaller))
        .in(name.file(frames.front()));
  std::optional<uint64_t> space = freeBytes(name.folder);
  for (size_t k = 0; space && k + 1 < files; ++k) {
    std::error_code missing;
    const uintmax_t replaced = std::filesystem::file_size(name.file(frames[k]), missing);
    if (!missing) *space += replaced;
  }
  if (space && perFile * files > *space)
    throw Error(fmt::format("needs about {}, and {} has {} left{}", megabytes(perFile * files),
                            name.folder.string(), megabytes(*space), smaller))
        .in(name.file(frames.front()));
}

// Surfels of one frame, as Gaussians.
struct PosedFrame {
  // `exposure`: factor of the frame.
  PosedFrame(const OpenShot& shot, const film::ShotRenderer& renderer, const surfels::DrawnSurfels& drawn,
             const surfels::FrameOptions& options, surfels::FrameWorkspace& workspace, int frame,
             double exposure, const Progress& progress)
      : time(scene::shotTime(shot.script, frame)), warp(scene::warpAt(shot.script, time)),
        radiance(*shot.model, drawn, {*warp, {}, scene::lightsAt(shot.script, time, renderer.environments())},
                 options, workspace, progress),
        gaussians(radiance, exposure) {}

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
  const OpenShot shot = opened(arguments, name, progress);
  if (name.isSequence)
    for (const int frame : shot.frames) requireReplaceable(name.file(frame));
  if (const std::vector<std::string> lost = lostOf(shot.script, shot.frames); !lost.empty())
    say(fmt::format("{}: {} {} for pictures, and not in the export", arguments.script, fmt::join(lost, ", "),
                    lost.size() == 1 ? "is" : "are"));

  const surfels::FrameOptions options = surfels::frameOptions(shot.setting);
  const size_t most = arguments.surfels ? static_cast<size_t>(*arguments.surfels) : shot.model->cloud.size();
  const surfels::DrawnSurfels drawn = surfels::drawnSurfels(*shot.model, most, progress);
  const std::string comment =
      fmt::format("surflect {}, {}", kVersion, plainText(folderName(arguments.script)));
  const gaussians::ParticleFieldFrames field{shot.frames, shot.script.frames->fps, drawn.cloud.size(),
                                             isZUp(shot.model->rig), comment};
  const bool isPly = name.format == ExportFormat::ply;
  const size_t files = isPly ? shot.frames.size() : 1;
  const uint64_t perFile = isPly ? gaussians::plyBytes(drawn.cloud.size(), arguments.degree, comment)
                                 : gaussians::particleFieldBytes(field, arguments.degree);
  requireSpace(name, shot.frames, perFile, files);
  say(fmt::format("{} of {} with {} of degree {}: {}about {}", counted(files, "file"),
                  counted(shot.frames.size(), "frame"), counted(drawn.cloud.size(), "Gaussian"),
                  arguments.degree, files > 1 ? "each " : "", megabytes(perFile)));

  film::ShotRenderer renderer(shot.script, *shot.renderer, progress);
  const auto exposureOf = [&](int frame) {
    const auto stops = scene::exposureAt(shot.script, scene::shotTime(shot.script, frame));
    return renderer.previewExposure() * std::exp2(stops.value_or(0));
  };
  std::vector<double> exposures;
  for (const int frame : shot.frames) exposures.push_back(exposureOf(frame));
  createFolder(name.folder);
  removeAbandoned(name.folder, [&](const std::string& target) {
    return std::ranges::any_of(shot.frames,
                               [&](int frame) { return name.file(frame).filename().string() == target; });
  });
  constexpr size_t kCacheBytes = size_t{1} << 30;
  surfels::FrameWorkspace workspace(*shot.model, kCacheBytes);
  const auto posed = [&](int frame) {
    return std::make_shared<const PosedFrame>(shot, renderer, drawn, options, workspace, frame,
                                              exposureOf(frame), progress);
  };

  Json report = {{"model", shot.model->folder.string()},
                 {"surfels", drawn.cloud.size()},
                 {"degree", arguments.degree},
                 {"frames", shot.frames},
                 {"exposure", exposures},
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
      writeGaussianPly(name.file(frame), pose->gaussians, arguments.degree, comment,
                       stepOf(progress, gaussians::kStage, k, shot.frames.size()));
      add(name.file(frame), {{"frame", frame}, {"gaussians", pose->gaussians.size()}});
    }
  } else {
    const gaussians::GaussiansAt at = [&](size_t k) {
      const auto pose = posed(shot.frames[k]);
      return std::shared_ptr<const gaussians::Gaussians>(pose, &pose->gaussians);
    };
    writeParticleField(name.file(0), field, at, arguments.degree, progress);
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
