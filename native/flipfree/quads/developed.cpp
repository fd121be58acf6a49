#include "flipfree/quads/developed.h"

#include <algorithm>
#include <numbers>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/layout/layout.h"

namespace flipfree::quads {

Developed::Developed(const FlatSurface& map, const CoarseSurface& coarse,
                     const ExecutionContext& context)
    : map_(map),
      coarse_(coarse),
      from_(at(map.halfedges())),
      moved_(at(map.halfedges())),
      bends_(at(map.halfedges())) {
  for (HalfedgeId e = 0; e < coarse.halfedges(); ++e) depart_from_corner(e);
  for (std::size_t i = 0; i < queue_.size(); ++i) {
    if (i % 1024 == 0) context.check();
    cross(queue_[i]);
  }
}

Vector2 Developed::from_whole(HalfedgeId h) const {
  return turned(image(from_[at(h)].place), -from_[at(h)].turn);
}

void Developed::set(HalfedgeId h, Place place, Index turn) {
  if (h == kInvalid || is_known(h)) return;
  from_[at(h)] = {place, turn & 3};
  queue_.push_back(h);
}

// The map's half-edges at the vertex of e, counter-clockwise of e by less than half a turn.
void Developed::depart_from_corner(HalfedgeId e) {
  CornerId c = coarse_[e].start;
  Index turn = coarse_[e].start_turn;  // from e's chart to that of c
  Gauss way = turned(coarse_[e].edge, turn);
  if (quads::cross(way, map_[c].edge) == 0) set(c, {e / 3, origin(coarse_, e)}, -turn);
  while (true) {
    const HalfedgeId last = previous_corner(c);
    const Gauss next = -map_[last].edge;
    if (quads::cross(way, next) <= 0 || map_[last].opposite == kInvalid) return;
    const auto [corner, more] = sector_of(coarse_, e, turned(next, -turn));
    turn += map_[last].turn;
    way = turned(way, map_[last].turn);
    c = map_[last].opposite;
    set(c, {corner / 3, origin(coarse_, corner)}, more - turn);
  }
}

// The affine image of a place, in whole numbers from the first corner of its face.
Vector2 Developed::image(const Place& place) const {
  const std::size_t h = at(3 * place.face);
  const Gauss first = coarse_.sides[h].edge, second = first + coarse_.sides[h + 1].edge;
  const auto area = static_cast<double>(quads::cross(first, second));
  return static_cast<double>(quads::cross(place.at, second)) / area *
             as_vector(coarse_.sides[h].integer) +
         static_cast<double>(quads::cross(first, place.at)) / area *
             (as_vector(coarse_.sides[h].integer) + as_vector(coarse_.sides[h + 1].integer));
}

void Developed::cross(HalfedgeId h) {
  const Departure from = from_[at(h)];
  Vector2 start = image(from.place);
  Index turn = from.turn;
  const Gauss end = from.place.at + turned(map_[h].edge, from.turn);
  // One side of each edge says where it is crossed.
  const bool bends = map_[h].opposite == kInvalid || h < map_[h].opposite;
  const auto crossed = [&](HalfedgeId out, Gauss a, Gauss b) {
    const HalfedgeId o = coarse_[out].opposite;
    const Index by = coarse_[out].turn;
    const Gauss place = origin(coarse_, out), edge = coarse_[out].edge;
    const std::int64_t before = quads::cross(place - a, edge), all = quads::cross(b - a, edge);
    // Not where it begins or ends on the coarse edge.
    if (bends && before != 0 && before != all) {
      const auto area = static_cast<double>(all);
      const double share = static_cast<double>(quads::cross(a - place, b - a)) / area;
      const Vector2 bend = as_vector(origin(coarse_, out, &Side::integer)) - start -
                           share * as_vector(coarse_[out].integer);
      bends_[at(h)].push_back({static_cast<double>(before) / area, turned(bend, -turn)});
    }
    start = as_vector(origin(coarse_, next_corner(o), &Side::integer)) +
            turned(Vector2(start - as_vector(origin(coarse_, out, &Side::integer))), by);
    turn += by;
  };
  const Place to = walk(coarse_, from.place, end, crossed);
  if (to.face == kInvalid) throw InternalError("quads: an edge of the map leaves the surface");
  moved_[at(h)] = turned(Vector2(image(to) - start), -turn);
  spread(next_corner(h), to, turn);
}

// The same place for all half-edges at a vertex of the map; those at coarse vertices are known.
void Developed::spread(HalfedgeId first, const Place& place, Index turn) {
  if (is_known(first)) return;
  set(first, place, turn);
  Index ccw = turn, cw = turn;
  for (HalfedgeId h = first;;) {
    const HalfedgeId last = previous_corner(h);
    h = map_[last].opposite;
    if (h == first) return;
    if (h == kInvalid) break;
    ccw -= map_[last].turn;
    set(h, place, ccw);
  }
  for (HalfedgeId h = first; map_[h].opposite != kInvalid;) {
    cw -= map_[h].turn;
    h = next_corner(map_[h].opposite);
    set(h, place, cw);
  }
}

// From the half-edge's source as far as it is straight.
Vector2 Developed::first_piece(HalfedgeId h) const {
  const HalfedgeId o = map_[h].opposite;
  if (!bends_[at(h)].empty()) return bends_[at(h)].front().place;
  if (o == kInvalid || bends_[at(o)].empty()) return moved_[at(h)];
  return turned(Vector2(bends_[at(o)].back().place - moved_[at(o)]), map_[o].turn);
}

// From its target, backwards.
Vector2 Developed::last_piece(HalfedgeId h) const {
  const HalfedgeId o = map_[h].opposite;
  if (!bends_[at(h)].empty()) return bends_[at(h)].back().place - moved_[at(h)];
  if (o == kInvalid || bends_[at(o)].empty()) return -moved_[at(h)];
  return turned(bends_[at(o)].front().place, map_[o].turn);
}

intrinsic::EdgePointMap Developed::points(const Points2& corner_uv,
                                          const mesh::Adjacency& adjacency) const {
  intrinsic::EdgePointMap points;
  points.corner_uv = corner_uv;
  intrinsic::InputEdges edges = intrinsic::number_edges(adjacency);
  points.begin.push_back(0);
  for (const HalfedgeId h : edges.halfedge) {
    const HalfedgeId o = map_[h].opposite;
    for (const Bend& bend : bends_[at(h)]) {
      const Vector2 left = corner_uv.row(h).transpose() + bend.place;
      Vector2 right = left;
      if (o != kInvalid)
        right = corner_uv.row(next_corner(o)).transpose() + turned(bend.place, map_[h].turn);
      points.points.push_back({{1.0 - bend.along, bend.along}, left, right});
    }
    points.begin.push_back(static_cast<std::int64_t>(points.points.size()));
  }
  points.edge_halfedge = std::move(edges.halfedge);
  points.edge_of = std::move(edges.of_corner);
  // Angles, as parts between coarse edges: of each it is known that it is less than half a turn.
  std::vector<std::vector<HalfedgeId>> coarse_at(at(map_.halfedges()));
  for (HalfedgeId e = 0; e < coarse_.halfedges(); ++e) coarse_at[at(coarse_[e].start)].push_back(e);
  for (CornerId c = 0; c < map_.halfedges(); ++c) {
    std::vector<HalfedgeId>& between = coarse_at[at(c)];
    const auto old = [&](HalfedgeId e) { return turned(coarse_[e].edge, coarse_[e].start_turn); };
    std::sort(between.begin(), between.end(),
              [&](HalfedgeId a, HalfedgeId b) { return quads::cross(old(a), old(b)) > 0; });
    Vector2 last = first_piece(c);
    double angle = 0.0;
    const auto add = [&](const Vector2& next) {
      const double part = flipfree::turn(last, next);
      angle += part < -1e-9 ? part + 2.0 * std::numbers::pi : part;
      last = next;
    };
    for (const HalfedgeId e : between)
      add(turned(as_vector(coarse_[e].integer), coarse_[e].start_turn));
    add(last_piece(previous_corner(c)));
    points.corner_angle.push_back(angle);
  }
  return points;
}

}  // namespace flipfree::quads
