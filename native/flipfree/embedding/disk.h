// A disk whose boundary is fixed on a convex polygon.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::embedding {

// Where the boundary of a disk goes: circle, square, equilateral triangle, or the caller's convex
// polygon.
//
// Polygons that are ours to choose are chosen so that they survive storage: every coordinate is a
// 32-bit float (held in a double) and neighbouring points are distinct. The circle is strictly
// convex by exact test; where 32-bit numbers hold no such points near where they belong (beyond
// some thousand), they are 64-bit numbers. Positions run counter-clockwise, the surface on the
// left.

enum class BoundaryShape { kCircle, kSquare, kTriangle };

// `edge_lengths[i]` is the length of the boundary edge from point i to point i + 1; #B of them,
// positive (or all equal to 1). Points are spread by arc length, but no edge gets less than a few
// per cent of the mean, and as much more as distinct (circle: strictly convex) 32-bit positions
// need. Circle: radius 1 at the origin; square:
// [-1, 1]^2; triangle: equilateral, circumradius 1, base horizontal. A point is put into each
// corner. #B x 2. Throws InvalidInput (kBadBoundary) if there are fewer points than corners, or
// fewer than 3. Cost: O(#B).
Points2 place_boundary(BoundaryShape shape, const std::vector<double>& edge_lengths);

// The unit circle's points by arc length as place_boundary() spreads them, but without regard to
// what 32 bits can hold where that costs strict convexity: 64-bit positions then.
Points2 spread_on_circle(const std::vector<double>& edge_lengths);

// Throws InvalidInput unless the polygon is finite, runs counter-clockwise once around, has no
// repeated neighbours and no reflex vertex. Reflex by no more than the rounding of 32-bit
// coordinates is let through (samples of a straight side are so): this refuses wrong input early,
// the result is judged by its own exact check. `loop` gives the vertex ids that messages name.
void require_convex(const Points2& polygon, const std::vector<VertexId>& loop);

// How many times the direction of travel turns counter-clockwise in one round of a closed polygon
// (#corners x 2): 1 for a simple counter-clockwise one, 0 for a figure-eight. A reversal (a spike,
// where the polygon goes back along itself) is the tip of a slit: its inner angle is 2 pi, so it
// turns right by pi. Precondition: consecutive corners differ. Exact. Cost: O(n).
int turning_number(const Points2& polygon);

// Every three consecutive points turn strictly left (exact), and the polygon winds once.
bool is_strictly_convex(const Points2& polygon);

// A disk and where its boundary goes. All outlive it.
struct Disk {
  const Triangles& faces;  // manifold, oriented
  Index vertex_count;
  const std::vector<VertexId>& loop;  // the boundary's vertices in order, surface on the left
  const Points2& boundary;            // #loop x 2
};

// Throws InvalidInput (kIndexOutOfRange) unless there are such vertices.
void require_vertices(const std::vector<VertexId>& loop, Index vertex_count);

// Throws InvalidInput unless the faces are a disk with this boundary, which has one position per
// vertex of the loop. Cost: O(#F).
void require_disk(const Disk& disk);

// Per vertex its place in the loop, kInvalid of others.
std::vector<Index> places_in(const std::vector<VertexId>& loop, Index vertex_count);

}  // namespace flipfree::embedding
