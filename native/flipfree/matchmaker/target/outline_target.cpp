#include "flipfree/matchmaker/target/outline_target.h"

#include <algorithm>
#include <cstddef>
#include <deque>
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
    target.singular.push_back(slit.vertex[at(corner)]);
  }
  return target;
}

[[noreturn]] void refuse_sheets(const PinnedVertex& p, std::size_t sheets,
                                const Constraints& constraints) {
  const std::string who = "Vertex " + vertex_id(p.vertex) + " is pinned to a point ";
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
    const Vector2& a = domain.point[at(mesh.source(h))];
    const Vector2& b = domain.point[at(mesh.target(h))];
    if (a == p.uv || (mesh.mark(h) != mesh::EditableTriangulation::kUnmarked &&
                      numeric::orientation(a, b, p.uv) == 0)) {
      throw_infeasible(ErrorCode::kContradictoryPins,
                       "Vertex " + vertex_id(p.vertex) +
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

[[noreturn]] void refuse_line(const TargetDomain& domain, Index from, VertexId a, VertexId b) {
  throw_infeasible(ErrorCode::kContradictoryPins,
                   "The line through vertices " + vertex_id(a) + ", " + vertex_id(b) +
                       " leaves the boundary's targets, or meets a pin or another line.",
                   {"line leaves", {{"place", numbers_of({domain.point[at(from)]})}}},
                   ElementKind::kVertex, {a, b});
}

// Domain vertices by the mesh vertices they stand for.
using Corners = std::map<VertexId, Index>;

// Pins on the only sheet there is, then those to which a line leads from another one.
Corners insert_pins(Target& target, const Constraints& constraints) {
  TargetDomain& domain = target.domain;
  Corners corner;
  for (std::size_t d = 0; d < domain.mesh_vertex.size(); ++d)
    corner.emplace(domain.mesh_vertex[d], static_cast<Index>(d));
  const auto insert = [&](const PinnedVertex& p, FaceId sheet) {
    check_off_edges(domain, p, sheet);
    corner.emplace(p.vertex, insert_point(domain, sheet, p.uv, p.vertex));
  };
  std::map<VertexId, PinnedVertex> left;
  for (const PinnedVertex& p : constraints.pins) {
    if (corner.contains(p.vertex)) continue;
    const std::vector<FaceId> sheets = sheets_at(domain, p.uv);
    if (sheets.size() == 1) {
      insert(p, sheets[0]);
    } else if (sheets.empty() || constraints.edges.empty()) {
      refuse_sheets(p, sheets.size(), constraints);
    } else {
      left.emplace(p.vertex, p);
    }
  }
  for (bool changed = true; changed && !left.empty();) {
    changed = false;
    for (const auto& edge : constraints.edges) {
      for (const auto& [a, b] : {edge, std::pair(edge.second, edge.first)}) {
        const auto from = corner.find(a);
        const auto to = left.find(b);
        if (from == corner.end() || to == left.end()) continue;
        const Vector2 start = domain.point[at(from->second)];
        const FaceId sheet =
            find_along(domain, domain.point, kInvalid, from->second, start, to->second.uv);
        if (sheet == kInvalid) refuse_line(domain, from->second, a, b);
        insert(to->second, sheet);
        left.erase(to);
        changed = true;
      }
    }
  }
  if (!left.empty()) {
    const PinnedVertex& p = left.begin()->second;
    refuse_sheets(p, sheets_at(domain, p.uv).size(), constraints);
  }
  return corner;
}

// Edges that the segment from a to b crosses, each from its right to its left.
std::deque<std::pair<Index, Index>> crossed_edges(const TargetDomain& domain, Index a, Index b) {
  const mesh::EditableTriangulation& mesh = domain.triangulation;
  const auto side = [&](Index v) {
    return numeric::orientation(domain.point[at(a)], domain.point[at(b)], domain.point[at(v)]);
  };
  const auto refuse = [&] {
    refuse_line(domain, a, domain.mesh_vertex[at(a)], domain.mesh_vertex[at(b)]);
  };
  HalfedgeId g = kInvalid;
  mesh.for_each_outgoing(a, [&](HalfedgeId h) {
    const Vector2& from = domain.point[at(a)];
    if (numeric::orientation(from, domain.point[at(mesh.target(h))], domain.point[at(b)]) > 0 &&
        numeric::orientation(from, domain.point[at(mesh.apex(h))], domain.point[at(b)]) < 0)
      g = next_corner(h);
  });
  std::deque<std::pair<Index, Index>> crossed;
  while (true) {
    // A vertex on the segment, another line, or the outline.
    if (g == kInvalid || mesh.is_boundary(g) || mesh.mark(g) != mesh.kUnmarked) refuse();
    crossed.emplace_back(mesh.source(g), mesh.target(g));
    const HalfedgeId o = mesh.opposite(g);
    const Index v = mesh.apex(o);
    if (v == b) return crossed;
    g = side(v) == 0 ? kInvalid : side(v) > 0 ? next_corner(o) : previous_corner(o);
  }
}

// Makes the segment between two vertices a fixed edge, by flips of the edges that it crosses
// (Sloan 1993): of these one at least can be flipped at any time, and every flip in a convex
// quadrilateral brings one nearer to crossing no more.
void insert_line(TargetDomain& domain, Index a, Index b) {
  mesh::EditableTriangulation& mesh = domain.triangulation;
  if (mesh.find(a, b) == kInvalid) {
    auto crossed = crossed_edges(domain, a, b);
    const auto point = [&](Index v) -> const Vector2& { return domain.point[at(v)]; };
    std::size_t steps = 1000 + crossed.size() * crossed.size() * 10;
    while (!crossed.empty()) {
      if (steps-- == 0)
        refuse_line(domain, a, domain.mesh_vertex[at(a)], domain.mesh_vertex[at(b)]);
      const auto [p, q] = crossed.front();
      crossed.pop_front();
      const HalfedgeId h = mesh.find(p, q);
      const Index c = mesh.apex(h), d = mesh.apex(mesh.opposite(h));
      const bool convex = numeric::orientation(point(c), point(d), point(mesh.target(h))) > 0 &&
                          numeric::orientation(point(d), point(c), point(mesh.source(h))) > 0;
      if (!convex || mesh.find(c, d) != kInvalid) {
        crossed.emplace_back(p, q);
        continue;
      }
      mesh.flip_edge(h);
      if (numeric::orientation(point(a), point(b), point(c)) *
              numeric::orientation(point(a), point(b), point(d)) <
          0)
        crossed.emplace_back(c, d);
    }
  }
  mesh.set_mark(mesh.find(a, b), TargetDomain::kFixedEdge);
}

}  // namespace

Target full_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                   const ExecutionContext& context) {
  if (constraints.free_boundary() || constraints.simple_outline)
    return embedded_target(surface, constraints);
  Target target = immersed_outline(surface, constraints, context);
  const Corners corner = insert_pins(target, constraints);
  for (const auto& [a, b] : constraints.edges) {
    insert_line(target.domain, corner.at(a), corner.at(b));
    target.given.push_back({a, b});
  }
  if (!constraints.edges.empty()) make_delaunay(target.domain);
  return target;
}

}  // namespace flipfree::matchmaker
