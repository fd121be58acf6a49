#include "flipfree/unwrap/unwrap.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/chart/separate.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/place.h"
#include "flipfree/unwrap/seams/auto_islands.h"
#include "flipfree/unwrap/seams/costs.h"
#include "flipfree/unwrap/seams/search.h"

namespace flipfree::unwrap {

namespace {

// Once as a rule: what becomes an island may open a way for a cut through its neighbour.
constexpr int kMostTimesTorn = 3;

void require_corners(const mesh::Surface& surface, const Points2& uv) {
  if (uv.rows() != 3 * surface.faces.rows())
    throw_invalid(ErrorCode::kBadShape, "The UVs to stay close to need one row per face corner.");
}

certify::CertifyRequest request_of(const UnwrapOptions& options) {
  certify::CertifyRequest request;
  request.pins = options.pins;
  request.require_bijective = options.bijective;
  request.require_disjoint = options.pins.empty();  // charts with pins lie where the pins are
  return request;
}

// The unwrap of a clean surface, step by step.
class Unwrapping {
 public:
  Unwrapping(const mesh::Surface& surface, const UnwrapOptions& options, ExecutionContext& context)
      : surface_(surface),
        options_(options),
        context_(context),
        adjacency_(surface.adjacency()),
        working_{normalised(surface.vertices, surface.faces), surface.faces} {}

  certify::Parametrization run() {
    check_options();
    const mesh::EdgeFlags seams = mesh::flag_edges(surface_.faces, adjacency_, options_.cuts);
    lap("seconds_validate");
    uncuttable_ = flags_of(surface_, options_.uncuttable);
    make_charts(seams);
    lap("seconds_flatten");
    const PlacedCharts placed = place();
    const Grace finishing(context_);
    certify::Parametrization map =
        map_of_charts(surface_, mesh::flagged_edges(surface_.faces, adjacency_, islands_.cut),
                      islands_.charts, placed.uv, placed.stored);
    lap("seconds_place");
    judge(map);
    return map;
  }

 private:
  void lap(const char* name) {
    stats_[name] = watch_.seconds();
    watch_.restart();
  }

  void check_options() {
    stats_["time_limit_reached"] = std::int64_t{0};
    if (options_.place_like) require_corners(surface_, *options_.place_like);
    if (options_.seams.find && !options_.pins.empty()) {
      throw_invalid(ErrorCode::kBadPins,
                    "Seams cannot be found where there are pins, whose place would be on both "
                    "sides of a seam. Leave the pins out, or give the seams.");
    }
  }

  // Where seams are found, charts come with their maps.
  void make_charts(const mesh::EdgeFlags& seams) {
    context_.report("cutting into charts", 0.02);
    const TimeLimit limit(context_, seconds_to_search(context_.seconds_left(),
                                                      static_cast<Index>(surface_.faces.rows())));
    if (options_.seams.find) {
      const ProgressRange range(context_, 0.05, 0.92);
      AutoIslands found =
          find_islands(working_, surface_, seams, uncuttable_, options_, context_, stats_);
      uv_ = std::move(found.uv);
      islands_ = std::move(found.islands);
      lap("seconds_islands");
    } else {
      {
        const ProgressRange range(context_, 0.02, 0.05);
        islands_ = make_islands(working_, seams, uncuttable_, context_,
                                {.pinned = pinned_vertices(surface_, options_.pins)});
        if (options_.cut_extremities && options_.pins.empty())
          slit_to_extremities(islands_, working_, uncuttable_, context_);
      }
      lap("seconds_islands");
      const ProgressRange range(context_, 0.05, 0.92);
      uv_ = flatten_islands(islands_, working_, uncuttable_, pins_by_chart(islands_, options_.pins),
                            options_, context_, stats_);
    }
    pins_ = pins_by_chart(islands_, options_.pins);
    stats_["opened_charts"] = static_cast<std::int64_t>(islands_.opened);
  }

  // Charts that cannot be stored are halved, and again.
  PlacedCharts place() {
    const Grace storing(context_, Grace::kShort);
    context_.report("placing charts", 0.92);
    constexpr int kRounds = 12;  // by then 4096 parts are made
    Unstorable unstorable;
    for (int round = 0;; ++round) {
      try {
        return place_and_round(unstorable);
      } catch (const NotConverged&) {
        if (!options_.bijective || !options_.may_add_cuts || round == kRounds ||
            !cut_unstorable(unstorable))
          throw;
        pins_ = pins_by_chart(islands_, options_.pins);
      }
    }
  }

  // Charts with pins stay; the others are put where there is room.
  PlacedCharts place_and_round(Unstorable& unstorable) {
    PlacingOptions placing;
    placing.margin = options_.margin;
    placing.scale_true = true;
    placing.place_like = options_.place_like;
    placing.effort = options_.effort;
    std::vector<char> moved;
    std::vector<KeptAsStored> kept;
    for (const auto& own : pins_) {
      moved.push_back(own.empty());
      KeptAsStored& chart = kept.emplace_back(KeptAsStored{options_.bijective, {}});
      for (const auto& [v, target] : own) chart.fixed.push_back(v);
    }
    const auto round = [&](const std::vector<Points2>& placed) {
      StoredCharts stored = store_charts(islands_.charts, placed, kept, context_);
      unstorable = std::move(stored.unstorable);
      for (auto& [c, error] : unstorable) error = in_terms_of_input(std::move(error), islands_, c);
      if (!unstorable.empty()) throw NotConverged(unstorable.front().second);
      stats_["rounding.repaired"] = stored.repaired;
      return std::move(stored.uv);
    };
    unstorable.clear();
    const ProgressRange range(context_, 0.92, 0.95);
    PlacedCharts placed =
        place_charts(islands_.charts, uv_, moved, placing, {}, Points2(0, 2), round, context_);
    report(placed, stats_);
    return placed;
  }

  // The same maps, on charts halved. False if there is nothing to cut.
  bool cut_unstorable(const Unstorable& unstorable) {
    mesh::EdgeFlags further(adjacency_.opposite.size(), 0);
    for (const auto& [c, error] : unstorable) {
      const mesh::Chart& chart = islands_.charts[c];
      if (!pins_[c].empty()) return false;
      const mesh::EdgeFlags spared = part_of(chart, uncuttable_);
      mesh::EdgeFlags own;
      for (const bool thin_alone : {false, true}) {
        if (!any_flag(own)) own = halving_cut(chart.surface, uv_[c], spared, thin_alone, context_);
      }
      put_part(chart, own, further);
    }
    if (!any_flag(further)) return false;
    Points2 corners(surface_.faces.size(), 2);
    for (std::size_t c = 0; c < islands_.charts.size(); ++c)
      put_corners(islands_.charts[c], uv_[c], corners);
    cut_further(islands_, surface_, further);
    uv_.clear();
    for (const mesh::Chart& chart : islands_.charts) uv_.push_back(by_vertex(chart, corners));
    return true;
  }

  void judge(certify::Parametrization& map) {
    context_.report("certifying", 0.95);
    const certify::CertifyRequest request = request_of(options_);
    certify::certify_map(map, surface_, request, context_);
    if (!map.certificate.ok) {
      // Turning and scaling can fold what is thinner than doubles resolve; the stored values were
      // rounded with care. Where there are pins, these are met in 64 bits.
      for (std::size_t c = 0; c < islands_.charts.size(); ++c) {
        if (!pins_[c].empty()) continue;
        for (const FaceId f : islands_.charts[c].faces)
          map.uv.middleRows(3 * f, 3) = map.uv32.middleRows(3 * f, 3).cast<double>();
      }
      certify::certify_map(map, surface_, request, context_);
    }
    lap("seconds_certify");
    stats_["charts"] = static_cast<std::int64_t>(islands_.charts.size());
    stats_["added_cuts"] =
        static_cast<std::int64_t>(std::count(islands_.added.begin(), islands_.added.end(), 1) / 2);
    stats_["energy"] = map.certificate.energy;
    stats_["max_energy"] = map.certificate.max_energy;
    stats_["added_vertices"] = std::int64_t{0};
    stats_["seconds"] = total_.seconds();
    map.stats.insert(stats_.begin(), stats_.end());
    certify::require_certificate(map, "The unwrap");
    context_.report("done", 1.0);
  }

  const mesh::Surface& surface_;
  const UnwrapOptions& options_;
  ExecutionContext& context_;
  Stopwatch total_;
  Stopwatch watch_;
  Stats stats_;
  const mesh::Adjacency& adjacency_;
  const mesh::Surface working_;  // in a unit of its own
  mesh::EdgeFlags uncuttable_;   // empty: none
  Islands islands_;
  ChartPins pins_;
  std::vector<Points2> uv_;  // by chart
};

// A mesh that is no clean surface by way of one (mesh/separated).
certify::Parametrization unwrap_any(const mesh::Surface& surface, const UnwrapOptions& options,
                                    ExecutionContext& context) {
  if (certify::is_clean(surface, context)) return Unwrapping(surface, options, context).run();
  const certify::SeparatedMap separated(surface, separating(options), context);
  UnwrapOptions own = on_separated(separated, options);
  if (options.place_like) {
    require_corners(surface, *options.place_like);
    own.place_like = separated.corners(*options.place_like);
  }
  const certify::Parametrization solved =
      separated.solve([&] { return Unwrapping(separated.surface(), own, context).run(); });
  const Grace finishing(context);
  certify::Parametrization map = separated.on_input(solved, request_of(options), context);
  map.stats["energy"] = map.certificate.energy;
  map.stats["max_energy"] = map.certificate.max_energy;
  certify::require_certificate(map, "The unwrap");
  return map;
}

}  // namespace

certify::Parametrization unwrap(const mesh::Surface& surface, const UnwrapOptions& options,
                                ExecutionContext& context) {
  return in_time(context, options.max_seconds, "Not all charts were flattened and stored",
                 "or unwrap the mesh in parts", [&] {
                   context.report("checking the mesh", 0.0);
                   certify::Parametrization map = unwrap_any(surface, options, context);
                   if (options.uncuttable.rows() == 0 && options.polygon.empty()) return map;
                   // Polygons that no cut could go around become islands: a map that is cut through
                   // them could not be written.
                   UnwrapOptions own = options;
                   if (own.polygon.empty())
                     own.polygon = mesh::polygons_of(surface.faces,
                                                     static_cast<Index>(surface.vertices.rows()),
                                                     options.uncuttable);
                   for (int round = 0; round < kMostTimesTorn; ++round) {
                     const IndexPairs sides =
                         mesh::sides_of_torn_polygons(surface.faces, own.polygon, map.uv32);
                     if (sides.rows() == 0) break;
                     const Eigen::Index before = own.cuts.rows();
                     own.cuts.conservativeResize(before + sides.rows(), 2);
                     own.cuts.bottomRows(sides.rows()) = sides;
                     map = unwrap_any(surface, own, context);
                   }
                   return map;
                 });
}

}  // namespace flipfree::unwrap
