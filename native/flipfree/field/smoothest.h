// The smoothest cross field, free or guided.
//
// The u of unit length in the mean that minimises E is the first eigenvector (Knoeppel et al.
// 2013), found by Lanczos' iteration. But it fades away from where it is smoothest, on limbs until
// nothing is left but rounding, and so does the answer to wishes that are given in a few places. So
// both are where a flow begins that brings every cross back to unit length between its steps
// (Viertel, Osting 2019, "An Approach to Quad Meshing Based on Harmonic Cross-Valued Maps and the
// Ginzburg-Landau Theory"). All of it needs one factorization.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/cross_field.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::field {

using Crosses = Eigen::VectorXcd;

// What each face is asked for, per face of the surface.
struct Wishes {
  explicit Wishes(Index faces)  // none at all
      : cross(Crosses::Ones(faces)), weight(at(faces), 0.0), held(at(faces), 0) {}

  Crosses cross;               // unit numbers; anything where neither weight nor held
  std::vector<double> weight;  // of |u - cross|^2, per share of the component's area
  std::vector<char> held;      // u is the cross
};

// u of every face of the surface, component by component; `pull` receives the weight of each face's
// wish times its share of the area. Throws NotConverged (kFactorizationFailed), Cancelled. Cost:
// one factorization and some ten solutions for each.
Crosses smoothest(const Frames& frames, const Wishes& wishes, std::vector<double>& pull,
                  ExecutionContext& context);

// What a cross field is asked to follow: curvature, sharp edges, the boundary.

// Principal directions, each weighing as much as the surface is curved differently along and across
// them: nothing on spheres and planes. `alignment` in [0, 1): 0 nothing, 0.5 as much as smoothness
// over a tenth of the surface's extent. Cost: O(#F).
void follow_curvature(const mesh::Surface& surface, double alignment, Wishes& wishes);

// The faces beside flagged edges (mesh::flag_edges), and beside the boundary if asked. `weight` of
// a face that lies beside one, on the scale of `alignment`; 1: they are held. A face with several
// takes their mean, the longer ones weigh more. Cost: O(#F).
void follow_edges(const Frames& frames, const mesh::EdgeFlags& edges, bool boundary, double weight,
                  Wishes& wishes);

// Fields for maps that are larger in some places than in others.
//
// Scaled by e^p, p varying, a map that follows a field has the field turn by *dp (thesis 6.3: a
// conformal change of the metric moves curvature, -laplace p, and with it where cones cost least).
// So the smoothest field for it is the one with the least rotation on the scaled surface.

// Sizing by how much the surface bends: a side as long as one over the square root of the curvature
// is as far off the surface everywhere. `share` of it in [0, 1]: of its logarithm; 0: 1 everywhere.
// Curvatures are means over a twentieth of the surface's extent, and at most kMostBent times more
// or less than the whole's. Cost: O(#F) times the rings of faces in there, 200 at most.
std::vector<double> curvature_sizing(const mesh::Surface& surface, double share);

// One positive number per vertex, or none at all. Throws InvalidInput (kBadShape, kBadOption)
// naming the vertex.
void check_sizing(const std::vector<double>& sizing, const mesh::Surface& surface);

// The frames in which the field that the scaled surface is parallel in does not turn: directions
// of half-edges change by what the corners opposite of them say, corners stay. `sizing`: per
// vertex, positive; length in the map of a length 1 there. Cost: O(#F).
Frames sized_frames(const Frames& frames, const std::vector<double>& sizing);

}  // namespace flipfree::field
