#include "flipfree/field/turning.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::field {

namespace {

// direction(the side out of a corner) - direction(the side into it) + corner, in quarter turns: pi,
// less a full turn at corner 0, where directions begin anew.
Index around_corner(CornerId c) { return c % 3 == 0 ? -2 : 2; }

// d(h), to the nearest quarter turn.
Index nearest_quarter(const Frames& frames, const CrossField& field, HalfedgeId h) {
  return static_cast<Index>(
      std::lround(from_edge(frames, field.angle, h) / (0.5 * std::numbers::pi)));
}

}  // namespace

std::vector<Index> cone_turns(const Triangles& faces, const mesh::Adjacency& adjacency,
                              const Frames& frames, const CrossField& field) {
  std::vector<Index> cones(adjacency.vertex_halfedge.size(), 0);
  for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
    // The corner at the source of h lies between the side before it and h.
    cones[at(mesh::source(faces, h))] += around_corner(h);
    cones[at(mesh::target(faces, h))] += field.matching[at(h)];
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    const Index quarter = nearest_quarter(frames, field, h);
    cones[at(mesh::source(faces, h))] += quarter;
    cones[at(mesh::target(faces, h))] -= quarter;
  }
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (adjacency.vertex_halfedge[v] == kInvalid) cones[v] = 4;
  }
  return cones;
}

Index turn_at_corner(HalfedgeId entered, HalfedgeId leaving) {
  // On the right hand the corner at the source of `leaving`, else the one at that of `entered`.
  return leaving == next_corner(entered) ? -around_corner(leaving) : around_corner(entered);
}

Index turning_number(const mesh::Adjacency& adjacency, const CrossField& field,
                     const DualLoop& loop) {
  Index turns = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    turns += field.matching[at(loop[i])];
    const HalfedgeId entered = adjacency.opposite[at(loop[i])];
    const HalfedgeId leaving = loop[(i + 1) % loop.size()];
    turns += turn_at_corner(entered, leaving);
  }
  return turns;
}

std::vector<DualLoop> boundary_strips(const Triangles& faces, const mesh::Adjacency& adjacency) {
  std::vector<DualLoop> strips;
  for (const std::vector<HalfedgeId>& boundary : mesh::boundary_halfedge_loops(faces, adjacency)) {
    DualLoop& strip = strips.emplace_back();
    for (const HalfedgeId b : boundary) {
      for (HalfedgeId h = next_corner(b); adjacency.opposite[at(h)] != kInvalid;
           h = next_corner(adjacency.opposite[at(h)])) {
        // Into a face with two boundary edges and back: not at all.
        intrinsic::go_across(strip, h, adjacency.opposite);
      }
    }
    intrinsic::close_strip(strip, adjacency.opposite);
  }
  return strips;
}

Signature signature_of(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                       const Frames& frames, const CrossField& field,
                       const ExecutionContext& context) {
  Signature signature;
  signature.cones = cone_turns(surface.faces, adjacency, frames, field);
  const auto add = [&](std::vector<DualLoop> loops) {
    for (DualLoop& loop : loops) {
      if (loop.empty()) continue;
      const Index turns = turning_number(adjacency, field, loop);
      signature.loops.push_back({std::move(loop), turns});
    }
  };
  add(intrinsic::tree_cotree(surface.faces, adjacency, intrinsic::steps_across(surface, adjacency),
                             context)
          .loops);
  add(boundary_strips(surface.faces, adjacency));
  return signature;
}

}  // namespace flipfree::field
