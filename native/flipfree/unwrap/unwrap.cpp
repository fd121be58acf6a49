#include "flipfree/unwrap/unwrap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/unwrap/chart.h"
#include "flipfree/unwrap/islands.h"
#include "flipfree/unwrap/place.h"

namespace flipfree {
namespace {

// Positions scaled by one power of two, which is exact, so that squares neither overflow nor vanish
// whatever the user's unit is; every component is moved to the origin on its own, so that none of
// them is lost beside one that is large or far away.
Points3 normalised(const Points3& positions, const Triangles& faces) {
  const auto count = static_cast<std::size_t>(positions.rows());
  DisjointSets components(static_cast<Index>(count));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    components.join(faces(f, 0), faces(f, 1));
    components.join(faces(f, 1), faces(f, 2));
  }
  const Vector3 infinite = Vector3::Constant(std::numeric_limits<double>::infinity());
  std::vector<Vector3> low(count, infinite);
  std::vector<Vector3> high(count, -infinite);
  for (const VertexId v : faces.reshaped()) {
    const auto c = static_cast<std::size_t>(components.find(v));
    low[c] = low[c].cwiseMin(positions.row(v).transpose());
    high[c] = high[c].cwiseMax(positions.row(v).transpose());
  }
  double size = 0.0;
  for (std::size_t c = 0; c < count; ++c) {
    // Halves first: the difference of two huge coordinates may not be finite.
    if (low[c].x() <= high[c].x()) size = std::max(size, (0.5 * high[c] - 0.5 * low[c]).maxCoeff());
  }
  int exponent = 0;
  std::frexp(size, &exponent);
  Points3 result = positions;
  for (VertexId v = 0; v < static_cast<VertexId>(count); ++v) {
    const auto c = static_cast<std::size_t>(components.find(v));
    if (low[c].x() <= high[c].x()) result.row(v) -= (0.5 * low[c] + 0.5 * high[c]).transpose();
  }
  for (double& x : result.reshaped()) x = std::ldexp(x, -exponent);
  return result;
}

// Flags of the vertices that have a pinned corner; empty without pins.
std::vector<char> pinned_vertices(const Surface& surface, const std::vector<CornerPin>& pins) {
  if (pins.empty()) return {};
  std::vector<char> pinned(static_cast<std::size_t>(surface.vertices.rows()), 0);
  for (const CornerPin& pin : pins) {
    if (pin.corner >= 0 && pin.corner < surface.faces.size())
      pinned[static_cast<std::size_t>(surface.faces(pin.corner / 3, pin.corner % 3))] = 1;
  }
  return pinned;
}

struct ChartPins {
  std::vector<std::vector<std::pair<VertexId, Vector2>>> of_chart;  // chart vertices
};

// Added cuts avoid pinned vertices; where they could not, one vertex has two places in its chart,
// and its pin would have to be met by both.
void refuse_pins_on_added_cuts(const Islands& islands, const ChartPins& pins) {
  const Triangles& faces = islands.mesh.faces;
  std::vector<char> on_added(islands.mesh.vertex_origin.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(islands.added.size()); ++h) {
    if (islands.added[static_cast<std::size_t>(h)] == 0) continue;
    on_added[static_cast<std::size_t>(source(faces, h))] = 1;
    on_added[static_cast<std::size_t>(target(faces, h))] = 1;
  }
  for (std::size_t c = 0; c < pins.of_chart.size(); ++c) {
    std::map<VertexId, Vector2> known;
    for (const auto& [local, uv] : pins.of_chart[c]) {
      const VertexId v = islands.charts[c].vertices[static_cast<std::size_t>(local)];
      const VertexId origin = islands.mesh.vertex_origin[static_cast<std::size_t>(v)];
      const auto [it, fresh] = known.emplace(origin, uv);
      if (fresh || it->second != uv || on_added[static_cast<std::size_t>(v)] == 0) continue;
      throw_not_converged(
          ErrorCode::kBadPins,
          "The island of vertex " + std::to_string(origin) +
              " had to be cut open, and every way that was found runs through this pinned vertex, "
              "which has two places then. Mark seams that open the island elsewhere, or unpin "
              "some vertices.",
          ElementKind::kVertex, {origin});
    }
  }
}

// Corner pins as pins of chart vertices; corners that share a chart vertex must agree.
ChartPins pins_by_chart(const Islands& islands, const std::vector<CornerPin>& pins) {
  ChartPins result;
  result.of_chart.resize(islands.charts.size());
  if (pins.empty()) return result;
  const std::size_t cut_vertices = islands.mesh.vertex_origin.size();
  std::vector<std::pair<std::size_t, VertexId>> place(cut_vertices);
  for (std::size_t c = 0; c < islands.charts.size(); ++c) {
    for (std::size_t i = 0; i < islands.charts[c].vertices.size(); ++i) {
      place[static_cast<std::size_t>(islands.charts[c].vertices[i])] = {c,
                                                                        static_cast<VertexId>(i)};
    }
  }
  std::vector<std::optional<Vector2>> target(cut_vertices);
  for (const CornerPin& pin : pins) {
    if (pin.corner < 0 || pin.corner >= 3 * islands.mesh.faces.rows() || !pin.uv.allFinite()) {
      throw_invalid(ErrorCode::kBadPins,
                    "A pin names corner " + std::to_string(pin.corner) +
                        ", which does not exist, or a place that is not finite. Correct the pin.",
                    ElementKind::kCorner, {pin.corner});
    }
    const auto v = static_cast<std::size_t>(islands.mesh.faces(pin.corner / 3, pin.corner % 3));
    if (target[v]) {
      if (*target[v] == pin.uv) continue;
      const VertexId origin = islands.mesh.vertex_origin[v];
      throw_invalid(ErrorCode::kBadPins,
                    "Vertex " + std::to_string(origin) +
                        " is pinned to two different places within one chart. Mark a seam between "
                        "them or unpin one.",
                    ElementKind::kVertex, {origin});
    }
    target[v] = pin.uv;
    const auto [chart, local] = place[v];
    result.of_chart[chart].emplace_back(local, pin.uv);
  }
  refuse_pins_on_added_cuts(islands, result);
  return result;
}

// An error about chart `c`, with elements of the user's mesh instead of the chart's own.
Error in_terms_of_input(Error error, const Islands& islands, std::size_t c) {
  const Chart& chart = islands.charts[c];
  const auto origin = [&](VertexId v) {
    return islands.mesh
        .vertex_origin[static_cast<std::size_t>(chart.vertices[static_cast<std::size_t>(v)])];
  };
  // Some are of the surface with its holes filled, which nobody else knows.
  const Index limit = error.kind == ElementKind::kFace ? static_cast<Index>(chart.faces.size())
                                                       : static_cast<Index>(chart.vertices.size());
  if (std::any_of(error.elements.begin(), error.elements.end(),
                  [&](Index i) { return i < 0 || i >= limit; }))
    error.elements.clear();
  std::string place;
  if (error.elements.empty()) error.kind = ElementKind::kNone;
  if (error.kind == ElementKind::kVertex || error.kind == ElementKind::kEdge) {
    for (Index& v : error.elements) v = origin(v);
    if (!error.elements.empty())
      place = ", first at vertex " + std::to_string(error.elements.front());
  } else if (error.kind == ElementKind::kFace && !error.elements.empty()) {
    for (Index& f : error.elements) f = chart.faces[static_cast<std::size_t>(f)];
    place = ", first at face " + std::to_string(error.elements.front());
  } else {
    const std::size_t shown = std::min<std::size_t>(1000, chart.faces.size());
    error.kind = ElementKind::kFace;
    error.elements.assign(chart.faces.begin(),
                          chart.faces.begin() + static_cast<std::ptrdiff_t>(shown));
  }
  error.message = "Chart of face " + std::to_string(chart.faces.front()) + " (" +
                  std::to_string(chart.faces.size()) + " triangles" + place + "): " + error.message;
  return error;
}

// Calls solve(chart, context, stats) for every chart and keeps the stats of the largest. One that
// holds half of all faces gets all threads; the others share them, one chart each.
template <typename Solve>
void for_charts(const Islands& islands, ExecutionContext& context, Stats& stats, Solve solve) {
  const std::vector<Chart>& charts = islands.charts;
  std::vector<Stats> chart_stats(charts.size());
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return charts[a].faces.size() > charts[b].faces.size();
  });
  std::size_t total = 0;
  for (const Chart& chart : charts) total += chart.faces.size();
  const auto share_of = [&](std::size_t c) {
    return static_cast<double>(charts[c].faces.size()) / static_cast<double>(total);
  };

  const auto solve_one = [&](std::size_t c, ExecutionContext& chart_context) {
    try {
      solve(c, chart_context, chart_stats[c]);
    } catch (const Cancelled&) {
      throw;
    } catch (const Infeasible& e) {
      throw Infeasible(in_terms_of_input(e.error(), islands, c));
    } catch (const InvalidInput& e) {
      throw InvalidInput(in_terms_of_input(e.error(), islands, c));
    } catch (const NotConverged& e) {
      throw NotConverged(in_terms_of_input(e.error(), islands, c));
    }
  };

  std::size_t first_small = 0;
  double done = 0.0;
  if (charts.size() == 1 || 2 * charts[order[0]].faces.size() >= total) {
    done = share_of(order[0]);
    const ProgressRange range(context, 0.0, done);
    solve_one(order[0], context);
    first_small = 1;
  }
  SharedProgress progress(context, done);
  parallel_for(context, order.size() - first_small, 1,
               [&](std::size_t begin, std::size_t, std::size_t) {
                 const std::size_t c = order[first_small + begin];
                 ExecutionContext part(&context, 1, &progress, share_of(c));
                 solve_one(c, part);
                 const Untimed done_with(part);
                 part.report("flattening charts", 1.0);
               });
  if (!order.empty()) stats.insert(chart_stats[order[0]].begin(), chart_stats[order[0]].end());
  if (std::any_of(chart_stats.begin(), chart_stats.end(),
                  [](const Stats& s) { return s.contains("time_limit_reached"); }))
    stats["time_limit_reached"] = std::int64_t{1};
}

// Rounds of cutting: pieces that may still overlap a little are looked at again, in the last round
// none may.
constexpr int kCuttingRounds = 3;

// Every chart onto the plane, cut further where that is the way to keep it from overlapping itself:
// then `islands` are those that result. Per chart #V x 2.
class Flattening {
 public:
  Flattening(Islands& islands, const Surface& surface, const Adjacency& adjacency,
             const EdgeFlags& uncuttable, const ChartPins& pins, const UnwrapOptions& options,
             bool acceptable)
      : islands_(islands),
        surface_(surface),
        adjacency_(adjacency),
        uncuttable_(uncuttable),
        pins_(pins),
        options_(options),
        acceptable_(acceptable),
        uv_(3 * surface.faces.rows(), 2),
        apart_(3 * surface.faces.rows(), 2),
        divided_(static_cast<std::size_t>(surface.faces.rows()), 1) {}

  std::vector<Points2> run(ExecutionContext& context, Stats& stats) {
    const auto added = [&] { return std::count(islands_.added.begin(), islands_.added.end(), 1); };
    const auto before = added();
    constexpr double kFirstShare = 0.7;
    double end = kFirstShare;
    double begin = 0.0;
    bool cut = true;
    for (int round = 0; cut; ++round) {
      const ProgressRange range(context, begin, end);
      begin = end;
      end += 0.5 * (1.0 - end);
      cut = flatten(round, context, stats);
    }
    stats["overlap_cuts"] = static_cast<std::int64_t>((added() - before) / 2);
    std::vector<Points2> uv;
    for (const Chart& chart : islands_.charts) uv.push_back(part(chart, uv_));
    return uv;
  }

 private:
  // Flattens the charts of `divided_` faces; true if some of them have to be cut, which is done.
  bool flatten(int round, ExecutionContext& context, Stats& stats) {
    std::vector<FlatChart> flat(islands_.charts.size());
    for_charts(islands_, context, stats,
               [&](std::size_t c, ExecutionContext& chart_context, Stats& chart_stats) {
                 const Chart& chart = islands_.charts[c];
                 if (divided_[static_cast<std::size_t>(chart.faces.front())] == 0) return;
                 FlattenOptions flatten = options_of(c, round);
                 const InOwnUnit own(chart.surface);
                 flat[c] = round == 0
                               ? flatten_chart(own.surface(), flatten, chart_context, chart_stats)
                               : flatten_piece(own.surface(), part(chart, uv_) / own.unit(),
                                               part(chart, apart_) / own.unit(), flatten,
                                               chart_context, chart_stats);
                 if (!flatten.pins.empty()) return;  // pins have a unit of their own
                 flat[c].uv *= own.unit();
                 flat[c].apart *= own.unit();
               });
    EdgeFlags further(adjacency_.opposite.size(), 0);
    std::fill(divided_.begin(), divided_.end(), 0);
    bool cut = false;
    for (std::size_t c = 0; c < flat.size(); ++c) {
      if (flat[c].uv.rows() == 0) continue;
      const Chart& chart = islands_.charts[c];
      for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h) {
        const std::size_t corner = in_surface(chart, h);
        const VertexId v = chart.surface.faces.data()[h];
        uv_.row(static_cast<Eigen::Index>(corner)) = flat[c].uv.row(v);
        if (flat[c].cut.empty()) continue;
        cut = true;
        apart_.row(static_cast<Eigen::Index>(corner)) = flat[c].apart.row(v);
        further[corner] = flat[c].cut[h];
        divided_[corner / 3] = 1;
      }
    }
    if (cut) cut_further(islands_, surface_, adjacency_, further);
    return cut;
  }

  FlattenOptions options_of(std::size_t c, int round) const {
    FlattenOptions flatten;
    flatten.bijective = options_.bijective;
    flatten.max_iterations = options_.max_iterations;
    flatten.tolerance = options_.tolerance;
    flatten.acceptable = acceptable_;
    if (round == 0) flatten.pins = pins_.of_chart[c];
    flatten.may_add_cuts = options_.bijective && options_.may_add_cuts && flatten.pins.empty();
    if (round + 1 >= kCuttingRounds) flatten.tolerated_overlap = 0.0;
    if (flatten.may_add_cuts && !uncuttable_.empty()) {
      const Chart& chart = islands_.charts[c];
      for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h)
        flatten.uncuttable.push_back(uncuttable_[in_surface(chart, h)]);
    }
    return flatten;
  }

  static std::size_t in_surface(const Chart& chart, std::size_t halfedge) {
    return 3 * static_cast<std::size_t>(chart.faces[halfedge / 3]) + halfedge % 3;
  }

  static Points2 part(const Chart& chart, const Points2& corners) {
    Points2 uv(chart.surface.vertices.rows(), 2);
    for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h)
      uv.row(chart.surface.faces.data()[h]) =
          corners.row(static_cast<Eigen::Index>(in_surface(chart, h)));
    return uv;
  }

  Islands& islands_;
  const Surface& surface_;
  const Adjacency& adjacency_;
  const EdgeFlags& uncuttable_;
  const ChartPins& pins_;
  const UnwrapOptions& options_;
  bool acceptable_;
  Points2 uv_;                 // per corner of the surface
  Points2 apart_;              // the same of the maps without overlap of charts that were cut
  std::vector<char> divided_;  // per face: its chart is to be flattened next
};

// The values to be stored, chart by chart.
std::vector<Points2f> round_all(const Islands& islands, const ChartPins& pins, bool bijective,
                                const std::vector<Points2>& uv, ExecutionContext& context,
                                Stats& stats) {
  const std::size_t count = islands.charts.size();
  std::vector<Points2f> stored(count);
  std::vector<Stats> chart_stats(count);
  parallel_for(context, count, 1, [&](std::size_t c, std::size_t, std::size_t) {
    ExecutionContext part(&context, 1);
    RoundingOptions rounding;
    rounding.bijective = bijective;
    for (const auto& [v, target] : pins.of_chart[c]) rounding.fixed.push_back(v);
    try {
      stored[c] =
          round_to_storage(islands.charts[c].surface.faces, uv[c], rounding, part, chart_stats[c]);
    } catch (const NotConverged& e) {
      throw NotConverged(in_terms_of_input(e.error(), islands, c));
    }
  });
  std::int64_t repaired = 0;
  for (const Stats& s : chart_stats) {
    const auto found = s.find("rounding.repaired");
    if (found != s.end()) repaired += std::get<std::int64_t>(found->second);
  }
  stats["rounding.repaired"] = repaired;
  return stored;
}

// Charts with pins stay; the others are put where there is room.
PlacedCharts place_and_round(const Islands& islands, const ChartPins& pins,
                             const UnwrapOptions& options, std::vector<Points2> uv,
                             ExecutionContext& context, Stats& stats) {
  std::vector<char> moved;
  for (const auto& own : pins.of_chart) moved.push_back(own.empty());
  PlacingOptions placing;
  placing.margin = options.margin;
  placing.scale_true = true;
  placing.place_like = options.place_like;
  const auto round = [&](const std::vector<Points2>& placed) {
    return round_all(islands, pins, options.bijective, placed, context, stats);
  };
  PlacedCharts placed = place_charts(islands.charts, std::move(uv), moved, placing, round);
  stats["kept_places"] = static_cast<std::int64_t>(placed.kept);
  stats["tile"] = static_cast<std::int64_t>(placed.tile);
  return placed;
}

// The stored values of charts without pins, also as those in 64 bits.
void use_stored_values(const Islands& islands, const ChartPins& pins, Parametrization& map) {
  for (std::size_t c = 0; c < islands.charts.size(); ++c) {
    if (!pins.of_chart[c].empty()) continue;
    for (const FaceId f : islands.charts[c].faces)
      map.uv.middleRows(3 * f, 3) = map.uv32.middleRows(3 * f, 3).cast<double>();
  }
}

// acceptable: maps may be taken as they are (ExecutionContext::accept).
Parametrization unwrap_in_time(const Surface& surface, const UnwrapOptions& options,
                               bool acceptable, ExecutionContext& context) {
  Stopwatch total;
  Stopwatch watch;
  Parametrization map;
  Stats& stats = map.stats;
  stats["time_limit_reached"] = std::int64_t{0};
  const auto lap = [&](const char* name) {
    stats[name] = watch.seconds();
    watch.restart();
  };
  context.report("checking the mesh", 0.0);
  validate(surface, {}, context);
  if (options.place_like != nullptr && options.place_like->rows() != 3 * surface.faces.rows()) {
    throw_invalid(ErrorCode::kBadShape, "The UVs to stay close to need one row per face corner.");
  }
  const Adjacency adjacency =
      build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const EdgeFlags seams = flag_edges(surface.faces, adjacency, options.cuts);
  lap("seconds_validate");

  context.report("cutting into charts", 0.02);
  const Surface working{normalised(surface.vertices, surface.faces), surface.faces};
  const EdgeFlags uncuttable = options.uncuttable.rows() == 0
                                   ? EdgeFlags{}
                                   : flag_edges(surface.faces, adjacency, options.uncuttable);
  Islands islands = [&] {
    const ProgressRange range(context, 0.02, 0.05);
    return make_islands(working, adjacency, seams, uncuttable,
                        options.cut_extremities && options.pins.empty(), context,
                        pinned_vertices(surface, options.pins));
  }();
  ChartPins pins = pins_by_chart(islands, options.pins);
  stats["opened_charts"] = static_cast<std::int64_t>(islands.opened);
  lap("seconds_islands");

  std::vector<Points2> uv;
  {
    const ProgressRange range(context, 0.05, 0.92);
    uv = Flattening(islands, working, adjacency, uncuttable, pins, options, acceptable)
             .run(context, stats);
  }
  pins = pins_by_chart(islands, options.pins);
  stats["charts"] = static_cast<std::int64_t>(islands.charts.size());
  stats["added_cuts"] =
      static_cast<std::int64_t>(std::count(islands.added.begin(), islands.added.end(), 1) / 2);
  lap("seconds_flatten");

  const Untimed finishing(context);
  context.report("placing charts", 0.92);
  const PlacedCharts placed =
      place_and_round(islands, pins, options, std::move(uv), context, stats);
  map.surface = surface;
  map.uv.resize(3 * surface.faces.rows(), 2);
  map.uv32.resize(3 * surface.faces.rows(), 2);
  for (std::size_t c = 0; c < islands.charts.size(); ++c) {
    const Chart& chart = islands.charts[c];
    for (std::size_t i = 0; i < chart.faces.size(); ++i) {
      for (Index k = 0; k < 3; ++k) {
        const VertexId v = chart.surface.faces(static_cast<Eigen::Index>(i), k);
        map.uv.row(3 * chart.faces[i] + k) = placed.uv[c].row(v);
        map.uv32.row(3 * chart.faces[i] + k) = placed.stored[c].row(v);
      }
    }
  }
  lap("seconds_place");

  context.report("certifying", 0.95);
  set_identity_provenance(map);
  map.cut_edges = flagged_edges(surface.faces, adjacency, islands.cut);
  CertifyRequest request;
  request.pins = options.pins;
  request.require_bijective = options.bijective;
  request.require_disjoint = options.pins.empty();  // charts with pins lie where the pins are
  certify_map(map, surface, request, context);
  if (!map.certificate.ok) {
    // Turning and scaling can fold what is thinner than doubles resolve; the stored values were
    // rounded with care.
    use_stored_values(islands, pins, map);
    certify_map(map, surface, request, context);
  }
  lap("seconds_certify");
  stats["energy"] = map.certificate.energy;
  stats["max_energy"] = map.certificate.max_energy;
  stats["added_vertices"] = std::int64_t{0};
  stats["seconds"] = total.seconds();
  require_certificate(map, "The unwrap");
  context.report("done", 1.0);
  return map;
}

}  // namespace

Parametrization unwrap(const Surface& surface, const UnwrapOptions& options,
                       ExecutionContext& context) try {
  const TimeLimit limit(context, limit_of(options.max_seconds));
  try {
    return unwrap_in_time(surface, options, true, context);
  } catch (const NotConverged&) {
    if (!context.accepted()) throw;
  }
  // What was accepted cannot be stored beside the other charts: as if nobody had asked.
  return unwrap_in_time(surface, options, false, context);
} catch (const TimeIsOver&) {
  if (!(options.max_seconds > 0)) throw;  // the limit is the caller's
  throw_out_of_time("Not all charts were flattened", options.max_seconds,
                    "or unwrap the mesh in parts");
}

}  // namespace flipfree
