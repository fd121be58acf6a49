// Disjoint short loops around handles (thesis 5.3.1), and by how much curves on a canvas turn
// (6.5.1).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/seamless/padding/paths.h"

namespace flipfree::seamless {

using Loops = std::vector<std::vector<VertexId>>;

// By how many quarters a map is to turn along a cycle of vertices.
using CycleTurns = std::function<Index(const std::vector<VertexId>& cycle)>;

// What curves are led by.
struct ChainGuide {
  // Of loops that are not much longer than others, those that are to turn least are taken (thesis
  // 6.5.1.1); null: the shortest.
  CycleTurns turning = nullptr;
  // Angles in which connectors pay for what they miss of the right angles to the loops' mean
  // directions at both their ends (thesis 6.5.1.2): flat_crossings() of the canvas' surface, or
  // others in which it is flat but for its cones. Null: they are as short as they can be.
  const std::vector<double>* crossings = nullptr;
  // What a quarter turn that a connector misses costs, in mean lengths of the loops.
  double quarter_price = 0.0;
};

// By how much curves on a canvas turn in angles such that the surface is flat but for its cones:
// the faces keep their own, and crossing an edge turns directions. Halves of an edge that is split
// turn directions as the edge did, edges inside a face by none: so refinement changes nothing.
// Remembers what it measured until the canvas is refined; not to be shared by threads.
class TurnMeter {
 public:
  // `crossings`: of ChainGuide. Both must outlive this.
  TurnMeter(const Canvas& canvas, const std::vector<double>& crossings)
      : canvas_(canvas), crossings_(crossings) {}

  const Canvas& canvas() const { return canvas_; }
  // Calls visit(departure, turn) for every half-edge that leaves the target of `arrival`, but back
  // along it, from the left: by how much a curve turns to the left, its left side measured.
  template <typename Visit>
  void for_each_turn(HalfedgeId arrival, const Visit& visit) const {
    const mesh::EditableTriangulation& mesh = canvas_.mesh();
    double left = 0.0;
    HalfedgeId h = next_corner(arrival);
    for (const HalfedgeId back = mesh.opposite(arrival); h != back; h = mesh.rotate_cw(h)) {
      left += known(h).corner;
      visit(h, 2.0 * kQuarterTurn - left);
      left += known(h).crossing;
    }
  }
  double turn(HalfedgeId arrival, HalfedgeId departure) const;
  // From a half-edge to another one that leaves the same vertex, counter-clockwise.
  double angle_between(HalfedgeId first, HalfedgeId second) const;
  // Of a closed curve.
  double turn(const std::vector<VertexId>& cycle) const;

 private:
  // Of a half-edge, once it was asked for.
  struct Known {
    double corner = 0.0;    // the angle at its source in its face, radians
    double crossing = 0.0;  // what crossing it adds to the angles around its source
    double length = -1.0;
  };
  const Known& known(HalfedgeId h) const;

  const Canvas& canvas_;
  const std::vector<double>& crossings_;
  mutable Index vertex_count_ = 0;  // when these were measured: no edge changes but by splits
  mutable std::vector<Known> known_;
};

// What curves cost that shall turn little: their length, and the square of the quarter turns by
// which they miss what they should turn by.
struct TurningPrice {
  // As the guide says, beside these loops.
  TurningPrice(const Canvas& canvas, const Loops& loops, const ChainGuide& guide);
  double cost(double length, double missed) const {
    const double quarters = missed / kQuarterTurn;
    return length + quarter * quarters * quarters;
  }
  double quarter;
};

// Sheets of a quarter turn, so many of them on either side at first and then, where no way is
// found.
inline constexpr std::int64_t kSheets[] = {16, 64};
// A search on sheets that tell by how much ways have turned; `left`: see there. The meter must
// outlive it, too.
SheetSearch turning_search(const TurnMeter& meter, const std::vector<double>& left,
                           std::int64_t sheets);

// Draws loops through free vertices until there are `genus` of them. `first`: one that is there
// already, or empty. A round finds the shortest loop of its tree and those that are disjoint and
// not much longer. With crossings, those that turn by an eighth and more are then exchanged for
// cycles that turn less, if these cost less.
Loops draw_loops(Canvas& canvas, const std::vector<VertexId>& first, Index genus,
                 const ChainGuide& guide);

}  // namespace flipfree::seamless
