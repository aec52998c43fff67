#include "render/lightfield/olf/opacity_method.h"

#include "render/gl/context.h"
#include "render/lightfield/common/light_field_renderer.h"
#include "render/lightfield/common/views.h"
#include "render/lightfield/olf/build.h"
#include "render/lightfield/olf/opacity_field.h"
#include "render/lightfield/olf/opacity_file.h"
#include "render/lightfield/olf/opacity_frame.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <utility>

namespace surflect::olf {

namespace {

using method::row, method::words, method::wholeRange, method::Setting, method::Option;

// ---------------------------------------------------------------------------------------------------------
// Building

struct BuildChoice {
  BuildOptions options = {};
  MeshOptions mesh = {};
  size_t budgetMb = 1024;
};

method::Rows<BuildChoice> buildRows(Blending method) {
  method::Rows<BuildChoice> rows = meshRows<BuildChoice>();
  rows.push_back(row<BuildChoice>(
      "budget_mb", [](auto& o) -> auto& { return o.budgetMb; },
      {.domain = wholeRange(1, 1 << 20), .help = "MiB of the views; larger ones are scaled down"}));
  rows.push_back(row<BuildChoice>(
      "s3tc", [](auto& o) -> auto& { return o.options.packing.s3tc; },
      {.help = "store views as S3TC (DXT5) blocks, which the GPU reads: a byte for each texel, not 8"}));
  if (method == Blending::vdtm)
    rows.push_back(row<BuildChoice>(
        "domain", [](auto& o) -> auto& { return o.options.domain; },
        {.domain = words({"sphere", "plane"}),
         .paper = "plane",
         .help = "triangulate directions on the sphere, or projected onto the tangent plane"}));
  return rows;
}

method::BuildReport buildModel(Blending method, const method::BuildInput& input, const Setting& setting,
                               const Progress& progress) {
  const Stopwatch watch;
  const BuildChoice choice = method::applied(BuildChoice{}, buildRows(method), setting);
  BuildOptions options = choice.options;
  options.method = method;
  options.hull = choice.mesh.hull;
  options.triangles = choice.mesh.triangles.value_or(0);
  options.visible = choice.mesh.visible;
  options.packing.budget = choice.budgetMb << 20;
  lightfield::Views views = lightfield::viewsOf(input, progress, true);
  const BuildReport report = build(views, options, input.output, progress);
  if (report.unseenVertices > 0)
    input.say(fmt::format("{} of {} vertices are seen by no view: they blend the views that face them",
                          report.unseenVertices, report.vertices));
  if (report.scale < 1)
    input.say(fmt::format("views are scaled to {:.0f} % of their width to stay within --budget-mb",
                          100 * report.scale));
  if (report.cutOffShare > 0)
    input.say(
        fmt::format("{:.2g} % of the visible texels are brighter than the white of their view, and cut off",
                    100 * report.cutOffShare));
  input.say(
      fmt::format("{}: {} triangles{}, {} views of {} x {} texels{}, {:.0f} for each vertex, {}; {:.1f} s",
                  input.output.string(), report.triangles, report.isHull ? " of the opacity hull" : "",
                  report.views, report.width, report.height, report.s3tc ? " as S3TC" : "",
                  report.visibleViews, lightfield::mebibytes(report.bytes), watch.seconds()));
  const auto count = [](auto number) { return static_cast<double>(number); };
  return {.counts = {{"triangles", count(report.triangles)},
                     {"vertices", count(report.vertices)},
                     {"hull", count(report.isHull)},
                     {"views", count(report.views)},
                     {"unseen_vertices", count(report.unseenVertices)},
                     {"visible_views", report.visibleViews},
                     {"view_width", report.width},
                     {"view_height", report.height},
                     {"scale", report.scale},
                     {"s3tc", count(report.s3tc)},
                     {"cut_off_share", report.cutOffShare},
                     {"picture_bytes", count(report.pictureBytes)},
                     {"packed_bytes", count(report.packedBytes)},
                     {"bytes", count(report.bytes)}},
          .lists = {},
          .seconds = report.seconds};
}

// ---------------------------------------------------------------------------------------------------------
// Rendering

struct RenderOptions {
  int samples = lightfield::kSamples;
  Order order = Order::list;
};

const method::Rows<RenderOptions>& renderRows() {
  static const method::Rows<RenderOptions> kRows{
      lightfield::samplesRow<RenderOptions>(),
      row<RenderOptions>("order", [](auto& o) -> auto& { return o.order; },
                         {.domain = words({"list", "peel", "bsp"}),
                          .paper = "bsp",
                          .help = "fragments by a list for each pixel, by depth peeling, or by a BSP tree, "
                                  "which blends by alpha",
                          .atOpening = true})};
  return kRows;
}

// An open field and its frames, which belong to the context's thread.
struct OpenOpacity {
  lightfield::LightFieldFolder folder;
  OpacityField field;
  std::optional<const ViewBlender> blender;
  std::shared_ptr<const gl::Context> context = gl::contextOfThread();
  std::optional<OpacityFrame> frame;
  RenderOptions options = {};
  bool s3tc;

  OpenOpacity(const std::filesystem::path& path, const RenderOptions& given, const Progress& progress)
      : folder(path, kFormat, kVersion, progress), field(readField(folder, progress)),
        s3tc(field.packed.isCompressed()) {
    blender.emplace(field, progress);
    frame.emplace(field, given.order, progress);
    field.packed.texels = {}, field.packed.blocks = {}; // the driver has them now
  }

  std::map<std::string, size_t> counts() const {
    std::map<std::string, size_t> counts = {{"views", field.cameras.size()},
                                            {"triangles", field.mesh.triangles.size()},
                                            {"pieces", frame->pieces()},
                                            {"s3tc", s3tc},
                                            {"texture_bytes", frame->textureBytes()}};
    size_t auxiliary = 0;
    for (const auto& parts : {blender->bytes(), frame->auxiliaryBytes()})
      for (const auto& [part, bytes] : parts) {
        counts[part] = bytes;
        auxiliary += bytes;
      }
    counts["auxiliary_bytes"] = auxiliary;
    return counts;
  }

  void draw(const capture::Camera<AcquisitionSpace>& camera, const std::vector<std::string>&,
            const Progress& progress, method::FrameLayers& layers) {
    std::map<std::string, double>& seconds = layers.report.seconds;
    const std::vector<TriangleBlend> blends = blender->blends(camera.center().raw(), &seconds, progress);
    FrameCounts counts;
    layers.color = frame->render(lightfield::sampled(camera, options.samples), blends, seconds, counts,
                                 options.samples, progress);
    layers.report.counts = {{"work.pixels", lightfield::samplesOf(camera, options.samples)},
                            {"passes", static_cast<double>(counts.passes)},
                            {"fragments", static_cast<double>(counts.fragments)},
                            {"pieces", static_cast<double>(frame->pieces())},
                            {"texture_bytes", static_cast<double>(frame->textureBytes())}};
  }
};

std::unique_ptr<method::Renderer> open(const std::filesystem::path& path, const Setting& setting,
                                       const Progress& progress) {
  const RenderOptions given = method::applied(RenderOptions{}, renderRows(), setting);
  const auto opacity = std::make_shared<OpenOpacity>(path, given, progress);
  const auto& positions = opacity->folder.mesh().positions;
  lightfield::LightFieldRenderer::Parts parts = lightfield::partsOf(
      opacity, renderRows(),
      {.method = (opacity->field.method == Blending::vdtm ? vdtmMethod() : ulrMethod()).tag,
       .folder = path,
       .identity = fmt::format("opacity light field {} order {} {}", hex(opacity->folder.identity()),
                               nameOf(given.order), opacity->context->driver()),
       .counts = opacity->counts(),
       .rig = opacity->folder.rig(),
       .middle = middleOf(positions),
       .points = positions});
  return std::make_unique<lightfield::LightFieldRenderer>(std::move(parts), setting);
}

method::Method methodOf(Blending method) {
  const bool isVdtm = method == Blending::vdtm;
  return {
      .tag = isVdtm ? "vdtm" : "ulr",
      .title = isVdtm ? "opacity light field by view-dependent texture mapping"
                      : "opacity light field by unstructured lumigraph rendering",
      .paper = isVdtm ? "Vlasic et al. 2003, §4" : "Vlasic et al. 2003, §5",
      .format = kFormat,
      .buildOptions = method::optionsOf(buildRows(method)),
      .renderOptions = method::optionsOf(renderRows()),
      .build = [method](const method::BuildInput& input, const Setting& setting,
                        const Progress& progress) { return buildModel(method, input, setting, progress); },
      .open = open};
}

} // namespace

const method::Method& vdtmMethod() {
  static const method::Method kMethod = methodOf(Blending::vdtm);
  return kMethod;
}

const method::Method& ulrMethod() {
  static const method::Method kMethod = methodOf(Blending::ulr);
  return kMethod;
}

} // namespace surflect::olf
