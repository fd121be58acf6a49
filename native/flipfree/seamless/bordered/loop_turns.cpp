#include "flipfree/seamless/bordered/loop_turns.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::seamless {

std::vector<LoopTurn> loops_to_turn(const mesh::Surface& surface, bool aligned,
                                    const ExecutionContext& context) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const std::vector<double> step = intrinsic::steps_across(surface, adjacency);
  std::vector<LoopTurn> loops;
  for (auto& loop : intrinsic::tree_cotree(surface.faces, adjacency, step, context).loops)
    loops.push_back({std::move(loop), 0});
  if (!aligned) return loops;
  for (auto& strip : intrinsic::strips_between(surface.faces, adjacency, step, context))
    loops.push_back({std::move(strip), 0, true});
  return loops;
}

std::vector<intrinsic::DualLoop> loops_on_setup(const std::vector<LoopTurn>& loops,
                                                const Triangles& faces,
                                                const intrinsic::IntrinsicSetup& setup) {
  std::vector<intrinsic::DualLoop> closed, open;
  for (const LoopTurn& loop : loops) {
    if (!loop.between_boundaries) {
      closed.push_back(loop.loop);
      continue;
    }
    intrinsic::DualLoop strip;
    for (const HalfedgeId h : loop.loop) strip.push_back(setup.input_halfedge[at(h)]);
    strip.front() ^= 1;
    open.push_back(intrinsic::closed_by_reflection(setup.mesh, strip));
  }
  auto all = intrinsic::on_setup(closed, faces, setup);
  all.insert(all.end(), open.begin(), open.end());
  return all;
}

std::vector<Index> cones_of_double(const std::vector<Index>& cones,
                                   const intrinsic::IntrinsicSetup& setup) {
  std::vector<Index> out;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    const bool twice = setup.mesh.symmetric() && !setup.on_boundary[v];
    const Index k = setup.on_boundary[v] ? 2 * cones[v] : cones[v];
    if (k == 4) continue;
    out.insert(out.end(), twice ? 2 : 1, k);
  }
  return out;
}

std::vector<Index> turns_of_double(const mesh::Surface& surface, const std::vector<Index>& cones,
                                   const std::vector<LoopTurn>& loops,
                                   const std::vector<Index>& turns) {
  std::vector<Index> all;
  for (std::size_t i = 0; i < turns.size(); ++i) all.push_back(whole_turns(loops[i], turns[i]));
  const auto curves = mesh::boundary_loops(surface.faces, surface.adjacency());
  for (const auto& curve : curves) {
    all.push_back(0);
    for (const VertexId v : curve) all.back() += 2 - cones[at(v)];
  }
  return all;
}

using intrinsic::EdgeLabel;
using intrinsic::IntrinsicMesh;

namespace {

// Per edge its column, and with what factor; none for diagonals.
struct Columns {
  std::vector<Index> of;
  std::vector<double> factor;
  Index count = 0;
};

Columns number_columns(const IntrinsicMesh& mesh) {
  Columns columns{std::vector<Index>(mesh.edge_count(), kInvalid),
                  std::vector<double>(mesh.edge_count(), 0.0)};
  for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
    const EdgeLabel label = mesh.label_of_edge(static_cast<EdgeId>(e));
    if (label == EdgeLabel::kDiagonal || label == EdgeLabel::kTwo) continue;
    columns.of[e] = columns.count++;
    columns.factor[e] = 1.0;
    if (label != EdgeLabel::kOne) continue;
    const std::size_t mirror = at(mesh.reflection[2 * e] >> 1);
    columns.of[mirror] = columns.of[e];
    columns.factor[e] = columns.factor[mirror] = 1.0 / std::numbers::sqrt2;
  }
  return columns;
}

}  // namespace

numeric::SparseMatrix symmetric_changes(const IntrinsicMesh& mesh,
                                        const std::vector<double>& cotangent) {
  const Columns columns = number_columns(mesh);
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(2 * mesh.edge_count());
  const auto add = [&](std::size_t row, EdgeId side, double share) {
    entries.emplace_back(static_cast<Index>(row), columns.of[at(side)],
                         share * columns.factor[at(side)]);
  };
  for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
    const auto edge = static_cast<EdgeId>(e);
    if (mesh.label_of_edge(edge) != EdgeLabel::kDiagonal) {
      add(e, edge, 1.0);
      continue;
    }
    for (const HalfedgeId d : {2 * edge, 2 * edge + 1}) {
      HalfedgeId leg = mesh.next_of(d), across = mesh.previous(d);
      if (mesh.label_of_edge(leg >> 1) == EdgeLabel::kPerpendicular) std::swap(leg, across);
      // (leg / diagonal)^2 by the law of sines.
      const double c = cotangent[at(d)], l = cotangent[at(leg)];
      const double share = (1.0 + c * c) / (1.0 + l * l);
      add(e, leg >> 1, 0.5 * share);
      add(e, across >> 1, 0.5 * (1.0 - share));
    }
  }
  numeric::SparseMatrix matrix(static_cast<Index>(mesh.edge_count()), columns.count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace flipfree::seamless
