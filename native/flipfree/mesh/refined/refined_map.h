// A map of a refined surface, while it is being made.
#pragma once

#include <string>

#include "flipfree/base/types.h"
#include "flipfree/mesh/refined/provenance.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::mesh {

struct RefinedMap {
  RefinedSurface surface;  // without collar
  Points2 uv;  // #V x 2, every face positive by exact test, all constraints met bit for bit
};

// Without the vertices that no face uses; the input's keep their ids, others move up.
RefinedMap compacted_map(const RefinedMap& map);

// What must hold of surfaces and maps under refinement wherever a stage hands them on.

// Empty if all invariants hold: those of the mesh (which throws), a support and a position per
// vertex, weights that are not negative and sum to one exactly, faces that lie in their parents and
// turn as these do. Otherwise what is broken. Cost: O(#F).
std::string find_broken_invariant(const RefinedSurface& surface);

// The same of a map: connectivity, one place per vertex, every face positive by exact test. Weights
// are asked for their sum alone, up to rounding, and faces need not turn as their parents do:
// between stages the surface may be one in the plane that only helps to find the user's, whose
// weights are its coordinates, of either sign. What a stage hands on as a map of the user's surface
// is asked for find_broken_invariant() as well (matchmaker/ways/solve.cpp). `uv`: #V x 2.
std::string find_broken_map(const RefinedSurface& surface, const Points2& uv);

// Empty if this can be where `refined` lies on `input`: parents exist, weights are not negative and
// sum to one up to a rounding, and every face's corners lie in its parent.
// Otherwise what is broken. Cost: O(#F).
std::string find_broken_provenance(const Surface& input, const Triangles& refined,
                                   const Provenance& provenance);

}  // namespace flipfree::mesh
