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
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/seams/costs.h"
#include "flipfree/unwrap/seams/sheet.h"

namespace flipfree::unwrap {
namespace {

// The most stretched that a bound leaves out.
constexpr double kShare = 0.01;

double mean_and_unit(const Points3& parts, double& area, double& unit) {
  double direct = 0.0;
  double inverse = 0.0;
  area = 0.0;
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    direct += parts(f, 2) * parts(f, 0);
    inverse += parts(f, 2) * parts(f, 1);
    area += parts(f, 2);
  }
  unit = std::sqrt(inverse) / std::sqrt(direct);  // the best scale's square
  return area > 0.0 ? 0.5 * std::sqrt(direct) * std::sqrt(inverse) / area : 1.0;
}

struct Factors {
  double length = 1.0;
  double area = 1.0;
};

Factors factors(double direct, double inverse, double unit) {
  // The squares' sum of the singular values, and their product.
  const double sum = direct * unit;
  const double product = std::sqrt(direct / inverse) * unit;
  const double larger =
      std::sqrt(0.5 * (sum + std::sqrt(std::max(sum * sum - 4.0 * product * product, 0.0))));
  return {std::max(larger, larger / product), std::max(product, 1.0 / product)};
}

}  // namespace

Stretch stretch_of(const mesh::Surface& surface, const Points2& corner_uv) {
  const Points3 parts = certify::symmetric_dirichlet_parts(surface, corner_uv);
  double area = 0.0;
  double unit = 1.0;
  Stretch result;
  result.energy = mean_and_unit(parts, area, unit);
  if (!(result.energy < kInfinite)) return {kInfinite, kInfinite};
  std::vector<std::pair<double, double>> lengths;  // ratio, area
  std::vector<std::pair<double, double>> areas;
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    const Factors own = factors(parts(f, 0), parts(f, 1), unit);
    lengths.emplace_back(own.length, parts(f, 2));
    areas.emplace_back(own.area, parts(f, 2));
  }
  for (auto* ratios : {&lengths, &areas}) {
    if (ratios->empty()) continue;
    std::sort(ratios->begin(), ratios->end());
    double above = 0.0;
    std::size_t last = ratios->size() - 1;
    while (last > 0 && above + (*ratios)[last].second < kShare * area)
      above += (*ratios)[last--].second;
    result.ratio = std::max(result.ratio, (*ratios)[last].first);
  }
  return result;
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
mesh::Surface slit_surface(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                           const mesh::EdgeFlags& cut) {
  mesh::CutMesh mesh = mesh::cut_along(chart.faces, adjacency, cut);
  mesh::Surface slit;
  slit.faces = std::move(mesh.faces);
  slit.vertices.resize(static_cast<Eigen::Index>(mesh.vertex_origin.size()), 3);
  for (std::size_t v = 0; v < mesh.vertex_origin.size(); ++v)
    slit.vertices.row(static_cast<Eigen::Index>(v)) = chart.vertices.row(mesh.vertex_origin[v]);
  return slit;
}

// The least distorted map of a chart while slits are added to it.
class TrialMap {
 public:
  // The chart must outlive this: connected, planar, with a boundary.
  explicit TrialMap(const mesh::Surface& chart) : chart_(chart) {}

  // The stretch of the chart cut along `cut`, which does not divide it and
  // includes what it was cut along before: relaxed, from the last map where there is one. The map
  // has no flip; it may overlap itself. Throws NotConverged, Cancelled, TimeIsOver.
  Stretch relax(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cut, double tolerance,
                ExecutionContext& context) {
    slit_ = slit_surface(chart_, adjacency, cut);
    Stats ignored;
    if (corner_uv_.rows() == 0) {
      FlattenOptions options;
      options.bijective = false;
      options.acceptable = false;
      options.max_iterations = kFirstSteps;
      options.tolerance = tolerance;
      uv_ = flatten_chart(slit_, options, context, ignored).uv;
    } else {
      distortion::MinimizeOptions options;
      options.max_iterations = kFurtherSteps;
      options.tolerance = tolerance;
      uv_ =
          distortion::minimize_distortion(slit_, by_vertex(slit_, corner_uv_), options, context).uv;
    }
    corner_uv_ = by_corner(slit_.faces, uv_);
    return stretch_of(chart_, corner_uv_);
  }

  const Points2& corner_uv() const { return corner_uv_; }  // empty before the first map
  // Exact, of the last map.
  bool overlaps_itself(const ExecutionContext& context) const {
    return unwrap::overlaps_itself(slit_.faces, uv_, context);
  }

  // The same chart, not on itself, with an energy of at most that of `most` if that can be; else
  // what it is cut along to be divided, with the map that overlaps.
  struct Apart {
    Points2 corner_uv;
    Stretch stretch;
    mesh::EdgeFlags cut;  // empty where it is not divided
  };
  // Precondition: there is a map.
  Apart hold_apart(const Stretch& most, bool may_add_cuts, const mesh::EdgeFlags& uncuttable,
                   ExecutionContext& context) const {
    FlattenOptions options;
    options.may_add_cuts = may_add_cuts;
    options.most_energy = most.energy;
    options.held_steps = kHeldTrialSteps;
    options.tolerated_overlap = kTolerated;
    options.uncuttable = uncuttable;
    options.acceptable = false;
    Stats ignored;
    FlatChart flat = flatten_chart(slit_, options, context, ignored);
    Apart apart;
    apart.corner_uv = by_corner(slit_.faces, flat.uv);
    apart.stretch = stretch_of(chart_, apart.corner_uv);
    apart.cut = std::move(flat.cut);
    return apart;
  }

 private:
  const mesh::Surface& chart_;
  mesh::Surface slit_;  // of the last map
  Points2 uv_;
  Points2 corner_uv_;
};

struct Shortened {
  std::vector<Sheet::Way> ways;  // of the sheet; those that are left
  double excess = 0.0;           // Sheet::excess() with these
};

constexpr int kMostShorteningRounds = 10;
// Of what may still be spent, in a round; when so little is left, or so little was given back, that
// it is done.
constexpr double kSpend = 0.5;
constexpr double kLeft = 0.03;
// Of an end's branch, in a round, and edges in any case.
constexpr double kRetreat = 0.35;
constexpr int kFewEdges = 2;
// Branches of less than this share of all are given back at once, if at all.
constexpr double kStub = 0.04;
// Angle defect of a vertex that is a tip, such as that of a cone: there a slit ends as one expects.
constexpr double kSlitTipDefect = 1.0;

// The part of a way that is left: vertices first .. last.
struct Rest {
  std::size_t first = 0;
  std::size_t last = 0;
};

// What is left of the slits.
struct State {
  std::vector<Rest> rests;
  std::vector<int> degree;  // edges of slits at each vertex
  std::vector<char> open;
  std::size_t edges = 0;
};

// The end of a way, on its way back.
struct End {
  std::size_t way = 0;
  bool front = true;
  double rate = 0.0;   // what a unit of length costs at most so far
  double ratio = 0.0;  // what the next edge costs, for what it gives back
  double gone = 0.0;
  double reach = 0.0;  // how far it may go in this round
  int steps = 0;
};

// The slits of the sheet, each ending sooner or left out, such that excess() is at most `most`: the
// end that costs least for its length goes first, by the first-order response of the scale field
// (ScaleField::respond), and every few steps it is solved. What opens a hole stays, what ends in a
// tip, such as that of a cone, and of a closed chart two edges. The same slits if excess() is above
// `most` already. Cost: some ten factorizations. Throws Cancelled, TimeIsOver.
class Shortener {
 public:
  Shortener(Sheet& sheet, ExecutionContext& context) : sheet_(sheet), context_(context) {
    state_.open = sheet.open();
    state_.degree.assign(state_.open.size(), 0);
    for (const Sheet::Way& way : sheet.ways()) {
      state_.rests.push_back({0, way.vertices.size() - 1});
      state_.edges += way.edges.size();
      for (std::size_t i = 0; i < way.edges.size(); ++i) {
        ++state_.degree[at(way.vertices[i])];
        ++state_.degree[at(way.vertices[i + 1])];
        total_ += length(way, i);
      }
    }
  }

  Shortened run(double most) {
    ScaleField::Response response = sheet_.respond(state_.open, context_);
    double excess = sheet_.excess(response.u);
    double factor = 1.0;  // what is lost, over what was foretold
    for (int round = 0; round < kMostShorteningRounds && most - excess > kLeft * most; ++round) {
      State before = state_;
      const double foretold = retreat(response.closing, kSpend * (most - excess) / factor);
      if (state_.edges == before.edges) break;
      ScaleField::Response next = sheet_.respond(state_.open, context_);
      const double now = sheet_.excess(next.u);
      const double seen = (now - excess) / std::max(foretold, 1e-300);
      if (now <= most) {
        factor = std::clamp(seen, 0.2 * factor, 5.0 * factor);
        excess = now;
        response = std::move(next);
      } else {
        factor = std::clamp(seen, 2.0 * factor, 50.0 * factor);
        state_ = std::move(before);
      }
    }
    return result(excess);
  }

 private:
  double length(const Sheet::Way& way, std::size_t edge) const {
    const Points3& places = sheet_.surface().vertices;
    return (places.row(way.vertices[edge]) - places.row(way.vertices[edge + 1])).norm();
  }
  const Sheet::Way& way_of(const End& end) const { return sheet_.ways()[end.way]; }
  VertexId tip(const End& end) const {
    const Rest& rest = state_.rests[end.way];
    return way_of(end).vertices[end.front ? rest.first : rest.last];
  }
  std::size_t edge_at(const End& end) const {
    const Rest& rest = state_.rests[end.way];
    return end.front ? rest.first : rest.last - 1;
  }
  bool is_end(VertexId v) const { return state_.degree[at(v)] == 1 && !sheet_.on_border(v); }

  void price_of(End& end, const std::vector<double>& closing) const {
    const std::size_t edge = edge_at(end);
    const double step = length(way_of(end), edge);
    const double worth = std::max(sheet_.cost(way_of(end).edges[edge]), 1e-300);
    end.rate = std::max(end.rate, std::max(closing[at(tip(end))], 0.0) / std::max(step, 1e-300));
    end.ratio = end.rate * step / worth;
  }

  // Length from a free end to where its branch begins.
  double branch(End end) const {
    const Rest& rest = state_.rests[end.way];
    const std::vector<VertexId>& vertices = way_of(end).vertices;
    double sum = 0.0;
    std::size_t i = end.front ? rest.first : rest.last;
    do {
      sum += length(way_of(end), end.front ? i : i - 1);
      i = end.front ? i + 1 : i - 1;
    } while (i > rest.first && i < rest.last && state_.degree[at(vertices[i])] == 2);
    return sum;
  }

  // A way and its image after it are taken back together as long as they are the same.
  bool has_image(const End& end) const {
    const std::size_t next = end.way + 1;
    if (!end.front || next == state_.rests.size() || !sheet_.ways()[next].image) return false;
    const Rest& rest = state_.rests[next];
    return rest.first == state_.rests[end.way].first && rest.first != rest.last &&
           is_end(tip({next}));
  }
  bool is_image(const End& end) const {
    return end.front && end.way > 0 && sheet_.ways()[end.way].image && has_image({end.way - 1});
  }

  void add_end(std::vector<End>& ends, std::size_t way, bool front,
               const std::vector<double>& closing) const {
    const Rest& rest = state_.rests[way];
    if (rest.first == rest.last) return;
    End end{way, front};
    if (!is_end(tip(end)) || is_image(end)) return;
    const bool untouched = front ? rest.first == 0 : rest.last + 1 == way_of(end).vertices.size();
    if (untouched && std::abs(sheet_.defect(tip(end))) > kSlitTipDefect) return;
    const double own = branch(end);
    end.reach = own < kStub * total_ ? own : kRetreat * own;
    price_of(end, closing);
    ends.push_back(end);
  }

  // Takes ends back until about `spend` is lost; returns what was foretold for it.
  double retreat(const std::vector<double>& closing, double spend) {
    std::vector<End> ends;
    for (std::size_t w = 0; w < state_.rests.size(); ++w) {
      add_end(ends, w, true, closing);
      add_end(ends, w, false, closing);
    }
    double spent = 0.0;
    const std::size_t least = sheet_.closed() ? 2 : 0;
    while (!ends.empty() && state_.edges > least) {
      const auto best = std::min_element(
          ends.begin(), ends.end(), [](const End& a, const End& b) { return a.ratio < b.ratio; });
      End end = *best;
      ends.erase(best);
      const std::size_t edge = edge_at(end);
      const double step = length(way_of(end), edge);
      const bool both = has_image(end);
      const double price = end.rate * step * (both ? 2.0 : 1.0);
      if (spent + price > spend) continue;
      spent += price;
      if (both) take_back({end.way + 1});
      const VertexId inner = take_back(end);
      end.gone += step;
      ++end.steps;
      Rest& rest = state_.rests[end.way];
      if (rest.first != rest.last && is_end(inner)) {
        if (end.gone >= end.reach && end.steps >= kFewEdges) continue;
        price_of(end, closing);
        ends.push_back(end);
      }
    }
    return spent;
  }

  // One edge; returns the vertex that is the end now.
  VertexId take_back(const End& end) {
    Rest& rest = state_.rests[end.way];
    const VertexId old = tip(end);
    (end.front ? rest.first : rest.last) += end.front ? std::size_t{1} : ~std::size_t{0};
    const VertexId inner = tip(end);
    --state_.edges;
    state_.degree[at(old)] = 0;
    state_.open[at(old)] = 0;
    if (--state_.degree[at(inner)] == 0 && !sheet_.on_border(inner)) state_.open[at(inner)] = 0;
    return inner;
  }

  Shortened result(double excess) const {
    Shortened result;
    result.excess = excess;
    const std::vector<Sheet::Way>& ways = sheet_.ways();
    VertexId root = kInvalid;
    for (std::size_t w = 0; w < ways.size(); ++w) {
      const Rest rest = state_.rests[w];
      const std::vector<VertexId>& vertices = ways[w].vertices;
      if (rest.first == rest.last && !(sheet_.closed() && vertices.size() == 1)) continue;
      const auto begin = static_cast<std::ptrdiff_t>(rest.first);
      const auto end = static_cast<std::ptrdiff_t>(rest.last);
      result.ways.push_back({{vertices.begin() + begin, vertices.begin() + end + 1},
                             {ways[w].edges.begin() + begin, ways[w].edges.begin() + end},
                             ways[w].image});
      if (root == kInvalid && vertices.size() > 1) root = vertices[rest.last];
    }
    if (sheet_.closed() && root != kInvalid && !result.ways.empty() &&
        result.ways.front().edges.empty())
      result.ways.front().vertices = {root};
    return result;
  }

  Sheet& sheet_;
  ExecutionContext& context_;
  State state_;
  double total_ = 0.0;
};

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

// The search for slits on one chart, slit by slit.
class SlitSearch {
 public:
  // As find_slits(); all must outlive this.
  SlitSearch(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
             const std::vector<double>& cost, const Mirror& mirror, const SlitOptions& options,
             ExecutionContext& context)
      : chart_(chart),
        adjacency_(adjacency),
        cost_(cost),
        options_(options),
        context_(context),
        sheet_(chart, adjacency, cost, mirror),
        map_(chart),
        share_(kFirstShare) {
    for (const double c : cost) uncuttable_.push_back(c == mesh::ShortestPaths::kUnreached ? 1 : 0);
  }

  // Slits for this bound: beyond those of the last call, with a lower one.
  Slits run(const Stretch& bound) {
    options_.bound = bound_ = bound;
    holding_ = 1.0;
    best_ = {};
    held_ = 0;
    std::optional<MapInHand> in_hand;
    try {
      if (sheet_.made().empty()) opened_anyhow_ = sheet_.open_closed(context_);
      for (int round = 0; round < kMostSearchRounds; ++round) {
        const std::vector<double> u = sheet_.scale(context_);
        const double excess = sheet_.excess(u);
        if (options_.acceptable && share_ * excess < kBearable) in_hand.emplace(context_);
        if (share_ * excess <= bound_.energy - 1.0 && is_done(excess)) {
          if (!opened_anyhow_ && best_.corner_uv.rows() > 0 && !best_.divided) shorten();
          break;
        }
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
  // The cheaper of these slits and of those that are left of some more.
  void choose_shorter(double most, Shortened& slits) {
    bool any = false;
    for (int round = 0; round < kMostFurther; ++round) {
      const std::vector<double> u = sheet_.scale(context_);
      if (sheet_.excess(u) <= kMoreSlits * most || !sheet_.slit_best(u, kMostAtOnce, context_))
        break;
      any = true;
    }
    if (!any) return;
    Shortened others = Shortener(sheet_, context_).run(most);
    const auto cost = [&](const Shortened& of) { return cost_of(sheet_.edges(of.ways), cost_); };
    if (others.excess <= most && cost(others) < cost(slits)) slits = std::move(others);
  }

  // Slits that were made for the highest hills are not all needed to their ends when the others are
  // there. Some more than needed are made first, so that there is a choice.
  void shorten() {
    double share = share_;
    double aim = kAim * (bound_.energy - 1.0) / holding_;
    const double least = stretch_of(chart_, best_.corner_uv).energy - 1.0;
    for (int map = 0; map < kMostShortened; ++map) {
      const double most = aim / share;
      Shortened slits = Shortener(sheet_, context_).run(most);
      if (map == 0) choose_shorter(most, slits);
      mesh::EdgeFlags cut = sheet_.edges(slits.ways);
      const double cost = cost_of(cut, cost_);
      if (cost > kWorthMapping * best_cost_) return;
      TrialMap trial(chart_);
      const Stretch stretch = trial.relax(adjacency_, cut, kTrialTolerance, context_);
      share = (stretch.energy - 1.0) / std::max(slits.excess, 1e-300);
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
      best_ = {std::move(cut), std::move(uv)};
      best_cost_ = cost;
      made_ = sheet_.parts(slits.ways);
      return;
    }
  }

  // True if nothing better than the best candidate is to be expected.
  bool is_done(double excess) {
    const Stretch stretch = map_.relax(adjacency_, sheet_.cut(), kTrialTolerance, context_);
    if (excess > 0.0) share_ = (stretch.energy - 1.0) / excess;
    if (!stretch.within(bound_)) return false;
    const double slit = cost_of(sheet_.cut(), cost_);
    const auto take = [&](Slits slits, double cost) {
      best_ = std::move(slits);
      best_cost_ = cost;
      made_ = sheet_.made();
    };
    if (!best_.cut.empty() && slit >= best_cost_) return true;
    if (!options_.bijective || !map_.overlaps_itself(context_)) {
      take({sheet_.cut(), map_.corner_uv()}, slit);
      return true;
    }
    // Above the bound already, it is not what holding apart is measured by.
    const Stretch most = {
        stretch.energy <= options_.bound.energy ? options_.bound.energy : kInfinite,
        options_.bound.ratio};
    TrialMap::Apart held = map_.hold_apart(most, options_.may_add_cuts, uncuttable_, context_);
    if (held.cut.empty()) {
      if (held.stretch.within(options_.bound)) {
        take({sheet_.cut(), std::move(held.corner_uv)}, slit);
        holding_ = (held.stretch.energy - 1.0) / std::max(stretch.energy - 1.0, 1e-300);
        return true;
      }
      // Anything that keeps the bound is better.
      if (best_.cut.empty() || best_cost_ == kInfinite)
        take({sheet_.cut(), std::move(held.corner_uv)}, kInfinite);
    } else {
      const Index pieces = piece_count(chart_, adjacency_, held.cut);
      const double cost = (slit + cost_of(held.cut, cost_)) *
                          (1.0 + kPriceOfPiece * static_cast<double>(pieces - 1));
      if (best_.cut.empty() || cost < best_cost_) {
        for (std::size_t h = 0; h < held.cut.size(); ++h) held.cut[h] |= sheet_.cut()[h];
        take({std::move(held.cut), std::move(held.corner_uv), true}, cost);
      }
    }
    bound_ = tightened(bound_);
    return ++held_ > kMostHeld;
  }

  const mesh::Surface& chart_;
  const mesh::Adjacency& adjacency_;
  const std::vector<double>& cost_;
  SlitOptions options_;
  ExecutionContext& context_;
  Sheet sheet_;
  TrialMap map_;
  mesh::EdgeFlags uncuttable_;
  double share_;
  Stretch bound_;         // of maps that may overlap
  double holding_ = 1.0;  // what the best one's energy exceeds 1 by, over the free map's
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
    const double own = edge_length(chart, h);
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
      const mesh::Adjacency adjacency = mesh::build_adjacency(few.surface);
      const std::vector<double> cost = costs_of_few(chart_, few, adjacency, cost_);
      SlitSearch search(few.surface, adjacency, cost, kNoMirror, options_, context_);
      Stretch aim = options_.bound;
      double done = 0.2;
      for (int round = 0; round < kCarryingRounds; ++round) {
        const Slits found = search.run(aim);
        if (search.opened_anyhow()) return {};
        mesh::EdgeFlags cut = carried(few, search.made());
        if (cut.empty()) return {};
        if (best.cut.empty()) best.cut = cut;
        context_.report("finding seams", done);
        const ProgressRange range(context_, done, done + 0.5 * (1.0 - done));
        done += 0.5 * (1.0 - done);
        // What the few need not be divided for may need some more slits, rather than to be divided.
        const bool may_divide =
            options_.may_add_cuts && (found.divided || round + 1 == kCarryingRounds);
        const Stretch stretch = lay_flat(std::move(cut), may_divide, best);
        if (stretch.within(options_.bound) || search.exhausted()) break;
        aim.energy = tighter(aim.energy, stretch.energy, options_.bound.energy);
        aim.ratio = tighter(aim.ratio, stretch.ratio, options_.bound.ratio);
      }
    } catch (const TimeIsOver&) {
      // What is slit by then is slit.
    } catch (const NotConverged&) {
      // Whoever lays the chart flat says why it cannot be.
    }
    return best;
  }

 private:
  // The map of the chart with this cut, held apart or divided where it would lie on itself.
  Stretch lay_flat(mesh::EdgeFlags cut, bool may_divide, Slits& slits) {
    TrialMap map(chart_);
    const Stretch stretch = map.relax(adjacency_, cut, kTrialTolerance, context_);
    slits = {std::move(cut), map.corner_uv()};
    if (!options_.bijective || !map.overlaps_itself(context_)) return stretch;
    TrialMap::Apart apart = map.hold_apart(options_.bound, may_divide, uncuttable_, context_);
    slits.corner_uv = std::move(apart.corner_uv);
    slits.divided = !apart.cut.empty();
    for (std::size_t h = 0; h < apart.cut.size(); ++h) slits.cut[h] |= apart.cut[h];
    return apart.stretch;
  }

  // The slits of the few on the chart; empty if there is no way for one of them.
  mesh::EdgeFlags carried(const mesh::Decimated& few, const Ways& ways) {
    const Grace carrying(context_);
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

// Triangles of a chart above which few of its vertices are searched instead.
constexpr Eigen::Index kLarge = 24000;

}  // namespace

Slits find_slits(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                 const std::vector<double>& cost, const SlitOptions& options,
                 ExecutionContext& context) {
  if (chart.faces.rows() > kLarge) {
    Slits slits = SlitCarrier(chart, adjacency, cost, options, context).run();
    if (!slits.cut.empty()) return slits;
  }
  const Mirror mirror = find_mirror(chart, adjacency, cost);
  const std::vector<double> own = mirror.empty() ? cost : mirrored_costs(chart.faces, mirror, cost);
  return SlitSearch(chart, adjacency, own, mirror, options, context).run(options.bound);
}

}  // namespace flipfree::unwrap
