#include "flipfree/matchmaker/trace_paths.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <queue>
#include <string>
#include <tuple>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/stats.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/matchmaker/curve_overlay.h"
#include "flipfree/matchmaker/tracing_order.h"

namespace flipfree {
namespace {

using Mesh = EditableTriangulation;

// What crossing an edge of the surface costs besides the way, as it adds a vertex: this share of the
// edge as it is drawn, and a bit that decides where the drawing is too dense to. It depends on the
// edge alone: then a path that enters a face twice, or turns back, is never shorter than the one
// that leaves the detour out, and hence does not get into its own way. (A price in proportion to
// the way makes paths go down a blind alley and back, as diagonals inside cells cost less.)
constexpr double kCrossingShare = 0.25;
constexpr double kCrossingCost = 1e-6;
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
  Tracer(RefinedSurface& surface, const TargetDomain& domain, const ConvexPartition& partition,
         std::vector<Vector2>* drawing)
      : mesh_(surface.mesh),
        overlay_(surface),
        domain_(domain),
        partition_(partition),
        paths_(partition.edges.size()),
        anchored_(partition.edges.size(), false),
        given_drawing_(drawing) {
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

  void trace(Index e, ExecutionContext& context) {
    const auto& edge = partition_.edges[static_cast<std::size_t>(e)];
    const VertexId from = mesh_vertex(edge.a);
    const VertexId to = mesh_vertex(edge.b);
    std::vector<VertexId> path = {from};
    std::vector<FaceId> start = sector(edge.a, e);
    // A shortest path that passes one face twice can cross itself when its splits are made. Then
    // the rest is searched again from where it stopped; what was laid is a slit and cuts nothing
    // off.
    constexpr int kMaxRestarts = 1000;
    for (int i = 0;; ++i) {
      if (given_drawing_ == nullptr) draw_region(start.front(), context);
      line_ = {place_of(from), place_of(to)};
      if (realise(e, search(path.back(), start, to, sector(edge.b, e)), path)) break;
      if (i == kMaxRestarts) throw InternalError("a traced path lost its way");
      start = onward(path);
    }
    paths_[static_cast<std::size_t>(e)] = std::move(path);
    anchor(edge.a);
    anchor(edge.b);
  }

  // All edges laid so far that hang together with domain vertex v hang together with the boundary.
  void anchor(Index v) {
    std::vector<Index> open = {v};
    while (!open.empty()) {
      const Index u = open.back();
      open.pop_back();
      for (const Index e : partition_.around[static_cast<std::size_t>(u)]) {
        if (!traced(e) || anchored_[static_cast<std::size_t>(e)]) continue;
        anchored_[static_cast<std::size_t>(e)] = true;
        open.push_back(partition_.edges[static_cast<std::size_t>(e)].a);
        open.push_back(partition_.edges[static_cast<std::size_t>(e)].b);
      }
    }
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

  // The piece of the cut surface that contains face `seed`, drawn in a disk by Tutte's embedding;
  // vertices on both sides of a path are two. place(h) then is where corner h lies. Shortest paths
  // in this drawing are nearly straight and keep away from earlier paths. Lines that are not joined
  // to the boundary yet do not cut the drawing, which would not be a disk. (On the surface itself
  // they run along those; then every path beside an earlier one crosses a fan at each of its
  // vertices, and the number of added vertices doubles from path to path.)
  void draw_region(FaceId seed, ExecutionContext& context) {
    const auto barrier = [&](HalfedgeId h) {
      return mesh_.is_boundary(h) || (mesh_.mark(h) != Mesh::kUnmarked &&
                                      anchored_[static_cast<std::size_t>(mesh_.mark(h))]);
    };
    const auto corners = static_cast<std::size_t>(mesh_.halfedge_slots());
    local_.resize(corners, kInvalid);
    inside_.resize(corners / 3, 0);
    ++drawn_;
    const auto enter = [&](FaceId f) {
      const bool fresh = std::exchange(inside_[static_cast<std::size_t>(f)], drawn_) != drawn_;
      for (HalfedgeId h = 3 * f; fresh && h < 3 * f + 3; ++h)
        local_[static_cast<std::size_t>(h)] = kInvalid;
      return fresh;
    };
    std::vector<FaceId> region = {seed};
    enter(seed);
    HalfedgeId rim = kInvalid;
    for (std::size_t i = 0; i < region.size(); ++i) {
      for (HalfedgeId h = 3 * region[i]; h < 3 * region[i] + 3; ++h) {
        if (barrier(h)) {
          rim = h;
          continue;
        }
        const FaceId g = mesh_.opposite(h) / 3;
        if (enter(g)) region.push_back(g);
      }
    }
    Index count = 0;
    for (const FaceId f : region) {
      for (HalfedgeId corner = 3 * f; corner < 3 * f + 3; ++corner) {
        if (local_[static_cast<std::size_t>(corner)] != kInvalid) continue;
        // The fan of this corner, both ways up to a barrier.
        HalfedgeId h = corner;
        while (!barrier(h)) {
          h = mesh_.rotate_cw(h);
          if (h == corner) break;
        }
        const HalfedgeId first = h;
        do {
          local_[static_cast<std::size_t>(h)] = count;
          if (barrier(previous_corner(h))) break;
          h = mesh_.rotate_ccw(h);
        } while (h != first);
        ++count;
      }
    }
    Triangles faces(static_cast<Eigen::Index>(region.size()), 3);
    for (std::size_t i = 0; i < region.size(); ++i) {
      for (Index k = 0; k < 3; ++k) {
        faces(static_cast<Eigen::Index>(i), k) =
            local_[static_cast<std::size_t>(3 * region[i] + k)];
      }
    }
    std::vector<VertexId> loop;
    HalfedgeId h = rim;
    do {
      loop.push_back(local_[static_cast<std::size_t>(h)]);
      h = next_corner(h);
      while (!barrier(h)) h = next_corner(mesh_.opposite(h));
    } while (h != rim);
    // Strictly convex polygons of distinct 64-bit points end somewhere above this; so does
    // patience.
    constexpr std::size_t kLongestRim = 100000;
    EmbedOptions options;
    options.method = EmbedMethod::kTutte;
    options.float32 = false;
    Stats unused;
    const ProgressRange quiet(context, 0.0, 0.0);
    try {
      if (loop.size() <= kLongestRim) {
        const std::vector<double> even(loop.size(), 1.0);
        const Points2 circle = place_boundary(BoundaryShape::kCircle, even).positions;
        drawing_ = embed_disk(faces, count, loop, circle, options, context, unused);
        return;
      }
    } catch (const InvalidInput&) {
      // A rim for which no circle of distinct points was found: the same complaint in the caller's
      // terms.
    }
    throw_not_converged(
        ErrorCode::kIterationLimit,
        "The lines between these pins wind around each other so often that the surface would have "
        "to be "
        "refined beyond all measure. Pin fewer vertices, or to places in a similar order.");
  }

  static double length(const Vector2& a, const Vector2& b) { return (a - b).norm(); }
  Vector2 place(HalfedgeId corner) const {
    if (given_drawing_ != nullptr)
      return (*given_drawing_)[static_cast<std::size_t>(mesh_.source(corner))];
    return drawing_.row(local_[static_cast<std::size_t>(corner)]).transpose();
  }
  Vector2 place_of(VertexId v) const {
    return given_drawing_ == nullptr ? Vector2::Zero()
                                     : (*given_drawing_)[static_cast<std::size_t>(v)];
  }
  // Where a path crosses the edge of h: in a given drawing as near to the straight line between its
  // ends as the room for further paths allows.
  Vector2 crossing(HalfedgeId h) const {
    const Vector2 a = place(h);
    const Vector2 b = place(next_corner(h));
    if (given_drawing_ == nullptr) return 0.5 * (a + b);
    const Vector2 along = line_[1] - line_[0];
    const auto side = [&](const Vector2& p) {
      return along.x() * (p.y() - line_[0].y()) - along.y() * (p.x() - line_[0].x());
    };
    const double of_a = side(a);
    const double of_b = side(b);
    const double t = of_a == of_b ? 0.5 : std::clamp(of_a / (of_a - of_b), kMargin, 1 - kMargin);
    return a + t * (b - a);
  }

  // Of a step from `here` across h.
  double cost(HalfedgeId h, const Vector2& here) const {
    const double way = length(here, crossing(h));
    if (!overlay_.on_base_edge(h)) return way;
    return way + kCrossingShare * length(place(h), place(next_corner(h))) + kCrossingCost;
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
                           const std::vector<FaceId>& to_sector) {
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
    while (!queue.empty()) {
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
      const Vector2 here = crossing(h);
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
        step.place = crossing(h);
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
        if (given_drawing_ != nullptr) given_drawing_->push_back(step.place);
        taken_.push_back(true);
      } else if (!overlay_.reach(path.back(), next, e)) {
        return false;
      }
      taken_[static_cast<std::size_t>(next)] = true;
      path.push_back(next);
    }
    return true;
  }

  Mesh& mesh_;
  CurveOverlay overlay_;
  const TargetDomain& domain_;
  const ConvexPartition& partition_;
  Paths paths_;
  std::vector<bool> anchored_;  // per partition edge: laid and joined to the boundary by laid edges
  std::vector<bool> taken_;     // on a path, the boundary, or a pin
  std::vector<Index> local_;    // per corner of the region: vertex of the drawing
  std::vector<std::uint32_t> inside_;  // per face: the drawing that it was last part of
  std::uint32_t drawn_ = 0;
  Points2 drawing_;
  std::vector<Vector2>* given_drawing_;
  std::array<Vector2, 2> line_;  // in a given drawing, between the ends of the present path
  std::vector<double> distance_;
  std::vector<std::size_t> previous_;
  std::vector<std::uint32_t> stamp_;
  std::uint32_t now_ = 0;
};

}  // namespace

Paths trace_paths(RefinedSurface& surface, const TargetDomain& domain,
                  const ConvexPartition& partition, const Paths& given, ExecutionContext& context,
                  std::vector<Vector2>* drawing) {
  Tracer tracer(surface, domain, partition, drawing);
  for (Index e = 0; e < static_cast<Index>(partition.edges.size()); ++e) {
    if (partition.edges[static_cast<std::size_t>(e)].boundary) tracer.lay_outline(e);
  }
  for (Index e = 0; e < static_cast<Index>(partition.edges.size()); ++e) {
    if (!given[static_cast<std::size_t>(e)].empty())
      tracer.lay_given(e, given[static_cast<std::size_t>(e)]);
  }
  for (const Index v : domain.outline) tracer.anchor(v);
  std::vector<bool> settled;
  for (const auto& path : given) settled.push_back(!path.empty());
  const std::vector<Index> order = tracing_order(domain, partition, settled);
  for (std::size_t i = 0; i < order.size(); ++i) {
    context.report("tracing paths", static_cast<double>(i) / static_cast<double>(order.size()));
    tracer.trace(order[i], context);
  }
  return tracer.finish();
}

}  // namespace flipfree
