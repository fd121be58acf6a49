#include "flipfree/matchmaker/patches/build_target.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/target/carry.h"
#include "flipfree/matchmaker/target/self_overlapping.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

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

[[noreturn]] void refuse(const Constraints& constraints) {
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

Target immersed_outline(const mesh::RefinedSurface& surface, const Constraints& constraints,
                        const ExecutionContext& context) {
  const SlitOutline slit = cut_slits(surface, constraints);
  const SelfOverlap overlap = find_self_overlap(slit.corners, context);
  if (!overlap.exists) refuse(constraints);
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

// Refuses a pin on a corner or a fixed edge of its triangle.
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

bool holds(const TargetDomain& domain, FaceId f, const Vector2& p) {
  const mesh::EditableTriangulation& mesh = domain.triangulation;
  for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
    if (numeric::orientation(domain.point[static_cast<std::size_t>(mesh.source(h))],
                             domain.point[static_cast<std::size_t>(mesh.target(h))], p) < 0)
      return false;
  }
  return true;
}

// Takes an inner vertex out of the triangulation. Its star is seen whole from it, hence a simple
// polygon; pins in it find their triangle among the new ones.
void remove_inner(TargetDomain& domain, Index v, std::vector<SheetPin>& pins,
                  const ExecutionContext& context) {
  mesh::EditableTriangulation& mesh = domain.triangulation;
  std::vector<Index> ring;
  Polygon polygon;
  mesh.for_each_outgoing(v, [&](HalfedgeId h) {
    ring.push_back(mesh.target(h));
    polygon.push_back(domain.point[static_cast<std::size_t>(ring.back())]);
  });
  const std::vector<FaceId> star = mesh.star(v);
  const SelfOverlap overlap = find_self_overlap(polygon, context);
  if (!overlap.exists) throw InternalError("the star of a pin has no triangulation");
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  for (Eigen::Index t = 0; t < overlap.triangles.rows(); ++t) {
    const auto corner = [&](Index k) {
      return ring[static_cast<std::size_t>(overlap.triangles(t, k))];
    };
    triangles.push_back({corner(0), corner(1), corner(2)});
  }
  const std::vector<FaceId> parents(triangles.size(), 0);
  const VertexId self = domain.mesh_vertex[static_cast<std::size_t>(v)];
  mesh.replace(star, triangles, parents);
  std::vector<FaceId> fresh;
  for (const auto& t : triangles) {
    const HalfedgeId h = mesh.find(t[0], t[1]);
    for (const HalfedgeId g : {h, mesh.opposite(h)}) {
      if (g != kInvalid && mesh.source(g) == t[0] && mesh.apex(g) == t[2]) fresh.push_back(g / 3);
    }
  }
  for (SheetPin& p : pins) {
    const bool inside =
        p.pin.vertex == self || std::find(star.begin(), star.end(), p.face) != star.end();
    if (!inside) continue;
    for (const FaceId f : fresh) {
      if (holds(domain, f, p.pin.uv)) {
        p.face = f;
        break;
      }
    }
  }
}

// Pins at the ends of lines whose sheet is known tell that of the next.
void follow_lines(SheetTarget& target, const Constraints& constraints) {
  std::map<VertexId, std::size_t> pin;
  std::map<VertexId, Index> corner;
  for (std::size_t i = 0; i < target.pins.size(); ++i) pin.emplace(target.pins[i].pin.vertex, i);
  for (const Index d : target.domain.outline)
    corner.emplace(target.domain.mesh_vertex[static_cast<std::size_t>(d)], d);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& edge : constraints.edges) {
      for (const auto& [a, b] : {edge, std::pair(edge.second, edge.first)}) {
        const auto to = pin.find(b);
        if (to == pin.end() || target.pins[to->second].face != kInvalid) continue;
        SheetPin& next = target.pins[to->second];
        const auto from = pin.find(a);
        const auto at = corner.find(a);
        if (at != corner.end()) {
          next.face =
              find_along(target.domain, target.domain.point, kInvalid, at->second,
                         target.domain.point[static_cast<std::size_t>(at->second)], next.pin.uv);
        } else if (from != pin.end() && target.pins[from->second].face != kInvalid) {
          next.face = find_along(target.domain, target.domain.point, target.pins[from->second].face,
                                 kInvalid, target.pins[from->second].pin.uv, next.pin.uv);
        } else {
          continue;
        }
        if (next.face == kInvalid) {
          throw_infeasible(ErrorCode::kContradictoryPins,
                           "The line through vertices " + std::to_string(a) + ", " +
                               std::to_string(b) + " leaves the boundary's targets.",
                           {"line leaves", {{"place", numbers_of({next.pin.uv})}}},
                           ElementKind::kVertex, {a, b});
        }
        changed = true;
      }
    }
  }
}

// Where lines a -> b and c -> d cross in the plane, on which sheet is each of them? Walked to from
// both ends; on the same one if all four walks agree.
void refuse_crossings(const SheetTarget& target, const Constraints& constraints,
                      const ExecutionContext& context) {
  struct End {
    VertexId vertex;
    FaceId face;
    Index corner;
    Vector2 place;
  };
  std::map<VertexId, End> ends;
  for (const SheetPin& p : target.pins)
    ends.insert({p.pin.vertex, {p.pin.vertex, p.face, kInvalid, p.pin.uv}});
  for (const Index d : target.domain.outline) {
    const auto i = static_cast<std::size_t>(d);
    const VertexId v = target.domain.mesh_vertex[i];
    ends.insert({v, {v, kInvalid, d, target.domain.point[i]}});
  }
  const auto& edges = constraints.edges;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    context.check();
    const End& a = ends.at(edges[i].first);
    const End& b = ends.at(edges[i].second);
    for (std::size_t j = 0; j < i; ++j) {
      const End& c = ends.at(edges[j].first);
      const End& d = ends.at(edges[j].second);
      if (numeric::orientation(a.place, b.place, c.place) *
                  numeric::orientation(a.place, b.place, d.place) >=
              0 ||
          numeric::orientation(c.place, d.place, a.place) *
                  numeric::orientation(c.place, d.place, b.place) >=
              0)
        continue;
      const Vector2 along = b.place - a.place;
      const auto beside = [&](const Vector2& p) {
        return along.x() * (p.y() - a.place.y()) - along.y() * (p.x() - a.place.x());
      };
      const double share = beside(c.place) / (beside(c.place) - beside(d.place));
      const Vector2 meeting = c.place + share * (d.place - c.place);
      const auto sheet = [&](const End& end) {
        return find_along(target.domain, target.domain.point, end.face, end.corner, end.place,
                          meeting);
      };
      const FaceId there = sheet(a);
      if (there == kInvalid || sheet(b) != there || sheet(c) != there || sheet(d) != there)
        continue;
      throw_infeasible(
          ErrorCode::kContradictoryPins,
          "The line through vertices " + std::to_string(a.vertex) + ", " +
              std::to_string(b.vertex) + " crosses the one through vertices " +
              std::to_string(c.vertex) + ", " + std::to_string(d.vertex) +
              " on one sheet. Move one of them.",
          {"segments meet", {{"segments", numbers_of({a.place, b.place, c.place, d.place})}}},
          ElementKind::kVertex, {a.vertex, b.vertex, c.vertex, d.vertex});
    }
  }
}

}  // namespace

SheetTarget sheet_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                         const ExecutionContext& context) {
  SheetTarget result;
  if (constraints.simple_outline) {
    result.domain = outline_target(surface, constraints, context).domain;
  } else {
    result.domain = immersed_outline(surface, constraints, context).domain;
  }
  for (const PinnedVertex& p : constraints.pins) result.pins.push_back({p, kInvalid});
  std::vector<char> outer(result.domain.point.size(), 0);
  for (const Index v : result.domain.outline) outer[static_cast<std::size_t>(v)] = 1;
  for (std::size_t v = 0; v < outer.size(); ++v) {
    if (outer[v] == 0) remove_inner(result.domain, static_cast<Index>(v), result.pins, context);
  }
  const auto find_only_sheets = [&](bool last) {
    for (SheetPin& p : result.pins) {
      if (p.face != kInvalid) continue;
      const std::vector<FaceId> sheets = sheets_at(result.domain, p.pin.uv);
      if (sheets.size() == 1) p.face = sheets[0];
      if (sheets.empty() || (last && sheets.size() > 1))
        refuse_sheets(p.pin, sheets.size(), constraints);
    }
  };
  find_only_sheets(constraints.edges.empty());
  if (!constraints.edges.empty()) {
    follow_lines(result, constraints);
    find_only_sheets(true);
  }
  for (std::size_t i = 0; i < result.pins.size(); ++i) {
    const SheetPin& p = result.pins[i];
    check_off_edges(result.domain, p.pin, p.face);
    for (std::size_t j = 0; j < i; ++j) {
      if (result.pins[j].pin.uv != p.pin.uv || result.pins[j].face != p.face) continue;
      throw_infeasible(ErrorCode::kContradictoryPins,
                       "Vertices " + std::to_string(result.pins[j].pin.vertex) + " and " +
                           std::to_string(p.pin.vertex) +
                           " are pinned to the same point of one sheet. Move or release one of "
                           "them.",
                       {"same place", {{"place", numbers_of({p.pin.uv})}}}, ElementKind::kVertex,
                       {result.pins[j].pin.vertex, p.pin.vertex});
    }
  }
  if (!constraints.simple_outline) refuse_crossings(result, constraints, context);
  return result;
}

Target outline_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                      const ExecutionContext& context) {
  Constraints outline;
  outline.outline = constraints.outline;
  outline.turning_number = constraints.turning_number;
  outline.simple_outline = constraints.simple_outline;
  return outline.simple_outline ? embedded_target(surface, outline)
                                : immersed_outline(surface, outline, context);
}

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

Paths given_paths(const Target& target, const ConvexPartition& partition) {
  Paths given(partition.edges.size());
  std::map<std::pair<VertexId, VertexId>, Index> edge_between;
  for (std::size_t e = 0; e < partition.edges.size(); ++e) {
    const VertexId a = target.domain.mesh_vertex[static_cast<std::size_t>(partition.edges[e].a)];
    const VertexId b = target.domain.mesh_vertex[static_cast<std::size_t>(partition.edges[e].b)];
    edge_between[{a, b}] = static_cast<Index>(e);
  }
  for (std::vector<VertexId> path : target.given) {
    auto it = edge_between.find({path.front(), path.back()});
    if (it == edge_between.end()) {
      std::reverse(path.begin(), path.end());
      it = edge_between.find({path.front(), path.back()});
    }
    if (it == edge_between.end()) throw InternalError("a prescribed path is no edge of the target");
    const auto e = static_cast<std::size_t>(it->second);
    if (!partition.edges[e].boundary) given[e] = std::move(path);
  }
  return given;
}

}  // namespace flipfree::matchmaker
