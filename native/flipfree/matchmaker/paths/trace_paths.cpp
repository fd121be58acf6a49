#include "flipfree/matchmaker/paths/trace_paths.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/paths/outline_tree.h"
#include "flipfree/matchmaker/paths/path_search.h"
#include "flipfree/matchmaker/paths/tracing_order.h"
#include "flipfree/mesh/refined/curve_overlay.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// Vertices that paths may add: beyond, what follows takes minutes.
constexpr Index kMostAdded = 500'000;

class Tracer {
 public:
  // `drawing`, if there is one: where every vertex lies, new ones appended.
  Tracer(mesh::RefinedSurface& surface, const TargetDomain& domain,
         const ConvexPartition& partition, std::vector<Vector2>* drawing)
      : surface_(surface),
        mesh_(surface.mesh),
        overlay_(surface),
        domain_(domain),
        partition_(partition),
        paths_(partition.edges.size()),
        drawing_(drawing),
        search_(surface, overlay_, taken_, drawing),
        added_from_(mesh_.vertex_count()) {
    taken_.assign(static_cast<std::size_t>(mesh_.vertex_count()), false);
    for (const VertexId v : surface.outer_boundary) taken_[static_cast<std::size_t>(v)] = true;
    for (const VertexId v : domain.mesh_vertex) taken_[static_cast<std::size_t>(v)] = true;
  }

  Paths finish() {
    overlay_.finish();
    return std::move(paths_);
  }

  void lay_outline(Index e) {
    const auto& edge = partition_.edges[static_cast<std::size_t>(e)];
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
    paths_[static_cast<std::size_t>(e)] = std::move(path);
  }

  void lay_given(Index e, const std::vector<VertexId>& path) {
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const HalfedgeId h = mesh_.find(path[i], path[i + 1]);
      const bool inner = i > 0;
      if (h == kInvalid || mesh_.mark(h) != Mesh::kUnmarked || (inner && taken(path[i]))) {
        throw_invalid(
            ErrorCode::kBadPins,
            "The given path through vertex " + std::to_string(path[i]) +
                " leaves the mesh's edges, or meets another path, pin or the boundary there. "
                "Give paths that meet at pins only.",
            ElementKind::kVertex, {path[i]});
      }
      mesh_.set_mark(h, e);
      if (inner) taken_[static_cast<std::size_t>(path[i])] = true;
    }
    paths_[static_cast<std::size_t>(e)] = path;
  }

  void trace(Index e, const ExecutionContext& context) {
    const auto& edge = partition_.edges[static_cast<std::size_t>(e)];
    const VertexId from = mesh_vertex(edge.a);
    const VertexId to = mesh_vertex(edge.b);
    std::vector<VertexId> path = {from};
    std::vector<FaceId> start = sector(edge.a, e);
    search_.keep_near(from, to);
    // A path that passes one cell twice can cross itself when its splits are made. Then the rest is
    // searched again from where it stopped; what was laid is a slit and cuts nothing off.
    constexpr int kMaxRestarts = 1000;
    for (int i = 0;; ++i) {
      if (realise(e, search_.run({path.back(), start}, {to, sector(edge.b, e)}, context), path))
        break;
      if (i == kMaxRestarts) throw InternalError("a traced path lost its way");
      start = onward(path);
    }
    paths_[static_cast<std::size_t>(e)] = std::move(path);
    if (mesh_.vertex_count() - added_from_ <= kMostAdded) return;
    throw_not_converged(
        ErrorCode::kIterationLimit,
        "The lines between these pins wind around each other so often that the surface would have "
        "to be refined beyond all measure. Pin fewer vertices, or to places in a similar order.");
  }

  // How long the path of edge e would be if it were traced next.
  double cost_of(Index e, const ExecutionContext& context) {
    const auto& edge = partition_.edges[static_cast<std::size_t>(e)];
    const VertexId to = mesh_vertex(edge.b);
    search_.run({mesh_vertex(edge.a), sector(edge.a, e)}, {to, sector(edge.b, e)}, context);
    return search_.length();
  }
  // A lower bound of cost_of().
  double least_cost_of(Index e) const {
    const auto& edge = partition_.edges[static_cast<std::size_t>(e)];
    return (surface_.position[static_cast<std::size_t>(mesh_vertex(edge.a))] -
            surface_.position[static_cast<std::size_t>(mesh_vertex(edge.b))])
        .norm();
  }

 private:
  VertexId mesh_vertex(Index domain_vertex) const {
    return domain_.mesh_vertex[static_cast<std::size_t>(domain_vertex)];
  }
  bool taken(VertexId v) const { return taken_[static_cast<std::size_t>(v)]; }
  bool traced(Index e) const { return !paths_[static_cast<std::size_t>(e)].empty(); }

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
    const auto& around = partition_.around[static_cast<std::size_t>(a)];
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
        if (drawing_ != nullptr) drawing_->push_back(step.place);
        taken_.push_back(true);
      } else if (!overlay_.reach(path.back(), next, e)) {
        return false;
      }
      taken_[static_cast<std::size_t>(next)] = true;
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
  std::vector<Vector2>* drawing_;
  PathSearch search_;
  Index added_from_;
};

// The edges by which points inside are joined to the outline: of all that join one more, always
// that with the shortest path, laid at once. Paths get longer as others come in between, so a
// length that was measured before is a lower bound.
void grow_tree(Tracer& tracer, const TargetDomain& domain, const ConvexPartition& partition,
               std::vector<bool>& settled, ExecutionContext& context) {
  join_to_outline(
      domain, partition, settled, [&](Index e) { return tracer.least_cost_of(e); },
      [&](Index e) { return tracer.cost_of(e, context); },
      [&](Index e, double share) {
        context.report("tracing paths", 0.5 * share);
        tracer.trace(e, context);
        settled[static_cast<std::size_t>(e)] = true;
      });
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

}  // namespace

Paths trace_paths(mesh::RefinedSurface& surface, const TargetDomain& domain,
                  const ConvexPartition& partition, const Paths& given, ExecutionContext& context,
                  std::vector<Vector2>* drawing) {
  Tracer tracer(surface, domain, partition, drawing);
  std::vector<bool> settled = lay_first(tracer, partition, given);
  // In a drawing straight lines do not wind, whatever comes first.
  if (drawing == nullptr) grow_tree(tracer, domain, partition, settled, context);
  const std::vector<Index> order = tracing_order(domain, partition, settled);
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
  Tracer tracer(surface, domain, partition, nullptr);
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
