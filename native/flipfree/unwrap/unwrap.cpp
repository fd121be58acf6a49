#include "flipfree/unwrap/unwrap.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/unwrap/islands/corners.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/mesh/separated/orientation.h"
#include "flipfree/unwrap/chart/flattening.h"
#include "flipfree/unwrap/chart/separate.h"
#include "flipfree/unwrap/islands/edge_costs.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/place.h"
#include "flipfree/unwrap/seams/auto_islands.h"

namespace flipfree::unwrap {
namespace {

// Once as a rule: what becomes an island may open a way for a cut through its neighbour.
constexpr int kMostTimesTorn = 3;

// Charts with pins stay; the others are put where there is room.
PlacedCharts place_and_round(const Islands& islands, const ChartPins& pins,
                             const UnwrapOptions& options, std::vector<Points2> uv,
                             Unstorable& unstorable, ExecutionContext& context, Stats& stats) {
  std::vector<char> moved;
  for (const auto& own : pins.of_chart) moved.push_back(own.empty());
  PlacingOptions placing;
  placing.margin = options.margin;
  placing.scale_true = true;
  placing.place_like = options.place_like;
  std::vector<KeptAsStored> kept;
  for (const auto& own : pins.of_chart) {
    KeptAsStored& chart = kept.emplace_back(KeptAsStored{options.bijective, {}});
    for (const auto& [v, target] : own) chart.fixed.push_back(v);
  }
  const auto round = [&](const std::vector<Points2>& placed) {
    std::int64_t repaired = 0;
    auto stored = store_charts(islands.charts, placed, kept, unstorable, repaired, context);
    for (auto& [c, error] : unstorable) error = in_terms_of_input(std::move(error), islands, c);
    if (!unstorable.empty()) throw NotConverged(unstorable.front().second);
    stats["rounding.repaired"] = repaired;
    return stored;
  };
  placing.effort = options.effort;
  const ProgressRange range(context, 0.92, 0.95);
  PlacedCharts placed = place_charts(islands.charts, std::move(uv), moved, placing, round, context);
  stats["fill"] = placed.fill;
  stats["margin_met"] = static_cast<std::int64_t>(placed.margin_met);
  stats["kept_places"] = static_cast<std::int64_t>(placed.kept);
  stats["tile"] = static_cast<std::int64_t>(placed.tile);
  stats["enlarged_islands"] = static_cast<std::int64_t>(placed.enlarged);
  return placed;
}

// The same maps, on charts halved that cannot be stored. False if there is nothing to cut.
bool cut_unstorable(Islands& islands, const Unstorable& unstorable, const ChartPins& pins,
                    const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                    const mesh::EdgeFlags& uncuttable, std::vector<Points2>& uv,
                    ExecutionContext& context) {
  mesh::EdgeFlags further(adjacency.opposite.size(), 0);
  for (const auto& [c, error] : unstorable) {
    const mesh::Chart& chart = islands.charts[c];
    if (!pins.of_chart[c].empty()) return false;
    const mesh::Adjacency own_adjacency = adjacency_of(chart.surface);
    const mesh::EdgeFlags spared = part_of(chart, uncuttable);
    mesh::EdgeFlags own = halving_cut(chart.surface, own_adjacency, uv[c], spared, false, context);
    if (!any_flag(own))
      own = halving_cut(chart.surface, own_adjacency, uv[c], spared, true, context);
    for (std::size_t h = 0; h < own.size(); ++h) further[corner_of(chart, h)] = own[h];
  }
  if (!any_flag(further)) return false;
  Points2 corners(surface.faces.size(), 2);
  for (std::size_t c = 0; c < islands.charts.size(); ++c)
    put_corners(islands.charts[c], uv[c], corners);
  cut_further(islands, surface, adjacency, further);
  uv.clear();
  for (const mesh::Chart& chart : islands.charts) uv.push_back(by_vertex(chart, corners));
  return true;
}

// The stored values of charts without pins, also as those in 64 bits.
void use_stored_values(const Islands& islands, const ChartPins& pins,
                       certify::Parametrization& map) {
  for (std::size_t c = 0; c < islands.charts.size(); ++c) {
    if (!pins.of_chart[c].empty()) continue;
    for (const FaceId f : islands.charts[c].faces)
      map.uv.middleRows(3 * f, 3) = map.uv32.middleRows(3 * f, 3).cast<double>();
  }
}

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

certify::Parametrization unwrap_clean(const mesh::Surface& surface, const UnwrapOptions& options,
                                      ExecutionContext& context) {
  Stopwatch total;
  Stopwatch watch;
  certify::Parametrization map;
  Stats& stats = map.stats;
  stats["time_limit_reached"] = std::int64_t{0};
  const auto lap = [&](const char* name) {
    stats[name] = watch.seconds();
    watch.restart();
  };
  if (options.place_like != nullptr) require_corners(surface, *options.place_like);
  if (options.seams.find && !options.pins.empty()) {
    throw_invalid(ErrorCode::kBadPins,
                  "Seams cannot be found where there are pins, whose place would be on both sides "
                  "of a seam. Leave the pins out, or give the seams.");
  }
  const mesh::Adjacency adjacency = adjacency_of(surface);
  const mesh::EdgeFlags seams = mesh::flag_edges(surface.faces, adjacency, options.cuts);
  lap("seconds_validate");

  context.report("cutting into charts", 0.02);
  const mesh::Surface working{normalised(surface.vertices, surface.faces), surface.faces};
  const mesh::EdgeFlags uncuttable =
      options.uncuttable.rows() == 0
          ? mesh::EdgeFlags{}
          : mesh::flag_edges(surface.faces, adjacency, options.uncuttable);
  std::vector<Points2> uv;
  Islands islands = [&] {
    if (options.seams.find) {
      const ProgressRange range(context, 0.05, 0.92);
      const TimeLimit limit(context, seconds_to_search(context.seconds_left(),
                                                       static_cast<Index>(surface.faces.rows())));
      AutoIslands found = find_islands(working, surface.vertices, adjacency, seams, uncuttable,
                                       options, context, stats);
      uv = std::move(found.uv);
      return std::move(found.islands);
    }
    const ProgressRange range(context, 0.02, 0.05);
    return make_islands(working, adjacency, seams, uncuttable,
                        options.cut_extremities && options.pins.empty(), context,
                        {pinned_vertices(surface, options.pins), {}, true});
  }();
  ChartPins pins = pins_by_chart(islands, options.pins);
  stats["opened_charts"] = static_cast<std::int64_t>(islands.opened);
  lap("seconds_islands");

  if (!options.seams.find) {
    const ProgressRange range(context, 0.05, 0.92);
    const TimeLimit limit(context, seconds_to_search(context.seconds_left(),
                                                     static_cast<Index>(surface.faces.rows())));
    uv = flatten_islands(islands, working, adjacency, uncuttable, pins, options, context, stats);
  }
  pins = pins_by_chart(islands, options.pins);
  lap("seconds_flatten");

  const PlacedCharts placed = [&] {
    const Overtime storing(context);
    context.report("placing charts", 0.92);
    constexpr int kRounds = 12;  // of cuts: by then 4096 parts are made
    Unstorable unstorable;
    for (int round = 0;; ++round) {
      unstorable.clear();
      try {
        return place_and_round(islands, pins, options, uv, unstorable, context, stats);
      } catch (const NotConverged&) {
        if (!options.bijective || !options.may_add_cuts || round == kRounds ||
            !cut_unstorable(islands, unstorable, pins, surface, adjacency, uncuttable, uv,
                            context)) {
          throw;
        }
        pins = pins_by_chart(islands, options.pins);
      }
    }
  }();
  stats["charts"] = static_cast<std::int64_t>(islands.charts.size());
  stats["added_cuts"] =
      static_cast<std::int64_t>(std::count(islands.added.begin(), islands.added.end(), 1) / 2);
  const Untimed finishing(context);
  map.surface = surface;
  map.uv.resize(3 * surface.faces.rows(), 2);
  map.uv32.resize(3 * surface.faces.rows(), 2);
  for (std::size_t c = 0; c < islands.charts.size(); ++c) {
    put_corners(islands.charts[c], placed.uv[c], map.uv);
    put_corners(islands.charts[c], placed.stored[c], map.uv32);
  }
  lap("seconds_place");

  context.report("certifying", 0.95);
  certify::set_identity_provenance(map);
  map.cut_edges = mesh::flagged_edges(surface.faces, adjacency, islands.cut);
  const certify::CertifyRequest request = request_of(options);
  certify::certify_map(map, surface, request, context);
  if (!map.certificate.ok) {
    // Turning and scaling can fold what is thinner than doubles resolve; the stored values were
    // rounded with care.
    use_stored_values(islands, pins, map);
    certify::certify_map(map, surface, request, context);
  }
  lap("seconds_certify");
  stats["energy"] = map.certificate.energy;
  stats["max_energy"] = map.certificate.max_energy;
  stats["added_vertices"] = std::int64_t{0};
  stats["seconds"] = total.seconds();
  certify::require_certificate(map, "The unwrap");
  context.report("done", 1.0);
  return map;
}

// A mesh that is no clean surface: by way of one (mesh/separated).
certify::Parametrization unwrap_separated(const mesh::Surface& surface,
                                          const UnwrapOptions& options, ExecutionContext& context) {
  const certify::SeparatedMap separated(surface, separating(options), context);
  UnwrapOptions own = on_separated(separated, options);
  Points2 places;
  if (options.place_like != nullptr) {
    require_corners(surface, *options.place_like);
    places = separated.corners(*options.place_like);
    own.place_like = &places;
  }
  const certify::Parametrization solved =
      separated.solve([&] { return unwrap_clean(separated.surface(), own, context); });
  const Untimed finishing(context);
  certify::Parametrization map = separated.on_input(solved, request_of(options), context);
  map.stats["energy"] = map.certificate.energy;
  map.stats["max_energy"] = map.certificate.max_energy;
  certify::require_certificate(map, "The unwrap");
  return map;
}

certify::Parametrization unwrap_any(const mesh::Surface& surface, const UnwrapOptions& options,
                                    ExecutionContext& context) {
  return certify::is_clean(surface, context) ? unwrap_clean(surface, options, context)
                                             : unwrap_separated(surface, options, context);
}

}  // namespace

certify::Parametrization unwrap(const mesh::Surface& surface, const UnwrapOptions& options,
                                ExecutionContext& context) try {
  const TimeLimit limit(context, limit_of(options.max_seconds));
  context.report("checking the mesh", 0.0);
  certify::Parametrization map = unwrap_any(surface, options, context);
  if (options.uncuttable.rows() == 0 && options.polygon.empty()) return map;
  // Polygons that no cut could go around become islands: a map that is cut through them could not
  // be written.
  UnwrapOptions own = options;
  if (own.polygon.empty())
    own.polygon = mesh::polygons_of(surface.faces, static_cast<Index>(surface.vertices.rows()),
                                    options.uncuttable);
  for (int round = 0; round < kMostTimesTorn; ++round) {
    const IndexPairs sides = mesh::sides_of_torn_polygons(surface.faces, own.polygon, map.uv32);
    if (sides.rows() == 0) break;
    const Eigen::Index before = own.cuts.rows();
    own.cuts.conservativeResize(before + sides.rows(), 2);
    own.cuts.bottomRows(sides.rows()) = sides;
    map = unwrap_any(surface, own, context);
  }
  return map;
} catch (const TimeIsOver&) {
  if (!(options.max_seconds > 0)) throw;  // the limit is the caller's
  throw_out_of_time("Not all charts were flattened and stored", options.max_seconds,
                    "or unwrap the mesh in parts");
}

}  // namespace flipfree::unwrap
