#include "flipfree/matchmaker/patches/trace_paths.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <queue>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/patches/path_search.h"
#include "flipfree/mesh/refined/curve_overlay.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// Vertices that paths may add: beyond, what follows takes minutes.
constexpr Index kMostAdded = 500'000;

class Tracer {
 public:
  Tracer(mesh::RefinedSurface& surface, const TargetDomain& domain,
         const ConvexPartition& partition)
      : surface_(surface),
        mesh_(surface.mesh),
        overlay_(surface),
        domain_(domain),
        partition_(partition),
        paths_(partition.edges.size()),
        search_(surface, overlay_, taken_),
        added_from_(mesh_.vertex_count()) {
    taken_.assign(static_cast<std::size_t>(mesh_.vertex_count()), false);
    for (const VertexId v : surface.outer_boundary) taken_[at(v)] = true;
    for (const VertexId v : domain.mesh_vertex) taken_[at(v)] = true;
  }

  Paths finish() {
    overlay_.finish();
    return std::move(paths_);
  }

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
      if (h == kInvalid || mesh_.mark(h) != Mesh::kUnmarked || (inner && taken(path[i]))) {
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
    const VertexId from = mesh_vertex(edge.a);
    const VertexId to = mesh_vertex(edge.b);
    std::vector<VertexId> path = {from};
    std::vector<FaceId> start = sector(edge.a, e);
    // A path that passes one cell twice can cross itself when its splits are made. Then the rest is
    // searched again from where it stopped; what was laid is a slit and cuts nothing off.
    constexpr int kMaxRestarts = 1000;
    for (int i = 0;; ++i) {
      if (realise(e, search_.run({path.back(), start}, {to, sector(edge.b, e)}, context), path))
        break;
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
    const VertexId to = mesh_vertex(edge.b);
    search_.run({mesh_vertex(edge.a), sector(edge.a, e)}, {to, sector(edge.b, e)}, context);
    return search_.length();
  }
  // A lower bound of cost_of().
  double least_cost_of(Index e) const {
    const auto& edge = partition_.edges[at(e)];
    return (surface_.position[at(mesh_vertex(edge.a))] - surface_.position[at(mesh_vertex(edge.b))])
        .norm();
  }

 private:
  VertexId mesh_vertex(Index domain_vertex) const { return domain_.mesh_vertex[at(domain_vertex)]; }
  bool taken(VertexId v) const { return taken_[at(v)]; }
  bool traced(Index e) const { return !paths_[at(e)].empty(); }

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

  // Faces around the end `a` of edge e, counter-clockwise, that lie between its traced neighbours.
  std::vector<FaceId> sector(Index a, Index e) const {
    const VertexId v = mesh_vertex(a);
    const auto& around = partition_.around[at(a)];
    const std::size_t n = around.size();
    const auto place =
        static_cast<std::size_t>(std::find(around.begin(), around.end(), e) - around.begin());
    Index before = kInvalid;
    Index after = kInvalid;
    for (std::size_t i = 1; i < n && before == kInvalid; ++i) {
      if (traced(around[(place + n - i) % n])) before = around[(place + n - i) % n];
    }
    for (std::size_t i = 1; i < n && after == kInvalid; ++i) {
      if (traced(around[(place + i) % n])) after = around[(place + i) % n];
    }
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

  const mesh::RefinedSurface& surface_;
  Mesh& mesh_;
  mesh::CurveOverlay overlay_;
  const TargetDomain& domain_;
  const ConvexPartition& partition_;
  Paths paths_;
  std::vector<bool> taken_;  // on a path, the boundary, or a pin
  PathSearch search_;
  Index added_from_;
};

// Joins the points inside to the outline (Prim 1957): of all edges that join one more, always that
// with the shortest path, laid at once. Paths get longer as others come in between, so a length
// that was measured before is a lower bound. Settled edges join their ends at no cost.
void grow_tree(Tracer& tracer, const TargetDomain& domain, const ConvexPartition& partition,
               std::vector<bool>& settled, ExecutionContext& context) {
  using Candidate = std::pair<double, Index>;
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue;
  std::vector<bool> reached(domain.point.size(), false);
  std::size_t count = 0;
  std::vector<Index> pending = domain.outline;
  const auto reach_pending = [&] {
    while (!pending.empty()) {
      const auto v = static_cast<std::size_t>(pending.back());
      pending.pop_back();
      if (reached[v]) continue;
      reached[v] = true;
      ++count;
      for (const Index e : partition.around[v]) {
        const auto& edge = partition.edges[at(e)];
        const Index other = static_cast<std::size_t>(edge.a) == v ? edge.b : edge.a;
        if (edge.boundary || reached[at(other)]) continue;
        if (settled[at(e)]) {
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
    settled[at(e)] = true;
    pending.push_back(a ? edge.b : edge.a);
    reach_pending();
  }
}

// Outline and given paths; returns which edges they are.
std::vector<bool> lay_first(Tracer& tracer, const ConvexPartition& partition, const Paths& given) {
  std::vector<bool> settled;
  for (std::size_t e = 0; e < given.size(); ++e) {
    settled.push_back(!given[e].empty());
    if (partition.edges[e].boundary) tracer.lay_outline(static_cast<Index>(e));
  }
  for (std::size_t e = 0; e < given.size(); ++e) {
    if (settled[e]) tracer.lay_given(static_cast<Index>(e), given[e]);
  }
  return settled;
}

// Divides a tree at the edge that leaves the smallest larger part, then both parts, and so on.
class Halving {
 public:
  struct Arm {
    Index edge, node;
  };

  Halving(std::vector<std::vector<Arm>> arms, std::vector<double> weight, std::vector<bool> cut)
      : arms_(std::move(arms)), weight_(std::move(weight)), cut_(std::move(cut)) {}

  // The edges of the tree that contains `root`, in the order in which they are cut.
  void run(Index root, std::vector<Index>& order) {
    std::vector<Index> roots = {root};
    for (std::size_t i = 0; i < roots.size(); ++i) {
      const Index e = halve(roots[i]);
      if (e == kInvalid) continue;
      order.push_back(e);
      cut_[at(e)] = true;
      roots.push_back(ends_[0]);
      roots.push_back(ends_[1]);
    }
  }

 private:
  Index halve(Index root) {
    struct Node {
      Index id, edge;
      std::size_t parent;
      double below;
    };
    std::vector<Node> nodes = {{root, kInvalid, 0, weight_[at(root)]}};
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      for (const Arm& arm : arms_[at(nodes[i].id)]) {
        if (arm.edge == nodes[i].edge || cut_[at(arm.edge)]) continue;
        nodes.push_back({arm.node, arm.edge, i, weight_[at(arm.node)]});
      }
    }
    for (std::size_t i = nodes.size(); i-- > 1;) nodes[nodes[i].parent].below += nodes[i].below;
    Index best = kInvalid;
    double least = nodes[0].below;
    for (std::size_t i = 1; i < nodes.size(); ++i) {
      const double larger = std::max(nodes[i].below, nodes[0].below - nodes[i].below);
      if (larger >= least) continue;
      least = larger;
      best = nodes[i].edge;
      ends_[0] = nodes[i].id;
      ends_[1] = nodes[nodes[i].parent].id;
    }
    return best;
  }

  std::vector<std::vector<Arm>> arms_;
  std::vector<double> weight_;
  std::vector<bool> cut_;
  Index ends_[2] = {kInvalid, kInvalid};
};

// The partition's edges but for the outline and those that are settled. As settled ones join all
// points to the outline, each of the rest divides one piece in two; they come so that both halves
// have about the same number of sides, hence a piece is divided O(log n) times.
std::vector<Index> dividing_order(const ConvexPartition& partition,
                                  const std::vector<bool>& settled) {
  std::vector<Index> order;
  std::vector<bool> cut = settled;
  std::vector<std::vector<Index>> beside(partition.edges.size());
  std::vector<double> weight;
  for (std::size_t p = 0; p < partition.polygons.size(); ++p) {
    weight.push_back(static_cast<double>(partition.polygons[p].size()));
    for (const auto& side : partition.polygons[p])
      beside[at(side.edge)].push_back(static_cast<Index>(p));
  }
  std::vector<std::vector<Halving::Arm>> arms(partition.polygons.size());
  for (std::size_t e = 0; e < beside.size(); ++e) {
    if (cut[e] || beside[e].size() != 2) continue;
    for (std::size_t k = 0; k < 2; ++k) {
      arms[at(beside[e][k])].push_back({static_cast<Index>(e), beside[e][1 - k]});
    }
  }
  Halving halving(std::move(arms), std::move(weight), std::move(cut));
  halving.run(0, order);
  return order;
}

}  // namespace

Paths trace_paths(mesh::RefinedSurface& surface, const TargetDomain& domain,
                  const ConvexPartition& partition, const Paths& given, ExecutionContext& context) {
  Tracer tracer(surface, domain, partition);
  std::vector<bool> settled = lay_first(tracer, partition, given);
  grow_tree(tracer, domain, partition, settled, context);
  const std::vector<Index> order = dividing_order(partition, settled);
  for (std::size_t i = 0; i < order.size(); ++i) {
    context.report("tracing paths",
                   0.5 + 0.5 * static_cast<double>(i) / static_cast<double>(order.size()));
    tracer.trace(order[i], context);
  }
  return tracer.finish();
}

std::vector<Index> shortest_tree(mesh::RefinedSurface surface, const TargetDomain& domain,
                                 const ConvexPartition& partition, const Paths& given,
                                 ExecutionContext& context) {
  Tracer tracer(surface, domain, partition);
  std::vector<bool> settled = lay_first(tracer, partition, given);
  const std::vector<bool> before = settled;
  grow_tree(tracer, domain, partition, settled, context);
  std::vector<Index> tree;
  for (std::size_t e = 0; e < settled.size(); ++e) {
    if (settled[e] && !before[e]) tree.push_back(static_cast<Index>(e));
  }
  return tree;
}

}  // namespace flipfree::matchmaker
