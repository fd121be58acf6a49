#include "support/openmesh_triangulation.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

namespace flipfree::test {
namespace {

constexpr Index kUnmarked = mesh::EditableTriangulation::kUnmarked;
using OpenMesh::VertexHandle;

Corners smallest_first(Corners corners) {
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

std::pair<VertexId, VertexId> ascending(VertexId a, VertexId b) { return std::minmax(a, b); }

void settle(TriangulationState& state) {
  std::sort(state.faces.begin(), state.faces.end());
  std::sort(state.edges.begin(), state.edges.end());
  for (auto& ring : state.rings)
    if (!ring.empty())
      std::rotate(ring.begin(), std::min_element(ring.begin(), ring.end()), ring.end());
}

}  // namespace

TriangulationState state_of(const mesh::EditableTriangulation& t) {
  TriangulationState state;
  for (HalfedgeId h = 0; h < t.halfedge_slots(); ++h) {
    if (!t.alive(h / 3)) continue;
    if (h % 3 == 0) state.faces.emplace_back(smallest_first(t.corners(h / 3)), t.parent(h / 3));
    const auto [a, b] = ascending(t.source(h), t.target(h));
    if (t.edge(h) == h) state.edges.emplace_back(a, b, t.mark(h), t.is_boundary(h));
  }
  state.rings.resize(static_cast<std::size_t>(t.vertex_count()));
  for (VertexId v = 0; v < t.vertex_count(); ++v) {
    auto& ring = state.rings[static_cast<std::size_t>(v)];
    HalfedgeId last = kInvalid;
    t.for_each_outgoing(v, [&](HalfedgeId h) { ring.push_back(t.target(last = h)); });
    if (last != kInvalid && t.is_boundary_vertex(v)) ring.push_back(t.apex(last));
  }
  settle(state);
  return state;
}

OpenMeshTriangulation::OpenMeshTriangulation(Index vertex_count, const Triangles& faces) {
  mesh_.add_property(mark_);
  mesh_.add_property(parent_);
  for (Index v = 0; v < vertex_count; ++v) mesh_.add_vertex(Mesh::Point(0, 0, 0));
  for (FaceId f = 0; f < faces.rows(); ++f) add_face({faces(f, 0), faces(f, 1), faces(f, 2)}, f);
  for (const auto e : mesh_.edges()) mesh_.property(mark_, e) = kUnmarked;
}

void OpenMeshTriangulation::add_face(const Corners& corners, FaceId parent) {
  const auto f =
      mesh_.add_face(VertexHandle(corners[0]), VertexHandle(corners[1]), VertexHandle(corners[2]));
  if (!f.is_valid()) throw std::runtime_error("OpenMesh takes no such face");
  mesh_.property(parent_, f) = parent;
}

OpenMeshTriangulation::Mesh::FaceHandle OpenMeshTriangulation::face(const Corners& corners) const {
  const auto h = mesh_.find_halfedge(VertexHandle(corners[0]), VertexHandle(corners[1]));
  if (!h.is_valid() || mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h)).idx() != corners[2])
    throw std::runtime_error("no such face");
  return mesh_.face_handle(h);
}

OpenMeshTriangulation::Mesh::EdgeHandle OpenMeshTriangulation::edge(VertexId a, VertexId b) const {
  const auto h = mesh_.find_halfedge(VertexHandle(a), VertexHandle(b));
  if (!h.is_valid()) throw std::runtime_error("no such edge");
  return mesh_.edge_handle(h);
}

void OpenMeshTriangulation::set_mark(VertexId a, VertexId b, Index mark) {
  mesh_.property(mark_, edge(a, b)) = mark;
}

void OpenMeshTriangulation::split_edge(VertexId a, VertexId b) {
  const auto e = edge(a, b);
  const Index mark = mesh_.property(mark_, e);
  std::map<VertexId, FaceId> parent_at;  // by the corner across the edge
  for (const unsigned side : {0U, 1U}) {
    const auto h = mesh_.halfedge_handle(e, side);
    if (mesh_.is_boundary(h)) continue;
    parent_at[mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h)).idx()] =
        mesh_.property(parent_, mesh_.face_handle(h));
  }
  const auto s = mesh_.add_vertex(Mesh::Point(0, 0, 0));
  mesh_.split(e, s);
  for (const auto h : mesh_.voh_range(s)) {
    const VertexId to = mesh_.to_vertex_handle(h).idx();
    mesh_.property(mark_, mesh_.edge_handle(h)) = to == a || to == b ? mark : kUnmarked;
    if (!parent_at.contains(to)) continue;
    for (const auto side : {h, mesh_.opposite_halfedge_handle(h)})
      mesh_.property(parent_, mesh_.face_handle(side)) = parent_at[to];
  }
}

void OpenMeshTriangulation::split_face(const Corners& corners) {
  const auto f = face(corners);
  const FaceId parent = mesh_.property(parent_, f);
  const auto s = mesh_.add_vertex(Mesh::Point(0, 0, 0));
  mesh_.split(f, s);
  for (const auto e : mesh_.ve_range(s)) mesh_.property(mark_, e) = kUnmarked;
  for (const auto g : mesh_.vf_range(s)) mesh_.property(parent_, g) = parent;
}

void OpenMeshTriangulation::flip_edge(VertexId a, VertexId b) {
  const auto e = edge(a, b);
  const auto h = mesh_.find_halfedge(VertexHandle(a), VertexHandle(b));
  const FaceId left = mesh_.property(parent_, mesh_.face_handle(h));
  const FaceId right =
      mesh_.property(parent_, mesh_.face_handle(mesh_.opposite_halfedge_handle(h)));
  if (!mesh_.is_flip_ok(e)) throw std::runtime_error("OpenMesh does not flip this edge");
  mesh_.flip(e);
  mesh_.property(mark_, e) = kUnmarked;
  // The face at a goes on as the left one, the face at b as the right one.
  for (const unsigned side : {0U, 1U}) {
    const auto g = mesh_.halfedge_handle(e, side);
    const bool at_a = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(g)).idx() == a;
    mesh_.property(parent_, mesh_.face_handle(g)) = at_a ? left : right;
  }
}

void OpenMeshTriangulation::replace(std::span<const Corners> faces,
                                    std::span<const Corners> triangles,
                                    std::span<const FaceId> parents) {
  // Edges that lose their only face die with it: marks are given again to what has the same ends.
  std::map<std::pair<VertexId, VertexId>, std::pair<Index, int>> known;
  std::vector<Mesh::FaceHandle> old;
  for (const Corners& corners : faces) {
    old.push_back(face(corners));
    for (std::size_t k = 0; k < 3; ++k) {
      auto& [mark, seen] = known[ascending(corners[k], corners[(k + 1) % 3])];
      mark = mesh_.property(mark_, edge(corners[k], corners[(k + 1) % 3]));
      ++seen;
    }
  }
  for (const auto f : old) mesh_.delete_face(f, false);
  for (std::size_t t = 0; t < triangles.size(); ++t) add_face(triangles[t], parents[t]);
  for (const Corners& corners : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = known.find(ascending(corners[k], corners[(k + 1) % 3]));
      const bool on_outline = at != known.end() && at->second.second == 1;
      set_mark(corners[k], corners[(k + 1) % 3], on_outline ? at->second.first : kUnmarked);
    }
  }
}

TriangulationState OpenMeshTriangulation::state() const {
  TriangulationState state;
  for (const auto f : mesh_.faces()) {
    Corners corners{};
    std::size_t k = 0;
    for (const auto v : mesh_.fv_ccw_range(f)) corners[k++] = v.idx();
    state.faces.emplace_back(smallest_first(corners), mesh_.property(parent_, f));
  }
  for (const auto e : mesh_.edges()) {
    const auto h = mesh_.halfedge_handle(e, 0);
    const auto [a, b] =
        ascending(mesh_.from_vertex_handle(h).idx(), mesh_.to_vertex_handle(h).idx());
    state.edges.emplace_back(a, b, mesh_.property(mark_, e), mesh_.is_boundary(e));
  }
  state.rings.resize(mesh_.n_vertices());
  for (const auto v : mesh_.vertices()) {
    if (mesh_.is_isolated(v)) continue;
    for (const auto w : mesh_.vv_ccw_range(v))
      state.rings[static_cast<std::size_t>(v.idx())].push_back(w.idx());
  }
  settle(state);
  return state;
}

}  // namespace flipfree::test
