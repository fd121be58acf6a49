#include "flipfree/embedding/disk/disk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "embedding/disks.h"
#include "flipfree/base/error.h"

namespace flipfree::embedding::require_disk_test {
namespace {

Error refusal(const Triangles& faces, Index vertices, const std::vector<VertexId>& loop,
              const Points2& boundary) {
  try {
    require_disk_with_boundary(faces, vertices, loop, boundary);
  } catch (const InvalidInput& e) {
    return e.error();
  }
  return {};
}

struct Case {
  test::Disk disk = test::make_disk(test::grid(4, 3), BoundaryShape::kCircle);
  Error refusal() const {
    return require_disk_test::refusal(disk.surface.faces, disk.vertex_count(), disk.loop,
                                      disk.boundary);
  }
};

TEST(RequireDisk, a_disk_with_its_loop_passes_wherever_the_loop_begins) {
  Case c;
  for (std::size_t i = 0; i < c.disk.loop.size(); ++i) {
    EXPECT_EQ(c.refusal().code, ErrorCode::kInternal) << "nothing thrown";
    std::rotate(c.disk.loop.begin(), c.disk.loop.begin() + 1, c.disk.loop.end());
  }
}

TEST(RequireDisk, wrong_loops_are_named) {
  Case c;
  c.disk.boundary.conservativeResize(5, 2);
  EXPECT_EQ(c.refusal().code, ErrorCode::kBadBoundary);
  c = {};
  c.disk.loop[3] = 99;
  EXPECT_EQ(c.refusal().code, ErrorCode::kIndexOutOfRange);
  EXPECT_NE(c.refusal().message.find("99"), std::string::npos);
  EXPECT_TRUE(c.refusal().elements.empty()) << "no vertex is to be shown";
  c = {};
  c.disk.loop[3] = c.disk.loop[1];
  EXPECT_EQ(c.refusal().code, ErrorCode::kBadBoundary);
  EXPECT_EQ(c.refusal().elements, std::vector<Index>{c.disk.loop[1]});
  c = {};
  std::swap(c.disk.loop[4], c.disk.loop[5]);
  EXPECT_EQ(c.refusal().code, ErrorCode::kBadBoundary);
  EXPECT_EQ(c.refusal().kind, ElementKind::kEdge);
  c = {};
  std::reverse(c.disk.loop.begin(), c.disk.loop.end());
  EXPECT_EQ(c.refusal().code, ErrorCode::kBadBoundary) << "the surface on the right";
}

TEST(RequireDisk, other_topologies_are_refused) {
  // With one boundary loop each, or the loop of one of them.
  mesh::Surface handle = test::torus(6, 5);
  handle.faces.conservativeResize(handle.faces.rows() - 1, 3);
  const test::Disk holed = test::make_disk(handle, BoundaryShape::kTriangle);
  EXPECT_EQ(refusal(holed.surface.faces, 30, holed.loop, holed.boundary).code,
            ErrorCode::kNotADisk);
  const test::Disk tube = test::make_disk(test::cylinder(6, 2), BoundaryShape::kCircle);
  EXPECT_EQ(refusal(tube.surface.faces, 18, tube.loop, tube.boundary).code,
            ErrorCode::kBadBoundary);
}

// Their Euler characteristics add up to that of a disk.
TEST(RequireDisk, a_disk_beside_a_torus_is_none) {
  const Case c;
  const mesh::Surface torus = test::torus(6, 5);
  const Index n = c.disk.vertex_count();
  Triangles both(c.disk.surface.faces.rows() + torus.faces.rows(), 3);
  both << c.disk.surface.faces, (torus.faces.array() + n).matrix();
  EXPECT_EQ(refusal(both, n + 30, c.disk.loop, c.disk.boundary).code, ErrorCode::kNotADisk);
}

}  // namespace
}  // namespace flipfree::embedding::require_disk_test
