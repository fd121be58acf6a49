#include "flipfree/embedding/progressive/planar_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "embedding/disks.h"

namespace flipfree::embedding::planar_mesh_test {
namespace {

PlanarMesh mesh_of(const test::Disk& disk) {
  return PlanarMesh(disk.surface.faces, disk.vertex_count(), disk.loop);
}

// Everything that connectivity means, recomputed from the live faces alone.
void expect_consistent(const PlanarMesh& mesh) {
  std::set<std::pair<VertexId, VertexId>> edges;
  std::vector<Index> faces_at(static_cast<std::size_t>(mesh.vertex_count()), 0);
  for (FaceId f = 0; f < mesh.face_count(); ++f) {
    if (!mesh.is_alive(f)) continue;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      ++faces_at[static_cast<std::size_t>(mesh.source(h))];
      EXPECT_TRUE(edges.emplace(mesh.source(h), mesh.target(h)).second);
      const HalfedgeId o = mesh.opposite(h);
      if (o == kInvalid) continue;
      ASSERT_TRUE(mesh.is_alive(o / 3));
      ASSERT_EQ(mesh.opposite(o), h);
      ASSERT_EQ(mesh.source(o), mesh.target(h));
    }
  }
  for (VertexId v = 0; v < mesh.vertex_count(); ++v) {
    const Index faces = faces_at[static_cast<std::size_t>(v)];
    if (faces == 0) continue;
    EXPECT_EQ(mesh.degree(v), faces + (mesh.is_boundary(v) ? 1 : 0));
    ASSERT_TRUE(mesh.is_alive(mesh.outgoing(v) / 3));
    ASSERT_EQ(mesh.source(mesh.outgoing(v)), v);
    Index visited = 0;
    HalfedgeId h = mesh.outgoing(v);
    do {
      ++visited;
      h = mesh.rotate(h);
    } while (h != kInvalid && h != mesh.outgoing(v));
    EXPECT_EQ(visited, faces);
  }
}

// Collapses random edges that the link condition allows, until none is left. Returns the record.
std::vector<HalfedgeId> collapse_randomly(PlanarMesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<HalfedgeId> record;
  for (bool any = true; any;) {
    any = false;
    std::vector<HalfedgeId> order;
    for (HalfedgeId h = 0; h < 3 * mesh.face_count(); ++h) order.push_back(h);
    std::shuffle(order.begin(), order.end(), random);
    for (const HalfedgeId h : order) {
      if (!mesh.is_alive(h / 3) || !mesh.can_collapse(h)) continue;
      mesh.collapse(h);
      record.push_back(h);
      any = true;
    }
  }
  return record;
}

TEST(PlanarMesh, SplitUndoesCollapseBitForBit) {
  const test::Disk disk =
      test::make_disk(test::stacked(60, test::Stacking::kMixed), BoundaryShape::kTriangle);
  PlanarMesh mesh = mesh_of(disk);
  const auto corners = mesh.corners();
  const auto opposites = mesh.opposites();
  int tried = 0;
  for (HalfedgeId h = 0; h < 3 * mesh.face_count(); ++h) {
    if (!mesh.can_collapse(h)) continue;
    mesh.collapse(h);
    expect_consistent(mesh);
    mesh.split(h);
    ASSERT_EQ(mesh.corners(), corners);
    ASSERT_EQ(mesh.opposites(), opposites);
    ++tried;
  }
  EXPECT_GT(tried, 30);
  expect_consistent(mesh);
}

TEST(PlanarMesh, AWholeRecordOfRandomCollapsesIsReversible) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const test::Disk disk =
        test::make_disk(test::bumpy_grid(11, 9, 0.1, 2), BoundaryShape::kCircle);
    PlanarMesh mesh = mesh_of(disk);
    const auto corners = mesh.corners();
    const auto opposites = mesh.opposites();
    std::vector<HalfedgeId> record = collapse_randomly(mesh, seed);
    expect_consistent(mesh);
    while (!record.empty()) {
      mesh.split(record.back());
      record.pop_back();
      if (record.size() % 10 == 0) expect_consistent(mesh);
    }
    EXPECT_EQ(mesh.corners(), corners);
    EXPECT_EQ(mesh.opposites(), opposites);
  }
}

// Theorem 3.8: there is always an edge that can be collapsed until one inner vertex is left.
TEST(PlanarMesh, CollapsesEndAtASingleInnerVertexWhateverTheirOrder) {
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    const test::Disk disk = test::opened(test::sphere(12, 8));
    PlanarMesh mesh = mesh_of(disk);
    const auto record = collapse_randomly(mesh, seed);
    EXPECT_EQ(static_cast<Index>(record.size()) + 4, disk.vertex_count());
  }
}

TEST(PlanarMesh, LinkConditionForbidsExactlyWhatWouldGlueEdgesTogether) {
  const test::Disk disk =
      test::make_disk(test::stacked(40, test::Stacking::kDeep), BoundaryShape::kTriangle);
  const PlanarMesh mesh = mesh_of(disk);
  std::vector<std::set<VertexId>> neighbours(static_cast<std::size_t>(mesh.vertex_count()));
  for (HalfedgeId h = 0; h < 3 * mesh.face_count(); ++h) {
    neighbours[static_cast<std::size_t>(mesh.source(h))].insert(mesh.target(h));
    neighbours[static_cast<std::size_t>(mesh.target(h))].insert(mesh.source(h));
  }
  int forbidden = 0;
  for (HalfedgeId h = 0; h < 3 * mesh.face_count(); ++h) {
    const auto& a = neighbours[static_cast<std::size_t>(mesh.source(h))];
    const auto& b = neighbours[static_cast<std::size_t>(mesh.target(h))];
    std::vector<VertexId> common;
    std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(common));
    const bool inner = !mesh.is_boundary(mesh.source(h)) && !mesh.is_boundary(mesh.target(h));
    EXPECT_EQ(mesh.can_collapse(h), inner && common.size() == 2);
    forbidden += inner && common.size() != 2;
  }
  EXPECT_GT(forbidden, 10);
}

}  // namespace
}  // namespace flipfree::embedding::planar_mesh_test
