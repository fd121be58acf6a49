#include "flipfree/unwrap/chart/chart.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/embedding/disk.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/mesh/decimated/decimated.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/unwrap/chart/separate.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::unwrap {

namespace {

// A flip-free start: holes filled virtually, the outer loop on a circle.
Points2 embed_on_circle(const mesh::Surface& chart, ExecutionContext& context, Stats& stats) {
  std::vector<std::vector<HalfedgeId>> loops =
      mesh::boundary_halfedge_loops(chart.faces, chart.adjacency());
  std::swap(loops[0], loops[longest_loop(chart, loops)]);
  const mesh::Surface filled = mesh::fill_holes(chart, {loops.begin() + 1, loops.end()});
  std::vector<VertexId> rim;
  std::vector<double> sides;
  for (const HalfedgeId h : loops[0]) {
    rim.push_back(mesh::source(chart.faces, h));
    sides.push_back(edge_length(chart, h));
  }
  const Points2 circle = embedding::place_boundary(embedding::BoundaryShape::kCircle, sides);
  // The optimiser starts from 64 bits; only its result is rounded.
  embedding::EmbedOptions options;
  options.float32 = false;
  try {
    return distortion::with_own_map([&] {
      const auto filled_count = static_cast<Index>(filled.vertices.rows());
      embedding::Embedding map =
          embedding::embed_disk({filled.faces, filled_count, rim, circle}, options, context);
      stats.merge(map.stats);
      return Points2(map.uv.topRows(chart.vertices.rows()));
    });
  } catch (const NotConverged& e) {
    // Its text counts vertices of the filled chart.
    throw_not_converged(e.error().code,
                        "The chart could not be laid into a circle (" +
                            std::string(describe(e.error().code)) +
                            "): it has very long and thin parts. Mark seams that cut these off.");
  }
}

double energy_of(const mesh::Surface& chart, const Points2& uv) {
  return certify::symmetric_dirichlet(chart, by_corner(chart.faces, uv)).mean;
}

// Each triangle with its own shape, joined to the one before it, breadth first: isometric but for
// rounding where the chart is developable, and torn out of shape where it is not, so that triangles
// may flip.
Points2 unfolded(const mesh::Surface& chart) {
  Points2 uv = Points2::Zero(chart.vertices.rows(), 2);
  std::vector<char> placed(at(chart.vertices.rows()), 0);
  // The third corner of the face of h, whose side there has its place.
  const auto place_third = [&](HalfedgeId h) {
    const VertexId third = mesh::source(chart.faces, previous_corner(h));
    if (std::exchange(placed[at(third)], 1) != 0) return;
    const auto [side, other] = mesh::sides_at(chart, h);
    const Vector2 a = uv.row(mesh::source(chart.faces, h));
    // On the unfolded side, however long that is by now: the direction counts.
    const Vector2 along = (uv.row(mesh::target(chart.faces, h)).transpose() - a).normalized();
    const double length = side.norm();
    uv.row(third) = a + along * (side.dot(other) / length) +
                    Vector2(-along.y(), along.x()) * (side.cross(other).norm() / length);
  };
  placed[at(chart.faces(0, 0))] = placed[at(chart.faces(0, 1))] = 1;
  uv(chart.faces(0, 1), 0) = mesh::sides_at(chart, 0).next.norm();
  place_third(0);
  mesh::for_each_face_across(
      chart.adjacency(), [](HalfedgeId, HalfedgeId) { return true; },
      [&](HalfedgeId, HalfedgeId beyond) { place_third(beyond); });
  return uv;
}

// The conformal map if it is flip-free and one-to-one, by exact test, and less distorted than the
// map on the circle; the optimiser then needs about half the iterations. A long strip bends so
// easily that rounding decides where its conformal map lies; unfolded it is flat.
Points2 better_start(const mesh::Surface& chart, Points2 circle, ExecutionContext& context) {
  context.report("conformal start", 0.0);
  const Points2 conformal = distortion::spectral_conformal_map(chart, circle, context);
  if (conformal.rows() == 0) return circle;
  const double most = energy_of(chart, circle);
  const auto usable = [&](const Points2& uv) {
    return uv.allFinite() && distortion::is_flip_free(chart.faces, uv, context) &&
           !overlaps_itself(chart.faces, uv, context);
  };
  if (usable(conformal)) return energy_of(chart, conformal) < most ? conformal : circle;
  Points2 flat = unfolded(chart);
  return usable(flat) && energy_of(chart, flat) < most ? flat : circle;
}

// A chart that does not overlap itself has no two vertices at one point; another one has no edge
// between them.
void reject_coincident_pins(const mesh::Surface& chart, bool bijective, const VertexPins& pins,
                            const ExecutionContext& context) {
  const auto refuse = [](const VertexPins::value_type& a, const VertexPins::value_type& b) {
    const Vector2& point = b.second;
    throw_infeasible(ErrorCode::kContradictoryPins,
                     "Two vertices of one chart are pinned to the same point (" +
                         std::to_string(point.x()) + ", " + std::to_string(point.y()) +
                         "). Unpin one of them or move its pin.",
                     {"same place", {{"place", {point.x(), point.y()}}}}, ElementKind::kVertex,
                     {a.first, b.first});
  };
  if (bijective) {
    VertexPins sorted = pins;
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
      return std::pair(a.second.x(), a.second.y()) < std::pair(b.second.x(), b.second.y());
    });
    const auto twice =
        std::adjacent_find(sorted.begin(), sorted.end(),
                           [](const auto& a, const auto& b) { return a.second == b.second; });
    if (twice != sorted.end()) refuse(*twice, *(twice + 1));
    return;
  }
  if (pins.empty()) return;
  std::vector<const VertexPins::value_type*> pin_of(at(chart.vertices.rows()), nullptr);
  for (const auto& pin : pins) pin_of[at(pin.first)] = &pin;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(chart.faces.size()); ++h) {
    if (h % 65536 == 0) context.check();
    const auto* a = pin_of[at(mesh::source(chart.faces, h))];
    const auto* b = pin_of[at(mesh::target(chart.faces, h))];
    if (a != nullptr && b != nullptr && a->second == b->second) refuse(*a, *b);
  }
}

distortion::MinimizeOptions minimize_options(const FlattenOptions& options) {
  distortion::MinimizeOptions minimize;
  minimize.max_iterations = options.max_iterations;
  minimize.tolerance = options.tolerance;
  minimize.bijective = options.bijective;
  minimize.acceptable = options.acceptable;
  if (std::isfinite(options.most_energy)) minimize.enough = options.most_energy;
  return minimize;
}

// A chart that overlaps itself by this share of its area at most is held apart before a cut is
// thought of; more has never come near the free map (benchmarks/unwrap.py sharp).
constexpr double kMildOverlap = 0.2;
// What a map without overlap may have more than the free one before a cut is the better way.
// benchmarks/unwrap.py sharp measures both.
constexpr double kEnergyFactor = 1.1;
constexpr double kEnergyExcess = 0.02;

double overlapping_share(const std::vector<FacePair>& pairs, const mesh::Surface& chart,
                         const Points2& uv) {
  double overlap = 0.0;
  for (const FacePair& pair : pairs) overlap += pair.area;
  return overlap / uv_area(chart.faces, uv);
}

FlatChart descended(distortion::Minimized descent, Stats& stats) {
  report(descent, stats);
  return {std::move(descent.uv), {}, descent.stop == distortion::Stop::kTimeLimit};
}

// `apart`: the last map of the descent to `free` that did not overlap.
FlatChart without_overlap(const mesh::Surface& chart, const FlattenOptions& options, Points2 apart,
                          Points2 free, ExecutionContext& context, Stats& stats) {
  distortion::MinimizeOptions minimize = minimize_options(options);
  minimize.held_apart = true;
  const auto hold_apart = [&] {
    return descended(distortion::minimize_distortion(chart, apart, minimize, context), stats);
  };
  if (!options.may_add_cuts) return hold_apart();
  const std::vector<FacePair> pairs = overlapping_faces(chart.faces, free, context);
  const double share = overlapping_share(pairs, chart, free);
  const double most =
      std::min(options.most_energy, kEnergyFactor * energy_of(chart, free) + kEnergyExcess);
  FlatChart flat;
  if (share <= kMildOverlap) {
    minimize.max_iterations = std::min(options.held_steps, options.max_iterations);
    flat = hold_apart();
    if (energy_of(chart, flat.uv) <= most) return flat;
  } else {
    flat.uv = std::move(apart);
  }
  mesh::EdgeFlags cut =
      separating_cut(chart, free, pairs, options.tolerated_overlap, options.uncuttable, context);
  // What is tolerated may need no cut at all; where holding apart has not helped, a cut has to.
  if (!any_flag(cut)) cut = separating_cut(chart, free, pairs, 0.0, options.uncuttable, context);
  if (any_flag(cut)) {
    flat.uv = std::move(free);
    flat.cut = std::move(cut);
  }
  return flat;
}

// A map that was accepted early may be drawn out too far for 32 bits. Then the descent goes on,
// whoever waits for it: there is no map otherwise.
void keep_storable(const mesh::Surface& chart, const distortion::MinimizeOptions& options,
                   Points2& uv, ExecutionContext& context, Stats& stats) {
  if (!options.acceptable || !context.accepted()) return;
  const Grace storing(context, Grace::kShort);
  distortion::RoundingOptions rounding;
  rounding.fixed = options.fixed;
  rounding.bijective = options.bijective;
  Stats ignored;
  try {
    distortion::round_to_storage(chart.faces, uv, rounding, context, ignored);
  } catch (const NotConverged&) {
    distortion::MinimizeOptions whole = options;
    whole.acceptable = false;
    uv = descended(distortion::minimize_distortion(chart, uv, whole, context), stats).uv;
  } catch (const TimeIsOver&) {
    // What is left of the time is for the other charts.
  }
}

// How near to its optimum the map of a chart is.
enum class Start {
  kFar,
  kNear,   // the last map before it would overlap is one to hold apart
  kPiece,  // of a chart that was cut: the last map before it would overlap is good
};

// Of a chart without pins, from a map that does not overlap, as far as time allows.
void lower_distortion(const mesh::Surface& chart, const FlattenOptions& options, Start start,
                      FlatChart& flat, ExecutionContext& context, Stats& stats) {
  const bool is_piece = start == Start::kPiece;
  Points2 free;
  distortion::MinimizeOptions minimize = minimize_options(options);
  minimize.overlapping = &free;
  minimize.ends_at_overlap = is_piece || (start == Start::kNear && !options.may_add_cuts);
  improve_in_time(context, stats, [&] {
    {
      const ProgressRange range(context, 0.0, is_piece ? 1.0 : 0.5);
      flat = descended(distortion::minimize_distortion(chart, flat.uv, minimize, context), stats);
    }
    if (free.rows() == 0 || is_piece) return;
    const ProgressRange range(context, 0.5, 1.0);
    flat = without_overlap(chart, options, flat.uv, std::move(free), context, stats);
  });
  if (flat.hurried) note_time_limit(stats);
}

// A piece of a chart that was cut as flatten_chart() said, from its part of that chart's map
// (#V x 2); anew where that overlaps itself still.
FlatChart flatten_piece(const mesh::Surface& piece, Points2 uv, const FlattenOptions& options,
                        ExecutionContext& context, Stats& stats) {
  if (overlaps_itself(piece.faces, uv, context))
    return flatten_chart(piece, options, context, stats);
  FlatChart flat{std::move(uv), {}};
  lower_distortion(piece, options, Start::kPiece, flat, context, stats);
  keep_storable(piece, minimize_options(options), flat.uv, context, stats);
  return flat;
}

// Of a chart with many triangles, which is laid flat by the share of them first; energies then need
// not be exact.
constexpr Index kTimesFewer = 8;
constexpr double kFewerTolerance = 1e-3;

// A large chart by fewer of its triangles, which lie flat and do not overlap if that is asked;
// empty where there is no way back.
Points2 by_fewer(const mesh::Surface& chart, const FlattenOptions& options,
                 ExecutionContext& context) {
  if (chart.faces.rows() <= kManyFaces) return {};
  const auto count = static_cast<Index>(chart.faces.rows());
  const mesh::Decimated few = mesh::decimate(chart, count / kTimesFewer, context);
  if (few.surface.faces.rows() > count / 2) return {};
  FlattenOptions coarse = options;
  coarse.may_add_cuts = false;
  coarse.acceptable = false;
  coarse.tolerance = std::max(options.tolerance, kFewerTolerance);
  Stats ignored;
  Points2 flat;
  try {
    flat = flatten_chart(few.surface, coarse, context, ignored).uv;
  } catch (const NotConverged&) {
    return {};  // The whole chart may have a map although few of its triangles have none.
  }
  const Grace prolonging(context);
  // A boundary that need not be the same curve draws fewer triangles out.
  for (const bool keep_boundary : {false, true}) {
    Points2 uv = mesh::prolong(chart, few, flat, keep_boundary, context);
    if (uv.rows() > 0 && !(options.bijective && overlaps_itself(chart.faces, uv, context)))
      return uv;
  }
  return {};
}

// From a map near the least distorted one, which is put where the pins want it, to one that meets
// them.
FlatChart pulled_to_pins(const mesh::Surface& chart, const FlattenOptions& options, Points2 uv,
                         ExecutionContext& context, Stats& stats) {
  distortion::MinimizeOptions minimize = minimize_options(options);
  {
    const ProgressRange range(context, 0.3, 0.6);
    try {
      uv = descended(distortion::minimize_distortion(chart, uv, minimize, context), stats).uv;
    } catch (const NotConverged& failure) {
      stats["optimise_failure"] = failure.error().message;
    }
  }
  const ProgressRange range(context, 0.6, 1.0);
  distortion::TargetsResult result =
      distortion::minimize_with_targets(chart, uv, options.pins, minimize, context);
  report(result, stats);
  if (context.time_is_over() || result.stop == distortion::Stop::kTimeLimit) note_time_limit(stats);
  if (!result.missed.empty()) {
    throw_not_converged(
        ErrorCode::kLineSearchStalled,
        std::to_string(result.missed.size()) + " of " + std::to_string(options.pins.size()) +
            " pins cannot be reached without folding this triangulation; the map came " +
            std::to_string(static_cast<int>(100.0 * result.fraction)) +
            " % of the way. Use Match Pins, which refines the mesh, or move or unpin them.",
        ElementKind::kVertex, result.missed);
  }
  for (const auto& [v, target] : options.pins) minimize.fixed.push_back(v);
  keep_storable(chart, minimize, result.uv, context, stats);
  return {std::move(result.uv), {}};
}

}  // namespace

FlatChart flatten_chart(const mesh::Surface& chart, const FlattenOptions& options,
                        ExecutionContext& context, Stats& stats) {
  reject_coincident_pins(chart, options.bijective, options.pins, context);
  FlatChart flat;
  Start start = Start::kNear;
  if (options.pins.empty()) {
    const ProgressRange range(context, 0.0, 0.3);
    flat.uv = by_fewer(chart, options, context);
  }
  if (flat.uv.rows() == 0) {
    start = Start::kFar;
    {
      const ProgressRange range(context, 0.0, 0.2);
      flat.uv = embed_on_circle(chart, context, stats);
    }
    const ProgressRange range(context, 0.2, 0.3);
    const auto improve = [&] { flat.uv = better_start(chart, flat.uv, context); };
    // From here on there is a map: without pins, less time only leaves it more distorted.
    if (options.pins.empty()) {
      improve_in_time(context, stats, improve);
    } else {
      improve();
    }
  }
  if (!options.pins.empty())
    return pulled_to_pins(chart, options, std::move(flat.uv), context, stats);
  const ProgressRange range(context, 0.3, 1.0);
  lower_distortion(chart, options, start, flat, context, stats);
  if (flat.cut.empty()) keep_storable(chart, minimize_options(options), flat.uv, context, stats);
  return flat;
}

std::vector<char> pinned_vertices(const mesh::Surface& surface,
                                  const std::vector<certify::CornerPin>& pins) {
  if (pins.empty()) return {};
  std::vector<char> pinned(at(surface.vertices.rows()), 0);
  for (const certify::CornerPin& pin : pins) {
    if (pin.corner >= 0 && pin.corner < surface.faces.size())
      pinned[at(surface.faces(pin.corner / 3, pin.corner % 3))] = 1;
  }
  return pinned;
}

namespace {

// Added cuts avoid pinned vertices; where they could not, one vertex has two places in its chart,
// and its pin would have to be met by both.
void refuse_pins_on_added_cuts(const Islands& islands, const ChartPins& pins) {
  const Triangles& faces = islands.mesh.faces;
  std::vector<char> on_added(islands.mesh.vertex_origin.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(islands.added.size()); ++h) {
    if (islands.added[at(h)] == 0) continue;
    on_added[at(mesh::source(faces, h))] = 1;
    on_added[at(mesh::target(faces, h))] = 1;
  }
  for (std::size_t c = 0; c < pins.size(); ++c) {
    std::map<VertexId, Vector2> known;
    for (const auto& [local, uv] : pins[c]) {
      const VertexId v = islands.charts[c].vertices[at(local)];
      const VertexId origin = islands.mesh.vertex_origin[at(v)];
      const auto [it, fresh] = known.emplace(origin, uv);
      if (fresh || it->second != uv || on_added[at(v)] == 0) continue;
      throw_not_converged(
          ErrorCode::kBadPins,
          "The island of vertex " + vertex_id(origin) +
              " had to be cut open, and every way that was found runs through this pinned vertex, "
              "which has two places then. Mark seams that open the island elsewhere, or unpin "
              "some vertices.",
          ElementKind::kVertex, {origin});
    }
  }
}

}  // namespace

ChartPins pins_of_charts(const std::vector<mesh::Chart>& charts,
                         const std::vector<certify::CornerPin>& pins, Index corners,
                         const std::vector<VertexId>* vertex_origin) {
  ChartPins result(charts.size());
  if (pins.empty()) return result;
  certify::require_storable_pins(pins, corners);
  std::vector<std::pair<std::size_t, VertexId>> place(at(corners));
  for (std::size_t c = 0; c < charts.size(); ++c) {
    for (std::size_t h = 0; h < corner_count(charts[c]); ++h)
      place[corner_of(charts[c], h)] = {c, charts[c].surface.faces.data()[h]};
  }
  for (const certify::CornerPin& pin : pins) {
    const auto [c, v] = place[at(pin.corner)];
    result[c].emplace_back(v, pin.uv);
  }
  for (std::size_t c = 0; c < result.size(); ++c) {
    VertexPins& own = result[c];
    std::stable_sort(own.begin(), own.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    own.erase(std::unique(own.begin(), own.end()), own.end());
    const auto twice = std::adjacent_find(
        own.begin(), own.end(), [](const auto& a, const auto& b) { return a.first == b.first; });
    if (twice == own.end()) continue;
    if (vertex_origin != nullptr) {
      const VertexId origin = (*vertex_origin)[at(charts[c].vertices[at(twice->first)])];
      throw_invalid(ErrorCode::kBadPins,
                    "Vertex " + vertex_id(origin) +
                        " is pinned to two different places within one chart. Mark a seam "
                        "between them or unpin one.",
                    ElementKind::kVertex, {origin});
    }
    throw_invalid(ErrorCode::kBadPins,
                  "Two corners that share one place in the map are pinned to different places. "
                  "Unpin one of them.");
  }
  return result;
}

ChartPins pins_by_chart(const Islands& islands, const std::vector<certify::CornerPin>& pins) {
  ChartPins result =
      pins_of_charts(islands.charts, pins, static_cast<Index>(islands.mesh.faces.size()),
                     &islands.mesh.vertex_origin);
  if (!pins.empty()) refuse_pins_on_added_cuts(islands, result);
  return result;
}

Renumbering numbers_of(const mesh::Chart& chart, const std::vector<VertexId>& vertex_origin) {
  const auto known = [](Index i, std::size_t count) { return i >= 0 && at(i) < count; };
  const auto face = [&, known](Index f) {
    return known(f, chart.faces.size()) ? chart.faces[at(f)] : kInvalid;
  };
  return {[&, known](Index v) {
            return known(v, chart.vertices.size()) ? vertex_origin[at(chart.vertices[at(v)])]
                                                   : kInvalid;
          },
          face,
          [face](Index c) {
            const FaceId f = face(c / 3);
            return f == kInvalid ? kInvalid : 3 * f + c % 3;
          }};
}

Error in_terms_of_input(Error error, const Islands& islands, std::size_t c) {
  const mesh::Chart& chart = islands.charts[c];
  error = renumbered(std::move(error), numbers_of(chart, islands.mesh.vertex_origin));
  std::string place;
  if (error.elements.empty() || error.kind == ElementKind::kCorner) {
    error.kind = ElementKind::kFace;
    error.elements = first_elements(chart.faces);
  } else {
    place = error.kind == ElementKind::kFace
                ? ", first at face " + face_id(error.elements.front())
                : ", first at vertex " + vertex_id(error.elements.front());
  }
  error.message = "Chart of face " + face_id(chart.faces.front()) + " (" +
                  std::to_string(chart.faces.size()) + " triangles" + place + "): " + error.message;
  return error;
}

namespace {

// Lays the charts flat whose map `maps` does not have, and keeps the stats of the largest; true if
// some of them have to be cut, which is done: their pieces are known to be such then.
bool flatten_unknown(Islands& islands, const mesh::Surface& surface,
                     const mesh::EdgeFlags& uncuttable, const ChartPins& pins,
                     const UnwrapOptions& options, KnownMaps& maps, ExecutionContext& context,
                     Stats& stats) {
  std::vector<FlatChart> flat(islands.charts.size());
  std::vector<Stats> own_stats(flat.size());
  const std::vector<std::size_t> order = largest_first(islands.charts);
  const auto flatten = [&](std::size_t c, ExecutionContext& part) {
    const mesh::Chart& chart = islands.charts[c];
    const char known = maps.of_face[at(chart.faces.front())];
    if (known == KnownMaps::kFlat) return;
    FlattenOptions own_options(options);
    if (known == KnownMaps::kNothing && !pins.empty()) own_options.pins = pins[c];
    own_options.may_add_cuts =
        options.bijective && options.may_add_cuts && own_options.pins.empty();
    if (own_options.may_add_cuts) own_options.uncuttable = part_of(chart, uncuttable);
    const mesh::InOwnUnit own(chart.surface);
    flat[c] = known == KnownMaps::kNothing
                  ? flatten_chart(own.surface(), own_options, part, own_stats[c])
                  : flatten_piece(own.surface(), by_vertex(chart, maps.corner_uv) / own.unit(),
                                  own_options, part, own_stats[c]);
    // Pins have a unit of their own.
    if (own_options.pins.empty()) flat[c].uv *= own.unit();
  };
  for_each_chart(islands.charts, order, "flattening charts", context,
                 [&](std::size_t c, ExecutionContext& part) {
                   with_errors(
                       [&](const Error& error) { return in_terms_of_input(error, islands, c); },
                       [&] { flatten(c, part); });
                 });
  if (!order.empty()) stats.insert(own_stats[order[0]].begin(), own_stats[order[0]].end());
  if (std::ranges::any_of(own_stats,
                          [](const Stats& s) { return s.contains("time_limit_reached"); }))
    note_time_limit(stats);
  mesh::EdgeFlags further(at(surface.faces.size()), 0);
  std::fill(maps.of_face.begin(), maps.of_face.end(), KnownMaps::kFlat);
  for (std::size_t c = 0; c < flat.size(); ++c) {
    const mesh::Chart& chart = islands.charts[c];
    if (flat[c].uv.rows() > 0) put_corners(chart, flat[c].uv, maps.corner_uv);
    put_part(chart, flat[c].cut, further);
    for (std::size_t f = 0; f < chart.faces.size() && !flat[c].cut.empty(); ++f)
      maps.of_face[at(chart.faces[f])] = KnownMaps::kPiece;
  }
  const bool is_cut = std::count(maps.of_face.begin(), maps.of_face.end(), KnownMaps::kPiece) > 0;
  if (is_cut) cut_further(islands, surface, further);
  return is_cut;
}

}  // namespace

std::vector<Points2> flatten_islands(Islands& islands, const mesh::Surface& surface,
                                     const mesh::EdgeFlags& uncuttable, const ChartPins& pins,
                                     const UnwrapOptions& options, ExecutionContext& context,
                                     Stats& stats, const KnownMaps* known) {
  KnownMaps maps = known != nullptr ? *known : KnownMaps(surface.faces);
  const auto added = [&] { return std::count(islands.added.begin(), islands.added.end(), 1); };
  const auto before = added();
  constexpr double kFirstShare = 0.7;
  double begin = 0.0;
  double end = kFirstShare;
  for (bool is_cut = true; is_cut;) {
    const ProgressRange range(context, begin, end);
    begin = std::exchange(end, end + 0.5 * (1.0 - end));
    is_cut = flatten_unknown(islands, surface, uncuttable, pins, options, maps, context, stats);
  }
  stats["overlap_cuts"] = static_cast<std::int64_t>((added() - before) / 2);
  std::vector<Points2> uv;
  for (const mesh::Chart& chart : islands.charts) uv.push_back(by_vertex(chart, maps.corner_uv));
  return uv;
}

}  // namespace flipfree::unwrap
