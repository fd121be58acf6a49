#include "flipfree/seamless/padding/topology/topology.h"

#include <array>
#include <cstddef>

#include "flipfree/mesh/own_unit.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/seamless/padding/topology/extra_path.h"
#include "flipfree/seamless/padding/topology/hole_chain.h"
#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

void draw_cut(Canvas& canvas, Pattern pattern, const std::vector<Index>& cones, Index genus,
              const ExecutionContext& context) {
  if (pattern == Pattern::kTwoTNodes) {
    const std::array<VertexId, 2> t_nodes = draw_chain_with_t_nodes(canvas, genus, context);
    if (!draw_shortest_joining_path(canvas, t_nodes, context))
      draw_fenced_joining_path(canvas, t_nodes, cones, context);
    return;
  }
  draw_hole_chain(canvas, genus, context);
  if (pattern == Pattern::kLoop) draw_loop_around_cone(canvas, cones, context);
  if (pattern == Pattern::kExtraPath && !draw_shortest_extra_path(canvas, context))
    draw_fenced_extra_path(canvas, cones, genus, context);
}

// The branch that begins with h.
std::vector<HalfedgeId> walk_branch(const Canvas& canvas, HalfedgeId h) {
  std::vector<HalfedgeId> branch = {h};
  while (true) {
    const std::vector<HalfedgeId> drawn = canvas.drawn_around(canvas.mesh().target(h));
    if (drawn.size() != 2) return branch;
    h = drawn[0] == canvas.mesh().opposite(h) ? drawn[1] : drawn[0];
    branch.push_back(h);
  }
}

// Branches by their first vertex and direction, flat sectors, and the extra path if T-nodes make it
// one.
void read_branches(const Canvas& canvas, AdmissibleCut& cut) {
  std::vector<char> walked(at(canvas.mesh().halfedge_slots()), 0);
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (!canvas.on_curve(v)) continue;
    const std::vector<HalfedgeId> drawn = canvas.drawn_around(v);
    if (drawn.size() == 2) continue;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      const bool is_extra = canvas.curve(drawn[i]) == Curve::kExtra;
      // Opposite of the extra path.
      if (drawn.size() == 3 && is_extra) cut.flat_sectors.push_back(drawn[(i + 1) % 3]);
      if (walked[at(drawn[i])] != 0) continue;
      cut.branches.push_back(walk_branch(canvas, drawn[i]));
      for (const HalfedgeId h : cut.branches.back())
        walked[at(h)] = walked[at(canvas.mesh().opposite(h))] = 1;
      if (is_extra) cut.extra_path = static_cast<Index>(cut.branches.size()) - 1;
    }
  }
  if (cut.flat_sectors.empty()) cut.extra_path = kInvalid;
}

}  // namespace

AdmissibleCut make_admissible_cut(const mesh::Surface& surface, const std::vector<Index>& cones,
                                  ExecutionContext& context) {
  const Index genus =
      mesh::topology(surface.faces, mesh::build_adjacency(
                                        static_cast<Index>(surface.vertices.rows()), surface.faces))
          .genus();
  check_cones(cones, genus);
  const mesh::InOwnUnit scaled(surface);
  const Pattern pattern = pattern_for(cones, genus);
  // A sphere is not cut: its cones may be neighbours.
  Canvas canvas(scaled.surface(),
                pattern == Pattern::kNone ? std::vector<Index>(cones.size(), 4) : cones);
  if (pattern != Pattern::kNone) draw_cut(canvas, pattern, cones, genus, context);
  AdmissibleCut cut;
  cut.surface = canvas.surface();
  cut.surface.vertices *= scaled.unit();
  cut.surface.vertices.topRows(surface.vertices.rows()) = surface.vertices;
  cut.provenance = canvas.provenance();
  read_branches(canvas, cut);
  return cut;
}

}  // namespace flipfree::seamless
