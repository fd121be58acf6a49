// A basis of the homology of a closed mesh that no solver has seen.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/loops.h"

namespace flipfree::test {

// By random steps; half-edges of the mesh.
inline std::vector<intrinsic::DualLoop> random_basis(const intrinsic::FlipMesh& mesh,
                                                     unsigned seed) {
  std::vector<HalfedgeId> halfedge;  // of each corner
  std::vector<CornerId> corner(mesh.halfedge_count(), kInvalid);
  for (HalfedgeId first = 0; at(first) < corner.size(); ++first) {
    for (HalfedgeId h = first; corner[at(h)] == kInvalid; h = mesh.next_of(h)) {
      corner[at(h)] = static_cast<CornerId>(halfedge.size());
      halfedge.push_back(h);
    }
  }
  Triangles faces(static_cast<Eigen::Index>(halfedge.size() / 3), 3);
  mesh::Adjacency adjacency;
  adjacency.vertex_halfedge.resize(at(intrinsic::count_vertices(mesh)));
  for (CornerId c = 0; at(c) < halfedge.size(); ++c) {
    faces(c / 3, c % 3) = mesh.origin_of(halfedge[at(c)]);
    adjacency.opposite.push_back(corner[at(halfedge[at(c)] ^ 1)]);
    adjacency.vertex_halfedge[at(faces(c / 3, c % 3))] = c;
  }
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.1, 1.0);
  std::vector<double> step(halfedge.size());
  for (CornerId c = 0; at(c) < step.size(); ++c)
    step[at(c)] = step[at(adjacency.opposite[at(c)])] = uniform(random);
  const ExecutionContext context;
  auto loops = intrinsic::tree_cotree(faces, adjacency, step, context).loops;
  for (auto& loop : loops) {
    for (HalfedgeId& h : loop) h = halfedge[at(h)];
  }
  return loops;
}

}  // namespace flipfree::test
