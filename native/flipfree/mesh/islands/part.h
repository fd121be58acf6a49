// Some faces of a triangulation as one of their own.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

struct Part {
  Triangles faces;                 // in the order they were chosen in
  std::vector<VertexId> vertices;  // of the whole, in the order in which the faces use them
};

// `local`: one kInvalid per vertex of the whole, and so again afterwards; it is the caller's so
// that many parts cost no more than their faces. Cost: O(chosen).
Part part_of(const Triangles& faces, const std::vector<FaceId>& chosen, std::vector<Index>& local);

}  // namespace flipfree::mesh
