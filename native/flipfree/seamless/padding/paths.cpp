#include "flipfree/seamless/padding/paths.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <set>

#include "flipfree/base/error.h"

namespace flipfree::seamless {

Canvas::Canvas(const mesh::Surface& surface, const std::vector<Index>& cones,
               const ExecutionContext& context)
    : refined_(mesh::unrefined(surface)),
      cones_(cones),
      context_(context),
      state_(cones.size(), State::kFree) {
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

std::vector<HalfedgeId> Canvas::inside(const std::vector<HalfedgeId>& sectors) const {
  std::vector<HalfedgeId> found;
  for (const HalfedgeId sector : sectors) {
    for (HalfedgeId h = mesh().rotate_ccw(sector); !is_drawn(h); h = mesh().rotate_ccw(h))
      found.push_back(h);
  }
  return found;
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
  std::vector<EdgeEnds> ends;
  for (const HalfedgeId h : chain) ends.emplace_back(mesh().source(h), mesh().target(h));
  while (ends.size() < edges) {
    const auto longest = std::max_element(
        ends.begin(), ends.end(),
        [&](const EdgeEnds& a, const EdgeEnds& b) { return length(edge(a)) < length(edge(b)); });
    const VertexId target = longest->second;
    const VertexId s = split(edge(*longest));
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

Index DiskBoundary::corners_between(Index from, Index to) const {
  const Index rest = corners_below[at(to)] - corners_below[at(from) + 1];
  return from < to ? rest : rest + corners_below.back();
}

std::vector<Index> DiskBoundary::places_between(Index from, Index to) const {
  std::vector<Index> places;
  for (Index i = (from + 1) % size(); i != to; i = (i + 1) % size()) places.push_back(i);
  return places;
}

DiskBoundary::DiskBoundary(Canvas& drawn_on)
    : canvas(drawn_on), place(at(drawn_on.mesh().halfedge_slots()), kInvalid) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  HalfedgeId start = kInvalid;  // drawn, at a node
  for (VertexId v = 0; start == kInvalid; ++v) {
    if (v == canvas.vertex_count()) throw InternalError("curves without a node");
    if (!canvas.on_curve(v)) continue;
    const std::vector<HalfedgeId> drawn = canvas.drawn_around(v);
    if (drawn.size() > 2) start = drawn.front();
  }
  HalfedgeId h = start;
  do {
    place[at(h)] = size();
    corner.push_back(canvas.drawn_around(mesh.source(h)).size() > 2 ? 1 : 0);
    halfedges.push_back(h);
    h = canvas.sector_of(next_corner(h));
  } while (h != start);
  Index corners = 0;
  Index branches = 0;
  for (Index i = 0; i < size(); ++i) {
    corners_below.push_back(corners);
    corners += corner[at(i)];
    const Index mate = place[at(mesh.opposite(halfedges[at(i)]))];
    if (corner[at(i)] == 0) {
      branch.push_back(branch.back());
    } else {
      // The branch's other side ends where this one begins.
      branch.push_back(mate < i ? branch[at(mate)] : branches++);
    }
  }
  corners_below.push_back(corners);
}

namespace {

// Per half-edge an integer, opposite ones of opposite signs, such that those along a simple closed
// counter-clockwise edge path through no cone, within the disk or on its boundary, sum to the
// excess (k - 4) of the cones that it encloses: ways from face to face lead from every cone to
// the boundary, and a path that crosses one from left to right passes that cone. Cost: O(#F).
std::vector<Index> excess_crossed(const DiskBoundary& boundary) {
  const Canvas& canvas = boundary.canvas;
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  // Faces breadth first, each by its half-edge towards the one that it was reached from.
  std::vector<HalfedgeId> back = {boundary.halfedges.front()};
  std::vector<char> seen(at(mesh.face_slots()), 0);
  seen[at(back.front() / 3)] = 1;
  for (std::size_t i = 0; i < back.size(); ++i) {
    const HalfedgeId first = back[i] - back[i] % 3;
    for (HalfedgeId h = first; h < first + 3; ++h) {
      const HalfedgeId o = mesh.opposite(h);
      if (!canvas.is_drawn(h) && std::exchange(seen[at(o / 3)], 1) == 0) back.push_back(o);
    }
  }
  std::vector<Index> beyond(at(mesh.face_slots()), 0);
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (canvas.excess(v) != 0) beyond[at(mesh.outgoing(v) / 3)] += canvas.excess(v);
  }
  std::vector<Index> crossed(at(mesh.halfedge_slots()), 0);
  for (std::size_t i = back.size(); i-- > 0;) {
    const HalfedgeId h = back[i], o = mesh.opposite(h);
    crossed[at(h)] = beyond[at(h / 3)];
    if (i == 0) break;  // out of the disk
    crossed[at(o)] = -beyond[at(h / 3)];
    beyond[at(o / 3)] += beyond[at(h / 3)];
  }
  return crossed;
}

}  // namespace

std::int64_t SheetSearch::label(HalfedgeId arrival, double gathered) const {
  const double sheet = std::round(gathered * cover_.per_unit);
  if (!(std::abs(sheet) <= static_cast<double>(cover_.sheets))) return kInvalid;
  const auto v = static_cast<std::int64_t>(canvas_.mesh().target(arrival));
  return v * (2 * cover_.sheets + 1) + static_cast<std::int64_t>(sheet) + cover_.sheets;
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
  queue_.emplace(way.length + left_[at(v)], static_cast<Index>(ways_.size()));
  ways_.push_back(way);
}

void SheetSearch::run(const std::function<void(const Way&)>& arrive, const double& limit) {
  const auto call = [&] {
    for (const Way& arrival : arrivals_) arrive(arrival);
    arrivals_.clear();
  };
  call();
  constexpr int kWaysPerCheck = 512;
  for (int step = 1; !queue_.empty() && queue_.top().first < limit; ++step) {
    if (step % kWaysPerCheck == 0) canvas_.context().check();
    if (ways_.size() > cover_.most * at(canvas_.vertex_count())) break;
    const Index index = queue_.top().second;
    queue_.pop();
    const Way way = ways_[at(index)];
    // A shorter one may have come.
    if (shortest_.at(label(way.arrival, way.gathered)) < way.length) continue;
    cover_.leave(way.arrival, [&](HalfedgeId h, double more) {
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

const TurnMeter::Known& TurnMeter::known(HalfedgeId h) const {
  if (canvas_.vertex_count() != vertex_count_) {
    vertex_count_ = canvas_.vertex_count();
    known_.assign(at(canvas_.mesh().halfedge_slots()), {});
  }
  Known& entry = known_[at(h)];
  if (entry.length >= 0.0) return entry;
  const double a = canvas_.length(h), b = canvas_.length(previous_corner(h)),
               c = canvas_.length(next_corner(h));
  // Half of it, which needles do not spoil (Kahan).
  const double s = 0.5 * (a + b + c);
  const double corner = 2.0 * std::atan2(std::sqrt(std::max(0.0, (s - a) * (s - b))),
                                         std::sqrt(std::max(0.0, s * (s - c))));
  const HalfedgeId side = canvas_.input_side(h);
  return entry = {corner, side == kInvalid ? 0.0 : crossings_[at(side)], a};
}

SheetSearch turning_search(const TurnMeter& meter, const std::vector<double>& left,
                           std::int64_t sheets) {
  constexpr double kSheetsPerQuarter = 2.0;
  constexpr std::size_t kWaysPerSheet = 2;  // looked at, per vertex
  return {meter.canvas(),
          left,
          {[&meter](HalfedgeId arrival, const SheetSearch::Visit& visit) {
             meter.for_each_turn(arrival, visit);
           },
           kSheetsPerQuarter / kQuarterTurn, sheets, kWaysPerSheet * at(sheets)}};
}

namespace {

// Ways per vertex that are looked at before the search gives up; fewer where there is another way.
constexpr std::size_t kMostSeparating = 24;
constexpr std::size_t kMostEnclosing = 6;
constexpr std::int64_t kMostExcess = 1 << 24;

// Is a path between these places one that is looked for, with cones of this excess on its left?
using Fits = std::function<bool(const PathEnds& ends, Index enclosed)>;

std::vector<HalfedgeId> shortest_on_cover(const DiskBoundary& boundary,
                                          const std::vector<Index>& from,
                                          const std::vector<Index>& to, const Fits& fits,
                                          std::size_t most) {
  const Canvas& canvas = boundary.canvas;
  const std::vector<Index> crossed = excess_crossed(boundary);
  // Per place, and in all: excess crossed by the boundary before it.
  std::vector<Index> along = {0};
  for (const HalfedgeId h : boundary.halfedges) along.push_back(along.back() + crossed[at(h)]);
  // What makes ways comparable that began in different places: which way they would go on in a
  // flat metric with right angles at corners.
  const auto share = [&](Index place) {
    return along[at(place)] - boundary.corners_below[at(place)];
  };
  std::vector<char> is_end(at(boundary.size()), 0);
  std::vector<HalfedgeId> sectors;
  for (const Index place : to) {
    is_end[at(place)] = 1;
    sectors.push_back(boundary.halfedges[at(place)]);
  }
  const std::vector<double> left = free_distances(canvas, canvas.inside(sectors)).distance;
  const auto leave = [&](HalfedgeId arrival, const SheetSearch::Visit& visit) {
    canvas.mesh().for_each_outgoing(canvas.mesh().target(arrival),
                                    [&](HalfedgeId h) { visit(h, crossed[at(h)]); });
  };
  SheetSearch search(canvas, left, {leave, 1.0, kMostExcess, most});
  for (const Index place : from) {
    for (const HalfedgeId h : canvas.inside({boundary.halfedges[at(place)]}))
      search.start(h, place, share(place) + crossed[at(h)]);
  }
  std::vector<HalfedgeId> best;
  double least = FreeDistances::kUnreached;
  const auto arrive = [&](const SheetSearch::Way& way) {
    if (way.length >= least) return;
    const PathEnds ends{way.from, boundary.place[at(canvas.sector_reached(way.arrival))]};
    if (ends.from == ends.to || is_end[at(ends.to)] == 0) return;
    // Closed along the boundary, counter-clockwise.
    Index enclosed = static_cast<Index>(way.gathered) - share(ends.from) + along[at(ends.from)] -
                     along[at(ends.to)];
    if (ends.from < ends.to) enclosed += along.back();
    if (!fits(ends, enclosed)) return;
    least = way.length;
    best = search.path(way);
  };
  search.run(arrive, least);
  return best;
}

}  // namespace

std::vector<HalfedgeId> shortest_separating_path(
    const DiskBoundary& boundary, const std::vector<Index>& from, const std::vector<Index>& to,
    const std::function<bool(const PathEnds&)>& allowed) {
  const Fits fits = [&](const PathEnds& ends, Index enclosed) {
    const Index corners = boundary.left_corners(ends);
    return corners % 4 != 0 && corners == 4 + enclosed && allowed(ends);
  };
  return shortest_on_cover(boundary, from, to, fits, kMostSeparating);
}

std::vector<HalfedgeId> shortest_enclosing_path(const DiskBoundary& boundary, const PathEnds& ends,
                                                Index excess) {
  const Fits fits = [&](const PathEnds&, Index enclosed) { return enclosed == excess; };
  return shortest_on_cover(boundary, {ends.from}, {ends.to}, fits, kMostEnclosing);
}

namespace {

class Fencer {
 public:
  explicit Fencer(const DiskBoundary& boundary) : canvas_(boundary.canvas) {
    for (const HalfedgeId h : boundary.halfedges)
      places_.emplace_back(canvas_.mesh().source(h), canvas_.mesh().target(h));
  }

  // Refinement renumbers half-edges: places are known by their edge's ends.
  HalfedgeId sector(Index place) const { return canvas_.edge(places_[at(place)]); }

  // A tree from places of the boundary to all these cones. Returns the vertex and the second one of
  // the first fence.
  EdgeEnds fence(const std::vector<Index>& places, std::set<VertexId> cones) {
    EdgeEnds first = {kInvalid, kInvalid};
    std::vector<VertexId> tree;
    const mesh::EditableTriangulation& mesh = canvas_.mesh();
    while (!cones.empty()) {
      std::vector<HalfedgeId> sectors;
      for (const Index place : places) sectors.push_back(sector(place));
      std::vector<HalfedgeId> from = canvas_.inside(sectors);
      for (const VertexId v : tree) {
        mesh.for_each_outgoing(v, [&](HalfedgeId h) {
          if (!canvas_.is_drawn(h)) from.push_back(h);
        });
      }
      const std::vector<HalfedgeId> path = find(
          from, [&](HalfedgeId h) { return cones.contains(mesh.target(h)); }, *cones.begin());
      if (tree.empty()) first = {mesh.source(path.front()), mesh.target(path.front())};
      for (const HalfedgeId h : path) tree.push_back(mesh.target(h));
      cones.erase(tree.back());
      canvas_.draw(path, Curve::kFence);
    }
    return first;
  }
  // One from places of the boundary to all other cones.
  void fence_others(const std::vector<Index>& places, const std::vector<VertexId>& cones) {
    std::set<VertexId> others;
    for (VertexId v = 0; v < canvas_.vertex_count(); ++v) {
      if (canvas_.excess(v) != 0) others.insert(v);
    }
    for (const VertexId v : cones) others.erase(v);
    fence(places, std::move(others));
  }

  std::vector<HalfedgeId> pass(HalfedgeId from, HalfedgeId to) {
    std::vector<HalfedgeId> path = find(
        canvas_.inside({from}), [&](HalfedgeId h) { return canvas_.sector_reached(h) == to; },
        canvas_.mesh().source(from));
    canvas_.remove_fences();
    return path;
  }

 private:
  std::vector<HalfedgeId> find(const std::vector<HalfedgeId>& first,
                               const std::function<bool(HalfedgeId)>& is_end,
                               VertexId place) const {
    std::vector<HalfedgeId> path = free_path(canvas_, first, is_end);
    if (!path.empty()) return path;
    throw_not_converged(ErrorCode::kIterationLimit,
                        "The cut found no way between the cones from vertex " + vertex_id(place) +
                            " on. Refine the mesh, or take other cones.",
                        ElementKind::kVertex, {place});
  }

  Canvas& canvas_;
  std::vector<EdgeEnds> places_;
};

}  // namespace

std::vector<HalfedgeId> fenced_path(const DiskBoundary& boundary, const PathEnds& ends,
                                    const std::vector<VertexId>& inside) {
  Fencer fencer(boundary);
  fencer.fence(boundary.places_between(ends.to, ends.from), {inside.begin(), inside.end()});
  fencer.fence_others(boundary.places_between(ends.from, ends.to), inside);
  return fencer.pass(fencer.sector(ends.from), fencer.sector(ends.to));
}

std::vector<HalfedgeId> fenced_loop(const DiskBoundary& boundary, Index place, VertexId inside) {
  Fencer fencer(boundary);
  // The fence to the cone divides the place's sector in two: the loop's ends.
  const EdgeEnds first = fencer.fence({place}, {inside});
  fencer.fence_others(boundary.places_between(place, place), {inside});
  return fencer.pass(boundary.canvas.edge(first), fencer.sector(place));
}

namespace {

// Dijkstra's algorithm through free vertices. arrive(h, distance): of half-edges to vertices that
// are not free; ends at `limit`, which it may lower.
template <typename Arrive>
FreeDistances search_free(const Canvas& canvas, const std::vector<HalfedgeId>& first, VertexId root,
                          const Arrive& arrive, const double& limit) {
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
  constexpr int kStepsPerCheck = 4096;
  for (int step = 1; !queue.empty() && queue.top().first < limit; ++step) {
    if (step % kStepsPerCheck == 0) canvas.context().check();
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
                             VertexId root) {
  return search_free(
      canvas, first, root, [](HalfedgeId, double) {}, FreeDistances::kUnreached);
}

std::vector<HalfedgeId> free_path(const Canvas& canvas, const std::vector<HalfedgeId>& first,
                                  const std::function<bool(HalfedgeId)>& is_end) {
  canvas.context().check();
  // Edges between vertices that are not free are drawn or were split: paths have two edges or more.
  double least = FreeDistances::kUnreached;
  HalfedgeId last = kInvalid;
  const auto arrive = [&](HalfedgeId h, double distance) {
    if (distance >= least || !is_end(h)) return;
    least = distance;
    last = h;
  };
  const FreeDistances found = search_free(canvas, first, kInvalid, arrive, least);
  std::vector<HalfedgeId> path;
  for (HalfedgeId h = last; h != kInvalid; h = found.arrival[at(canvas.mesh().source(h))])
    path.push_back(h);
  std::reverse(path.begin(), path.end());
  return path;
}

}  // namespace flipfree::seamless
