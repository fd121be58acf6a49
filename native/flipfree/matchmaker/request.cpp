#include "flipfree/matchmaker/request.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/embedding/disk.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {

bool is_locally_convex(const Polygon& polygon) {
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (numeric::orientation(polygon[i], polygon[(i + 1) % n], polygon[(i + 2) % n]) < 0)
      return false;
  }
  return true;
}

std::optional<std::pair<Index, Index>> first_conflict(const Polygon& polygon) {
  distortion::Boundary boundary;
  const auto n = static_cast<Index>(polygon.size());
  for (Index i = 0; i < n; ++i) {
    boundary.edges.push_back({i, (i + 1) % n});
    boundary.vertices.push_back(i);
  }
  const Points2 uv = rows_of(polygon);
  const auto found = distortion::BoundaryGrid(boundary, uv).conflicts(1, ExecutionContext());
  if (found.empty()) return std::nullopt;
  return std::minmax(found[0][0], found[0][1]);
}

Vector3 barycentric(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& point) {
  const double area = twice_area(a, b, c);
  const double at_b = twice_area(a, point, c) / area;
  const double at_c = twice_area(a, b, point) / area;
  return {1 - at_b - at_c, at_b, at_c};
}

Points2 rows_of(const Polygon& points) {
  Points2 rows(static_cast<Eigen::Index>(points.size()), 2);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) rows.row(i) = points[at(i)].transpose();
  return rows;
}

Triangles rows_of(const std::vector<mesh::EditableTriangulation::Triangle>& triangles) {
  Triangles rows(static_cast<Eigen::Index>(triangles.size()), 3);
  for (Eigen::Index f = 0; f < rows.rows(); ++f) {
    const auto [a, b, c] = triangles[at(f)];
    rows.row(f) << a, b, c;
  }
  return rows;
}

Polygon points_of(const Points2& rows) {
  Polygon points;
  for (const auto& row : rows.rowwise()) points.emplace_back(row);
  return points;
}

std::vector<double> lengths_along(const mesh::RefinedSurface& surface,
                                  const std::vector<VertexId>& chain) {
  std::vector<Vector3> places;
  for (const VertexId v : chain) places.push_back(surface.position[at(v)]);
  return lengths_along(places);
}

std::vector<double> numbers_of(const Polygon& points) {
  std::vector<double> numbers;
  for (const Vector2& p : points) numbers.insert(numbers.end(), {p.x(), p.y()});
  return numbers;
}

void throw_contradiction(const std::string& message, Witness witness,
                         std::vector<VertexId> vertices) {
  throw_infeasible(ErrorCode::kContradictoryPins, message, std::move(witness), ElementKind::kVertex,
                   std::move(vertices));
}

namespace {

std::string vertex_name(VertexId v) { return "vertex " + vertex_id(v); }

// It has the inside of its image on the side on which the surface is enclosed.
void refuse_reversed_line(const mesh::EditableTriangulation& mesh,
                          const std::vector<VertexId>& chain, const Polygon& polyline) {
  if (polyline.front() != polyline.back()) return;  // a vertex with two targets
  const Polygon corners(polyline.begin(), polyline.end() - 1);
  const int turns = corners.size() < 3 ? 0 : embedding::turning_number(rows_of(corners));
  if (turns != 1 && turns != -1) return;  // lines that cross are named later
  std::vector<char> wall(at(mesh.halfedge_slots()), 0);
  FaceId left = kInvalid;
  for (std::size_t i = 1; i < chain.size(); ++i) {
    const HalfedgeId h = mesh.find(chain[i - 1], chain[i]);
    if (left == kInvalid && mesh.source(h) == chain[i - 1]) left = h / 3;
    wall[at(h)] = 1;
    if (!mesh.is_boundary(h)) wall[at(mesh.opposite(h))] = 1;
  }
  DisjointSets parts(mesh.face_slots());
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (wall[at(h)] == 0 && !mesh.is_boundary(h)) parts.join(h / 3, mesh.opposite(h) / 3);
  }
  bool enclosed = left != kInvalid;  // a boundary loop walked backwards has nothing on its left
  for (HalfedgeId h = 0; enclosed && h < mesh.halfedge_slots(); ++h)
    enclosed = wall[at(h)] != 0 || !mesh.is_boundary(h) || parts.find(h / 3) != parts.find(left);
  if (enclosed == (turns == 1)) return;
  throw_contradiction(
      "The closed line through " + vertex_name(chain[0]) + " and " + vertex_name(chain[1]) +
          " runs the other way round in the map than on the mesh: every map that "
          "meets it is turned over. Reverse its points, or its vertices.",
      {"closed line", {{"polygon", numbers_of(corners)}, {"encloses", {enclosed ? 1.0 : 0.0}}}},
      {chain.begin(), chain.end() - 1});
}

class Reader {
 public:
  Reader(mesh::RefinedSurface& surface, const MatchRequest& request, SelfOverlaps overlaps)
      : surface_(surface), request_(request), overlaps_(overlaps) {}

  Constraints read() {
    read_boundary();
    for (const PinnedVertex& p : request_.points) {
      check_vertex(p.vertex);
      pin(p.vertex, p.uv);
    }
    for (const PinnedLine& line : request_.lines) read_line(line);
    read_paths();
    read_movable();
    for (const auto& [vertex, uv] : target_) {
      if (!on_boundary_.contains(vertex)) result_.pins.push_back({vertex, uv});
    }
    check_outline();
    check_distinct();
    check_inside();
    check_lines();
    return std::move(result_);
  }

 private:
  void check_vertex(VertexId v) const {
    const bool exists = v >= 0 && v < surface_.input_vertices();
    if (exists && surface_.mesh.outgoing(v) != kInvalid) return;
    throw_invalid(ErrorCode::kIndexOutOfRange,
                  "A constraint names " + vertex_name(v) +
                      (exists ? ", which belongs to no face." : ", which does not exist.") +
                      " Name vertices of the mesh.",
                  exists ? ElementKind::kVertex : ElementKind::kNone,
                  exists ? std::vector<VertexId>{v} : std::vector<VertexId>{});
  }

  // A target beyond what is stored can be met by no map, and exact predicates need finite sums.
  // A vertex that a line has added is named by no caller.
  void check_storable(const std::string& where, VertexId v, const Vector2& uv) const {
    if (is_storable(uv)) return;
    const bool own = v < surface_.input_vertices();
    throw_invalid(ErrorCode::kNotFinite,
                  "The target of " + where + (own ? vertex_name(v) : "a vertex that a line adds") +
                      " is not finite, or beyond 3.4e38, the largest number that UVs can store. "
                      "Correct it, or scale all targets down.",
                  ElementKind::kVertex, own ? std::vector<VertexId>{v} : std::vector<VertexId>{});
  }

  void check_edge(const std::string& what, VertexId a, VertexId b) const {
    if (surface_.mesh.find(a, b) != kInvalid) return;
    throw_invalid(ErrorCode::kNotAnEdge,
                  what + " runs from " + vertex_name(a) + " to " + vertex_name(b) +
                      ", which no edge joins. List vertices along edges.",
                  ElementKind::kVertex, {a, b});
  }

  void check_chain(const std::string& what, const std::vector<VertexId>& chain) const {
    for (std::size_t i = 0; i < chain.size(); ++i) {
      check_vertex(chain[i]);
      if (i > 0) check_edge(what, chain[i - 1], chain[i]);
    }
  }

  void read_boundary() {
    if (request_.boundary_uv.empty()) {
      if (!request_.boundary_loop.empty()) {
        throw_invalid(ErrorCode::kBadBoundary,
                      "boundary_loop is given without boundary_uv. Give both, or neither.");
      }
      return;
    }
    const std::vector<VertexId>& loop = surface_.boundary;
    const std::size_t n = loop.size();
    if (request_.boundary_uv.size() != n ||
        (!request_.boundary_loop.empty() && request_.boundary_loop.size() != n)) {
      throw_invalid(ErrorCode::kBadBoundary,
                    "The boundary has " + std::to_string(n) +
                        " vertices; boundary_uv and boundary_loop must have as many.");
    }
    result_.outline.resize(n);
    if (request_.boundary_loop.empty()) {
      result_.outline = request_.boundary_uv;
    } else {
      const auto found = std::find(loop.begin(), loop.end(), request_.boundary_loop.front());
      const std::size_t start = at(found - loop.begin());
      const auto follows = [&](std::size_t step) {
        for (std::size_t i = 0; i < n; ++i) {
          if (loop[(start + i * step) % n] != request_.boundary_loop[i]) return false;
        }
        return true;
      };
      const bool ahead = found != loop.end() && follows(1);
      if (found == loop.end() || (!ahead && !follows(n - 1))) {
        throw_invalid(
            ErrorCode::kBadBoundary,
            "boundary_loop is not the mesh's boundary in order. List every boundary vertex once, "
            "each followed by its neighbour.");
      }
      for (std::size_t i = 0; i < n; ++i) {
        result_.outline[(start + i * (ahead ? 1 : n - 1)) % n] = request_.boundary_uv[i];
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      on_boundary_.insert(loop[i]);
      target_.emplace(loop[i], result_.outline[i]);
      check_storable("boundary ", loop[i], result_.outline[i]);
      if (result_.outline[i] == result_.outline[(i + 1) % n]) {
        throw_contradiction("Neighbouring boundary vertices " + vertex_id(loop[i]) + " and " +
                                vertex_id(loop[(i + 1) % n]) +
                                " have the same target. Move one of them.",
                            {"same place", {{"place", numbers_of({result_.outline[i]})}}},
                            {loop[i], loop[(i + 1) % n]});
      }
    }
  }

  void pin(VertexId v, const Vector2& uv) {
    check_storable("", v, uv);
    const auto [known, fresh] = target_.emplace(v, uv);
    if (!fresh && known->second != uv) {
      throw_contradiction(
          "Two different targets are given for " + vertex_name(v) + ". Keep one of them.",
          {"two places", {{"places", numbers_of({known->second, uv})}}}, {v});
    }
  }

  void read_line(const PinnedLine& line) {
    std::vector<VertexId> chain = line.vertices;
    const std::size_t points = line.polyline.size();
    if (chain.size() < 2 || points < 2) {
      throw_invalid(ErrorCode::kBadPins, "A line needs at least two vertices and two points.");
    }
    check_chain("A line", chain);
    if (chain.front() == chain.back()) refuse_reversed_line(surface_.mesh, chain, line.polyline);
    while (chain.size() < points) split_longest(chain);
    const std::vector<std::size_t> corner = assign_corners(chain, line.polyline);
    const std::vector<double> along = lengths_along(surface_, chain);
    for (std::size_t j = 0; j < points; ++j) {
      pin(chain[corner[j]], line.polyline[j]);
      if (j == 0) continue;
      for (std::size_t i = corner[j - 1] + 1; i < corner[j]; ++i) {
        const double t =
            (along[i] - along[corner[j - 1]]) / (along[corner[j]] - along[corner[j - 1]]);
        pin(chain[i], line.polyline[j - 1] + t * (line.polyline[j] - line.polyline[j - 1]));
      }
    }
    for (std::size_t i = 0; i + 1 < chain.size(); ++i)
      result_.edges.emplace_back(chain[i], chain[i + 1]);
  }

  void split_longest(std::vector<VertexId>& chain) {
    const std::vector<double> along = lengths_along(surface_, chain);
    std::size_t longest = 0;
    for (std::size_t i = 0; i + 1 < along.size(); ++i) {
      if (along[i + 1] - along[i] > along[longest + 1] - along[longest]) longest = i;
    }
    const VertexId s = surface_.split_edge(surface_.mesh.find(chain[longest], chain[longest + 1]));
    chain.insert(chain.begin() + static_cast<std::ptrdiff_t>(longest) + 1, s);
  }

  // Place in the chain of every point of the polyline, increasing, by relative length.
  std::vector<std::size_t> assign_corners(const std::vector<VertexId>& chain,
                                          const Polygon& polyline) const {
    const std::vector<double> along = lengths_along(surface_, chain);
    const std::vector<double> share = lengths_along(polyline);
    std::vector<std::size_t> corner = {0};
    for (std::size_t j = 1; j + 1 < polyline.size(); ++j) {
      const double wanted = share[j] / share.back() * along.back();
      std::size_t i = corner.back() + 1;
      const std::size_t last = chain.size() - (polyline.size() - j);
      while (i < last && std::abs(along[i + 1] - wanted) < std::abs(along[i] - wanted)) ++i;
      corner.push_back(i);
    }
    corner.push_back(chain.size() - 1);
    return corner;
  }

  void read_paths() {
    for (const std::vector<VertexId>& path : request_.paths) {
      check_chain("A path", path);
      if (path.size() < 2 || !target_.contains(path.front()) ||
          on_boundary_.contains(path.front()) || !on_boundary_.contains(path.back())) {
        throw_invalid(ErrorCode::kBadPins,
                      "A path must run from a pinned inner vertex to the boundary, whose targets "
                      "must be given.",
                      ElementKind::kVertex, path);
      }
      result_.paths.push_back(path);
    }
  }

  void read_movable() {
    for (const VertexId v : request_.movable) {
      check_vertex(v);
      if (!on_boundary_.contains(v)) {
        throw_invalid(ErrorCode::kBadPins,
                      "Movable " + vertex_name(v) +
                          " has no target on the boundary. Name boundary vertices, and give "
                          "boundary_uv, where they begin.",
                      ElementKind::kVertex, {v});
      }
      const auto is_end = [&](const auto& edge) { return edge.first == v || edge.second == v; };
      const bool pinned = std::any_of(request_.points.begin(), request_.points.end(),
                                      [&](const PinnedVertex& p) { return p.vertex == v; }) ||
                          std::any_of(result_.edges.begin(), result_.edges.end(), is_end);
      if (pinned) {
        throw_contradiction("Vertex " + vertex_id(v) + " is pinned and movable. Choose one.",
                            {"pinned and movable", {}}, {v});
      }
      result_.movable.push_back(v);
    }
    std::sort(result_.movable.begin(), result_.movable.end());
  }

  void check_outline() {
    if (result_.free_boundary()) return;
    result_.turning_number = embedding::turning_number(rows_of(result_.outline));
    const auto conflict = first_conflict(result_.outline);
    result_.simple_outline = !conflict;
    if (result_.turning_number == -1 && !conflict) {
      throw_contradiction(
          "The boundary's targets run clockwise, against the surface's orientation: every map onto "
          "them is turned over. Mirror the targets, or reverse their order.",
          {"turning number", {{"polygon", numbers_of(result_.outline)}}}, {});
    }
    if (result_.turning_number < 1) {
      std::vector<VertexId> elements;
      std::string example;
      if (conflict) {
        elements = {surface_.boundary[at(conflict->first)],
                    surface_.boundary[at(conflict->second)]};
        example = ", for instance after vertices " + vertex_id(elements[0]) + " and " +
                  vertex_id(elements[1]);
      }
      throw_infeasible(
          ErrorCode::kNotSelfOverlapping,
          "The boundary's targets form a polygon with turning number " +
              std::to_string(result_.turning_number) +
              "; the outline of a flip-free map turns at least once counter-clockwise. It crosses "
              "itself as a figure-eight does" +
              example + ".",
          {"turning number", {{"polygon", numbers_of(result_.outline)}}}, ElementKind::kVertex,
          elements);
    }
  }

  [[noreturn]] void contradict(const std::string& message, Witness witness,
                               std::vector<VertexId> vertices) const {
    if (overlaps_ == SelfOverlaps::kAllowed && result_.free_boundary()) {
      throw_not_converged(
          ErrorCode::kContradictoryPins,
          message + " (A map that overlaps itself might do it; none is looked for.)",
          ElementKind::kVertex, std::move(vertices));
    }
    throw_contradiction(message, std::move(witness), std::move(vertices));
  }

  // No two vertices at one point, except boundary vertices of a target that overlaps itself.
  // (There insert_pin() looks further.)
  void check_distinct() const {
    if (!result_.simple_outline) return;
    std::vector<PinnedVertex> all = result_.pins;
    for (std::size_t i = 0; i < result_.outline.size(); ++i)
      all.push_back({surface_.boundary[i], result_.outline[i]});
    // Equal as stored is equal, but for neighbours on a dense boundary, which rounding can part.
    const auto key = [](const PinnedVertex& p) {
      return std::make_tuple(static_cast<float>(p.uv.x()), static_cast<float>(p.uv.y()), p.uv.x(),
                             p.uv.y(), p.vertex);
    };
    std::sort(all.begin(), all.end(),
              [&](const PinnedVertex& a, const PinnedVertex& b) { return key(a) < key(b); });
    for (std::size_t i = 0; i + 1 < all.size(); ++i) {
      const auto& [a, p] = all[i];
      const auto& [b, q] = all[i + 1];
      const bool outline = on_boundary_.contains(a) && on_boundary_.contains(b);
      if (outline ? p != q : p.cast<float>() != q.cast<float>()) continue;
      contradict("Vertices " + vertex_id(a) + " and " + vertex_id(b) +
                     " are pinned to the same point. Move or release one of them.",
                 {"same place", {{"place", numbers_of({p})}}}, {a, b});
    }
  }

  const Vector2& target(VertexId v) const { return target_.at(v); }

  using Edge = std::pair<VertexId, VertexId>;
  [[noreturn]] void refuse_meeting(const Edge& line, const Edge& other, const char* what,
                                   const char* cure) const {
    const auto& [a, b] = line;
    const auto& [c, d] = other;
    throw_contradiction(
        "The line through vertices " + vertex_id(a) + ", " + vertex_id(b) + " crosses " + what +
            " vertices " + vertex_id(c) + ", " + vertex_id(d) + cure,
        {"segments meet", {{"segments", numbers_of({target(a), target(b), target(c), target(d)})}}},
        {a, b, c, d});
  }

  void check_inside() const {
    if (result_.free_boundary() || !result_.simple_outline) return;
    for (const PinnedVertex& p : result_.pins) {
      if (locate_in_polygon(result_.outline, p.uv) > 0) continue;
      throw_contradiction(
          "Inner vertex " + vertex_id(p.vertex) +
              " is pinned outside the boundary's targets, or onto them. Move it inside.",
          {"outside", {{"place", numbers_of({p.uv})}, {"polygon", numbers_of(result_.outline)}}},
          {p.vertex});
    }
  }

  // Lines meet each other, pins and the outline in shared vertices only.
  void check_lines() const {
    if (!result_.simple_outline) return;  // they may cross on different sheets
    const auto& edges = result_.edges;
    const std::size_t n = result_.outline.size();
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const auto& [a, b] = edges[i];
      const auto meets = [&](const Vector2& p, const Vector2& q) {
        return numeric::segments_conflict(target(edges[i].first), target(edges[i].second), p, q);
      };
      for (std::size_t j = 0; j < i; ++j) {
        if (meets(target(edges[j].first), target(edges[j].second)))
          refuse_meeting(edges[i], edges[j], "the one through",
                         ". Lines of the mesh that do not meet may not meet in the map.");
      }
      for (const PinnedVertex& p : result_.pins) {
        if (!meets(p.uv, p.uv)) continue;
        contradict(
            "Vertex " + vertex_id(p.vertex) + " is pinned onto the line through vertices " +
                vertex_id(a) + ", " + vertex_id(b) + ". Move it off the line.",
            {"segments meet", {{"segments", numbers_of({target(a), target(b), p.uv, p.uv})}}},
            {p.vertex, a, b});
      }
      for (std::size_t k = 0; k < n; ++k) {
        const Edge side(surface_.boundary[k], surface_.boundary[(k + 1) % n]);
        const bool along = edges[i] == side || edges[i] == Edge(side.second, side.first);
        if (!along && meets(result_.outline[k], result_.outline[(k + 1) % n]))
          refuse_meeting(edges[i], side, "the boundary's targets at", ".");
      }
    }
  }

  mesh::RefinedSurface& surface_;
  const MatchRequest& request_;
  SelfOverlaps overlaps_;
  Constraints result_;
  std::map<VertexId, Vector2> target_;  // pins, and the outline's
  std::set<VertexId> on_boundary_;      // of a prescribed outline
};

}  // namespace

Constraints read_constraints(mesh::RefinedSurface& surface, const MatchRequest& request,
                             SelfOverlaps overlaps) {
  return Reader(surface, request, overlaps).read();
}

std::vector<VertexId> held_vertices(const mesh::RefinedSurface& surface,
                                    const Constraints& constraints) {
  std::vector<VertexId> held;
  for (const PinnedVertex& p : constraints.pins) held.push_back(p.vertex);
  if (!constraints.free_boundary())
    held.insert(held.end(), surface.boundary.begin(), surface.boundary.end());
  std::sort(held.begin(), held.end());
  return held;
}

Constraints outline_alone(const Constraints& constraints) {
  Constraints outline;
  outline.outline = constraints.outline;
  outline.turning_number = constraints.turning_number;
  outline.simple_outline = constraints.simple_outline;
  return outline;
}

}  // namespace flipfree::matchmaker
