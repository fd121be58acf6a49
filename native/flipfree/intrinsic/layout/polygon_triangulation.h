// Triangulates the image of one input triangle whose sides carry points: a polygon in the UV plane.
//
// The programme of matchmaker/coarsen.cpp minimises the worst cost and forgets
// angles; this one minimises their sum and carries the angles at both ends of every chain, which
// say how often the polygon winds. That of matchmaker/outline_target.h asks which chains are
// possible at all, for polygons of thousands of corners, in bits.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::intrinsic {

// Where a vertex of the polygon lies: 0 is the first corner of that side, 1 its first point.
struct SidePlace {
  Index side = 0;
  Index place = 0;
};

struct PolygonVertex {
  Index id = kInvalid;  // the caller's name for it
  SidePlace place;
  std::uint8_t sides = 0;  // bit k: lies on side k of the input triangle (corners lie on two)
  Vector2 domain;          // place in the input triangle, any affine frame of positive orientation
  Vector2 uv;
  Vector2 stored;  // uv as 32 bits have it
};
using PolygonTriangle = std::array<Index, 3>;  // ids of vertices

// Which values must be positive.
enum class Storage { k64And32, k64Only };

// Is (a, b, c) strictly positive in UV and not flat in the input triangle? Exact.
bool valid_triangle(const PolygonVertex& a, const PolygonVertex& b, const PolygonVertex& c,
                    Storage storage);

// Conformal distortion of (a, b, c): (|J|^2 / (2 det J)) times the domain's area; >= the area. Any
// frame of the domain that is isometric to the surface gives the same.
double distortion_cost(const PolygonVertex& a, const PolygonVertex& b, const PolygonVertex& c);

// The same over the domain's area: 1 is conformal.
double distortion(const PolygonVertex& a, const PolygonVertex& b, const PolygonVertex& c);

// Sums of angles are the right ones if they differ by less than this (radians): wrong ones differ
// by a full turn.
inline constexpr double kAngleSlack = 1.0;

// Triangles of least summed cost, all valid and, unless `angles` is empty, with these angle sums at
// the polygon's vertices (a polygon that overlaps itself may have triangulations that wind
// differently; Shor, Van Wyk 1992); false if there are none. The polygon's vertices are in
// counter-clockwise order; it may overlap itself, as long as the triangles are valid. Above
// kLargestPolygon vertices none are looked for. Cost: O(k^3). Throws Cancelled, TimeIsOver.
inline constexpr std::size_t kLargestPolygon = 256;
bool triangulate_polygon(const std::vector<PolygonVertex>& polygon,
                         const std::vector<double>& angles, Storage storage,
                         std::vector<PolygonTriangle>& triangles, const ExecutionContext& context);

// Triangulates the image of one input triangle by the cells that the final triangulation cuts it
// into, whatever it winds around.
//
// The vertices of T are those of the input, so inside an input triangle the edges of T are chords:
// from side to side around a corner, or, of one corner at most, to the side opposite to it. How
// many points each side has tells which chords these are (as normal coordinates do). Between two
// neighbouring chords lies a part of one triangle of T: convex, with three to six corners. So a
// face that is crossed a thousand times falls into small convex pieces, where a search among all
// diagonals (triangulate_polygon()) takes its cube.

// Pairs (i, j), i < j, of positions in a polygon: the chords both of whose ends are there. `count`:
// points on each side, in use or not. Cost: O(polygon).
std::vector<std::array<Index, 2>> face_chords(const std::array<Index, 3>& count,
                                              const std::vector<PolygonVertex>& polygon);

// The polygon's triangles, each part between chords by itself; false if one of these has none.
// Chords do not cross. Where points of the polygon are not those of an overlay, or some are
// missing, triangles are valid all the same, but may wind otherwise. Cost: that of the parts.
bool triangulate_cells(const std::vector<PolygonVertex>& polygon,
                       const std::vector<std::array<Index, 2>>& chords, Storage storage,
                       std::vector<PolygonTriangle>& triangles, const ExecutionContext& context);

}  // namespace flipfree::intrinsic
