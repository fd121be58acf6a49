#include "flipfree/matchmaker/outline_target.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/dynamic_bitset.hpp>
#include <deque>
#include <map>
#include <tuple>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// The triangles of a disk that the polygon bounds, (n - 2) x 3 corners, counter-clockwise; nothing
// if there is none.
//
// Preconditions: at least three corners, all finite, consecutive ones different. Which of several
// disks is found is deterministic but not specified. Cost: O(n^3) orientation tests at worst, in
// practice O(n^3 / 64) bit operations.
std::optional<Triangles> find_self_overlap(const Polygon& polygon,
                                           const ExecutionContext& context) {
  const std::size_t n = polygon.size();
  if (turning_number(polygon) < 1 || n < 3) return std::nullopt;
  // Which chords (i, j), i < j, close a sub-polygon i..j that is triangulated, and by which third
  // corner.
  using Bits = boost::dynamic_bitset<>;
  std::vector<Bits> from(n, Bits(n)), to(n, Bits(n));  // by i the j, by j the i
  std::vector<std::vector<Index>> apex(n, std::vector<Index>(n, kInvalid));
  const auto close = [&](std::size_t i, std::size_t j, Index k) {
    from[i].set(j);
    to[j].set(i);
    apex[i][j] = k;
  };
  for (std::size_t i = 0; i + 1 < n; ++i) close(i, i + 1, kInvalid);
  for (std::size_t j = 2; j < n; ++j) {
    context.check();
    // Descending i: (i, k) with k < j was decided in earlier rounds, (k, j) with k > i earlier in
    // this one.
    for (std::size_t i = j - 1; i-- > 0;) {
      const Bits &one = from[i], &other = to[j];
      // The first after k that both have; each leaps over what the other lacks.
      const auto next_common = [&](std::size_t k) {
        k = one.find_next(k);
        while (k != Bits::npos && !other[k]) {
          k = other.find_next(k);
          if (k != Bits::npos && !one[k]) k = one.find_next(k);
        }
        return k;
      };
      std::size_t k = next_common(i);
      while (k != Bits::npos && numeric::orientation(polygon[i], polygon[k], polygon[j]) <= 0)
        k = next_common(k);
      if (k != Bits::npos) close(i, j, static_cast<Index>(k));
    }
  }
  if (apex[0][n - 1] == kInvalid) return std::nullopt;
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  std::vector<std::pair<std::size_t, std::size_t>> chords = {{0, n - 1}};
  while (!chords.empty()) {
    const auto [i, j] = chords.back();
    chords.pop_back();
    const Index k = apex[i][j];
    if (k == kInvalid) continue;
    triangles.push_back({static_cast<Index>(i), k, static_cast<Index>(j)});
    chords.emplace_back(i, at(k));
    chords.emplace_back(at(k), j);
  }
  return rows_of(triangles);
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
  std::map<VertexId, Vector2> uv;
  for (const PinnedVertex& p : constraints.pins) uv.emplace(p.vertex, p.uv);
  SlitOutline slit;
  slit.mesh_vertex = surface.boundary;
  const auto add = [&](std::size_t domain_vertex, const Vector2& corner) {
    slit.corners.push_back(corner);
    slit.vertex.push_back(static_cast<Index>(domain_vertex));
  };
  std::map<std::size_t, std::vector<Index>> pins;  // at a boundary place: slits' ends, in order
  for (std::size_t i = surface.boundary.size(); i-- > 0;) {
    std::vector<const std::vector<VertexId>*> leaving;
    surface.mesh.for_each_outgoing(surface.boundary[i], [&](HalfedgeId h) {
      for (const auto& path : constraints.paths) {
        if (path.back() == surface.boundary[i] && surface.mesh.target(h) == path[path.size() - 2])
          leaving.push_back(&path);
      }
    });
    // Counter-clockwise around the vertex, from its outgoing boundary edge on; walking the outline,
    // with the surface on the left, the arriving edge comes first: the reverse order.
    for (auto path = leaving.rbegin(); path != leaving.rend(); ++path) {
      pins[i].push_back(static_cast<Index>(slit.mesh_vertex.size()));
      slit.mesh_vertex.push_back((*path)->front());
    }
  }
  for (std::size_t i = 0; i < surface.boundary.size(); ++i) {
    add(i, constraints.outline[i]);
    for (const Index pin : pins[i]) {
      add(at(pin), uv.at(slit.mesh_vertex[at(pin)]));
      add(i, constraints.outline[i]);
    }
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

// A simple outline, or a box around the pins for a surface with a collar and a free boundary, with
// all pins and lines in it.
Target embedded_target(const mesh::RefinedSurface& surface, const Constraints& constraints) {
  Polygon outline = constraints.outline;
  std::vector<VertexId> vertex = surface.boundary;
  if (constraints.free_boundary()) {
    // A box with a margin as wide as the pins' own extent, its corners spread evenly over the
    // collar.
    Eigen::AlignedBox2d box(Vector2(0, 0));
    if (!constraints.pins.empty()) box.setEmpty();
    for (const PinnedVertex& p : constraints.pins) box.extend(p.uv);
    const double extent = constraints.pins.empty()
                              ? 1.0
                              : std::max(box.sizes().maxCoeff(),
                                         1e-3 * std::max(box.min().cwiseAbs().maxCoeff(), 1e-300));
    const Vector2 low = box.min() - Vector2::Constant(extent);
    const Vector2 high = box.max() + Vector2::Constant(extent);
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

// An outline that overlaps itself, with a slit to every pin that has a path: its triangles, where
// corners that are the two sides of a slit share a vertex, whose edges are fixed, made Delaunay by
// flips. Throws Infeasible
// (kNotSelfOverlapping), or NotConverged with that code where the slits may be at fault.
TargetDomain immersed_outline(const mesh::RefinedSurface& surface, const Constraints& constraints,
                              const ExecutionContext& context) {
  const SlitOutline slit = cut_slits(surface, constraints);
  const std::optional<Triangles> triangles = find_self_overlap(slit.corners, context);
  if (!triangles) refuse_outline(constraints);
  const auto count = static_cast<Index>(slit.mesh_vertex.size());
  Triangles faces = *triangles;
  for (Index& corner : faces.reshaped()) corner = slit.vertex[at(corner)];
  TargetDomain domain{mesh::EditableTriangulation(count, faces), std::vector<Vector2>(at(count)),
                      slit.mesh_vertex,
                      mesh::boundary_loops(faces, mesh::build_adjacency(count, faces)).front()};
  const std::size_t n = slit.corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    domain.point[at(slit.vertex[i])] = slit.corners[i];
    domain.fix(slit.vertex[i], slit.vertex[(i + 1) % n]);
  }
  make_delaunay(domain);
  return domain;
}

// Refuses a pin at which not one sheet but so many lie: none is Infeasible (kContradictoryPins),
// several are InvalidInput (kBadPins).
[[noreturn]] void refuse_sheets(const PinnedVertex& p, std::size_t sheets,
                                const Constraints& constraints) {
  const std::string who = "Vertex " + vertex_id(p.vertex) + " is pinned to a point ";
  if (sheets == 0) {
    throw_contradiction(
        who + "outside the boundary's targets. Move it inside.",
        {"outside", {{"place", numbers_of({p.uv})}, {"polygon", numbers_of(constraints.outline)}}},
        {p.vertex});
  }
  throw_invalid(
      ErrorCode::kBadPins,
      who + "where the target overlaps itself " + std::to_string(sheets) +
          " times. Give a path from it to the boundary, which says on which sheet it lies.",
      ElementKind::kVertex, {p.vertex});
}

// Infeasible (kContradictoryPins) if the pin lies on a corner or a fixed edge of its triangle.
void check_off_edges(const TargetDomain& domain, const PinnedVertex& p, FaceId sheet) {
  const mesh::EditableTriangulation& mesh = domain.triangulation;
  for (HalfedgeId h = 3 * sheet; h < 3 * sheet + 3; ++h) {
    const Vector2& a = domain.point[at(mesh.source(h))];
    const Vector2& b = domain.point[at(mesh.target(h))];
    if (a == p.uv || (mesh.mark(h) != mesh::EditableTriangulation::kUnmarked &&
                      numeric::orientation(a, b, p.uv) == 0)) {
      throw_contradiction("Vertex " + vertex_id(p.vertex) +
                              " is pinned to a point on the boundary's targets, or on another pin. "
                              "Move it.",
                          {"segments meet", {{"segments", numbers_of({a, b, p.uv, p.uv})}}},
                          {p.vertex});
    }
  }
}

std::string line_name(VertexId a, VertexId b) {
  return "The line through vertices " + vertex_id(a) + ", " + vertex_id(b);
}

[[noreturn]] void refuse_line(const TargetDomain& domain, Index from, VertexId a, VertexId b) {
  throw_contradiction(
      line_name(a, b) + " leaves the boundary's targets, or meets a pin or another line.",
      {"line leaves", {{"place", numbers_of({domain.at(from)})}}}, {a, b});
}

// Edges that the segment from a to b crosses, each from its right to its left.
std::deque<std::pair<Index, Index>> crossed_edges(const TargetDomain& domain, Index a, Index b) {
  const mesh::EditableTriangulation& mesh = domain.triangulation;
  const auto side = [&](Index v) {
    return numeric::orientation(domain.at(a), domain.at(b), domain.at(v));
  };
  const auto refuse = [&] { refuse_line(domain, a, domain.vertex_of(a), domain.vertex_of(b)); };
  HalfedgeId g = kInvalid;
  mesh.for_each_outgoing(a, [&](HalfedgeId h) {
    if (side(mesh.target(h)) < 0 && side(mesh.apex(h)) > 0) g = next_corner(h);
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
void insert_line(TargetDomain& domain, Index a, Index b, Index mark) {
  mesh::EditableTriangulation& mesh = domain.triangulation;
  if (mesh.find(a, b) == kInvalid) {
    auto crossed = crossed_edges(domain, a, b);
    const auto side = [&](Index p, Index q, Index v) {
      return numeric::orientation(domain.at(p), domain.at(q), domain.at(v));
    };
    std::size_t steps = 1000 + crossed.size() * crossed.size() * 10;
    while (!crossed.empty()) {
      if (steps-- == 0) refuse_line(domain, a, domain.vertex_of(a), domain.vertex_of(b));
      const auto [p, q] = crossed.front();
      crossed.pop_front();
      const HalfedgeId h = mesh.find(p, q);
      const Index c = mesh.apex(h), d = mesh.apex(mesh.opposite(h));
      if (side(c, d, mesh.target(h)) <= 0 || side(d, c, mesh.source(h)) <= 0 ||
          mesh.find(c, d) != kInvalid) {
        crossed.emplace_back(p, q);
        continue;
      }
      mesh.flip_edge(h);
      if (side(a, b, c) * side(a, b, d) < 0) crossed.emplace_back(c, d);
    }
  }
  domain.fix(a, b, mark);
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
  const std::optional<Triangles> filled = find_self_overlap(polygon, context);
  if (!filled) throw InternalError("the star of a pin has no triangulation");
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  for (Eigen::Index t = 0; t < (*filled).rows(); ++t) {
    const auto corner = [&](Index k) { return ring[at((*filled)(t, k))]; };
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
      if (holds(domain, domain.point, f, p.pin.uv)) {
        p.face = f;
        break;
      }
    }
  }
}

// Where a line begins: a corner of the outline, or a pin and its triangle.
struct LineEnd {
  VertexId vertex;
  FaceId face;
  Index corner;
  Vector2 place;

  // The triangle that holds the point, along a straight line from here; kInvalid if that leaves the
  // domain.
  FaceId find(const TargetDomain& domain, const Vector2& point) const {
    return find_along(domain, domain.point, face, corner, place, point);
  }
};

// By vertex, of those whose sheet is known.
std::map<VertexId, LineEnd> line_ends(const SheetTarget& target) {
  std::map<VertexId, LineEnd> ends;
  for (const SheetPin& p : target.pins) {
    if (p.face != kInvalid) ends.insert({p.pin.vertex, {p.pin.vertex, p.face, kInvalid, p.pin.uv}});
  }
  for (const Index d : target.domain.outline) {
    const VertexId v = target.domain.vertex_of(d);
    ends.insert({v, {v, kInvalid, d, target.domain.at(d)}});
  }
  return ends;
}

// Pins at the ends of lines whose sheet is known tell that of the next.
void follow_lines(SheetTarget& target, const Constraints& constraints) {
  std::map<VertexId, SheetPin*> pins;
  for (SheetPin& p : target.pins) pins.emplace(p.pin.vertex, &p);
  std::map<VertexId, LineEnd> known = line_ends(target);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& edge : constraints.edges) {
      for (const auto& [a, b] : {edge, std::pair(edge.second, edge.first)}) {
        const auto from = known.find(a);
        if (from == known.end() || known.contains(b)) continue;
        SheetPin& next = *pins.at(b);
        next.face = from->second.find(target.domain, next.pin.uv);
        if (next.face == kInvalid) {
          throw_contradiction(line_name(a, b) + " leaves the boundary's targets.",
                              {"line leaves", {{"place", numbers_of({next.pin.uv})}}}, {a, b});
        }
        known.insert({b, {b, next.face, kInvalid, next.pin.uv}});
        changed = true;
      }
    }
  }
}

// Do segments cross, each with its ends strictly on both sides of the other?
bool cross_properly(const LineEnd& a, const LineEnd& b, const LineEnd& c, const LineEnd& d) {
  const auto parts = [](const LineEnd& p, const LineEnd& q, const LineEnd& r, const LineEnd& s) {
    return numeric::orientation(p.place, q.place, r.place) *
               numeric::orientation(p.place, q.place, s.place) <
           0;
  };
  return parts(a, b, c, d) && parts(c, d, a, b);
}

// Where lines a -> b and c -> d cross in the plane, on which sheet is each of them? Walked to from
// both ends; on the same one if all four walks agree.
void refuse_crossings(const SheetTarget& target, const Constraints& constraints,
                      const ExecutionContext& context) {
  const std::map<VertexId, LineEnd> ends = line_ends(target);
  const auto& edges = constraints.edges;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    context.check();
    const LineEnd& a = ends.at(edges[i].first);
    const LineEnd& b = ends.at(edges[i].second);
    for (std::size_t j = 0; j < i; ++j) {
      const LineEnd& c = ends.at(edges[j].first);
      const LineEnd& d = ends.at(edges[j].second);
      if (!cross_properly(a, b, c, d)) continue;
      const double right = twice_area(a.place, b.place, c.place);
      const double left = twice_area(a.place, b.place, d.place);
      const Vector2 meeting = c.place + right / (right - left) * (d.place - c.place);
      const FaceId there = a.find(target.domain, meeting);
      if (there == kInvalid || b.find(target.domain, meeting) != there ||
          c.find(target.domain, meeting) != there || d.find(target.domain, meeting) != there)
        continue;
      throw_contradiction(
          line_name(a.vertex, b.vertex) + " crosses the one through vertices " +
              vertex_id(c.vertex) + ", " + vertex_id(d.vertex) + " on one sheet. Move one of them.",
          {"segments meet", {{"segments", numbers_of({a.place, b.place, c.place, d.place})}}},
          {a.vertex, b.vertex, c.vertex, d.vertex});
    }
  }
}

}  // namespace

SheetTarget sheet_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                         const ExecutionContext& context) {
  SheetTarget result;
  if (constraints.simple_outline) {
    result.domain = embedded_target(surface, outline_alone(constraints)).domain;
  } else {
    result.domain = immersed_outline(surface, constraints, context);
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
    throw_contradiction(
        "Vertices " + vertex_id(other->second) + " and " + vertex_id(p.pin.vertex) +
            " are pinned to the same point of one sheet. Move or release one of them.",
        {"same place", {{"place", numbers_of({p.pin.uv})}}}, {other->second, p.pin.vertex});
  }
  if (!constraints.simple_outline) refuse_crossings(result, constraints, context);
  return result;
}

namespace {

// Puts every pin into its sheet, as a vertex of the triangulation. Returns which vertex stands for
// each mesh vertex.
std::map<VertexId, Index> insert_pins(SheetTarget& target) {
  TargetDomain& domain = target.domain;
  mesh::EditableTriangulation& mesh = domain.triangulation;
  std::map<VertexId, Index> corner;
  for (const Index d : domain.outline) corner.emplace(domain.mesh_vertex[at(d)], d);
  // What a face is divided into has it for its parent.
  for (FaceId f = 0; f < mesh.face_slots(); ++f) mesh.set_parent(f, f);
  for (const SheetPin& p : target.pins) {
    FaceId f = 0;
    while (!mesh.alive(f) || mesh.parent(f) != p.face || !holds(domain, domain.point, f, p.pin.uv))
      ++f;
    corner.emplace(p.pin.vertex, insert_point(domain, f, p.pin.uv, p.pin.vertex));
  }
  return corner;
}

}  // namespace

Target full_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                   const ExecutionContext& context) {
  if (constraints.free_boundary() || constraints.simple_outline)
    return embedded_target(surface, constraints);
  SheetTarget sheets = sheet_target(surface, constraints, context);
  const std::map<VertexId, Index> corner = insert_pins(sheets);
  Target target{std::move(sheets.domain), constraints.paths};
  for (const auto& [a, b] : constraints.edges) target.given.push_back({a, b});
  Index mark = TargetDomain::kFixedEdge;
  for (const std::vector<VertexId>& path : target.given)
    insert_line(target.domain, corner.at(path.front()), corner.at(path.back()), ++mark);
  make_delaunay(target.domain);
  return target;
}

}  // namespace flipfree::matchmaker
