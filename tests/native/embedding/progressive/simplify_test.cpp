#include "flipfree/embedding/progressive/simplify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "embedding/progressive/valid_maps.h"
#include "flipfree/base/error.h"

namespace flipfree::embedding::simplify_test {
namespace {

Points2 with_boundary(const test::Disk& disk) {
  Points2 uv = Points2::Zero(disk.vertex_count(), 2);
  for (std::size_t i = 0; i < disk.loop.size(); ++i)
    uv.row(disk.loop[i]) = disk.boundary.row(static_cast<Index>(i));
  return uv;
}

TEST(Simplify, SharesAreConservedByCollapsesAndRestoredBySplits) {
  const test::Disk disk = test::make_disk(test::bumpy_grid(15, 12, 0.2, 3), BoundaryShape::kCircle);
  ExecutionContext context;
  PlanarMap map = make_planar_map(disk.surface.faces, disk.loop, with_boundary(disk), true);
  CollapseRecord record;
  collapse_all(map, record, context);
  double total = 0.0;
  for (FaceId f = 0; f < map.mesh.face_count(); ++f) {
    if (map.mesh.is_alive(f)) total += map.share[static_cast<std::size_t>(f)];
  }
  EXPECT_NEAR(total, static_cast<double>(map.mesh.face_count()), 1e-6);
  for (; !record.empty(); record.pop_back()) split_vertex(map, record.back());
  for (const double share : map.share) EXPECT_NEAR(share, 1.0, 1e-9);
}

TEST(Simplify, vertices_left_are_those_that_no_collapse_removed) {
  const test::Disk disk = test::make_disk(test::bumpy_grid(8, 8, 0.2, 2.0), BoundaryShape::kCircle);
  PlanarMap map = test::valid_map(disk, true);
  std::mt19937 random(1);
  CollapseRecord record;
  std::vector<char> gone(static_cast<std::size_t>(disk.vertex_count()), 0);
  for (int i = 0; i < 400; ++i) {
    const auto h =
        static_cast<HalfedgeId>(random() % static_cast<unsigned>(disk.surface.faces.size()));
    if (!map.mesh.is_alive(h / 3) || !map.mesh.can_collapse(h)) continue;
    gone[static_cast<std::size_t>(map.mesh.source(h))] = 1;
    collapse_vertex(map, h);
    record.push_back(h);
  }
  ASSERT_GT(record.size(), 10U);
  std::vector<VertexId> expected;
  for (VertexId v = 0; v < disk.vertex_count(); ++v) {
    if (!map.mesh.is_boundary(v) && !gone[static_cast<std::size_t>(v)]) expected.push_back(v);
  }
  EXPECT_EQ(vertices_left(map, record), expected);
}

TEST(Simplify, invalid_maps_become_valid_where_no_vertex_need_move_and_the_record_undoes_it) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    const test::Disk disk =
        test::make_disk(test::bumpy_grid(12, 10, 0.2, 2.0), BoundaryShape::kCircle);
    PlanarMap map = test::valid_map(disk, true);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-0.4, 0.4);
    for (VertexId v = 0; v < disk.vertex_count(); ++v) {
      if (!map.mesh.is_boundary(v) && random() % 4 == 0)
        map.move(v, map.snap(Vector2(place(random), place(random))));
    }
    const PlanarMap before = map;
    CollapseRecord record;
    ExecutionContext context;
    collapse_invalid(map, seed % 2 == 0, 100000, record, context);
    for (FaceId f = 0; f < map.mesh.face_count(); ++f)
      EXPECT_TRUE(!map.mesh.is_alive(f) || is_valid_face(map, f));
    EXPECT_TRUE(seed % 2 == 0 || !record.empty());
    for (; !record.empty(); record.pop_back()) split_vertex(map, record.back());
    EXPECT_EQ(map.mesh.corners(), before.mesh.corners());
    EXPECT_EQ(map.mesh.opposites(), before.mesh.opposites());
  }
}

TEST(Simplify, more_collapses_than_allowed_are_refused) {
  const test::Disk disk =
      test::make_disk(test::bumpy_grid(12, 10, 0.2, 2.0), BoundaryShape::kCircle);
  PlanarMap map = make_planar_map(disk.surface.faces, disk.loop, with_boundary(disk), true);
  CollapseRecord record;
  ExecutionContext context;
  try {
    collapse_invalid(map, false, 3, record, context);
    FAIL();
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kIterationLimit);
  }
}

TEST(Simplify, collapsing_everything_leaves_one_vertex_in_its_kernel) {
  const test::Disk disk =
      test::make_disk(test::bumpy_grid(12, 10, 0.2, 2.0), BoundaryShape::kCircle);
  PlanarMap map = make_planar_map(disk.surface.faces, disk.loop, with_boundary(disk), true);
  CollapseRecord record;
  ExecutionContext context;
  collapse_all(map, record, context);
  EXPECT_EQ(vertices_left(map, record).size(), 1U);
  for (FaceId f = 0; f < map.mesh.face_count(); ++f)
    EXPECT_TRUE(!map.mesh.is_alive(f) || map.positive(f));
}

}  // namespace
}  // namespace flipfree::embedding::simplify_test
