// Symmetric flips of 4.4.3: each is a sequence of plain flips, so its closed-form lengths must
// agree with Ptolemy's formula applied flip by flip, the reflection must survive, and doing and
// undoing must give the lengths back.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "flipfree/conformal/flip_lengths.h"
#include "flipfree/conformal/intrinsic_mesh.h"
#include "support/shapes.h"

namespace flipfree::conformal {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

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
    const Surface surface = round % 3 == 0   ? test::grid(3, 3)
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

}  // namespace
}  // namespace flipfree::conformal
