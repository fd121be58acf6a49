// Shortest ways through free vertices, from sector to sector of the curves that are drawn already.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <queue>
#include <unordered_map>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

// The surface on which the curves of a cut are drawn, refined as they come (thesis 5.4.1).
//
// Curves run along edges. A vertex is free if it is neither a cone nor on a curve. After every
// curve each edge that is not on one and joins two vertices that are not free is split, so that
// whatever the curves leave connected is connected through free vertices: faces that meet in an
// edge share its free end, and the free vertices of a face are joined by its edges.
//
// A sector is what lies between two curves around a vertex, named by the half-edge of the first of
// them in counter-clockwise order: it leaves the vertex and has the sector on its left. A point
// inside a curve has two sectors, one per side.

// What an edge is part of.
enum class Curve : Index {
  kNone = mesh::EditableTriangulation::kUnmarked,
  kLoop,
  kConnector,
  kExtra,
  kFence
};

// What names a half-edge while the canvas is refined elsewhere: from the first to the second.
using EdgeEnds = std::pair<VertexId, VertexId>;

class Canvas {
 public:
  // `surface`: closed, connected, in a unit in which squares of lengths neither overflow nor
  // vanish. `cones`: #V, quarter turns. `context`: what is drawn and sought asks it whether to go
  // on. All must outlive this.
  Canvas(const mesh::Surface& surface, const std::vector<Index>& cones,
         const ExecutionContext& context);

  const mesh::Surface& input() const { return *refined_.input; }
  // Of the input's vertices.
  const std::vector<Index>& cones() const { return cones_; }
  const ExecutionContext& context() const { return context_; }

  const mesh::EditableTriangulation& mesh() const { return refined_.mesh; }
  Index vertex_count() const { return refined_.mesh.vertex_count(); }
  double length(HalfedgeId h) const;
  double length(const std::vector<HalfedgeId>& path) const;
  // k - 4: what a cone adds to the corners around it; 0 where it is flat.
  Index excess(VertexId v) const {
    return v < static_cast<VertexId>(cones_.size()) ? cones_[at(v)] - kFlat : 0;
  }
  bool is_free(VertexId v) const { return state_[at(v)] == State::kFree; }
  bool on_curve(VertexId v) const { return state_[at(v)] == State::kOnCurve; }
  Curve curve(HalfedgeId h) const { return static_cast<Curve>(refined_.mesh.mark(h)); }
  bool is_drawn(HalfedgeId h) const { return curve(h) != Curve::kNone; }

  // The sector of h, which leaves a vertex on a curve and is not drawn itself (or names one).
  HalfedgeId sector_of(HalfedgeId h) const;
  // The one by which h comes to a curve; kInvalid if it comes to none.
  HalfedgeId sector_reached(HalfedgeId h) const {
    return on_curve(mesh().target(h)) ? sector_of(mesh().opposite(h)) : kInvalid;
  }
  // The half-edges strictly inside sectors, counter-clockwise in each.
  std::vector<HalfedgeId> inside(const std::vector<HalfedgeId>& sectors) const;
  HalfedgeId edge(const EdgeEnds& ends) const { return mesh().find(ends.first, ends.second); }
  // Drawn half-edges around v, counter-clockwise.
  std::vector<HalfedgeId> drawn_around(VertexId v) const;
  // The half-edges of a chain and of a cycle of vertices, in order.
  std::vector<HalfedgeId> edges_along(const std::vector<VertexId>& vertices) const;
  std::vector<HalfedgeId> edges_of(std::vector<VertexId> cycle) const;

  // Draws edges and refines. `path`: half-edges in any order; none drawn yet.
  void draw(const std::vector<HalfedgeId>& path, Curve kind);
  // Undraws edges, or all of them; vertices that no drawn edge is left at are free again. The
  // refinement stays.
  void erase(const std::vector<HalfedgeId>& path);
  void erase_all();
  // Splits edges of a chain of drawn half-edges until it has `edges`; returns its vertices.
  std::vector<VertexId> divide(const std::vector<HalfedgeId>& chain, std::size_t edges);
  // Undraws every fence. The refinement stays.
  void remove_fences();

  // The half-edge 3 f + k of the input's face f across which h leaves it; kInvalid if h and its
  // opposite lie in the same one.
  HalfedgeId input_side(HalfedgeId h) const;

  // As it is now.
  const mesh::RefinedSurface& refined() const { return refined_; }

 private:
  enum class State : char { kFree, kCone, kOnCurve, kFenced };
  VertexId split(HalfedgeId h);
  void refine_around(VertexId v);

  mesh::RefinedSurface refined_;
  const std::vector<Index>& cones_;
  const ExecutionContext& context_;
  std::vector<State> state_;  // #V
};

// The boundary of the disk that a canvas is when cut along the curves drawn on it, and the cones
// inside as seen from paths through it (thesis 5.4.1, "Extra Cut").
//
//   <--h_2--.           Places are numbered counter-clockwise, the disk on the left: place i is the
//           |           sector that begins with half-edge h_i, between h_i and the opposite of
//     disk  h_1         h_(i-1).
//           |
//   --h_0-->'

// From one place of the boundary to another one. The part on its left has the corners strictly
// between `to` and `from`, and two more at the path's ends.
struct PathEnds {
  Index from = kInvalid;
  Index to = kInvalid;
};

struct DiskBoundary {
  // The curves cut the canvas, which must outlive this, into one disk. Cost: O(#F).
  explicit DiskBoundary(Canvas& drawn_on);

  Canvas& canvas;
  std::vector<HalfedgeId> halfedges;
  std::vector<Index> branch;  // of each half-edge: both sides of a branch have the same number
  std::vector<char> corner;   // per place: is it a sector of a node
  std::vector<Index> corners_below;  // per place, and in all: how many corners are before it
  std::vector<Index> place;          // per half-edge of the canvas: i, or kInvalid

  Index size() const { return static_cast<Index>(halfedges.size()); }
  // Corners strictly between two different places, counter-clockwise.
  Index corners_between(Index from, Index to) const;
  // Corners of the left part.
  Index left_corners(const PathEnds& ends) const { return corners_between(ends.to, ends.from) + 2; }
  // Places strictly between, in order.
  std::vector<Index> places_between(Index from, Index to) const;
};

// Paths through free vertices on sheets: Dijkstra's algorithm with one label per vertex and sheet,
// led by what is left at least (A*; Hart, Nilsson, Raphael 1968). The sheet is told by what a path
// has gathered so far: the excess that it has passed, or by how much it has turned. No path meets
// itself: of those on one sheet that meet in a vertex only the shorter one goes on.
class SheetSearch {
 public:
  struct Way {
    HalfedgeId arrival;  // its last half-edge
    Index before;        // the way that it continues, or kInvalid
    Index from;          // where it began, as start() was told
    double gathered;
    double length;
  };
  // visit(h, gathered) for half-edges by which a way goes on, and what these add.
  using Visit = std::function<void(HalfedgeId, double)>;
  struct Cover {
    std::function<void(HalfedgeId arrival, const Visit& visit)> leave;
    double per_unit;      // sheets for what is gathered
    std::int64_t sheets;  // on either side
    std::size_t most;     // ways per vertex
  };

  // `left`: per vertex, what a way is longer yet at least; infinite where no way leads on. It and
  // the canvas must outlive this.
  SheetSearch(const Canvas& canvas, const std::vector<double>& left, Cover cover)
      : canvas_(canvas), left_(left), cover_(std::move(cover)) {}

  // By this half-edge, which leaves a curve.
  void start(HalfedgeId departure, Index from, double gathered) {
    cross(departure, kInvalid, from, gathered, 0.0);
  }
  // Calls arrive(way), which may lower `limit`, for all ways onto curves, and goes on as long as
  // that is more than the shortest way that has not been gone on from will be. Cost: O(n log n) for
  // n ways.
  void run(const std::function<void(const Way&)>& arrive, const double& limit);
  std::vector<HalfedgeId> path(const Way& way) const;

 private:
  std::int64_t label(HalfedgeId arrival, double gathered) const;
  void cross(HalfedgeId h, Index before, Index from, double gathered, double length);
  bool meets_itself(Index way, VertexId v) const;

  const Canvas& canvas_;
  const std::vector<double>& left_;
  Cover cover_;
  std::vector<Way> ways_;
  std::unordered_map<std::int64_t, double> shortest_;  // per vertex and sheet
  std::unordered_map<VertexId, double> nearest_;       // per vertex, the shortest way to it
  using Entry = std::pair<double, Index>;              // by length and what is left
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
  std::vector<Way> arrivals_;  // not called yet
};

// By how much curves on a canvas turn in angles such that the surface is flat but for its cones:
// the faces keep their own, and crossing an edge turns directions. Halves of an edge that is split
// turn directions as the edge did, edges inside a face by none: so refinement changes nothing.
// Remembers what it measured until the canvas is refined; not to be shared by threads.
class TurnMeter {
 public:
  // `crossings`: flat_crossings() of the input, or others in which it is flat but for its cones.
  // Both must outlive this.
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
  double turn(HalfedgeId arrival, HalfedgeId departure) const {
    return 2.0 * kQuarterTurn - angle_between(departure, canvas_.mesh().opposite(arrival));
  }
  // From a half-edge to another one that leaves the same vertex, counter-clockwise.
  double angle_between(HalfedgeId first, HalfedgeId second) const {
    double angle = 0.0;
    for (HalfedgeId h = first; h != second;) {
      angle += known(h).corner;
      h = canvas_.mesh().rotate_ccw(h);
      if (h != second) angle += known(h).crossing;
    }
    return angle;
  }
  // Of a closed curve.
  double turn(const std::vector<VertexId>& cycle) const {
    const std::vector<HalfedgeId> edges = canvas_.edges_of(cycle);
    double sum = 0.0;
    for (std::size_t i = 0; i < edges.size(); ++i)
      sum += turn(edges[(i + edges.size() - 1) % edges.size()], edges[i]);
    return sum;
  }

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

// Sheets of a quarter turn, so many of them on either side at first and then, where no way is
// found.
inline constexpr std::int64_t kSheets[] = {16, 64};
// A search on sheets that tell by how much ways have turned; `left`: see there. The meter must
// outlive it, too.
SheetSearch turning_search(const TurnMeter& meter, const std::vector<double>& left,
                           std::int64_t sheets);

// The shortest path that divides a disk so that both parts have the corners that the cones in them
// ask for (thesis 5.2.1, equation 5.1), on the branched cover of the disk, whose sheets are the
// excess that a path has passed (5.4.1, "Extra Cut").

// From one place to another one, with cones of this excess on its left in all; empty if the
// search ends without one, likewise.
std::vector<HalfedgeId> shortest_enclosing_path(const DiskBoundary& boundary, const PathEnds& ends,
                                                Index excess);

// From one of the places `from` to one of the places `to` for which `allowed(ends)` is true, such
// that the left part has 4 + sum of (k - 4) corners over its cones, not a multiple of four. Empty
// if the search ends without one, which does not prove that there is none: of paths on the same
// sheet that meet in a vertex only the shorter one goes on, if it does not meet itself, and at most
// a fixed multiple of #V are looked at. Cost: O(n log n) for n of them.
std::vector<HalfedgeId> shortest_separating_path(
    const DiskBoundary& boundary, const std::vector<Index>& from, const std::vector<Index>& to,
    const std::function<bool(const PathEnds&)>& allowed);

// Paths around chosen cones of a disk, which always exist: what the proof of Proposition 11 (thesis
// 5.3.2) draws, for any set of cones.
//
//    from                  Fences (=) join the cones inside (o) with the boundary between `to` and
//   --*---------------     `from`, all others (x) with the rest of it. What is left of the disk is
//     |   x=======         connected, so a path leads between the fences.
//     '---------.
//   ======o     |
//   ------------*-----
//               to

// The path with exactly the cones `inside` on its left. Fences are removed and leave their
// refinement behind. Preconditions: places strictly between the ends on both sides. Throws
// NotConverged if there is no way, which cannot happen in a disk. Cost: O(cones #F log #F).
std::vector<HalfedgeId> fenced_path(const DiskBoundary& boundary, const PathEnds& ends,
                                    const std::vector<VertexId>& inside);

// The same from a place, which is no corner, around one cone back to it: what is inside has one
// corner.
std::vector<HalfedgeId> fenced_loop(const DiskBoundary& boundary, Index place, VertexId inside);

// Distances through free vertices to all of them.

struct FreeDistances {
  static constexpr double kUnreached = std::numeric_limits<double>::infinity();

  std::vector<double>
      distance;  // #V; kUnreached where no way leads and at vertices that are not free
  std::vector<HalfedgeId>
      arrival;                  // #V: the last half-edge; kInvalid at the root and where unreached
  std::vector<VertexId> order;  // those reached, from near to far
};

// `first`: half-edges to begin with, from vertices at distance zero. root: a free vertex to begin
// at too, or kInvalid. Cost: O(#F log #F).
FreeDistances free_distances(const Canvas& canvas, const std::vector<HalfedgeId>& first,
                             VertexId root = kInvalid);

// The shortest path that begins with one of these half-edges and ends with one, to a vertex that is
// not free, for which is_end(h) is true; all its other vertices are free. Empty if there is none.
// Cost: O(#V + F log F), F being the faces that are nearer.
std::vector<HalfedgeId> free_path(const Canvas& canvas, const std::vector<HalfedgeId>& first,
                                  const std::function<bool(HalfedgeId)>& is_end);

}  // namespace flipfree::seamless
