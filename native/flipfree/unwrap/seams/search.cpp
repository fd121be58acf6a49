#include "flipfree/unwrap/seams/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/mesh/decimated/decimated.h"
#include "flipfree/mesh/shortest_paths.h"
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

using Ways = std::vector<std::vector<VertexId>>;

// Hills with at least this share of the best one's gain for its length are slit in the same round.
constexpr double kNearlyBest = 0.5;

// Moves the longest loop to the end.
mesh::Surface filled_but_for_longest(const mesh::Surface& chart,
                                     std::vector<std::vector<HalfedgeId>>& loops) {
  std::swap(loops.back(), loops[longest_loop(chart, loops)]);
  return mesh::fill_holes(chart, {loops.begin(), loops.end() - 1});
}

// The chart with its holes filled by fans, which cost nothing to cross, but for the longest loop;
// or all its holes are open as that loop is. A closed chart is open at one vertex to begin with.
class Sheet {
 public:
  enum class Holes { kFilled, kOpen };

  // chart: connected, planar; must outlive this. cost: per half-edge, both sides the same, infinite
  // where no slit may run. mirror: of the chart, may be empty; otherwise every slit comes with its
  // image, as far as that leads to what is open.
  Sheet(const mesh::Surface& chart, const std::vector<double>& cost,
        const Mirror& mirror = kNoMirror, Holes holes = Holes::kFilled)
      : chart_(chart),
        mirror_(mirror),
        loops_(mesh::boundary_halfedge_loops(chart.faces, chart.adjacency())),
        real_(static_cast<HalfedgeId>(cost.size())),
        surface_(holes == Holes::kOpen || loops_.empty() ? chart
                                                         : filled_but_for_longest(chart, loops_)),
        adjacency_(surface_.adjacency()),
        cost_(adjacency_.opposite.size(), 0.0),
        area_(adjacency_.vertex_halfedge.size(), 0.0),
        open_(adjacency_.vertex_halfedge.size(), 0),
        loop_of_(adjacency_.vertex_halfedge.size(), kInvalid),
        cut_(cost.size(), 0),
        paths_(surface_.faces, adjacency_, cost_) {
    for (std::size_t h = 0; h < cost.size(); ++h) {
      const HalfedgeId o = adjacency_.opposite[h];
      if (o < real_) cost_[h] = cost[h];
    }
    for (FaceId f = 0; f < chart.faces.rows(); ++f) {
      const double area = chart.area_vector(f).norm() / 6.0;
      for (Index k = 0; k < 3; ++k) area_[at(chart.faces(f, k))] += area;
    }
    double total = 0.0;
    for (const double a : area_) total += a;
    for (double& a : area_) a /= total;
    if (holes == Holes::kOpen) {
      for (VertexId v = 0; v < chart.vertices.rows(); ++v)
        if (mesh::rotate_cw(adjacency_, adjacency_.vertex_halfedge[at(v)]) == kInvalid)
          open_vertex(v);
      return;
    }
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      for (const HalfedgeId h : loops_[i])
        loop_of_[at(mesh::source(chart.faces, h))] = static_cast<Index>(i);
    }
    if (!loops_.empty()) open_vertex(mesh::source(chart.faces, loops_.back().front()));
  }

  // A closed chart is slit between two hills: no slit ends in the middle of nowhere. True if it had
  // to be opened anyhow.
  bool open_closed(ExecutionContext& context) {
    if (!loops_.empty()) return false;
    const VertexId first = chart_.faces.triangles().minCoeff();
    open_[at(first)] = 1;
    const VertexId peak = steepest(scale(context), first);
    open_[at(first)] = 0;
    // A slit between a hill and its image crosses the plane.
    const VertexId root = nearest_on_plane(peak, context);
    open_vertex(root);
    ways_.push_back({{root}, {}});
    const std::vector<double> u = scale(context);
    paths_.grow(context);
    const VertexId end = root == peak ? steepest(u, root) : peak;
    if (edges_to(end) >= (root == peak ? 2 : 1)) {
      slit_to(end, context);
      return false;
    }
    return open_anyhow(context);
  }

  // A closed chart has to be opened, also where there is no time to choose where. True if it was.
  bool open_anyhow(ExecutionContext& context) {
    if (!loops_.empty() || any_flag(cut_)) return false;
    const Grace opening(context);
    cut_ = mesh::planar_cut(chart_, adjacency_, context, {}, {}, positive(chart_, cost_));
    for (HalfedgeId h = 0; h < real_; ++h) {
      if (cut_[at(h)] != 0) open_vertex(mesh::source(surface_.faces, h));
    }
    return true;
  }

  // The scale field for what is open now, #V of the filled chart.
  std::vector<double> scale(ExecutionContext& context) const {
    return scale_field(surface_, open_, context);
  }

  // What the energy of the conformal map with this scale exceeds 1 by, at the best unit.
  double excess(const std::vector<double>& u) const {
    double growing = 0.0;
    double shrinking = 0.0;
    for (std::size_t v = 0; v < u.size(); ++v) {
      growing += area_[v] * std::exp(2.0 * u[v]);
      shrinking += area_[v] * std::exp(-2.0 * u[v]);
    }
    return std::sqrt(growing * shrinking) - 1.0;
  }

  // Slits to the hills that are worth most for their length. False if there is none.
  bool slit_best(const std::vector<double>& u, std::size_t most, ExecutionContext& context) {
    paths_.grow(context);
    std::vector<std::pair<double, VertexId>> ends;  // less what they are worth
    std::vector<char> reach(open_.size());
    for (VertexId v = 0; v < static_cast<VertexId>(reach.size()); ++v)
      reach[at(v)] = paths_.distance(v) < mesh::ShortestPaths::kUnreached ? 1 : 0;
    for (const Hill& hill : hills(surface_, u, area_, reach)) {
      const double length = paths_.distance(hill.peak);
      if (!(hill.gain > 0.0)) continue;
      ends.emplace_back(-hill.gain / std::max(length, 1e-300), hill.peak);
    }
    std::sort(ends.begin(), ends.end());
    for (std::size_t i = 0; i < std::min(ends.size(), most); ++i) {
      if (ends[i].first > kNearlyBest * ends[0].first) break;
      slit_to(ends[i].second, context);
    }
    return !ends.empty();
  }

  // The shortest slit to a vertex from what is open; nothing where there is no way.
  void slit_to(VertexId end, ExecutionContext& context) {
    paths_.grow(context);
    Way way;
    VertexId begin = end;
    for (; paths_.arrival(begin) != kInvalid; begin = paths_.before(begin)) {
      way.vertices.push_back(begin);
      way.edges.push_back(paths_.arrival(begin));
    }
    if (way.edges.empty()) return;
    way.vertices.push_back(begin);
    take(std::move(way));
    if (!mirror_.empty()) slit_image(ways_.back());
  }

  // A shortest slit between two vertices, one of which is open. The same vertex twice: where a
  // closed chart is opened first. False if there is no way.
  bool slit_between(VertexId end, VertexId begin, ExecutionContext& context) {
    if (end == begin) {
      if (loops_.empty()) open_vertex(end);
      return true;
    }
    paths_.grow(context);
    // Which loop of a chart is its outer one may differ.
    const VertexId closed = open_[at(end)] == 0 ? end : begin;
    if (open_[at(closed)] != 0) return true;
    if (paths_.distance(closed) == mesh::ShortestPaths::kUnreached) return false;
    slit_to(closed, context);
    return true;
  }

  // The slits' parts on the chart, each along vertices from where it began to its end, in the order
  // in which they were made; where a closed chart was opened first is a slit of one vertex.
  Ways made() const {
    Ways result;
    for (const Way& slit : ways_) {
      std::vector<VertexId> part;
      const auto end_part = [&] {
        if (part.size() > 1 || slit.edges.empty()) result.push_back(part);
        part.clear();
      };
      for (auto v = slit.vertices.rbegin(); v != slit.vertices.rend(); ++v) {
        if (*v < chart_.vertices.rows()) {
          part.push_back(*v);
        } else {
          end_part();
        }
      }
      end_part();
    }
    return result;
  }

  const mesh::EdgeFlags& cut() const { return cut_; }

 private:
  using Loops = std::vector<std::vector<HalfedgeId>>;
  // Along a slit, also across holes.
  struct Way {
    std::vector<VertexId> vertices;  // of the filled chart
    std::vector<HalfedgeId> edges;   // between them
  };

  // The peak of the hill with the largest gain, that a slit may end in; `otherwise` if there is
  // none.
  VertexId steepest(const std::vector<double>& u, VertexId otherwise) const {
    Hill best{otherwise, 0.0};
    std::vector<char> reach(open_.size(), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h) {
      if (cost_[at(h)] < mesh::ShortestPaths::kUnreached)
        reach[at(mesh::source(surface_.faces, h))] = 1;
    }
    for (const Hill& hill : hills(surface_, u, area_, reach)) {
      if (hill.gain > best.gain) best = hill;
    }
    return best.peak;
  }

  int edges_to(VertexId v) const {
    int count = 0;
    for (; paths_.arrival(v) != kInvalid; v = paths_.before(v)) ++count;
    return count;
  }

  void open_vertex(VertexId v) {
    if (open_[at(v)] != 0) return;
    open_[at(v)] = 1;
    paths_.add_source(v);
    if (loop_of_[at(v)] == kInvalid) return;
    // A vertex is on one loop, which is taken before the others on it ask for it again.
    for (const HalfedgeId h : std::exchange(loops_[at(loop_of_[at(v)])], {}))
      open_vertex(mesh::source(surface_.faces, h));
  }

  // Up to where it meets what is open: the slit itself where both cross the plane.
  void slit_image(const Way& way) {
    Way image;
    for (std::size_t i = 0; i < way.vertices.size(); ++i) {
      if (way.vertices[i] >= chart_.vertices.rows()) return;  // across a hole
      const VertexId v = mirror_.image[at(way.vertices[i])];
      image.vertices.push_back(v);
      if (open_[at(v)] != 0) break;
      if (i == way.edges.size() || mirror_.edge[at(way.edges[i])] == kInvalid) return;
      image.edges.push_back(mirror_.edge[at(way.edges[i])]);
    }
    if (!image.edges.empty()) take(std::move(image));
  }

  VertexId nearest_on_plane(VertexId v, const ExecutionContext& context) const {
    if (mirror_.empty() || mirror_.image[at(v)] == v) return v;
    mesh::ShortestPaths from(surface_.faces, adjacency_, cost_);
    from.add_source(v);
    from.grow(context);
    VertexId nearest = v;
    double least = mesh::ShortestPaths::kUnreached;
    for (VertexId w = 0; w < static_cast<VertexId>(mirror_.image.size()); ++w) {
      if (mirror_.image[at(w)] != w || from.distance(w) >= least) continue;
      least = from.distance(w);
      nearest = w;
    }
    return nearest;
  }

  void take(Way way) {
    for (const VertexId v : way.vertices) open_vertex(v);
    for (const HalfedgeId h : way.edges) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (h < real_ && o < real_ && o != kInvalid) cut_[at(h)] = cut_[at(o)] = 1;
    }
    ways_.push_back(std::move(way));
  }

  const mesh::Surface& chart_;
  const Mirror& mirror_;
  Loops loops_;  // of the chart, the outer one last
  HalfedgeId real_;
  mesh::Surface surface_;
  const mesh::Adjacency& adjacency_;
  std::vector<double> cost_;
  std::vector<double> area_;  // per vertex, a share of the chart's
  std::vector<char> open_;    // on the outside, or on what leads there
  std::vector<Index> loop_of_;
  mesh::EdgeFlags cut_;
  mesh::ShortestPaths paths_;
  std::vector<Way> ways_;
};

}  // namespace

std::vector<double> positive(const mesh::Surface& surface, std::vector<double> cost) {
  constexpr double kLeast = 1e-12;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const double most = std::max(kForbidden * edge_length(surface, h), kLeast);
    cost[at(h)] = std::clamp(cost[at(h)], kLeast, most);
  }
  return cost;
}

namespace {

// A peak is high where lengths would shrink or grow by e^2, about 7; it stands out by e^1.5. On the
// shared corpus this brings the energy of closed models from 1.1 - 4.6 to 1.02 - 1.15
// (benchmarks/unwrap.py corpus); lower values add seams for a per cent of energy.
constexpr double kHigh = 2.0;
constexpr double kProminence = 1.5;
// Slits lower the peaks beside them; what is left after so many rounds is small.
constexpr int kSlitRounds = 4;

mesh::EdgeFlags cut_to_extremities(const mesh::Surface& chart, const mesh::EdgeFlags& uncuttable,
                                   ExecutionContext& context) {
  std::vector<double> length;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(chart.faces.size()); ++h)
    length.push_back(!uncuttable.empty() && uncuttable[at(h)] ? mesh::ShortestPaths::kUnreached
                                                              : edge_length(chart, h));
  const std::vector<double> even(at(chart.vertices.rows()), 1.0);
  const std::vector<char> all(even.size(), 1);
  Sheet sheet(chart, length, kNoMirror, Sheet::Holes::kOpen);
  for (int round = 0; round < kSlitRounds; ++round) {
    std::vector<Hill> ends = hills(chart, sheet.scale(context), even, all);
    std::erase_if(ends, [](const Hill& hill) {
      return !(hill.height > kHigh && hill.height - hill.foot > kProminence);
    });
    if (ends.empty()) break;
    std::sort(ends.begin(), ends.end(), [](const Hill& a, const Hill& b) {
      return a.height != b.height ? a.height > b.height : a.peak < b.peak;
    });
    for (const Hill& hill : ends) sheet.slit_to(hill.peak, context);
  }
  return sheet.cut();
}

}  // namespace

void slit_to_extremities(Islands& islands, const mesh::Surface& surface,
                         const mesh::EdgeFlags& uncuttable, ExecutionContext& context) {
  mesh::EdgeFlags further(islands.added.size(), 0);
  for (const mesh::Chart& chart : islands.charts) {
    context.check();
    if (any_flag(part_of(chart, islands.added)))
      put_part(chart, cut_to_extremities(chart.surface, part_of(chart, uncuttable), context),
               further);
  }
  if (any_flag(further)) cut_further(islands, surface, further);
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
    bool ended = false;
    Stats ignored;
    // What is slit by the end of the time is slit, and whoever lays the chart flat says why it
    // cannot be.
    improve_in_time(context_, ignored, [&] {
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
      ended = true;
    });
    exhausted_ = exhausted_ || !ended;
    if (sheet_.open_anyhow(context_)) opened_anyhow_ = true;
    if (best_.cut.empty()) {
      best_.cut = sheet_.cut();
      made_ = sheet_.made();
    }
    return best_;
  }
  // The slits of the last call's result, in the order in which they were made (Sheet::made()).
  const Ways& made() const { return made_; }
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
  Ways made_;  // those of the best
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

// What an edge between the few costs: its length, times the harmonic mean of what the edges around
// its ends cost for theirs, times what its own bend makes of it.
std::vector<double> costs_of_few(const mesh::Surface& chart, const mesh::Decimated& few,
                                 const std::vector<double>& cost) {
  std::vector<double> length(few.origin.size(), 0.0);
  std::vector<double> cheapness(few.origin.size(), 0.0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const double own = edge_length(chart, h);
    if (!(own > 0.0) || cost[at(h)] == kInfinite) continue;
    for (const VertexId v : {mesh::source(chart.faces, h), mesh::target(chart.faces, h)}) {
      length[at(few.into[at(v)])] += own;
      cheapness[at(few.into[at(v)])] += own * own / std::max(cost[at(h)], 1e-300);
    }
  }
  const auto price = [&](VertexId v) {
    return cheapness[at(v)] > 0.0 ? length[at(v)] / cheapness[at(v)] : kInfinite;
  };
  std::vector<double> result = edge_costs(few.surface, {}, {});
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(result.size()); ++h)
    if (result[at(h)] > 0.0)
      result[at(h)] *= 0.5 * (price(mesh::source(few.surface.faces, h)) +
                              price(mesh::target(few.surface.faces, h)));
  return result;
}

// The slits of the few on the chart; empty if there is no way for one of them.
mesh::EdgeFlags carried(const mesh::Surface& chart, std::vector<double> cost,
                        const mesh::Decimated& few, const Ways& ways, ExecutionContext& context) {
  const Grace carrying(context);
  std::vector<char> near(few.origin.size(), 0);  // on the ways, or a neighbour of what is
  for (const std::vector<VertexId>& way : ways) {
    for (const VertexId v : way) {
      near[at(v)] = 1;
      mesh::for_each_outgoing(few.surface.adjacency(), v, [&](HalfedgeId h) {
        near[at(mesh::target(few.surface.faces, h))] = 1;
        near[at(mesh::source(few.surface.faces, previous_corner(h)))] = 1;
      });
    }
  }
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    for (const VertexId v : {mesh::source(chart.faces, h), mesh::target(chart.faces, h)})
      if (near[at(few.into[at(v)])] == 0) cost[at(h)] = kInfinite;
  }
  Sheet sheet(chart, cost);
  for (const std::vector<VertexId>& way : ways) {
    if (!sheet.slit_between(few.origin[at(way.back())], few.origin[at(way.front())], context))
      return {};
  }
  return sheet.cut();
}

// Of a large chart, by way of fewer triangles; none where these do not tell.
Slits find_by_fewer(const mesh::Surface& chart, const std::vector<double>& cost,
                    const Stretch& bound, const UnwrapOptions& options, ExecutionContext& context) {
  Slits best;
  Stats ignored;
  improve_in_time(context, ignored, [&] {
    context.report("finding seams", 0.0);
    const mesh::Decimated few = mesh::decimate(chart, kFewTriangles, context);
    const std::vector<double> cost_of_few = costs_of_few(chart, few, cost);
    SlitSearch search(few.surface, cost_of_few, kNoMirror, options, context);
    Stretch aim = bound;
    double done = 0.2;
    for (int round = 0; round < kCarryingRounds; ++round) {
      const Slits found = search.run(aim);
      mesh::EdgeFlags cut;
      if (!search.opened_anyhow()) cut = carried(chart, cost, few, search.made(), context);
      if (cut.empty()) {
        best = {};
        return;
      }
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
  });
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
