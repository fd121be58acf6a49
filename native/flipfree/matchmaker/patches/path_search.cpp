#include "flipfree/matchmaker/patches/path_search.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <string>
#include <tuple>

#include "flipfree/base/error.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// What crossing an edge of the surface costs besides the way, as it adds a vertex: this share of
// the edge, and a bit that decides where all is too near to tell. It depends on the edge alone:
// then a path that enters a face twice, or turns back, is never shorter than the one that leaves
// the detour out, and hence does not get into its own way. (A price in proportion to the way makes
// paths go down a blind alley and back, as diagonals inside cells cost less.)
constexpr double kCrossingShare = 0.25;
constexpr double kCrossingCost = 1e-4;  // in units of the mean edge
constexpr int kVisitsPerCheck = 1 << 14;

double distance(const Vector3& a, const Vector3& b) { return (a - b).norm(); }

struct Entry {
  double distance;
  std::size_t node;
  bool operator>(const Entry& other) const {
    return std::tie(distance, node) > std::tie(other.distance, other.node);
  }
};

}  // namespace

PathSearch::PathSearch(const mesh::RefinedSurface& surface, const mesh::CurveOverlay& overlay,
                       const std::vector<bool>& taken)
    : surface_(surface),
      mesh_(surface.mesh),
      overlay_(overlay),
      taken_(taken),
      crossing_cost_(kCrossingCost * mean_length()) {}

// Of an edge.
double PathSearch::mean_length() const {
  double sum = 0;
  for (HalfedgeId h = 0; h < mesh_.halfedge_slots(); ++h) {
    if (mesh_.alive(h / 3)) sum += distance(place(h), place(next_corner(h)));
  }
  return sum / static_cast<double>(std::max(mesh_.halfedge_slots(), Index{1}));
}

// Where a corner lies.
const Vector3& PathSearch::place(HalfedgeId corner) const {
  return surface_.position[at(mesh_.source(corner))];
}
// Where a path crosses the edge of h.
Vector3 PathSearch::crossing(HalfedgeId h) const {
  return 0.5 * (place(h) + place(next_corner(h)));
}

// Of a step from `here` across h.
double PathSearch::cost(HalfedgeId h, const Vector3& here) const {
  const double way = distance(here, crossing(h));
  if (!overlay_.on_base_edge(h)) return way;
  return way + kCrossingShare * distance(place(h), place(next_corner(h))) + crossing_cost_;
}

std::vector<PathStep> PathSearch::run(const PathEnd& from_end, const PathEnd& to_end,
                                      const ExecutionContext& context) {
  const VertexId from = from_end.vertex, to = to_end.vertex;
  const std::vector<FaceId>&from_sector = from_end.sector, &to_sector = to_end.sector;
  const auto nodes = static_cast<std::size_t>(mesh_.vertex_count() + mesh_.halfedge_slots());
  if (distance_.size() < nodes) {
    distance_.resize(nodes + nodes / 4);
    previous_.resize(distance_.size());
    stamp_.resize(distance_.size(), 0);
  }
  ++now_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto offer = [&](std::size_t node, double distance, std::size_t previous) {
    if (stamp_[node] == now_ && distance_[node] <= distance) return;
    stamp_[node] = now_;
    distance_[node] = distance;
    previous_[node] = previous;
    queue.push({distance, node});
  };
  const auto in = [](const std::vector<FaceId>& faces, FaceId f) {
    return std::find(faces.begin(), faces.end(), f) != faces.end();
  };
  const auto free_vertex = [&](VertexId v) { return !taken_[at(v)]; };
  const auto free_edge = [&](HalfedgeId h) {
    return mesh_.mark(h) == Mesh::kUnmarked && !mesh_.is_boundary(h);
  };
  // May a step along the edge h, into its target, end the path? Both faces beside it must be in
  // the sector.
  const auto ends_along = [&](HalfedgeId h) {
    return mesh_.target(h) == to && mesh_.mark(h) == Mesh::kUnmarked && !mesh_.is_boundary(h) &&
           in(to_sector, h / 3) && in(to_sector, mesh_.opposite(h) / 3);
  };
  // Arcs out of vertex v within face f, h being the half-edge of f that leaves v.
  const auto relax_corner = [&](std::size_t node, double base, HalfedgeId h) {
    const HalfedgeId facing = next_corner(h);
    if (free_edge(facing)) {
      offer(edge_node(mesh_.opposite(facing)), base + cost(facing, place(h)), node);
    }
  };
  const auto relax_along = [&](std::size_t node, double base, HalfedgeId h) {
    if (mesh_.mark(h) != Mesh::kUnmarked || mesh_.is_boundary(h)) return;
    const VertexId w = mesh_.target(h);
    if (free_vertex(w) || ends_along(h)) {
      offer(vertex_node(w), base + distance(place(h), place(next_corner(h))), node);
    }
  };
  const std::size_t start = vertex_node(from);
  const std::size_t goal = vertex_node(to);
  stamp_[start] = now_;
  distance_[start] = 0;
  previous_[start] = start;
  mesh_.for_each_outgoing(from, [&](HalfedgeId h) {
    if (!in(from_sector, h / 3)) return;
    relax_corner(start, 0, h);
    const HalfedgeId o = mesh_.opposite(h);
    if (o != kInvalid && in(from_sector, o / 3)) relax_along(start, 0, h);
  });
  for (int visited = 0; !queue.empty(); ++visited) {
    if (visited % kVisitsPerCheck == 0) context.check();
    const Entry top = queue.top();
    queue.pop();
    if (top.distance > distance_[top.node]) continue;
    if (top.node == goal) {
      length_ = top.distance;
      return read_path(start, goal);
    }
    if (top.node < static_cast<std::size_t>(mesh_.vertex_count())) {
      mesh_.for_each_outgoing(static_cast<VertexId>(top.node), [&](HalfedgeId h) {
        relax_corner(top.node, top.distance, h);
        relax_along(top.node, top.distance, h);
      });
      continue;
    }
    const auto h =
        static_cast<HalfedgeId>(top.node - static_cast<std::size_t>(mesh_.vertex_count()));
    const Vector3 here = crossing(h);
    const VertexId v = mesh_.apex(h);
    if (free_vertex(v) || (v == to && in(to_sector, h / 3))) {
      offer(vertex_node(v), top.distance + distance(here, place(previous_corner(h))), top.node);
    }
    for (const HalfedgeId side : {next_corner(h), previous_corner(h)}) {
      if (free_edge(side))
        offer(edge_node(mesh_.opposite(side)), top.distance + cost(side, here), top.node);
    }
  }
  throw InternalError("no room for a path from vertex " + std::to_string(from) + " to vertex " +
                      std::to_string(to));
}

std::vector<PathStep> PathSearch::read_path(std::size_t start, std::size_t goal) const {
  std::vector<PathStep> steps;
  for (std::size_t node = goal; node != start; node = previous_[node]) {
    PathStep step;
    if (node < static_cast<std::size_t>(mesh_.vertex_count())) {
      step.vertex = static_cast<VertexId>(node);
    } else {
      const auto h = static_cast<HalfedgeId>(node - static_cast<std::size_t>(mesh_.vertex_count()));
      if (!overlay_.on_base_edge(h)) continue;  // inside a cell
      step.edge = {mesh_.source(h), mesh_.target(h)};
    }
    steps.push_back(step);
  }
  std::reverse(steps.begin(), steps.end());
  return steps;
}

}  // namespace flipfree::matchmaker
