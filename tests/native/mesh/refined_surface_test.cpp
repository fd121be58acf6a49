#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "fuzz/rational.h"
#include "support/corner_maps.h"
#include "support/openmesh_triangulation.h"
#include "support/shapes.h"

namespace flipfree::mesh::refined_surface_test {
namespace {

using fuzz::Rational;
using test::Corners;

Rational sum_of(const Support& s) {
  return Rational(s.weight[0]) + Rational(s.weight[1]) + Rational(s.weight[2]);
}

bool is_multiple(double weight) {
  const double scaled = std::ldexp(weight, 52);
  return scaled == std::floor(scaled);
}

// Sorted, without gaps, nothing where no vertex is.
void expect_tidy(const Support& s) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (s.vertex[i] == kInvalid) {
      EXPECT_EQ(s.weight[i], 0.0);
    } else if (i > 0) {
      EXPECT_LT(s.vertex[i - 1], s.vertex[i]);
    }
  }
}

TEST(Support, rounded_points_sum_to_one_exactly_in_multiples_that_stay_exact) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  Support a{{3, kInvalid, kInvalid}, {1.0, 0.0, 0.0}};
  const std::array<Support, 3> corner = {a, Support{{5, kInvalid, kInvalid}, {1.0, 0.0, 0.0}},
                                         Support{{8, kInvalid, kInvalid}, {1.0, 0.0, 0.0}}};
  // Repeatedly towards a corner: errors of one step are the next one's input.
  for (int i = 0; i < 2000; ++i) {
    const Support& other = corner[random() % 3];
    const double share = random() % 5 == 0 ? std::ldexp(any(random), -60) : any(random);
    const Support before = a;
    a = rounded_between(a, other, share);
    EXPECT_EQ(sum_of(a), 1);
    expect_tidy(a);
    for (const VertexId v : {3, 5, 8}) {
      EXPECT_TRUE(is_multiple(a.of(v)));
      EXPECT_GE(a.of(v), 0.0);
      const double exact = (1 - share) * before.of(v) + share * other.of(v);
      EXPECT_LE(std::abs(a.of(v) - exact), std::ldexp(1.0, -50));
    }
  }
}

// What has been promised of every refined surface: weights exact, faces turned as their parents,
// each parent covered exactly once, positions where the weights say.
void expect_subdivides(const RefinedSurface& refined) {
  refined.mesh.check_invariants();
  const Surface& input = *refined.input;
  std::vector<Rational> covered(static_cast<std::size_t>(input.faces.rows()), 0);
  for (FaceId f = 0; f < refined.mesh.face_slots(); ++f) {
    if (!refined.mesh.alive(f) || refined.in_collar(f)) continue;
    const FaceId p = refined.mesh.parent(f);
    std::array<fuzz::Point, 3> at;
    std::size_t k = 0;
    for (const VertexId v : refined.mesh.corners(f)) {
      const Support& s = refined.support[static_cast<std::size_t>(v)];
      at[k++] = {Rational(s.of(input.faces(p, 1))), Rational(s.of(input.faces(p, 2)))};
      EXPECT_EQ(Rational(s.of(input.faces(p, 0))) + at[k - 1].x + at[k - 1].y, 1)
          << "vertex " << v << " is not in face " << p;
    }
    const Rational area = fuzz::area(at[0], at[1], at[2]);
    EXPECT_GT(area, 0);
    const auto [a, b, c] = refined.mesh.corners(f);
    EXPECT_EQ(refined.orientation_in_parent(p, a, b, c), 1);
    EXPECT_EQ(refined.orientation_in_parent(p, a, c, b), -1);
    EXPECT_EQ(refined.orientation_in_parent(p, a, b, a), 0);
    covered[static_cast<std::size_t>(p)] += area;
  }
  for (const Rational& area : covered) EXPECT_EQ(area, 1);
}

// Splits at random: edges at midpoints, faces at rounded points.
void refine(RefinedSurface& refined, int steps, std::mt19937& random) {
  const auto support = [&](VertexId v) { return refined.support[static_cast<std::size_t>(v)]; };
  for (int i = 0; i < steps; ++i) {
    const FaceId f =
        static_cast<FaceId>(random() % static_cast<unsigned>(refined.mesh.face_slots()));
    if (!refined.mesh.alive(f)) continue;
    const HalfedgeId h = 3 * f + static_cast<Index>(random() % 3);
    const VertexId a = refined.mesh.source(h), b = refined.mesh.target(h);
    const double wanted = (1.0 + static_cast<double>(random() % 15)) / 16.0;
    VertexId added = kInvalid;
    if (refined.in_collar(f) || random() % 3 != 0) {
      const Vector3 expected = 0.5 * (refined.position[static_cast<std::size_t>(a)] +
                                      refined.position[static_cast<std::size_t>(b)]);
      added = refined.split_edge(h);
      EXPECT_LT((refined.position[static_cast<std::size_t>(added)] - expected).norm(), 1e-13);
    } else {
      const auto [p, q, r] = refined.mesh.corners(f);
      const Support where = rounded_between(
          support(p), rounded_between(support(q), support(r), 0.1 + 0.8 * wanted), 0.7 * wanted);
      added = refined.split_face(f, where);
    }
    EXPECT_EQ(added, static_cast<VertexId>(refined.support.size()) - 1);
    EXPECT_EQ(refined.support.size(), refined.position.size());
  }
}

TEST(RefinedSurface, random_splits_subdivide_the_input_exactly) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    const Surface input = test::bumpy_grid(3, 2, 0.4, 2.0);
    RefinedSurface refined = make_refined_surface(input);
    expect_subdivides(refined);
    refine(refined, 60, random);
    expect_subdivides(refined);
    for (std::size_t v = 0; v < refined.support.size(); ++v)
      EXPECT_EQ(refined.place(refined.support[v]), refined.position[v]);
  }
}

TEST(WithCollar, surrounds_the_surface_and_compacting_takes_it_away_again) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    std::mt19937 random(seed);
    const Surface input = seed % 2 == 0 ? test::bumpy_grid(3, 2, 0.4, 2.0)
                                        : test::stacked(12, test::Stacking::kRandom, seed);
    RefinedSurface bare = make_refined_surface(input);
    refine(bare, static_cast<int>(seed) * 3, random);
    RefinedSurface refined = with_collar(bare);
    expect_subdivides(refined);
    EXPECT_GE(refined.outer_boundary.size(), 4U);
    EXPECT_TRUE(topology(refined.mesh.faces(),
                         build_adjacency(refined.mesh.vertex_count(), refined.mesh.faces()))
                    .is_disk());
    for (const VertexId v : refined.outer_boundary) {
      EXPECT_TRUE(refined.mesh.is_boundary_vertex(v));
      EXPECT_TRUE(refined.support[static_cast<std::size_t>(v)].empty());
    }
    for (const VertexId v : refined.boundary) EXPECT_FALSE(refined.mesh.is_boundary_vertex(v));
    refine(refined, 40, random);
    expect_subdivides(refined);

    std::vector<VertexId> old_vertex;
    const RefinedSurface compact = compacted(refined, old_vertex);
    expect_subdivides(compact);
    EXPECT_EQ(compact.mesh.face_slots(), compact.mesh.faces().rows()) << "gaps";
    EXPECT_EQ(compact.outer_boundary, compact.boundary);
    for (VertexId v = 0; v < compact.mesh.vertex_count(); ++v) {
      const auto old = static_cast<std::size_t>(old_vertex[static_cast<std::size_t>(v)]);
      EXPECT_TRUE(v >= compact.input_vertices() || static_cast<VertexId>(old) == v);
      EXPECT_NE(compact.mesh.outgoing(v), kInvalid);
      EXPECT_EQ(compact.support[static_cast<std::size_t>(v)].vertex, refined.support[old].vertex);
      EXPECT_EQ(compact.support[static_cast<std::size_t>(v)].weight, refined.support[old].weight);
      EXPECT_EQ(compact.position[static_cast<std::size_t>(v)], refined.position[old]);
    }
  }
}

TEST(Compacted, keeps_the_inputs_isolated_vertices_and_no_other) {
  Surface input = test::grid(2, 2);
  input.vertices.conservativeResize(11, 3);
  input.vertices.bottomRows<2>().setOnes();
  RefinedSurface refined = make_refined_surface(input);
  const std::array<VertexId, 3> face = refined.mesh.corners(0);
  const VertexId gone = refined.split_face(
      0, rounded_between(refined.support[static_cast<std::size_t>(face[0])],
                         rounded_between(refined.support[static_cast<std::size_t>(face[1])],
                                         refined.support[static_cast<std::size_t>(face[2])], 0.5),
                         0.5));
  const std::vector<FaceId> star = refined.mesh.star(gone);
  refined.mesh.replace(star, std::array<EditableTriangulation::Triangle, 1>{face},
                       std::array<FaceId, 1>{0});
  std::vector<VertexId> old_vertex;
  const RefinedSurface compact = compacted(refined, old_vertex);
  EXPECT_EQ(compact.mesh.vertex_count(), 11);
  EXPECT_EQ(compact.mesh.faces().rows(), 8);
  expect_subdivides(compact);
}

// Every operation of EditableTriangulation, at random, against the same on OpenMesh's half-edges.
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
}  // namespace flipfree::mesh::refined_surface_test
