#include "flipfree/unwrap/chart/flattening.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/unwrap/chart/chart.h"

namespace flipfree::unwrap {

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

// Calls solve(chart, context, stats) for every chart and keeps the stats of the largest. One that
// holds half of all faces gets all threads; the others share them, one chart each.
template <typename Solve>
void for_charts(const Islands& islands, ExecutionContext& context, Stats& stats, Solve solve) {
  const std::vector<mesh::Chart>& charts = islands.charts;
  std::vector<Stats> chart_stats(charts.size());
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return charts[a].faces.size() > charts[b].faces.size();
  });
  std::size_t total = 0;
  for (const mesh::Chart& chart : charts) total += chart.faces.size();
  const auto share_of = [&](std::size_t c) {
    return static_cast<double>(charts[c].faces.size()) / static_cast<double>(total);
  };

  const auto solve_one = [&](std::size_t c, ExecutionContext& chart_context) {
    with_errors([&](const Error& error) { return in_terms_of_input(error, islands, c); },
                [&] { solve(c, chart_context, chart_stats[c]); });
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

class Flattening {
 public:
  Flattening(Islands& islands, const mesh::Surface& surface, const mesh::Adjacency& adjacency,
             const mesh::EdgeFlags& uncuttable, const ChartPins& pins, const UnwrapOptions& options,
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
        divided_(static_cast<std::size_t>(surface.faces.rows()), 1),
        piece_(divided_.size(), 0) {}

  void use(const KnownMaps& known) {
    uv_ = known.corner_uv;
    apart_ = known.apart;
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
    for (const mesh::Chart& chart : islands_.charts) uv.push_back(part(chart, uv_));
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
                               : flatten_piece(own.surface(), part(chart, uv_) / own.unit(),
                                               part(chart, apart_) / own.unit(), flatten,
                                               chart_context, chart_stats);
                 if (!flatten.pins.empty()) return;  // pins have a unit of their own
                 flat[c].uv *= own.unit();
                 flat[c].apart *= own.unit();
               });
    mesh::EdgeFlags further(adjacency_.opposite.size(), 0);
    std::fill(divided_.begin(), divided_.end(), 0);
    bool cut = false;
    for (std::size_t c = 0; c < flat.size(); ++c) {
      if (flat[c].uv.rows() == 0) continue;
      const mesh::Chart& chart = islands_.charts[c];
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
    if (round == 0 && !pins_.of_chart.empty()) flatten.pins = pins_.of_chart[c];
    flatten.may_add_cuts = options_.bijective && options_.may_add_cuts && flatten.pins.empty();
    if (round + 1 >= kCuttingRounds) flatten.tolerated_overlap = 0.0;
    if (flatten.may_add_cuts && !uncuttable_.empty()) {
      const mesh::Chart& chart = islands_.charts[c];
      for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h)
        flatten.uncuttable.push_back(uncuttable_[in_surface(chart, h)]);
    }
    return flatten;
  }

  static std::size_t in_surface(const mesh::Chart& chart, std::size_t halfedge) {
    return 3 * static_cast<std::size_t>(chart.faces[halfedge / 3]) + halfedge % 3;
  }

  static Points2 part(const mesh::Chart& chart, const Points2& corners) {
    Points2 uv(chart.surface.vertices.rows(), 2);
    for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h)
      uv.row(chart.surface.faces.data()[h]) =
          corners.row(static_cast<Eigen::Index>(in_surface(chart, h)));
    return uv;
  }

  Islands& islands_;
  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& uncuttable_;
  const ChartPins& pins_;
  const UnwrapOptions& options_;
  bool acceptable_;
  Points2 uv_;                 // per corner of the surface
  Points2 apart_;              // the same of the maps without overlap of charts that were cut
  std::vector<char> divided_;  // per face: its chart is to be flattened next
  std::vector<char> piece_;    // per face: uv_ and apart_ are known from the start
};

}  // namespace

std::vector<Points2> flatten_islands(Islands& islands, const mesh::Surface& surface,
                                     const mesh::Adjacency& adjacency,
                                     const mesh::EdgeFlags& uncuttable, const ChartPins& pins,
                                     const UnwrapOptions& options, bool acceptable,
                                     ExecutionContext& context, Stats& stats,
                                     const KnownMaps* known) {
  Flattening flattening(islands, surface, adjacency, uncuttable, pins, options, acceptable);
  if (known != nullptr) flattening.use(*known);
  return flattening.run(context, stats);
}

}  // namespace flipfree::unwrap
