#include "flipfree/seamless/padding/paths/canvas.h"

#include <algorithm>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::seamless {
namespace {

mesh::RefinedSurface on_closed(const mesh::Surface& surface) {
  mesh::RefinedSurface refined;
  refined.input = &surface;
  const auto n = static_cast<Index>(surface.vertices.rows());
  for (Index v = 0; v < n; ++v) {
    refined.support.push_back({{v, kInvalid, kInvalid}, {1.0, 0.0, 0.0}});
    refined.position.emplace_back(surface.vertices.row(v).transpose());
  }
  refined.mesh = mesh::EditableTriangulation(n, surface.faces);
  return refined;
}

}  // namespace

Canvas::Canvas(const mesh::Surface& surface, const std::vector<Index>& cones)
    : refined_(on_closed(surface)), cones_(cones), state_(cones.size(), State::kFree) {
  const auto n = static_cast<VertexId>(cones.size());
  for (VertexId v = 0; v < n; ++v) {
    if (excess(v) != 0) state_[at(v)] = State::kCone;
  }
  for (VertexId v = 0; v < n; ++v) {
    if (!is_free(v)) refine_around(v);
  }
}

double Canvas::length(HalfedgeId h) const {
  return (refined_.position[at(mesh().source(h))] - refined_.position[at(mesh().target(h))]).norm();
}

HalfedgeId Canvas::sector_of(HalfedgeId h) const {
  while (!is_drawn(h)) h = mesh().rotate_cw(h);
  return h;
}

std::vector<HalfedgeId> Canvas::drawn_around(VertexId v) const {
  std::vector<HalfedgeId> drawn;
  mesh().for_each_outgoing(v, [&](HalfedgeId h) {
    if (is_drawn(h)) drawn.push_back(h);
  });
  return drawn;
}

std::vector<HalfedgeId> Canvas::edges_of(const std::vector<VertexId>& cycle) const {
  std::vector<HalfedgeId> edges;
  for (std::size_t i = 0; i < cycle.size(); ++i)
    edges.push_back(mesh().find(cycle[i], cycle[(i + 1) % cycle.size()]));
  return edges;
}

void Canvas::draw(const std::vector<HalfedgeId>& path, Curve kind) {
  std::vector<VertexId> taken;
  for (const HalfedgeId h : path) {
    refined_.mesh.set_mark(h, static_cast<Index>(kind));
    for (const VertexId v : {mesh().source(h), mesh().target(h)}) {
      if (on_curve(v) || state_[at(v)] == State::kFenced) continue;
      // A cone at the end of a fence is a cone again when the fence goes.
      state_[at(v)] = kind == Curve::kFence ? State::kFenced : State::kOnCurve;
      taken.push_back(v);
    }
  }
  for (const VertexId v : taken) refine_around(v);
}

void Canvas::erase(const std::vector<HalfedgeId>& path) {
  for (const HalfedgeId h : path) refined_.mesh.set_mark(h, static_cast<Index>(Curve::kNone));
  for (const HalfedgeId h : path) {
    for (const VertexId v : {mesh().source(h), mesh().target(h)}) {
      if (drawn_around(v).empty()) state_[at(v)] = State::kFree;
    }
  }
}

void Canvas::erase_all() {
  std::vector<HalfedgeId> drawn;
  for (HalfedgeId h = 0; h < mesh().halfedge_slots(); ++h) {
    if (is_drawn(h)) drawn.push_back(h);
  }
  erase(drawn);
}

std::vector<VertexId> Canvas::divide(const std::vector<HalfedgeId>& chain, std::size_t edges) {
  std::vector<std::pair<VertexId, VertexId>> ends;
  for (const HalfedgeId h : chain) ends.emplace_back(mesh().source(h), mesh().target(h));
  while (ends.size() < edges) {
    const auto longest =
        std::max_element(ends.begin(), ends.end(), [&](const auto& a, const auto& b) {
          return length(mesh().find(a.first, a.second)) < length(mesh().find(b.first, b.second));
        });
    const VertexId target = longest->second;
    const VertexId s = split(mesh().find(longest->first, target));
    state_[at(s)] = State::kOnCurve;
    longest->second = s;
    ends.insert(longest + 1, {s, target});
    refine_around(s);
  }
  std::vector<VertexId> vertices = {ends.front().first};
  for (const auto& [source, target] : ends) vertices.push_back(target);
  return vertices;
}

VertexId Canvas::halve(HalfedgeId h) { return split(h); }

void Canvas::remove_fences() {
  for (HalfedgeId h = 0; h < mesh().halfedge_slots(); ++h) {
    if (curve(h) == Curve::kFence) refined_.mesh.set_mark(h, static_cast<Index>(Curve::kNone));
  }
  for (VertexId v = 0; v < vertex_count(); ++v) {
    if (state_[at(v)] == State::kFenced)
      state_[at(v)] = excess(v) == 0 ? State::kFree : State::kCone;
  }
}

HalfedgeId Canvas::input_side(HalfedgeId h) const {
  const FaceId parent = mesh().parent(h / 3);
  if (parent == mesh().parent(mesh().opposite(h) / 3)) return kInvalid;
  for (HalfedgeId side = 3 * parent; side < 3 * parent + 3; ++side) {
    // The edge lies where the corner beyond the side has no weight.
    const HalfedgeId beyond = previous_corner(side);
    const VertexId apex = refined_.input->faces(beyond / 3, beyond % 3);
    if (refined_.support[at(mesh().source(h))].of(apex) == 0.0 &&
        refined_.support[at(mesh().target(h))].of(apex) == 0.0)
      return side;
  }
  throw InternalError("an edge between two faces that lies on no side of them");
}

mesh::Surface Canvas::surface() const {
  mesh::Surface surface;
  surface.faces = mesh().faces();
  surface.vertices.resize(vertex_count(), 3);
  for (VertexId v = 0; v < vertex_count(); ++v)
    surface.vertices.row(v) = refined_.position[at(v)].transpose();
  return surface;
}

mesh::Provenance Canvas::provenance() const {
  mesh::Provenance provenance;
  provenance.vertex.resize(at(vertex_count()));
  for (FaceId f = 0; f < mesh().face_slots(); ++f) {
    const FaceId parent = mesh().parent(f);
    provenance.face.push_back(parent);
    for (const VertexId v : mesh().corners(f)) {
      mesh::SurfacePoint& point = provenance.vertex[at(v)];
      if (point.face != kInvalid) continue;
      point.face = parent;
      for (Index k = 0; k < 3; ++k)
        point.weight[k] = refined_.support[at(v)].of(refined_.input->faces(parent, k));
    }
  }
  return provenance;
}

VertexId Canvas::split(HalfedgeId h) {
  const HalfedgeId o = mesh().opposite(h);
  const mesh::Support where = mesh::rounded_between(refined_.support[at(mesh().source(h))],
                                                    refined_.support[at(mesh().target(h))], 0.5);
  const auto has_room = [&](HalfedgeId side) {
    const FaceId parent = mesh().parent(side / 3);
    const mesh::Support& apex = refined_.support[at(mesh().apex(side))];
    return refined_.orientation_in_parent(parent, refined_.support[at(mesh().source(side))], where,
                                          apex) > 0 &&
           refined_.orientation_in_parent(parent, where, refined_.support[at(mesh().target(side))],
                                          apex) > 0;
  };
  if (!has_room(h) || !has_room(o)) {
    throw_not_converged(ErrorCode::kIterationLimit,
                        "The curves of the cut leave no room in double precision for another "
                        "vertex at vertex " +
                            std::to_string(mesh().source(h)) +
                            ". Refine the mesh there, or take other cones.",
                        ElementKind::kVertex, {mesh().source(h)});
  }
  const VertexId s = refined_.split_edge(h, where);
  state_.push_back(State::kFree);
  return s;
}

void Canvas::refine_around(VertexId v) {
  std::vector<VertexId> taken;
  mesh().for_each_outgoing(v, [&](HalfedgeId h) {
    if (!is_drawn(h) && !is_free(mesh().target(h))) taken.push_back(mesh().target(h));
  });
  for (const VertexId w : taken) split(mesh().find(v, w));
}

}  // namespace flipfree::seamless
