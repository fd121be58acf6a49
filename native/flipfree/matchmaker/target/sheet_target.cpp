#include "flipfree/matchmaker/target/sheet_target.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <tuple>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/target/outline_target.h"
#include "flipfree/matchmaker/target/self_overlapping.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

bool holds(const TargetDomain& domain, FaceId f, const Vector2& p) {
  const mesh::EditableTriangulation& mesh = domain.triangulation;
  for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
    if (numeric::orientation(domain.point[at(mesh.source(h))], domain.point[at(mesh.target(h))],
                             p) < 0)
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
    polygon.push_back(domain.point[at(ring.back())]);
  });
  const std::vector<FaceId> star = mesh.star(v);
  const SelfOverlap overlap = find_self_overlap(polygon, context);
  if (!overlap.exists) throw InternalError("the star of a pin has no triangulation");
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  for (Eigen::Index t = 0; t < overlap.triangles.rows(); ++t) {
    const auto corner = [&](Index k) { return ring[at(overlap.triangles(t, k))]; };
    triangles.push_back({corner(0), corner(1), corner(2)});
  }
  const std::vector<FaceId> parents(triangles.size(), 0);
  const VertexId self = domain.mesh_vertex[at(v)];
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
  for (const Index d : target.domain.outline) corner.emplace(target.domain.mesh_vertex[at(d)], d);
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
                           "The line through vertices " + vertex_id(a) + ", " + vertex_id(b) +
                               " leaves the boundary's targets.",
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
          "The line through vertices " + vertex_id(a.vertex) + ", " + vertex_id(b.vertex) +
              " crosses the one through vertices " + vertex_id(c.vertex) + ", " +
              vertex_id(d.vertex) + " on one sheet. Move one of them.",
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
    result.domain = full_target(surface, outline_alone(constraints), context).domain;
  } else {
    result.domain = immersed_outline(surface, constraints, context).domain;
  }
  for (const PinnedVertex& p : constraints.pins) result.pins.push_back({p, kInvalid});
  std::vector<char> outer(result.domain.point.size(), 0);
  for (const Index v : result.domain.outline) outer[at(v)] = 1;
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
  std::map<std::tuple<double, double, FaceId>, VertexId> taken;
  for (const SheetPin& p : result.pins) {
    check_off_edges(result.domain, p.pin, p.face);
    const auto [other, added] =
        taken.try_emplace({p.pin.uv.x(), p.pin.uv.y(), p.face}, p.pin.vertex);
    if (added) continue;
    throw_infeasible(ErrorCode::kContradictoryPins,
                     "Vertices " + vertex_id(other->second) + " and " + vertex_id(p.pin.vertex) +
                         " are pinned to the same point of one sheet. Move or release one of them.",
                     {"same place", {{"place", numbers_of({p.pin.uv})}}}, ElementKind::kVertex,
                     {other->second, p.pin.vertex});
  }
  if (!constraints.simple_outline) refuse_crossings(result, constraints, context);
  return result;
}

}  // namespace flipfree::matchmaker
