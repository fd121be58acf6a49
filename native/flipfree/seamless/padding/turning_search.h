// By how much curves on a canvas turn, and paths through free vertices that are judged by that and
// by their length: field-guided connectors (thesis 6.5.1.2).
//
// Angles are such that the surface is flat but for its cones in them: the faces keep their own, and
// crossing an edge turns directions. Halves of an edge that is split turn directions as the edge
// did, edges inside a face by none: so refinement changes nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/paths.h"

namespace flipfree::seamless {

// Per half-edge 3 f + k of a closed connected surface: radians that it adds to the angles around
// its source, so that they sum to k quarter turns at every vertex; those that a conformal change of
// the metric would add, if angles were linear in it (Crane, Desbrun, Schroeder 2010, "Trivial
// Connections on Discrete Surfaces", on the dual edges). `cones`: #V, quarter turns, of the right
// sum. Cost: one sparse factorization. Throws NotConverged if that fails.
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

// What a curve costs: its length, and the square of the quarter turns by which it misses what it
// should turn by, times `quarter`. And what finding it may cost.
struct TurningPrice {
  double quarter = 0.0;
  std::int64_t* ways_left = nullptr;  // that searches look at, all together
  double cost(double length, double missed) const {
    const double quarters = missed / TurnMeter::kQuarter;
    return length + quarter * quarters * quarters;
  }
};

// One search from some half-edges on: Dijkstra's algorithm on sheets, one per vertex and eighth of
// a turn that the path has turned so far. No path meets itself.
class TurningSearch {
 public:
  struct Way {
    HalfedgeId arrival;  // its last half-edge, to a free vertex
    Index before;        // the way that it continues, or kInvalid
    double turned;       // radians to the left, from where straight ahead is zero
    double length;
  };
  // A half-edge by which a way arrives on a curve.
  struct Arrival {
    Index way;  // that it continues
    HalfedgeId halfedge;
    double turned, length;
  };

  // `sheets`: on either side. `left`: per vertex, what a way is longer yet at least, which leads
  // the search (A*; Hart, Nilsson, Raphael 1968); infinite where no way leads on.
  TurningSearch(const TurnMeter& meter, const std::vector<double>& left, std::int64_t sheets)
      : meter_(meter), left_(left), sheets_(sheets) {}

  // `turned`: where this half-edge heads, to the left of straight ahead. It leaves a curve.
  void start(HalfedgeId departure, double turned);
  // Calls arrive(Arrival) for all ways onto curves, and goes on as long as `limit()` is more than
  // the shortest way that has not been gone on from will be; at most a fixed multiple of #V ways.
  // Cost: O(n log n) for n of them. Throws NotConverged (kIterationLimit) when none of `ways_left`
  // is left.
  void run(const std::function<void(const Arrival&)>& arrive, const std::function<double()>& limit,
           std::int64_t* ways_left, const ExecutionContext& context);
  std::vector<HalfedgeId> path(const Arrival& arrival) const;

  // Two turns either way.
  static constexpr std::int64_t kSheets = 16;

 private:
  std::int64_t key(HalfedgeId arrival, double turned) const;
  void cross(HalfedgeId h, Index before, double turned, double length);
  bool meets_itself(Index way, VertexId v) const;

  const TurnMeter& meter_;
  const std::vector<double>& left_;
  std::int64_t sheets_;
  std::vector<Way> ways_;
  std::unordered_map<std::int64_t, double> shortest_;  // per vertex and sheet
  std::unordered_map<VertexId, double> nearest_;       // per vertex, the shortest way to it
  std::vector<std::pair<double, Index>> queue_;        // a heap by length and what is left
  std::vector<Arrival> arrivals_;                      // not called yet
};

}  // namespace flipfree::seamless
