// Halves of double covers: triangulations of the disk alone, with a way back to its own.
#include "flipfree/seamless/padding/disks/half_triangulation.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/seamless/padding/disks/cut_disks.h"
#include "seamless/padding/geometry/hand_cuts.h"

namespace flipfree::seamless::half_triangulation_test {
namespace {

void expect_way_home(const CutDisk& disk) {
  const HalfTriangulation& half = disk.half;
  const auto inside = std::count(half.inside.begin(), half.inside.end(), 1);
  EXPECT_EQ(inside, 3 * disk.chart.surface.faces.rows());
  intrinsic::FlipMesh mesh = half.mesh;
  for (const EdgeId e : half.flips_home) intrinsic::flip_edge(mesh, e);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mesh.halfedge_count()); ++h) {
    const HalfedgeId c = half.home[static_cast<std::size_t>(h)];
    if (c == kInvalid) continue;
    EXPECT_EQ(half.home[static_cast<std::size_t>(mesh.next_of(h))], next_corner(c));
    EXPECT_EQ(mesh.origin_of(h), disk.chart.surface.faces(c / 3, c % 3));
  }
}

void expect_triangles(const HalfTriangulation& half) {
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(half.inside.size()); ++h) {
    if (!half.inside[static_cast<std::size_t>(h)]) continue;
    const auto side = [&](HalfedgeId g) { return half.length[static_cast<std::size_t>(g / 2)]; };
    EXPECT_TRUE(side(h) < side(half.mesh.next_of(h)) + side(half.mesh.previous(h)));
  }
}

TEST(HalfTriangulation, LeadsHomeAndHasTriangles) {
  for (const bool coned : {false, true}) {
    const test::ConedCut cut = coned ? test::digon_cut() : test::square_cut(test::GridTorus(9, 7));
    const mesh::Adjacency adjacency = test::adjacency_of(cut.cut);
    ExecutionContext context;
    for (const CutDisk& disk :
         solve_disks(cut.cut, adjacency, cut_segments(cut.cut, adjacency), cut.cones, context)) {
      expect_way_home(disk);
      expect_triangles(disk.half);
    }
  }
}

}  // namespace
}  // namespace flipfree::seamless::half_triangulation_test
