#include "flipfree/embedding/disk/disk.h"

#include <gtest/gtest.h>

#include <set>

#include "embedding/disks.h"

namespace flipfree::embedding::disk_test {
namespace {

TEST(NumberDisk, boundary_vertices_count_along_the_loop_and_inner_ones_by_id) {
  test::Disk disk = test::make_disk(test::bumpy_grid(5, 4, 0.2, 2.0), BoundaryShape::kCircle);
  const Index n = disk.vertex_count() + 2;  // the last two isolated
  const DiskNumbering numbering = number_disk(disk.surface.faces, n, disk.loop);
  Index next = 0;
  for (VertexId v = 0; v < n; ++v) {
    const auto at = static_cast<std::size_t>(v);
    const Index place = numbering.boundary_index[at];
    const auto found = std::find(disk.loop.begin(), disk.loop.end(), v);
    EXPECT_EQ(place,
              found == disk.loop.end() ? kInvalid : static_cast<Index>(found - disk.loop.begin()));
    if (place != kInvalid || v >= n - 2) {
      EXPECT_EQ(numbering.inner_index[at], kInvalid);
    } else {
      EXPECT_EQ(numbering.inner_index[at], next);
      EXPECT_EQ(numbering.inner[static_cast<std::size_t>(next)], v);
      ++next;
    }
  }
  EXPECT_EQ(static_cast<Index>(numbering.inner.size()), next);
}

TEST(InnerStars, name_every_neighbour_of_an_inner_vertex_once) {
  const test::Disk disk =
      test::make_disk(test::stacked(60, test::Stacking::kRandom, 3), BoundaryShape::kTriangle);
  const Triangles& faces = disk.surface.faces;
  const DiskNumbering numbering = number_disk(faces, disk.vertex_count(), disk.loop);
  const InnerStars stars = inner_stars(faces, numbering);
  ASSERT_EQ(stars.start.size(), numbering.inner.size() + 1);
  for (std::size_t i = 0; i < numbering.inner.size(); ++i) {
    const VertexId v = numbering.inner[i];
    std::set<VertexId> expected, found;
    for (HalfedgeId h = 0; h < faces.size(); ++h) {
      if (mesh::source(faces, h) == v) expected.insert(mesh::target(faces, h));
      if (mesh::target(faces, h) == v) expected.insert(mesh::source(faces, h));
    }
    HalfedgeId before = -1;
    for (Index k = stars.start[i]; k < stars.start[i + 1]; ++k) {
      const HalfedgeId h = stars.halfedge[static_cast<std::size_t>(k)];
      EXPECT_EQ(mesh::source(faces, h), v);
      EXPECT_GT(h, before) << "in the order of faces";
      before = h;
      EXPECT_TRUE(found.insert(mesh::target(faces, h)).second);
    }
    EXPECT_EQ(found, expected);
  }
}

}  // namespace
}  // namespace flipfree::embedding::disk_test
