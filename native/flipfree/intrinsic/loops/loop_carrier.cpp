#include "flipfree/intrinsic/loops/loop_carrier.h"

#include <utility>

namespace flipfree::intrinsic {
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

}  // namespace flipfree::intrinsic
