#include "flipfree/matchmaker/target/outline_target.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// Which chords (i, j), i < j, close a sub-polygon i..j that is triangulated, and by which third
// corner.
class ChordTable {
 public:
  explicit ChordTable(std::size_t n)
      : n_(n), words_((n + 63) / 64), from_(n * words_), to_(n * words_), apex_(n * n, kInvalid) {
    for (std::size_t i = 0; i + 1 < n; ++i) set(i, i + 1, kInvalid);
  }

  void set(std::size_t i, std::size_t j, Index apex) {
    from_[i * words_ + j / 64] |= std::uint64_t{1} << (j % 64);
    to_[j * words_ + i / 64] |= std::uint64_t{1} << (i % 64);
    apex_[i * n_ + j] = apex;
  }
  Index apex(std::size_t i, std::size_t j) const { return apex_[i * n_ + j]; }

  // The first k in (i, j) for which both (i, k) and (k, j) are closed and accept(k); kInvalid if
  // there is none.
  template <typename Accept>
  Index find_apex(std::size_t i, std::size_t j, const Accept& accept) const {
    const std::uint64_t* row = &from_[i * words_];
    const std::uint64_t* column = &to_[j * words_];
    for (std::size_t w = i / 64; w <= j / 64; ++w) {
      std::uint64_t both = row[w] & column[w];
      while (both != 0) {
        const auto k =
            static_cast<Index>(w * 64 + static_cast<std::size_t>(std::countr_zero(both)));
        if (accept(k)) return k;
        both &= both - 1;
      }
    }
    return kInvalid;
  }

 private:
  std::size_t n_;
  std::size_t words_;
  std::vector<std::uint64_t> from_;  // row i: bits j
  std::vector<std::uint64_t> to_;    // row j: bits i
  std::vector<Index> apex_;
};

Triangles read_triangles(const ChordTable& table, std::size_t n) {
  Triangles triangles(static_cast<Eigen::Index>(n) - 2, 3);
  std::vector<std::pair<std::size_t, std::size_t>> chords = {{0, n - 1}};
  Eigen::Index count = 0;
  while (!chords.empty()) {
    const auto [i, j] = chords.back();
    chords.pop_back();
    const Index k = table.apex(i, j);
    if (k == kInvalid) continue;
    triangles.row(count++) << static_cast<Index>(i), k, static_cast<Index>(j);
    chords.emplace_back(i, static_cast<std::size_t>(k));
    chords.emplace_back(static_cast<std::size_t>(k), j);
  }
  return triangles;
}

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
  ChordTable table(n);
  for (std::size_t j = 2; j < n; ++j) {
    context.check();
    // Descending i: (i, k) with k < j was decided in earlier rounds, (k, j) with k > i earlier in
    // this one.
    for (std::size_t i = j - 1; i-- > 0;) {
      const Index apex = table.find_apex(i, j, [&](Index k) {
        return numeric::orientation(polygon[i], polygon[at(k)], polygon[j]) > 0;
      });
      if (apex != kInvalid) table.set(i, j, apex);
    }
  }
  if (table.apex(0, n - 1) == kInvalid) return std::nullopt;
  return read_triangles(table, n);
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

// An outline that overlaps itself, with a slit to every pin that has a path. Throws Infeasible
// (kNotSelfOverlapping), or NotConverged with that code where the slits may be at fault.
TargetDomain immersed_outline(const mesh::RefinedSurface& surface, const Constraints& constraints,
                              const ExecutionContext& context) {
  const SlitOutline slit = cut_slits(surface, constraints);
  const std::optional<Triangles> triangles = find_self_overlap(slit.corners, context);
  if (!triangles) refuse_outline(constraints);
  TargetDomain domain = triangulate_immersed(
      slit.corners, slit.vertex, static_cast<Index>(slit.mesh_vertex.size()), *triangles);
  domain.mesh_vertex = slit.mesh_vertex;
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

}  // namespace

Constraints outline_alone(const Constraints& constraints) {
  Constraints outline;
  outline.outline = constraints.outline;
  outline.turning_number = constraints.turning_number;
  outline.simple_outline = constraints.simple_outline;
  return outline;
}

namespace {

[[noreturn]] void refuse_line(const TargetDomain& domain, Index from, VertexId a, VertexId b) {
  throw_contradiction("The line through vertices " + vertex_id(a) + ", " + vertex_id(b) +
                          " leaves the boundary's targets, or meets a pin or another line.",
                      {"line leaves", {{"place", numbers_of({domain.point[at(from)]})}}}, {a, b});
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
          throw_contradiction("The line through vertices " + vertex_id(a) + ", " + vertex_id(b) +
                                  " leaves the boundary's targets.",
                              {"line leaves", {{"place", numbers_of({next.pin.uv})}}}, {a, b});
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
      throw_contradiction(
          "The line through vertices " + vertex_id(a.vertex) + ", " + vertex_id(b.vertex) +
              " crosses the one through vertices " + vertex_id(c.vertex) + ", " +
              vertex_id(d.vertex) + " on one sheet. Move one of them.",
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
  for (const std::vector<VertexId>& path : target.given)
    insert_line(target.domain, corner.at(path.front()), corner.at(path.back()));
  make_delaunay(target.domain);
  return target;
}

}  // namespace flipfree::matchmaker
