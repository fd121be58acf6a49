// Symmetric flips of 4.4.3: each is a sequence of plain flips, so its closed-form lengths must
// agree with Ptolemy's formula applied flip by flip, the reflection must survive, and doing and
// undoing must give the lengths back.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "flipfree/intrinsic/flip_lengths.h"
#include "flipfree/intrinsic/symmetric_flips.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::symmetric_flips_test {
namespace {

// Random lengths that are symmetric and, being log-uniform, mostly violate the triangle inequality.
std::vector<double> random_lengths(const IntrinsicMesh& mesh, std::mt19937& random, double spread) {
  std::uniform_real_distribution<double> uniform(-spread, spread);
  std::vector<double> length(mesh.edge_count());
  for (std::size_t e = 0; e < length.size(); ++e) {
    length[e] = std::exp(uniform(random));
    if (mesh.symmetric()) {
      const HalfedgeId r = mesh.reflection[2 * e];
      if ((r >> 1) < static_cast<Index>(e)) length[e] = length[at(r >> 1)];
    }
  }
  return length;
}

void plain_ptolemy_flip(IntrinsicMesh& mesh, std::vector<double>& length, EdgeId e) {
  const auto l = [&](HalfedgeId h) { return length[at(h >> 1)]; };
  const HalfedgeId h = 2 * e;
  const HalfedgeId hn = mesh.next[at(h)];
  const HalfedgeId hp = mesh.next[at(hn)];
  const HalfedgeId on = mesh.next[at(h + 1)];
  const HalfedgeId op = mesh.next[at(on)];
  const double z = (l(hn) * l(on) + l(hp) * l(op)) / l(h);
  flip_edge(mesh, e);
  length[at(e)] = z;
}

// The judge of the walks below.
TEST(IntrinsicMesh, ABrokenReflectionLabelOrFaceIsFound) {
  const IntrinsicMesh good = build_intrinsic_mesh(16, test::grid(3, 3).faces).mesh;
  IntrinsicMesh mesh = good;
  std::swap(mesh.reflection[0], mesh.reflection[2]);
  EXPECT_NE(find_broken_invariant(mesh), "");
  mesh = good;
  mesh.edge_label[0] = mesh.edge_label[0] == EdgeLabel::kOne ? EdgeLabel::kTwo : EdgeLabel::kOne;
  EXPECT_NE(find_broken_invariant(mesh), "");
  mesh = good;
  mesh.face_label[0] = FaceLabel::kQuad;
  EXPECT_NE(find_broken_invariant(mesh), "");
  mesh = good;
  mesh.face_halfedge[0] = mesh.face_halfedge[1];
  EXPECT_NE(find_broken_invariant(mesh), "");
}

struct Walk {
  IntrinsicMesh mesh;
  IntrinsicMesh plain_mesh;
  std::vector<double> length;
  std::vector<double> plain_length;
  std::array<int, kFlipTypes> count{};
};

// `steps` random symmetric flips, each mirrored by plain ones; checks everything after each.
void walk(Walk& w, std::mt19937& random, int steps) {
  FlipLengths<double> lengths(w.length);
  for (int i = 0; i < steps; ++i) {
    const EdgeId e = static_cast<EdgeId>(random() % w.mesh.edge_count());
    FlipType type = FlipType::kInterior;
    if (!flip_type(w.mesh, e, type)) continue;
    const FlipStencil stencil = flip_stencil(w.mesh, e, type);
    lengths.ptolemy(stencil);
    flip_symmetrically(w.mesh, stencil);
    ++w.count[static_cast<std::size_t>(type)];
    for (int k = 0; k < stencil.plain.count; ++k) {
      plain_ptolemy_flip(w.plain_mesh, w.plain_length,
                         stencil.plain.edges[static_cast<std::size_t>(k)]);
    }
    ASSERT_EQ(find_broken_invariant(w.mesh), "")
        << "after flip " << i << " of type " << static_cast<int>(type);
    for (int k = 0; k < stencil.plain.count; ++k) {
      const std::size_t changed = at(stencil.plain.edges[static_cast<std::size_t>(k)]);
      ASSERT_NEAR(w.length[changed] / w.plain_length[changed], 1.0, 1e-9)
          << "flip " << i << " of type " << static_cast<int>(type) << ", edge " << k;
    }
    ASSERT_EQ(w.mesh.next, w.plain_mesh.next);
    ASSERT_EQ(w.mesh.origin, w.plain_mesh.origin);
  }
}

TEST(SymmetricFlips, closed_forms_agree_with_plain_ptolemy_flips_for_all_seven_types) {
  std::mt19937 random(5);
  std::array<int, kFlipTypes> count{};
  for (int round = 0; round < 60; ++round) {
    const mesh::Surface surface = round % 3 == 0   ? test::grid(3, 3)
                                  : round % 3 == 1 ? test::cylinder(4, 2)
                                                   : test::grid(1, 1);
    IntrinsicSetup setup =
        build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces);
    ASSERT_EQ(find_broken_invariant(setup.mesh), "");
    Walk w;
    w.mesh = setup.mesh;
    w.plain_mesh = setup.mesh;
    w.length = random_lengths(w.mesh, random, 0.2);
    w.plain_length = w.length;
    walk(w, random, 60);
    if (HasFatalFailure()) return;
    for (int t = 0; t < kFlipTypes; ++t)
      count[static_cast<std::size_t>(t)] += w.count[static_cast<std::size_t>(t)];
  }
  for (int t = 0; t < kFlipTypes; ++t)
    EXPECT_GT(count[static_cast<std::size_t>(t)], 10) << "type " << t;
}

TEST(SymmetricFlips, flipping_back_restores_lengths_and_connectivity) {
  std::mt19937 random(9);
  for (int round = 0; round < 40; ++round) {
    const mesh::Surface surface = round % 2 == 0 ? test::torus(4, 3) : test::grid(3, 2);
    IntrinsicSetup setup =
        build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces);
    Walk w;
    w.mesh = setup.mesh;
    w.plain_mesh = setup.mesh;
    w.length = random_lengths(w.mesh, random, 0.2);
    w.plain_length = w.length;
    walk(w, random, 30);
    if (HasFatalFailure()) return;
    FlipLengths<double> lengths(w.length);
    for (EdgeId e = 0; e < static_cast<EdgeId>(w.mesh.edge_count()); ++e) {
      FlipType type = FlipType::kInterior;
      if (!flip_type(w.mesh, e, type)) continue;
      const IntrinsicMesh mesh_before = w.mesh;
      const std::vector<double> length_before = w.length;
      const FlipStencil there = flip_stencil(w.mesh, e, type);
      lengths.ptolemy(there);
      flip_symmetrically(w.mesh, there);
      // The edge that now stands for the flipped one: the crossing edge, or the one in copy 1.
      EdgeId created = there.new_cross != kInvalid ? there.new_cross : there.new_side;
      if (w.mesh.symmetric() && w.mesh.label_of_edge(created) == EdgeLabel::kTwo)
        created = there.new_side2;
      FlipType inverse = FlipType::kInterior;
      ASSERT_TRUE(flip_type(w.mesh, created, inverse));
      const FlipStencil back = flip_stencil(w.mesh, created, inverse);
      lengths.ptolemy(back);
      flip_symmetrically(w.mesh, back);
      // Ids may be permuted among the edges that the flip touched; as sets of (length, ends) they
      // are the same.
      std::vector<std::array<double, 3>> before;
      std::vector<std::array<double, 3>> after;
      const auto describe = [](const IntrinsicMesh& m, const std::vector<double>& l, auto& out) {
        for (std::size_t k = 0; k < l.size(); ++k) {
          const double a = m.unknown[at(m.origin[2 * k])];
          const double b = m.unknown[at(m.origin[2 * k + 1])];
          out.push_back({std::min(a, b), std::max(a, b), std::round(l[k] / 1e-6)});
        }
        std::sort(out.begin(), out.end());
      };
      describe(mesh_before, length_before, before);
      describe(w.mesh, w.length, after);
      for (std::size_t k = 0; k < before.size(); ++k) {
        ASSERT_EQ(before[k][0], after[k][0]);
        ASSERT_EQ(before[k][1], after[k][1]);
        ASSERT_NEAR(before[k][2], after[k][2], 1.0 + 1e-6 * before[k][2]);
      }
      ASSERT_EQ(find_broken_invariant(w.mesh), "");
    }
  }
}

TEST(SymmetricFlips, a_single_triangle_with_boundary_can_flip_into_faces_glued_to_themselves) {
  mesh::Surface surface;
  surface.vertices.resize(3, 3);
  surface.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  surface.faces.resize(1, 3);
  surface.faces << 0, 1, 2;
  IntrinsicMesh mesh = build_intrinsic_mesh(3, surface.faces).mesh;
  FlipType type = FlipType::kInterior;
  ASSERT_TRUE(flip_type(mesh, 0, type));
  ASSERT_EQ(type, FlipType::kParallel);
  flip_symmetrically(mesh, flip_stencil(mesh, 0, type));
  EXPECT_EQ(find_broken_invariant(mesh), "");
  // Both other edges are now glued to themselves around vertices of valence 1 and never flip.
  EXPECT_FALSE(flip_type(mesh, 1, type));
  EXPECT_FALSE(flip_type(mesh, 2, type));
  ASSERT_TRUE(flip_type(mesh, 0, type));
  EXPECT_EQ(type, FlipType::kPerpendicular);
  flip_symmetrically(mesh, flip_stencil(mesh, 0, type));
  EXPECT_EQ(find_broken_invariant(mesh), "");
}

}  // namespace
}  // namespace flipfree::intrinsic::symmetric_flips_test
