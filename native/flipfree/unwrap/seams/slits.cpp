#include "flipfree/unwrap/seams/slits.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/cut_graph/cut_graph.h"
#include "flipfree/mesh/cut_graph/fill.h"
#include "flipfree/mesh/cut_graph/shortest_paths.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/islands/scale_field.h"
#include "flipfree/unwrap/seams/hills.h"
#include "flipfree/unwrap/seams/trial_map.h"

namespace flipfree::unwrap {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// What the least energy exceeds 1 by, as a share of what the scale field promises: shear does what
// conformal maps cannot. The first guess; then it is measured.
constexpr double kFirstShare = 0.3;
// Hills with at least this share of the best one's gain for its length are slit in the same round.
constexpr double kNearlyBest = 0.5;
constexpr std::size_t kMostAtOnce = 8;
constexpr int kMostRounds = 400;
constexpr double kTolerance = 1e-3;
// A chart that overlaps itself may have to be held apart, which has its price, or divided. Up to so
// often more slits are tried first, with a bound that is tighter by so much.
constexpr int kMostHeld = 3;
constexpr double kTighter = 0.8;
// What a further island costs, as a share of all seams.
constexpr double kPriceOfPiece = 0.03;
// Edges that must not be seams, where there is no other way to open a closed surface.
constexpr double kForbidden = 1e6;
constexpr double kLeastCost = 1e-12;

// The chart with its holes filled by fans, which cost nothing to cross, but for the longest loop. A
// closed chart is open at one vertex to begin with.
class Sheet {
 public:
  Sheet(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
        const std::vector<double>& cost)
      : loops_(outer_loop_last(chart, mesh::boundary_halfedge_loops(chart.faces, adjacency))),
        real_(static_cast<HalfedgeId>(adjacency.opposite.size())),
        surface_(loops_.empty()
                     ? chart
                     : mesh::fill_holes(chart, {loops_.begin(), loops_.end() - 1}).surface),
        adjacency_(
            mesh::build_adjacency(static_cast<Index>(surface_.vertices.rows()), surface_.faces)),
        scale_(surface_, adjacency_),
        cost_(adjacency_.opposite.size(), 0.0),
        area_(adjacency_.vertex_halfedge.size(), 0.0),
        open_(adjacency_.vertex_halfedge.size(), 0),
        loop_of_(adjacency_.vertex_halfedge.size(), kInvalid),
        cut_(adjacency.opposite.size(), 0),
        paths_(surface_.faces, adjacency_, cost_) {
    for (std::size_t h = 0; h < cost.size(); ++h) {
      const HalfedgeId o = adjacency_.opposite[h];
      if (o < real_) cost_[h] = cost[h];
    }
    for (FaceId f = 0; f < chart.faces.rows(); ++f) {
      const Vector3 p = chart.vertices.row(chart.faces(f, 0));
      const double area = (chart.vertices.row(chart.faces(f, 1)).transpose() - p)
                              .cross(chart.vertices.row(chart.faces(f, 2)).transpose() - p)
                              .norm() /
                          6.0;
      for (Index k = 0; k < 3; ++k) area_[at(chart.faces(f, k))] += area;
    }
    double total = 0.0;
    for (const double a : area_) total += a;
    for (double& a : area_) a /= total;
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      for (const HalfedgeId h : loops_[i])
        loop_of_[at(mesh::source(chart.faces, h))] = static_cast<Index>(i);
    }
    if (!loops_.empty()) open_loop(static_cast<Index>(loops_.size()) - 1);
  }

  // A closed chart is slit between two hills: no slit ends in the middle of nowhere.
  void open_closed(const mesh::Surface& chart, ExecutionContext& context) {
    if (!loops_.empty()) return;
    const auto used =
        std::find_if(adjacency_.vertex_halfedge.begin(), adjacency_.vertex_halfedge.end(),
                     [](HalfedgeId h) { return h != kInvalid; });
    const auto first = static_cast<std::size_t>(used - adjacency_.vertex_halfedge.begin());
    open_[first] = 1;
    const VertexId root = steepest(scale(context), static_cast<VertexId>(first));
    open_[first] = 0;
    open_vertex(root);
    const std::vector<double> u = scale(context);
    paths_.grow(context);
    const VertexId end = steepest(u, root);
    if (edges_to(end) >= 2) {
      slit_to(end);
      return;
    }
    open_anyhow(chart, context);
  }

  // A closed chart has to be opened, also where there is no time to choose where.
  void open_anyhow(const mesh::Surface& chart, ExecutionContext& context) {
    if (!loops_.empty() || std::find(cut_.begin(), cut_.end(), 1) != cut_.end()) return;
    const Untimed opening(context);
    std::vector<double> cost = cost_;
    for (double& c : cost) c = std::clamp(c, kLeastCost, kForbidden);
    cut_ = mesh::planar_cut(chart, adjacency_, context, {}, {}, cost);
    for (HalfedgeId h = 0; h < real_; ++h) {
      if (cut_[at(h)] != 0) open_vertex(mesh::source(surface_.faces, h));
    }
  }

  std::vector<double> scale(ExecutionContext& context) const {
    return scale_.solve(open_, context);
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
    struct End {
      VertexId vertex;
      double worth;
    };
    std::vector<End> ends;
    std::vector<char> reach(open_.size());
    for (VertexId v = 0; v < static_cast<VertexId>(reach.size()); ++v)
      reach[at(v)] = paths_.distance(v) < mesh::ShortestPaths::kUnreached ? 1 : 0;
    for (const Hill& hill : hills(surface_.faces, adjacency_, u, area_, reach)) {
      const double length = paths_.distance(hill.peak);
      if (!(hill.gain > 0.0)) continue;
      ends.push_back({hill.peak, hill.gain / std::max(length, 1e-300)});
    }
    std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
      return a.worth != b.worth ? a.worth > b.worth : a.vertex < b.vertex;
    });
    for (std::size_t i = 0; i < std::min(ends.size(), most); ++i) {
      if (ends[i].worth < kNearlyBest * ends[0].worth) break;
      paths_.grow(context);
      slit_to(ends[i].vertex);
    }
    return !ends.empty();
  }

  const mesh::EdgeFlags& cut() const { return cut_; }

 private:
  using Loops = std::vector<std::vector<HalfedgeId>>;

  static Loops outer_loop_last(const mesh::Surface& chart, Loops loops) {
    std::size_t outer = 0;
    double longest = -1.0;
    for (std::size_t i = 0; i < loops.size(); ++i) {
      double length = 0.0;
      for (const HalfedgeId h : loops[i]) {
        length += (chart.vertices.row(mesh::source(chart.faces, h)) -
                   chart.vertices.row(mesh::target(chart.faces, h)))
                      .norm();
      }
      if (length > longest) {
        longest = length;
        outer = i;
      }
    }
    if (!loops.empty()) std::swap(loops.back(), loops[outer]);
    return loops;
  }

  // The peak of the hill with the largest gain, that a slit may end in; `otherwise` if there is
  // none.
  VertexId steepest(const std::vector<double>& u, VertexId otherwise) const {
    Hill best{otherwise, 0.0};
    std::vector<char> reach(open_.size(), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h) {
      if (cost_[at(h)] < mesh::ShortestPaths::kUnreached)
        reach[at(mesh::source(surface_.faces, h))] = 1;
    }
    for (const Hill& hill : hills(surface_.faces, adjacency_, u, area_, reach)) {
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
    if (loop_of_[at(v)] != kInvalid) open_loop(loop_of_[at(v)]);
  }

  void open_loop(Index loop) {
    for (const HalfedgeId h : loops_[at(loop)]) open_vertex(mesh::source(surface_.faces, h));
  }

  void slit_to(VertexId end) {
    std::vector<VertexId> vertices;
    for (VertexId v = end; paths_.arrival(v) != kInvalid; v = paths_.before(v)) {
      vertices.push_back(v);
      const HalfedgeId h = paths_.arrival(v);
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (h < real_ && o < real_ && o != kInvalid) cut_[at(h)] = cut_[at(o)] = 1;
    }
    for (const VertexId v : vertices) open_vertex(v);
  }

  Loops loops_;  // of the chart, the outer one last
  HalfedgeId real_;
  mesh::Surface surface_;
  mesh::Adjacency adjacency_;
  ScaleField scale_;
  std::vector<double> cost_;
  std::vector<double> area_;  // per vertex, a share of the chart's
  std::vector<char> open_;    // on the outside, or on what leads there
  std::vector<Index> loop_of_;
  mesh::EdgeFlags cut_;
  mesh::ShortestPaths paths_;
};

// A chart cut along its slits, flat; or divided, and its pieces to be laid flat.
struct Candidate {
  Slits slits;
  double cost = 0.0;
};

double cost_of(const mesh::EdgeFlags& cut, const std::vector<double>& cost) {
  double sum = 0.0;
  for (std::size_t h = 0; h < cut.size(); ++h) {
    if (cut[h] != 0) sum += 0.5 * std::min(cost[h], kForbidden);
  }
  return sum;
}

Index pieces_of(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                const mesh::EdgeFlags& cut) {
  mesh::Adjacency parted = adjacency;
  for (std::size_t h = 0; h < cut.size(); ++h) {
    if (cut[h] != 0) parted.opposite[h] = kInvalid;
  }
  return chart.faces.rows() == 0 ? 0 : mesh::face_components(parted).count;
}

class Search {
 public:
  Search(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
         const std::vector<double>& cost, const SlitOptions& options, ExecutionContext& context)
      : chart_(chart),
        adjacency_(adjacency),
        cost_(cost),
        options_(options),
        context_(context),
        sheet_(chart, adjacency, cost),
        map_(chart),
        bound_(options.bound) {
    for (const double c : cost) uncuttable_.push_back(c == mesh::ShortestPaths::kUnreached ? 1 : 0);
  }

  Slits run() {
    try {
      sheet_.open_closed(chart_, context_);
      for (int round = 0; round < kMostRounds; ++round) {
        const std::vector<double> u = sheet_.scale(context_);
        const double excess = sheet_.excess(u);
        if (share_ * excess <= bound_ - 1.0 && is_done(excess)) break;
        // Near the bound one after another, so as not to do too much.
        const bool near = share_ * excess < 2.0 * (bound_ - 1.0);
        if (sheet_.slit_best(u, near ? 1 : kMostAtOnce, context_)) continue;
        options_.bound = std::numeric_limits<double>::infinity();  // there is no better
        bound_ = options_.bound;
        is_done(excess);
        break;
      }
    } catch (const TimeIsOver&) {
      // What is slit by then is slit.
    } catch (const NotConverged&) {
      // Whoever lays the chart flat says why it cannot be.
    }
    sheet_.open_anyhow(chart_, context_);
    if (best_.slits.cut.empty()) best_.slits.cut = sheet_.cut();
    return std::move(best_.slits);
  }

 private:
  // True if nothing better than the best candidate is to be expected.
  bool is_done(double excess) {
    const double energy = map_.relax(adjacency_, sheet_.cut(), kTolerance, context_);
    if (excess > 0.0) share_ = (energy - 1.0) / excess;
    if (energy > bound_) return false;
    const double slit = cost_of(sheet_.cut(), cost_);
    if (!best_.slits.cut.empty() && slit >= best_.cost) return true;
    if (!options_.bijective || !map_.overlaps_itself(context_)) {
      best_ = {{sheet_.cut(), map_.corner_uv(), {}}, slit};
      return true;
    }
    TrialMap::Apart held =
        map_.hold_apart(options_.bound, options_.may_add_cuts, uncuttable_, context_);
    if (held.cut.empty()) {
      best_ = {{sheet_.cut(), std::move(held.corner_uv), {}}, slit};
      if (held.energy <= options_.bound) return true;
    } else {
      const Index pieces = pieces_of(chart_, adjacency_, held.cut);
      const double cost = (slit + cost_of(held.cut, cost_)) *
                          (1.0 + kPriceOfPiece * static_cast<double>(pieces - 1));
      if (best_.slits.cut.empty() || cost < best_.cost) {
        for (std::size_t h = 0; h < held.cut.size(); ++h) held.cut[h] |= sheet_.cut()[h];
        best_ = {{std::move(held.cut), std::move(held.corner_uv), std::move(held.apart)}, cost};
      }
    }
    bound_ = 1.0 + kTighter * (bound_ - 1.0);
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
  double share_ = kFirstShare;
  double bound_;  // of maps that may overlap
  int held_ = 0;
  Candidate best_;
};

}  // namespace

Slits find_slits(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                 const std::vector<double>& cost, const SlitOptions& options,
                 ExecutionContext& context) {
  return Search(chart, adjacency, cost, options, context).run();
}

}  // namespace flipfree::unwrap
