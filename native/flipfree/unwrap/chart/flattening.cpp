#include "flipfree/unwrap/chart/flattening.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/islands/corners.h"

namespace flipfree::unwrap {
std::vector<char> pinned_vertices(const mesh::Surface& surface,
                                  const std::vector<certify::CornerPin>& pins) {
  if (pins.empty()) return {};
  std::vector<char> pinned(static_cast<std::size_t>(surface.vertices.rows()), 0);
  for (const certify::CornerPin& pin : pins) {
    if (pin.corner >= 0 && pin.corner < surface.faces.size())
      pinned[static_cast<std::size_t>(surface.faces(pin.corner / 3, pin.corner % 3))] = 1;
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
    if (islands.added[static_cast<std::size_t>(h)] == 0) continue;
    on_added[static_cast<std::size_t>(mesh::source(faces, h))] = 1;
    on_added[static_cast<std::size_t>(mesh::target(faces, h))] = 1;
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

}  // namespace

ChartPins pins_by_chart(const Islands& islands, const std::vector<certify::CornerPin>& pins) {
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
  certify::require_storable_pins(pins, static_cast<Index>(islands.mesh.faces.size()));
  for (const certify::CornerPin& pin : pins) {
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

Error in_terms_of_input(Error error, const Islands& islands, std::size_t c) {
  const mesh::Chart& chart = islands.charts[c];
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
    error.kind = ElementKind::kFace;
    error.elements = first_elements(chart.faces);
  }
  error.message = "Chart of face " + std::to_string(chart.faces.front()) + " (" +
                  std::to_string(chart.faces.size()) + " triangles" + place + "): " + error.message;
  return error;
}

namespace {

// Calls solve(chart, context, stats) for every chart and keeps the stats of the largest.
template <typename Solve>
void for_charts(const Islands& islands, ExecutionContext& context, Stats& stats, Solve solve) {
  std::vector<Stats> own(islands.charts.size());
  std::vector<std::size_t> order(own.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  order = largest_first(islands.charts, std::move(order));
  for_each_chart(islands.charts, order, "flattening charts", context,
                 [&](std::size_t c, ExecutionContext& part) {
                   with_errors(
                       [&](const Error& error) { return in_terms_of_input(error, islands, c); },
                       [&] { solve(c, part, own[c]); });
                 });
  if (!order.empty()) stats.insert(own[order[0]].begin(), own[order[0]].end());
  if (std::any_of(own.begin(), own.end(),
                  [](const Stats& s) { return s.contains("time_limit_reached"); }))
    stats["time_limit_reached"] = std::int64_t{1};
}

// Rounds of cutting: pieces that may still overlap a little are looked at again, in the last round
// none may.
constexpr int kCuttingRounds = 3;

class Flattening {
 public:
  Flattening(Islands& islands, const mesh::Surface& surface, const mesh::Adjacency& adjacency,
             const mesh::EdgeFlags& uncuttable, const ChartPins& pins, const UnwrapOptions& options)
      : islands_(islands),
        surface_(surface),
        adjacency_(adjacency),
        uncuttable_(uncuttable),
        pins_(pins),
        options_(options),
        uv_(3 * surface.faces.rows(), 2),
        divided_(static_cast<std::size_t>(surface.faces.rows()), 1),
        piece_(divided_.size(), 0) {}

  void use(const KnownMaps& known) {
    uv_ = known.corner_uv;
    for (std::size_t f = 0; f < divided_.size(); ++f) {
      divided_[f] = known.of_face[f] == KnownMaps::kFlat ? 0 : 1;
      piece_[f] = known.of_face[f] == KnownMaps::kPiece ? 1 : 0;
    }
  }

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
    for (const mesh::Chart& chart : islands_.charts) uv.push_back(by_vertex(chart, uv_));
    return uv;
  }

 private:
  // Flattens the charts of `divided_` faces; true if some of them have to be cut, which is done.
  bool flatten(int round, ExecutionContext& context, Stats& stats) {
    std::vector<FlatChart> flat(islands_.charts.size());
    for_charts(islands_, context, stats,
               [&](std::size_t c, ExecutionContext& chart_context, Stats& chart_stats) {
                 const mesh::Chart& chart = islands_.charts[c];
                 if (divided_[static_cast<std::size_t>(chart.faces.front())] == 0) return;
                 FlattenOptions flatten = options_of(c, round);
                 const mesh::InOwnUnit own(chart.surface);
                 const bool piece = piece_[static_cast<std::size_t>(chart.faces.front())] != 0;
                 flat[c] = round == 0 && !piece
                               ? flatten_chart(own.surface(), flatten, chart_context, chart_stats)
                               : flatten_piece(own.surface(), by_vertex(chart, uv_) / own.unit(),
                                               flatten, chart_context, chart_stats);
                 if (!flatten.pins.empty()) return;  // pins have a unit of their own
                 flat[c].uv *= own.unit();
               });
    mesh::EdgeFlags further(adjacency_.opposite.size(), 0);
    std::fill(divided_.begin(), divided_.end(), 0);
    bool cut = false;
    for (std::size_t c = 0; c < flat.size(); ++c) {
      if (flat[c].uv.rows() == 0) continue;
      const mesh::Chart& chart = islands_.charts[c];
      put_corners(chart, flat[c].uv, uv_);
      if (flat[c].cut.empty()) continue;
      cut = true;
      for (std::size_t h = 0; h < corner_count(chart); ++h)
        further[corner_of(chart, h)] = flat[c].cut[h];
      for (const FaceId f : chart.faces) divided_[at(f)] = 1;
    }
    if (cut) cut_further(islands_, surface_, adjacency_, further);
    return cut;
  }

  FlattenOptions options_of(std::size_t c, int round) const {
    FlattenOptions flatten;
    flatten.bijective = options_.bijective;
    flatten.max_iterations = options_.max_iterations;
    flatten.tolerance = options_.tolerance;
    flatten.acceptable = options_.acceptable;
    if (round == 0 && !pins_.of_chart.empty()) flatten.pins = pins_.of_chart[c];
    flatten.may_add_cuts = options_.bijective && options_.may_add_cuts && flatten.pins.empty();
    if (round + 1 >= kCuttingRounds) flatten.tolerated_overlap = 0.0;
    if (flatten.may_add_cuts) flatten.uncuttable = part_of(islands_.charts[c], uncuttable_);
    return flatten;
  }

  Islands& islands_;
  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& uncuttable_;
  const ChartPins& pins_;
  const UnwrapOptions& options_;
  Points2 uv_;                 // per corner of the surface
  std::vector<char> divided_;  // per face: its chart is to be flattened next
  std::vector<char> piece_;    // per face: uv_ is known from the start
};

}  // namespace

std::vector<Points2> flatten_islands(Islands& islands, const mesh::Surface& surface,
                                     const mesh::Adjacency& adjacency,
                                     const mesh::EdgeFlags& uncuttable, const ChartPins& pins,
                                     const UnwrapOptions& options, ExecutionContext& context,
                                     Stats& stats, const KnownMaps* known) {
  Flattening flattening(islands, surface, adjacency, uncuttable, pins, options);
  if (known != nullptr) flattening.use(*known);
  return flattening.run(context, stats);
}

}  // namespace flipfree::unwrap
