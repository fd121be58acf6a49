// Where a surface has to give way: the hills of its scale field, and what a seam to each of them is
// worth.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"

namespace flipfree::unwrap {

struct Hill {
  VertexId peak = kInvalid;  // its highest vertex that a seam may reach
  double gain = 0.0;         // integral of (|u| - |u| where it meets a higher one)^2 over the hill
};

// The hills of |u|, those of either sign by themselves; not sorted. u: #V, zero at open vertices,
// which border hills; all others lie inside. area: #V. reach: #V flags; hills that
// no seam may reach are left out. Deterministic. Vertices are taken from the
// highest down, and where two hills meet, the lower one ends (persistence; Edelsbrunner, Letscher,
// Zomorodian 2002). Cost: O(#V log #V).
std::vector<Hill> hills(const Triangles& faces, const mesh::Adjacency& adjacency,
                        const std::vector<double>& u, const std::vector<double>& area,
                        const std::vector<char>& reach);

}  // namespace flipfree::unwrap
