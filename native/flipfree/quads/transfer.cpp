#include "flipfree/quads/transfer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/conformal/map.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/intrinsic/layout/layout.h"
#include "flipfree/intrinsic/layout/refine_map.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/quads/places.h"
#include "flipfree/seamless/exact/take_back.h"

namespace flipfree::quads {

namespace {

// The map by the whole numbers that were chosen for its coarse surface: affine on each of the
// coarse triangles, so that no triangle flips once their edges are drawn on the map.
class Developed {
 public:
  // `coarse`: of `map`, with its integers. Cost: the coarse triangles that the map's edges cross.
  Developed(const FlatSurface& map, const CoarseSurface& coarse, const ExecutionContext& context)
      : map_(map),
        coarse_(coarse),
        from_(at(map.halfedges())),
        moved_(at(map.halfedges())),
        bends_(at(map.halfedges())) {
    for (HalfedgeId e = 0; e < coarse.halfedges(); ++e) depart_from_corner(e);
    for (std::size_t i = 0; i < queue_.size(); ++i) {
      if (i % 1024 == 0) context.check();
      trace(queue_[i]);
    }
  }

  // Per half-edge of the map, in the chart of its face: from one end to the other.
  const std::vector<Vector2>& edges() const { return moved_; }

  // Where the half-edge's source lies from a point of whole numbers, in the half-edge's chart.
  Vector2 from_whole(HalfedgeId h) const {
    return turned(image(from_[at(h)].place), -from_[at(h)].turn);
  }

  // The map with a point wherever one of its edges crosses a coarse one. `corner_uv`: 3 #F x 2, by
  // edges(); `adjacency`: of the map's triangles.
  intrinsic::EdgePointMap points(const Points2& corner_uv, const mesh::Adjacency& adjacency) const {
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
    for (HalfedgeId e = 0; e < coarse_.halfedges(); ++e)
      coarse_at[at(coarse_[e].start)].push_back(e);
    for (CornerId c = 0; c < map_.halfedges(); ++c) {
      std::vector<HalfedgeId>& between = coarse_at[at(c)];
      const auto old = [&](HalfedgeId e) { return turned(coarse_[e].edge, coarse_[e].start_turn); };
      std::sort(between.begin(), between.end(),
                [&](HalfedgeId a, HalfedgeId b) { return cross(old(a), old(b)) > 0; });
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

 private:
  // How a half-edge of the map leaves its vertex: the vertex's place on the coarse surface, in its
  // old integers; and by how many quarters vectors in the half-edge's chart turn to be ones there.
  struct Departure {
    Place place;
    Index turn = 0;
  };
  // Where a half-edge crosses a coarse edge: share of its length, and from its source.
  struct Bend {
    double along;
    Vector2 place;
  };

  bool is_known(HalfedgeId h) const { return from_[at(h)].place.face != kInvalid; }

  void set(HalfedgeId h, Place place, Index turn) {
    if (h == kInvalid || is_known(h)) return;
    from_[at(h)] = {place, turn & 3};
    queue_.push_back(h);
  }

  // The map's half-edges at the vertex of e, counter-clockwise of e by less than half a turn.
  void depart_from_corner(HalfedgeId e) {
    CornerId c = coarse_[e].start;
    Index turn = coarse_[e].start_turn;  // from e's chart to that of c
    Gauss way = turned(coarse_[e].edge, turn);
    if (cross(way, map_[c].edge) == 0) set(c, {e / 3, origin(coarse_, e)}, -turn);
    while (true) {
      const HalfedgeId last = previous_corner(c);
      const Gauss next = -map_[last].edge;
      if (cross(way, next) <= 0 || map_[last].opposite == kInvalid) return;
      const auto [corner, more] = sector_of(coarse_, e, turned(next, -turn));
      turn += map_[last].turn;
      way = turned(way, map_[last].turn);
      c = map_[last].opposite;
      set(c, {corner / 3, origin(coarse_, corner)}, more - turn);
    }
  }

  // The affine image of a place, in whole numbers from the first corner of its face.
  Vector2 image(const Place& place) const {
    const std::size_t h = at(3 * place.face);
    const Gauss first = coarse_.sides[h].edge, second = first + coarse_.sides[h + 1].edge;
    const auto area = static_cast<double>(cross(first, second));
    return static_cast<double>(cross(place.at, second)) / area *
               as_vector(coarse_.sides[h].integer) +
           static_cast<double>(cross(first, place.at)) / area *
               (as_vector(coarse_.sides[h].integer) + as_vector(coarse_.sides[h + 1].integer));
  }

  void trace(HalfedgeId h) {
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
      const std::int64_t before = cross(place - a, edge), all = cross(b - a, edge);
      // Not where it begins or ends on the coarse edge.
      if (bends && before != 0 && before != all) {
        const auto area = static_cast<double>(all);
        const double share = static_cast<double>(cross(a - place, b - a)) / area;
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
  void spread(HalfedgeId first, const Place& place, Index turn) {
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
  Vector2 first_piece(HalfedgeId h) const {
    const HalfedgeId o = map_[h].opposite;
    if (!bends_[at(h)].empty()) return bends_[at(h)].front().place;
    if (o == kInvalid || bends_[at(o)].empty()) return moved_[at(h)];
    return turned(Vector2(bends_[at(o)].back().place - moved_[at(o)]), map_[o].turn);
  }

  // From its target, backwards.
  Vector2 last_piece(HalfedgeId h) const {
    const HalfedgeId o = map_[h].opposite;
    if (!bends_[at(h)].empty()) return bends_[at(h)].back().place - moved_[at(h)];
    if (o == kInvalid || bends_[at(o)].empty()) return -moved_[at(h)];
    return turned(bends_[at(o)].front().place, map_[o].turn);
  }

  const FlatSurface& map_;
  const CoarseSurface& coarse_;
  std::vector<Departure> from_;
  std::vector<Vector2> moved_;
  std::vector<std::vector<Bend>> bends_;
  std::vector<HalfedgeId> queue_;
};

// Points of the cut map by its edges, face after face; one place per chart is given.
template <typename Base>
Points2 laid_out(const distortion::CutMap& cut, const std::vector<Vector2>& edges,
                 const Base& base) {
  const Triangles& faces = cut.surface.faces;
  const mesh::Adjacency& adjacency = cut.surface.adjacency();
  Points2 uv(cut.uv.rows(), 2);
  std::vector<char> placed(at(cut.uv.rows()), 0), reached(at(faces.rows()), 0);
  const auto place = [&](VertexId v, const Vector2& p) {
    if (placed[at(v)] == 0) uv.row(v) = p.transpose();
    placed[at(v)] = 1;
  };
  std::vector<FaceId> queue;
  for (FaceId seed = 0; seed < static_cast<FaceId>(faces.rows()); ++seed) {
    if (reached[at(seed)] != 0) continue;
    reached[at(seed)] = 1;
    place(faces(seed, 0), base(3 * seed));
    queue.assign(1, seed);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      HalfedgeId h = 3 * queue[i];
      while (placed[at(mesh::source(faces, h))] == 0) ++h;
      for (int k = 0; k < 2; ++k, h = next_corner(h))
        place(mesh::target(faces, h), uv.row(mesh::source(faces, h)).transpose() + edges[at(h)]);
      for (h = 3 * queue[i]; h < 3 * queue[i] + 3; ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        if (o == kInvalid || reached[at(o / 3)] != 0) continue;
        reached[at(o / 3)] = 1;
        queue.push_back(o / 3);
      }
    }
  }
  return uv;
}

// The surface cut along `cuts`, with corners at `uv`, and of what is to stay along the axes the
// border, if `aligned`, and `lines`: half-edges inside, of each edge one.
distortion::CutMap cut_of(const mesh::Surface& surface, const mesh::EdgeFlags& cuts,
                          const Points2& uv, bool aligned, const std::vector<HalfedgeId>& lines) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  distortion::CutMap cut = distortion::cut_map(surface, adjacency, cuts, uv);
  if (aligned) cut.straight = distortion::straight_boundary(cut, adjacency);
  for (const HalfedgeId line : lines) {
    // The side that runs forwards, so that neighbours in one chart are one line.
    distortion::StraightEdge side;
    for (const HalfedgeId h : {line, adjacency.opposite[at(line)]}) {
      const Vector2 e = (uv.row(next_corner(h)) - uv.row(h)).transpose();
      const bool across = std::abs(e.y()) > std::abs(e.x());
      const bool forwards = e[across ? 1 : 0] > 0.0;
      if (side.h == kInvalid || forwards) side = {h, (across ? 1 : 0) + (forwards ? 0 : 2)};
      if (forwards) break;
    }
    cut.straight.push_back(side);
  }
  return cut;
}

certify::Parametrization with_uv(certify::Parametrization map, Points2 corner_uv) {
  map.uv = std::move(corner_uv);
  return map;
}

// What is carried: a map of `surface` (its corners at `uv`, cut along `cuts`).
struct Carried {
  const mesh::Surface& surface;
  mesh::EdgeFlags cuts;
  Points2 uv;                     // of corners
  bool aligned;                   // its border
  std::vector<HalfedgeId> lines;  // as cut_of() takes them
  std::vector<char> held;         // per vertex
};

// Brought to the goal, whose triangles may flip where its edges bend: on as many points of these as
// it takes, and then on fewer, as long as there are fewer in every round.
std::optional<certify::Parametrization> imprinted(const Carried& from,
                                                  intrinsic::EdgePointMap points,
                                                  ExecutionContext& context, Stats& stats) {
  const auto own = from.surface.vertices.rows();
  mesh::EdgeFlags on_line(at(3 * from.surface.faces.rows()), 0);
  for (const HalfedgeId h : from.lines)
    on_line[at(h)] = on_line[at(from.surface.adjacency().opposite[at(h)])] = 1;
  std::optional<certify::Parametrization> best;
  while (true) {
    intrinsic::RefinedLayout layout = intrinsic::refine_map(
        from.surface, points, intrinsic::Refinement::kAuto, intrinsic::Storage::k64And32, context);
    if (!layout.invalid.empty()) return best;
    if (best && layout.surface.vertices.rows() >= best->surface.vertices.rows()) return best;
    const IndexPairs cuts = intrinsic::edges_on(from.surface.faces, points, from.cuts, layout);
    const IndexPairs lines = intrinsic::edges_on(from.surface.faces, points, on_line, layout);
    certify::Parametrization fine;
    conformal::take_map(layout, fine);
    const mesh::Adjacency& adjacency = fine.surface.adjacency();
    const mesh::EdgeFlags fine_lines = mesh::flag_edges(fine.surface.faces, adjacency, lines);
    for (HalfedgeId h = 0; at(h) < fine_lines.size(); ++h)
      if (fine_lines[at(h)] != 0 && h < adjacency.opposite[at(h)]) fine.features.push_back(h);
    Points2 before(fine.uv.rows(), 2);
    for (CornerId c = 0; c < static_cast<CornerId>(before.rows()); ++c) {
      const FaceId parent = fine.parent_face[at(c / 3)];
      const Vector3 weights =
          weights_in(parent, mesh::source(fine.surface.faces, c), from.surface, fine);
      before.row(c) = weights.transpose() * from.uv.middleRows<3>(3 * parent);
    }
    const distortion::CutMap cut =
        cut_of(fine.surface, mesh::flag_edges(fine.surface.faces, adjacency, cuts), before,
               from.aligned, fine.features);
    Points2 goal(cut.uv.rows(), 2);
    std::vector<char> held(at(cut.uv.rows()), 0);
    for (CornerId c = 0; c < static_cast<CornerId>(before.rows()); ++c) {
      const VertexId v = mesh::source(cut.surface.faces, c);
      goal.row(v) = fine.uv.row(c);
      const VertexId origin = mesh::source(fine.surface.faces, c);
      held[at(v)] = origin < own ? from.held[at(origin)] : char{0};
    }
    const std::optional<Points2> uv = distortion::carried_to(cut, goal, held, context, stats);
    if (!uv) return best;
    fine.uv = distortion::corners_of(cut, *uv);
    best = std::move(fine);
    if (best->surface.vertices.rows() == own) return best;
    points = *seamless::edge_point_map(from.surface, *best);
  }
}

}  // namespace

std::optional<certify::Parametrization> integer_map(const certify::Parametrization& map,
                                                    const mesh::Surface& input,
                                                    const Prepared& prepared,
                                                    const CoarseSurface& chosen,
                                                    ExecutionContext& context, Stats& stats) {
  const FlatSurface& flat = prepared.flat.surface;
  // Every component at its new scale.
  const std::vector<VertexId> part = components(flat, prepared.quarters.size());
  std::vector<double> old_area(prepared.quarters.size(), 0.0), new_area = old_area;
  for (FaceId f = 0; f < chosen.faces(); ++f) {
    const std::size_t n = at(part[at(chosen[3 * f].source)]);
    old_area[n] += static_cast<double>(chosen.twice_area(f));
    new_area[n] += static_cast<double>(chosen.twice_area(f, &Side::integer));
  }
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  const Points2 given = map.uv32.cast<double>();
  Carried from{
      map.surface,
      mesh::cut_to_disks(map.surface, adjacency, mesh::uv_cuts(adjacency, given), {}, {}, context),
      given,
      prepared.flat.oblique.empty(),
      {},
      std::vector<char>(prepared.quarters.size(), 0)};
  for (const HalfedgeId h : prepared.features)
    if (h < adjacency.opposite[at(h)]) from.lines.push_back(h);
  const std::vector<HalfedgeId> corner = leaving(chosen, prepared.quarters.size());
  for (std::size_t v = 0; v < corner.size(); ++v) from.held[v] = corner[v] != kInvalid ? 1 : 0;
  for (HalfedgeId h = 0; h < flat.halfedges(); ++h) {
    const std::size_t n = at(part[at(flat[h].source)]);
    from.uv.row(h) *= std::sqrt(new_area[n] / old_area[n]) / prepared.flat.unit;
  }
  const distortion::CutMap cut = cut_of(from.surface, from.cuts, from.uv, from.aligned, from.lines);
  const Developed developed(flat, chosen, context);
  const Points2 goal = laid_out(cut, developed.edges(), [&](HalfedgeId h) -> Vector2 {
    const Vector2 lattice = developed.from_whole(h);
    const Vector2 old = from.uv.row(h);
    return lattice + Vector2((old - lattice).array().round());
  });
  std::vector<char> held(at(cut.uv.rows()));
  for (HalfedgeId h = 0; h < flat.halfedges(); ++h)
    held[at(mesh::source(cut.surface.faces, h))] = from.held[at(flat[h].source)];
  if (const auto whole = distortion::carried_to(cut, goal, held, context, stats))
    return with_uv(map, distortion::corners_of(cut, *whole));
  std::optional<certify::Parametrization> fine =
      imprinted(from, developed.points(distortion::corners_of(cut, goal), from.surface.adjacency()),
                context, stats);
  if (!fine) return std::nullopt;
  // On the map's own surface so far.
  for (FaceId& parent : fine->parent_face) parent = map.parent_face[at(parent)];
  for (std::size_t v = 0; v < fine->vertex_parent.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    if (row < map.vertex_barycentric.rows()) {
      fine->vertex_parent[v] = map.vertex_parent[v];
      fine->vertex_barycentric.row(row) = map.vertex_barycentric.row(row);
      continue;
    }
    const Spot spot = on_input(
        map, input, {fine->vertex_parent[v], fine->vertex_barycentric.row(row).transpose()});
    fine->vertex_parent[v] = spot.face;
    fine->vertex_barycentric.row(row) = spot.weight.transpose();
  }
  return fine;
}

std::optional<certify::Parametrization> rounded_map(const certify::Parametrization& map,
                                                    const FlatMap& flat, double scale,
                                                    ExecutionContext& context, Stats& stats) {
  const Points2 uv = map.uv32.cast<double>();
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  std::vector<HalfedgeId> lines;
  for (const HalfedgeId h : map.features) {
    const Gauss e = flat.surface[h].edge;
    if (adjacency.opposite[at(h)] != kInvalid && (e.x == 0 || e.y == 0)) lines.push_back(h);
  }
  const distortion::CutMap cut =
      cut_of(map.surface, mesh::uv_cuts(adjacency, uv), scale * uv, flat.oblique.empty(), lines);
  // Cones, and of components without them one vertex.
  const std::vector<Index> quarters =
      quarters_around(flat.surface, at(map.surface.vertices.rows()));
  const std::vector<VertexId> part = components(flat.surface, quarters.size());
  const std::vector<HalfedgeId> first = leaving(flat.surface, quarters.size());
  std::vector<char> has_cone(quarters.size(), 0), held(at(cut.uv.rows()), 0);
  const auto is_cone = [&](VertexId v) {
    return flat.surface[first[at(v)]].opposite != kInvalid && quarters[at(v)] != 4;
  };
  for (VertexId v = 0; at(v) < quarters.size(); ++v)
    if (first[at(v)] != kInvalid && is_cone(v)) has_cone[at(part[at(v)])] = 1;
  for (HalfedgeId h = 0; h < flat.surface.halfedges(); ++h) {
    const VertexId v = flat.surface[h].source;
    char& known = has_cone[at(part[at(v)])];
    if (is_cone(v) || known == 0) held[at(mesh::source(cut.surface.faces, h))] = 1;
    known = 1;
  }
  const auto whole = distortion::carried_to(cut, cut.uv, held, context, stats);
  return whole ? std::optional(with_uv(map, distortion::corners_of(cut, *whole))) : std::nullopt;
}

void certify_integers(const std::vector<Index>& quarters, const mesh::Surface& input,
                      const IndexPairs& features, certify::Parametrization& map,
                      const ExecutionContext& context) {
  map.uv32 = map.uv.cast<float>();
  map.agreed.resize(0, 2);
  certify::CertifyRequest request;
  request.require_seamless = true;
  request.require_cones = true;
  request.features = features;
  request.require_features = false;
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  for (VertexId v = 0; at(v) < quarters.size(); ++v) {
    const HalfedgeId h = adjacency.vertex_halfedge[at(v)];
    if (h != kInvalid && adjacency.opposite[at(h)] != kInvalid && quarters[at(v)] != 4)
      request.cone_angles.emplace_back(v, quarters[at(v)] * kQuarterTurn);
  }
  certify::certify_map(map, input, request, context);
  const std::vector<certify::SeamTransition>& seams = map.certificate.seams;
  map.cut_edges.resize(static_cast<Eigen::Index>(seams.size()), 2);
  map.transitions.clear();
  for (std::size_t i = 0; i < seams.size(); ++i) {
    map.cut_edges.row(static_cast<Eigen::Index>(i)) << seams[i].from, seams[i].to;
    map.transitions.push_back({seams[i].quarter_turns, seams[i].translation});
  }
}

}  // namespace flipfree::quads
