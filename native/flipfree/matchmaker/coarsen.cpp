#include "flipfree/matchmaker/coarsen.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/distortion/minimize.h"
#include "flipfree/matchmaker/first_try.h"
#include "flipfree/matchmaker/polygon.h"
#include "flipfree/matchmaker/restore.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree {
namespace {

using Mesh = EditableTriangulation;

constexpr int kMostPasses = 12;
constexpr int kRelaxIterations = 6;
// A removal may not leave a triangle that is worse than the worst it removes, except up to so many
// times the mean energy.
constexpr double kMostTimesMean = 4.0;
// A pass that removes a smaller share (in per cent) of what is there is idle.
constexpr Index kWorthwhile = 2;
// Neighbourhoods in which pieces are untangled at the end.
constexpr std::array<int, 2> kRings = {2, 5};
// A star with more corners than this is left alone.
constexpr std::size_t kMostCorners = 40;

// Boundary vertices with a wider angle stay. Beyond 2 pi the triangles that fill the corner may
// wind once more around a vertex of its rim.
constexpr double kWidestCorner = 1.9 * std::numbers::pi;

// One side of a star: corners counter-clockwise, closed by the edge from the last to the first.
struct Side {
  std::vector<VertexId> corners;
  FaceId parent = kInvalid;
};

class Remover {
 public:
  explicit Remover(RefinedMap& map) : map_(map), mesh_(map.surface.mesh) { measure(); }

  bool remove(VertexId v) {
    std::vector<Side> sides;
    const std::vector<FaceId> star = mesh_.star(v);
    if (star.empty() || !split_star(v, sides)) return false;
    if (mesh_.is_boundary_vertex(v) && angle(v) > kWidestCorner) return false;
    std::vector<Mesh::Triangle> triangles;
    std::vector<FaceId> parents;
    bound_ = kMostTimesMean * mean_;
    for (const FaceId f : star) {
      const Mesh::Triangle t = mesh_.corners(f);
      bound_ = std::max(bound_, energy(t[0], t[1], t[2]));
    }
    for (const Side& side : sides) {
      if (!triangulate(side, triangles)) return false;
      parents.resize(triangles.size(), side.parent);
    }
    mesh_.replace(star, triangles, parents);
    return true;
  }

 private:
  const Support& support(VertexId v) const {
    return map_.surface.support[static_cast<std::size_t>(v)];
  }
  Vector2 uv(VertexId v) const { return map_.uv.row(v).transpose(); }

  double angle(VertexId v) const {
    double sum = 0;
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      const Vector2 a = uv(mesh_.target(h)) - uv(v);
      const Vector2 b = uv(mesh_.apex(h)) - uv(v);
      sum += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    });
    return sum;
  }

  // Does w lie on the input edge that v, with two supports, lies on?
  bool on_edge_of(VertexId v, VertexId w) const {
    const Support& s = support(v);
    const Support& t = support(w);
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

  // Best triangulation by dynamic programming: least worst energy; all triangles positive in
  // both planes.
  bool triangulate(const Side& side, std::vector<Mesh::Triangle>& triangles) const {
    const std::vector<VertexId>& c = side.corners;
    const std::size_t n = c.size();
    if (n < 3 || n > kMostCorners) return false;
    Polygon polygon;
    for (const VertexId v : c) polygon.push_back(uv(v));
    for (std::size_t i = 0; i < n; ++i) {
      if (polygon[i] == polygon[(i + 1) % n]) return false;
    }
    if (turning_number(polygon) != 1) return false;
    // As stored: triangles between held vertices could not be repaired when the map is rounded.
    Polygon stored;
    for (const Vector2& p : polygon) stored.push_back(p.cast<float>().cast<double>());
    constexpr double kNone = -std::numeric_limits<double>::infinity();
    std::vector<double> best(n * n, kNone);
    std::vector<std::size_t> apex(n * n, 0);
    for (std::size_t i = 0; i + 1 < n; ++i)
      best[i * n + i + 1] = std::numeric_limits<double>::infinity();
    for (std::size_t length = 2; length < n; ++length) {
      for (std::size_t i = 0; i + length < n; ++i) {
        const std::size_t j = i + length;
        for (std::size_t k = i + 1; k < j; ++k) {
          const double parts = std::min(best[i * n + k], best[k * n + j]);
          if (parts <= best[i * n + j]) continue;
          if (orientation(polygon[i], polygon[k], polygon[j]) <= 0) continue;
          if (orientation(stored[i], stored[k], stored[j]) <= 0) continue;
          if (map_.surface.orientation_in_parent(side.parent, c[i], c[k], c[j]) <= 0) continue;
          const double cost = energy(c[i], c[k], c[j]);
          if (cost > bound_) continue;
          const double value = std::min(parts, -cost);
          if (value <= best[i * n + j]) continue;
          best[i * n + j] = value;
          apex[i * n + j] = k;
        }
      }
    }
    if (best[n - 1] == kNone) return false;
    std::vector<std::array<std::size_t, 2>> open = {{0, n - 1}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      if (j == i + 1) continue;
      const std::size_t k = apex[i * n + j];
      triangles.push_back({c[i], c[k], c[j]});
      open.push_back({i, k});
      open.push_back({k, j});
    }
    return true;
  }

  // Half the squared lengths of J and of its inverse, from the surface to the map.
  std::array<double, 2> stretches(VertexId a, VertexId b, VertexId c) const {
    const auto at = [&](VertexId v) -> const Vector3& {
      return map_.surface.position[static_cast<std::size_t>(v)];
    };
    const Vector3 e = at(b) - at(a);
    const Vector3 f = at(c) - at(a);
    const double length = std::max(e.norm(), 1e-300);
    const double along = e.dot(f) / length;
    // Needles as everywhere: distortion/rest_shapes.h.
    const double height = std::max(e.cross(f).norm() / length, 1e-7 * std::max(length, f.norm()));
    const Vector2 p = (uv(b) - uv(a)) / length;
    const Vector2 q = (uv(c) - uv(a) - along * p) / height;
    const double square = 0.5 * (p.squaredNorm() + q.squaredNorm());
    const double area = p.x() * q.y() - p.y() * q.x();
    return {square, square / (area * area)};
  }
  // Symmetric Dirichlet energy at the map's scale.
  double energy(VertexId a, VertexId b, VertexId c) const {
    const auto [stretch, shrink] = stretches(a, b, c);
    return 0.5 * (stretch * scale2_ + shrink / scale2_);
  }
  void measure() {
    double stretch = 0;
    double shrink = 0;
    double total = 0;
    for (FaceId f = 0; f < mesh_.face_slots(); ++f) {
      if (!mesh_.alive(f)) continue;
      const Mesh::Triangle t = mesh_.corners(f);
      const auto at = [&](std::size_t k) -> const Vector3& {
        return map_.surface.position[static_cast<std::size_t>(t[k])];
      };
      const double area = (at(1) - at(0)).cross(at(2) - at(0)).norm();
      const auto [s, i] = stretches(t[0], t[1], t[2]);
      stretch += area * s;
      shrink += area * i;
      total += area;
    }
    scale2_ = std::sqrt(shrink / stretch);
    mean_ = std::sqrt(stretch * shrink) / total;
    // Too distorted to be measured: whatever is valid will do.
    if (!std::isfinite(mean_) || !(scale2_ > 0) || !std::isfinite(scale2_)) {
      scale2_ = 1;
      mean_ = std::numeric_limits<double>::infinity();
    }
  }

  RefinedMap& map_;
  Mesh& mesh_;
  double scale2_ = 1;  // square of the best global scale
  double mean_ = 0;    // energy of the map
  double bound_ = 0;   // of the new triangles of the star at hand
};

}  // namespace

Index straighten(RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                 ExecutionContext& context) {
  const RefinedSurface& surface = map.surface;
  const Mesh& mesh = surface.mesh;
  const Triangles& input = surface.input->faces;
  const auto uv = [&](VertexId v) -> Vector2 { return map.uv.row(v).transpose(); };
  // Input faces that cannot be whole again.
  std::vector<char> bent(static_cast<std::size_t>(input.rows()), 0);
  for (FaceId f = 0; f < input.rows(); ++f) {
    bent[static_cast<std::size_t>(f)] =
        orientation(uv(input(f, 0)), uv(input(f, 1)), uv(input(f, 2))) <= 0 ? 1 : 0;
  }
  const Index count = mesh.vertex_count();
  std::vector<Vector2> straight(static_cast<std::size_t>(count - keep), Vector2::Zero());
  for (VertexId v = keep; v < count; ++v) {
    const Support& s = surface.support[static_cast<std::size_t>(v)];
    for (std::size_t i = 0; i < 3 && s.vertex[i] != kInvalid; ++i) {
      straight[static_cast<std::size_t>(v - keep)] += s.weight[i] * uv(s.vertex[i]);
    }
  }
  const auto leave = [&](VertexId v) {
    mesh.for_each_outgoing(
        v, [&](HalfedgeId h) { bent[static_cast<std::size_t>(mesh.parent(h / 3))] = 1; });
  };
  for (VertexId v = surface.input_vertices(); v < keep; ++v) leave(v);
  for (const VertexId v : held) {
    if (v >= keep) leave(v);
  }
  const auto stays = [&](VertexId v) {
    bool all = true;
    mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      all = all && bent[static_cast<std::size_t>(mesh.parent(h / 3))] != 0;
    });
    return all;
  };
  const auto place = [&](VertexId v) {
    return v < keep || stays(v) ? uv(v) : straight[static_cast<std::size_t>(v - keep)];
  };
  const auto around = [&](VertexId v, std::vector<FaceId>& faces) {
    mesh.for_each_outgoing(v, [&](HalfedgeId h) { faces.push_back(h / 3); });
  };
  std::vector<FaceId> open;
  for (VertexId v = keep; v < count; ++v) around(v, open);
  std::sort(open.begin(), open.end());
  open.erase(std::unique(open.begin(), open.end()), open.end());
  std::vector<std::pair<FaceId, FaceId>> parts;  // input face, face
  for (const FaceId f : open) parts.emplace_back(mesh.parent(f), f);
  std::sort(parts.begin(), parts.end());
  const auto bend = [&](FaceId parent) {
    if (std::exchange(bent[static_cast<std::size_t>(parent)], char{1}) != 0) return;
    for (auto part = std::lower_bound(parts.begin(), parts.end(), std::pair(parent, FaceId{0}));
         part != parts.end() && part->first == parent; ++part) {
      for (const VertexId v : mesh.corners(part->second)) {
        if (v >= keep) around(v, open);
      }
    }
  };
  const auto bend_around = [&](VertexId v) {
    std::vector<FaceId> parents;
    mesh.for_each_outgoing(v, [&](HalfedgeId h) { parents.push_back(mesh.parent(h / 3)); });
    for (const FaceId parent : parents) bend(parent);
  };
  // Positive triangles can wind twice around an inner vertex; a bound in the middle of once and
  // twice decides beyond rounding.
  const auto winds_once = [&](VertexId v) {
    double angle = 0;
    const Vector2 p = place(v);
    mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      const Vector2 a = place(mesh.target(h)) - p;
      const Vector2 b = place(mesh.apex(h)) - p;
      angle += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    });
    return mesh.is_boundary_vertex(v) || angle < 3 * std::numbers::pi;
  };
  Index steps = 0;
  while (!open.empty()) {
    while (!open.empty()) {
      if (++steps % 1024 == 0) context.check();
      const FaceId f = open.back();
      open.pop_back();
      const Mesh::Triangle c = mesh.corners(f);
      if (orientation(place(c[0]), place(c[1]), place(c[2])) > 0) continue;
      // Give this face, or, if it is bent already, its neighbours across straight edges their bends
      // back.
      if (bent[static_cast<std::size_t>(mesh.parent(f))] != 0) {
        for (const VertexId v : c) {
          if (v >= keep && !stays(v)) bend_around(v);
        }
      }
      bend(mesh.parent(f));
    }
    for (const auto& part : parts) {
      for (const VertexId v : mesh.corners(part.second)) {
        if (winds_once(v)) continue;
        bend_around(v);
        mesh.for_each_outgoing(v, [&](HalfedgeId h) {
          for (const VertexId w : {mesh.target(h), mesh.apex(h)}) {
            if (w >= keep && !stays(w)) bend_around(w);
          }
        });
      }
    }
  }
  std::vector<std::pair<VertexId, Vector2>> moved;
  for (VertexId v = keep; v < count; ++v) {
    if (mesh.outgoing(v) != kInvalid && !stays(v)) moved.emplace_back(v, place(v));
  }
  for (const auto& [v, p] : moved) map.uv.row(v) = p.transpose();
  return static_cast<Index>(moved.size());
}

RefinedMap compacted_map(const RefinedMap& map) {
  RefinedMap result;
  std::vector<VertexId> old_vertex;
  result.surface = compacted(map.surface, old_vertex);
  result.uv.resize(static_cast<Eigen::Index>(old_vertex.size()), 2);
  for (std::size_t v = 0; v < old_vertex.size(); ++v) {
    result.uv.row(static_cast<Eigen::Index>(v)) = map.uv.row(old_vertex[v]);
  }
  return result;
}

Index remove_vertices(RefinedMap& map, const std::vector<char>& removable,
                      ExecutionContext& context) {
  Remover remover(map);
  Index removed = 0;
  for (VertexId v = map.surface.mesh.vertex_count(); v-- > 0;) {
    if (v % 256 == 0) context.check();
    if (removable[static_cast<std::size_t>(v)] != 0 && remover.remove(v)) ++removed;
  }
  return removed;
}

Index thin_out(RefinedMap& map, const std::vector<VertexId>& held, Index keep,
               ExecutionContext& context) {
  std::vector<char> removable(map.surface.position.size(), 0);
  std::fill(removable.begin() +
                std::min<std::ptrdiff_t>(keep, static_cast<std::ptrdiff_t>(removable.size())),
            removable.end(), char{1});
  for (const VertexId v : held) removable[static_cast<std::size_t>(v)] = 0;
  const Index removed = remove_vertices(map, removable, context);
  if (removed > 0) map = compacted_map(map);
  return removed;
}

Index remove_added(RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                   ExecutionContext& context) {
  straighten(map, held, keep, context);
  return thin_out(map, held, keep, context);
}

RefinedMap coarsen(RefinedMap map, const Constraints& constraints, Index keep,
                   ExecutionContext& context, Stats& stats) {
  const Index before = map.surface.mesh.vertex_count();
  const auto added = [&] { return map.surface.mesh.vertex_count() - keep; };
  // False when the map is too squeezed; what is removed is removed.
  const auto relax = [&] {
    MinimizeOptions options;
    options.max_iterations = kRelaxIterations;
    options.fixed = held_vertices(map.surface, constraints);
    if (static_cast<Index>(options.fixed.size()) >= map.surface.mesh.vertex_count()) return true;
    Stats unused;
    try {
      map.uv = minimize_distortion(to_surface(map.surface), map.uv, options, context, unused);
    } catch (const NotConverged&) {
      return false;
    }
    return true;
  };
  std::int64_t passes = 0;
  int idle = 0;
  for (int pass = 0; pass < kMostPasses && idle < 2 && added() > 0; ++pass, ++passes) {
    context.report("taking refinement back", 0.8 * static_cast<double>(pass) / kMostPasses);
    const ProgressRange quiet(context, 0.8 * static_cast<double>(pass) / kMostPasses,
                              0.8 * static_cast<double>(pass + 1) / kMostPasses);
    const Index there = added();
    const Index removed = remove_added(map, held_vertices(map.surface, constraints), keep, context);
    idle = 100 * removed < kWorthwhile * there ? idle + 1 : 0;
    if (added() == 0 || !relax()) break;
  }
  const ProgressRange rest(context, 0.8, 1.0);
  for (const int rings : kRings) {
    if (added() == 0 || added() > keep / 2) break;
    std::vector<char> held(map.surface.position.size(), 0);
    for (const VertexId v : held_vertices(map.surface, constraints))
      held[static_cast<std::size_t>(v)] = 1;
    if (restore_pieces(map, held, keep, rings, context) == 0) continue;
    map = compacted_map(map);
    relax();
  }
  stats["coarsen.removed"] = static_cast<std::int64_t>(before - map.surface.mesh.vertex_count());
  stats["coarsen.passes"] = passes;
  return map;
}

RefinedMap coarsen_gently(RefinedMap map, const Constraints& constraints, Index keep,
                          ExecutionContext& context, Stats& stats) {
  const Index before = map.surface.mesh.vertex_count();
  std::int64_t passes = 0;
  for (; passes < kMostPasses && map.surface.mesh.vertex_count() > keep; ++passes) {
    const double share = static_cast<double>(passes) / kMostPasses;
    context.report("taking refinement back", share);
    const ProgressRange quiet(context, share, share);
    MinimizeOptions options;
    options.max_iterations = kRelaxIterations;
    options.fixed = held_vertices(map.surface, constraints);
    if (thin_out(map, options.fixed, keep, context) == 0) break;
    if (static_cast<Index>(options.fixed.size()) >= map.surface.mesh.vertex_count()) break;
    Stats unused;
    try {
      map.uv = minimize_distortion(to_surface(map.surface), map.uv, options, context, unused);
    } catch (const NotConverged&) {
      break;  // too squeezed to be relaxed; what is removed is removed
    }
  }
  stats["coarsen.removed"] = static_cast<std::int64_t>(before - map.surface.mesh.vertex_count());
  stats["coarsen.passes"] = passes;
  return map;
}

}  // namespace flipfree
