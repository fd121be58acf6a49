#include "flipfree/matchmaker/patches/trace_paths.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <queue>
#include <string>
#include <tuple>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/matchmaker/patches/outline_tree.h"
#include "flipfree/matchmaker/patches/tracing_order.h"
#include "flipfree/mesh/refined/curve_overlay.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// What crossing an edge of the surface costs besides the way, as it adds a vertex: this share of
// the edge, and a bit that decides where all is too near to tell. It depends on the edge alone:
// then a path that enters a face twice, or turns back, is never shorter than the one that leaves
// the detour out, and hence does not get into its own way. (A price in proportion to the way makes
// paths go down a blind alley and back, as diagonals inside cells cost less.) In a drawing, where
// paths have to follow straight lines, the price is in proportion all the same: edges that are
// drawn long would turn them aside.
constexpr double kCrossingShare = 0.25;
constexpr double kCrossingShareOfWay = 0.5;
constexpr double kCrossingCost = 1e-4;  // in units of the mean edge
// Vertices that paths may add: beyond, what follows takes minutes.
constexpr Index kMostAdded = 500'000;
constexpr int kVisitsPerCheck = 1 << 14;
// Crossings keep this share of an edge's piece away from its ends.
constexpr double kMargin = 0.15;

// A step of a path: to a vertex, or across an edge of the surface, which is split there.
struct Step {
  VertexId vertex = kInvalid;
  std::array<VertexId, 2> edge = {kInvalid, kInvalid};
  Vector2 place = Vector2::Zero();  // in the drawing
};

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
        crossing_cost_(kCrossingCost * mean_length()),
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
    if (drawing_ != nullptr) {
      line_ = {(*drawing_)[static_cast<std::size_t>(from)],
               (*drawing_)[static_cast<std::size_t>(to)]};
    }
    // A path that passes one cell twice can cross itself when its splits are made. Then the rest is
    // searched again from where it stopped; what was laid is a slit and cuts nothing off.
    constexpr int kMaxRestarts = 1000;
    for (int i = 0;; ++i) {
      if (realise(e, search(path.back(), start, to, sector(edge.b, e), context), path)) break;
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
    search(mesh_vertex(edge.a), sector(edge.a, e), to, sector(edge.b, e), context);
    return distance_[vertex_node(to)];
  }
  // A lower bound of cost_of().
  double least_cost_of(Index e) const {
    const auto& edge = partition_.edges[static_cast<std::size_t>(e)];
    return (surface_.position[static_cast<std::size_t>(mesh_vertex(edge.a))] -
            surface_.position[static_cast<std::size_t>(mesh_vertex(edge.b))])
        .norm();
  }

 private:
  // Of an edge, where the lengths of paths are measured.
  double mean_length() const {
    double sum = 0;
    for (HalfedgeId h = 0; h < mesh_.halfedge_slots(); ++h) {
      if (mesh_.alive(h / 3)) sum += length(place(h), place(next_corner(h)));
    }
    return sum / static_cast<double>(std::max(mesh_.halfedge_slots(), Index{1}));
  }
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

  static double length(const Vector3& a, const Vector3& b) { return (a - b).norm(); }
  // Where a corner lies: in the drawing, or on the surface.
  Vector3 place(HalfedgeId corner) const {
    const auto v = static_cast<std::size_t>(mesh_.source(corner));
    if (drawing_ == nullptr) return surface_.position[v];
    return {(*drawing_)[v].x(), (*drawing_)[v].y(), 0.0};
  }
  // Where a path crosses the edge of h: in the middle, or in a drawing as near to the straight line
  // between the path's ends as the room for further paths allows.
  Vector3 crossing(HalfedgeId h) const {
    const Vector3 a = place(h);
    const Vector3 b = place(next_corner(h));
    if (drawing_ == nullptr) return 0.5 * (a + b);
    const Vector2 along = line_[1] - line_[0];
    const auto side = [&](const Vector3& p) {
      return along.x() * (p.y() - line_[0].y()) - along.y() * (p.x() - line_[0].x());
    };
    const double of_a = side(a);
    const double of_b = side(b);
    const double t = of_a == of_b ? 0.5 : std::clamp(of_a / (of_a - of_b), kMargin, 1 - kMargin);
    return a + t * (b - a);
  }

  // Of a step from `here` across h.
  double cost(HalfedgeId h, const Vector3& here) const {
    const double way = length(here, crossing(h));
    if (!overlay_.on_base_edge(h)) return way;
    const double price = drawing_ != nullptr
                             ? kCrossingShareOfWay * way
                             : kCrossingShare * length(place(h), place(next_corner(h)));
    return way + price + crossing_cost_;
  }

  // Nodes: vertex v, or, entering the face of h, the middle of the edge of h: a path that has
  // crossed an edge goes on through the face beyond it. Distances are kept by stamps, so that a
  // search costs only what it visits.
  std::size_t vertex_node(VertexId v) const { return static_cast<std::size_t>(v); }
  std::size_t edge_node(HalfedgeId h) const {
    return static_cast<std::size_t>(mesh_.vertex_count() + h);
  }

  struct Entry {
    double distance;
    std::size_t node;
    bool operator>(const Entry& other) const {
      return std::tie(distance, node) > std::tie(other.distance, other.node);
    }
  };

  std::vector<Step> search(VertexId from, const std::vector<FaceId>& from_sector, VertexId to,
                           const std::vector<FaceId>& to_sector, const ExecutionContext& context) {
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
    const auto free_vertex = [&](VertexId v) { return !taken(v); };
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
        offer(vertex_node(w), base + length(place(h), place(next_corner(h))), node);
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
      if (top.node == goal) return read_path(start, goal);
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
        offer(vertex_node(v), top.distance + length(here, place(previous_corner(h))), top.node);
      }
      for (const HalfedgeId side : {next_corner(h), previous_corner(h)}) {
        if (free_edge(side))
          offer(edge_node(mesh_.opposite(side)), top.distance + cost(side, here), top.node);
      }
    }
    throw InternalError("no room for a path from vertex " + std::to_string(from) + " to vertex " +
                        std::to_string(to));
  }

  std::vector<Step> read_path(std::size_t start, std::size_t goal) const {
    std::vector<Step> steps;
    for (std::size_t node = goal; node != start; node = previous_[node]) {
      Step step;
      if (node < static_cast<std::size_t>(mesh_.vertex_count())) {
        step.vertex = static_cast<VertexId>(node);
      } else {
        const auto h =
            static_cast<HalfedgeId>(node - static_cast<std::size_t>(mesh_.vertex_count()));
        if (!overlay_.on_base_edge(h)) continue;  // inside a cell
        step.edge = {mesh_.source(h), mesh_.target(h)};
        step.place = crossing(h).head<2>();
      }
      steps.push_back(step);
    }
    std::reverse(steps.begin(), steps.end());
    return steps;
  }

  // Lays the path and appends it. False if a step is not possible any more.
  bool realise(Index e, const std::vector<Step>& steps, std::vector<VertexId>& path) {
    for (const Step& step : steps) {
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
  std::array<Vector2, 2> line_;  // in the drawing, between the ends of the present path
  double crossing_cost_;
  Index added_from_;
  std::vector<double> distance_;
  std::vector<std::size_t> previous_;
  std::vector<std::uint32_t> stamp_;
  std::uint32_t now_ = 0;
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
