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
#include "flipfree/certify/parametrization.h"
#include "flipfree/quads/flat_surface.h"

namespace flipfree::quads {

// Areas by `edge`, in the map's integers, are positive. Each half-edge leaves its vertex on the map
// in the sector of the corner `start`, which begins at the corner's half-edge and ends before the
// next one, as the vector i^start_turn edge. `feature`: 1 of parts of features, along an axis of
// the map: never flipped, and stays along it. `integer`: the same edge in quads, as
// choose_integers() does.
struct CoarseSurface : FlatSurface {
  bool has_integers = false;
};

// Vertices that are kept: cones, corners, ends, bends and crossings of features, one of every
// closed border or feature and of every component that has none else; and those that could not be
// taken out. `quarters`: quarters_around() of the map. `feature`: per half-edge. Throws Cancelled,
// TimeIsOver. Cost: about O(#F).
CoarseSurface coarse_surface(const FlatSurface& map, const std::vector<Index>& quarters,
                             const std::vector<char>& feature, const ExecutionContext& context);

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

// A seamless map made ready for whole numbers: as integers, and on its cones and corners alone.

struct Prepared {
  FlatMap flat;
  std::vector<Index> quarters;       // per vertex of the map
  std::vector<HalfedgeId> features;  // of the map, both of each edge, along an axis
  CoarseSurface coarse;
};

// Precondition: the map's border, if it has one, runs along the axes (flat.oblique is empty). Its
// features that run along an axis are kept. Throws as coarse_surface().
Prepared prepare(FlatMap flat, const certify::Parametrization& map,
                 const ExecutionContext& context);

struct Scales {
  // Per face of the coarse surface: quads per length of the map's integers, for one quad in all.
  std::vector<double> scale;
  double area = 0.0;  // of the surface
};

// Every component has its share of the quads by its area on the surface, whatever its size in the
// map.
Scales scales_of(const Prepared& p, const certify::Parametrization& map);

// Half-edges of the map, of features that run beside another one at less than a tenth of a quad
// where there are `wanted` quads: of each such pair those of the shorter line between two vertices
// of the coarse surface. Kept, they would be a whole quad apart, and shear what is around.
std::vector<HalfedgeId> close_features(const Prepared& p, const Scales& scales, double wanted);

// Chooses the integers of the surface, of `wanted` quads in all by `scales`. `count`: how many
// quads there shall be, for whose sake lengths give way where that costs least; 0: as many as come
// out. Valid integers that are there already, of about that scale, are what it begins at; else it
// rounds. Flips edges so that triangles are well shaped in the new metric; areas stay positive by
// the edges and by the integers. False if no integers with positive areas were found. Throws
// Cancelled, TimeIsOver.
bool choose_integers(CoarseSurface& coarse, const Prepared& p, const Scales& scales, double wanted,
                     double count, ExecutionContext& context);

// Twice the area of all triangles by their integers: twice the number of quads.
std::int64_t twice_area_in_quads(const CoarseSurface& coarse);

}  // namespace flipfree::quads
