#include "flipfree/matchmaker/request/request.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {

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
  const int turns = corners.size() < 3 ? 0 : turning_number(corners);
  if (turns != 1 && turns != -1) return;  // lines that cross are named later
  std::vector<char> wall(static_cast<std::size_t>(mesh.halfedge_slots()), 0);
  std::vector<FaceId> stack;  // what can be reached on the left of the chain
  for (std::size_t i = 1; i < chain.size(); ++i) {
    const HalfedgeId h = mesh.find(chain[i - 1], chain[i]);
    if (stack.empty() && mesh.source(h) == chain[i - 1]) stack.push_back(h / 3);
    wall[at(h)] = 1;
    if (!mesh.is_boundary(h)) wall[at(mesh.opposite(h))] = 1;
  }
  std::vector<char> seen(static_cast<std::size_t>(mesh.halfedge_slots() / 3), 0);
  bool enclosed = !stack.empty();  // a boundary loop walked backwards has nothing on its left
  while (!stack.empty() && enclosed) {
    const FaceId f = stack.back();
    stack.pop_back();
    if (seen[at(f)] != 0) continue;
    seen[at(f)] = 1;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (wall[at(h)] != 0) continue;
      if (mesh.is_boundary(h)) {
        enclosed = false;
      } else {
        stack.push_back(mesh.opposite(h) / 3);
      }
    }
  }
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
    for (const PinnedVertex& p : request_.points) pin(p.vertex, p.uv);
    for (const PinnedLine& line : request_.lines) read_line(line);
    read_paths();
    read_movable();
    for (const auto& [vertex, uv] : pins_) result_.pins.push_back({vertex, uv});
    check_outline();
    check_distinct();
    check_lines();
    check_inside();
    return std::move(result_);
  }

 private:
  void check_vertex(VertexId v) const {
    if (v < 0 || v >= surface_.input_vertices()) {
      throw_invalid(ErrorCode::kIndexOutOfRange,
                    "A constraint names " + vertex_name(v) +
                        ", which does not exist. Name vertices of the mesh.");
    }
    if (surface_.mesh.outgoing(v) == kInvalid) {
      throw_invalid(ErrorCode::kIndexOutOfRange,
                    "A constraint names " + vertex_name(v) +
                        ", which belongs to no face. Name vertices of the mesh.",
                    ElementKind::kVertex, {v});
    }
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
      const auto at = std::find(loop.begin(), loop.end(), request_.boundary_loop.front());
      const auto start = static_cast<std::size_t>(at - loop.begin());
      const auto follows = [&](std::size_t step) {
        for (std::size_t i = 0; i < n; ++i) {
          if (loop[(start + i * step) % n] != request_.boundary_loop[i]) return false;
        }
        return true;
      };
      const bool ahead = at != loop.end() && follows(1);
      if (at == loop.end() || (!ahead && !follows(n - 1))) {
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
      on_boundary_.emplace(loop[i], i);
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

  void pin(VertexId v, const Vector2& uv, bool added = false) {
    if (!added) check_vertex(v);
    check_storable("", v, uv);
    const auto boundary = on_boundary_.find(v);
    const Vector2* known = nullptr;
    if (boundary != on_boundary_.end()) {
      known = &result_.outline[boundary->second];
    } else {
      const auto [it, fresh] = pins_.emplace(v, uv);
      if (!fresh) known = &it->second;
    }
    if (known != nullptr && *known != uv) {
      throw_contradiction(
          "Two different targets are given for " + vertex_name(v) + ". Keep one of them.",
          {"two places", {{"places", numbers_of({*known, uv})}}}, {v});
    }
  }

  void read_line(const PinnedLine& line) {
    std::vector<VertexId> chain = line.vertices;
    const std::size_t points = line.polyline.size();
    if (chain.size() < 2 || points < 2) {
      throw_invalid(ErrorCode::kBadPins, "A line needs at least two vertices and two points.");
    }
    for (std::size_t i = 0; i < chain.size(); ++i) {
      check_vertex(chain[i]);
      if (i > 0) check_edge("A line", chain[i - 1], chain[i]);
    }
    if (chain.front() == chain.back()) refuse_reversed_line(surface_.mesh, chain, line.polyline);
    while (chain.size() < points) split_longest(chain);
    const std::vector<std::size_t> corner = assign_corners(chain, line.polyline);
    std::vector<double> along = lengths(chain);
    for (std::size_t j = 0; j < points; ++j) {
      pin(chain[corner[j]], line.polyline[j], chain[corner[j]] >= surface_.input_vertices());
      if (j == 0) continue;
      for (std::size_t i = corner[j - 1] + 1; i < corner[j]; ++i) {
        const double t =
            (along[i] - along[corner[j - 1]]) / (along[corner[j]] - along[corner[j - 1]]);
        const Vector2 uv = line.polyline[j - 1] + t * (line.polyline[j] - line.polyline[j - 1]);
        pin(chain[i], uv, chain[i] >= surface_.input_vertices());
      }
    }
    for (std::size_t i = 0; i + 1 < chain.size(); ++i)
      result_.edges.emplace_back(chain[i], chain[i + 1]);
  }

  std::vector<double> lengths(const std::vector<VertexId>& chain) const {
    std::vector<double> along = {0.0};
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
      along.push_back(
          along.back() +
          (surface_.position[at(chain[i + 1])] - surface_.position[at(chain[i])]).norm());
    }
    return along;
  }

  void split_longest(std::vector<VertexId>& chain) {
    const std::vector<double> along = lengths(chain);
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
    const std::vector<double> along = lengths(chain);
    std::vector<double> at = {0.0};
    for (std::size_t j = 0; j + 1 < polyline.size(); ++j) {
      at.push_back(at.back() + (polyline[j + 1] - polyline[j]).norm());
    }
    std::vector<std::size_t> corner = {0};
    for (std::size_t j = 1; j + 1 < polyline.size(); ++j) {
      const double wanted = at[j] / at.back() * along.back();
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
      for (std::size_t i = 0; i < path.size(); ++i) {
        check_vertex(path[i]);
        if (i > 0) check_edge("A path", path[i - 1], path[i]);
      }
      const bool pinned = path.size() >= 2 && pins_.count(path.front()) > 0;
      if (!pinned || on_boundary_.count(path.back()) == 0) {
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
      if (on_boundary_.count(v) == 0) {
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
    result_.turning_number = turning_number(result_.outline);
    const auto conflict = first_conflict(result_.outline);
    result_.simple_outline = !conflict;
    const std::string turns = std::to_string(result_.turning_number);
    if (result_.turning_number == -1 && !conflict) {
      throw_contradiction(
          "The boundary's targets run clockwise, against the surface's orientation: "
          "every map onto them "
          "is turned over. Mirror the targets, or reverse their order.",
          {"turning number", {{"polygon", numbers_of(result_.outline)}}}, {});
    }
    if (result_.turning_number < 1) {
      std::vector<VertexId> elements;
      if (conflict) elements = {at_loop(conflict->first), at_loop(conflict->second)};
      throw_infeasible(
          ErrorCode::kNotSelfOverlapping,
          "The boundary's targets form a polygon with turning number " + turns +
              "; the outline of a flip-free map turns at least once counter-clockwise. It crosses "
              "itself "
              "as a figure-eight does" +
              (conflict ? ", for instance after vertices " + vertex_id(elements[0]) + " and " +
                              vertex_id(elements[1])
                        : std::string()) +
              ".",
          {"turning number", {{"polygon", numbers_of(result_.outline)}}}, ElementKind::kVertex,
          elements);
    }
  }
  VertexId at_loop(Index i) const { return surface_.boundary[at(i)]; }

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
  // (There sheet_target() looks further.)
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
      const bool outline =
          on_boundary_.count(all[i].vertex) != 0 && on_boundary_.count(all[i + 1].vertex) != 0;
      const bool same = outline ? all[i].uv == all[i + 1].uv
                                : all[i].uv.cast<float>() == all[i + 1].uv.cast<float>();
      if (!same) continue;
      contradict("Vertices " + vertex_id(all[i].vertex) + " and " + vertex_id(all[i + 1].vertex) +
                     " are pinned to the same point. Move or release one of them.",
                 {"same place", {{"place", numbers_of({all[i].uv})}}},
                 {all[i].vertex, all[i + 1].vertex});
    }
  }

  const Vector2& target(VertexId v) const {
    const auto boundary = on_boundary_.find(v);
    return boundary != on_boundary_.end() ? result_.outline[boundary->second] : pins_.at(v);
  }

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

  // Lines meet each other and pins in shared vertices only.
  void check_lines() const {
    if (!result_.simple_outline) return;  // they may cross on different sheets
    const auto& edges = result_.edges;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const Vector2& a = target(edges[i].first);
      const Vector2& b = target(edges[i].second);
      for (std::size_t j = 0; j < i; ++j) {
        if (!numeric::segments_conflict(a, b, target(edges[j].first), target(edges[j].second)))
          continue;
        refuse_meeting(edges[i], edges[j], "the one through",
                       ". Lines of the mesh that do not meet may not meet in the map.");
      }
      for (const PinnedVertex& p : result_.pins) {
        if (!numeric::segments_conflict(a, b, p.uv, p.uv)) continue;
        contradict("Vertex " + vertex_id(p.vertex) + " is pinned onto the line through vertices " +
                       vertex_id(edges[i].first) + ", " + vertex_id(edges[i].second) +
                       ". Move it off the line.",
                   {"segments meet", {{"segments", numbers_of({a, b, p.uv, p.uv})}}},
                   {p.vertex, edges[i].first, edges[i].second});
      }
    }
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
    const std::size_t n = result_.outline.size();
    for (const auto& [a, b] : result_.edges) {
      for (std::size_t i = 0; i < n; ++i) {
        if (!numeric::segments_conflict(target(a), target(b), result_.outline[i],
                                        result_.outline[(i + 1) % n]))
          continue;
        const VertexId c = surface_.boundary[i];
        const VertexId d = surface_.boundary[(i + 1) % n];
        if ((a == c && b == d) || (a == d && b == c)) continue;
        refuse_meeting({a, b}, {c, d}, "the boundary's targets at", ".");
      }
    }
  }

  mesh::RefinedSurface& surface_;
  const MatchRequest& request_;
  SelfOverlaps overlaps_;
  Constraints result_;
  std::map<VertexId, Vector2> pins_;
  std::map<VertexId, std::size_t> on_boundary_;
};

}  // namespace

Constraints read_constraints(mesh::RefinedSurface& surface, const MatchRequest& request,
                             SelfOverlaps overlaps) {
  return Reader(surface, request, overlaps).read();
}

}  // namespace flipfree::matchmaker
