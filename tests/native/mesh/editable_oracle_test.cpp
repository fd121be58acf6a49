// Every operation of EditableTriangulation, at random, against the same on OpenMesh's half-edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "support/openmesh_triangulation.h"
#include "support/shapes.h"

namespace flipfree::mesh::editable_oracle_test {
namespace {

using test::Corners;

class Pair {
 public:
  Pair(const Surface& surface, unsigned seed)
      : ours_(static_cast<Index>(surface.vertices.rows()), surface.faces),
        theirs_(static_cast<Index>(surface.vertices.rows()), surface.faces),
        random_(seed) {}

  // One operation; false if this one cannot be done where chance has put it.
  bool step() {
    switch (random_() % 6) {
      case 0:
        return mark();
      case 1:
        return split_edge();
      case 2:
        return split_face();
      case 3:
        return flip();
      case 4:
        return remove_vertex();
      default:
        return retriangulate();
    }
  }
  void expect_same() {
    ours_.check_invariants();
    ASSERT_TRUE(test::state_of(ours_) == theirs_.state());
  }

 private:
  HalfedgeId any_halfedge() {
    for (;;) {
      const auto h =
          static_cast<HalfedgeId>(random_() % static_cast<unsigned>(ours_.halfedge_slots()));
      if (ours_.alive(h / 3)) return h;
    }
  }

  bool mark() {
    const HalfedgeId h = any_halfedge();
    const auto value = static_cast<Index>(random_() % 5) - 1;
    ours_.set_mark(h, value);
    theirs_.set_mark(ours_.source(h), ours_.target(h), value);
    return true;
  }

  bool split_edge() {
    const HalfedgeId h = any_halfedge();
    const VertexId a = ours_.source(h), b = ours_.target(h);
    const VertexId s = ours_.split_edge(h);
    EXPECT_EQ(ours_.source(h), a);
    EXPECT_EQ(ours_.target(h), s);
    theirs_.split_edge(a, b);
    return true;
  }

  bool split_face() {
    const FaceId f = any_halfedge() / 3;
    const Corners corners = ours_.corners(f);
    ours_.split_face(f);
    theirs_.split_face(corners);
    return true;
  }

  bool flip() {
    const HalfedgeId h = any_halfedge();
    if (ours_.is_boundary(h)) return false;
    if (ours_.find(ours_.apex(h), ours_.apex(ours_.opposite(h))) != kInvalid) return false;
    const VertexId a = ours_.source(h), b = ours_.target(h);
    ours_.flip_edge(h);
    theirs_.flip_edge(a, b);
    return true;
  }

  // A fan from ring[0] over the polygon `ring`, if its diagonals are no edges yet.
  std::vector<Corners> fan(const std::vector<VertexId>& ring, bool closed) const {
    std::vector<Corners> triangles;
    const std::size_t last = ring.size() - 1;
    if (ring.size() < 3 || std::set<VertexId>(ring.begin(), ring.end()).size() != ring.size())
      return {};
    for (std::size_t i = 2; i <= last; ++i) {
      if ((i < last || !closed) && ours_.find(ring[0], ring[i]) != kInvalid) return {};
      triangles.push_back({ring[0], ring[i - 1], ring[i]});
    }
    return triangles;
  }

  void replace(const std::vector<FaceId>& faces, const std::vector<Corners>& triangles) {
    std::vector<Corners> old;
    std::vector<FaceId> parents;
    for (const FaceId f : faces) old.push_back(ours_.corners(f));
    for (std::size_t t = 0; t < triangles.size(); ++t)
      parents.push_back(ours_.parent(faces[random_() % faces.size()]));
    ours_.replace(faces, triangles, parents);
    theirs_.replace(old, triangles, parents);
  }

  // Takes a vertex out: an inner one, or one of the boundary, which then runs past it.
  bool remove_vertex() {
    const VertexId v = ours_.source(any_halfedge());
    const bool inner = !ours_.is_boundary_vertex(v);
    std::vector<VertexId> ring;
    HalfedgeId last = kInvalid;
    ours_.for_each_outgoing(v, [&](HalfedgeId h) { ring.push_back(ours_.target(last = h)); });
    if (inner) {
      const auto turn = static_cast<std::ptrdiff_t>(random_() % ring.size());
      std::rotate(ring.begin(), ring.begin() + turn, ring.end());
    } else {
      ring.push_back(ours_.apex(last));
    }
    const std::vector<Corners> triangles = fan(ring, inner);
    if (triangles.empty()) return false;
    replace(ours_.star(v), triangles);
    EXPECT_EQ(ours_.outgoing(v), kInvalid);
    return true;
  }

  // A star by its own triangles in another order, with other parents.
  bool retriangulate() {
    const VertexId v = ours_.source(any_halfedge());
    if (ours_.is_boundary_vertex(v)) return false;
    std::vector<Corners> triangles;
    const std::vector<FaceId> star = ours_.star(v);
    for (const FaceId f : star) triangles.push_back(ours_.corners(f));
    std::shuffle(triangles.begin(), triangles.end(), random_);
    for (Corners& t : triangles)
      std::rotate(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(random_() % 3), t.end());
    replace(star, triangles);
    return true;
  }

  EditableTriangulation ours_;
  test::OpenMeshTriangulation theirs_;
  std::mt19937 random_;
};

void run(const Surface& surface) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Pair pair(surface, seed);
    int done = 0;
    for (int i = 0; i < 300; ++i) {
      done += pair.step() ? 1 : 0;
      pair.expect_same();
      if (::testing::Test::HasFatalFailure()) return;
    }
    EXPECT_GT(done, 150);
  }
}

TEST(EditableOracle, OperationsOnADiskAreThoseOfOpenMesh) { run(test::grid(4, 3)); }
TEST(EditableOracle, OperationsOnASphereAreThoseOfOpenMesh) { run(test::sphere(6, 4)); }
TEST(EditableOracle, OperationsOnATorusAreThoseOfOpenMesh) { run(test::torus(6, 5)); }
TEST(EditableOracle, OperationsBetweenTwoBoundariesAreThoseOfOpenMesh) {
  run(test::cylinder(7, 3));
}

}  // namespace
}  // namespace flipfree::mesh::editable_oracle_test
