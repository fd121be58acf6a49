// Loops that turn are exchanged for loops that do not (thesis 5.4.1 takes the shortest ones).
//
// A padded map's loops are straight but for what padding bends: a loop that turns in the flat
// angles of the surface asks the metric of the cut disk for as much along its sides.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/admissible_cut.h"
#include "flipfree/seamless/padding/paths.h"

namespace flipfree::seamless {

// Angles in which a surface is flat but for its cones, to first order: those that a conformal
// change of its metric would have, if angles were linear in it (Crane, Desbrun, Schroeder 2010,
// "Trivial Connections on Discrete Surfaces", on the dual edges).
//
// The faces keep their own angles; crossing an edge turns directions. What an edge adds to the
// angles around its source, w (u_target - u_source), its opposite takes away around the target.
// Halves of an edge that is split turn directions as the edge did, edges inside a face by none: so
// refinement changes nothing.

// Per half-edge 3 f + k of a closed connected surface: radians that it adds to the angles around
// its source, so that they sum to k quarter turns at every vertex. `cones`: #V, quarter turns, of
// the right sum. Cost: one sparse factorization. Throws NotConverged if that fails.
std::vector<double> flat_crossings(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   ExecutionContext& context);

// By how much curves on a canvas turn in these angles. Remembers what it measured until the canvas
// is refined; not to be shared by threads.
class TurnMeter {
 public:
  // `crossings`: flat_crossings() of the surface that the canvas was made of. Both must outlive
  // this.
  TurnMeter(const Canvas& canvas, const std::vector<double>& crossings)
      : canvas_(canvas), crossings_(crossings) {}

  const Canvas& canvas() const { return canvas_; }
  // The angle at the source of h in the face of h, radians.
  double corner(HalfedgeId h) const { return known(h).corner; }
  // What crossing h adds to the angles around its source.
  double crossing(HalfedgeId h) const { return known(h).crossing; }
  double length(HalfedgeId h) const { return known(h).length; }

  // Calls visit(departure, turn) for every half-edge that leaves the target of `arrival`, but back
  // along it, from the left: by how much a curve turns to the left, its left side measured.
  template <typename Visit>
  void for_each_turn(HalfedgeId arrival, const Visit& visit) const {
    const mesh::EditableTriangulation& mesh = canvas_.mesh();
    double left = 0.0;
    HalfedgeId h = next_corner(arrival);
    for (const HalfedgeId back = mesh.opposite(arrival); h != back; h = mesh.rotate_cw(h)) {
      left += corner(h);
      visit(h, kHalfTurn - left);
      left += crossing(h);
    }
  }
  double turn(HalfedgeId arrival, HalfedgeId departure) const;
  // From a half-edge to another one that leaves the same vertex, counter-clockwise.
  double angle_between(HalfedgeId first, HalfedgeId second) const;
  // Of a closed curve.
  double turn(const std::vector<VertexId>& cycle) const;

  static constexpr double kHalfTurn = 3.14159265358979323846;
  static constexpr double kQuarter = 0.5 * kHalfTurn;

 private:
  // Of a half-edge, once it was asked for.
  struct Known {
    double corner = 0.0, crossing = 0.0, length = -1.0;
  };
  const Known& known(HalfedgeId h) const {
    if (canvas_.vertex_count() != vertex_count_) forget();
    Known& entry = known_[static_cast<std::size_t>(h)];
    if (entry.length < 0.0) measure(h, entry);
    return entry;
  }
  void forget() const;
  void measure(HalfedgeId h, Known& entry) const;

  const Canvas& canvas_;
  const std::vector<double>& crossings_;
  mutable Index vertex_count_ = 0;  // when these were measured: no edge changes but by splits
  mutable std::vector<Known> known_;
};

// The order of holes in a chain as a short tour (thesis 5.4.1 goes from nearest to nearest).

// Holes 2 l and 2 l + 1 are partners.
constexpr Index partner_of(Index hole) { return hole ^ 1; }

// Are there partners with an odd number of holes between them, the ends aside? `order`: of all
// holes, its ends partners. Cost: O(holes).
bool has_odd_couple(const std::vector<Index>& order);

// All holes in an order whose ends are partners and, with odd_couple (three loops or more), in
// which two other partners have an odd number of holes between them; the sum of the costs from one
// to the next is as small as reversing parts (2-opt; Croes 1958), moving parts of up to three (Or
// 1976) and the choice of the ends make it within a budget. `cost`: symmetric. Deterministic. Cost:
// O(loops^3) mostly, at most a fixed number of trials or O(loops^2).
std::vector<Index> hole_tour(const std::vector<std::vector<double>>& cost, bool odd_couple,
                             const ExecutionContext& context);

// The sum of the costs along an order.
double tour_cost(const std::vector<std::vector<double>>& cost, const std::vector<Index>& order);

// How far a metric must be scaled, to first order, so that its angles become others: what makes
// them hard to reach.

// Per half-edge 3 f + k the cotangent weight of its edge, kept between a hundredth and a hundred: a
// needle is not to decide.
std::vector<double> edge_weights(const mesh::Surface& surface);

// u with L u = wish - own angles, per vertex; zero at the last one. `surface`: connected, with or
// without boundary; `weight`: edge_weights(); `wish`: radians per vertex, with the right sum. The
// metric is to be scaled by exp(-u). Throws NotConverged (kFactorizationFailed). Cost: one sparse
// factorization.
std::vector<double> linear_scale(const mesh::Surface& surface, const std::vector<double>& weight,
                                 const std::vector<double>& wish, ExecutionContext& context);

// Largest less smallest u of a piece of the surface cut along a cut, its sides straight and its
// corners right angles; of all pieces the largest such range. `cones`: of the surface before it was
// cut, quarter turns; vertices that the cut added are flat. Cost: as above.
double scale_range(const AdmissibleCut& cut, const std::vector<Index>& cones,
                   ExecutionContext& context);

// Paths through free vertices that are judged by their length and by how much they turn: Dijkstra's
// algorithm on sheets, one per vertex and eighth of a turn that the path has turned so far.

// What a curve costs: its length, and the square of the quarter turns by which it misses what it
// should turn by, times `quarter`. And what finding it may cost.
struct TurningPrice {
  double quarter = 0.0;
  std::int64_t* ways_left = nullptr;  // that searches look at, all together; null: no end
  double cost(double length, double missed) const {
    const double quarters = missed / TurnMeter::kQuarter;
    return length + quarter * quarters * quarters;
  }
};

// One search from some half-edges on. No path meets itself.
class TurningSearch {
 public:
  struct Way {
    HalfedgeId arrival;  // its last half-edge, to a free vertex
    HalfedgeId first;
    Index before;   // the way that it continues, or kInvalid
    double turned;  // radians to the left, from where straight ahead is zero
    double length;
  };
  // A half-edge by which a way arrives on a curve.
  struct Arrival {
    Index way;  // that it continues
    HalfedgeId halfedge, first;
    double turned, length;
  };

  // `sheets`: on either side. `left`: per vertex, what a way is longer yet at least, which leads
  // the search (A*; Hart, Nilsson, Raphael 1968); infinite where no way leads on. Empty: nothing is
  // known.
  explicit TurningSearch(const TurnMeter& meter, std::vector<double> left = {},
                         std::int64_t sheets = kSheets)
      : meter_(meter), left_(std::move(left)), sheets_(sheets) {}

  // `turned`: where this half-edge heads, to the left of straight ahead. It leaves a curve.
  void start(HalfedgeId departure, double turned);
  // Calls arrive(Arrival) for all ways onto curves, and goes on as long as `limit()` is more than
  // the shortest way that has not been gone on from will be; at most a fixed multiple of #V ways.
  // Cost: O(n log n) for n of them. Throws NotConverged (kIterationLimit) when none of `ways_left`
  // is left; null: no end.
  void run(const std::function<void(const Arrival&)>& arrive, const std::function<double()>& limit,
           std::int64_t* ways_left, const ExecutionContext& context);
  std::vector<HalfedgeId> path(const Arrival& arrival) const;

  // Two turns either way.
  static constexpr std::int64_t kSheets = 16;

 private:
  std::int64_t key(HalfedgeId arrival, double turned) const;
  void cross(HalfedgeId h, HalfedgeId first, Index before, double turned, double length);
  bool meets_itself(Index way, VertexId v) const;

  const TurnMeter& meter_;
  std::vector<double> left_;
  std::int64_t sheets_;
  std::vector<Way> ways_;
  std::unordered_map<std::int64_t, double> shortest_;  // per vertex and sheet
  std::unordered_map<VertexId, double> nearest_;       // per vertex, the shortest way to it
  std::vector<std::pair<double, Index>> queue_;        // a heap by length and what is left
  std::vector<Arrival> arrivals_;                      // not called yet
};

// The cheapest cycle that meets this loop in one vertex, where it crosses it from the right to the
// left, and no other curve, and turns by less than an eighth; empty if none is found that costs
// less than `most`. `loop`: vertices in order, drawn, with no connectors.
std::vector<VertexId> crossing_cycle(const TurnMeter& meter, const std::vector<VertexId>& loop,
                                     const TurningPrice& price, double most,
                                     const ExecutionContext& context);

// What a loop costs.
double loop_cost(const TurnMeter& meter, const std::vector<VertexId>& loop,
                 const TurningPrice& price);

// Exchanges each loop that turns by an eighth and more for the cheapest cycle that crosses it, if
// that one costs less. The loops stay disjoint, and no sum of them bounds: no other one crosses
// what the new one does. Preconditions: the loops are drawn on `canvas`, which is the meter's; so
// may others be. Cost: some searches per vertex of such a loop.
void straighten_loops(Canvas& canvas, const TurnMeter& meter, const TurningPrice& price,
                      std::span<std::vector<VertexId>> loops, const ExecutionContext& context);

}  // namespace flipfree::seamless
