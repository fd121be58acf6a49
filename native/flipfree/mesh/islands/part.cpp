#include "flipfree/mesh/islands/part.h"

#include <cstddef>

namespace flipfree::mesh {

Part part_of(const Triangles& faces, const std::vector<FaceId>& chosen, std::vector<Index>& local) {
  Part part;
  part.faces.resize(static_cast<Eigen::Index>(chosen.size()), 3);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    for (Index k = 0; k < 3; ++k) {
      const VertexId v = faces(chosen[i], k);
      Index& own = local[static_cast<std::size_t>(v)];
      if (own == kInvalid) {
        own = static_cast<Index>(part.vertices.size());
        part.vertices.push_back(v);
      }
      part.faces(static_cast<Eigen::Index>(i), k) = own;
    }
  }
  for (const VertexId v : part.vertices) local[static_cast<std::size_t>(v)] = kInvalid;
  return part;
}

}  // namespace flipfree::mesh
