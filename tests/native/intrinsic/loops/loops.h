// What tests of dual loops ask of them.
#pragma once

#include <Eigen/Dense>
#include <random>
#include <vector>

#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::test {

inline intrinsic::FlipMesh flip_mesh(const mesh::Surface& surface) {
  return intrinsic::build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces)
      .mesh;
}

inline std::vector<double> random_steps(const intrinsic::FlipMesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.1, 1.0);
  std::vector<double> step(mesh.next.size() / 2);
  for (double& s : step) s = uniform(random);
  return step;
}

inline bool is_closed_strip(const intrinsic::FlipMesh& mesh, const intrinsic::DualLoop& loop) {
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const HalfedgeId entered = intrinsic::FlipMesh::opposite(loop[i]);
    const HalfedgeId leaving = loop[(i + 1) % loop.size()];
    if (leaving != mesh.next_of(entered) && leaving != mesh.previous(entered)) return false;
  }
  return true;
}

inline Eigen::MatrixXd intersections(const intrinsic::FlipMesh& mesh,
                                     const std::vector<intrinsic::DualLoop>& loops) {
  const auto n = static_cast<Eigen::Index>(loops.size());
  Eigen::MatrixXd m(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      m(i, j) = intrinsic::intersection_number(mesh, loops[static_cast<std::size_t>(i)],
                                               loops[static_cast<std::size_t>(j)]);
    }
  }
  return m;
}

}  // namespace flipfree::test
