#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <queue>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/target_domain.h"
#include "flipfree/mesh/refined/curve_overlay.h"

namespace flipfree::matchmaker {
namespace {

// The shortest path between two vertices over a surface that other paths have cut up (Dijkstra),
// along edges and across them.

// A step of a path: to a vertex, or across an edge of the surface, which is split there.
struct PathStep {
  VertexId vertex = kInvalid;
  std::array<VertexId, 2> edge = {kInvalid, kInvalid};
};

// An end of a path, and the faces around it through which the path may leave or arrive.
struct PathEnd {
  VertexId vertex = kInvalid;
  std::vector<FaceId> sector;

  bool holds(FaceId f) const { return std::find(sector.begin(), sector.end(), f) != sector.end(); }
};

using Mesh = mesh::EditableTriangulation;

// What crossing an edge of the surface costs besides the way, as it adds a vertex: this share of
// the edge. It depends on the edge alone: then a path that enters a face twice, or turns back, is
// never shorter than the one that leaves the detour out, and hence does not get into its own way.
// (A price in proportion to the way makes paths go down a blind alley and back, as diagonals inside
// cells cost less.)
constexpr double kCrossingShare = 0.25;
constexpr int kVisitsPerCheck = 1 << 14;

double distance(const Vector3& a, const Vector3& b) { return (a - b).norm(); }

class PathSearch {
 public:
  // All outlive this and may change between searches. `overlay`: lays the paths over the surface.
  // taken[v]: no path may pass through v.
  PathSearch(const mesh::RefinedSurface& surface, const mesh::CurveOverlay& overlay,
             const std::vector<bool>& taken)
      : surface_(surface), overlay_(overlay), taken_(taken) {}

  // Steps after `from`, the last of them `to`. Paths cross free edges (unmarked, inner) and pass
  // through free vertices. Throws InternalError if there is none. Cost: O(k log k) for k faces that
  // are visited.
  std::vector<PathStep> run(const PathEnd& from, const PathEnd& to,
                            const ExecutionContext& context) {
    const std::size_t nodes = at(mesh_.vertex_count() + mesh_.halfedge_slots());
    if (label_.size() < nodes) label_.resize(nodes + nodes / 4);
    ++now_;
    queue_ = {};
    to_ = &to;
    const std::size_t start = vertex_node(from.vertex);
    const std::size_t goal = vertex_node(to.vertex);
    label_[start] = {now_, 0.0, start};
    mesh_.for_each_outgoing(from.vertex, [&](HalfedgeId h) {
      if (!from.holds(h / 3)) return;
      leave_corner(start, h);
      const HalfedgeId o = mesh_.opposite(h);
      if (o != kInvalid && from.holds(o / 3)) leave_along(start, h);
    });
    for (int visited = 0; !queue_.empty(); ++visited) {
      if (visited % kVisitsPerCheck == 0) context.check();
      const auto [length, node] = queue_.top();
      queue_.pop();
      if (length > label_[node].distance) continue;
      if (node == goal) {
        length_ = length;
        return read_path(start, goal);
      }
      leave(node);
    }
    throw InternalError("no room for a path from vertex " + std::to_string(from.vertex) +
                        " to vertex " + std::to_string(to.vertex));
  }

  // Of the path that was found last.
  double length() const { return length_; }

 private:
  struct Label {
    std::uint32_t search = 0;  // that left the other two
    double distance = 0;
    std::size_t previous = 0;
  };

  void offer(std::size_t node, double step, std::size_t previous) {
    const double distance = label_[previous].distance + step;
    Label& label = label_[node];
    if (label.search == now_ && label.distance <= distance) return;
    label = {now_, distance, previous};
    queue_.push({distance, node});
  }

  bool is_free(HalfedgeId h) const {
    return mesh_.mark(h) == Mesh::kUnmarked && !mesh_.is_boundary(h);
  }

  // From the source of h, which is the node, across the facing edge.
  void leave_corner(std::size_t node, HalfedgeId h) {
    const HalfedgeId facing = next_corner(h);
    if (is_free(facing)) offer(edge_node(mesh_.opposite(facing)), cost(facing, place(h)), node);
  }

  // From there along h. A path ends so only between two faces of its end's sector.
  void leave_along(std::size_t node, HalfedgeId h) {
    if (!is_free(h)) return;
    const VertexId w = mesh_.target(h);
    const bool ends = w == to_->vertex && to_->holds(h / 3) && to_->holds(mesh_.opposite(h) / 3);
    if (ends || !taken_[at(w)])
      offer(vertex_node(w), distance(place(h), place(next_corner(h))), node);
  }

  void leave(std::size_t node) {
    if (node < at(mesh_.vertex_count())) {
      mesh_.for_each_outgoing(static_cast<VertexId>(node), [&](HalfedgeId h) {
        leave_corner(node, h);
        leave_along(node, h);
      });
      return;
    }
    const HalfedgeId h = halfedge_of(node);
    const Vector3 here = crossing(h);
    const VertexId v = mesh_.apex(h);
    if (!taken_[at(v)] || (v == to_->vertex && to_->holds(h / 3)))
      offer(vertex_node(v), distance(here, place(previous_corner(h))), node);
    for (const HalfedgeId side : {next_corner(h), previous_corner(h)}) {
      if (is_free(side)) offer(edge_node(mesh_.opposite(side)), cost(side, here), node);
    }
  }

  // Where a corner lies.
  const Vector3& place(HalfedgeId corner) const {
    return surface_.position[at(mesh_.source(corner))];
  }

  // Where a path crosses the edge of h.
  Vector3 crossing(HalfedgeId h) const { return 0.5 * (place(h) + place(next_corner(h))); }

  // Of a step from `here` across h.
  double cost(HalfedgeId h, const Vector3& here) const {
    const double way = distance(here, crossing(h));
    if (!overlay_.on_base_edge(h)) return way;
    return way + kCrossingShare * distance(place(h), place(next_corner(h)));
  }

  // Nodes: vertex v, or, entering the face of h, the middle of the edge of h: a path that has
  // crossed an edge goes on through the face beyond it. Distances are kept by stamps, so that a
  // search costs only what it visits.
  std::size_t vertex_node(VertexId v) const { return at(v); }
  std::size_t edge_node(HalfedgeId h) const { return at(mesh_.vertex_count() + h); }
  HalfedgeId halfedge_of(std::size_t node) const {
    return static_cast<HalfedgeId>(node) - mesh_.vertex_count();
  }
  std::vector<PathStep> read_path(std::size_t start, std::size_t goal) const {
    std::vector<PathStep> steps;
    for (std::size_t node = goal; node != start; node = label_[node].previous) {
      if (node < at(mesh_.vertex_count())) {
        steps.push_back({static_cast<VertexId>(node), {}});
      } else if (const HalfedgeId h = halfedge_of(node); overlay_.on_base_edge(h)) {
        steps.push_back({kInvalid, {mesh_.source(h), mesh_.target(h)}});
      }  // else inside a cell
    }
    std::reverse(steps.begin(), steps.end());
    return steps;
  }

  const mesh::RefinedSurface& surface_;
  const Mesh& mesh_ = surface_.mesh;
  const mesh::CurveOverlay& overlay_;
  const std::vector<bool>& taken_;
  double length_ = 0;
  std::vector<Label> label_;  // per node
  std::priority_queue<std::pair<double, std::size_t>, std::vector<std::pair<double, std::size_t>>,
                      std::greater<>>
      queue_;  // distance and node
  const PathEnd* to_ = nullptr;
  std::uint32_t now_ = 0;
};

// Vertices that paths may add: beyond, what follows takes minutes.
constexpr Index kMostAdded = 500'000;

class Tracer {
 public:
  Tracer(mesh::RefinedSurface& surface, const TargetDomain& domain,
         const ConvexPartition& partition)
      : surface_(surface), domain_(domain), partition_(partition) {
    taken_.assign(at(mesh_.vertex_count()), false);
    for (const VertexId v : surface.outer_boundary) taken_[at(v)] = true;
    for (const VertexId v : domain.mesh_vertex) taken_[at(v)] = true;
  }

  Paths finish() {
    overlay_.finish();
    return std::move(paths_);
  }

  bool traced(Index e) const { return !paths_[at(e)].empty(); }

  void lay_outline(Index e) {
    const auto& edge = partition_.edges[at(e)];
    const VertexId end = mesh_vertex(edge.b);
    std::vector<VertexId> path = {mesh_vertex(edge.a)};
    while (path.back() != end) {
      const HalfedgeId h = mesh_.outgoing(path.back());
      if (!mesh_.is_boundary(h) || mesh_.mark(h) != Mesh::kUnmarked) {
        throw InternalError("outline edges do not follow the mesh boundary");
      }
      mesh_.set_mark(h, e);
      path.push_back(mesh_.target(h));
    }
    paths_[at(e)] = std::move(path);
  }

  void lay_given(Index e, const std::vector<VertexId>& path) {
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const HalfedgeId h = mesh_.find(path[i], path[i + 1]);
      const bool inner = i > 0;
      if (h == kInvalid || mesh_.mark(h) != Mesh::kUnmarked || (inner && taken_[at(path[i])])) {
        throw_invalid(
            ErrorCode::kBadPins,
            "The given path through vertex " + vertex_id(path[i]) +
                " leaves the mesh's edges, or meets another path, pin or the boundary there. "
                "Give paths that meet at pins only.",
            ElementKind::kVertex, {path[i]});
      }
      mesh_.set_mark(h, e);
      if (inner) taken_[at(path[i])] = true;
    }
    paths_[at(e)] = path;
  }

  void trace(Index e, const ExecutionContext& context) {
    const auto& edge = partition_.edges[at(e)];
    std::vector<VertexId> path = {mesh_vertex(edge.a)};
    std::vector<FaceId> start = sector(edge.a, e);
    // A path that passes one cell twice can cross itself when its splits are made. Then the rest is
    // searched again from where it stopped; what was laid is a slit and cuts nothing off.
    constexpr int kMaxRestarts = 1000;
    for (int i = 0;; ++i) {
      if (realise(e, search_.run({path.back(), start}, end(edge.b, e), context), path)) break;
      if (i == kMaxRestarts) throw InternalError("a traced path lost its way");
      start = onward(path);
    }
    paths_[at(e)] = std::move(path);
    if (mesh_.vertex_count() - added_from_ <= kMostAdded) return;
    throw_not_converged(
        ErrorCode::kIterationLimit,
        "The lines between these pins wind around each other so often that the surface would have "
        "to be refined beyond all measure. Pin fewer vertices, or to places in a similar order.");
  }

  // How long the path of edge e would be if it were traced next.
  double cost_of(Index e, const ExecutionContext& context) {
    const auto& edge = partition_.edges[at(e)];
    search_.run(end(edge.a, e), end(edge.b, e), context);
    return search_.length();
  }
  // A lower bound of cost_of().
  double least_cost_of(Index e) const {
    const auto& edge = partition_.edges[at(e)];
    return (surface_.position[at(mesh_vertex(edge.a))] - surface_.position[at(mesh_vertex(edge.b))])
        .norm();
  }

 private:
  VertexId mesh_vertex(Index domain_vertex) const { return domain_.vertex_of(domain_vertex); }

  // Half-edge with which the traced path of edge e leaves mesh vertex v (its inner side for
  // arriving boundary edges is found by the caller): kInvalid if e arrives along the boundary and
  // has no outgoing half-edge.
  HalfedgeId leaving(VertexId v, Index e) const {
    HalfedgeId found = kInvalid;
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      if (mesh_.mark(h) == e) found = h;
    });
    return found;
  }

  // Faces around the last vertex of an unfinished path by which it can go on: from an edge of the
  // surface not back into the face that it has just crossed.
  std::vector<FaceId> onward(const std::vector<VertexId>& path) const {
    std::vector<FaceId> faces = mesh_.star(path.back());
    if (path.size() < 2 || overlay_.is_base_vertex(path.back())) return faces;
    const HalfedgeId arc = mesh_.find(path[path.size() - 2], path.back());
    if (overlay_.on_base_edge(arc)) return faces;
    const FaceId behind = mesh_.parent(arc / 3);
    std::erase_if(faces, [&](FaceId f) { return mesh_.parent(f) == behind; });
    return faces;
  }

  PathEnd end(Index a, Index e) const { return {mesh_vertex(a), sector(a, e)}; }

  // Faces around the end `a` of edge e, counter-clockwise, that lie between its traced neighbours.
  std::vector<FaceId> sector(Index a, Index e) const {
    const VertexId v = mesh_vertex(a);
    const auto& around = partition_.around[at(a)];
    const std::size_t n = around.size();
    const auto place = at(std::find(around.begin(), around.end(), e) - around.begin());
    const auto next_traced = [&](std::size_t step) {
      for (std::size_t i = 1; i < n; ++i) {
        if (const Index other = around[(place + i * step) % n]; traced(other)) return other;
      }
      return kInvalid;
    };
    const Index before = next_traced(n - 1), after = next_traced(1);
    std::vector<FaceId> faces;
    HalfedgeId h = before == kInvalid ? mesh_.outgoing(v) : leaving(v, before);
    if (h == kInvalid) throw InternalError("no traced path where one was expected");
    const HalfedgeId first = h;
    do {
      faces.push_back(h / 3);
      h = mesh_.rotate_ccw(h);
    } while (h != kInvalid && h != first && (after == kInvalid || mesh_.mark(h) != after));
    return faces;
  }

  // Lays the path and appends it. False if a step is not possible any more.
  bool realise(Index e, const std::vector<PathStep>& steps, std::vector<VertexId>& path) {
    for (const PathStep& step : steps) {
      VertexId next = step.vertex;
      if (next == kInvalid) {
        next = overlay_.cross(path.back(), step.edge[0], step.edge[1], e);
        if (next == kInvalid) return false;
        taken_.push_back(true);
      } else if (!overlay_.reach(path.back(), next, e)) {
        return false;
      }
      taken_[at(next)] = true;
      path.push_back(next);
    }
    return true;
  }

  mesh::RefinedSurface& surface_;
  Mesh& mesh_ = surface_.mesh;
  mesh::CurveOverlay overlay_{surface_};
  const TargetDomain& domain_;
  const ConvexPartition& partition_;
  Paths paths_ = Paths(partition_.edges.size());
  std::vector<bool> taken_;  // on a path, the boundary, or a pin
  PathSearch search_{surface_, overlay_, taken_};
  Index added_from_ = mesh_.vertex_count();
};

// Joins the points inside to the outline (Prim 1957): of all edges that join one more, always that
// with the shortest path, laid at once. Paths get longer as others come in between, so a length
// that was measured before is a lower bound. Traced edges join their ends at no cost.
void grow_tree(Tracer& tracer, const TargetDomain& domain, const ConvexPartition& partition,
               ExecutionContext& context) {
  using Candidate = std::pair<double, Index>;
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue;
  std::vector<bool> reached(domain.point.size(), false);
  std::size_t count = 0;
  std::vector<Index> pending = domain.outline;
  const auto reach_pending = [&] {
    while (!pending.empty()) {
      const auto v = at(pending.back());
      pending.pop_back();
      if (reached[v]) continue;
      reached[v] = true;
      ++count;
      for (const Index e : partition.around[v]) {
        const auto& edge = partition.edges[at(e)];
        const Index other = at(edge.a) == v ? edge.b : edge.a;
        if (edge.boundary || reached[at(other)]) continue;
        if (tracer.traced(e)) {
          pending.push_back(other);
        } else {
          queue.emplace(tracer.least_cost_of(e), e);
        }
      }
    }
  };
  reach_pending();
  while (!queue.empty()) {
    const Index e = queue.top().second;
    queue.pop();
    const auto& edge = partition.edges[at(e)];
    const bool a = reached[at(edge.a)];
    if (a && reached[at(edge.b)]) continue;
    const double now = tracer.cost_of(e, context);
    if (!queue.empty() && now > queue.top().first) {
      queue.emplace(now, e);
      continue;
    }
    context.report("tracing paths",
                   0.5 * static_cast<double>(count) / static_cast<double>(reached.size()));
    tracer.trace(e, context);
    pending.push_back(a ? edge.b : edge.a);
    reach_pending();
  }
}

// The partition's edges that are not traced. As the others join all points to the outline, each of
// these divides one piece in two; the longest in the target come first, which leave parts of about
// the same size.
std::vector<Index> dividing_order(const Tracer& tracer, const TargetDomain& domain,
                                  const ConvexPartition& partition) {
  std::vector<Index> order;
  for (Index e = 0; e < static_cast<Index>(partition.edges.size()); ++e) {
    if (!tracer.traced(e)) order.push_back(e);
  }
  const auto length = [&](Index e) {
    const auto& edge = partition.edges[at(e)];
    return (domain.at(edge.a) - domain.at(edge.b)).norm();
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](Index a, Index b) { return length(a) > length(b); });
  return order;
}

}  // namespace

Paths trace_paths(mesh::RefinedSurface& surface, const TargetDomain& domain,
                  const ConvexPartition& partition, const std::vector<std::vector<VertexId>>& given,
                  ExecutionContext& context) {
  Tracer tracer(surface, domain, partition);
  const auto edges = static_cast<Index>(partition.edges.size());
  for (Index e = 0; e < edges; ++e) {
    if (partition.edges[at(e)].boundary) tracer.lay_outline(e);
  }
  for (Index e = 0; e < edges; ++e) {
    const auto& edge = partition.edges[at(e)];
    if (edge.boundary || edge.given == kInvalid) continue;
    std::vector<VertexId> path = given[at(edge.given)];
    if (path.front() != domain.vertex_of(edge.a)) std::ranges::reverse(path);
    tracer.lay_given(e, path);
  }
  grow_tree(tracer, domain, partition, context);
  const std::vector<Index> order = dividing_order(tracer, domain, partition);
  for (std::size_t i = 0; i < order.size(); ++i) {
    context.report("tracing paths",
                   0.5 + 0.5 * static_cast<double>(i) / static_cast<double>(order.size()));
    tracer.trace(order[i], context);
  }
  return tracer.finish();
}

}  // namespace flipfree::matchmaker
