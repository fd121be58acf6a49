#include "flipfree/quads/transfer.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/conformal/map.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/intrinsic/layout/refine_map.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/quads/developed.h"
#include "flipfree/quads/places.h"
#include "flipfree/seamless/exact/take_back.h"

namespace flipfree::quads {

namespace {

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

// The surface cut along `cuts`, with corners at `uv`, and of what is to stay along the axes the
// border, if `aligned`, and `lines`: half-edges inside, of each edge one.
distortion::CutMap cut_of(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                          const mesh::EdgeFlags& cuts, const Points2& uv, bool aligned,
                          const std::vector<HalfedgeId>& lines) {
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

// A vertex in a face that holds it, as weights of the face's corners.
Vector3 weights_in(FaceId f, VertexId v, const mesh::Surface& coarse,
                   const certify::Parametrization& fine) {
  Vector3 weights = Vector3::Zero();
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      if (coarse.faces(f, k) == coarse.faces(fine.vertex_parent[at(v)], i))
        weights[k] += fine.vertex_barycentric(v, i);
  return weights;
}

// What is carried: a map of `surface` (its corners at `uv`, cut along `cuts`).
struct Carried {
  const mesh::Surface& surface;
  const mesh::Adjacency& adjacency;
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
    on_line[at(h)] = on_line[at(from.adjacency.opposite[at(h)])] = 1;
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
        cut_of(fine.surface, adjacency, mesh::flag_edges(fine.surface.faces, adjacency, cuts),
               before, from.aligned, fine.features);
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
  DisjointSets parts(static_cast<Index>(prepared.quarters.size()));
  for (HalfedgeId h = 0; h < flat.halfedges(); ++h) parts.join(flat[h].source, flat.target(h));
  std::vector<double> old_area(prepared.quarters.size(), 0.0), new_area = old_area;
  for (FaceId f = 0; f < chosen.faces(); ++f) {
    const std::size_t part = at(parts.find(chosen[3 * f].source));
    old_area[part] += static_cast<double>(chosen.twice_area(f));
    new_area[part] += static_cast<double>(cross(chosen[3 * f].integer, chosen[3 * f + 1].integer));
  }
  Carried from{map.surface,
               map.surface.adjacency(),
               {},
               map.uv32.cast<double>(),
               prepared.flat.oblique.empty(),
               {},
               std::vector<char>(prepared.quarters.size(), 0)};
  from.cuts = mesh::cut_to_disks(map.surface, from.adjacency,
                                 mesh::uv_cuts(from.adjacency, from.uv), {}, {}, context);
  for (const HalfedgeId h : prepared.features)
    if (h < from.adjacency.opposite[at(h)]) from.lines.push_back(h);
  const std::vector<HalfedgeId> corner = leaving(chosen, prepared.quarters.size());
  for (std::size_t v = 0; v < corner.size(); ++v) from.held[v] = corner[v] != kInvalid ? 1 : 0;
  for (HalfedgeId h = 0; h < flat.halfedges(); ++h) {
    const std::size_t part = at(parts.find(flat[h].source));
    from.uv.row(h) *= std::sqrt(new_area[part] / old_area[part]) / prepared.flat.unit;
  }
  const distortion::CutMap cut =
      cut_of(from.surface, from.adjacency, from.cuts, from.uv, from.aligned, from.lines);
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
  std::optional<certify::Parametrization> fine = imprinted(
      from, developed.points(distortion::corners_of(cut, goal), from.adjacency), context, stats);
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
  const distortion::CutMap cut = cut_of(map.surface, adjacency, mesh::uv_cuts(adjacency, uv),
                                        scale * uv, flat.oblique.empty(), lines);
  // Cones, and of components without them one vertex.
  const std::vector<Index> quarters =
      quarters_around(flat.surface, at(map.surface.vertices.rows()));
  DisjointSets parts(static_cast<Index>(quarters.size()));
  for (HalfedgeId h = 0; h < flat.surface.halfedges(); ++h)
    parts.join(flat.surface[h].source, flat.surface.target(h));
  const std::vector<HalfedgeId> first = leaving(flat.surface, quarters.size());
  std::vector<char> has_cone(quarters.size(), 0), held(at(cut.uv.rows()), 0);
  const auto is_cone = [&](VertexId v) {
    return flat.surface[first[at(v)]].opposite != kInvalid && quarters[at(v)] != 4;
  };
  for (VertexId v = 0; at(v) < quarters.size(); ++v)
    if (first[at(v)] != kInvalid && is_cone(v)) has_cone[at(parts.find(v))] = 1;
  for (HalfedgeId h = 0; h < flat.surface.halfedges(); ++h) {
    const VertexId v = flat.surface[h].source;
    char& known = has_cone[at(parts.find(v))];
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
