#include "flipfree/matchmaker/coarsening/relax.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// A neighbourhood with a larger share of the map's vertices is the map.
constexpr double kMostNeighbourhoodShare = 0.5;
// Vertices move within so many rings around added ones.
constexpr int kRingsAroundAdded = 6;

double angle(const Vector2& apex, const Vector2& right, const Vector2& left) {
  const Vector2 a = right - apex;
  const Vector2 b = left - apex;
  return turn(a, b);
}

bool minimize(const mesh::Surface& surface, const distortion::MinimizeOptions& options, Points2& uv,
              ExecutionContext& context) {
  if (static_cast<Eigen::Index>(options.fixed.size()) >= uv.rows()) return true;
  Outcome<distortion::Minimized> better = attempt([&] {
    return distortion::with_own_map(
        [&] { return distortion::minimize_distortion(surface, uv, options, context); });
  });
  if (better) uv = std::move(better->uv);
  return static_cast<bool>(better);
}

distortion::MinimizeOptions minimize_options(int steps) {
  distortion::MinimizeOptions minimize;
  minimize.max_iterations = steps;
  minimize.lengthen = true;
  return minimize;
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
    const VertexId v = patch.vertices[at(i)];
    patch.surface.vertices.row(i) = map.surface.position[at(v)].transpose();
    patch.uv.row(i) = map.uv.row(v);
  }
  Triangles faces(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      faces(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(k)) = static_cast<Index>(
          std::lower_bound(patch.vertices.begin(), patch.vertices.end(), triangles[t][k]) -
          patch.vertices.begin());
    }
  }
  patch.surface.faces = std::move(faces);
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
      const auto found = std::lower_bound(vertices.begin(), vertices.end(), t[k]);
      if (found == vertices.end() || *found != t[k]) continue;
      const auto at = [&](std::size_t i) -> Vector2 {
        return map.uv.row(t[(k + i) % 3]).transpose();
      };
      gain[static_cast<std::size_t>(found - vertices.begin())] -= angle(at(0), at(1), at(2));
    }
  }
  for (std::size_t i = 0; i < gain.size(); ++i) {
    if (gain[i] >= std::numbers::pi && !mesh.is_boundary_vertex(vertices[i])) return true;
  }
  return false;
}

Energy measured(const mesh::RefinedMap& map, const ExecutionContext& context) {
  const mesh::Surface surface = to_surface(map.surface);
  const distortion::RestShapes rest = distortion::build_rest_shapes(surface, context);
  return {distortion::sum_energy(surface.faces, rest.triangles, map.uv, context), rest.length};
}

double best_unit(const mesh::RefinedMap& map, const ExecutionContext& context) {
  const auto [sums, length] = measured(map, context);
  const bool far = sums.worst_at_best_scale() > 10 * distortion::kProgressiveBound;
  return 1.0 / (length * (far ? std::exp(-0.5 * sums.log_area) : sums.best_scale()));
}

std::optional<distortion::TargetsResult> reach_targets(const mesh::Surface& surface,
                                                       const Points2& uv,
                                                       const VertexTargets& targets,
                                                       const distortion::MinimizeOptions& options,
                                                       ExecutionContext& context) {
  Outcome<distortion::TargetsResult> result = attempt([&] {
    return distortion::with_own_map(
        [&] { return distortion::minimize_with_targets(surface, uv, targets, options, context); });
  });
  if (!result || !result->missed.empty()) return std::nullopt;
  return std::move(*result);
}

bool relax(mesh::RefinedMap& map, const std::vector<VertexId>& fixed, int steps,
           ExecutionContext& context) {
  distortion::MinimizeOptions whole = minimize_options(steps);
  whole.fixed = fixed;
  return minimize(to_surface(map.surface), whole, map.uv, context);
}

std::vector<VertexId> beside_added(const Mesh& mesh, Index keep) {
  std::vector<VertexId> vertices;
  for (VertexId v = keep; v < mesh.vertex_count(); ++v) vertices.push_back(v);
  vertices = vertices_near(mesh, std::move(vertices), 1);
  std::erase_if(vertices, [&](VertexId v) { return v >= keep; });
  return vertices;
}

bool relax_near_added(mesh::RefinedMap& map, std::vector<VertexId> seeds, Index keep,
                      const std::vector<VertexId>& fixed, int steps, ExecutionContext& context) {
  const Mesh& mesh = map.surface.mesh;
  for (VertexId v = keep; v < mesh.vertex_count(); ++v) seeds.push_back(v);
  const std::vector<VertexId> free = vertices_near(mesh, std::move(seeds), kRingsAroundAdded);
  if (static_cast<double>(free.size()) >=
      kMostNeighbourhoodShare * static_cast<double>(mesh.vertex_count()))
    return relax(map, fixed, steps, context);
  std::vector<Mesh::Triangle> triangles;
  for (const FaceId f : faces_at(mesh, free)) triangles.push_back(mesh.corners(f));
  if (triangles.empty()) return true;
  Patch patch = make_patch(map, triangles);
  std::vector<VertexId> held = fixed;
  std::sort(held.begin(), held.end());
  distortion::MinimizeOptions near = minimize_options(steps);
  near.unit = best_unit(map, context);
  for (std::size_t i = 0; i < patch.vertices.size(); ++i) {
    const VertexId v = patch.vertices[i];
    if (!std::binary_search(free.begin(), free.end(), v) ||
        std::binary_search(held.begin(), held.end(), v))
      near.fixed.push_back(static_cast<VertexId>(i));
  }
  if (!minimize(patch.surface, near, patch.uv, context)) return false;
  for (std::size_t i = 0; i < patch.vertices.size(); ++i)
    map.uv.row(patch.vertices[i]) = patch.uv.row(static_cast<Eigen::Index>(i));
  return true;
}

}  // namespace flipfree::matchmaker
