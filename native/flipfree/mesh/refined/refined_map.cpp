#include "flipfree/mesh/refined/refined_map.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "flipfree/base/debug_check.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::mesh {

RefinedMap compacted_map(const RefinedMap& map) {
  RefinedMap result;
  std::vector<VertexId> old_vertex;
  result.surface = compacted(map.surface, old_vertex);
  result.uv.resize(static_cast<Eigen::Index>(old_vertex.size()), 2);
  for (std::size_t v = 0; v < old_vertex.size(); ++v) {
    result.uv.row(static_cast<Eigen::Index>(v)) = map.uv.row(old_vertex[v]);
  }
  debug_check("compacted_map", [&] { return find_broken_map(result.surface, result.uv); });
  return result;
}

namespace {

std::string broken_support(const Support& support) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(support.weight[i] >= 0.0)) return "a weight is negative";
    if (support.vertex[i] == kInvalid && support.weight[i] != 0.0) return "a weight of no vertex";
    sum += support.weight[i];
  }
  return sum == 1.0 ? "" : "weights do not sum to one";
}

bool lies_in(const Support& support, const Triangles& faces, FaceId f) {
  for (const VertexId v : support.vertex) {
    if (v != kInvalid && faces(f, 0) != v && faces(f, 1) != v && faces(f, 2) != v) return false;
  }
  return true;
}

// What is wrong with a face outside the collar; empty if nothing is.
std::string broken_face(const RefinedSurface& surface, FaceId f) {
  const FaceId parent = surface.mesh.parent(f);
  if (parent < 0 || parent >= static_cast<FaceId>(surface.input->faces.rows()))
    return "has no parent";
  const EditableTriangulation::Triangle corners = surface.mesh.corners(f);
  for (const VertexId v : corners) {
    const Support& support = surface.support[at(v)];
    if (support.empty()) return "has a corner without support";
    if (std::string broken = broken_support(support); !broken.empty()) return broken;
    if (!lies_in(support, surface.input->faces, parent)) return "reaches out of its parent";
  }
  return surface.orientation_in_parent(parent, corners[0], corners[1], corners[2]) > 0
             ? ""
             : "does not turn as its parent does";
}

// Weights that were computed, not chosen, sum to one up to a few roundings.
constexpr double kRounded = 4 * std::numeric_limits<double>::epsilon();

// What is wrong with the support of a map between stages; empty if nothing is.
std::string nearly_broken_support(const Support& support) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (support.vertex[i] == kInvalid && support.weight[i] != 0.0) return "a weight of no vertex";
    sum += support.weight[i];
  }
  return std::abs(sum - 1.0) <= kRounded ? "" : "weights do not sum to one";
}

std::string broken_point(const SurfacePoint& point, Index face_count) {
  if (point.face < 0 || point.face >= face_count) return "lies in no face of the input";
  // A weight that is not a number fails as well.
  if (!(point.weight.minCoeff() >= 0.0)) return "has a negative weight";
  if (!(std::abs(point.weight.sum() - 1.0) <= kRounded)) return "has weights that are not one";
  return {};
}

// Input vertices with a weight, sorted.
std::array<VertexId, 3> support(const Surface& input, const SurfacePoint& point) {
  std::array<VertexId, 3> out{kInvalid, kInvalid, kInvalid};
  for (int k = 0; k < 3; ++k) {
    if (point.weight[k] > 0.0) out[at(k)] = input.faces(point.face, k);
  }
  return out;
}

bool point_lies_in(const Surface& input, const SurfacePoint& point, FaceId face) {
  if (point.face == face) return true;
  for (const VertexId v : support(input, point)) {
    if (v == kInvalid) continue;
    if (input.faces(face, 0) != v && input.faces(face, 1) != v && input.faces(face, 2) != v)
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
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (!mesh.alive(f) || surface.in_collar(f)) continue;
    if (std::string broken = broken_face(surface, f); !broken.empty())
      return "face " + std::to_string(f) + ": " + broken;
  }
  return {};
}

std::string find_broken_map(const RefinedSurface& surface, const Points2& uv) {
  const EditableTriangulation& mesh = surface.mesh;
  mesh.check_invariants();
  if (uv.rows() != mesh.vertex_count()) return "not one place per vertex";
  if (surface.support.size() != static_cast<std::size_t>(mesh.vertex_count()))
    return "not one support per vertex";
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (!mesh.alive(f)) continue;
    const EditableTriangulation::Triangle t = mesh.corners(f);
    for (const VertexId v : t) {
      if (surface.in_collar(f)) break;
      if (std::string broken = nearly_broken_support(surface.support[at(v)]); !broken.empty())
        return "vertex " + std::to_string(v) + ": " + broken;
    }
    if (numeric::orientation(Vector2(uv.row(t[0])), Vector2(uv.row(t[1])), Vector2(uv.row(t[2]))) <=
        0)
      return "face " + std::to_string(f) + " is not positive";
  }
  return {};
}

std::string find_broken_provenance(const Surface& input, const Triangles& refined,
                                   const Provenance& provenance) {
  const auto face_count = static_cast<Index>(input.faces.rows());
  for (std::size_t v = 0; v < provenance.vertex.size(); ++v) {
    if (std::string broken = broken_point(provenance.vertex[v], face_count); !broken.empty())
      return "vertex " + std::to_string(v) + " " + broken;
  }
  if (provenance.face.size() != static_cast<std::size_t>(refined.rows()))
    return "not one parent per face";
  for (Index f = 0; f < static_cast<Index>(refined.rows()); ++f) {
    const FaceId parent = provenance.face[at(f)];
    if (parent < 0 || parent >= face_count) return "face " + std::to_string(f) + " has no parent";
    for (int k = 0; k < 3; ++k) {
      const VertexId v = refined(f, k);
      if (v < 0 || at(v) >= provenance.vertex.size())
        return "face " + std::to_string(f) + " has a corner without provenance";
      if (!point_lies_in(input, provenance.vertex[at(v)], parent))
        return "face " + std::to_string(f) + " reaches out of its parent";
    }
  }
  return {};
}

}  // namespace flipfree::mesh
