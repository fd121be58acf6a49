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
#include "flipfree/field/smoothest/field_system.h"

namespace flipfree::field {

// What each face is asked for, per face of the surface.
struct Wishes {
  Crosses cross;               // unit numbers; anything where neither weight nor held
  std::vector<double> weight;  // of |u - cross|^2, per share of the component's area
  std::vector<char> held;      // u is the cross
};

// u of every face of the surface, component by component. Throws NotConverged
// (kFactorizationFailed), Cancelled. Cost: one factorization and some ten solutions for each.
Crosses smoothest(const std::vector<FaceGraph>& graphs, const Wishes& wishes,
                  ExecutionContext& context);

}  // namespace flipfree::field
