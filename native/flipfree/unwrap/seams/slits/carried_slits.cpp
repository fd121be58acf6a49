#include "flipfree/unwrap/seams/slits/carried_slits.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/decimated/decimated.h"
#include "flipfree/unwrap/islands/edge_costs.h"
#include "flipfree/unwrap/seams/slits/level_map.h"

namespace flipfree::unwrap {
namespace {

constexpr int kCarryingRounds = 4;
// A bound that the chart's own map misses is tightened in proportion, and by this.
constexpr double kTighterForChart = 0.9;
constexpr double kNever = std::numeric_limits<double>::infinity();

double tighter(double aim, double reached, double most) {
  return reached > most ? 1.0 + kTighterForChart * (aim - 1.0) * (most - 1.0) / (reached - 1.0)
                        : aim;
}

using Ways = std::vector<std::vector<VertexId>>;

// What an edge between the few costs: its length, times the harmonic mean of what the edges around
// its ends cost for theirs, times what its own bend makes of it.
std::vector<double> costs_of_few(const mesh::Surface& chart, const mesh::Decimated& few,
                                 const mesh::Adjacency& adjacency,
                                 const std::vector<double>& cost) {
  std::vector<double> length(few.origin.size(), 0.0);
  std::vector<double> cheapness(few.origin.size(), 0.0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const VertexId a = mesh::source(chart.faces, h);
    const VertexId b = mesh::target(chart.faces, h);
    const double own = (chart.vertices.row(a) - chart.vertices.row(b)).norm();
    if (!(own > 0.0) || cost[at(h)] == kNever) continue;
    for (const VertexId v : {few.into[at(a)], few.into[at(b)]}) {
      length[at(v)] += own;
      cheapness[at(v)] += own * own / std::max(cost[at(h)], 1e-300);
    }
  }
  const auto price = [&](VertexId v) {
    return cheapness[at(v)] > 0.0 ? length[at(v)] / cheapness[at(v)] : kNever;
  };
  std::vector<double> result(adjacency.opposite.size());
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(result.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid && o < h) {
      result[at(h)] = result[at(o)];
      continue;
    }
    const VertexId a = mesh::source(few.surface.faces, h);
    const VertexId b = mesh::target(few.surface.faces, h);
    const double own = (few.surface.vertices.row(a) - few.surface.vertices.row(b)).norm();
    const double bend = o == kInvalid ? 1.0 : bend_factor(few.surface, h, o);
    result[at(h)] = own > 0.0 ? 0.5 * (price(a) + price(b)) * own * bend : 0.0;
  }
  return result;
}

// Vertices of the chart that went into those along the ways, or into their neighbours.
std::vector<char> neighbourhood(const mesh::Decimated& few, const Ways& ways) {
  const auto own = static_cast<VertexId>(few.origin.size());
  std::vector<char> along(few.origin.size(), 0);
  for (const std::vector<VertexId>& way : ways) {
    for (const VertexId v : way) {
      if (v < own) along[at(v)] = 1;
    }
  }
  std::vector<char> near = along;
  for (Eigen::Index f = 0; f < few.surface.faces.rows(); ++f) {
    const auto face = few.surface.faces.row(f);
    if (along[at(face[0])] == 0 && along[at(face[1])] == 0 && along[at(face[2])] == 0) continue;
    for (Index k = 0; k < 3; ++k) near[at(face[k])] = 1;
  }
  std::vector<char> of_chart(few.into.size());
  for (std::size_t v = 0; v < of_chart.size(); ++v) of_chart[v] = near[at(few.into[v])];
  return of_chart;
}

class SlitCarrier {
 public:
  SlitCarrier(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
              const std::vector<double>& cost, const SlitOptions& options,
              ExecutionContext& context)
      : chart_(chart), adjacency_(adjacency), cost_(cost), options_(options), context_(context) {
    for (const double c : cost) uncuttable_.push_back(c == kNever ? 1 : 0);
  }

  Slits run() {
    Slits best;
    try {
      context_.report("finding seams", 0.0);
      const mesh::Decimated few = mesh::decimate(chart_, kFewTriangles, context_);
      const mesh::Adjacency adjacency =
          mesh::build_adjacency(static_cast<Index>(few.surface.vertices.rows()), few.surface.faces);
      const std::vector<double> cost = costs_of_few(chart_, few, adjacency, cost_);
      SlitSearch search(few.surface, adjacency, cost, kNoMirror, options_, context_);
      Stretch aim = options_.bound;
      double done = 0.2;
      for (int round = 0; round < kCarryingRounds; ++round) {
        const Slits found = search.run(aim);
        if (search.opened_anyhow()) return {};
        context_.report("finding seams", done);
        mesh::EdgeFlags cut = carried(few, search.made());
        if (cut.empty()) return {};
        if (best.cut.empty()) best.cut = cut;
        const ProgressRange range(context_, done, done + 0.5 * (1.0 - done));
        done += 0.5 * (1.0 - done);
        // What the few need not be divided for may need some more slits, rather than to be divided.
        SlitOptions own = options_;
        own.may_add_cuts =
            options_.may_add_cuts && (found.apart.rows() > 0 || round + 1 == kCarryingRounds);
        LevelMap map = map_by_levels(chart_, adjacency_, cut, uncuttable_, own, context_);
        best = std::move(map.slits);
        if (map.stretch.within(options_.bound) || search.exhausted()) break;
        aim.energy = tighter(aim.energy, map.stretch.energy, options_.bound.energy);
        aim.ratio = tighter(aim.ratio, map.stretch.ratio, options_.bound.ratio);
      }
    } catch (const TimeIsOver&) {
      // What is slit by then is slit.
    } catch (const NotConverged&) {
      // Whoever lays the chart flat says why it cannot be.
    }
    return best;
  }

 private:
  // The slits of the few on the chart; empty if there is no way for one of them.
  mesh::EdgeFlags carried(const mesh::Decimated& few, const Ways& ways) {
    const Untimed carrying(context_);
    const std::vector<char> near = neighbourhood(few, ways);
    std::vector<double> cost = cost_;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
      if (near[at(mesh::source(chart_.faces, h))] == 0 ||
          near[at(mesh::target(chart_.faces, h))] == 0)
        cost[at(h)] = kNever;
    }
    Sheet sheet(chart_, adjacency_, cost);
    for (const std::vector<VertexId>& way : ways) {
      if (!sheet.slit_between(few.origin[at(way.front())], few.origin[at(way.back())], context_))
        return {};
    }
    return sheet.cut();
  }

  const mesh::Surface& chart_;
  const mesh::Adjacency& adjacency_;
  const std::vector<double>& cost_;
  const SlitOptions& options_;
  ExecutionContext& context_;
  mesh::EdgeFlags uncuttable_;
};

}  // namespace

Slits carried_slits(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                    const std::vector<double>& cost, const SlitOptions& options,
                    ExecutionContext& context) {
  return SlitCarrier(chart, adjacency, cost, options, context).run();
}

}  // namespace flipfree::unwrap
