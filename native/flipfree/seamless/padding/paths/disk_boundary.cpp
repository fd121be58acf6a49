#include "flipfree/seamless/padding/paths/disk_boundary.h"

#include <cstddef>

#include "flipfree/base/error.h"

namespace flipfree::seamless {
namespace {

HalfedgeId some_drawn_at_node(const Canvas& canvas) {
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (!canvas.on_curve(v)) continue;
    const std::vector<HalfedgeId> drawn = canvas.drawn_around(v);
    if (drawn.size() > 2) return drawn.front();
  }
  throw InternalError("curves without a node");
}

// The faces from the root on, each after the one that it was reached from, across `back`.
struct FaceTree {
  std::vector<FaceId> order;
  std::vector<HalfedgeId> back;  // per face: its half-edge towards the root; kInvalid at the root
};

FaceTree breadth_first(const Canvas& canvas, FaceId root) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  FaceTree tree;
  tree.order.push_back(root);
  tree.back.assign(at(mesh.face_slots()), kInvalid);
  std::vector<char> seen(at(mesh.face_slots()), 0);
  seen[at(root)] = 1;
  for (std::size_t i = 0; i < tree.order.size(); ++i) {
    for (HalfedgeId h = 3 * tree.order[i]; h < 3 * tree.order[i] + 3; ++h) {
      const HalfedgeId o = mesh.opposite(h);
      if (canvas.is_drawn(h) || seen[at(o / 3)] != 0) continue;
      seen[at(o / 3)] = 1;
      tree.back[at(o / 3)] = o;
      tree.order.push_back(o / 3);
    }
  }
  return tree;
}

}  // namespace

Index DiskBoundary::corners_between(Index from, Index to) const {
  const Index rest = corners_below[at(to)] - corners_below[at(from) + 1];
  return from < to ? rest : rest + corners_below.back();
}

std::vector<Index> DiskBoundary::places_between(Index from, Index to) const {
  std::vector<Index> places;
  for (Index i = (from + 1) % size(); i != to; i = (i + 1) % size()) places.push_back(i);
  return places;
}

DiskBoundary disk_boundary(const Canvas& canvas) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  DiskBoundary boundary;
  boundary.place.assign(at(mesh.halfedge_slots()), kInvalid);
  const HalfedgeId start = some_drawn_at_node(canvas);
  HalfedgeId h = start;
  do {
    boundary.place[at(h)] = boundary.size();
    boundary.corner.push_back(canvas.drawn_around(mesh.source(h)).size() > 2 ? 1 : 0);
    boundary.halfedges.push_back(h);
    h = canvas.sector_of(next_corner(h));
  } while (h != start);
  for (HalfedgeId d = 0; d < mesh.halfedge_slots(); ++d) {
    if (canvas.is_drawn(d) && boundary.place[at(d)] == kInvalid)
      throw InternalError("the curves do not cut the surface into one disk");
  }
  Index corners = 0;
  Index branches = 0;
  for (Index i = 0; i < boundary.size(); ++i) {
    boundary.corners_below.push_back(corners);
    corners += boundary.corner[at(i)];
    const Index mate = boundary.place[at(mesh.opposite(boundary.halfedges[at(i)]))];
    if (boundary.corner[at(i)] == 0) {
      boundary.branch.push_back(boundary.branch.back());
    } else {
      // The branch's other side ends where this one begins.
      boundary.branch.push_back(mate < i ? boundary.branch[at(mate)] : branches++);
    }
  }
  boundary.corners_below.push_back(corners);
  return boundary;
}

std::vector<Index> excess_crossed(const Canvas& canvas, const DiskBoundary& boundary) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  const HalfedgeId exit = boundary.halfedges.front();
  const FaceTree tree = breadth_first(canvas, exit / 3);
  std::vector<Index> beyond(at(mesh.face_slots()), 0);
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (canvas.excess(v) != 0) beyond[at(mesh.outgoing(v) / 3)] += canvas.excess(v);
  }
  std::vector<Index> crossed(at(mesh.halfedge_slots()), 0);
  for (auto face = tree.order.rbegin(); face != tree.order.rend(); ++face) {
    const HalfedgeId back = tree.back[at(*face)];
    if (back == kInvalid) {
      crossed[at(exit)] = beyond[at(*face)];
    } else {
      crossed[at(back)] = beyond[at(*face)];
      crossed[at(mesh.opposite(back))] = -beyond[at(*face)];
      beyond[at(mesh.opposite(back) / 3)] += beyond[at(*face)];
    }
  }
  return crossed;
}

}  // namespace flipfree::seamless
