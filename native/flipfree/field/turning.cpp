#include "flipfree/field/turning.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
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
  add(tree_cotree(surface, adjacency, context).loops);
  add(boundary_strips(surface.faces, adjacency));
  return signature;
}

namespace {

// From centre to centre across each edge, over its middle: per half-edge.
std::vector<double> steps_across(const mesh::Surface& surface, const mesh::Adjacency& adjacency) {
  std::vector<double> half(adjacency.opposite.size());
  for (HalfedgeId h = 0; at(h) < half.size(); ++h) {
    const Vector3 a = surface.vertices.row(mesh::source(surface.faces, h));
    const Vector3 b = surface.vertices.row(mesh::target(surface.faces, h));
    const HalfedgeId p = previous_corner(h);
    const Vector3 c = surface.vertices.row(mesh::source(surface.faces, p));
    half[at(h)] = (c - 0.5 * (a + b)).norm() / 3.0;
  }
  std::vector<double> step(half.size(), 0.0);
  for (HalfedgeId h = 0; at(h) < half.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid) step[at(h)] = half[at(h)] + half[at(o)];
  }
  return step;
}

struct Dual {
  const mesh::Adjacency& adjacency;
  const std::vector<double>& steps;

  std::size_t face_count() const { return adjacency.opposite.size() / 3; }
  static FaceId face_of(HalfedgeId h) { return h / 3; }
  HalfedgeId opposite(HalfedgeId h) const { return adjacency.opposite[at(h)]; }
  double step(HalfedgeId h) const { return steps[at(h)]; }
  template <typename Visit>
  static void for_each_side(FaceId f, const Visit& visit) {
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) visit(h);
  }
};

std::vector<VertexId> boundary_as_points(const Triangles& faces, const mesh::Adjacency& adjacency) {
  std::vector<VertexId> stands_for(adjacency.vertex_halfedge.size());
  for (std::size_t v = 0; v < stands_for.size(); ++v) stands_for[v] = static_cast<VertexId>(v);
  for (const std::vector<VertexId>& loop : mesh::boundary_loops(faces, adjacency)) {
    for (const VertexId v : loop) stands_for[at(v)] = loop.front();
  }
  return stands_for;
}

// The tree of vertices takes the edges first whose loops would be long.
void join_vertices(const Triangles& faces, const Dual& dual, const intrinsic::DualTree& tree,
                   TreeCotree& out) {
  DisjointSets sets(static_cast<Index>(out.stands_for.size()));
  std::vector<std::vector<HalfedgeId>> around(out.stands_for.size());
  intrinsic::for_each_uncrossed(dual, tree, static_cast<HalfedgeId>(dual.steps.size()),
                                [&](double, HalfedgeId h) {
                                  const VertexId a = out.stands_for[at(mesh::source(faces, h))];
                                  const VertexId b = out.stands_for[at(mesh::target(faces, h))];
                                  if (!sets.join(a, b)) {
                                    out.left_over.push_back(h);
                                    return;
                                  }
                                  around[at(b)].push_back(h);
                                  around[at(a)].push_back(dual.opposite(h));
                                });
  // From the roots: `around` has half-edges that point to a vertex.
  out.to_parent.assign(out.stands_for.size(), kInvalid);
  std::vector<char> seen(out.stands_for.size(), 0);
  for (VertexId root = 0; at(root) < seen.size(); ++root) {
    if (seen[at(root)] != 0 || out.stands_for[at(root)] != root) continue;
    seen[at(root)] = 1;
    out.order.push_back(root);
    for (std::size_t i = out.order.size() - 1; i < out.order.size(); ++i) {
      for (const HalfedgeId h : around[at(out.order[i])]) {
        const VertexId child = out.stands_for[at(mesh::source(faces, h))];
        if (seen[at(child)] != 0) continue;
        seen[at(child)] = 1;
        out.to_parent[at(child)] = h;
        out.order.push_back(child);
      }
    }
  }
}

}  // namespace

TreeCotree tree_cotree(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                       const ExecutionContext& context) {
  const std::vector<double> step = steps_across(surface, adjacency);
  const Dual dual{adjacency, step};
  const intrinsic::DualTree tree = intrinsic::dual_tree(dual, true, context);
  TreeCotree out;
  out.stands_for = boundary_as_points(surface.faces, adjacency);
  join_vertices(surface.faces, dual, tree, out);
  for (const HalfedgeId h : out.left_over)
    out.loops.push_back(intrinsic::loop_across(dual, tree, h));
  return out;
}

EdgeChain tree_path(const Triangles& faces, const mesh::Adjacency& adjacency,
                    const TreeCotree& tree, VertexId from, VertexId to) {
  const auto to_root = [&](VertexId v) {
    EdgeChain chain;
    for (HalfedgeId up = tree.to_parent[at(tree.stands_for[at(v)])]; up != kInvalid;
         up = tree.to_parent[at(tree.stands_for[at(mesh::target(faces, up))])])
      chain.push_back(up);
    return chain;
  };
  EdgeChain chain = to_root(from), before = to_root(to);
  while (!chain.empty() && !before.empty() && chain.back() == before.back()) {
    chain.pop_back();
    before.pop_back();
  }
  for (auto up = before.rbegin(); up != before.rend(); ++up)
    chain.push_back(adjacency.opposite[at(*up)]);
  return chain;
}

EdgeChain chain_of(const Triangles& faces, const mesh::Adjacency& adjacency, const TreeCotree& tree,
                   std::size_t i) {
  // h is left by the loop, so it runs from the loop's right to its left.
  const HalfedgeId h = tree.left_over[i];
  EdgeChain chain =
      tree_path(faces, adjacency, tree, mesh::target(faces, h), mesh::source(faces, h));
  chain.insert(chain.begin(), h);
  return chain;
}

}  // namespace flipfree::field
