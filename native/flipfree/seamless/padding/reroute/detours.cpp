#include "flipfree/seamless/padding/reroute/detours.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/paths/disk_boundary.h"
#include "flipfree/seamless/padding/paths/free_path.h"
#include "flipfree/seamless/padding/paths/separating_path.h"

namespace flipfree::seamless {
namespace {

using Vertices = std::vector<VertexId>;

Vertices reversed(Vertices vertices) {
  std::reverse(vertices.begin(), vertices.end());
  return vertices;
}

std::vector<HalfedgeId> edges_along(const Canvas& canvas, const Vertices& vertices) {
  std::vector<HalfedgeId> path;
  for (std::size_t i = 0; i + 1 < vertices.size(); ++i)
    path.push_back(canvas.mesh().find(vertices[i], vertices[i + 1]));
  return path;
}

Vertices vertices_along(const Canvas& canvas, const std::vector<HalfedgeId>& path) {
  Vertices vertices = {canvas.mesh().source(path.front())};
  for (const HalfedgeId h : path) vertices.push_back(canvas.mesh().target(h));
  return vertices;
}

double length(const Canvas& canvas, const std::vector<HalfedgeId>& path) {
  double sum = 0.0;
  for (const HalfedgeId h : path) sum += canvas.length(h);
  return sum;
}

// From an inner vertex of a branch, on its left, to a cone.
struct Spur {
  Vertices vertices;
  double length = 0.0;
};

// The nearest cone of one of the excesses that are wanted.
std::optional<Spur> nearest_spur(const Canvas& canvas, const Vertices& branch,
                                 const std::function<bool(Index)>& is_wanted,
                                 const ExecutionContext& context) {
  WayStart from;
  for (std::size_t i = 1; i + 1 < branch.size(); ++i)
    from.sectors.push_back(canvas.mesh().find(branch[i], branch[i + 1]));
  const auto is_end = [&](VertexId v) { return is_wanted(canvas.excess(v)); };
  const std::vector<HalfedgeId> path = free_path(canvas, from, {nullptr, is_end}, context);
  if (path.empty()) return std::nullopt;
  return Spur{vertices_along(canvas, path), length(canvas, path)};
}

// The vertices beside a spur that is drawn as a fence, from the one after its root on the branch
// around its cone to the one before the root: a half-edge from the spur for each, in that order.
// One vertex may have several.
std::vector<HalfedgeId> spokes_around(const Canvas& canvas, VertexId root, VertexId after,
                                      VertexId before) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  std::vector<HalfedgeId> spokes;
  const HalfedgeId last = mesh.find(root, before);
  for (HalfedgeId h = mesh.rotate_ccw(mesh.find(root, after)); h != last; h = mesh.rotate_ccw(h)) {
    if (canvas.is_drawn(h)) {
      h = mesh.opposite(h);
    } else {
      spokes.push_back(h);
    }
  }
  return spokes;
}

// The vertices beside the spur, each once; refines until there is such a path.
Vertices path_beside(Canvas& canvas, VertexId root, VertexId after, VertexId before) {
  // Halved once, every spoke has an end of its own.
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    Vertices beside;
    std::set<VertexId> seen, met_again;
    std::vector<std::pair<VertexId, VertexId>> spokes;
    for (const HalfedgeId h : spokes_around(canvas, root, after, before)) {
      const VertexId v = canvas.mesh().target(h);
      spokes.emplace_back(canvas.mesh().source(h), v);
      if (!beside.empty() && beside.back() == v) continue;
      if (!seen.insert(v).second) met_again.insert(v);
      beside.push_back(v);
    }
    if (met_again.empty()) return beside;
    for (const auto& [center, v] : spokes) {
      if (met_again.contains(v)) canvas.halve(canvas.mesh().find(center, v));
    }
  }
  throw InternalError("the vertices beside a path to a cone make no path");
}

// Takes the branch, which has the spur on its left, around it.
Vertices draw_around(Canvas& canvas, const Vertices& branch, const Vertices& spur) {
  const auto root = std::find(branch.begin() + 1, branch.end() - 1, spur.front());
  const VertexId before = *(root - 1), after = *(root + 1);
  const Curve kind = canvas.curve(canvas.mesh().find(before, *root));
  canvas.draw(edges_along(canvas, spur), Curve::kFence);
  const Vertices beside = path_beside(canvas, *root, after, before);
  canvas.remove_fences();
  canvas.erase(edges_along(canvas, {before, *root, after}));
  Vertices detour(branch.begin(), root);
  detour.insert(detour.end(), beside.rbegin(), beside.rend());
  detour.insert(detour.end(), root + 1, branch.end());
  Vertices drawn = {before};
  drawn.insert(drawn.end(), beside.rbegin(), beside.rend());
  drawn.push_back(after);
  canvas.draw(edges_along(canvas, drawn), kind);
  return detour;
}

}  // namespace

std::optional<Vertices> draw_shortest_detour(Canvas& canvas, const Vertices& branch, Index change,
                                             const ExecutionContext& context) {
  const DiskBoundary boundary = disk_boundary(canvas);
  Vertices detour;
  double shortest = 0.0;
  for (const bool on_right : {false, true}) {
    const std::vector<HalfedgeId> along = edges_along(canvas, on_right ? reversed(branch) : branch);
    // Back from the end of the branch, so that the cones between are on the left.
    const PathEnds ends{(boundary.place[at(along.back())] + 1) % boundary.size(),
                        boundary.place[at(along.front())]};
    const auto path =
        shortest_enclosing_path(canvas, boundary, ends, on_right ? change : -change, context);
    if (!path) continue;
    const double own = length(canvas, path->halfedges);
    if (!detour.empty() && own >= shortest) continue;
    shortest = own;
    detour = vertices_along(canvas, path->halfedges);
    if (!on_right) detour = reversed(detour);
  }
  if (detour.empty()) return std::nullopt;
  const std::vector<HalfedgeId> old = edges_along(canvas, branch);
  const Curve kind = canvas.curve(old.front());
  canvas.erase(old);
  canvas.draw(edges_along(canvas, detour), kind);
  return detour;
}

Detour draw_detour_around_cone(Canvas& canvas, const Vertices& branch,
                               const std::set<Index>& changes, const ExecutionContext& context) {
  const auto left = nearest_spur(
      canvas, branch, [&](Index excess) { return changes.contains(-excess); }, context);
  const auto right = nearest_spur(
      canvas, reversed(branch), [&](Index excess) { return changes.contains(excess); }, context);
  if (!left && !right) throw InternalError("no way from the cut to a cone");
  if (left && (!right || left->length <= right->length)) {
    const Index change = -canvas.excess(left->vertices.back());
    return {draw_around(canvas, branch, left->vertices), change};
  }
  const Index change = canvas.excess(right->vertices.back());
  return {reversed(draw_around(canvas, reversed(branch), right->vertices)), change};
}

}  // namespace flipfree::seamless
