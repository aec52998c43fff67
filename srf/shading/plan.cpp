#include "srf/shading/plan.h"

#include "srf/shading/taps.h"
#include "srf/weights/camera_weights.h"
#include "srf/weights/environment_tables.h"
#include "srf/weights/light_weights.h"
#include "srf/weights/pair_weights.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <variant>

namespace surflect::shading {

namespace {

constexpr size_t kTargetsPerPlan = 512;

// Appends look-ups of one place after another to a plan.
class Emitter {
public:
  // The field must outlive the emitter.
  explicit Emitter(const weights::ReflectanceField& field)
      : alpha_(field.alpha), files_(field.files), projections_(field.rig.views.size()) {
    for (const capture::View& view : field.rig.views) projectors_.emplace_back(view.camera);
  }

  void moveTo(const Point3<AcquisitionSpace>& place) {
    place_ = place.cast<double>();
    ++current_;
  }

  // Adds a look-up of the place in a view for a target, under the light row [begin, end), and the view's
  // alpha to that of the target. Does nothing if the place does not project into the view.
  void emit(size_t target, uint32_t view, float weight, size_t begin, size_t end, ShadingPlan& plan) {
    const auto& pixel = pixelIn(view);
    if (!pixel) return;
    const auto [x, y] = *pixel;
    if (!plan.alphaSums.empty()) {
      ShadingPlan::AlphaSum& sum = plan.alphaSums[target];
      sum.weight += weight;
      weight *= alpha_[view].at(x, y);
      sum.alpha += weight;
      if (weight == 0) return;
    }
    plan.ops.push_back({static_cast<uint32_t>(target), view, x, y, weight, static_cast<uint32_t>(begin),
                        static_cast<uint32_t>(end)});
  }

  using Shows = weights::EnvironmentTables::Shows;
  // Content of a view at the place: the object if it projects to a texel in a stored block. Views without a
  // file show it wherever it projects.
  Shows showsIn(uint32_t view) {
    const auto& pixel = pixelIn(view);
    if (!pixel) return Shows::nothing;
    const bool isStored = files_.empty() || storesTexel(files_[view], pixel->x, pixel->y);
    return isStored ? Shows::object : Shows::background;
  }
  bool isShown(uint32_t view) { return showsIn(view) == Shows::object; }

private:
  struct Pixel {
    float x, y;
  };
  struct Projection {
    uint64_t of = 0; // number of the place
    std::optional<Pixel> pixel;
  };

  const std::optional<Pixel>& pixelIn(uint32_t view) {
    Projection& projection = projections_[view];
    if (projection.of != current_) {
      projection = {current_, {}};
      if (const auto pixel = projectors_[view](place_))
        projection.pixel = {static_cast<float>(pixel->x), static_cast<float>(pixel->y)};
    }
    return projection.pixel;
  }

  std::span<const codec::AlphaPlane> alpha_;                     // one for each view, or none
  std::span<const codec::ViewFile> files_;                       // likewise
  std::vector<capture::Projector<AcquisitionSpace>> projectors_; // one for each view
  std::vector<Projection> projections_;                          // likewise
  Point3<AcquisitionSpace, double> place_;
  uint64_t current_ = 0; // number of the place
};

// Adds the tables' correction to a target of all places of a query.
void correctEnvironment(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                        size_t query, size_t firstPlace, size_t target, weights::EnvironmentTables& tables,
                        Emitter& emitter, ShadingPlan& plan) {
  if (!tables.answer()) return;
  tables.lookUp();
  for (size_t place = batch.placeBegin(query); place < batch.placeBegin(query + 1); ++place) {
    const uint32_t surfel = batch.placeAt(place);
    emitter.moveTo(field.cloud.p0[surfel]);
    Rgb& offset = plan.offsets[(place - firstPlace) * plan.targetsPerPlace + target];
    offset = offset + field.shared->gains[surfel] *
                          tables.correctionAt(surfel, [&](uint32_t view) { return emitter.showsIn(view); });
  }
}

// Plans cameras and lights with separate weights: one operation for each query and camera.
class ProductPlanner {
public:
  // For all lights, a query has one target; for environments alone, it is the first after those of the
  // lights.
  ProductPlanner(const weights::ReflectanceField& field, const weights::LightExtrapolationFade& coverage,
                 const weights::QueryBatch& batch, const weights::ShadeOptions& options,
                 weights::LightSources sources)
      : field_(field), batch_(batch), isWhole_(sources == weights::LightSources::all),
        share_(isWhole_
                   ? 1
                   : static_cast<float>(batch.environments.size()) / static_cast<float>(batch.sources())),
        cameras_(field, batch, options), lights_(field, coverage, batch, options, sources), emitter_(field),
        viewColor_(weights::blendColors(field.rig.views.size())) {
    if (correctsEnvironments(field, batch, options)) tables_.emplace(field);
  }

  void plan(size_t begin, size_t end, ShadingPlan& plan, bool relights = false) {
    const bool isLit = !field_.rig.lights.empty(), showsBlends = !plan.cameraBlend.empty();
    const size_t firstPlace = batch_.placeBegin(begin);
    auto relit = plan.ops.begin(); // the first operation that waits for its light row
    for (size_t first = begin; first < end; first += weights::kQueryLanes) {
      const size_t count = std::min(weights::kQueryLanes, end - first);
      if (isLit) lights_.prepare(first, count, plan.rows);
      if (!relights) cameras_.prepare(first, count);
      for (size_t lane = 0; lane < count; ++lane) {
        const size_t placeBegin = batch_.placeBegin(first + lane),
                     placeEnd = batch_.placeBegin(first + lane + 1);
        if (tables_) tables_->moveTo(batch_.surfels[first + lane], batch_.towardsView[first + lane]);
        const bool corrects = tables_ && tables_->answer();
        const weights::LightWeights::Row row =
            isLit ? lights_.append(lane, plan.rows, corrects) : fixedLight(plan.rows);
        const float share = share_ * (colorScales_.empty() ? 1 : colorScales_[first + lane - firstQuery_]);
        for (size_t i = placeBegin - firstPlace; isLit && showsBlends && i < placeEnd - firstPlace; ++i)
          plan.lightBlend[i] = plan.lightBlend[i] + share / share_ * lights_.blendColor();
        if (relights) {
          for (; relit != plan.ops.end() && relit->target < placeEnd - firstPlace; ++relit) {
            relit->rowBegin = static_cast<uint32_t>(row.begin);
            relit->rowEnd = static_cast<uint32_t>(row.end);
          }
          continue;
        }
        if (corrects) addEnvironments(first + lane);
        const weights::BestView best = cameras_.forEach(lane, [&](uint32_t view, float weight) {
          if (corrects) takeAway(view, weight);
          for (size_t place = placeBegin; place < placeEnd; ++place) {
            const size_t i = place - firstPlace;
            emitter_.moveTo(field_.cloud.p0[batch_.placeAt(place)]);
            emitter_.emit(i * plan.targetsPerPlace + (isWhole_ ? 0 : batch_.lights), view, weight, row.begin,
                          row.end, plan);
            if (showsBlends) plan.cameraBlend[i] = plan.cameraBlend[i] + share * weight * viewColor_[view];
          }
        });
        if (corrects)
          correctEnvironment(field_, batch_, first + lane, firstPlace, isWhole_ ? 0 : batch_.lights, *tables_,
                             emitter_, plan);
        for (size_t i = placeBegin - firstPlace; i < placeEnd - firstPlace; ++i) {
          if (!isWhole_) continue; // known from the lights
          plan.confidence[i] = weights::confidenceOf(best.penalty);
          if (!best.isSeen) ++plan.unseen;
        }
      }
    }
  }

  // As plan(), for all lights. Rows are made where a place asks for a look-up.
  void planKept(size_t begin, size_t end, ShadingPlan& plan, KeptLookUps& kept) {
    const size_t firstPlace = batch_.placeBegin(begin);
    struct Lane {
      weights::BlendSet views;
      weights::BestView best;
      bool asks = false;
    };
    std::array<Lane, weights::kQueryLanes> lanes;
    std::vector<uint32_t>& slots = slots_; // of the lanes: place by place, view by view
    for (size_t first = begin; first < end; first += weights::kQueryLanes) {
      const size_t count = std::min(weights::kQueryLanes, end - first);
      cameras_.prepare(first, count);
      slots.clear();
      bool asks = false;
      for (size_t l = 0; l < count; ++l) {
        Lane& lane = lanes[l] = {};
        std::array<uint32_t, weights::kMaxBlended> views;
        lane.best = cameras_.forEach(l, [&](uint32_t view, float weight) {
          views[lane.views.size()] = view;
          lane.views.push({view, weight});
        });
        for (size_t place = batch_.placeBegin(first + l); place < batch_.placeBegin(first + l + 1); ++place) {
          const size_t at = slots.size();
          slots.resize(at + lane.views.size());
          kept.assign(batch_.placeAt(place), batch_, first + l, std::span(views).first(lane.views.size()),
                      slots.data() + at);
          for (size_t i = at; i < slots.size(); ++i) lane.asks |= !kept.isKnown(slots[i]);
        }
        asks |= lane.asks;
      }
      if (asks) lights_.prepare(first, count, plan.rows);
      size_t at = 0; // slot of the lane's first place
      for (size_t l = 0; l < count; ++l) {
        const auto& [views, best, laneAsks] = lanes[l];
        const weights::LightWeights::Row row =
            laneAsks ? lights_.append(l, plan.rows) : weights::LightWeights::Row{0, 0};
        const size_t placeBegin = batch_.placeBegin(first + l), placeEnd = batch_.placeBegin(first + l + 1);
        for (size_t i = 0; i < views.size(); ++i)
          for (size_t place = placeBegin; place < placeEnd; ++place) {
            const uint32_t slot = slots[at + (place - placeBegin) * views.size() + i];
            const bool isKnown = kept.isKnown(slot);
            const size_t op = plan.ops.size();
            emitter_.moveTo(field_.cloud.p0[batch_.placeAt(place)]);
            emitter_.emit(place - firstPlace, views[i].index, views[i].weight, isKnown ? 0 : row.begin,
                          isKnown ? 0 : row.end, plan);
            if (plan.ops.size() > op)
              (isKnown ? plan.known : plan.asked).push_back({static_cast<uint32_t>(op), slot});
          }
        at += (placeEnd - placeBegin) * views.size();
        for (size_t place = placeBegin; place < placeEnd; ++place) {
          plan.confidence[place - firstPlace] = weights::confidenceOf(best.penalty);
          if (!best.isSeen) ++plan.unseen;
        }
      }
    }
  }

  // Replaces the batch's irradiance from a query on (#lights a query), and scales the blend colours of each
  // query; both must outlive the next plan.
  void answerRest(std::span<const Rgb> irradiance, std::span<const float> colorScales, size_t firstQuery) {
    lights_.setIrradiance(irradiance, firstQuery);
    colorScales_ = colorScales;
    firstQuery_ = firstQuery;
  }

private:
  // Row of a capture under fixed illumination: its only column, unchanged.
  static weights::LightWeights::Row fixedLight(weights::LightRows& rows) {
    rows.add(0, {1, 1, 1});
    return {rows.lights.size() - 1, rows.lights.size()};
  }

  // Adds the lights of all environments to the tables.
  void addEnvironments(size_t query) {
    for (size_t e = 0; e < batch_.environments.size(); ++e) {
      const auto& [lights, strength, extrapolation, table] = batch_.environments[e];
      const auto reached = lights_.environment(e).reached;
      for (size_t q = 0; q < lights.size(); ++q)
        tables_->add(batch_.rotationOf(query, e)(lights[q].towards),
                     reached[q] * (strength * lights[q].irradiance));
    }
  }
  // Takes a view away from the tables, as far as it answers for environments.
  void takeAway(uint32_t view, float weight) {
    tables_->addView(view, weight);
    for (uint32_t light = 0; light < field_.rig.lights.size(); ++light) {
      Rgb irradiance;
      for (size_t e = 0; e < batch_.environments.size(); ++e) {
        const Eigen::Array4f& share = lights_.environment(e).shares[light];
        irradiance = irradiance + batch_.environments[e].strength * Rgb{share[0], share[1], share[2]};
      }
      tables_->takeAway(light, weight * irradiance);
    }
  }

  const weights::ReflectanceField& field_;
  const weights::QueryBatch& batch_;
  const bool isWhole_;
  const float share_;                  // of the query's lights
  std::span<const float> colorScales_; // empty: 1
  size_t firstQuery_ = 0;
  weights::CameraWeights cameras_;
  weights::LightWeights lights_;
  std::optional<weights::EnvironmentTables> tables_; // if they answer environments
  Emitter emitter_;
  std::vector<Rgb> viewColor_;
  std::vector<uint32_t> slots_; // working memory of planKept
};

// Sum of values at corners by the weights of a place.
template <class T> T atPlace(const weights::AtCorners<T>& values, const weights::AtCorners<float>& weights) {
  return weights[0] * values[0] + weights[1] * values[1] + (weights[2] * values[2] + weights[3] * values[3]);
}

// Plans (camera, light) pairs: one operation for each light or environment and view.
class PairPlanner {
public:
  PairPlanner(const weights::ReflectanceField& field, const weights::LightExtrapolationFade& coverage,
              const weights::QueryBatch& batch, const weights::ShadeOptions& options)
      : field_(field), batch_(batch), corners_(batch.corners()), pairs_(field, coverage, batch, options),
        lights_(batch.lights), emitter_(field), viewColor_(weights::blendColors(field.rig.views.size())),
        lightColor_(weights::blendColors(field.rig.lights.size())),
        environmentBrightness_(weights::environmentBrightness(batch)), listsUnmatched_(options.showsTargets) {
    assert(corners_ == 1 || (batch.environments.empty() && weights::blendsCorners(field, options)));
    isSeparate_ = field.isFullProduct && isSeparateBesideTables(field, options);
    if (!field.isFullProduct && correctsEnvironments(field, batch, options)) tables_.emplace(field);
    if (isSeparate_ || (field.isFullProduct && !batch.environments.empty()))
      product_.emplace(field, coverage, batch, options,
                       isSeparate_ ? weights::LightSources::all : weights::LightSources::environments);
  }

  void plan(size_t begin, size_t end, ShadingPlan& plan) {
    firstPlace_ = batch_.placeBegin(begin);
    rest_.clear();
    restShares_.clear();
    for (size_t first = begin; first < end; first += queriesAtOnce()) {
      const size_t count = std::min(queriesAtOnce(), end - first);
      pairs_.prepare(first, count);
      for (size_t lane = 0; lane < count; lane += corners_) {
        for (Light& light : lights_) light.clear();
        for (size_t corner = 0; corner < corners_; ++corner)
          askCorner(first + lane + corner, lane, corner, plan);
        planPlaces(first + lane, plan);
      }
    }
    if (isSeparate_) product_->answerRest(rest_, restShares_, begin);
    if (product_) product_->plan(begin, end, plan);
  }

private:
  template <class T> using AtCorners = weights::AtCorners<T>;

  // Queries that are prepared together: a lane set, or fewer so that few systems of many lights are in
  // memory.
  size_t queriesAtOnce() const {
    constexpr size_t kLightsAtOnce = 128;
    const size_t few = kLightsAtOnce / std::max(size_t{1}, batch_.lights) / corners_ * corners_;
    return std::clamp(few, corners_, weights::kQueryLanes);
  }

  // A photograph that answers a light at some corners.
  struct Term {
    uint32_t number;           // of the pair
    AtCorners<float> weight{}; // not below 0
    AtCorners<Rgb> factor{};   // of its radiance
    AtCorners<Rgb> absent{};   // of tables: radiance to add where it does not show a place
  };
  static Term& termOf(std::vector<Term>& terms, uint32_t number) {
    const auto found = std::ranges::find(terms, number, &Term::number);
    return found != terms.end() ? *found : terms.emplace_back(Term{number});
  }

  // An operation at a place of a group.
  struct Operation {
    uint32_t view;
    float weight;
    size_t rowBegin, rowEnd;
  };

  // A light at the corners: its pairs, and the photographs that correct its tables.
  struct Light {
    std::vector<Term> pairs, corrections;
    AtCorners<float> share;      // of the tables
    AtCorners<Rgb> offset;       // radiance by tables, without gain
    AtCorners<float> lacksState; // 1: few photographs have the requested shadow state
    // At a place: one for each view that has pairs, and one for each correction.
    std::vector<Operation> ofPairs, ofCorrections;

    void clear() {
      pairs.clear();
      corrections.clear();
      share.fill(0);
      offset.fill({});
      lacksState.fill(0);
    }
  };

  void askCorner(size_t query, size_t lane, size_t corner, ShadingPlan& plan) {
    const weights::BestView best = pairs_.select(lane + corner);
    confidence_[corner] = weights::confidenceOf(best.penalty);
    isUnseen_[corner] = best.isSeen ? 0.f : 1.f;
    cameraColor_[corner] = lightBlendColor_[corner] = {};
    float restShare = static_cast<float>(batch_.environments.size());
    for (size_t l = 0; l < batch_.lights; ++l) restShare += 1 - askLight(query, l, corner);
    if (isSeparate_) restShares_.push_back(restShare / static_cast<float>(batch_.sources()));
    if (!product_)
      for (size_t e = 0; e < batch_.environments.size(); ++e) planEnvironment(query, e, plan);
  }

  // Asks for the tables' share of a light, and for the rest unless the product answers it. Returns that
  // share.
  float askLight(size_t query, size_t l, size_t corner) {
    pairs_.setLight(l);
    const Rgb& irradiance = batch_.irradiance[query * batch_.lights + l];
    const auto shared = pairs_.shared();
    const float share = shared ? shared->share : 0;
    if (shared) addCorrections(*shared, irradiance, lights_[l], corner);
    if (isSeparate_)
      rest_.push_back((1 - share) * irradiance);
    else if (share < 1)
      addPairs(1 - share, irradiance, lights_[l], corner);
    return share;
  }

  void addPairs(float share, const Rgb& irradiance, Light& light, size_t corner) {
    const auto [weights, scale, lacksState] = pairs_.blend();
    light.lacksState[corner] = lacksState ? 1 : 0;
    for (const auto& [number, weight] : weights) {
      const weights::CapturedPairs::Pair& pair = pairs_.pairs()[number];
      Term& term = termOf(light.pairs, number);
      term.weight[corner] += weight; // perhaps once more, with camera and light exchanged
      term.factor[corner] =
          term.factor[corner] + share * scale * weight * pairs_.ratio(irradiance, pair.light);
      addColors(pair, share * weight, share * scale * weight, corner);
    }
  }

  // Blend colours are those of the photographs, by the size of their factors.
  void addCorrections(const weights::PairWeights::Shared& shared, const Rgb& irradiance, Light& light,
                      size_t corner) {
    const auto& [photographs, predicted, offset] = shared.blend;
    const float share = shared.share * shared.fade;
    light.share[corner] = shared.share;
    light.offset[corner] = share * (irradiance * offset);
    float sizes = 0;
    for (const auto& [number, factor] : photographs) sizes += std::abs(factor);
    for (size_t i = 0; i < photographs.size(); ++i) {
      const auto [number, factor] = photographs[i];
      if (factor == 0) continue;
      const weights::CapturedPairs::Pair& pair = pairs_.pairs()[number];
      Term& term = termOf(light.corrections, number);
      term.weight[corner] = std::abs(factor);
      term.factor[corner] = share * factor * pairs_.ratio(irradiance, pair.light);
      term.absent[corner] = share * factor * (irradiance * predicted[i]);
      const float ofBlend = shared.share * std::abs(factor) / sizes;
      addColors(pair, ofBlend, ofBlend, corner);
    }
  }

  void addColors(const weights::CapturedPairs::Pair& pair, float ofView, float ofLight, size_t corner) {
    const auto sources = static_cast<float>(batch_.sources());
    cameraColor_[corner] = cameraColor_[corner] + ofView / sources * viewColor_[pair.view];
    lightBlendColor_[corner] = lightBlendColor_[corner] + ofLight / sources * lightColor_[pair.light];
  }

  // Plans all places of a group, which begins with a query.
  void planPlaces(size_t query, ShadingPlan& plan) {
    for (Light& light : lights_) std::ranges::sort(light.pairs, {}, &Term::number); // view by view
    const size_t begin = batch_.placeBegin(query), end = batch_.placeBegin(query + corners_);
    for (size_t place = begin; place < end; ++place) {
      const AtCorners<float> own = weightsAt(place);
      const size_t i = place - firstPlace_;
      plan.confidence[i] = atPlace(confidence_, own);
      if (!isSeparate_ && atPlace(isUnseen_, own) > 0.5f) ++plan.unseen; // the product counts, too
      if (!plan.cameraBlend.empty()) {
        plan.cameraBlend[i] = atPlace(cameraColor_, own);
        plan.lightBlend[i] = atPlace(lightBlendColor_, own);
      }
      emitter_.moveTo(field_.cloud.p0[batch_.placeAt(place)]);
      for (size_t l = 0; l < batch_.lights; ++l) {
        if (corners_ > 1 || place == begin) writeOperations(lights_[l], own, batch_.placeAt(place), plan);
        if (atPlace(lights_[l].lacksState, own) > 0.5f) {
          ++plan.unmatchedShadows;
          if (listsUnmatched_) plan.unmatchedAt.push_back(static_cast<uint32_t>(i * batch_.lights + l));
        }
        planLight(place, l, own, plan);
      }
    }
  }

  AtCorners<float> weightsAt(size_t place) const {
    return corners_ == 1 ? AtCorners<float>{1} : batch_.cornerWeights[place];
  }

  // Whether a surfel may be looked up in a view that its corners chose: something else may hide it there.
  bool isSeen(uint32_t surfel, uint32_t view) const {
    return corners_ == 1 || field_.visibility.of(surfel)[view] > 0;
  }

  // Writes the operations of a light at a place. The weights of views that do not see the surfel pass to the
  // others, if there are any.
  void writeOperations(Light& light, const AtCorners<float>& own, uint32_t surfel, ShadingPlan& plan) const {
    light.ofPairs.clear();
    light.ofCorrections.clear();
    const weights::CapturedPairs& pairs = pairs_.pairs();
    const auto addRow = [&](const Term& term, float weight) {
      plan.rows.add(pairs[term.number].column, 1 / weight * atPlace(term.factor, own));
    };
    float all = 0, seen = 0;
    for (const Term& term : light.pairs) {
      const float weight = atPlace(term.weight, own);
      all += weight;
      if (isSeen(surfel, pairs[term.number].view)) seen += weight;
    }
    const bool choosesSeen = seen > 0 && seen < all;
    for (auto first = light.pairs.begin(); first != light.pairs.end();) {
      const uint32_t view = pairs[first->number].view;
      const auto last = std::find_if(first, light.pairs.end(),
                                     [&](const Term& term) { return pairs[term.number].view != view; });
      float weight = 0;
      for (auto term = first; term != last; ++term) weight += atPlace(term->weight, own);
      const size_t rowBegin = plan.rows.lights.size();
      if (weight > 0 && (!choosesSeen || isSeen(surfel, view))) {
        for (auto term = first; term != last; ++term) addRow(*term, weight);
        light.ofPairs.push_back(
            {view, choosesSeen ? weight * (all / seen) : weight, rowBegin, plan.rows.lights.size()});
      }
      first = last;
    }
    for (const Term& term : light.corrections) {
      const float weight = atPlace(term.weight, own);
      const size_t row = plan.rows.lights.size();
      if (weight > 0) addRow(term, weight);
      light.ofCorrections.push_back({pairs[term.number].view, weight, row, row + 1});
    }
  }

  // Plans a light at a place. A photograph that does not show the place counts as its prediction, so that it
  // corrects nothing there.
  void planLight(size_t place, size_t l, const AtCorners<float>& own, ShadingPlan& plan) {
    const Light& light = lights_[l];
    const uint32_t surfel = batch_.placeAt(place);
    const size_t i = place - firstPlace_, first = i * plan.targetsPerPlace;
    for (const auto& [view, weight, begin, end] : light.ofPairs)
      emitter_.emit(first + l, view, weight, begin, end, plan);
    if (plan.tablesPerPlace == 0) return;
    const size_t target = first + plan.targetsPerPlace - plan.tablesPerPlace + l;
    plan.tableShares[i * plan.tablesPerPlace + l] = atPlace(light.share, own);
    Rgb offset = atPlace(light.offset, own);
    for (size_t k = 0; k < light.ofCorrections.size(); ++k) {
      const auto& [view, weight, begin, end] = light.ofCorrections[k];
      if (!(weight > 0)) continue;
      if (isSeen(surfel, view) && emitter_.isShown(view))
        emitter_.emit(target, view, weight, begin, end, plan);
      else
        offset = offset + atPlace(light.corrections[k].absent, own);
    }
    plan.offsets[target] = field_.shared->gains[surfel] * offset;
  }

  // Looks up all places of a query for one of its environments.
  void emitAll(size_t query, size_t source, uint32_t view, float weight, size_t rowBegin, size_t rowEnd,
               ShadingPlan& plan) {
    for (size_t place = batch_.placeBegin(query); place < batch_.placeBegin(query + 1); ++place) {
      emitter_.moveTo(field_.cloud.p0[batch_.placeAt(place)]);
      emitter_.emit((place - firstPlace_) * plan.targetsPerPlace + source, view, weight, rowBegin, rowEnd,
                    plan);
    }
  }

  // Sums the irradiance of the environment's lights that each pair represents; the pairs of one view become
  // one operation.
  void planEnvironment(size_t query, size_t e, ShadingPlan& plan) {
    const weights::QueryEnvironment& environment = batch_.environments[e];
    const auto& rotation = batch_.rotationOf(query, e);
    pairShare_.assign(pairs_.pairs().size(), Rgb{});
    if (tables_) tables_->moveTo(batch_.surfels[query], batch_.towardsView[query]);
    const bool corrects = tables_ && tables_->answer();
    for (const auto& [towards, irradiance, spread] : environment.lights) {
      const auto [weights, scale, _] = pairs_.blendTowards(rotation(towards), environment.extrapolation);
      for (const auto& [number, weight] : weights)
        pairShare_[number] = pairShare_[number] + scale * weight * irradiance;
      if (corrects)
        tables_->add(rotation(towards),
                     pairs_.reachedPart(weights, scale) * (environment.strength * irradiance));
    }
    const auto sources = static_cast<float>(batch_.sources());
    const auto colorShare = [&](float ofLight) { return ofLight / (environmentBrightness_[e] * sources); };
    for (uint32_t view = 0; view < field_.columns.size(); ++view) {
      const auto& lights = field_.columns[view];
      const std::span shares = std::span(pairShare_).subspan(pairs_.pairs().firstOf(view), lights.size());
      float brightnessOfView = 0;
      for (const Rgb& share : shares) brightnessOfView += weights::brightness(share);
      if (!(brightnessOfView > 0)) continue;
      const float weight = brightnessOfView / environmentBrightness_[e];
      if (corrects) tables_->addView(view, weight);
      const size_t rowBegin = plan.rows.lights.size();
      for (uint32_t column = 0; column < lights.size(); ++column) {
        const Rgb share = shares[column];
        if (share == Rgb{}) continue;
        if (corrects) tables_->takeAway(lights[column], environment.strength * share);
        plan.rows.add(column, 1 / weight *
                                  weights::irradianceRatio(environment.strength * share,
                                                           pairs_.irradiance(lights[column])));
        lightBlendColor_[0] =
            lightBlendColor_[0] + colorShare(weights::brightness(share)) * lightColor_[lights[column]];
      }
      emitAll(query, batch_.lights + e, view, weight, rowBegin, plan.rows.lights.size(), plan);
      cameraColor_[0] = cameraColor_[0] + colorShare(brightnessOfView) * viewColor_[view];
    }
    if (corrects)
      correctEnvironment(field_, batch_, query, firstPlace_, batch_.lights + e, *tables_, emitter_, plan);
  }

  const weights::ReflectanceField& field_;
  const weights::QueryBatch& batch_;
  const size_t corners_;
  weights::PairWeights pairs_;
  // The group that is being planned.
  std::vector<Light> lights_;
  AtCorners<float> confidence_{}, isUnseen_{}; // unseen: 1
  AtCorners<Rgb> cameraColor_{}, lightBlendColor_{};
  // Cameras and lights apart: of environments, if every camera has every light, or of all that tables leave.
  std::optional<ProductPlanner> product_;
  bool isSeparate_ = false; // the product answers lights where tables do not
  // The rest that tables leave, of each planned query: irradiance of each light, and mean share of all
  // sources.
  std::vector<Rgb> rest_;
  std::vector<float> restShares_;
  Emitter emitter_;
  std::vector<Rgb> viewColor_, lightColor_;
  std::vector<float> environmentBrightness_;
  const bool listsUnmatched_;
  size_t firstPlace_ = 0;      // of the plan
  std::vector<Rgb> pairShare_; // per pair: share of the current environment's irradiance
  std::optional<weights::EnvironmentTables> tables_; // of environments, beside ULR
};

using Planner = std::variant<ProductPlanner, PairPlanner>;

void requireLights(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                   const weights::ShadeOptions& options) {
  const bool isFixed = field.rig.lights.empty();
  if (isFixed && batch.sources() > 0)
    throw Error("captured under fixed illumination: it cannot be lit by a light of the script")
        .in(field.folder);
  if (!isFixed && batch.sources() == 0)
    throw Error("captured under " + counted(field.rig.lights.size(), "light") +
                ": the script, or the photographs to compare with, must name a light; `evaluate --script` "
                "takes one with [[light]]")
        .in(field.folder);
  if (interpolationOf(field, options) == weights::Interpolation::shared && !isFixed && !field.shared)
    throw Error::mismatch(
        "a model with tables",
        "none: pack its capture again with --tables on, opaque and with at least 4 cameras and lights")
        .at("interpolation shared")
        .in(field.folder);
  if (options.foreshortened.value_or(false) &&
      (isFixed ||
       (!field.isFullProduct && (!usesKriging(field, options) || isSeparateBesideTables(field, options)))))
    throw Error::mismatch("photographs under all lights from all cameras, or --interpolation kriging",
                          isFixed ? "fixed illumination" : "pairs of cameras and lights")
        .at("foreshortening on")
        .in(field.folder);
}

// Operations name their rows and targets by 32 bits.
void requireIndices(const ShadingPlan& plan) {
  if (std::max({plan.rows.weights.size(), plan.rows.lights.size(), plan.targets()}) >
      std::numeric_limits<uint32_t>::max())
    throw Error("too many surfels and lights to be planned at once");
}

} // namespace

void addOffsets(const ShadingPlan& plan, std::span<Rgb> radiance) {
  for (size_t target = 0; target < plan.offsets.size(); ++target)
    radiance[target] = reflectance::positive(radiance[target] + plan.offsets[target]);
}

void meanAlpha(ShadingPlan& plan) {
  plan.alpha.assign(plan.alphaSums.size() / plan.targetsPerPlace, 0);
  for (size_t place = 0; place < plan.alpha.size(); ++place) {
    float sum = 0, count = 0;
    for (size_t target = 0; target < plan.targetsPerPlace; ++target)
      if (const auto& [alpha, weight] = plan.alphaSums[place * plan.targetsPerPlace + target]; weight > 0) {
        sum += alpha / weight;
        ++count;
      }
    if (count > 0) plan.alpha[place] = std::clamp(sum / count, 0.f, 1.f);
  }
}

struct ShadingPlanner::Impl {
  const weights::ReflectanceField& field;
  const weights::QueryBatch& batch;
  weights::ShadeOptions options;
  weights::LightExtrapolationFade coverage{lightDirections(field)};
  bool usesAlpha = options.usesAlpha && !field.alpha.empty();
  bool isProduct = hasSeparateWeights(field, options) ||
                   (field.isFullProduct && batch.lights == 0 &&
                    !correctsEnvironments(field, batch, options)); // environments alone
  bool hasTables = !isProduct && usesTables(field, options);
  size_t targetsPerPlace = (isProduct || (field.isFullProduct && isSeparateBesideTables(field, options))
                                ? 1
                                : std::max(size_t{1}, batch.sources())) +
                           (hasTables ? batch.lights : 0);
  tbb::enumerable_thread_specific<Planner> planners{[this] {
    return isProduct ? Planner(std::in_place_type<ProductPlanner>, field, coverage, batch, options,
                               weights::LightSources::all)
                     : Planner(std::in_place_type<PairPlanner>, field, coverage, batch, options);
  }};

  // Empties a plan of the queries [begin, end), and makes room.
  void begin(size_t begin, size_t end, ShadingPlan& plan) const {
    plan.places = batch.placeBegin(end) - batch.placeBegin(begin);
    plan.targetsPerPlace = targetsPerPlace;
    plan.tablesPerPlace = hasTables ? batch.lights : 0;
    plan.ops.clear();
    plan.rows.clear();
    plan.kept = nullptr;
    plan.known.clear();
    plan.asked.clear();
    plan.unseen = 0;
    plan.unmatchedShadows = 0;
    plan.unmatchedAt.clear();
    plan.offsets.assign(hasTables ? plan.targets() : 0, {});
    plan.tableShares.assign(plan.places * plan.tablesPerPlace, 0);
    plan.confidence.resize(plan.places);
    const size_t blends = options.showsBlends ? plan.places : 0;
    plan.alphaSums.assign(usesAlpha ? plan.targets() : 0, {});
    plan.cameraBlend.assign(blends, {});
    plan.lightBlend.assign(blends, {});
  }
};

ShadingPlanner::ShadingPlanner(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                               const weights::ShadeOptions& options) {
  assert(batch.towardsView.size() == batch.size());
  assert(batch.towardsLight.size() == batch.size() * batch.lights &&
         batch.irradiance.size() == batch.towardsLight.size());
  assert(batch.extrapolation.empty() || batch.extrapolation.size() == batch.lights);
  assert(batch.acquisitionFromEnvironment.size() == batch.size() * batch.environments.size());
  assert(batch.reached.empty() ||
         (field.lightVisibility && batch.reached.size() == batch.towardsLight.size()));
  requireLights(field, batch, options);
  impl_ = std::unique_ptr<Impl>(new Impl{field, batch, options});
}

ShadingPlanner::~ShadingPlanner() = default;

size_t ShadingPlanner::targetsPerPlace() const { return impl_->targetsPerPlace; }

size_t ShadingPlanner::queriesPerPlan() const {
  const size_t perQuery = targetsPerPlace() * impl_->options.placesPerQuery;
  return std::max(size_t{1}, kTargetsPerPlan / perQuery / weights::kQueryLanes) * weights::kQueryLanes;
}

void ShadingPlanner::plan(size_t begin, size_t end, ShadingPlan& plan) {
  impl_->begin(begin, end, plan);
  std::visit([&](auto& planner) { planner.plan(begin, end, plan); }, impl_->planners.local());
  meanAlpha(plan);
  requireIndices(plan);
}

void ShadingPlanner::planKept(size_t begin, size_t end, ShadingPlan& plan, KeptLookUps& kept) {
  assert(canRelight() && !impl_->options.showsBlends);
  impl_->begin(begin, end, plan);
  plan.kept = &kept;
  std::get<ProductPlanner>(impl_->planners.local()).planKept(begin, end, plan, kept);
  meanAlpha(plan);
  requireIndices(plan);
}

bool ShadingPlanner::canRelight() const { return impl_->isProduct; }

void ShadingPlanner::relight(size_t begin, size_t end, ShadingPlan& plan) {
  assert(canRelight() && plan.places == impl_->batch.placeBegin(end) - impl_->batch.placeBegin(begin));
  plan.rows.clear();
  plan.lightBlend.assign(plan.lightBlend.size(), {});
  std::get<ProductPlanner>(impl_->planners.local()).plan(begin, end, plan, true);
  requireIndices(plan);
}

ShadingPlan planShading(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                        const weights::ShadeOptions& options) {
  ShadingPlan plan;
  ShadingPlanner(field, batch, options).plan(0, batch.size(), plan);
  return plan;
}

} // namespace surflect::shading
