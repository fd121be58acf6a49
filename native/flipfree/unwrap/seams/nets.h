// Seams of hard surfaces: things that are made, of flat and rolled faces between creases.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// Up to this angle, radians between the normals of two faces, a net runs over a bend like over a
// smooth region (of bevels with one or two segments).
inline constexpr double kBendAngle = 0.61;
// Share of the area of what is no island of its own.
inline constexpr double kSliver = 0.002;

// Flags of edges along which the surface falls into nets: faces unfolded rigidly onto the plane and
// joined edge by edge, flat ones first, then rolled ones, then across creases, the longest edges
// before the shorter. Two nets are joined where they do not overlap and most of their outlines
// runs along one cross afterwards as well. Edges whose two sides come to lie on each other are no
// seams. Bevels and their corners go with one side. So a cube becomes a strip of four squares and
// its ends, a cylinder a rectangle and two caps.
//
// Only in connected parts (between `seams`) that are hard by measure: most of the area lies in
// flat regions, or in rolled ones, which have no curvature inside, and is in few nets afterwards.
// In others nothing is flagged. Faces of `is_rim` (#F or none) may overlap a
// little, as those of bevels do, so that rims go whole with one side. Edges of infinite `cost` (per
// half-edge) are no seams. Precondition: a validated surface. Cost: O(#F log #F) joins as a rule,
// each of the smaller net's faces.
//
// After mesh unfolding by a tree of faces (Schlickenrieder 1997, "Nets of Polyhedra").
mesh::EdgeFlags net_seams(const mesh::Surface& surface, const mesh::EdgeFlags& seams,
                          const std::vector<double>& cost, const std::vector<char>& is_rim,
                          const ExecutionContext& context);

}  // namespace flipfree::unwrap
