#include "flipfree/unwrap/seams/auto_islands.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/unwrap/chart/flattening.h"
#include "flipfree/unwrap/chart/stretch.h"
#include "flipfree/unwrap/islands/edge_costs.h"
#include "flipfree/unwrap/seams/creases.h"
#include "flipfree/unwrap/seams/exposure.h"
#include "flipfree/unwrap/seams/halves.h"
#include "flipfree/unwrap/seams/slits/slits.h"

namespace flipfree::unwrap {
namespace {

std::size_t in_surface(const mesh::Chart& chart, std::size_t halfedge) {
  return 3 * at(chart.faces[halfedge / 3]) + halfedge % 3;
}

// Edges that must not be seams, but there may be no other way to open a closed surface.
std::vector<double> positive(const mesh::Surface& surface, std::vector<double> cost) {
  constexpr double kForbidden = 1e6;
  constexpr double kLeast = 1e-12;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const double length = (surface.vertices.row(mesh::source(surface.faces, h)) -
                           surface.vertices.row(mesh::target(surface.faces, h)))
                              .norm();
    cost[at(h)] = std::clamp(cost[at(h)], kLeast, std::max(kForbidden * length, kLeast));
  }
  return cost;
}

// What a seam costs grows with the root of how much is seen there, between these.
constexpr double kHidden = 0.5;
constexpr double kSeen = 2.0;

void prefer_hidden(std::vector<double>& cost, const Triangles& faces,
                   const std::vector<double>& exposure) {
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const double seen =
        0.5 * (exposure[at(mesh::source(faces, h))] + exposure[at(mesh::target(faces, h))]);
    cost[at(h)] *= std::clamp(std::sqrt(seen), kHidden, kSeen);
  }
}

KnownMaps nothing_known(const Triangles& faces) {
  return {Points2(3 * faces.rows(), 2), Points2(3 * faces.rows(), 2),
          std::vector<char>(static_cast<std::size_t>(faces.rows()), KnownMaps::kNothing)};
}

// The map (#V x 2) of a chart, as known.
void take_down(const mesh::Chart& chart, const Points2& uv, char kind, KnownMaps& known) {
  for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h) {
    const std::size_t corner = in_surface(chart, h);
    known.of_face[corner / 3] = kind;
    known.corner_uv.row(static_cast<Eigen::Index>(corner)) = uv.row(chart.surface.faces.data()[h]);
  }
}

// Is the map (#V x 2) within the bound, eased where that helps?
bool ease_to(const Stretch& bound, const mesh::Surface& chart, bool apart, Points2& uv,
             ExecutionContext& context) {
  const auto within = [&] {
    Points2 corners(chart.faces.size(), 2);
    for (CornerId k = 0; k < corners.rows(); ++k) corners.row(k) = uv.row(chart.faces.data()[k]);
    return stretch_of(chart, corners).within(bound);
  };
  if (within()) return true;
  if (context.time_is_over()) return false;
  uv = eased(chart, uv, bound, apart, context);
  return within();
}

// Maps of the islands that the given seams bound, none of which had to be opened, within the bound
// of stretch and not on themselves: what is cut well enough is cut no further.
KnownMaps known_by_seams(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                         const mesh::EdgeFlags& seams, const mesh::EdgeFlags& uncuttable,
                         Islands& islands, const UnwrapOptions& options, bool acceptable,
                         ExecutionContext& context, Stats& stats) {
  KnownMaps known = nothing_known(surface.faces);
  std::vector<char> candidate(islands.charts.size(), 0);
  for (std::size_t c = 0; c < candidate.size(); ++c) {
    const mesh::Chart& chart = islands.charts[c];
    const mesh::Adjacency local = mesh::build_adjacency(
        static_cast<Index>(chart.surface.vertices.rows()), chart.surface.faces);
    bool opened = false;
    for (std::size_t h = 0; h < local.opposite.size(); ++h) {
      const std::size_t corner = in_surface(chart, h);
      opened = opened || islands.added[corner] != 0;
      if (local.opposite[h] == kInvalid && seams[corner] != 0) candidate[c] = 1;
    }
    if (opened) candidate[c] = 0;
    // The others are passed over as if they were known.
    if (candidate[c] == 0)
      for (const FaceId f : chart.faces) known.of_face[at(f)] = KnownMaps::kFlat;
  }
  if (std::find(candidate.begin(), candidate.end(), 1) == candidate.end())
    return nothing_known(surface.faces);
  UnwrapOptions whole = options;
  whole.may_add_cuts = false;
  // What cannot be flattened whole is searched like what is stretched.
  Outcome<std::vector<Points2>> uv = attempt([&] {
    return flatten_islands(islands, surface, adjacency, uncuttable, ChartPins{}, whole, acceptable,
                           context, stats, &known);
  });
  known = nothing_known(surface.faces);
  if (!uv) return known;
  const Stretch bound = stretch_bound(options.seams.stretch);
  for (std::size_t c = 0; c < candidate.size(); ++c) {
    const mesh::Surface& chart = islands.charts[c].surface;
    if (candidate[c] != 0 && ease_to(bound, chart, options.bijective, (*uv)[c], context))
      take_down(islands.charts[c], (*uv)[c], KnownMaps::kFlat, known);
  }
  return known;
}

// Charts are searched again, for what they have become since, with a bound that is tighter by this.
constexpr int kSearchRounds = 4;
constexpr double kTighterEachRound = 0.8;
// What is above the bound by then is cut in two, and again: a single triangle is not stretched.

class Finder {
 public:
  Finder(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
         const mesh::EdgeFlags& uncuttable, const UnwrapOptions& options, std::vector<double> cost,
         Islands islands, KnownMaps known)
      : surface_(surface),
        adjacency_(adjacency),
        uncuttable_(uncuttable),
        options_(options),
        cost_(std::move(cost)),
        islands_(std::move(islands)),
        known_(std::move(known)) {}

  AutoIslands run(bool acceptable, ExecutionContext& context, Stats& stats) {
    const Stretch bound = stretch_bound(options_.seams.stretch);
    Stretch aim = bound;
    std::vector<Points2> uv;
    double begin = 0.0;
    for (int round = 0;; ++round) {
      const double end = begin + 0.5 * (1.0 - begin);
      if (round < kSearchRounds) {
        const ProgressRange range(context, begin, begin + 0.7 * (end - begin));
        search(aim, context);
      }
      const ProgressRange range(context, begin + 0.7 * (end - begin), end);
      begin = end;
      try {
        uv = flatten_islands(islands_, surface_, adjacency_, uncuttable_, ChartPins{}, options_,
                             acceptable, context, stats, &known_);
      } catch (const TimeIsOver&) {
        if (options_.seams.edges_only) break;
        throw;
      }
      if (!any_above(bound, uv, context)) break;
      if (context.time_is_over()) {
        stats["time_limit_reached"] = std::int64_t{1};
        break;
      }
      if (round + 1 >= kSearchRounds && !halve(context)) break;
      aim.energy = 1.0 + kTighterEachRound * (aim.energy - 1.0);
    }
    stats["symmetric_charts"] = symmetric_.load();
    return {std::move(islands_), std::move(uv)};
  }

 private:
  // Slits for the charts without a map that is known, and maps for those that can have one.
  void search(const Stretch& aim, ExecutionContext& context) {
    mesh::EdgeFlags further(adjacency_.opposite.size(), 0);
    const std::size_t count = islands_.charts.size();
    SharedProgress progress(context, 0.0);
    parallel_for(context, count, 1, [&](std::size_t c, std::size_t, std::size_t) {
      ExecutionContext part(&context, count == 1 ? context.threads : 1, &progress,
                            1.0 / static_cast<double>(count));
      if (known_.of_face[at(islands_.charts[c].faces.front())] == KnownMaps::kNothing)
        search_chart(islands_.charts[c], aim, further, part);
      const Untimed done_with(part);
      part.report("finding seams", 1.0);
    });
    cut_further(islands_, surface_, adjacency_, further);
  }

  void search_chart(const mesh::Chart& chart, const Stretch& aim, mesh::EdgeFlags& further,
                    ExecutionContext& context) {
    const mesh::InOwnUnit own(chart.surface);
    const mesh::Adjacency local = mesh::build_adjacency(
        static_cast<Index>(chart.surface.vertices.rows()), chart.surface.faces);
    std::vector<double> cost(local.opposite.size());
    for (std::size_t h = 0; h < cost.size(); ++h)
      cost[h] = cost_[in_surface(chart, h)] / own.unit();
    const SlitOptions options{aim, options_.bijective, options_.may_add_cuts};
    const Slits slits = find_slits(own.surface(), local, cost, options, context);
    if (slits.symmetric) ++symmetric_;
    for (std::size_t h = 0; h < cost.size(); ++h) {
      const std::size_t corner = in_surface(chart, h);
      further[corner] = slits.cut[h];
      if (slits.corner_uv.rows() == 0) continue;
      const auto row = static_cast<Eigen::Index>(corner);
      const auto own_row = static_cast<Eigen::Index>(h);
      known_.corner_uv.row(row) = own.unit() * slits.corner_uv.row(own_row);
      if (slits.apart.rows() == 0) {
        known_.of_face[corner / 3] = KnownMaps::kFlat;
        continue;
      }
      known_.of_face[corner / 3] = KnownMaps::kPiece;
      known_.apart.row(row) = own.unit() * slits.apart.row(own_row);
    }
  }

  // Cuts the charts in two of which no map is known, in the sense of any_above(). False if none can
  // be.
  bool halve(ExecutionContext& context) {
    if (!options_.may_add_cuts) return false;
    mesh::EdgeFlags further(adjacency_.opposite.size(), 0);
    bool any = false;
    for (const mesh::Chart& chart : islands_.charts) {
      if (known_.of_face[at(chart.faces.front())] != KnownMaps::kNothing) continue;
      const std::size_t count = 3 * chart.faces.size();
      Points2 corners(static_cast<Eigen::Index>(count), 2);
      mesh::EdgeFlags never(count);
      for (std::size_t h = 0; h < count; ++h) {
        const std::size_t corner = in_surface(chart, h);
        corners.row(static_cast<Eigen::Index>(h)) =
            known_.corner_uv.row(static_cast<Eigen::Index>(corner));
        never[h] = cost_[corner] == mesh::ShortestPaths::kUnreached ? 1 : 0;
      }
      const mesh::Adjacency local = mesh::build_adjacency(
          static_cast<Index>(chart.surface.vertices.rows()), chart.surface.faces);
      const mesh::EdgeFlags cut = halving_cut(chart.surface, local, corners, never, context);
      const bool is_cut = std::find(cut.begin(), cut.end(), 1) != cut.end();
      any = any || is_cut;
      for (std::size_t h = 0; h < count; ++h) {
        const std::size_t corner = in_surface(chart, h);
        further[corner] = cut[h];
        known_.of_face[corner / 3] = is_cut ? KnownMaps::kPiece : KnownMaps::kFlat;
        known_.apart.row(static_cast<Eigen::Index>(corner)) =
            known_.corner_uv.row(static_cast<Eigen::Index>(corner));
      }
    }
    cut_further(islands_, surface_, adjacency_, further);
    return any;
  }

  // Takes down the maps, but of charts above the bound. True if there are such.
  bool any_above(const Stretch& bound, std::vector<Points2>& uv, ExecutionContext& context) {
    bool any = false;
    for (std::size_t c = 0; c < islands_.charts.size(); ++c) {
      const mesh::Chart& chart = islands_.charts[c];
      const bool within = ease_to(bound, chart.surface, options_.bijective, uv[c], context);
      any = any || !within;
      take_down(chart, uv[c], within ? KnownMaps::kFlat : KnownMaps::kNothing, known_);
    }
    return any;
  }

  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& uncuttable_;
  const UnwrapOptions& options_;
  std::vector<double> cost_;  // per half-edge
  Islands islands_;
  KnownMaps known_;
  std::atomic<std::int64_t> symmetric_{0};
};

}  // namespace

AutoIslands find_islands(const mesh::Surface& surface, const Points3& placed,
                         const mesh::Adjacency& adjacency, const mesh::EdgeFlags& seams,
                         const mesh::EdgeFlags& uncuttable, const UnwrapOptions& options,
                         bool acceptable, ExecutionContext& context, Stats& stats) {
  KnownMaps known = nothing_known(surface.faces);
  double begin = 0.0;
  if (std::find(seams.begin(), seams.end(), 1) != seams.end()) {
    Islands given =
        make_islands(surface, adjacency, seams, uncuttable, false, context, {{}, {}, false});
    begin = 0.2;
    const ProgressRange range(context, 0.0, begin);
    try {
      known = known_by_seams(surface, adjacency, seams, uncuttable, given, options, acceptable,
                             context, stats);
    } catch (const TimeIsOver&) {
      if (options.seams.edges_only) return {std::move(given), {}};
      throw;
    }
    if (std::find(known.of_face.begin(), known.of_face.end(), KnownMaps::kNothing) ==
        known.of_face.end()) {
      std::vector<Points2> uv = flatten_islands(given, surface, adjacency, uncuttable, ChartPins{},
                                                options, acceptable, context, stats, &known);
      return {std::move(given), std::move(uv)};
    }
  }
  const ProgressRange range(context, begin, 1.0);
  std::vector<double> cost = edge_costs(surface, adjacency, uncuttable, options.seams);
  prefer_hidden(cost, surface.faces, exposure(placed, surface.faces, adjacency, context));
  mesh::EdgeFlags never(cost.size(), 0);
  for (std::size_t h = 0; h < cost.size(); ++h) {
    if (known.of_face[h / 3] != KnownMaps::kNothing) cost[h] = mesh::ShortestPaths::kUnreached;
    never[h] = cost[h] == mesh::ShortestPaths::kUnreached ? 1 : 0;
  }
  mesh::EdgeFlags wanted =
      with_sharp_edges(surface, adjacency, seams, never, options.seams.sharp_angle);
  const mesh::EdgeFlags creases = crease_seams(surface, adjacency, wanted, cost);
  for (std::size_t h = 0; h < wanted.size(); ++h) wanted[h] |= creases[h];
  Islands islands = make_islands(surface, adjacency, wanted, uncuttable, false, context,
                                 {{}, positive(surface, cost), false});
  return Finder(surface, adjacency, uncuttable, options, std::move(cost), std::move(islands),
                std::move(known))
      .run(acceptable, context, stats);
}

}  // namespace flipfree::unwrap
