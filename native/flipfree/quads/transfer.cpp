#include "flipfree/quads/transfer.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/distortion/seams/carry.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/mesh/cut_graph.h"

namespace flipfree::quads {

namespace {

// How a half-edge of the map leaves its vertex: the vertex's place on the coarse surface, in its
// old integers; and by how many quarters vectors in the half-edge's chart turn to be ones there.
struct Departure {
  Place place;
  Index turn = 0;
};

// The map's edges by the new metric of the coarse surface, which is the affine image of the old one
// in each of its triangles.
class Developed {
 public:
  Developed(const FlatSurface& map, const CoarseSurface& coarse, const ExecutionContext& context)
      : map_(map), coarse_(coarse), from_(at(map.halfedges())), moved_(at(map.halfedges())) {
    for (const Gauss q : coarse.integer) whole_.push_back(as_vector(q));
    for (HalfedgeId e = 0; e < coarse.flat.halfedges(); ++e) depart_from_corner(e);
    for (std::size_t i = 0; i < queue_.size(); ++i) {
      if (i % 1024 == 0) context.check();
      cross(queue_[i]);
    }
  }

  const std::vector<Vector2>& edges() const { return moved_; }

  // Where the half-edge's source lies from a point of whole numbers, in the half-edge's chart.
  Vector2 from_whole(HalfedgeId h) const {
    return turned(image(from_[at(h)].place), -from_[at(h)].turn);
  }

 private:
  bool is_known(HalfedgeId h) const { return from_[at(h)].place.face != kInvalid; }
  void set(HalfedgeId h, Place place, Index turn) {
    if (h == kInvalid || is_known(h)) return;
    from_[at(h)] = {place, turn & 3};
    queue_.push_back(h);
  }

  // The map's half-edges at the vertex of e, counter-clockwise of e by less than half a turn.
  void depart_from_corner(HalfedgeId e) {
    CornerId c = coarse_.start[at(e)];
    Index turn = coarse_.start_turn[at(e)];  // from e's chart to that of c
    Gauss way = turned(coarse_.flat.edge[at(e)], turn);
    if (quads::cross(way, map_.edge[at(c)]) == 0)
      set(c, {e / 3, origin(coarse_.flat.edge, e)}, -turn);
    while (true) {
      const HalfedgeId last = previous_corner(c);
      const Gauss next = -map_.edge[at(last)];
      if (quads::cross(way, next) <= 0 || map_.opposite[at(last)] == kInvalid) return;
      const auto [corner, more] = sector_of(coarse_.flat, e, turned(next, -turn));
      turn += map_.turn[at(last)];
      way = turned(way, map_.turn[at(last)]);
      c = map_.opposite[at(last)];
      set(c, {corner / 3, origin(coarse_.flat.edge, corner)}, more - turn);
    }
  }

  // The affine image of a place, in whole numbers from the first corner of its face.
  Vector2 image(const Place& place) const {
    const std::size_t h = at(3 * place.face);
    const Gauss first = coarse_.flat.edge[h], second = first + coarse_.flat.edge[h + 1];
    const auto area = static_cast<double>(quads::cross(first, second));
    return static_cast<double>(quads::cross(place.at, second)) / area * whole_[h] +
           static_cast<double>(quads::cross(first, place.at)) / area * (whole_[h] + whole_[h + 1]);
  }

  void cross(HalfedgeId h) {
    const Departure from = from_[at(h)];
    Vector2 start = image(from.place);
    Index turn = from.turn;
    const Gauss end = from.place.at + turned(map_.edge[at(h)], from.turn);
    const Place to = walk(coarse_.flat, coarse_.flat.edge, from.place, end, [&](HalfedgeId out) {
      const HalfedgeId o = coarse_.flat.opposite[at(out)];
      const Index by = coarse_.flat.turn[at(out)];
      start = origin(whole_, next_corner(o)) + turned(Vector2(start - origin(whole_, out)), by);
      turn += by;
    });
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
      h = map_.opposite[at(last)];
      if (h == first) return;
      if (h == kInvalid) break;
      ccw -= map_.turn[at(last)];
      set(h, place, ccw);
    }
    for (HalfedgeId h = first; map_.opposite[at(h)] != kInvalid;) {
      cw -= map_.turn[at(h)];
      h = next_corner(map_.opposite[at(h)]);
      set(h, place, cw);
    }
  }

  const FlatSurface& map_;
  const CoarseSurface& coarse_;
  std::vector<Vector2> whole_;  // the coarse surface's integers
  std::vector<Departure> from_;
  std::vector<Vector2> moved_;
  std::vector<HalfedgeId> queue_;
};

// Points of the cut map by its edges, face after face; one place per chart is given.
template <typename Base>
Points2 laid_out(const distortion::CutMap& cut, const std::vector<Vector2>& edges,
                 const Base& base) {
  const Triangles& faces = cut.surface.faces;
  const mesh::Adjacency adjacency = mesh::build_adjacency(static_cast<Index>(cut.uv.rows()), faces);
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

// The map cut where its UVs differ, and as far as that takes into disks if `disks`, with its
// features and, where it runs along the axes, its border as lines.
distortion::CutMap cut_of(const certify::Parametrization& map, const FlatMap& flat, bool disks,
                          const ExecutionContext& context) {
  const Points2 uv = map.uv32.cast<double>();
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  mesh::EdgeFlags cuts = mesh::uv_cuts(adjacency, uv);
  if (disks) cuts = mesh::cut_to_disks(map.surface, adjacency, cuts, {}, {}, context);
  distortion::CutMap cut = distortion::cut_map(map.surface, adjacency, cuts, uv);
  if (flat.oblique.empty()) cut.straight = distortion::straight_boundary(cut, adjacency);
  for (HalfedgeId h : map.features) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    Gauss e = flat.surface.edge[at(h)];
    if (o == kInvalid || (e.x != 0 && e.y != 0)) continue;
    // The side that runs forwards, so that neighbours in one chart are one line.
    if (e.x + e.y < 0) {
      const Gauss back = flat.surface.edge[at(o)];
      if (back.x + back.y > 0) {
        h = o;
        e = back;
      }
    }
    cut.straight.push_back({h, e.y == 0 ? (e.x > 0 ? 0 : 2) : (e.y > 0 ? 1 : 3)});
  }
  return cut;
}

std::optional<Points2> carried(distortion::CutMap& cut, const Points2& goal,
                               const std::vector<char>& held, ExecutionContext& context,
                               Stats& stats) {
  std::optional<Points2> uv = distortion::carried_to(cut, goal, held, context, stats);
  if (!uv) return std::nullopt;
  return distortion::corners_of(cut, *uv);
}

}  // namespace

std::optional<Points2> integer_uv(const certify::Parametrization& map, const Prepared& prepared,
                                  const CoarseSurface& chosen, ExecutionContext& context,
                                  Stats& stats) {
  const FlatSurface& flat = prepared.flat.surface;
  distortion::CutMap cut = cut_of(map, prepared.flat, true, context);
  // Every component at its new scale.
  DisjointSets parts(static_cast<Index>(prepared.quarters.size()));
  for (HalfedgeId h = 0; h < flat.halfedges(); ++h) parts.join(flat.source[at(h)], flat.target(h));
  std::vector<double> old_area(prepared.quarters.size(), 0.0), new_area = old_area;
  for (FaceId f = 0; f < chosen.faces(); ++f) {
    const std::size_t part = at(parts.find(chosen.flat.source[at(3 * f)]));
    old_area[part] += static_cast<double>(chosen.flat.twice_area(f));
    new_area[part] +=
        static_cast<double>(cross(chosen.integer[at(3 * f)], chosen.integer[at(3 * f + 1)]));
  }
  const std::vector<HalfedgeId> corner = leaving(chosen.flat, prepared.quarters.size());
  std::vector<char> held(at(cut.uv.rows()), 0);
  for (HalfedgeId h = 0; h < flat.halfedges(); ++h) {
    const VertexId v = flat.source[at(h)], own = mesh::source(cut.surface.faces, h);
    const std::size_t part = at(parts.find(v));
    const double scale = std::sqrt(new_area[part] / old_area[part]) / prepared.flat.unit;
    cut.uv.row(own) = scale * map.uv32.row(h).cast<double>();
    if (corner[at(v)] != kInvalid) held[at(own)] = 1;
  }
  const Developed developed(flat, chosen, context);
  const Points2 goal = laid_out(cut, developed.edges(), [&](HalfedgeId h) -> Vector2 {
    const Vector2 lattice = developed.from_whole(h);
    const Vector2 old = cut.uv.row(mesh::source(cut.surface.faces, h));
    return lattice + Vector2((old - lattice).array().round());
  });
  return carried(cut, goal, held, context, stats);
}

std::optional<Points2> rounded_uv(const certify::Parametrization& map, const FlatMap& flat,
                                  double scale, ExecutionContext& context, Stats& stats) {
  distortion::CutMap cut = cut_of(map, flat, false, context);
  cut.uv *= scale;
  // Cones, and of components without them one vertex.
  const std::vector<Index> quarters =
      quarters_around(flat.surface, at(map.surface.vertices.rows()));
  DisjointSets parts(static_cast<Index>(quarters.size()));
  for (HalfedgeId h = 0; h < flat.surface.halfedges(); ++h)
    parts.join(flat.surface.source[at(h)], flat.surface.target(h));
  const std::vector<HalfedgeId> first = leaving(flat.surface, quarters.size());
  std::vector<char> has_cone(quarters.size(), 0), held(at(cut.uv.rows()), 0);
  const auto is_cone = [&](VertexId v) {
    return flat.surface.opposite[at(first[at(v)])] != kInvalid && quarters[at(v)] != 4;
  };
  for (VertexId v = 0; at(v) < quarters.size(); ++v)
    if (first[at(v)] != kInvalid && is_cone(v)) has_cone[at(parts.find(v))] = 1;
  for (HalfedgeId h = 0; h < flat.surface.halfedges(); ++h) {
    const VertexId v = flat.surface.source[at(h)];
    char& known = has_cone[at(parts.find(v))];
    if (is_cone(v) || known == 0) held[at(mesh::source(cut.surface.faces, h))] = 1;
    known = 1;
  }
  return carried(cut, cut.uv, held, context, stats);
}

void set_integer_uv(Points2 integers, const std::vector<Index>& quarters,
                    const mesh::Surface& parent, const IndexPairs& features,
                    certify::Parametrization& map, const ExecutionContext& context) {
  map.uv = std::move(integers);
  map.uv32 = map.uv.cast<float>();
  map.agreed.resize(0, 2);
  certify::CertifyRequest request;
  request.require_seamless = true;
  request.require_cones = true;
  request.features = features;
  request.require_features = false;
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  for (VertexId v = 0; at(v) < quarters.size(); ++v) {
    const HalfedgeId h = adjacency.vertex_halfedge[at(v)];
    if (h != kInvalid && adjacency.opposite[at(h)] != kInvalid && quarters[at(v)] != 4)
      request.cone_angles.emplace_back(v, quarters[at(v)] * kQuarterTurn);
  }
  certify::certify_map(map, parent, request, context);
  const std::vector<certify::SeamTransition>& seams = map.certificate.seams;
  map.cut_edges.resize(static_cast<Eigen::Index>(seams.size()), 2);
  map.transitions.clear();
  for (std::size_t i = 0; i < seams.size(); ++i) {
    map.cut_edges.row(static_cast<Eigen::Index>(i)) << seams[i].from, seams[i].to;
    map.transitions.push_back({seams[i].quarter_turns, seams[i].translation});
  }
}

}  // namespace flipfree::quads
