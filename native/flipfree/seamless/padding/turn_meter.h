// By how much curves on a canvas turn (thesis 6.5.1).
//
// Angles are such that the surface is flat but for its cones in them: the faces keep their own, and
// crossing an edge turns directions. Halves of an edge that is split turn directions as the edge
// did, edges inside a face by none: so refinement changes nothing.
#pragma once

#include <cstddef>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/paths.h"
#include "flipfree/seamless/padding/segments.h"

namespace flipfree::seamless {

// Per half-edge 3 f + k of a closed connected surface: radians that it adds to the angles around
// its source, so that they sum to k quarter turns at every vertex; those that a conformal change of
// the metric would add, if angles were linear in it (Crane, Desbrun, Schroeder 2010, "Trivial
// Connections on Discrete Surfaces", on the dual edges). `cones`: #V, quarter turns, of the right
// sum. Cost: one sparse factorization. Throws NotConverged if that fails.
std::vector<double> flat_crossings(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   ExecutionContext& context);

// Largest range, of the pieces of a cut surface, of the scale factors by which their sides become
// straight and their corners right angles to first order: what makes that metric hard to reach.
// `cones`: of the surface before it was cut, quarter turns. Cost: as above.
double scale_range(const AdmissibleCut& cut, std::vector<Index> cones, ExecutionContext& context);

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

}  // namespace flipfree::seamless
