#include "flipfree/embedding/disk/disk.h"

namespace flipfree::embedding {

using Size = std::size_t;

DiskNumbering number_disk(const Triangles& faces, Index vertex_count,
                          const std::vector<VertexId>& loop) {
  DiskNumbering result;
  result.boundary_index.assign(static_cast<Size>(vertex_count), kInvalid);
  result.inner_index.assign(static_cast<Size>(vertex_count), kInvalid);
  for (Size i = 0; i < loop.size(); ++i) {
    result.boundary_index[static_cast<Size>(loop[i])] = static_cast<Index>(i);
  }
  for (Index k = 0; k < faces.size(); ++k) {
    const Size v = static_cast<Size>(faces.data()[k]);
    if (result.boundary_index[v] == kInvalid) result.inner_index[v] = 0;  // used by a face
  }
  for (VertexId v = 0; v < vertex_count; ++v) {
    Index& index = result.inner_index[static_cast<Size>(v)];
    if (index == kInvalid) continue;
    index = static_cast<Index>(result.inner.size());
    result.inner.push_back(v);
  }
  return result;
}

InnerStars inner_stars(const Triangles& faces, const DiskNumbering& numbering) {
  InnerStars stars;
  stars.start.assign(numbering.inner.size() + 1, 0);
  for (Index h = 0; h < faces.size(); ++h) {
    const Index i = numbering.inner_index[static_cast<Size>(faces.data()[h])];
    if (i != kInvalid) ++stars.start[static_cast<Size>(i) + 1];
  }
  for (Size i = 0; i + 1 < stars.start.size(); ++i) stars.start[i + 1] += stars.start[i];
  stars.halfedge.resize(static_cast<Size>(stars.start.back()));
  std::vector<Index> next(stars.start.begin(), stars.start.end() - 1);
  for (HalfedgeId h = 0; h < faces.size(); ++h) {
    const Index i = numbering.inner_index[static_cast<Size>(faces.data()[h])];
    if (i != kInvalid) stars.halfedge[static_cast<Size>(next[static_cast<Size>(i)]++)] = h;
  }
  return stars;
}

}  // namespace flipfree::embedding
