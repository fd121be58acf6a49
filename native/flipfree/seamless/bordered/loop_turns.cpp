#include "flipfree/seamless/bordered/loop_turns.h"

#include <utility>

#include "flipfree/intrinsic/loops/surface_loops.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::seamless {
namespace {

// Per half-edge of the mesh: the input's, 3 f + k.
std::vector<HalfedgeId> input_corners(const intrinsic::IntrinsicSetup& setup) {
  std::vector<HalfedgeId> corner_of(setup.mesh.halfedge_count(), kInvalid);
  for (std::size_t c = 0; c < setup.input_halfedge.size(); ++c)
    corner_of[at(setup.input_halfedge[c])] = static_cast<HalfedgeId>(c);
  return corner_of;
}

std::vector<std::vector<HalfedgeId>> closed_loops(const mesh::Surface& surface,
                                                  const intrinsic::IntrinsicSetup& setup,
                                                  const ExecutionContext& context) {
  const std::vector<HalfedgeId> corner_of = input_corners(setup);
  auto loops =
      intrinsic::homology_basis(setup.mesh, intrinsic::steps_inside(surface, setup), context);
  for (auto& loop : loops) {
    for (HalfedgeId& h : loop) h = corner_of[at(h)];
  }
  return loops;
}

}  // namespace

std::vector<std::vector<HalfedgeId>> input_homology_basis(const mesh::Surface& surface,
                                                          const ExecutionContext& context) {
  return closed_loops(
      surface,
      intrinsic::build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces),
      context);
}

std::vector<LoopTurn> loops_to_turn(const mesh::Surface& surface,
                                    const intrinsic::IntrinsicSetup& setup, bool aligned,
                                    const ExecutionContext& context) {
  std::vector<LoopTurn> loops;
  for (auto& loop : closed_loops(surface, setup, context)) loops.push_back({std::move(loop), 0});
  if (!setup.mesh.symmetric() || !aligned) return loops;
  const std::vector<HalfedgeId> corner_of = input_corners(setup);
  for (const intrinsic::DualLoop& strip :
       intrinsic::boundary_strips(setup.mesh, intrinsic::steps_inside(surface, setup), context)) {
    LoopTurn own{{}, 0, true};
    // The first half-edge comes in from the mirror image.
    own.loop.push_back(corner_of[at(strip.front() ^ 1)]);
    for (std::size_t i = 1; i < strip.size(); ++i) own.loop.push_back(corner_of[at(strip[i])]);
    loops.push_back(std::move(own));
  }
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
  const auto curves = mesh::boundary_loops(
      surface.faces, mesh::build_adjacency(static_cast<Index>(cones.size()), surface.faces));
  for (const auto& curve : curves) {
    all.push_back(0);
    for (const VertexId v : curve) all.back() += 2 - cones[at(v)];
  }
  return all;
}

}  // namespace flipfree::seamless
