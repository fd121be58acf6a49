// What is asked of a seamless map, checked before any work: errors name the place in the caller's
// mesh, whatever part of it is at fault.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// Throws InvalidInput: defects of the mesh, vertices without a face among them.
void check_surface(const mesh::Surface& surface, ExecutionContext& context);

// `cones`: quarter turns per vertex, 4 or kNotGiven where it is flat. Throws
// InvalidInput (check_surface(); k < 1) and, for closed parts, Infeasible (Gauss-Bonnet; cones that
// no metric has, whatever its loops), naming the cones of the connected part at fault, or its faces
// if it has none. Parts with a boundary are aligned_cones()' and free_angles()' to judge. Cost:
// O(#F).
void check_request(const mesh::Surface& surface, const std::vector<Index>& cones,
                   ExecutionContext& context);

// Errors of a part, or of a refined map, with the places of the caller's mesh.

// `faces`, `vertices`: the caller's number of each of those that the error counts; elements beyond
// are left out, corners become faces. Each is named once, but for the ends of edges.
Error placed_in(Error error, const std::vector<FaceId>& faces,
                const std::vector<VertexId>& vertices);

// To be called in a catch block: throws the exception at hand again, NotConverged (a failed
// certificate too) with its places; others as they are.
[[noreturn]] void rethrow_placed(const std::vector<FaceId>& faces,
                                 const std::vector<VertexId>& vertices);

}  // namespace flipfree::seamless
