#include "flipfree/mesh/refined/refined_surface.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "flipfree/mesh/adjacency.h"
#include "fuzz/rational.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::mesh::refined_surface_test {
namespace {

using fuzz::Rational;

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
    const Support exact = between(a, other, share);
    a = rounded_between(a, other, share);
    EXPECT_EQ(sum_of(a), 1);
    expect_tidy(a);
    for (const VertexId v : {3, 5, 8}) {
      EXPECT_TRUE(is_multiple(a.of(v)));
      EXPECT_GE(a.of(v), 0.0);
      EXPECT_LE(std::abs(a.of(v) - exact.of(v)), std::ldexp(1.0, -50));
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
                         between(refined.support[static_cast<std::size_t>(face[1])],
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

}  // namespace
}  // namespace flipfree::mesh::refined_surface_test
