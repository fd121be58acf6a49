#include "flipfree/matchmaker/smooth/neighbourhood.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>

#include "flipfree/base/plane.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

void sort_unique(std::vector<Index>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

// Place in an ascending list, kInvalid if it is not there.
Index place_of(const std::vector<VertexId>& vertices, VertexId v) {
  const auto found = std::lower_bound(vertices.begin(), vertices.end(), v);
  return found != vertices.end() && *found == v ? static_cast<Index>(found - vertices.begin())
                                                : kInvalid;
}

double angle(const Vector2& apex, const Vector2& right, const Vector2& left) {
  const Vector2 a = right - apex;
  const Vector2 b = left - apex;
  return turn(a, b);
}

}  // namespace

std::vector<VertexId> vertices_near(const Mesh& mesh, std::vector<VertexId> seeds, int rings) {
  sort_unique(seeds);
  std::vector<VertexId> near = seeds;
  std::vector<VertexId> front = std::move(seeds);
  for (int ring = 0; ring < rings && !front.empty(); ++ring) {
    std::vector<VertexId> next;
    for (const VertexId v : front) {
      mesh.for_each_outgoing(v, [&](HalfedgeId h) {
        next.push_back(mesh.target(h));
        next.push_back(mesh.apex(h));
      });
    }
    sort_unique(next);
    front.clear();
    std::set_difference(next.begin(), next.end(), near.begin(), near.end(),
                        std::back_inserter(front));
    std::vector<VertexId> wider;
    wider.reserve(near.size() + front.size());
    std::set_union(near.begin(), near.end(), front.begin(), front.end(), std::back_inserter(wider));
    near.swap(wider);
  }
  return near;
}

std::vector<FaceId> faces_at(const Mesh& mesh, const std::vector<VertexId>& vertices) {
  std::vector<FaceId> faces;
  for (const VertexId v : vertices)
    mesh.for_each_outgoing(v, [&](HalfedgeId h) { faces.push_back(h / 3); });
  sort_unique(faces);
  return faces;
}

std::vector<VertexId> around_added(const Mesh& mesh, Index keep) {
  std::vector<VertexId> vertices;
  for (VertexId v = keep; v < mesh.vertex_count(); ++v) vertices.push_back(v);
  return vertices_near(mesh, std::move(vertices), 1);
}

Patch make_patch(const mesh::RefinedMap& map, const std::vector<Mesh::Triangle>& triangles) {
  Patch patch;
  patch.vertices.reserve(3 * triangles.size());
  for (const Mesh::Triangle& t : triangles)
    patch.vertices.insert(patch.vertices.end(), t.begin(), t.end());
  sort_unique(patch.vertices);
  const auto count = static_cast<Eigen::Index>(patch.vertices.size());
  patch.surface.vertices.resize(count, 3);
  patch.uv.resize(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    const VertexId v = patch.vertices[static_cast<std::size_t>(i)];
    patch.surface.vertices.row(i) = map.surface.position[static_cast<std::size_t>(v)].transpose();
    patch.uv.row(i) = map.uv.row(v);
  }
  patch.surface.faces.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      patch.surface.faces(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(k)) =
          place_of(patch.vertices, triangles[t][k]);
    }
  }
  return patch;
}

bool winds_more(const mesh::RefinedMap& map, const std::vector<VertexId>& vertices,
                const Triangles& faces, const Points2& uv, const std::vector<FaceId>& replaced) {
  const Mesh& mesh = map.surface.mesh;
  std::vector<double> gain(vertices.size(), 0.0);
  for (FaceId f = 0; f < faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      const auto at = [&](Index i) -> Vector2 { return uv.row(faces(f, (k + i) % 3)).transpose(); };
      gain[static_cast<std::size_t>(faces(f, k))] += angle(at(0), at(1), at(2));
    }
  }
  for (const FaceId f : replaced) {
    const Mesh::Triangle t = mesh.corners(f);
    for (std::size_t k = 0; k < 3; ++k) {
      const Index number = place_of(vertices, t[k]);
      if (number == kInvalid) continue;
      const auto at = [&](std::size_t i) -> Vector2 {
        return map.uv.row(t[(k + i) % 3]).transpose();
      };
      gain[static_cast<std::size_t>(number)] -= angle(at(0), at(1), at(2));
    }
  }
  for (std::size_t i = 0; i < gain.size(); ++i) {
    if (gain[i] >= std::numbers::pi && !mesh.is_boundary_vertex(vertices[i])) return true;
  }
  return false;
}

}  // namespace flipfree::matchmaker
