#include "flipfree/mesh/islands/part.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace flipfree::mesh::part_test {
namespace {

TEST(PartOf, has_the_chosen_faces_in_order_with_vertices_numbered_as_they_are_used) {
  Triangles faces(4, 3);
  faces << 0, 1, 2, 2, 1, 3, 5, 4, 3, 6, 7, 8;
  std::vector<Index> local(9, kInvalid);
  const Part part = part_of(faces, {2, 1}, local);
  Triangles expected(2, 3);
  expected << 0, 1, 2, 3, 4, 2;
  EXPECT_EQ(part.faces, expected);
  EXPECT_EQ(part.vertices, (std::vector<VertexId>{5, 4, 3, 2, 1}));
  EXPECT_EQ(std::count(local.begin(), local.end(), kInvalid), 9);
}

TEST(PartOf, parts_that_share_vertices_are_numbered_each_by_itself) {
  Triangles faces(2, 3);
  faces << 0, 1, 2, 2, 1, 3;
  std::vector<Index> local(4, kInvalid);
  for (const FaceId f : {0, 1}) {
    const Part part = part_of(faces, {f}, local);
    EXPECT_EQ(part.faces.row(0), (Eigen::RowVector3<Index>(0, 1, 2)));
    for (Index k = 0; k < 3; ++k)
      EXPECT_EQ(part.vertices[static_cast<std::size_t>(k)], faces(f, k));
  }
  EXPECT_EQ(part_of(faces, {}, local).faces.rows(), 0);
}

}  // namespace
}  // namespace flipfree::mesh::part_test
