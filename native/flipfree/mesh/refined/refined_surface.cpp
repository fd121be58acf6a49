#include "flipfree/mesh/refined/refined_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::mesh {

double Support::of(VertexId v) const {
  for (std::size_t i = 0; i < 3; ++i) {
    if (vertex[i] == v && v != kInvalid) return weight[i];
  }
  return 0.0;
}

Support rounded_between(const Support& a, const Support& b, double share) {
  std::vector<VertexId> corners;
  for (const Support& support : {a, b})
    for (const VertexId v : support.vertex)
      if (v != kInvalid) corners.push_back(v);
  sort_unique(corners);
  if (corners.size() > 3) throw InternalError("point between points that share no input face");
  Support result;
  std::size_t count = 0;
  double rest = 1.0;
  for (const VertexId v : corners) {
    const double exact = (1 - share) * a.of(v) + share * b.of(v);
    const double weight =
        v == corners.back()
            ? rest
            : std::min(rest, std::ldexp(std::nearbyint(std::ldexp(exact, 52)), -52));
    rest -= weight;
    if (weight == 0.0) continue;
    result.vertex[count] = v;
    result.weight[count++] = weight;
  }
  return result;
}

VertexId RefinedSurface::split_edge(HalfedgeId h) {
  const auto a = static_cast<std::size_t>(mesh.source(h));
  const auto b = static_cast<std::size_t>(mesh.target(h));
  const bool on_input = !support[a].empty() && !support[b].empty();
  // Rounded where weights have no bits to spare: they sum to one exactly.
  if (on_input) return split_edge(h, rounded_between(support[a], support[b], 0.5));
  const VertexId s = mesh.split_edge(h);
  support.emplace_back();
  position.emplace_back(0.5 * position[a] + 0.5 * position[b]);
  return s;
}

VertexId RefinedSurface::split_edge(HalfedgeId h, const Support& where) {
  support.push_back(where);
  position.push_back(place(where));
  return mesh.split_edge(h);
}

VertexId RefinedSurface::split_face(FaceId f, const Support& where) {
  support.push_back(where);
  position.push_back(place(where));
  return mesh.split_face(f);
}

Vector3 RefinedSurface::place(const Support& s) const {
  Vector3 where = Vector3::Zero();
  for (std::size_t i = 0; i < 3 && s.vertex[i] != kInvalid; ++i) {
    where += s.weight[i] * input->vertices.row(s.vertex[i]).transpose();
  }
  return where;
}

int RefinedSurface::orientation_in_parent(FaceId parent, VertexId a, VertexId b, VertexId c) const {
  return orientation_in_parent(parent, support[at(a)], support[at(b)], support[at(c)]);
}

int RefinedSurface::orientation_in_parent(FaceId parent, const Support& a, const Support& b,
                                          const Support& c) const {
  const auto planar = [&](const Support& s) {
    return Vector2(s.of(input->faces(parent, 1)), s.of(input->faces(parent, 2)));
  };
  return numeric::orientation(planar(a), planar(b), planar(c));
}

namespace {

std::vector<VertexId> walk_boundary(const EditableTriangulation& mesh, VertexId start) {
  std::vector<VertexId> loop;
  VertexId v = start;
  do {
    loop.push_back(v);
    v = mesh.target(mesh.outgoing(v));
  } while (v != start);
  return loop;
}

}  // namespace

RefinedSurface unrefined(const Surface& surface) {
  RefinedSurface refined;
  refined.input = &surface;
  const auto n = static_cast<Index>(surface.vertices.rows());
  for (Index v = 0; v < n; ++v) {
    refined.support.push_back({{v, kInvalid, kInvalid}, {1.0, 0.0, 0.0}});
    refined.position.emplace_back(surface.vertices.row(v).transpose());
  }
  refined.mesh = EditableTriangulation(n, surface.faces);
  return refined;
}

RefinedSurface make_refined_surface(const Surface& surface) {
  RefinedSurface refined = unrefined(surface);
  refined.boundary = boundary_loops(surface.faces, surface.adjacency()).front();
  refined.outer_boundary = refined.boundary;
  return refined;
}

RefinedSurface with_collar(const RefinedSurface& surface) {
  RefinedSurface refined;
  refined.input = surface.input;
  refined.support = surface.support;
  refined.position = surface.position;
  refined.boundary = walk_boundary(surface.mesh, surface.boundary.front());
  std::vector<FaceId> slots;
  Triangles faces = surface.mesh.faces(&slots);
  const auto m = static_cast<Index>(faces.rows());
  const auto n = static_cast<Index>(surface.position.size());
  const auto loop = static_cast<Index>(refined.boundary.size());
  //  n+i ---- n+i+1     the collar lies to the right of the loop b_i -> b_i+1
  //   | \       |
  //  b_i --- b_i+1
  faces.conservativeResize(m + 2 * loop, 3);
  Vector3 centre = Vector3::Zero();
  for (const VertexId v : refined.boundary) centre += refined.position[at(v)];
  centre /= static_cast<double>(loop);
  for (Index i = 0; i < loop; ++i) {
    const VertexId b0 = refined.boundary[at(i)];
    const VertexId b1 = refined.boundary[at((i + 1) % loop)];
    faces.row(m + 2 * i) << b1, b0, n + i;
    faces.row(m + 2 * i + 1) << b1, n + i, n + (i + 1) % loop;
    refined.support.emplace_back();
    const Vector3 p = refined.position[at(b0)];
    refined.position.emplace_back(p + 0.2 * (p - centre));
  }
  refined.mesh = EditableTriangulation(static_cast<Index>(refined.position.size()), faces);
  for (FaceId f = 0; f < refined.mesh.face_slots(); ++f) {
    refined.mesh.set_parent(f, f < m ? surface.mesh.parent(slots[at(f)]) : kInvalid);
  }
  if (loop == 3) refined.split_edge(refined.mesh.outgoing(n));
  refined.outer_boundary = walk_boundary(refined.mesh, n);
  return refined;
}

RefinedSurface compacted(const RefinedSurface& surface, std::vector<VertexId>& old_vertex) {
  const EditableTriangulation& mesh = surface.mesh;
  std::vector<FaceId> slots;
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (mesh.alive(f) && !surface.in_collar(f)) slots.push_back(f);
  }
  std::vector<VertexId> number(static_cast<std::size_t>(mesh.vertex_count()), kInvalid);
  for (const FaceId f : slots) {
    for (const VertexId v : mesh.corners(f)) number[at(v)] = v;
  }
  RefinedSurface result;
  result.input = surface.input;
  old_vertex.clear();
  for (VertexId v = 0; v < mesh.vertex_count(); ++v) {
    // Isolated vertices of the input stay.
    if (v >= surface.input_vertices() && number[at(v)] == kInvalid) continue;
    number[at(v)] = static_cast<VertexId>(old_vertex.size());
    old_vertex.push_back(v);
    result.support.push_back(surface.support[at(v)]);
    result.position.push_back(surface.position[at(v)]);
  }
  Triangles faces(static_cast<Eigen::Index>(slots.size()), 3);
  for (std::size_t f = 0; f < slots.size(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      faces(static_cast<Eigen::Index>(f), k) = number[at(mesh.source(3 * slots[f] + k))];
    }
  }
  result.mesh = EditableTriangulation(static_cast<Index>(old_vertex.size()), faces);
  for (std::size_t f = 0; f < slots.size(); ++f) {
    result.mesh.set_parent(static_cast<FaceId>(f), mesh.parent(slots[f]));
  }
  result.boundary = walk_boundary(result.mesh, surface.boundary.front());
  result.outer_boundary = result.boundary;
  return result;
}

Surface to_surface(const RefinedSurface& surface) {
  Surface arrays{Points3(static_cast<Eigen::Index>(surface.position.size()), 3),
                 surface.mesh.faces()};
  for (std::size_t v = 0; v < surface.position.size(); ++v)
    arrays.vertices.row(static_cast<Eigen::Index>(v)) = surface.position[v].transpose();
  return arrays;
}

Provenance provenance_of(const RefinedSurface& surface) {
  Provenance provenance{{}, std::vector<SurfacePoint>(surface.position.size())};
  for (FaceId f = 0; f < surface.mesh.face_slots(); ++f) {
    if (!surface.mesh.alive(f)) continue;
    const FaceId parent = surface.mesh.parent(f);
    provenance.face.push_back(parent);
    for (const VertexId v : surface.mesh.corners(f)) {
      SurfacePoint& point = provenance.vertex[at(v)];
      if (point.face != kInvalid) continue;
      point.face = parent;
      for (Index c = 0; c < 3; ++c)
        point.weight[c] = surface.support[at(v)].of(surface.input->faces(parent, c));
    }
  }
  return provenance;
}

RefinedMap compacted_map(const RefinedMap& map) {
  RefinedMap result;
  std::vector<VertexId> old_vertex;
  result.surface = compacted(map.surface, old_vertex);
  result.uv = map.uv(old_vertex, Eigen::all);
  debug_check("compacted_map", [&] { return find_broken_map(result.surface, result.uv); });
  return result;
}

namespace {

// Weights that were computed, not chosen, sum to one up to a few roundings.
constexpr double kRounded = 4 * std::numeric_limits<double>::epsilon();

std::string broken_point(const SurfacePoint& point, Index face_count) {
  if (point.face < 0 || point.face >= face_count) return "lies in no face of the input";
  // A weight that is not a number fails as well.
  if (!(point.weight.minCoeff() >= 0.0)) return "has a negative weight";
  if (!(std::abs(point.weight.sum() - 1.0) <= kRounded)) return "has weights that are not one";
  return {};
}

// Are the corners of its face that it has weights of corners of the other one as well?
bool point_lies_in(const Surface& input, const SurfacePoint& point, FaceId face) {
  const auto corners = input.faces.row(face);
  for (int k = 0; k < 3; ++k) {
    const VertexId v = input.faces(point.face, k);
    if (point.weight[k] > 0.0 && std::find(corners.begin(), corners.end(), v) == corners.end())
      return false;
  }
  return true;
}

}  // namespace

std::string find_broken_invariant(const RefinedSurface& surface) {
  const EditableTriangulation& mesh = surface.mesh;
  mesh.check_invariants();
  const auto vertices = static_cast<std::size_t>(mesh.vertex_count());
  if (surface.support.size() != vertices || surface.position.size() != vertices)
    return "not one support and one position per vertex";
  const Index parents = static_cast<Index>(surface.input->faces.rows());
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (mesh.alive(f) && (mesh.parent(f) < 0 || mesh.parent(f) >= parents))
      return "face " + std::to_string(f) + " has no parent";
  }
  for (const Support& support : surface.support) {
    const auto& [a, b, c] = support.weight;
    if (!support.empty() && (std::min({a, b, c}) < 0.0 || a + b + c != 1.0))
      return "weights that are negative or do not sum to one";
  }
  const Triangles faces = mesh.faces();
  const Provenance provenance = provenance_of(surface);
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    if (surface.orientation_in_parent(provenance.face[at(f)], faces(f, 0), faces(f, 1),
                                      faces(f, 2)) <= 0)
      return "face " + std::to_string(f) + " does not turn as its parent does";
  }
  return find_broken_provenance(*surface.input, faces, provenance);
}

std::string find_broken_map(const RefinedSurface& surface, const Points2& uv) {
  const EditableTriangulation& mesh = surface.mesh;
  mesh.check_invariants();
  if (uv.rows() != mesh.vertex_count()) return "not one place per vertex";
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (!mesh.alive(f)) continue;
    const auto [a, b, c] = mesh.corners(f);
    if (numeric::orientation(Vector2(uv.row(a)), Vector2(uv.row(b)), Vector2(uv.row(c))) <= 0)
      return "face " + std::to_string(f) + " is not positive";
  }
  return {};
}

std::string find_broken_provenance(const Surface& input, const Triangles& refined,
                                   const Provenance& provenance) {
  const auto face_count = static_cast<Index>(input.faces.rows());
  if (provenance.face.size() != at(refined.rows())) return "not one parent per face";
  for (Index f = 0; f < static_cast<Index>(refined.rows()); ++f) {
    const FaceId parent = provenance.face[at(f)];
    if (parent < 0 || parent >= face_count) return "face " + std::to_string(f) + " has no parent";
    for (int k = 0; k < 3; ++k) {
      const VertexId v = refined(f, k);
      if (v < 0 || at(v) >= provenance.vertex.size())
        return "face " + std::to_string(f) + " has a corner without provenance";
      if (std::string broken = broken_point(provenance.vertex[at(v)], face_count); !broken.empty())
        return "vertex " + std::to_string(v) + " " + broken;
      if (!point_lies_in(input, provenance.vertex[at(v)], parent))
        return "face " + std::to_string(f) + " reaches out of its parent";
    }
  }
  return {};
}

}  // namespace flipfree::mesh
