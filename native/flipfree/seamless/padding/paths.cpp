#include "flipfree/seamless/padding/paths.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <set>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::seamless {

mesh::RefinedSurface unrefined(const mesh::Surface& surface) {
  mesh::RefinedSurface refined;
  refined.input = &surface;
  const auto n = static_cast<Index>(surface.vertices.rows());
  for (Index v = 0; v < n; ++v) {
    refined.support.push_back({{v, kInvalid, kInvalid}, {1.0, 0.0, 0.0}});
    refined.position.emplace_back(surface.vertices.row(v).transpose());
  }
  refined.mesh = mesh::EditableTriangulation(n, surface.faces);
  return refined;
}

Canvas::Canvas(const mesh::Surface& surface, const std::vector<Index>& cones)
    : refined_(unrefined(surface)), cones_(cones), state_(cones.size(), State::kFree) {
  const auto n = static_cast<VertexId>(cones.size());
  for (VertexId v = 0; v < n; ++v) {
    if (excess(v) != 0) state_[at(v)] = State::kCone;
  }
  for (VertexId v = 0; v < n; ++v) {
    if (!is_free(v)) refine_around(v);
  }
}

double Canvas::length(HalfedgeId h) const {
  return (refined_.position[at(mesh().source(h))] - refined_.position[at(mesh().target(h))]).norm();
}

double Canvas::length(const std::vector<HalfedgeId>& path) const {
  double sum = 0.0;
  for (const HalfedgeId h : path) sum += length(h);
  return sum;
}

HalfedgeId Canvas::sector_of(HalfedgeId h) const {
  while (!is_drawn(h)) h = mesh().rotate_cw(h);
  return h;
}

std::vector<HalfedgeId> Canvas::drawn_around(VertexId v) const {
  std::vector<HalfedgeId> drawn;
  mesh().for_each_outgoing(v, [&](HalfedgeId h) {
    if (is_drawn(h)) drawn.push_back(h);
  });
  return drawn;
}

std::vector<HalfedgeId> Canvas::edges_along(const std::vector<VertexId>& vertices) const {
  std::vector<HalfedgeId> edges;
  for (std::size_t i = 0; i + 1 < vertices.size(); ++i)
    edges.push_back(mesh().find(vertices[i], vertices[i + 1]));
  return edges;
}

std::vector<HalfedgeId> Canvas::edges_of(std::vector<VertexId> cycle) const {
  cycle.push_back(cycle.front());
  return edges_along(cycle);
}

void Canvas::draw(const std::vector<HalfedgeId>& path, Curve kind) {
  std::vector<VertexId> taken;
  for (const HalfedgeId h : path) {
    refined_.mesh.set_mark(h, static_cast<Index>(kind));
    for (const VertexId v : {mesh().source(h), mesh().target(h)}) {
      if (on_curve(v) || state_[at(v)] == State::kFenced) continue;
      // A cone at the end of a fence is a cone again when the fence goes.
      state_[at(v)] = kind == Curve::kFence ? State::kFenced : State::kOnCurve;
      taken.push_back(v);
    }
  }
  for (const VertexId v : taken) refine_around(v);
}

void Canvas::erase(const std::vector<HalfedgeId>& path) {
  for (const HalfedgeId h : path) refined_.mesh.set_mark(h, static_cast<Index>(Curve::kNone));
  for (const HalfedgeId h : path) {
    for (const VertexId v : {mesh().source(h), mesh().target(h)}) {
      if (drawn_around(v).empty()) state_[at(v)] = State::kFree;
    }
  }
}

void Canvas::erase_all() {
  std::vector<HalfedgeId> drawn;
  for (HalfedgeId h = 0; h < mesh().halfedge_slots(); ++h) {
    if (is_drawn(h)) drawn.push_back(h);
  }
  erase(drawn);
}

std::vector<VertexId> Canvas::divide(const std::vector<HalfedgeId>& chain, std::size_t edges) {
  std::vector<std::pair<VertexId, VertexId>> ends;
  for (const HalfedgeId h : chain) ends.emplace_back(mesh().source(h), mesh().target(h));
  while (ends.size() < edges) {
    const auto longest =
        std::max_element(ends.begin(), ends.end(), [&](const auto& a, const auto& b) {
          return length(mesh().find(a.first, a.second)) < length(mesh().find(b.first, b.second));
        });
    const VertexId target = longest->second;
    const VertexId s = split(mesh().find(longest->first, target));
    state_[at(s)] = State::kOnCurve;
    longest->second = s;
    ends.insert(longest + 1, {s, target});
    refine_around(s);
  }
  std::vector<VertexId> vertices = {ends.front().first};
  for (const auto& [source, target] : ends) vertices.push_back(target);
  return vertices;
}

void Canvas::remove_fences() {
  for (HalfedgeId h = 0; h < mesh().halfedge_slots(); ++h) {
    if (curve(h) == Curve::kFence) refined_.mesh.set_mark(h, static_cast<Index>(Curve::kNone));
  }
  for (VertexId v = 0; v < vertex_count(); ++v) {
    if (state_[at(v)] == State::kFenced)
      state_[at(v)] = excess(v) == 0 ? State::kFree : State::kCone;
  }
}

HalfedgeId Canvas::input_side(HalfedgeId h) const {
  const FaceId parent = mesh().parent(h / 3);
  if (parent == mesh().parent(mesh().opposite(h) / 3)) return kInvalid;
  for (HalfedgeId side = 3 * parent; side < 3 * parent + 3; ++side) {
    // The edge lies where the corner beyond the side has no weight.
    const HalfedgeId beyond = previous_corner(side);
    const VertexId apex = refined_.input->faces(beyond / 3, beyond % 3);
    if (refined_.support[at(mesh().source(h))].of(apex) == 0.0 &&
        refined_.support[at(mesh().target(h))].of(apex) == 0.0)
      return side;
  }
  throw InternalError("an edge between two faces that lies on no side of them");
}

VertexId Canvas::split(HalfedgeId h) {
  const HalfedgeId o = mesh().opposite(h);
  const mesh::Support where = mesh::rounded_between(refined_.support[at(mesh().source(h))],
                                                    refined_.support[at(mesh().target(h))], 0.5);
  const auto has_room = [&](HalfedgeId side) {
    const FaceId parent = mesh().parent(side / 3);
    const mesh::Support& apex = refined_.support[at(mesh().apex(side))];
    return refined_.orientation_in_parent(parent, refined_.support[at(mesh().source(side))], where,
                                          apex) > 0 &&
           refined_.orientation_in_parent(parent, where, refined_.support[at(mesh().target(side))],
                                          apex) > 0;
  };
  if (!has_room(h) || !has_room(o)) {
    throw_not_converged(ErrorCode::kIterationLimit,
                        "The curves of the cut leave no room in double precision for another "
                        "vertex at vertex " +
                            vertex_id(mesh().source(h)) +
                            ". Refine the mesh there, or take other cones.",
                        ElementKind::kVertex, {mesh().source(h)});
  }
  const VertexId s = refined_.split_edge(h, where);
  state_.push_back(State::kFree);
  return s;
}

void Canvas::refine_around(VertexId v) {
  std::vector<VertexId> taken;
  mesh().for_each_outgoing(v, [&](HalfedgeId h) {
    if (!is_drawn(h) && !is_free(mesh().target(h))) taken.push_back(mesh().target(h));
  });
  for (const VertexId w : taken) split(mesh().find(v, w));
}

namespace {

HalfedgeId some_drawn_at_node(const Canvas& canvas) {
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (!canvas.on_curve(v)) continue;
    const std::vector<HalfedgeId> drawn = canvas.drawn_around(v);
    if (drawn.size() > 2) return drawn.front();
  }
  throw InternalError("curves without a node");
}

// The faces from the root on, each after the one that it was reached from, across `back`.
struct FaceTree {
  std::vector<FaceId> order;
  std::vector<HalfedgeId> back;  // per face: its half-edge towards the root; kInvalid at the root
};

FaceTree breadth_first(const Canvas& canvas, FaceId root) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  FaceTree tree;
  tree.order.push_back(root);
  tree.back.assign(at(mesh.face_slots()), kInvalid);
  std::vector<char> seen(at(mesh.face_slots()), 0);
  seen[at(root)] = 1;
  for (std::size_t i = 0; i < tree.order.size(); ++i) {
    for (HalfedgeId h = 3 * tree.order[i]; h < 3 * tree.order[i] + 3; ++h) {
      const HalfedgeId o = mesh.opposite(h);
      if (canvas.is_drawn(h) || seen[at(o / 3)] != 0) continue;
      seen[at(o / 3)] = 1;
      tree.back[at(o / 3)] = o;
      tree.order.push_back(o / 3);
    }
  }
  return tree;
}

}  // namespace

Index DiskBoundary::corners_between(Index from, Index to) const {
  const Index rest = corners_below[at(to)] - corners_below[at(from) + 1];
  return from < to ? rest : rest + corners_below.back();
}

std::vector<Index> DiskBoundary::places_between(Index from, Index to) const {
  std::vector<Index> places;
  for (Index i = (from + 1) % size(); i != to; i = (i + 1) % size()) places.push_back(i);
  return places;
}

DiskBoundary disk_boundary(const Canvas& canvas) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  DiskBoundary boundary;
  boundary.place.assign(at(mesh.halfedge_slots()), kInvalid);
  const HalfedgeId start = some_drawn_at_node(canvas);
  HalfedgeId h = start;
  do {
    boundary.place[at(h)] = boundary.size();
    boundary.corner.push_back(canvas.drawn_around(mesh.source(h)).size() > 2 ? 1 : 0);
    boundary.halfedges.push_back(h);
    h = canvas.sector_of(next_corner(h));
  } while (h != start);
  for (HalfedgeId d = 0; d < mesh.halfedge_slots(); ++d) {
    if (canvas.is_drawn(d) && boundary.place[at(d)] == kInvalid)
      throw InternalError("the curves do not cut the surface into one disk");
  }
  Index corners = 0;
  Index branches = 0;
  for (Index i = 0; i < boundary.size(); ++i) {
    boundary.corners_below.push_back(corners);
    corners += boundary.corner[at(i)];
    const Index mate = boundary.place[at(mesh.opposite(boundary.halfedges[at(i)]))];
    if (boundary.corner[at(i)] == 0) {
      boundary.branch.push_back(boundary.branch.back());
    } else {
      // The branch's other side ends where this one begins.
      boundary.branch.push_back(mate < i ? boundary.branch[at(mate)] : branches++);
    }
  }
  boundary.corners_below.push_back(corners);
  return boundary;
}

namespace {

// Per half-edge an integer, opposite ones of opposite signs, such that those along a simple closed
// counter-clockwise edge path through no cone, within the disk or on its boundary, sum to the
// excess (k - 4) of the cones that it encloses: ways from face to face lead from every cone to
// the boundary, and a path that crosses one from left to right passes that cone. Cost: O(#F).
std::vector<Index> excess_crossed(const Canvas& canvas, const DiskBoundary& boundary) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  const HalfedgeId exit = boundary.halfedges.front();
  const FaceTree tree = breadth_first(canvas, exit / 3);
  std::vector<Index> beyond(at(mesh.face_slots()), 0);
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (canvas.excess(v) != 0) beyond[at(mesh.outgoing(v) / 3)] += canvas.excess(v);
  }
  std::vector<Index> crossed(at(mesh.halfedge_slots()), 0);
  for (auto face = tree.order.rbegin(); face != tree.order.rend(); ++face) {
    const HalfedgeId back = tree.back[at(*face)];
    if (back == kInvalid) {
      crossed[at(exit)] = beyond[at(*face)];
    } else {
      crossed[at(back)] = beyond[at(*face)];
      crossed[at(mesh.opposite(back))] = -beyond[at(*face)];
      beyond[at(mesh.opposite(back) / 3)] += beyond[at(*face)];
    }
  }
  return crossed;
}

}  // namespace

std::int64_t SheetSearch::label(HalfedgeId arrival, double gathered) const {
  const double sheet = std::round(gathered * per_unit_);
  if (!(std::abs(sheet) <= static_cast<double>(sheets_))) return kInvalid;
  const auto v = static_cast<std::int64_t>(canvas_.mesh().target(arrival));
  return v * (2 * sheets_ + 1) + static_cast<std::int64_t>(sheet) + sheets_;
}

bool SheetSearch::meets_itself(Index way, VertexId v) const {
  const auto nearest = nearest_.find(v);
  if (nearest == nearest_.end()) return false;
  // The parts of the way that are shorter than any to v do not end there.
  for (; way != kInvalid && ways_[at(way)].length >= nearest->second; way = ways_[at(way)].before) {
    if (canvas_.mesh().target(ways_[at(way)].arrival) == v) return true;
  }
  return false;
}

void SheetSearch::cross(HalfedgeId h, Index before, Index from, double gathered, double length) {
  const VertexId v = canvas_.mesh().target(h);
  const Way way{h, before, from, gathered, length + canvas_.length(h)};
  if (canvas_.on_curve(v)) arrivals_.push_back(way);
  if (!canvas_.is_free(v) || std::isinf(left_[at(v)])) return;
  const std::int64_t place = label(h, gathered);
  if (place == kInvalid) return;
  const auto [known, is_new] = shortest_.try_emplace(place, way.length);
  if (!is_new && known->second <= way.length) return;
  if (meets_itself(before, v)) {
    if (is_new) shortest_.erase(known);
    return;
  }
  known->second = way.length;
  const auto [nearest, is_first] = nearest_.try_emplace(v, way.length);
  if (!is_first) nearest->second = std::min(nearest->second, way.length);
  queue_.emplace_back(way.length + left_[at(v)], static_cast<Index>(ways_.size()));
  std::push_heap(queue_.begin(), queue_.end(), std::greater<>());
  ways_.push_back(way);
}

void SheetSearch::run(const Leave& leave, const std::function<void(const Way&)>& arrive,
                      const double& limit, std::size_t most, const ExecutionContext& context) {
  const auto call = [&] {
    for (const Way& arrival : arrivals_) arrive(arrival);
    arrivals_.clear();
  };
  call();
  constexpr int kWaysPerCheck = 512;
  for (int step = 1; !queue_.empty() && queue_.front().first < limit; ++step) {
    if (step % kWaysPerCheck == 0) context.check();
    if (ways_.size() > most * at(canvas_.vertex_count())) break;
    std::pop_heap(queue_.begin(), queue_.end(), std::greater<>());
    const Index index = queue_.back().second;
    queue_.pop_back();
    const Way way = ways_[at(index)];
    // A shorter one may have come.
    if (shortest_.at(label(way.arrival, way.gathered)) < way.length) continue;
    leave(way.arrival, [&](HalfedgeId h, double more) {
      cross(h, index, way.from, way.gathered + more, way.length);
    });
    call();
  }
}

std::vector<HalfedgeId> SheetSearch::path(const Way& way) const {
  std::vector<HalfedgeId> path = {way.arrival};
  for (Index before = way.before; before != kInvalid; before = ways_[at(before)].before)
    path.push_back(ways_[at(before)].arrival);
  std::reverse(path.begin(), path.end());
  return path;
}

namespace {

// Ways per vertex that are looked at before the search gives up; fewer where there is another way.
constexpr std::size_t kMostSeparating = 24;
constexpr std::size_t kMostEnclosing = 6;
constexpr std::int64_t kMostExcess = 1 << 24;

// Is a path between these places one that is looked for, with cones of this excess on its left?
using Fits = std::function<bool(const PathEnds& ends, Index enclosed)>;

std::vector<HalfedgeId> shortest_on_cover(const Canvas& canvas, const DiskBoundary& boundary,
                                          const std::vector<Index>& from,
                                          const std::vector<Index>& to, const Fits& fits,
                                          std::size_t most, const ExecutionContext& context) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  const std::vector<Index> crossed = excess_crossed(canvas, boundary);
  std::vector<Index> along = {
      0};  // per place, and in all: excess crossed by the boundary before it
  for (const HalfedgeId h : boundary.halfedges) along.push_back(along.back() + crossed[at(h)]);
  // What makes ways comparable that began in different places: which way they would go on in a
  // flat metric with right angles at corners.
  const auto share = [&](Index place) {
    return along[at(place)] - boundary.corners_below[at(place)];
  };
  std::vector<char> is_end(at(boundary.size()), 0);
  std::vector<HalfedgeId> last;
  for (const Index place : to) {
    is_end[at(place)] = 1;
    canvas.for_each_inside(boundary.halfedges[at(place)], [&](HalfedgeId h) { last.push_back(h); });
  }
  const std::vector<double> left = free_distances(canvas, last, kInvalid, context).distance;
  SheetSearch search(canvas, left, 1.0, kMostExcess);
  for (const Index place : from) {
    canvas.for_each_inside(boundary.halfedges[at(place)], [&](HalfedgeId h) {
      search.start(h, place, share(place) + crossed[at(h)]);
    });
  }
  std::vector<HalfedgeId> best;
  double least = FreeDistances::kUnreached;
  const auto leave = [&](HalfedgeId arrival, const SheetSearch::Visit& visit) {
    mesh.for_each_outgoing(mesh.target(arrival), [&](HalfedgeId h) { visit(h, crossed[at(h)]); });
  };
  const auto arrive = [&](const SheetSearch::Way& way) {
    if (way.length >= least) return;
    const HalfedgeId sector = canvas.sector_of(mesh.opposite(way.arrival));
    const PathEnds ends{way.from, boundary.place[at(sector)]};
    if (ends.from == ends.to || is_end[at(ends.to)] == 0) return;
    // Closed along the boundary, counter-clockwise.
    Index enclosed = static_cast<Index>(way.gathered) - share(ends.from) + along[at(ends.from)] -
                     along[at(ends.to)];
    if (ends.from < ends.to) enclosed += along.back();
    if (!fits(ends, enclosed)) return;
    least = way.length;
    best = search.path(way);
  };
  search.run(leave, arrive, least, most, context);
  return best;
}

}  // namespace

std::vector<HalfedgeId> shortest_separating_path(
    const Canvas& canvas, const DiskBoundary& boundary, const std::vector<Index>& from,
    const std::vector<Index>& to, const std::function<bool(const PathEnds&)>& allowed,
    const ExecutionContext& context) {
  const Fits fits = [&](const PathEnds& ends, Index enclosed) {
    const Index corners = left_corners(boundary, ends);
    return corners % 4 != 0 && corners == 4 + enclosed && allowed(ends);
  };
  return shortest_on_cover(canvas, boundary, from, to, fits, kMostSeparating, context);
}

std::vector<HalfedgeId> shortest_enclosing_path(const Canvas& canvas, const DiskBoundary& boundary,
                                                const PathEnds& ends, Index excess,
                                                const ExecutionContext& context) {
  const Fits fits = [&](const PathEnds&, Index enclosed) { return enclosed == excess; };
  return shortest_on_cover(canvas, boundary, {ends.from}, {ends.to}, fits, kMostEnclosing, context);
}

namespace {

[[noreturn]] void no_way(VertexId v) {
  throw_not_converged(ErrorCode::kIterationLimit,
                      "The cut found no way between the cones from vertex " + vertex_id(v) +
                          " on. Refine the mesh, or take other cones.",
                      ElementKind::kVertex, {v});
}

class Fencer {
 public:
  Fencer(Canvas& canvas, const DiskBoundary& boundary, const ExecutionContext& context)
      : canvas_(canvas), context_(context) {
    for (const HalfedgeId h : boundary.halfedges)
      places_.emplace_back(canvas.mesh().source(h), canvas.mesh().target(h));
  }

  // Refinement renumbers half-edges: places are known by their edge's ends.
  HalfedgeId sector(Index place) const {
    return canvas_.mesh().find(places_[at(place)].first, places_[at(place)].second);
  }

  // A tree from places of the boundary to all these cones. Returns the vertex and the second one of
  // the first fence.
  std::pair<VertexId, VertexId> fence(const std::vector<Index>& places, std::set<VertexId> cones) {
    std::pair<VertexId, VertexId> first = {kInvalid, kInvalid};
    std::vector<VertexId> tree;
    while (!cones.empty()) {
      WayStart from;
      for (const Index place : places) from.sectors.push_back(sector(place));
      from.vertices = tree;
      const std::vector<HalfedgeId> path = free_path(
          canvas_, from, {nullptr, [&](VertexId v) { return cones.contains(v); }}, context_);
      if (path.empty()) no_way(*cones.begin());
      if (tree.empty())
        first = {canvas_.mesh().source(path.front()), canvas_.mesh().target(path.front())};
      for (const HalfedgeId h : path) tree.push_back(canvas_.mesh().target(h));
      cones.erase(tree.back());
      canvas_.draw(path, Curve::kFence);
    }
    return first;
  }

  std::vector<HalfedgeId> pass(HalfedgeId from, HalfedgeId to) {
    std::vector<HalfedgeId> path = free_path(
        canvas_, {{from}, {}}, {[&](HalfedgeId s) { return s == to; }, nullptr}, context_);
    if (path.empty()) no_way(canvas_.mesh().source(from));
    canvas_.remove_fences();
    return path;
  }

 private:
  Canvas& canvas_;
  const ExecutionContext& context_;
  std::vector<std::pair<VertexId, VertexId>> places_;
};

std::set<VertexId> other_cones(const Canvas& canvas, const std::vector<VertexId>& cones) {
  std::set<VertexId> others;
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (canvas.excess(v) != 0) others.insert(v);
  }
  for (const VertexId v : cones) others.erase(v);
  return others;
}

}  // namespace

std::vector<HalfedgeId> fenced_path(Canvas& canvas, const DiskBoundary& boundary,
                                    const PathEnds& ends, const std::vector<VertexId>& inside,
                                    const ExecutionContext& context) {
  Fencer fencer(canvas, boundary, context);
  fencer.fence(boundary.places_between(ends.to, ends.from), {inside.begin(), inside.end()});
  fencer.fence(boundary.places_between(ends.from, ends.to), other_cones(canvas, inside));
  return fencer.pass(fencer.sector(ends.from), fencer.sector(ends.to));
}

std::vector<HalfedgeId> fenced_loop(Canvas& canvas, const DiskBoundary& boundary, Index place,
                                    VertexId inside, const ExecutionContext& context) {
  Fencer fencer(canvas, boundary, context);
  // The fence to the cone divides the place's sector in two: the loop's ends.
  const auto [root, second] = fencer.fence({place}, {inside});
  fencer.fence(boundary.places_between(place, place), other_cones(canvas, {inside}));
  return fencer.pass(canvas.mesh().find(root, second), fencer.sector(place));
}

namespace {

// Dijkstra's algorithm through free vertices. arrive(h, distance): of half-edges to vertices that
// are not free; ends at `limit`, which it may lower.
template <typename Arrive>
FreeDistances search_free(const Canvas& canvas, const std::vector<HalfedgeId>& first, VertexId root,
                          const Arrive& arrive, const double& limit,
                          const ExecutionContext& context) {
  using Entry = std::pair<double, VertexId>;
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  FreeDistances found;
  found.distance.assign(at(canvas.vertex_count()), FreeDistances::kUnreached);
  found.arrival.assign(at(canvas.vertex_count()), kInvalid);
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto cross = [&](HalfedgeId h, double so_far) {
    const VertexId v = mesh.target(h);
    const double distance = so_far + canvas.length(h);
    if (!canvas.is_free(v)) return arrive(h, distance);
    if (distance >= found.distance[at(v)]) return;
    found.distance[at(v)] = distance;
    found.arrival[at(v)] = h;
    queue.push({distance, v});
  };
  for (const HalfedgeId h : first) cross(h, 0.0);
  if (root != kInvalid) {
    found.distance[at(root)] = 0.0;
    found.arrival[at(root)] = kInvalid;
    queue.push({0.0, root});
  }
  std::vector<char> done(found.distance.size(), 0);
  for (int step = 1; !queue.empty() && queue.top().first < limit; ++step) {
    if (step % kFreeStepsPerCheck == 0) context.check();
    const auto [distance, v] = queue.top();
    queue.pop();
    if (done[at(v)] != 0) continue;
    done[at(v)] = 1;
    found.order.push_back(v);
    mesh.for_each_outgoing(v, [&, so_far = distance](HalfedgeId h) { cross(h, so_far); });
  }
  return found;
}

}  // namespace

FreeDistances free_distances(const Canvas& canvas, const std::vector<HalfedgeId>& first,
                             VertexId root, const ExecutionContext& context) {
  return search_free(
      canvas, first, root, [](HalfedgeId, double) {}, FreeDistances::kUnreached, context);
}

std::vector<HalfedgeId> free_path(const Canvas& canvas, const WayStart& from, const WayEnd& to,
                                  const ExecutionContext& context) {
  context.check();
  // Edges between vertices that are not free are drawn or were split: paths have two edges or more.
  std::vector<HalfedgeId> first;
  for (const HalfedgeId sector : from.sectors)
    canvas.for_each_inside(sector, [&](HalfedgeId h) { first.push_back(h); });
  for (const VertexId v : from.vertices) {
    canvas.mesh().for_each_outgoing(v, [&](HalfedgeId h) {
      if (!canvas.is_drawn(h)) first.push_back(h);
    });
  }
  double least = FreeDistances::kUnreached;
  HalfedgeId last = kInvalid;
  const auto is_end = [&](HalfedgeId h) {
    const VertexId v = canvas.mesh().target(h);
    if (canvas.on_curve(v))
      return to.sector && to.sector(canvas.sector_of(canvas.mesh().opposite(h)));
    return to.cone && to.cone(v);
  };
  const FreeDistances found = search_free(
      canvas, first, kInvalid,
      [&](HalfedgeId h, double distance) {
        if (distance >= least || !is_end(h)) return;
        least = distance;
        last = h;
      },
      least, context);
  std::vector<HalfedgeId> path;
  for (HalfedgeId h = last; h != kInvalid; h = found.arrival[at(canvas.mesh().source(h))])
    path.push_back(h);
  std::reverse(path.begin(), path.end());
  return path;
}

}  // namespace flipfree::seamless
