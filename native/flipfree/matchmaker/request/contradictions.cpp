#include "flipfree/matchmaker/request/contradictions.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

class Checker {
 public:
  Checker(const mesh::RefinedSurface& surface, SelfOverlaps overlaps, Constraints& constraints)
      : surface_(surface), overlaps_(overlaps), result_(constraints) {
    for (const PinnedVertex& p : constraints.pins) pins_.emplace(p.vertex, p.uv);
    if (constraints.free_boundary()) return;
    for (std::size_t i = 0; i < surface.boundary.size(); ++i)
      on_boundary_.emplace(surface.boundary[i], i);
  }

  void run() {
    check_outline();
    check_distinct();
    check_lines();
    check_inside();
  }

 private:
  void check_outline() {
    if (result_.free_boundary()) return;
    result_.turning_number = turning_number(result_.outline);
    const auto conflict = first_conflict(result_.outline);
    result_.simple_outline = !conflict;
    const std::string turns = std::to_string(result_.turning_number);
    if (result_.turning_number == -1 && !conflict) {
      throw_infeasible(ErrorCode::kContradictoryPins,
                       "The boundary's targets run clockwise, against the surface's orientation: "
                       "every map onto them "
                       "is turned over. Mirror the targets, or reverse their order.",
                       {"turning number", {{"polygon", numbers_of(result_.outline)}}},
                       ElementKind::kVertex, {});
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
              (conflict ? ", for instance after vertices " + std::to_string(elements[0]) + " and " +
                              std::to_string(elements[1])
                        : std::string()) +
              ".",
          {"turning number", {{"polygon", numbers_of(result_.outline)}}}, ElementKind::kVertex,
          elements);
    }
  }
  VertexId at_loop(Index i) const { return surface_.boundary[static_cast<std::size_t>(i)]; }

  [[noreturn]] void contradict(const std::string& message, Witness witness,
                               std::vector<VertexId> vertices) const {
    if (overlaps_ == SelfOverlaps::kAllowed && result_.free_boundary()) {
      throw_not_converged(
          ErrorCode::kContradictoryPins,
          message + " (A map that overlaps itself might do it; none is looked for.)",
          ElementKind::kVertex, std::move(vertices));
    }
    throw_infeasible(ErrorCode::kContradictoryPins, message, std::move(witness),
                     ElementKind::kVertex, std::move(vertices));
  }

  // No two vertices at one point, except boundary vertices of a target that overlaps itself.
  // (There sheet_target() looks further.)
  void check_distinct() const {
    if (!result_.simple_outline) return;
    std::vector<PinnedVertex> all = result_.pins;
    if (result_.simple_outline) {
      for (std::size_t i = 0; i < result_.outline.size(); ++i)
        all.push_back({surface_.boundary[i], result_.outline[i]});
    }
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
      contradict("Vertices " + std::to_string(all[i].vertex) + " and " +
                     std::to_string(all[i + 1].vertex) +
                     " are pinned to the same point. Move or release one of them.",
                 {"same place", {{"place", numbers_of({all[i].uv})}}},
                 {all[i].vertex, all[i + 1].vertex});
    }
  }

  const Vector2& target(VertexId v) const {
    const auto boundary = on_boundary_.find(v);
    return boundary != on_boundary_.end() ? result_.outline[boundary->second] : pins_.at(v);
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
        throw_infeasible(
            ErrorCode::kContradictoryPins,
            "The line through vertices " + std::to_string(edges[i].first) + ", " +
                std::to_string(edges[i].second) + " crosses the one through vertices " +
                std::to_string(edges[j].first) + ", " + std::to_string(edges[j].second) +
                ". Lines of the mesh that do not meet may not meet in the map.",
            {"segments meet",
             {{"segments", numbers_of({a, b, target(edges[j].first), target(edges[j].second)})}}},
            ElementKind::kVertex,
            {edges[i].first, edges[i].second, edges[j].first, edges[j].second});
      }
      for (const PinnedVertex& p : result_.pins) {
        if (!numeric::segments_conflict(a, b, p.uv, p.uv)) continue;
        contradict("Vertex " + std::to_string(p.vertex) +
                       " is pinned onto the line through vertices " +
                       std::to_string(edges[i].first) + ", " + std::to_string(edges[i].second) +
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
      throw_infeasible(
          ErrorCode::kContradictoryPins,
          "Inner vertex " + std::to_string(p.vertex) +
              " is pinned outside the boundary's targets, or onto them. Move it inside.",
          {"outside", {{"place", numbers_of({p.uv})}, {"polygon", numbers_of(result_.outline)}}},
          ElementKind::kVertex, {p.vertex});
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
        throw_infeasible(ErrorCode::kContradictoryPins,
                         "The line through vertices " + std::to_string(a) + ", " +
                             std::to_string(b) + " crosses the boundary's targets at vertices " +
                             std::to_string(c) + ", " + std::to_string(d) + ".",
                         {"segments meet",
                          {{"segments", numbers_of({target(a), target(b), result_.outline[i],
                                                    result_.outline[(i + 1) % n]})}}},
                         ElementKind::kVertex, {a, b, c, d});
      }
    }
  }

  const mesh::RefinedSurface& surface_;
  SelfOverlaps overlaps_;
  Constraints& result_;
  std::map<VertexId, Vector2> pins_;
  std::map<VertexId, std::size_t> on_boundary_;
};

}  // namespace

std::string vertex_name(VertexId v) { return "vertex " + std::to_string(v); }

void refuse_contradictions(const mesh::RefinedSurface& surface, SelfOverlaps overlaps,
                           Constraints& constraints) {
  Checker(surface, overlaps, constraints).run();
}

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
    wall[static_cast<std::size_t>(h)] = 1;
    if (!mesh.is_boundary(h)) wall[static_cast<std::size_t>(mesh.opposite(h))] = 1;
  }
  std::vector<char> seen(static_cast<std::size_t>(mesh.halfedge_slots() / 3), 0);
  bool enclosed = !stack.empty();  // a boundary loop walked backwards has nothing on its left
  while (!stack.empty() && enclosed) {
    const FaceId f = stack.back();
    stack.pop_back();
    if (seen[static_cast<std::size_t>(f)] != 0) continue;
    seen[static_cast<std::size_t>(f)] = 1;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (wall[static_cast<std::size_t>(h)] != 0) continue;
      if (mesh.is_boundary(h)) {
        enclosed = false;
      } else {
        stack.push_back(mesh.opposite(h) / 3);
      }
    }
  }
  if (enclosed == (turns == 1)) return;
  throw_infeasible(
      ErrorCode::kContradictoryPins,
      "The closed line through " + vertex_name(chain[0]) + " and " + vertex_name(chain[1]) +
          " runs the other way round in the map than on the mesh: every map that "
          "meets it is turned over. Reverse its points, or its vertices.",
      {"closed line", {{"polygon", numbers_of(corners)}, {"encloses", {enclosed ? 1.0 : 0.0}}}},
      ElementKind::kVertex, {chain.begin(), chain.end() - 1});
}

}  // namespace flipfree::matchmaker
