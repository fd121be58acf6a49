#include "flipfree/unwrap/seams/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/decimated/decimated.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/islands/sheet.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/seams/costs.h"

namespace flipfree::unwrap {
namespace {

// Without the most stretched, which a bound leaves out.
constexpr double kShare = 0.99;

}  // namespace

Stretch stretch_of(const mesh::Surface& surface, const Points2& corner_uv) {
  const certify::EnergyFigures figures = certify::symmetric_dirichlet(surface, corner_uv);
  if (std::isnan(figures.mean)) return {};  // no area at all
  if (std::isinf(figures.mean)) return {kInfinite, kInfinite};
  const Points3 parts = certify::symmetric_dirichlet_parts(surface, corner_uv);
  const double unit = figures.scale * figures.scale;
  std::vector<std::pair<double, double>> lengths;  // ratio, area
  std::vector<std::pair<double, double>> areas;
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    // The squares' sum of the singular values, and their product.
    const double sum = parts(f, 0) * unit;
    const double product = std::sqrt(parts(f, 0) / parts(f, 1)) * unit;
    const double larger =
        std::sqrt(0.5 * (sum + std::sqrt(std::max(sum * sum - 4.0 * product * product, 0.0))));
    lengths.emplace_back(std::max(larger, larger / product), parts(f, 2));
    areas.emplace_back(std::max(product, 1.0 / product), parts(f, 2));
  }
  return {figures.mean, std::max({1.0, weighted_percentile(std::move(lengths), kShare),
                                  weighted_percentile(std::move(areas), kShare)})};
}

namespace {

// Of the optimiser, for maps that tell whether the slits are enough.
constexpr double kTrialTolerance = 1e-3;
// From the last map on: what has not settled by then has moved enough to be judged.
constexpr int kFurtherSteps = 12;
constexpr int kFirstSteps = 60;
constexpr int kHeldTrialSteps = 40;
// Share of its area by which a piece may still overlap itself, to be held apart once it is cut.
constexpr double kTolerated = 0.1;

// The chart with its corners separated along `cut` (mesh/cut.h).
mesh::Surface slit_surface(const mesh::Surface& chart, const mesh::EdgeFlags& cut) {
  mesh::CutMesh mesh = mesh::cut_along(chart.faces, chart.adjacency(), cut);
  return {chart.vertices(mesh.vertex_origin, Eigen::all), std::move(mesh.faces)};
}

// The chart along `cut`: not on itself if that is asked, with an energy of at most
// options.most_energy if that can be; else with what it is cut along to be divided as well, and the
// map that overlaps.
Slits lay_flat(const mesh::Surface& chart, mesh::EdgeFlags cut, FlattenOptions options,
               ExecutionContext& context) {
  options.held_steps = kHeldTrialSteps;
  options.tolerated_overlap = kTolerated;
  options.acceptable = false;
  Stats ignored;
  const mesh::Surface slit = slit_surface(chart, cut);
  const FlatChart flat = flatten_chart(slit, options, context, ignored);
  Slits slits{std::move(cut), by_corner(slit.faces, flat.uv), !flat.cut.empty(), {}};
  slits.stretch = stretch_of(chart, slits.corner_uv);
  for (std::size_t h = 0; h < flat.cut.size(); ++h) slits.cut[h] |= flat.cut[h];
  return slits;
}

// What the least energy exceeds 1 by, as a share of what the scale field promises: shear does what
// conformal maps cannot. The first guess; then it is measured.
constexpr double kFirstShare = 0.3;
// Slits that promise less can be accepted: lengths change by a factor of 1.6 one way.
constexpr double kBearable = 0.25;
constexpr std::size_t kMostAtOnce = 8;
constexpr int kMostSearchRounds = 400;
// A chart that overlaps itself may have to be held apart, which has its price, or divided. Up to so
// often more slits are tried first, with a bound that is tighter by so much.
constexpr int kMostHeld = 3;
constexpr double kTighterWhereHeld = 0.8;
// What a further island costs, as a share of all seams.
constexpr double kPriceOfPiece = 0.03;
double cost_of(const mesh::EdgeFlags& cut, const std::vector<double>& cost) {
  double sum = 0.0;
  for (std::size_t h = 0; h < cut.size(); ++h) {
    if (cut[h] != 0) sum += 0.5 * std::min(cost[h], kForbidden);
  }
  return sum;
}

// The search for slits on one chart, slit by slit.
class SlitSearch {
 public:
  // As find_slits(); all must outlive this.
  SlitSearch(const mesh::Surface& chart, const std::vector<double>& cost, const Mirror& mirror,
             const UnwrapOptions& options, ExecutionContext& context)
      : chart_(chart),
        cost_(cost),
        options_(options),
        context_(context),
        sheet_(chart, cost, mirror),
        share_(kFirstShare) {}

  // Slits for this bound: beyond those of the last call, with a lower one.
  Slits run(const Stretch& bound) {
    asked_ = bound_ = bound;
    best_ = {};
    held_ = 0;
    std::optional<MapInHand> in_hand;
    try {
      if (sheet_.made().empty()) opened_anyhow_ = sheet_.open_closed(context_);
      for (int round = 0; round < kMostSearchRounds; ++round) {
        const std::vector<double> u = sheet_.scale(context_);
        const double excess = sheet_.excess(u);
        if (options_.acceptable && share_ * excess < kBearable) in_hand.emplace(context_);
        if (share_ * excess <= bound_.energy - 1.0 && is_done(excess)) break;
        // Near the bound one after another, so as not to do too much.
        const bool near = share_ * excess < 2.0 * (bound_.energy - 1.0);
        if (sheet_.slit_best(u, near ? 1 : kMostAtOnce, context_)) continue;
        bound_ = {kInfinite, kInfinite};  // there is no better
        exhausted_ = true;
        is_done(excess);
        break;
      }
    } catch (const TimeIsOver&) {
      exhausted_ = true;  // what is slit by then is slit
    } catch (const NotConverged&) {
      exhausted_ = true;  // whoever lays the chart flat says why it cannot be
    }
    if (sheet_.open_anyhow(context_)) opened_anyhow_ = true;
    if (best_.cut.empty()) {
      best_.cut = sheet_.cut();
      made_ = sheet_.made();
    }
    return best_;
  }
  // The slits of the last call's result, in the order in which they were made (Sheet::made()).
  const std::vector<std::vector<VertexId>>& made() const { return made_; }
  // Is there nothing left to be slit, or no time?
  bool exhausted() const { return exhausted_; }
  // Was the chart opened in a way that no slit describes?
  bool opened_anyhow() const { return opened_anyhow_; }

 private:
  // Relaxes the map of the chart cut along the slits, from the last one where there is one; it has
  // no flip, and may overlap itself.
  Stretch relax() {
    slit_ = slit_surface(chart_, sheet_.cut());
    Stats ignored;
    if (corner_uv_.rows() == 0) {
      FlattenOptions options;
      options.bijective = false;
      options.acceptable = false;
      options.max_iterations = kFirstSteps;
      options.tolerance = kTrialTolerance;
      uv_ = flatten_chart(slit_, options, context_, ignored).uv;
    } else {
      distortion::MinimizeOptions options;
      options.max_iterations = kFurtherSteps;
      options.tolerance = kTrialTolerance;
      uv_ = distortion::minimize_distortion(slit_, by_vertex(slit_, corner_uv_), options, context_)
                .uv;
    }
    corner_uv_ = by_corner(slit_.faces, uv_);
    return stretch_of(chart_, corner_uv_);
  }

  // True if nothing better than the best candidate is to be expected.
  bool is_done(double excess) {
    const Stretch stretch = relax();
    if (excess > 0.0) share_ = (stretch.energy - 1.0) / excess;
    if (!stretch.within(bound_)) return false;
    const double slit = cost_of(sheet_.cut(), cost_);
    const auto take = [&](Slits slits, double cost) {
      best_ = std::move(slits);
      best_cost_ = cost;
      made_ = sheet_.made();
    };
    if (!best_.cut.empty() && slit >= best_cost_) return true;
    if (!options_.bijective || !overlaps_itself(slit_.faces, uv_, context_)) {
      take({sheet_.cut(), corner_uv_, false, stretch}, slit);
      return true;
    }
    FlattenOptions flatten;
    flatten.may_add_cuts = options_.may_add_cuts;
    // Above the bound already, it is not what holding apart is measured by.
    if (stretch.energy <= asked_.energy) flatten.most_energy = asked_.energy;
    flatten.uncuttable = never_seams(cost_);
    Slits held = lay_flat(chart_, sheet_.cut(), flatten, context_);
    if (!held.divided) {
      if (held.stretch.within(asked_)) {
        take(std::move(held), slit);
        return true;
      }
      // Anything that keeps the bound is better.
      if (best_.cut.empty() || best_cost_ == kInfinite) take(std::move(held), kInfinite);
    } else {
      const Index pieces = mesh::components_between(chart_.adjacency(), held.cut).count;
      const double cost =
          cost_of(held.cut, cost_) * (1.0 + kPriceOfPiece * static_cast<double>(pieces - 1));
      if (best_.cut.empty() || cost < best_cost_) take(std::move(held), cost);
    }
    bound_ = {1.0 + kTighterWhereHeld * (bound_.energy - 1.0), bound_.ratio};
    return ++held_ > kMostHeld;
  }

  const mesh::Surface& chart_;
  const std::vector<double>& cost_;
  const UnwrapOptions& options_;
  ExecutionContext& context_;
  Sheet sheet_;
  mesh::Surface slit_;  // of the last map
  Points2 uv_;
  Points2 corner_uv_;  // no rows before the first map
  double share_;
  Stretch asked_;
  Stretch bound_;  // of maps that may overlap
  int held_ = 0;
  bool exhausted_ = false;
  bool opened_anyhow_ = false;
  Slits best_;
  double best_cost_ = 0.0;
  std::vector<std::vector<VertexId>> made_;  // those of the best
};

// Of a large chart so many triangles are searched.
constexpr Index kFewTriangles = 12000;
constexpr int kCarryingRounds = 4;
// A bound that the chart's own map misses is tightened in proportion, and by this.
constexpr double kTighterForChart = 0.9;

double tighter(double aim, double reached, double most) {
  return reached > most ? 1.0 + kTighterForChart * (aim - 1.0) * (most - 1.0) / (reached - 1.0)
                        : aim;
}

using Ways = std::vector<std::vector<VertexId>>;

// What an edge between the few costs: its length, times the harmonic mean of what the edges around
// its ends cost for theirs, times what its own bend makes of it.
std::vector<double> costs_of_few(const mesh::Surface& chart, const mesh::Decimated& few,
                                 const std::vector<double>& cost) {
  const mesh::Adjacency& adjacency = few.surface.adjacency();
  std::vector<double> length(few.origin.size(), 0.0);
  std::vector<double> cheapness(few.origin.size(), 0.0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const VertexId a = mesh::source(chart.faces, h);
    const VertexId b = mesh::target(chart.faces, h);
    const double own = edge_length(chart, h);
    if (!(own > 0.0) || cost[at(h)] == kInfinite) continue;
    for (const VertexId v : {few.into[at(a)], few.into[at(b)]}) {
      length[at(v)] += own;
      cheapness[at(v)] += own * own / std::max(cost[at(h)], 1e-300);
    }
  }
  const auto price = [&](VertexId v) {
    return cheapness[at(v)] > 0.0 ? length[at(v)] / cheapness[at(v)] : kInfinite;
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
    const double own = edge_length(few.surface, h);
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

// The slits of the few on the chart; empty if there is no way for one of them.
mesh::EdgeFlags carried(const mesh::Surface& chart, std::vector<double> cost,
                        const mesh::Decimated& few, const Ways& ways, ExecutionContext& context) {
  const Grace carrying(context);
  const std::vector<char> near = neighbourhood(few, ways);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    if (near[at(mesh::source(chart.faces, h))] == 0 || near[at(mesh::target(chart.faces, h))] == 0)
      cost[at(h)] = kInfinite;
  }
  Sheet sheet(chart, cost);
  for (const std::vector<VertexId>& way : ways) {
    if (!sheet.slit_between(few.origin[at(way.front())], few.origin[at(way.back())], context))
      return {};
  }
  return sheet.cut();
}

// Of a large chart, by way of fewer triangles; none where these do not tell.
Slits find_by_fewer(const mesh::Surface& chart, const std::vector<double>& cost,
                    const Stretch& bound, const UnwrapOptions& options, ExecutionContext& context) {
  Slits best;
  try {
    context.report("finding seams", 0.0);
    const mesh::Decimated few = mesh::decimate(chart, kFewTriangles, context);
    const std::vector<double> cost_of_few = costs_of_few(chart, few, cost);
    SlitSearch search(few.surface, cost_of_few, kNoMirror, options, context);
    Stretch aim = bound;
    double done = 0.2;
    for (int round = 0; round < kCarryingRounds; ++round) {
      const Slits found = search.run(aim);
      if (search.opened_anyhow()) return {};
      mesh::EdgeFlags cut = carried(chart, cost, few, search.made(), context);
      if (cut.empty()) return {};
      if (best.cut.empty()) best.cut = cut;
      context.report("finding seams", done);
      const ProgressRange range(context, done, done + 0.5 * (1.0 - done));
      done += 0.5 * (1.0 - done);
      // What the few need not be divided for may need some more slits, rather than to be divided.
      FlattenOptions flatten;
      flatten.bijective = options.bijective;
      flatten.may_add_cuts =
          options.may_add_cuts && (found.divided || round + 1 == kCarryingRounds);
      flatten.most_energy = bound.energy;
      flatten.uncuttable = never_seams(cost);
      flatten.tolerance = kTrialTolerance;
      best = lay_flat(chart, std::move(cut), flatten, context);
      if (best.stretch.within(bound) || search.exhausted()) break;
      aim.energy = tighter(aim.energy, best.stretch.energy, bound.energy);
      aim.ratio = tighter(aim.ratio, best.stretch.ratio, bound.ratio);
    }
  } catch (const TimeIsOver&) {
    // What is slit by then is slit.
  } catch (const NotConverged&) {
    // Whoever lays the chart flat says why it cannot be.
  }
  return best;
}

}  // namespace

Slits find_slits(const mesh::Surface& chart, const std::vector<double>& cost, const Stretch& bound,
                 const UnwrapOptions& options, ExecutionContext& context) {
  if (chart.faces.rows() > kManyFaces) {
    Slits slits = find_by_fewer(chart, cost, bound, options, context);
    if (!slits.cut.empty()) return slits;
  }
  const Mirror mirror = find_mirror(chart, cost);
  const std::vector<double> own = mirrored_costs(chart.faces, mirror, cost);
  return SlitSearch(chart, own, mirror, options, context).run(bound);
}

}  // namespace flipfree::unwrap
