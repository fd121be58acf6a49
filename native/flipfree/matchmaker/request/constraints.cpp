#include "flipfree/matchmaker/request/constraints.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/matchmaker/request/contradictions.h"

namespace flipfree::matchmaker {
namespace {

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
    refuse_contradictions(surface_, overlaps_, result_);
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
        throw_infeasible(ErrorCode::kContradictoryPins,
                         "Neighbouring boundary vertices " + std::to_string(loop[i]) + " and " +
                             std::to_string(loop[(i + 1) % n]) +
                             " have the same target. Move one of them.",
                         {"same place", {{"place", numbers_of({result_.outline[i]})}}},
                         ElementKind::kVertex, {loop[i], loop[(i + 1) % n]});
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
      throw_infeasible(
          ErrorCode::kContradictoryPins,
          "Two different targets are given for " + vertex_name(v) + ". Keep one of them.",
          {"two places", {{"places", numbers_of({*known, uv})}}}, ElementKind::kVertex, {v});
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
      along.push_back(along.back() + (surface_.position[static_cast<std::size_t>(chain[i + 1])] -
                                      surface_.position[static_cast<std::size_t>(chain[i])])
                                         .norm());
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
        throw_infeasible(ErrorCode::kContradictoryPins,
                         "Vertex " + std::to_string(v) + " is pinned and movable. Choose one.",
                         {"pinned and movable", {}}, ElementKind::kVertex, {v});
      }
      result_.movable.push_back(v);
    }
    std::sort(result_.movable.begin(), result_.movable.end());
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
