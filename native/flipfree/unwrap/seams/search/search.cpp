#include "flipfree/unwrap/seams/search/search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/chart/stretch.h"
#include "flipfree/unwrap/seams/search/shortened.h"

namespace flipfree::unwrap {
namespace {

// What the least energy exceeds 1 by, as a share of what the scale field promises: shear does what
// conformal maps cannot. The first guess; then it is measured.
constexpr double kFirstShare = 0.3;
constexpr std::size_t kMostAtOnce = 8;
constexpr int kMostSearchRounds = 400;
// A chart that overlaps itself may have to be held apart, which has its price, or divided. Up to so
// often more slits are tried first, with a bound that is tighter by so much.
constexpr int kMostHeld = 3;
constexpr double kTighterWhereHeld = 0.8;
// What a further island costs, as a share of all seams.
constexpr double kPriceOfPiece = 0.03;
// Maps of slits that were made shorter; of the bound, what they aim at; and the share of the cost
// below which they are worth a map.
constexpr int kMostShortened = 4;
constexpr double kAim = 0.97;
constexpr double kWorthMapping = 0.98;
// Before, slits are made down to this share of what the scale field may promise, in so many rounds.
constexpr double kMoreSlits = 0.6;
constexpr int kMostFurther = 4;

Stretch tightened(const Stretch& bound) {
  return {1.0 + kTighterWhereHeld * (bound.energy - 1.0), bound.ratio};
}

double cost_of(const mesh::EdgeFlags& cut, const std::vector<double>& cost) {
  double sum = 0.0;
  for (std::size_t h = 0; h < cut.size(); ++h) {
    if (cut[h] != 0) sum += 0.5 * std::min(cost[h], kForbidden);
  }
  return sum;
}

Index piece_count(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                  const mesh::EdgeFlags& cut) {
  return chart.faces.rows() == 0 ? 0 : mesh::components_between(adjacency, cut).count;
}

}  // namespace

SlitSearch::SlitSearch(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                       const std::vector<double>& cost, const Mirror& mirror,
                       const SlitOptions& options, ExecutionContext& context)
    : chart_(chart),
      adjacency_(adjacency),
      cost_(cost),
      mirror_(mirror),
      options_(options),
      context_(context),
      sheet_(chart, adjacency, cost, mirror),
      map_(chart),
      share_(kFirstShare) {
  for (const double c : cost) uncuttable_.push_back(c == mesh::ShortestPaths::kUnreached ? 1 : 0);
}

Slits SlitSearch::run(const Stretch& bound) {
  options_.bound = bound_ = bound;
  holding_ = 1.0;
  best_ = {};
  held_ = 0;
  try {
    if (sheet_.made().empty()) opened_anyhow_ = sheet_.open_closed(context_);
    for (int round = 0; round < kMostSearchRounds; ++round) {
      const std::vector<double> u = sheet_.scale(context_);
      const double excess = sheet_.excess(u);
      if (share_ * excess <= bound_.energy - 1.0 && is_done(excess)) {
        if (!opened_anyhow_ && best_.corner_uv.rows() > 0 && best_.apart.rows() == 0) shorten();
        break;
      }
      // Near the bound one after another, so as not to do too much.
      if (at_tips_ && slit_tips()) continue;
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

SlitSearch::Shorter SlitSearch::shorter(double most) {
  const auto taken = [&](Sheet& sheet, const Shortened& slits) {
    Shorter result{sheet.edges(slits.ways), sheet.parts(slits.ways), slits.excess, 0.0};
    result.cost = cost_of(result.cut, cost_);
    return result;
  };
  const Shortened own = shortened(sheet_, most, context_);
  Shorter best = taken(sheet_, own);
  Sheet anew(chart_, adjacency_, cost_, mirror_);
  if (!anew.connect(own.ends, context_)) return best;
  const Shortened other = shortened(anew, most, context_);
  if (other.excess > most) return best;
  Shorter rerouted = taken(anew, other);
  return rerouted.cost < best.cost ? rerouted : best;
}

// Slits that were made for the highest hills are not all needed to their ends when the others are
// there. Some more than needed are made first, so that there is a choice.
void SlitSearch::shorten() {
  double share = share_;
  double aim = kAim * (bound_.energy - 1.0) / holding_;
  const double least = stretch_of(chart_, best_.corner_uv).energy - 1.0;
  for (int map = 0; map < kMostShortened; ++map) {
    const double most = aim / share;
    Shorter slits = shorter(most);
    if (map == 0 && slit_further(kMoreSlits * most)) {
      Shorter others = shorter(most);
      if (others.cost < slits.cost && others.excess <= most) slits = std::move(others);
    }
    if (slits.cost > kWorthMapping * best_cost_) return;
    TrialMap trial(chart_);
    Stretch stretch = trial.relax(adjacency_, slits.cut, kTrialTolerance, context_);
    share = (stretch.energy - 1.0) / std::max(slits.excess, 1e-300);
    if (!stretch.within(bound_)) stretch = trial.ease(bound_, context_);
    if (!stretch.within(bound_)) {
      // Halfway back to what keeps the bound.
      if (stretch.energy <= bound_.energy) aim = 0.5 * (aim + least);
      continue;
    }
    Points2 uv = trial.corner_uv();
    if (options_.bijective && trial.overlaps_itself(context_)) {
      TrialMap::Apart held =
          trial.hold_apart(options_.bound, options_.may_add_cuts, uncuttable_, context_);
      if (!held.cut.empty() || !held.stretch.within(options_.bound)) {
        aim *= kTighterWhereHeld;
        continue;
      }
      uv = std::move(held.corner_uv);
    }
    best_ = {std::move(slits.cut), std::move(uv), {}};
    best_cost_ = slits.cost;
    made_ = std::move(slits.made);
    return;
  }
}

bool SlitSearch::slit_tips() {
  const std::vector<double> ratios = ratios_of(chart_, map_.corner_uv());
  return sheet_.slit_best(sheet_.tips(ratios, bound_.ratio), kMostAtOnce, context_);
}

bool SlitSearch::slit_further(double most) {
  bool any = false;
  for (int round = 0; round < kMostFurther; ++round) {
    const std::vector<double> u = sheet_.scale(context_);
    if (sheet_.excess(u) <= most || !sheet_.slit_best(u, kMostAtOnce, context_)) break;
    any = true;
  }
  return any;
}

// True if nothing better than the best candidate is to be expected.
bool SlitSearch::is_done(double excess) {
  Stretch stretch = map_.relax(adjacency_, sheet_.cut(), kTrialTolerance, context_);
  if (excess > 0.0) share_ = (stretch.energy - 1.0) / excess;
  if (!stretch.within(bound_)) stretch = map_.ease(bound_, context_);
  at_tips_ = stretch.energy <= bound_.energy && stretch.ratio > bound_.ratio;
  if (!stretch.within(bound_)) return false;
  const double slit = cost_of(sheet_.cut(), cost_);
  const auto take = [&](Slits slits, double cost) {
    best_ = std::move(slits);
    best_cost_ = cost;
    made_ = sheet_.made();
  };
  if (!best_.cut.empty() && slit >= best_cost_) return true;
  if (!options_.bijective || !map_.overlaps_itself(context_)) {
    take({sheet_.cut(), map_.corner_uv(), {}}, slit);
    return true;
  }
  // Above the bound already, it is not what holding apart is measured by.
  const Stretch most = {stretch.energy <= options_.bound.energy ? options_.bound.energy : kInfinite,
                        options_.bound.ratio};
  TrialMap::Apart held = map_.hold_apart(most, options_.may_add_cuts, uncuttable_, context_);
  if (held.cut.empty()) {
    if (held.stretch.within(options_.bound)) {
      take({sheet_.cut(), std::move(held.corner_uv), {}}, slit);
      holding_ = (held.stretch.energy - 1.0) / std::max(stretch.energy - 1.0, 1e-300);
      return true;
    }
    // Anything that keeps the bound is better.
    if (best_.cut.empty() || best_cost_ == kInfinite)
      take({sheet_.cut(), std::move(held.corner_uv), {}}, kInfinite);
  } else {
    const Index pieces = piece_count(chart_, adjacency_, held.cut);
    const double cost =
        (slit + cost_of(held.cut, cost_)) * (1.0 + kPriceOfPiece * static_cast<double>(pieces - 1));
    if (best_.cut.empty() || cost < best_cost_) {
      for (std::size_t h = 0; h < held.cut.size(); ++h) held.cut[h] |= sheet_.cut()[h];
      take({std::move(held.cut), std::move(held.corner_uv), std::move(held.apart)}, cost);
    }
  }
  bound_ = tightened(bound_);
  return ++held_ > kMostHeld;
}

}  // namespace flipfree::unwrap
