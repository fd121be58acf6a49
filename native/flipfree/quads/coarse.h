// The coarse surface of a map: the same flat surface, triangulated on its cones and corners alone.
//
// Flat vertices go one after the other: edges at the vertex are flipped until three are left (on
// the border none inside), then it is taken out and what is around is made Delaunay. A vertex of
// four edges or more always has one that may be flipped: its star, laid out, is a polygon of which
// the vertex sees every corner, and one of two ears that do not overlap does not hold it inside.
// (Loops at the vertex can forbid it; then the vertex stays, which costs a quad corner there and
// nothing else.) Every area is decided in integers; Delaunay is a wish, in doubles.
//
// Based on: Gillespie, Sharp, Crane, "Integer Coordinates for Intrinsic Geometry Processing"
// (2021), for removal by flips; directions are kept as in Sharp, Soliman, Crane, "Navigating
// Intrinsic Triangulations" (2019), but exactly.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/quads/flat_surface.h"

namespace flipfree::quads {

// Areas by `edge`, in the map's integers, are positive. Each half-edge leaves its vertex on the map
// in the sector of the corner `start`, which begins at the corner's half-edge and ends before the
// next one, as the vector i^start_turn edge. `feature`: 1 of parts of features, along an axis of
// the map: never flipped, and stays along it. `integer`: the same edge in quads, as integers.h
// chooses.
struct CoarseSurface : FlatSurface {
  bool has_integers = false;
};

// Vertices that are kept: cones, corners, ends, bends and crossings of features, one of every
// closed border or feature and of every component that has none else; and those that could not be
// taken out. `quarters`: quarters_around() of the map. `feature`: per half-edge. Throws Cancelled,
// TimeIsOver. Cost: about O(#F).
CoarseSurface coarse_surface(const FlatSurface& map, const std::vector<Index>& quarters,
                             const std::vector<char>& feature, const ExecutionContext& context);

// The corner whose sector holds a direction that lies counter-clockwise of the half-edge of `first`
// by less than half a turn, given in the chart of `first`'s face; and how many quarters its chart
// is turned.
std::pair<CornerId, Index> sector_of(const FlatSurface& surface, CornerId first, Gauss direction);

// Replaces the edge of h by the other diagonal, in the charts of the two faces; its half-edges are
// 3 f + 2 (from b to a), f the face of h, and three times its neighbour (from a to b).
// Preconditions: two faces; both areas are positive by the edges.
void flip_coarse(CoarseSurface& coarse, const FlatSurface& map, HalfedgeId h);

// Whether the flip makes the edge Delaunay in the metric of these vectors, and by more than
// rounding.
bool is_delaunay(const FlatSurface& surface, HalfedgeId h, Gauss Side::*of = &Side::edge);

// Per vertex of the map one half-edge of the coarse surface that leaves it, on the border the one
// from which around() sees all; kInvalid where it was taken out.
std::vector<HalfedgeId> leaving(const FlatSurface& surface, std::size_t vertices);

}  // namespace flipfree::quads
