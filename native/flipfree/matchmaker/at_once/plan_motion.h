// On which side pins pass each other on their way, all together: the choice that decides how far a
// map inside a prescribed boundary is drawn out.
//
// Brought home one after another, thirty pins wind around each other so often that the edges
// between their sources cross those between their targets 10^4 to 10^5 times; 1600 is enough. As
// MovingPins tells the number for any motion in a fraction of a millisecond, motions are simply
// tried: all pins go along straight lines to a place on the way, then to their targets, and these
// places are found by simulated annealing (Kirkpatrick, Gelatt, Vecchi 1983).
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/matchmaker/request/polygon.h"

namespace flipfree::matchmaker {

// Pins that move inside a fixed convex polygon, and what becomes of arcs between them: the isotopy
// class of a map, without the map.
//
// A homeomorphism of the polygon that takes pins from their sources to their targets is known up to
// isotopy by the images of the edges of a triangulation of the sources (the arcs). These are known
// by how often they cross each edge of a triangulation of the places where the pins are now: normal
// coordinates (intrinsic/overlay.h). When pins move, the triangulation is kept
// Delaunay by flips. A pin that makes a loop around another one and comes home changes
// the class; where everything lies is as before. All that costs microseconds, so thousands of
// classes can be tried.

// The Delaunay triangulation of pins strictly inside a strictly convex polygon, all distinct. Its
// vertices: pins first, then the rim's.
Triangles triangulate_pins(const Polygon& rim, const std::vector<Vector2>& pins);

class MovingPins {
 public:
  // Preconditions: those of triangulate_pins(), whose edges are the arcs.
  MovingPins(const Polygon& rim, const std::vector<Vector2>& pins);

  const Vector2& place(VertexId v) const { return place_[at(v)]; }
  // The arcs, and the triangulation of the places. One vertex more than have places lies beyond the
  // rim and closes the sphere; edges that bound() holds do not change.
  const intrinsic::OverlayCoordinates& arcs() const { return arcs_; }
  bool bound(HalfedgeId h) const;
  // How often arcs cross edges, all told.
  std::int64_t complexity() const { return complexity_; }

  // Moves a pin along a straight line; false if it comes so near another one that doubles cannot
  // tell on which side it passes. Then it has stopped on the way.
  bool move(VertexId pin, const Vector2& to);

 private:
  const intrinsic::FlipMesh& mesh() const { return arcs_.current(); }
  VertexId apex(HalfedgeId h) const { return mesh().origin_of(mesh().previous(h)); }
  void flip(HalfedgeId h);
  bool star_is_positive(VertexId v, const Vector2& p) const;
  bool is_delaunay(HalfedgeId h) const;
  void make_delaunay();

  std::int64_t complexity_ = 0;
  double doubt_ = 0;  // below this, rounding may decide on which side of a circle a place is
  std::vector<Vector2> place_;
  intrinsic::OverlayCoordinates arcs_;
  std::vector<HalfedgeId> leaving_;  // per vertex one out of it
  std::vector<HalfedgeId> open_;     // edges that may not be Delaunay
};

struct PinMove {
  VertexId pin;  // its place in the list of sources
  Vector2 to;    // straight
};

// A motion from `from` to `to` inside the rim, one move after another, with few crossings. Empty if
// none was found that doubles can follow. Preconditions: the rim is strictly convex, sources and
// targets are strictly inside, each distinct. The same for any number of threads. Cost: about 2 s
// for thirty pins, growing with the square of their number.
std::vector<PinMove> plan_motion(const Polygon& rim, const std::vector<Vector2>& from,
                                 const std::vector<Vector2>& to, ExecutionContext& context);

}  // namespace flipfree::matchmaker
