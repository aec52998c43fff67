#include "srf/model/pack_prepass.h"

#include "srf/capture/mask_file.h"
#include "srf/capture/silhouette.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"
#include "surfel/geometry/smooth_normals.h"
#include "surfel/math/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <locale>
#include <sstream>

namespace surflect::model {

namespace {

void matteFromMesh(MattedView& view, const capture::Camera<AcquisitionSpace>& camera,
                   const RayCaster<AcquisitionSpace>& impostor) {
  constexpr int kRim = 2; // pixels
  view.stack.alpha = capture::silhouette(camera, impostor);
  const image::Mask outline = image::objectMask(view.stack.alpha);
  view.object = image::eroded(outline, kRim);
  const auto source = image::nearestSeeds(view.object, outline);
  for (image::Image& light : view.stack.lights)
    for (size_t texel = 0; texel < source.size(); ++texel)
      if (source[texel] != texel)
        std::copy_n(light.values.begin() + static_cast<std::ptrdiff_t>(3 * source[texel]), 3,
                    light.values.begin() + static_cast<std::ptrdiff_t>(3 * texel));
}

} // namespace

MattedView fillMissingMatte(ViewPictures pictures, const capture::Camera<AcquisitionSpace>& camera,
                            const RayCaster<AcquisitionSpace>& impostor) {
  MattedView view{std::move(pictures.stack), {}, pictures.invalidTexels};
  if (pictures.hasMatte)
    view.object = image::objectMask(view.stack.alpha);
  else
    matteFromMesh(view, camera, impostor);
  return view;
}

MattedView wholeView(ViewPictures pictures) {
  MattedView view{std::move(pictures.stack), {}, pictures.invalidTexels};
  view.object = image::objectMask(view.stack.alpha);
  return view;
}

namespace {

// Alpha that 8 bits tell from clear and from opaque.
constexpr float kClear = 0.5f / 255, kOpaque = 1 - kClear;
constexpr int kEdge = 2; // pixels

bool isEdge(const image::Image& alpha, int x, int y) {
  bool hasClear = false, hasOpaque = false;
  for (int j = std::max(0, y - kEdge); j <= std::min(alpha.height - 1, y + kEdge); ++j)
    for (int i = std::max(0, x - kEdge); i <= std::min(alpha.width - 1, x + kEdge); ++i) {
      hasClear |= alpha.at(i, j)[0] < kClear;
      hasOpaque |= alpha.at(i, j)[0] > kOpaque;
    }
  return hasClear && hasOpaque;
}

} // namespace

void TranslucencySurvey::add(const image::Image& alpha) {
  assert(alpha.channels == 1);
  for (int y = 0; y < alpha.height; ++y)
    for (int x = 0; x < alpha.width; ++x) {
      const float own = alpha.at(x, y)[0];
      if (!(own >= kClear)) continue;
      ++object_;
      translucent_ += own <= kOpaque && !isEdge(alpha, x, y);
    }
}

double TranslucencySurvey::share() const {
  return object_ > 0 ? static_cast<double>(translucent_) / static_cast<double>(object_) : 0;
}

void WhiteLevel::add(const codec::ReflectanceStack& stack, const image::Mask& object,
                     const Progress& progress) {
  for (const image::Image& light : stack.lights) {
    progress.checkpoint();
    for (size_t texel = 0; texel < object.inside.size(); ++texel)
      if (object.inside[texel])
        for (size_t c = 0; c < 3; ++c) values_.add(light.values[3 * texel + c]);
  }
}

double WhiteLevel::value() const { return std::clamp(values_.percentile(0.995), 1e-20, 1e20); }

namespace {

// Version of the survey; a resumed run ignores surveys of other versions.
constexpr const char* kSurvey = "survey-4";

// Samples without texels: directions and irradiances of the lights at the middle of the impostor.
ReflectanceSamples lightSamples(const capture::Capture& capture,
                                const Point3<AcquisitionSpace, double>& middle) {
  std::vector<Direction3<AcquisitionSpace>> towards;
  std::vector<Rgb> irradiance;
  for (const capture::Light& light : capture.lights) {
    towards.push_back(capture::towardsLight(light, middle).cast<float>());
    irradiance.push_back(capture::irradianceAt(light, middle));
  }
  return {towards, irradiance};
}

// Adds at most `most` texels of the object, evenly spread over the picture, where the impostor has a surface.
void addSamples(const MattedView& view, const capture::Camera<AcquisitionSpace>& camera,
                std::span<const capture::Light> lights, const SmoothNormals& normals,
                const RayCaster<AcquisitionSpace>& impostor, size_t most, ReflectanceSamples& samples) {
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const auto width = static_cast<size_t>(camera.lens.width);
  const auto object = static_cast<size_t>(std::ranges::count(view.object.inside, true));
  const size_t step = std::max(size_t{1}, (object + most - 1) / most);
  std::vector<Rgb> reflectance(lights.size());
  size_t seen = 0;
  for (size_t texel = 0; texel < view.object.inside.size(); ++texel) {
    if (!view.object.inside[texel] || seen++ % step != 0) continue;
    const auto ray = capture::rayThrough(
        camera.lens, {static_cast<double>(texel % width) + 0.5, static_cast<double>(texel / width) + 0.5});
    if (!ray) continue;
    const auto origin = worldFromCamera(ray->origin);
    const auto direction = worldFromCamera(ray->direction);
    const auto hit = impostor.firstHit(origin, direction);
    if (!hit) continue;
    const auto place = origin + hit->distance * direction;
    const Vec3<float> normal = normals.at(hit->triangle, place.raw()).cast<float>();
    for (size_t light = 0; light < lights.size(); ++light) {
      const float* value = &view.stack.lights[light].values[3 * texel];
      const Rgb fallen = capture::irradianceAt(lights[light], place);
      reflectance[light] = {value[0] / fallen.r, value[1] / fallen.g, value[2] / fallen.b};
    }
    samples.add(reflectance, assume<Normal3<AcquisitionSpace>>(normal));
  }
}

} // namespace

PackPrepass prepass(PackSource& source, std::span<const std::vector<size_t>> frames, const TriangleMesh& mesh,
                    NormalsFrom normals, const RayCaster<AcquisitionSpace>& impostor,
                    const std::optional<capture::ViewPart>& part, const Progress& progress) {
  constexpr size_t kViews = 8, kTexels = 4000;
  const capture::Capture& capture = source.training();
  // Full product: every view has a frame of each light, since none has two of one light.
  const bool isFullProduct =
      std::ranges::all_of(frames, [&](const auto& ofView) { return ofView.size() == capture.lights.size(); });
  WhiteLevel white;
  TranslucencySurvey translucency;
  ReflectanceSamples samples = lightSamples(capture, middleOf(mesh.positions));
  std::optional<SmoothNormals> surface;
  if (isFullProduct) surface.emplace(mesh, progress);
  const std::vector<size_t> surveyed = evenlySpaced(frames.size(), kViews);
  const size_t count = surveyed.size();
  for (size_t i = 0; i < count; ++i) {
    const size_t number = surveyed[i];
    capture::Camera<AcquisitionSpace> camera = capture.views[number].camera;
    if (part) camera.lens = capture::shrunk(camera.lens, part->shrink);
    const Progress ofView = stepOf(progress, "survey", i, count);
    ofView("", 0);
    const MattedView view =
        part ? wholeView(readPicturePart(capture, frames[number], *part, ofView))
             : fillMissingMatte(source.pictures(frames[number], false, ofView), camera, impostor);
    white.add(view.stack, view.object, progress);
    translucency.add(view.stack.alpha);
    if (surface) addSamples(view, camera, capture.lights, *surface, impostor, kTexels / count, samples);
  }
  if (!white.isKnown()) {
    const auto matte = capture::describeFirstMatte(capture);
    throw Error(
        "no photograph shows anything of the object" +
        (matte ? ", which is what is above half of white in mask and alpha; the first is " + *matte : ""))
        .in(capture.file);
  }
  return {white.value(), samples.choose(white.value(), normals, progress), translucency.isTranslucent()};
}

std::string packPrepassText(const PackPrepass& survey) {
  const auto& [blend, leftOutDb] = survey.lights;
  return fmt::format("{} {:.17g} {} {} {} {} {}\n", kSurvey, survey.white, blend.lights, nameOf(blend.fit),
                     blend.foreshortened ? "foreshortened" : "plain",
                     leftOutDb ? fmt::format("{:.17g}", *leftOutDb) : "unknown",
                     survey.isTranslucent ? "translucent" : "opaque");
}

std::optional<PackPrepass> parsePackPrepass(const std::string& text) {
  std::istringstream words(text);
  words.imbue(std::locale::classic());
  PackPrepass survey;
  weights::LightBlend& blend = survey.lights.blend;
  std::string fit, shortening, leftOutDb, opacity;
  std::string kind;
  if (!(words >> kind >> survey.white >> blend.lights >> fit >> shortening >> leftOutDb >> opacity))
    return std::nullopt;
  if (fit == nameOf(weights::LightFit::plane)) blend.fit = weights::LightFit::plane;
  blend.foreshortened = shortening == "foreshortened";
  survey.isTranslucent = opacity == "translucent";
  if (leftOutDb != "unknown") {
    double db = 0;
    std::from_chars(leftOutDb.data(), leftOutDb.data() + leftOutDb.size(), db);
    survey.lights.leftOutDb = db;
  }
  if (packPrepassText(survey) != text || !(survey.white >= 1e-20 && survey.white <= 1e20))
    return std::nullopt;
  return survey;
}

} // namespace surflect::model
