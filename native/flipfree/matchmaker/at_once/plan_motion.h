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

using intrinsic::Strands;

class MovingPins {
 public:
  // The triangulation's vertices: pins first, then the rim's. Preconditions: the rim is strictly
  // convex and counter-clockwise, the pins are strictly inside and distinct. The arcs are the edges
  // of the Delaunay triangulation as it is then. Invalid, see valid(), if a pin lies exactly on an
  // edge while it is inserted.
  MovingPins(const Polygon& rim, const std::vector<Vector2>& pins);
  bool valid() const { return valid_; }

  Index pin_count() const { return pins_; }
  Index vertex_count() const { return static_cast<Index>(place_.size()); }
  Index face_count() const { return static_cast<Index>(corner_.size() / 3); }
  VertexId corner(Index face, Index k) const { return corner_[at(3 * face + k)]; }
  const Vector2& place(VertexId v) const { return place_[at(v)]; }
  static HalfedgeId next(HalfedgeId h) { return h - h % 3 + (h + 1) % 3; }
  static HalfedgeId previous(HalfedgeId h) { return h - h % 3 + (h + 2) % 3; }
  // Half-edge 3 f + k runs from corner k to corner k + 1; kInvalid beyond the rim.
  HalfedgeId opposite(HalfedgeId h) const { return opposite_[at(h)]; }
  VertexId source(HalfedgeId h) const { return corner_[at(h)]; }
  VertexId target(HalfedgeId h) const { return corner_[at(h - h % 3 + (h + 1) % 3)]; }
  VertexId apex(HalfedgeId h) const { return corner_[at(h - h % 3 + (h + 2) % 3)]; }
  // How often arcs cross the edge of h, and whether one runs along it.
  std::int64_t crossings(HalfedgeId h) const { return crossings_[at(h)]; }
  bool along(HalfedgeId h) const { return along_[at(h)] != 0; }
  // The sum over all edges.
  std::int64_t complexity() const { return complexity_; }

  // A half-edge that leaves v.
  HalfedgeId leaving(VertexId v) const { return leaving_[at(v)]; }

  // Moves a pin along a straight line; false if it comes so near another one that doubles cannot
  // tell on which side it passes. Then it has stopped on the way.
  bool move(VertexId pin, const Vector2& to);

 private:
  bool insert(VertexId v);
  void link(HalfedgeId a, HalfedgeId b);
  void set(HalfedgeId h, std::int64_t crossings, char along);
  void flip(HalfedgeId h);
  bool star_is_positive(VertexId v, const Vector2& p) const;
  bool is_delaunay(HalfedgeId h) const;
  void make_delaunay();
  void open(HalfedgeId h);

  Index pins_ = 0;
  bool valid_ = true;
  std::int64_t complexity_ = 0;
  double doubt_ = 0;  // below this, rounding may decide on which side of a circle a place is
  std::vector<Vector2> place_;
  std::vector<VertexId> corner_;
  std::vector<HalfedgeId> opposite_;
  std::vector<HalfedgeId> leaving_;
  std::vector<std::int64_t> crossings_;
  std::vector<char> along_;
  std::vector<HalfedgeId> open_;  // edges that may not be Delaunay
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
