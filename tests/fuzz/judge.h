// What a certificate says of a map, decided from all pairs of triangles and edges in rational
// numbers. Shares nothing with certify/ or mesh/ but the arrays. For tiny maps with finite values.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "flipfree/mesh/surface.h"
#include "rational.h"

namespace flipfree::fuzz {

// Disjoint sets without any cleverness: everything has the name of its set.
struct Sets {
  std::vector<Index> of;
  explicit Sets(Index count);
  void join(Index a, Index b);
  bool same(Index a, Index b) const;
};

class Judge {
 public:
  // corner_uv (3 #F x 2) must outlive this, and so must the surface, a valid mesh.
  Judge(const mesh::Surface& surface, const Points2& corner_uv);

  // Faces of no positive area, ascending.
  std::vector<FaceId> flipped() const;
  // One face of each chart: faces joined across edges whose two sides have the same values.
  std::vector<FaceId> charts() const;
  // Pairs of boundary edges of a face's chart that meet elsewhere than in a vertex which both have.
  std::int64_t contacts(FaceId chart) const;
  // Do two triangles of a face's chart share area?
  bool covers_twice(FaceId chart) const;
  // Pairs of charts that share area.
  std::int64_t island_pairs() const;
  // Inner vertices without a cut edge whose corners hold a direction another number of times than
  // once. Precondition: no flipped face.
  std::set<VertexId> winding() const;
  // Cut edges whose sides are not related by a quarter turn and a translation.
  std::int64_t seams() const;

 private:
  Index count() const { return static_cast<Index>(uv_.rows()); }
  VertexId vertex(Index c) const { return faces_(c / 3, c % 3); }
  Corners corners(FaceId f) const;
  bool bounds(Index c) const;
  bool touch(Index c, Index d) const;

  const Triangles& faces_;
  const Points2& uv_;
  std::vector<Point> point_;     // per corner
  std::vector<Index> opposite_;  // per corner: where the other side of its edge starts, or -1
  std::vector<bool> cut_;        // per corner, of the edge that starts there: its sides differ
  Sets charts_;                  // of faces
  Sets places_;                  // of corners that are one vertex of the cut mesh
  std::vector<bool> outer_;      // vertices on the surface's boundary
};

}  // namespace flipfree::fuzz
