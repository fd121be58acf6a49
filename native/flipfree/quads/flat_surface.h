// Flat surfaces with cones, in integers: triangles whose edges are Gaussian integers, and quarter
// turns between their charts.
//
// Every face has a chart of its own. Half-edge h = 3 f + k (mesh/adjacency.h) is the vector `edge`
// in the chart of f, and the vectors of a face sum up to zero. Across an edge vectors turn by
// quarters:
//
//        edge of the opposite half-edge = -i^turn edge
//
// so that i^turn takes vectors from the chart of h's face to that of its neighbour. A map whose
// seams are exact as stored is such a surface without a rounding: its coordinates are multiples of
// a power of two.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::quads {

// A Gaussian integer.
struct Gauss {
  std::int64_t x = 0;
  std::int64_t y = 0;
  friend bool operator==(const Gauss&, const Gauss&) = default;
};
constexpr Gauss operator+(Gauss a, Gauss b) { return {a.x + b.x, a.y + b.y}; }
constexpr Gauss operator-(Gauss a, Gauss b) { return {a.x - b.x, a.y - b.y}; }
constexpr Gauss operator-(Gauss a) { return {-a.x, -a.y}; }
using flipfree::cross;
using seamless::turned;  // turned(a, quarters) = i^quarters a
constexpr std::int64_t cross(Gauss a, Gauss b) { return a.x * b.y - a.y * b.x; }
constexpr std::int64_t dot(Gauss a, Gauss b) { return a.x * b.x + a.y * b.y; }
inline Vector2 as_vector(Gauss a) { return {static_cast<double>(a.x), static_cast<double>(a.y)}; }
// Is b counter-clockwise of a, by less than half a turn?
constexpr bool is_left(Gauss b, Gauss a) { return cross(a, b) > 0; }
inline bool is_left(Gauss b, const Vector2& a) { return cross(a, as_vector(b)) > 0.0; }

// Components of edges stay below this either way, so that products and their sums fit 64 bits.
inline constexpr std::int64_t kLongest = std::int64_t{1} << 30;
constexpr bool fits(Gauss a) {
  return a.x < kLongest && a.x > -kLongest && a.y < kLongest && a.y > -kLongest;
}

struct Side {
  VertexId source = kInvalid;
  HalfedgeId opposite = kInvalid;  // on the border
  Index turn = 0;                  // 0 to 3; 0 on the border
  Gauss edge;
  // Of a coarse surface (coarse.h).
  CornerId start = kInvalid;
  Index start_turn = 0;
  char feature = 0;
  Gauss integer;
};

// The same in a chart that is turned by so many quarters; its neighbour's stays.
inline Side turned(Side side, Index by) {
  side.turn -= by;
  side.start_turn = (side.start_turn - by) & 3;
  side.edge = turned(side.edge, by);
  side.integer = turned(side.integer, by);
  return side;
}

struct FlatSurface {
  std::vector<Side> sides;  // 3 #F: half-edges

  Side& operator[](HalfedgeId h) { return sides[at(h)]; }
  const Side& operator[](HalfedgeId h) const { return sides[at(h)]; }
  Index halfedges() const { return static_cast<Index>(sides.size()); }
  Index faces() const { return halfedges() / 3; }
  VertexId target(HalfedgeId h) const { return sides[at(next_corner(h))].source; }
  std::int64_t twice_area(FaceId f, Gauss Side::*of = &Side::edge) const {
    return cross(sides[at(3 * f)].*of, sides[at(3 * f + 1)].*of);
  }
};

// The map as a flat surface on its own triangles, and the power of two that its integers are
// multiplied with. Throws InvalidInput where the map is not seamless as it is stored, or where it
// is on no common grid.
struct FlatMap {
  FlatSurface surface;
  double unit = 0.0;
  std::vector<HalfedgeId> oblique;  // on the border, along no axis
};
FlatMap flat_map(const certify::Parametrization& map);

// Of every vertex the smallest one that it hangs together with.
std::vector<VertexId> components(const FlatSurface& surface, std::size_t vertices);

// Quarter turns of the angle around every vertex; 0 for those that no face uses.
std::vector<Index> quarters_around(const FlatSurface& surface, std::size_t vertices);

// The two triangles at an edge, and those that a flip would make of them, in the chart of h's
// face:
//
//            t                        t
//          / | \                    /   \          h: s -> t, the face of h has its apex a on
//        a   h   b       ->       a --d-- b        the left; d runs from a to b. The face of h
//          \ | /                    \   /          becomes (a, s, b), its neighbour (a, b, t).
//            s                        s
struct Diamond {
  Gauss before, diagonal, across;                                     // a -> s, a -> b, a -> t
  std::int64_t at_source() const { return cross(before, diagonal); }  // twice the area of (a, s, b)
  std::int64_t at_target() const { return cross(diagonal, across); }
};
Diamond diamond(const FlatSurface& surface, HalfedgeId h, Gauss Side::*of = &Side::edge);

// The corner whose sector holds a direction (Gauss or Vector2) that lies counter-clockwise of the
// half-edge of `first` by less than half a turn, given in the chart of `first`'s face; and how many
// quarters its chart is turned. A sector begins at the corner's half-edge and ends before the next.
template <typename Direction>
std::pair<CornerId, Index> sector_of(const FlatSurface& surface, CornerId first,
                                     const Direction& direction) {
  CornerId c = first;
  Index turn = 0;
  while (true) {
    const HalfedgeId last = previous_corner(c);
    const HalfedgeId across = surface[last].opposite;
    if (across == kInvalid || is_left(-surface[last].edge, turned(direction, turn)))
      return {c, turn};
    turn += surface[last].turn;
    c = across;
  }
}

// A place in the chart of a face, whose first corner is the origin.
struct Place {
  FaceId face = kInvalid;
  Gauss at;
};

// Where the half-edge begins in the chart of its face.
inline Gauss origin(const FlatSurface& surface, HalfedgeId h, Gauss Side::*of = &Side::edge) {
  const HalfedgeId first = h - h % 3;
  return h % 3 == 0   ? Gauss{}
         : h % 3 == 1 ? surface[first].*of
                      : surface[first].*of + surface[first + 1].*of;
}

// Straight from a place in a face to another one of its chart, through as many faces as it takes;
// neither the way nor its end passes a vertex on the way. The end in the chart of a face that holds
// it; face kInvalid where the way leaves the surface. Calls crossed(h, from, end) for the
// half-edges that are left across, in order, with the way in the chart of h.
template <typename Crossed>
Place walk(const FlatSurface& surface, Place from, Gauss end, const Crossed& crossed) {
  Place here{from.face, end};
  Gauss start = from.at;
  HalfedgeId came = kInvalid;
  for (Index steps = 0; steps < 16 * surface.halfedges() + 64; ++steps) {
    HalfedgeId out = kInvalid;
    for (HalfedgeId h = 3 * here.face; h < 3 * here.face + 3; ++h) {
      const Gauss place = origin(surface, h);
      if (h == came || cross(surface[h].edge, here.at - place) >= 0) continue;
      // It leaves across h if h's ends lie on the two sides of the way.
      const Gauss way = here.at - start;
      const Gauss a = place - start, b = a + surface[h].edge;
      if (cross(way, a) <= 0 && cross(way, b) >= 0) out = h;
    }
    if (out == kInvalid) return here;
    const HalfedgeId o = surface[out].opposite;
    if (o == kInvalid) break;
    crossed(out, start, here.at);
    const Gauss target = origin(surface, next_corner(o));  // out's beginning, over there
    const auto carried = [&](Gauss p) {
      return target + turned(p - origin(surface, out), surface[out].turn);
    };
    here = {o / 3, carried(here.at)};
    start = carried(start);
    came = o;
  }
  return {};
}

// Calls visit(h) for the half-edges that leave the vertex of `first`, counter-clockwise, from
// `first` on; until it returns false, comes round, or meets the border.
template <typename Visit>
void around(const FlatSurface& surface, HalfedgeId first, const Visit& visit) {
  for (HalfedgeId h = first; h != kInvalid;) {
    if (!visit(h)) return;
    h = surface[previous_corner(h)].opposite;
    if (h == first) return;
  }
}

}  // namespace flipfree::quads
