#include "flipfree/matchmaker/coarsening/remove_vertex.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/coarsening/relax.h"
#include "flipfree/matchmaker/request/polygon.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// A removal may not leave a triangle that is worse than the worst it removes, except up to so many
// times the mean energy.
constexpr double kMostTimesMean = 4.0;
// A star with more corners than this is left alone.
constexpr std::size_t kMostRemovedCorners = 40;
// What a triangle costs that is turned over in the map.
constexpr double kTurnedOver = 1e300;
// Boundary vertices with a wider angle stay. Beyond 2 pi the triangles that fill the corner may
// wind once more around a vertex of its rim.
constexpr double kWidestCorner = 1.9 * std::numbers::pi;
// What a triangle costs that there may not be.
constexpr double kForbidden = std::numeric_limits<double>::infinity();

// The triangulation of a polygon with corners 0 ... n - 1, n >= 3, whose worst triangle costs
// least, by dynamic programming over the chords (Klincsek 1980): corners, ascending in each
// triangle; empty if there is none. cost(i, k, j), i < k < j. Cost: O(n^3).
template <class Cost>
std::vector<std::array<std::size_t, 3>> fill_polygon(std::size_t n, const Cost& cost) {
  std::vector<double> best(n * n, kForbidden);  // of the chord i, j: n i + j
  std::vector<std::size_t> apex(n * n, 0);
  for (std::size_t i = 0; i + 1 < n; ++i) best[i * n + i + 1] = -kForbidden;
  for (std::size_t length = 2; length < n; ++length) {
    for (std::size_t i = 0; i + length < n; ++i) {
      const std::size_t j = i + length;
      for (std::size_t k = i + 1; k < j; ++k) {
        const double parts = std::max(best[i * n + k], best[k * n + j]);
        if (parts >= best[i * n + j]) continue;
        const double worst = std::max(parts, cost(i, k, j));
        if (worst >= best[i * n + j]) continue;
        best[i * n + j] = worst;
        apex[i * n + j] = k;
      }
    }
  }
  std::vector<std::array<std::size_t, 3>> triangles;
  if (best[n - 1] == kForbidden) return triangles;
  std::vector<std::array<std::size_t, 2>> open = {{0, n - 1}};
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    if (j == i + 1) continue;
    const std::size_t k = apex[i * n + j];
    triangles.push_back({i, k, j});
    open.push_back({i, k});
    open.push_back({k, j});
  }
  return triangles;
}

// The star of a vertex and what is to replace it.
struct StarFilling {
  std::vector<FaceId> star;
  std::vector<Mesh::Triangle> triangles;
  std::vector<FaceId> parents;  // per triangle
};

class VertexRemover {
 public:
  // The map must outlive it. Measures the map's energy: O(#F).
  VertexRemover(const mesh::RefinedMap& map, const ExecutionContext& context)
      : map_(map), mesh_(map.surface.mesh) {
    const auto [sums, length] = measured(map_, context);
    const double scale = length * sums.best_scale();
    scale2_ = scale * scale;
    mean_ = sums.at_best_scale();
    // Too distorted to be measured: whatever is valid will do.
    if (std::isfinite(mean_) && scale2_ > 0 && std::isfinite(scale2_)) return;
    scale2_ = 1;
    mean_ = std::numeric_limits<double>::infinity();
  }

  // The triangulation of the star without the vertex that is best in the map; positive there, or,
  // if triangles may be `turned_over`, as far as may be. False if there is none, or the star is not
  // where its support says, or has too many corners.
  bool fill(VertexId v, bool turned_over, StarFilling& filling) {
    std::vector<Side> sides;
    filling = {mesh_.star(v), {}, {}};
    if (filling.star.empty() || !split_star(v, sides)) return false;
    if (mesh_.is_boundary_vertex(v) && angle(v) > kWidestCorner) return false;
    bound_ = kMostTimesMean * mean_;
    for (const FaceId f : filling.star) {
      const Mesh::Triangle t = mesh_.corners(f);
      bound_ = std::max(bound_, energy(t[0], t[1], t[2]));
    }
    for (const Side& side : sides) {
      if (!triangulate(side, turned_over, filling.triangles)) return false;
      filling.parents.resize(filling.triangles.size(), side.parent);
    }
    return true;
  }

 private:
  // One side of a star: corners counter-clockwise, closed by the edge from the last to the first.
  struct Side {
    std::vector<VertexId> corners;
    FaceId parent = kInvalid;
  };

  double angle(VertexId v) const {
    double sum = 0;
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      const Vector2 a = uv(mesh_.target(h)) - uv(v);
      const Vector2 b = uv(mesh_.apex(h)) - uv(v);
      sum += turn(a, b);
    });
    return sum;
  }

  // Does w lie on the input edge that v, with two supports, lies on?
  bool on_edge_of(VertexId v, VertexId w) const {
    const mesh::Support& s = support(v);
    const mesh::Support& t = support(w);
    for (std::size_t i = 0; i < 3 && t.vertex[i] != kInvalid; ++i) {
      if (t.vertex[i] != s.vertex[0] && t.vertex[i] != s.vertex[1]) return false;
    }
    return true;
  }

  // False if v is not where its support says: then it is left alone.
  bool split_star(VertexId v, std::vector<Side>& sides) const {
    const bool on_edge = support(v).vertex[2] == kInvalid;
    std::vector<HalfedgeId> fan;
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) { fan.push_back(h); });
    if (!on_edge) {
      Side side;
      for (const HalfedgeId h : fan) side.corners.push_back(mesh_.target(h));
      side.parent = mesh_.parent(fan.front() / 3);
      sides.push_back(std::move(side));
      return !mesh_.is_boundary_vertex(v);
    }
    const bool boundary = mesh_.is_boundary_vertex(v);
    std::size_t first = 0;
    if (!boundary) {
      while (first < fan.size() && !on_edge_of(v, mesh_.target(fan[first]))) ++first;
      if (first == fan.size()) return false;
      std::rotate(fan.begin(), fan.begin() + static_cast<std::ptrdiff_t>(first), fan.end());
    } else if (!on_edge_of(v, mesh_.target(fan.front()))) {
      return false;
    }
    for (const HalfedgeId h : fan) {
      if (on_edge_of(v, mesh_.target(h))) {
        sides.emplace_back();
        sides.back().parent = mesh_.parent(h / 3);
      }
      if (mesh_.parent(h / 3) != sides.back().parent) return false;
      sides.back().corners.push_back(mesh_.target(h));
      const VertexId next = mesh_.apex(h);
      const bool ends = on_edge_of(v, next);
      if (ends) sides.back().corners.push_back(next);
    }
    return sides.size() == (boundary ? 1U : 2U);
  }

  // Least worst energy; all triangles positive in both planes. Appends to `triangles`.
  bool triangulate(const Side& side, bool turned_over, std::vector<Mesh::Triangle>& triangles) {
    const std::vector<VertexId>& c = side.corners;
    const std::size_t n = c.size();
    if (n < 3 || n > kMostRemovedCorners) return false;
    Polygon polygon;
    for (const VertexId v : c) polygon.push_back(uv(v));
    if (!turned_over) {
      for (std::size_t i = 0; i < n; ++i) {
        if (polygon[i] == polygon[(i + 1) % n]) return false;
      }
      if (turning_number(polygon) != 1) return false;
    }
    // As stored: triangles between held vertices could not be repaired when the map is rounded.
    Polygon stored;
    for (const Vector2& p : polygon) stored.push_back(as_stored(p));
    const auto cost = [&](std::size_t i, std::size_t k, std::size_t j) {
      const bool positive = numeric::orientation(polygon[i], polygon[k], polygon[j]) > 0 &&
                            numeric::orientation(stored[i], stored[k], stored[j]) > 0;
      if (!positive && !turned_over) return kForbidden;
      if (map_.surface.orientation_in_parent(side.parent, c[i], c[k], c[j]) <= 0) return kForbidden;
      if (!positive) return kTurnedOver;
      const double value = energy(c[i], c[k], c[j]);
      return value > bound_ && !turned_over ? kForbidden : value;
    };
    const auto filled = fill_polygon(n, cost);
    for (const auto& [i, k, j] : filled) triangles.push_back({c[i], c[k], c[j]});
    return !filled.empty();
  }

  // Symmetric Dirichlet energy at the map's scale.
  double energy(VertexId a, VertexId b, VertexId c) const {
    const auto position = [&](VertexId v) { return map_.surface.position[at(v)]; };
    const Vector3 points[3] = {position(a), position(b), position(c)};
    const distortion::RestTriangle rest = distortion::unfold(points, distortion::kFlattestRest);
    const auto place = [&](VertexId v) { return map_.uv.row(v).data(); };
    const distortion::Jacobian j = distortion::jacobian(rest, place(a), place(b), place(c));
    const double square = 0.25 * (j.a * j.a + j.b * j.b + j.c * j.c + j.d * j.d);
    return square * scale2_ + square / (j.determinant * j.determinant * scale2_);
  }

  const mesh::Support& support(VertexId v) const { return map_.surface.support[at(v)]; }
  Vector2 uv(VertexId v) const { return map_.uv.row(v).transpose(); }

  const mesh::RefinedMap& map_;
  const Mesh& mesh_;
  double scale2_ = 1;  // square of the best global scale
  double mean_ = 0;    // energy of the map
  double bound_ = 0;   // of the new triangles of the star at hand
};

}  // namespace

Index thin_out(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
               ExecutionContext& context) {
  std::vector<char> stays(map.surface.position.size(), 0);
  for (const VertexId v : held) stays[static_cast<std::size_t>(v)] = 1;
  VertexRemover remover(map, context);
  Index removed = 0;
  for (VertexId v = map.surface.mesh.vertex_count(); v-- > keep;) {
    if (v % 256 == 0) context.check();
    StarFilling filling;
    if (stays[at(v)] != 0 || !remover.fill(v, false, filling)) continue;
    map.surface.mesh.replace(filling.star, filling.triangles, filling.parents);
    ++removed;
  }
  if (removed > 0) map = mesh::compacted_map(map);
  return removed;
}

Index remove_by_untangling(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                           int rings, ExecutionContext& context) {
  constexpr int kIterations = 80;
  constexpr int kPatience = 10;
  distortion::UntangleOptions untangling;
  untangling.max_iterations = kIterations;
  untangling.patience = kPatience;
  untangling.extra_iterations = 1;
  Mesh& mesh = map.surface.mesh;
  VertexRemover remover(map, context);
  std::vector<char> stays(map.surface.position.size(), 0);
  for (const VertexId v : held) stays[at(v)] = 1;
  Index removed = 0;
  for (VertexId v = mesh.vertex_count(); v-- > keep;) {
    context.check();
    StarFilling filling;
    if (stays[at(v)] != 0 || !remover.fill(v, true, filling)) continue;
    std::sort(filling.star.begin(), filling.star.end());
    std::vector<VertexId> near = vertices_near(mesh, {v}, rings);
    near.erase(std::lower_bound(near.begin(), near.end(), v));
    const std::vector<FaceId> faces = faces_at(mesh, near);
    std::vector<Mesh::Triangle> triangles = filling.triangles;
    for (const FaceId f : faces) {
      if (!std::binary_search(filling.star.begin(), filling.star.end(), f))
        triangles.push_back(mesh.corners(f));
    }
    const Patch patch = make_patch(map, triangles);
    std::vector<char> fixed;
    for (const VertexId w : patch.vertices) {
      const bool moves = std::binary_search(near.begin(), near.end(), w) && stays[at(w)] == 0 &&
                         !mesh.is_boundary_vertex(w);
      fixed.push_back(moves ? 0 : 1);
    }
    const distortion::UntangleResult result =
        distortion::Untangler(patch.surface, fixed, context).run(patch.uv, untangling, context);
    if (result.flips != 0 ||
        !distortion::is_flip_free(patch.surface.faces, as_stored(result.uv), context) ||
        winds_more(map, patch.vertices, patch.surface.faces, result.uv, faces))
      continue;
    for (std::size_t i = 0; i < patch.vertices.size(); ++i)
      map.uv.row(patch.vertices[i]) = result.uv.row(static_cast<Eigen::Index>(i));
    mesh.replace(filling.star, filling.triangles, filling.parents);
    ++removed;
  }
  return removed;
}

}  // namespace flipfree::matchmaker
