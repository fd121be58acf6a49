#include "flipfree/matchmaker/target/outline_target.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/target/self_overlapping.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// The outline with a slit for every path: ... b, p, b, ... Slits that leave the same boundary
// vertex follow each other clockwise around it, as the outline meets them with the surface on its
// left.
struct SlitOutline {
  Polygon corners;
  std::vector<Index> vertex;          // per corner its domain vertex
  std::vector<VertexId> mesh_vertex;  // per domain vertex
};

SlitOutline cut_slits(const mesh::RefinedSurface& surface, const Constraints& constraints) {
  std::map<VertexId, std::vector<const std::vector<VertexId>*>> at;
  for (const auto& path : constraints.paths) at[path.back()].push_back(&path);
  std::map<VertexId, Vector2> uv;
  for (const PinnedVertex& p : constraints.pins) uv.emplace(p.vertex, p.uv);
  SlitOutline slit;
  const std::size_t n = surface.boundary.size();
  for (std::size_t i = 0; i < n; ++i) {
    const VertexId b = surface.boundary[i];
    slit.mesh_vertex.push_back(b);
    slit.corners.push_back(constraints.outline[i]);
    slit.vertex.push_back(static_cast<Index>(i));
  }
  for (std::size_t i = n; i-- > 0;) {
    const auto paths = at.find(surface.boundary[i]);
    if (paths == at.end()) continue;
    // Counter-clockwise around the vertex, from its outgoing boundary edge on; walking the outline,
    // with the surface on the left, the arriving edge comes first: the reverse order.
    std::vector<std::pair<std::size_t, const std::vector<VertexId>*>> ordered;
    std::size_t turn = 0;
    surface.mesh.for_each_outgoing(surface.boundary[i], [&](HalfedgeId h) {
      for (const auto* path : paths->second) {
        if (surface.mesh.target(h) == (*path)[path->size() - 2]) ordered.emplace_back(turn, path);
      }
      ++turn;
    });
    std::sort(ordered.begin(), ordered.end(),
              [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<Vector2> corners;
    std::vector<Index> vertices;
    for (const auto& [place, path] : ordered) {
      corners.push_back(uv.at(path->front()));
      vertices.push_back(static_cast<Index>(slit.mesh_vertex.size()));
      slit.mesh_vertex.push_back(path->front());
      corners.push_back(constraints.outline[i]);
      vertices.push_back(static_cast<Index>(i));
    }
    const auto after = static_cast<std::ptrdiff_t>(i) + 1;
    slit.corners.insert(slit.corners.begin() + after, corners.begin(), corners.end());
    slit.vertex.insert(slit.vertex.begin() + after, vertices.begin(), vertices.end());
  }
  return slit;
}

[[noreturn]] void refuse_outline(const Constraints& constraints) {
  const std::string what = "The boundary's targets are not weakly self-overlapping: ";
  if (!constraints.paths.empty()) {
    // Only slits that are straight were tried: no proof.
    throw_not_converged(ErrorCode::kNotSelfOverlapping,
                        what +
                            "no disk with this outline contains the straight slits from the given "
                            "paths' ends to their pins; give other paths, or move the pins.");
  }
  throw_infeasible(ErrorCode::kNotSelfOverlapping,
                   what + "although it turns " + std::to_string(constraints.turning_number) +
                       " times, no way of filling it with counter-clockwise triangles exists.",
                   {"no immersion", {{"polygon", numbers_of(constraints.outline)}}});
}

}  // namespace

Target embedded_target(const mesh::RefinedSurface& surface, const Constraints& constraints) {
  Polygon outline = constraints.outline;
  std::vector<VertexId> vertex = surface.boundary;
  if (constraints.free_boundary()) {
    // A box with a margin as wide as the pins' own extent, its corners spread evenly over the
    // collar.
    Vector2 low = constraints.pins.empty() ? Vector2::Zero() : constraints.pins.front().uv;
    Vector2 high = low;
    for (const PinnedVertex& p : constraints.pins) {
      low = low.cwiseMin(p.uv);
      high = high.cwiseMax(p.uv);
    }
    const double extent =
        constraints.pins.empty()
            ? 1.0
            : std::max((high - low).maxCoeff(), 1e-3 * std::max(low.cwiseAbs().maxCoeff(), 1e-300));
    const Vector2 margin = Vector2::Constant(extent);
    low -= margin;
    high += margin;
    outline = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
    const std::size_t n = surface.outer_boundary.size();
    vertex.clear();
    // A triangle has three boundary vertices and four corners; its collar is refined by the caller.
    for (std::size_t i = 0; i < 4; ++i) vertex.push_back(surface.outer_boundary[i * n / 4]);
  }
  std::map<VertexId, Index> number;
  for (std::size_t i = 0; i < vertex.size(); ++i) number.emplace(vertex[i], static_cast<Index>(i));
  std::vector<Vector2> inner;
  for (const PinnedVertex& p : constraints.pins) {
    number.emplace(p.vertex, static_cast<Index>(vertex.size()));
    vertex.push_back(p.vertex);
    inner.push_back(p.uv);
  }
  Target target;
  std::vector<std::pair<Index, Index>> edges;
  for (const auto& [a, b] : constraints.edges) {
    edges.emplace_back(number.at(a), number.at(b));
    target.given.push_back({a, b});
  }
  target.domain = triangulate_embedded(outline, inner, edges);
  target.domain.mesh_vertex = vertex;
  return target;
}

Target immersed_outline(const mesh::RefinedSurface& surface, const Constraints& constraints,
                        const ExecutionContext& context) {
  const SlitOutline slit = cut_slits(surface, constraints);
  const SelfOverlap overlap = find_self_overlap(slit.corners, context);
  if (!overlap.exists) refuse_outline(constraints);
  Target target;
  target.domain = triangulate_immersed(
      slit.corners, slit.vertex, static_cast<Index>(slit.mesh_vertex.size()), overlap.triangles);
  target.domain.mesh_vertex = slit.mesh_vertex;
  target.given = constraints.paths;
  for (const Index corner : overlap.singular_corners) {
    target.singular.push_back(slit.vertex[static_cast<std::size_t>(corner)]);
  }
  return target;
}

[[noreturn]] void refuse_sheets(const PinnedVertex& p, std::size_t sheets,
                                const Constraints& constraints) {
  const std::string who = "Vertex " + std::to_string(p.vertex) + " is pinned to a point ";
  if (sheets == 0) {
    throw_infeasible(
        ErrorCode::kContradictoryPins, who + "outside the boundary's targets. Move it inside.",
        {"outside", {{"place", numbers_of({p.uv})}, {"polygon", numbers_of(constraints.outline)}}},
        ElementKind::kVertex, {p.vertex});
  }
  throw_invalid(
      ErrorCode::kBadPins,
      who + "where the target overlaps itself " + std::to_string(sheets) +
          " times. Give a path from it to the boundary, which says on which sheet it lies.",
      ElementKind::kVertex, {p.vertex});
}

void check_off_edges(const TargetDomain& domain, const PinnedVertex& p, FaceId sheet) {
  const mesh::EditableTriangulation& mesh = domain.triangulation;
  for (HalfedgeId h = 3 * sheet; h < 3 * sheet + 3; ++h) {
    const Vector2& a = domain.point[static_cast<std::size_t>(mesh.source(h))];
    const Vector2& b = domain.point[static_cast<std::size_t>(mesh.target(h))];
    if (a == p.uv || (mesh.mark(h) != mesh::EditableTriangulation::kUnmarked &&
                      numeric::orientation(a, b, p.uv) == 0)) {
      throw_infeasible(ErrorCode::kContradictoryPins,
                       "Vertex " + std::to_string(p.vertex) +
                           " is pinned to a point on the boundary's targets, or on another pin. "
                           "Move it.",
                       {"segments meet", {{"segments", numbers_of({a, b, p.uv, p.uv})}}},
                       ElementKind::kVertex, {p.vertex});
    }
  }
}

Constraints outline_alone(const Constraints& constraints) {
  Constraints outline;
  outline.outline = constraints.outline;
  outline.turning_number = constraints.turning_number;
  outline.simple_outline = constraints.simple_outline;
  return outline;
}

namespace {

void insert_pins(Target& target, const Constraints& constraints) {
  std::vector<VertexId> placed = target.domain.mesh_vertex;
  std::sort(placed.begin(), placed.end());
  for (const PinnedVertex& p : constraints.pins) {
    if (std::binary_search(placed.begin(), placed.end(), p.vertex)) continue;
    const std::vector<FaceId> sheets = sheets_at(target.domain, p.uv);
    if (sheets.size() != 1) refuse_sheets(p, sheets.size(), constraints);
    check_off_edges(target.domain, p, sheets[0]);
    insert_point(target.domain, sheets[0], p.uv, p.vertex);
  }
}

}  // namespace

Target full_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                   const ExecutionContext& context) {
  if (constraints.free_boundary() || constraints.simple_outline)
    return embedded_target(surface, constraints);
  if (!constraints.edges.empty()) {
    throw_invalid(ErrorCode::kBadPins,
                  "Lines inside a target that overlaps itself are not supported. Pin their "
                  "vertices as points.");
  }
  Target target = immersed_outline(surface, constraints, context);
  insert_pins(target, constraints);
  return target;
}

}  // namespace flipfree::matchmaker
