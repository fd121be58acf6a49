#include "flipfree/intrinsic/loops/dual_loops.h"

#include <cmath>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/intrinsic/loops/dual_tree.h"

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

// b is pushed to the left of itself until it runs along edges: around the corners on its left. It
// then crosses a wherever a crosses one of these edges.
Index intersection_number(const FlipMesh& mesh, const DualLoop& a, const DualLoop& b) {
  // The edges on the left of b: those of which b passes the target on its left, from corner to
  // corner. As a chain: for each face whose third side b has on its left, that side.
  std::vector<Index> chain(mesh.next.size() / 2, 0);
  for (std::size_t i = 0; i < b.size(); ++i) {
    const HalfedgeId entered = FlipMesh::opposite(b[i]);
    const HalfedgeId leaving = b[(i + 1) % b.size()];
    if (leaving != mesh.next_of(entered)) continue;  // a corner on the left: no side there
    // The third side, previous(entered), runs against b's direction.
    const HalfedgeId side = mesh.previous(entered);
    chain[at(side >> 1)] += (side & 1) == 0 ? -1 : 1;
  }
  Index sum = 0;
  for (const HalfedgeId h : a) sum += (h & 1) == 0 ? chain[at(h >> 1)] : -chain[at(h >> 1)];
  return sum;
}

}  // namespace flipfree::intrinsic
