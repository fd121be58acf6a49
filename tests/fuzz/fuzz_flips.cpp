#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "finding.h"
#include "flipfree/intrinsic/flip_lengths.h"
#include "flipfree/intrinsic/symmetric_flips.h"
#include "meshes.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

using intrinsic::EdgeLabel;
using intrinsic::FlipLengths;
using intrinsic::FlipStencil;
using intrinsic::FlipType;
using intrinsic::IntrinsicMesh;

// Edges as what does not depend on their numbers: ends and length.
std::vector<std::array<double, 3>> described(const intrinsic::IntrinsicMesh& mesh,
                                             const std::vector<double>& length) {
  std::vector<std::array<double, 3>> edges;
  for (std::size_t e = 0; e < length.size(); ++e) {
    const double a = mesh.unknown[at(mesh.origin[2 * e])];
    const double b = mesh.unknown[at(mesh.origin[2 * e + 1])];
    edges.push_back({std::min(a, b), std::max(a, b), length[e]});
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

void require_valid(const intrinsic::IntrinsicMesh& mesh) {
  const std::string broken = intrinsic::find_broken_invariant(mesh);
  if (!broken.empty()) throw Finding{"a flip broke the mesh: " + broken};
}

void flip(intrinsic::IntrinsicMesh& mesh, std::vector<double>& length,
          const intrinsic::FlipStencil& stencil) {
  intrinsic::FlipLengths<double>(length).ptolemy(stencil);
  intrinsic::flip_symmetrically(mesh, stencil);
  require_valid(mesh);
}

// The edge that stands for the flipped one: the crossing edge, or the one in copy 1.
EdgeId created(const intrinsic::IntrinsicMesh& mesh, const intrinsic::FlipStencil& stencil) {
  if (stencil.new_cross != kInvalid) return stencil.new_cross;
  const bool mirrored =
      mesh.symmetric() && mesh.label_of_edge(stencil.new_side) == intrinsic::EdgeLabel::kTwo;
  return mirrored ? stencil.new_side2 : stencil.new_side;
}

}  // namespace

void fuzz_flips(Bytes bytes) {
  const mesh::Surface surface = read_mesh(bytes, Kind::kConnected, 24);
  intrinsic::IntrinsicMesh mesh =
      intrinsic::build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces)
          .mesh;
  require_valid(mesh);
  // Symmetric, and mostly in breach of the triangle inequality. Small ranges: each of some hundred
  // flips multiplies lengths.
  std::vector<double> length(mesh.edge_count());
  for (std::size_t e = 0; e < length.size(); ++e) {
    length[e] = std::exp(0.2 * bytes.fraction());
    if (!mesh.symmetric()) continue;
    const HalfedgeId r = mesh.reflection[2 * e];
    if (r != kInvalid && at(r >> 1) < e) length[e] = length[at(r >> 1)];
  }
  while (!bytes.empty()) {
    const EdgeId e = bytes.below(static_cast<Index>(mesh.edge_count()));
    intrinsic::FlipType type = intrinsic::FlipType::kInterior;
    if (!intrinsic::flip_type(mesh, e, type)) continue;
    const auto before = described(mesh, length);
    const intrinsic::IntrinsicMesh mesh_before = mesh;
    const std::vector<double> length_before = length;
    const intrinsic::FlipStencil there = intrinsic::flip_stencil(mesh, e, type);
    flip(mesh, length, there);
    for (const double x : length) require(x > 0.0, "a length is not positive");
    intrinsic::IntrinsicMesh back = mesh;
    std::vector<double> length_back = length;
    const EdgeId now = created(back, there);
    intrinsic::FlipType inverse = intrinsic::FlipType::kInterior;
    require(intrinsic::flip_type(back, now, inverse), "a flip cannot be undone");
    flip(back, length_back, intrinsic::flip_stencil(back, now, inverse));
    const auto after = described(back, length_back);
    for (std::size_t i = 0; i < before.size(); ++i) {
      require(before[i][0] == after[i][0] && before[i][1] == after[i][1],
              "flipped twice, an edge has other ends");
      require(std::abs(before[i][2] - after[i][2]) <= 1e-12 * before[i][2],
              "flipped twice, an edge has another length");
    }
    if (std::any_of(length.begin(), length.end(),
                    [](double x) { return !(x > 1e-100 && x < 1e100); })) {
      return;
    }
  }
}

}  // namespace flipfree::fuzz
