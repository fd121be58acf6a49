#include "flipfree/unwrap/seams/auto_islands.h"

#include <algorithm>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/certify/measures/energy.h"
#include "flipfree/mesh/cut_graph/shortest_paths.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/unwrap/chart/flattening.h"
#include "flipfree/unwrap/islands/edge_costs.h"
#include "flipfree/unwrap/seams/creases.h"
#include "flipfree/unwrap/seams/slits/slits.h"

namespace flipfree::unwrap {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

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

// Charts are searched again, for what they have become since, with a bound that is tighter by this.
constexpr int kRounds = 4;
constexpr double kTighter = 0.8;

class Finder {
 public:
  Finder(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
         const mesh::EdgeFlags& uncuttable, const UnwrapOptions& options, std::vector<double> cost,
         Islands islands)
      : surface_(surface),
        adjacency_(adjacency),
        uncuttable_(uncuttable),
        options_(options),
        cost_(std::move(cost)),
        islands_(std::move(islands)),
        known_{Points2(3 * surface.faces.rows(), 2), Points2(3 * surface.faces.rows(), 2),
               std::vector<char>(static_cast<std::size_t>(surface.faces.rows()),
                                 KnownMaps::kNothing)} {}

  AutoIslands run(bool acceptable, ExecutionContext& context, Stats& stats) {
    const double bound = energy_bound(options_.seams.stretch);
    double aim = bound;
    std::vector<Points2> uv;
    double begin = 0.0;
    for (int round = 0; round < kRounds; ++round) {
      const double end = begin + 0.5 * (1.0 - begin);
      {
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
      if (!any_above(bound, uv) || context.time_is_over()) break;
      aim = 1.0 + kTighter * (aim - 1.0);
    }
    return {std::move(islands_), std::move(uv)};
  }

 private:
  // Slits for the charts without a map that is known, and maps for those that can have one.
  void search(double aim, ExecutionContext& context) {
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

  void search_chart(const mesh::Chart& chart, double aim, mesh::EdgeFlags& further,
                    ExecutionContext& context) {
    const mesh::InOwnUnit own(chart.surface);
    const mesh::Adjacency local = mesh::build_adjacency(
        static_cast<Index>(chart.surface.vertices.rows()), chart.surface.faces);
    std::vector<double> cost(local.opposite.size());
    for (std::size_t h = 0; h < cost.size(); ++h)
      cost[h] = cost_[in_surface(chart, h)] / own.unit();
    const SlitOptions options{aim, options_.bijective, options_.may_add_cuts};
    const Slits slits = find_slits(own.surface(), local, cost, options, context);
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

  // Takes down the maps, but of charts above the bound. True if there are such.
  bool any_above(double bound, const std::vector<Points2>& uv) {
    bool any = false;
    for (std::size_t c = 0; c < islands_.charts.size(); ++c) {
      const mesh::Chart& chart = islands_.charts[c];
      Points2 corners(chart.surface.faces.size(), 2);
      for (CornerId k = 0; k < corners.rows(); ++k)
        corners.row(k) = uv[c].row(chart.surface.faces.data()[k]);
      const bool above = certify::symmetric_dirichlet(chart.surface, corners).mean > bound;
      any = any || above;
      for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h) {
        const std::size_t corner = in_surface(chart, h);
        known_.of_face[corner / 3] = above ? KnownMaps::kNothing : KnownMaps::kFlat;
        known_.corner_uv.row(static_cast<Eigen::Index>(corner)) =
            corners.row(static_cast<Eigen::Index>(h));
      }
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
};

}  // namespace

AutoIslands find_islands(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                         const mesh::EdgeFlags& seams, const mesh::EdgeFlags& uncuttable,
                         const UnwrapOptions& options, bool acceptable, ExecutionContext& context,
                         Stats& stats) {
  std::vector<double> cost = edge_costs(surface, adjacency, uncuttable, options.seams);
  mesh::EdgeFlags never(cost.size(), 0);
  for (std::size_t h = 0; h < cost.size(); ++h)
    never[h] = cost[h] == mesh::ShortestPaths::kUnreached ? 1 : 0;
  mesh::EdgeFlags wanted =
      with_sharp_edges(surface, adjacency, seams, never, options.seams.sharp_angle);
  const mesh::EdgeFlags creases = crease_seams(surface, adjacency, wanted, cost);
  for (std::size_t h = 0; h < wanted.size(); ++h) wanted[h] |= creases[h];
  Islands islands = make_islands(surface, adjacency, wanted, uncuttable, false, context,
                                 {{}, positive(surface, cost), false});
  return Finder(surface, adjacency, uncuttable, options, std::move(cost), std::move(islands))
      .run(acceptable, context, stats);
}

}  // namespace flipfree::unwrap
