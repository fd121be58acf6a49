// Slits that let a chart be laid flat within a bound of distortion, without dividing it.
#pragma once

#include <limits>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

// No bound; and how much a map is stretched that has a flipped or degenerate face.
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Infinite where a face is flipped or degenerate. corner_uv: 3 #F x 2. Cost: O(#F).
Stretch stretch_of(const mesh::Surface& surface, const Points2& corner_uv);

struct Slits {
  mesh::EdgeFlags cut;   // of the chart's half-edges
  Points2 corner_uv;     // a map of the chart cut along `cut`; empty if there is none
  bool divided = false;  // the map lies on itself; `cut` divides the chart
  Stretch stretch;       // of the map
};

// cost: per half-edge, both sides the same, infinite where no slit may run. Slits run along
// shortest paths from the boundary, or from other slits, to where the chart's conformal map would
// change lengths most (Hill), as many as it takes for the least distorted map to have a mean
// energy of at most the bound; fewer where time is over or nothing is left to be slit. Holes whose
// border turns are opened to the outside first. Large charts are decimated and
// searched by few of their vertices; every slit found there becomes a shortest path of the chart
// through the neighbourhood of what went into the vertices along it. Precondition: connected,
// planar; with a boundary, or closed.
//
// Of the options: bijective, may_add_cuts (a chart that would lie on itself may be divided), and
// acceptable (accept() ends the search where the slits will do, context.h).
Slits find_slits(const mesh::Surface& chart, const std::vector<double>& cost, const Stretch& bound,
                 const UnwrapOptions& options, ExecutionContext& context);

// What a seam costs at most where it must not be, but there is no other way.
inline constexpr double kForbidden = 1e6;
// Costs per half-edge that are never nothing, and at most that for an edge's length.
std::vector<double> positive(const mesh::Surface& surface, std::vector<double> cost);

// Where an automatic cut is too short: the extremities of a chart (fingers, legs, horns), which a
// flat map would have to shrink by orders of magnitude.
//
// They are found from the scale factor of the conformal map that keeps the length of the boundary:
// u = 0 there, and (cotan Laplacian) u = angle defect inside, one sparse solve (Ben-Chen, Gotsman,
// Bunin 2008, who place cones at its extrema; here they become ends of slits, as in Gu, Gortler and
// Hoppe 2002, where the largest distortion of a map says where its cut has to grow).

// Slits charts that had to be opened, those with added cuts, along shortest paths from the
// boundary, or from earlier slits, to every peak of |u| that is high and stands out; pieces whose
// seams were enough never are. They stay connected and planar. `uncuttable` as in planar_cut().
// Cost: a few rounds of one factorization with #V unknowns and O(#F log #F).
void slit_to_extremities(Islands& islands, const mesh::Surface& surface,
                         const mesh::EdgeFlags& uncuttable, ExecutionContext& context);

}  // namespace flipfree::unwrap
