#include "flipfree/matchmaker/outline_target.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/dynamic_bitset.hpp>
#include <deque>
#include <map>
#include <span>

#include "flipfree/base/plane.h"
#include "flipfree/embedding/disk.h"
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
  if (embedding::turning_number(rows_of(polygon)) < 1 || n < 3) return std::nullopt;
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
  for (std::size_t i = 0; i < surface.boundary.size(); ++i) {
    const VertexId v = surface.boundary[i];
    add(i, constraints.outline[i]);
    std::vector<VertexId> pins;  // at the other ends of slits, counter-clockwise around v
    surface.mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      for (const auto& path : constraints.paths) {
        if (path.back() == v && surface.mesh.target(h) == path[path.size() - 2])
          pins.push_back(path.front());
      }
    });
    // That is from its outgoing boundary edge on; walking the outline, with the surface on the
    // left, the arriving edge comes first: the reverse order.
    std::ranges::reverse(pins);
    for (const VertexId pin : pins) {
      add(slit.mesh_vertex.size(), uv.at(pin));
      add(i, constraints.outline[i]);
      slit.mesh_vertex.push_back(pin);
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

std::string line_name(VertexId a, VertexId b) {
  return "The line through vertices " + vertex_id(a) + ", " + vertex_id(b);
}

// The line from domain vertex a to b meets an edge that may not be crossed, if it does not leave
// the domain, or meet a vertex (kInvalid).
[[noreturn]] void refuse_line(const TargetDomain& domain, const Constraints& constraints, Index a,
                              Index b, HalfedgeId met = kInvalid) {
  const mesh::EditableTriangulation& mesh = domain.triangulation;
  const VertexId v = domain.vertex_of(a), w = domain.vertex_of(b);
  if (met == kInvalid || mesh.mark(met) <= static_cast<Index>(constraints.paths.size())) {
    throw_contradiction(
        line_name(v, w) + " leaves the boundary's targets, or meets a pin or another line.",
        {"line leaves", {{"place", numbers_of({domain.at(a)})}}}, {v, w});
  }
  const Index c = mesh.source(met), d = mesh.target(met);
  const std::vector<VertexId> vertices = {v, w, domain.vertex_of(c), domain.vertex_of(d)};
  throw_contradiction(
      line_name(v, w) + " crosses the one through vertices " + vertex_id(vertices[2]) + ", " +
          vertex_id(vertices[3]) + " on one sheet. Move one of them.",
      {"segments meet",
       {{"segments", numbers_of({domain.at(a), domain.at(b), domain.at(c), domain.at(d)})}}},
      vertices);
}

// Edges that the segment from a to b crosses, each from its right to its left.
std::deque<std::pair<Index, Index>> crossed_edges(const TargetDomain& domain,
                                                  const Constraints& constraints, Index a,
                                                  Index b) {
  const mesh::EditableTriangulation& mesh = domain.triangulation;
  const auto side = [&](Index v) {
    return numeric::orientation(domain.at(a), domain.at(b), domain.at(v));
  };
  HalfedgeId g = kInvalid;
  mesh.for_each_outgoing(a, [&](HalfedgeId h) {
    if (side(mesh.target(h)) < 0 && side(mesh.apex(h)) > 0) g = next_corner(h);
  });
  std::deque<std::pair<Index, Index>> crossed;
  while (true) {
    // A vertex on the segment, another line, or the outline.
    if (g == kInvalid || mesh.is_boundary(g) || mesh.mark(g) != mesh.kUnmarked)
      refuse_line(domain, constraints, a, b, g);
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
void insert_line(TargetDomain& domain, const Constraints& constraints, Index a, Index b,
                 Index mark) {
  mesh::EditableTriangulation& mesh = domain.triangulation;
  if (mesh.find(a, b) == kInvalid) {
    auto crossed = crossed_edges(domain, constraints, a, b);
    const auto side = [&](Index p, Index q, Index v) {
      return numeric::orientation(domain.at(p), domain.at(q), domain.at(v));
    };
    std::size_t steps = 1000 + crossed.size() * crossed.size() * 10;
    while (!crossed.empty()) {
      if (steps-- == 0) refuse_line(domain, constraints, a, b);
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
  mesh.replace(star, triangles, parents);  // in the slots of the star's first faces
  const std::span fresh(star.begin(), triangles.size());
  for (SheetPin& p : pins) {
    if (p.pin.vertex != domain.vertex_of(v) && std::ranges::find(star, p.face) == star.end())
      continue;
    p.face = *std::ranges::find_if(
        fresh, [&](FaceId f) { return holds(domain, domain.point, f, p.pin.uv); });
  }
}

// Pins at the ends of lines whose sheet is known tell that of the next.
void follow_lines(SheetTarget& target, const Constraints& constraints) {
  const TargetDomain& domain = target.domain;
  // Where a line begins: a pin and its triangle, or a corner of the outline.
  struct LineEnd {
    FaceId face;
    Index corner;
    Vector2 place;
  };
  std::map<VertexId, LineEnd> known;
  std::map<VertexId, SheetPin*> pins;
  for (SheetPin& p : target.pins) {
    pins.emplace(p.pin.vertex, &p);
    if (p.face != kInvalid) known.insert({p.pin.vertex, {p.face, kInvalid, p.pin.uv}});
  }
  for (const Index d : domain.outline)
    known.insert({domain.vertex_of(d), {kInvalid, d, domain.at(d)}});
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& edge : constraints.edges) {
      for (const auto& [a, b] : {edge, std::pair(edge.second, edge.first)}) {
        if (!known.contains(a) || known.contains(b)) continue;
        const auto& [face, corner, place] = known.at(a);
        auto& [pin, next] = *pins.at(b);
        next = find_along(domain, domain.point, face, corner, place, pin.uv);
        if (next == kInvalid) {
          throw_contradiction(line_name(a, b) + " leaves the boundary's targets.",
                              {"line leaves", {{"place", numbers_of({pin.uv})}}}, {a, b});
        }
        known.insert({b, {next, kInvalid, pin.uv}});
        changed = true;
      }
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
  // The outline's vertices come first, then those at the ends of slits.
  for (std::size_t v = constraints.outline.size(); v < result.domain.point.size(); ++v)
    remove_inner(result.domain, static_cast<Index>(v), result.pins, context);
  const auto find_only_sheets = [&](bool last) {
    for (SheetPin& p : result.pins) {
      if (p.face != kInvalid) continue;
      const std::vector<FaceId> sheets = sheets_at(result.domain, p.pin.uv);
      if (sheets.size() == 1) p.face = sheets[0];
      if (sheets.empty() || (last && sheets.size() > 1))
        refuse_sheets(p.pin, sheets.size(), constraints);
    }
  };
  find_only_sheets(false);
  follow_lines(result, constraints);
  find_only_sheets(true);
  return result;
}

namespace {

// Puts a pin into a triangle that holds it. Infeasible (kContradictoryPins) where another one or
// the outline is.
Index insert_pin(TargetDomain& domain, FaceId sheet, const PinnedVertex& pin) {
  mesh::EditableTriangulation& mesh = domain.triangulation;
  HalfedgeId on_edge = kInvalid;
  for (HalfedgeId h = 3 * sheet; h < 3 * sheet + 3; ++h) {
    const Vector2& a = domain.at(mesh.source(h));
    const Vector2& b = domain.at(mesh.target(h));
    if (a == pin.uv && !mesh.is_boundary_vertex(mesh.source(h))) {
      const VertexId other = domain.vertex_of(mesh.source(h));
      throw_contradiction(
          "Vertices " + vertex_id(other) + " and " + vertex_id(pin.vertex) +
              " are pinned to the same point of one sheet. Move or release one of them.",
          {"same place", {{"place", numbers_of({a})}}}, {other, pin.vertex});
    }
    if (numeric::orientation(a, b, pin.uv) != 0) continue;
    if (a == pin.uv || mesh.mark(h) != mesh.kUnmarked) {
      throw_contradiction("Vertex " + vertex_id(pin.vertex) +
                              " is pinned to a point on the boundary's targets, or on another pin. "
                              "Move it.",
                          {"segments meet", {{"segments", numbers_of({a, b, pin.uv, pin.uv})}}},
                          {pin.vertex});
    }
    on_edge = h;
  }
  domain.point.push_back(pin.uv);
  domain.mesh_vertex.push_back(pin.vertex);
  return on_edge == kInvalid ? mesh.split_face(sheet) : mesh.split_edge(on_edge);
}

// Puts every pin into its sheet, as a vertex of the triangulation. Returns which vertex stands for
// each mesh vertex.
std::map<VertexId, Index> insert_pins(SheetTarget& target) {
  TargetDomain& domain = target.domain;
  mesh::EditableTriangulation& mesh = domain.triangulation;
  std::map<VertexId, Index> corner;
  for (const Index d : domain.outline) corner.emplace(domain.vertex_of(d), d);
  // What a face is divided into has it for its parent.
  for (FaceId f = 0; f < mesh.face_slots(); ++f) mesh.set_parent(f, f);
  for (const SheetPin& p : target.pins) {
    FaceId f = 0;
    while (!mesh.alive(f) || mesh.parent(f) != p.face || !holds(domain, domain.point, f, p.pin.uv))
      ++f;
    corner.emplace(p.pin.vertex, insert_pin(domain, f, p.pin));
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
    insert_line(target.domain, constraints, corner.at(path.front()), corner.at(path.back()),
                ++mark);
  make_delaunay(target.domain);
  return target;
}

void check_target(const mesh::RefinedSurface& surface, const Constraints& constraints,
                  const ExecutionContext& context) {
  SheetTarget sheets = sheet_target(surface, constraints, context);
  const std::map<VertexId, Index> corner = insert_pins(sheets);
  Index mark = TargetDomain::kFixedEdge + static_cast<Index>(constraints.paths.size());
  for (const auto& [a, b] : constraints.edges)
    insert_line(sheets.domain, constraints, corner.at(a), corner.at(b), ++mark);
}

}  // namespace flipfree::matchmaker
