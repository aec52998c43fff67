#include "render/lightfield/lumigraph/lumigraph_method.h"

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/common/light_field_renderer.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/lumigraph/build.h"
#include "render/lightfield/lumigraph/lumigraph_file.h"
#include "render/lightfield/lumigraph/lumigraph_frame.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <utility>

namespace surflect::lumigraph {

namespace {

using method::row, method::wholeRange, method::Setting;

struct BuildChoice {
  BuildOptions options = {};
  std::optional<size_t> triangles;
};

const method::Rows<BuildChoice>& buildRows() {
  static const method::Rows<BuildChoice> kRows{
      row<BuildChoice>(
          "st", [](auto& o) -> auto& { return o.options.slabs.nodes; },
          {.domain = wholeRange(2, kMostNodes), .help = "pictures of a slab along each side of its st grid"}),
      row<BuildChoice>(
          "texels", [](auto& o) -> auto& { return o.options.slabs.texels; },
          {.domain = wholeRange(1, 8589934592),
           .help =
               "texels of all slabs together, at most; the `texels` of a surface light field give both the "
               "same size"}),
      row<BuildChoice>(
          "triangles", [](auto& o) -> auto& { return o.triangles; },
          {.domain = wholeRange(4, 2147483648),
           .help = "simplify the geometry that corrects depth to so many; default: the whole mesh"}),
      row<BuildChoice>("nearest", [](auto& o) -> auto& { return o.options.resampling.nearest; },
                       {.paper = method::kOn, .help = "take the nearest view for each ray, do not blend"})};
  return kRows;
}

method::BuildReport buildModel(const method::BuildInput& input, const Setting& setting,
                               const Progress& progress) {
  const Stopwatch watch;
  BuildChoice choice = method::applied(BuildChoice{}, buildRows(), setting);
  BuildOptions& options = choice.options;
  options.triangles = choice.triangles.value_or(0);
  const lightfield::Views views = lightfield::viewsOf(input, progress);
  lightfield::foretellMemory(input, lightfield::photographMemory(views), "photographs");
  const BuildReport report = build(views, options, input.output, progress);
  size_t texels = 0;
  std::vector<double> widths, heights;
  for (const Slab& slab : report.slabs) {
    texels += slab.texels();
    widths.push_back(slab.width);
    heights.push_back(slab.height);
  }
  const auto count = [](auto number) { return static_cast<double>(number); };
  const double total = count(report.texels.seen + report.texels.unseen + report.texels.missed);
  input.say(fmt::format("{}: 6 slabs of {} x {} pictures, {} texels of {} at most, {:.0f} % of them on the "
                        "object, {}; {:.1f} s",
                        input.output.string(), options.slabs.nodes, options.slabs.nodes, texels,
                        options.slabs.texels, 100 * (1 - count(report.texels.missed) / total),
                        lightfield::mebibytes(report.bytes), watch.seconds()));
  if (report.blackPictures > 0)
    input.say(
        fmt::format("{} of {} pictures are black: no photograph sees the side of the object that they show",
                    report.blackPictures, 6 * options.slabs.nodes * options.slabs.nodes));
  method::BuildReport result{.counts = {{"nodes", options.slabs.nodes},
                                        {"texels", count(texels)},
                                        {"texel_quota", count(options.slabs.texels)},
                                        {"texels_seen", count(report.texels.seen)},
                                        {"texels_unseen", count(report.texels.unseen)},
                                        {"texels_missed", count(report.texels.missed)},
                                        {"black_pictures", count(report.blackPictures)},
                                        {"depth_triangles", count(report.triangles)},
                                        {"bytes", count(report.bytes)}},
                             .lists = {{"slab_widths", widths}, {"slab_heights", heights}},
                             .seconds = report.seconds};
  if (!report.errors) return result;
  const DepthErrors& errors = *report.errors;
  input.say(fmt::format("depth by {} triangles is wrong by {:.3g} on average, {:.3g} at worst: neighbouring "
                        "pictures show a point up to {:.2f} texels apart on average, {:.1f} at worst",
                        report.triangles, errors.meanDepth, errors.worstDepth, errors.meanOffset,
                        errors.worstOffset));
  result.counts["depth_errors.lines"] = count(errors.lines);
  result.counts["depth_errors.mean"] = errors.meanDepth;
  result.counts["depth_errors.worst"] = errors.worstDepth;
  result.counts["depth_errors.mean_offset_texels"] = errors.meanOffset;
  result.counts["depth_errors.worst_offset_texels"] = errors.worstOffset;
  return result;
}

struct RenderOptions {
  int samples = lightfield::kSamples;
};

const method::Rows<RenderOptions>& renderRows() {
  static const method::Rows<RenderOptions> kRows{lightfield::samplesRow<RenderOptions>()};
  return kRows;
}

// An open lumigraph and its frames, which belong to the context's thread.
struct OpenLumigraph {
  std::shared_ptr<const gl::Context> context = gl::contextOfThread();
  lightfield::LightFieldFolder folder;
  LumigraphFrame frame;
  RenderOptions options = {};

  void draw(const capture::Camera<AcquisitionSpace>& camera, const std::vector<std::string>& aovs,
            const Progress& progress, method::FrameLayers& layers) {
    const bool isDepthAsked = lightfield::isAsked(aovs, "depth");
    LumigraphFrame::Picture picture =
        frame.render(camera, {options.samples, isDepthAsked}, layers.report.seconds, progress);
    layers.color = std::move(picture.color);
    if (isDepthAsked) layers.aovs["depth"] = std::move(picture.depth);
    layers.report.counts = {{"work.pixels", lightfield::samplesOf(camera, options.samples)},
                            {"triangles", static_cast<double>(frame.triangles())},
                            {"texture_bytes", static_cast<double>(frame.textureBytes())}};
  }
};

std::unique_ptr<method::Renderer> open(const std::filesystem::path& path, const Setting& setting,
                                       const Progress& progress) {
  auto context = gl::contextOfThread();
  lightfield::LightFieldFolder folder(path, kFormat, kVersion, progress);
  const Lumigraph field = readLumigraph(folder, progress);
  size_t texels = 0;
  for (const Slab& slab : field.slabs) texels += slab.texels();
  const auto lumigraph = std::make_shared<OpenLumigraph>(
      OpenLumigraph{std::move(context), std::move(folder), LumigraphFrame(field)});
  const lightfield::LightFieldFolder& opened = lumigraph->folder;
  lightfield::LightFieldRenderer::Parts parts = lightfield::partsOf(
      lumigraph, renderRows(),
      {.method = lumigraphMethod().tag,
       .folder = path,
       .identity = fmt::format("lumigraph {} {}", hex(opened.identity()), lumigraph->context->driver()),
       .counts = {{"nodes", static_cast<size_t>(field.slabs[0].nodes)},
                  {"texels", texels},
                  {"triangles", field.geometry.mesh.triangles.size()}},
       .rig = opened.rig(),
       .middle = middleOf(opened.mesh().positions),
       .points = opened.mesh().positions,
       .aovs = {"depth"}});
  return std::make_unique<lightfield::LightFieldRenderer>(std::move(parts), setting);
}

} // namespace

const method::Method& lumigraphMethod() {
  static const method::Method kMethod{.tag = "lumigraph",
                                      .title = "lumigraph: six slabs of two planes around the object",
                                      .paper = "Azuma 1999, §4",
                                      .format = kFormat,
                                      .buildOptions = method::optionsOf(buildRows()),
                                      .renderOptions = method::optionsOf(renderRows()),
                                      .build = buildModel,
                                      .open = open};
  return kMethod;
}

} // namespace surflect::lumigraph
