#include "flipfree/intrinsic/loops.h"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"

namespace flipfree::intrinsic {

namespace {

// Faces are named by numbers of their own, in the order of their first half-edge.
class Dual {
 public:
  Dual(const FlipMesh& mesh, const std::vector<double>& step) : mesh_(mesh), step_(step) {
    face_.assign(mesh.next.size(), kInvalid);
    for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); ++h) {
      if (face_of(h) != kInvalid) continue;
      const auto f = static_cast<FaceId>(any_.size());
      any_.push_back(h);
      for_each_side(f, [&](HalfedgeId g) { face_[at(g)] = f; });
    }
  }

  std::size_t face_count() const { return any_.size(); }
  FaceId face_of(HalfedgeId h) const { return face_[at(h)]; }
  static HalfedgeId opposite(HalfedgeId h) { return FlipMesh::opposite(h); }
  double step(HalfedgeId h) const { return step_[at(h >> 1)]; }
  template <typename Visit>
  void for_each_side(FaceId f, const Visit& visit) const {
    HalfedgeId h = any_[at(f)];
    for (int k = 0; k < 3; ++k, h = mesh_.next_of(h)) visit(h);
  }

 private:
  const FlipMesh& mesh_;
  const std::vector<double>& step_;
  std::vector<FaceId> face_;     // per half-edge
  std::vector<HalfedgeId> any_;  // per face: one of its half-edges
};

}  // namespace

void go_across(DualLoop& strip, HalfedgeId side, const std::vector<HalfedgeId>& opposite) {
  if (!strip.empty() && strip.back() == opposite[at(side)]) {
    strip.pop_back();
  } else {
    strip.push_back(side);
  }
}

void close_strip(DualLoop& strip, const std::vector<HalfedgeId>& opposite) {
  std::size_t first = 0;
  while (first + 1 < strip.size() && strip[first] == opposite[at(strip.back())]) {
    strip.pop_back();
    ++first;
  }
  strip.erase(strip.begin(), strip.begin() + static_cast<std::ptrdiff_t>(first));
}

std::vector<DualLoop> homology_basis(const FlipMesh& mesh, const std::vector<double>& step,
                                     const ExecutionContext& context) {
  const Dual dual(mesh, step);
  const DualTree tree = dual_tree(dual, false, context);
  DisjointSets sets(count_vertices(mesh));
  std::vector<DualLoop> loops;
  for_each_uncrossed(
      dual, tree, static_cast<HalfedgeId>(mesh.halfedge_count()), [&](double length, HalfedgeId h) {
        if (!sets.join(mesh.origin_of(h), mesh.origin_of(h + 1)) && std::isfinite(length))
          loops.push_back(loop_across(dual, tree, h));
      });
  return loops;
}

std::vector<DualLoop> boundary_strips(const FlipMesh& mesh, const std::vector<double>& step,
                                      const ExecutionContext& context) {
  const Dual dual(mesh, step);
  const DualTree tree = dual_tree(dual, false, context);
  // Closed curves of barriers, by the vertices on them, each with the half-edge that is nearest.
  DisjointSets sets(count_vertices(mesh));
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); h += 2) {
    if (!std::isfinite(dual.step(h))) sets.join(mesh.origin_of(h), mesh.origin_of(h + 1));
  }
  std::vector<Index> curve_of(at(count_vertices(mesh)), kInvalid);
  std::vector<HalfedgeId> nearest;
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); ++h) {
    const double distance = tree.distance[at(dual.face_of(h))];
    if (std::isfinite(dual.step(h)) || !std::isfinite(distance)) continue;
    Index& curve = curve_of[at(sets.find(mesh.origin_of(h)))];
    if (curve == kInvalid) {
      curve = static_cast<Index>(nearest.size());
      nearest.push_back(h);
    }
    HalfedgeId& best = nearest[at(curve)];
    if (distance < tree.distance[at(dual.face_of(best))]) best = h;
  }
  std::vector<DualLoop> strips;
  for (std::size_t i = 1; i < nearest.size(); ++i) {
    DualLoop strip{FlipMesh::opposite(nearest.front())};
    const TreePath path =
        path_between(dual, tree, dual.face_of(nearest.front()), dual.face_of(nearest[i]));
    strip.insert(strip.end(), path.up.begin(), path.up.end());
    strip.insert(strip.end(), path.down.begin(), path.down.end());
    strip.push_back(nearest[i]);
    strips.push_back(std::move(strip));
  }
  return strips;
}

LoopCarrier::LoopCarrier(FlipMesh mesh, const std::vector<DualLoop>& loops)
    : mesh_(std::move(mesh)), on_edge_(mesh_.next.size() / 2, kInvalid) {
  for (std::size_t i = 0; i < loops.size(); ++i) {
    first_.push_back(kInvalid);
    Index last = kInvalid;
    for (const HalfedgeId h : loops[i]) last = insert(h, static_cast<Index>(i), last);
  }
}

Index LoopCarrier::insert(HalfedgeId h, Index loop, Index after) {
  Index id = static_cast<Index>(nodes_.size());
  if (unused_.empty()) {
    nodes_.emplace_back();
  } else {
    id = unused_.back();
    unused_.pop_back();
  }
  Node& node = nodes_[at(id)];
  node.halfedge = h;
  node.loop = loop;
  if (after == kInvalid) {
    node.next = node.previous = id;
    first_[at(loop)] = id;
  } else {
    node.previous = after;
    node.next = nodes_[at(after)].next;
    nodes_[at(node.next)].previous = id;
    nodes_[at(after)].next = id;
  }
  Index& top = on_edge_[at(h >> 1)];
  node.above = kInvalid;
  node.below = top;
  if (top != kInvalid) nodes_[at(top)].above = id;
  top = id;
  return id;
}

void LoopCarrier::remove(Index id) {
  const Node& node = nodes_[at(id)];
  nodes_[at(node.previous)].next = node.next;
  nodes_[at(node.next)].previous = node.previous;
  if (first_[at(node.loop)] == id) first_[at(node.loop)] = node.next;
  if (node.below != kInvalid) nodes_[at(node.below)].above = node.above;
  (node.above == kInvalid ? on_edge_[at(node.halfedge >> 1)] : nodes_[at(node.above)].below) =
      node.below;
  unused_.push_back(id);
}

// Loops that enter the face of `side` and `diagonal` across `side`: those that leave the
// quadrilateral from the other face cross the diagonal.
void LoopCarrier::cross_new_diagonal(HalfedgeId side, HalfedgeId diagonal) {
  const HalfedgeId from_outside = FlipMesh::opposite(side);
  for (Index id = on_edge_[at(side >> 1)]; id != kInvalid; id = nodes_[at(id)].below) {
    if (nodes_[at(id)].halfedge != from_outside) continue;
    const HalfedgeId leaving = nodes_[at(nodes_[at(id)].next)].halfedge;
    const bool same_face =
        leaving == mesh_.next_of(diagonal) || leaving == mesh_.previous(diagonal);
    if (!same_face) insert(diagonal, nodes_[at(id)].loop, id);
  }
}

void LoopCarrier::flip(EdgeId e) {
  while (on_edge_[at(e)] != kInvalid) remove(on_edge_[at(e)]);
  const HalfedgeId h = 2 * e;
  flip_edge(mesh_, e);
  for (const HalfedgeId diagonal : {h, h + 1}) {
    cross_new_diagonal(mesh_.next_of(diagonal), diagonal);
    cross_new_diagonal(mesh_.previous(diagonal), diagonal);
  }
}

DualLoop LoopCarrier::loop(std::size_t i) const {
  DualLoop loop;
  Index node = first_[i];
  do {
    loop.push_back(nodes_[at(node)].halfedge);
    node = nodes_[at(node)].next;
  } while (node != first_[i]);
  return loop;
}

// Distance between the centres of two triangles across each edge: two thirds of the height of the
// edge over them, as far as doubles tell.
std::vector<double> steps_across(const mesh::Surface& surface, const IntrinsicSetup& setup) {
  std::vector<double> step(setup.mesh.edge_count(), 1e-12);
  for (Index f = 0; f < static_cast<Index>(surface.faces.rows()); ++f) {
    Vector3 centre = Vector3::Zero();
    for (int k = 0; k < 3; ++k) centre += surface.vertices.row(surface.faces(f, k)) / 3.0;
    for (int k = 0; k < 3; ++k) {
      const Vector3 a = surface.vertices.row(surface.faces(f, k));
      const Vector3 b = surface.vertices.row(surface.faces(f, (k + 1) % 3));
      step[at(setup.input_halfedge[at(3 * f + k)] >> 1)] += (centre - 0.5 * (a + b)).norm();
    }
  }
  return step;
}

std::vector<double> steps_inside(const mesh::Surface& surface, const IntrinsicSetup& setup) {
  std::vector<double> step = steps_across(surface, setup);
  for (std::size_t e = 0; e < step.size(); ++e) {
    if (setup.mesh.label_of_edge(static_cast<EdgeId>(e)) == EdgeLabel::kParallel)
      step[e] = std::numeric_limits<double>::infinity();
  }
  return step;
}

DualLoop closed_by_reflection(const IntrinsicMesh& mesh, const DualLoop& strip) {
  DualLoop loop = strip;
  for (std::size_t i = strip.size() - 2; i > 0; --i)
    loop.push_back(mesh.reflection[at(FlipMesh::opposite(strip[i]))]);
  return loop;
}

std::vector<DualLoop> on_setup(const std::vector<DualLoop>& loops, const Triangles& faces,
                               const IntrinsicSetup& setup) {
  const auto corner_count = static_cast<HalfedgeId>(3 * faces.rows());
  std::vector<HalfedgeId> corner_of(setup.mesh.halfedge_count(), kInvalid);
  for (HalfedgeId c = 0; c < corner_count; ++c) corner_of[at(setup.input_halfedge[at(c)])] = c;
  std::vector<DualLoop> out;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const DualLoop& loop = loops[i];
    DualLoop own;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const HalfedgeId after = loop[(k + 1) % loop.size()];
      const bool inside =
          loop[k] >= 0 && loop[k] < corner_count && after >= 0 && after < corner_count;
      const HalfedgeId entered =
          inside ? corner_of[at(setup.input_halfedge[at(loop[k])] ^ 1)] : kInvalid;
      if (!inside || entered / 3 != after / 3 || entered == after) {
        throw_invalid(ErrorCode::kBadOption,
                      "Loop " + std::to_string(i) + " is not a closed strip of faces at place " +
                          std::to_string(k) +
                          ". Give half-edges across each of which the loop enters the face of the "
                          "next one, without turning back.");
      }
      own.push_back(setup.input_halfedge[at(loop[k])]);
    }
    if (own.empty())
      throw_invalid(ErrorCode::kBadOption,
                    "Loop " + std::to_string(i) + " is empty. Leave it out.");
    out.push_back(std::move(own));
  }
  return out;
}

}  // namespace flipfree::intrinsic
