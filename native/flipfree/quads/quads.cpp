#include "flipfree/quads/quads.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/field/smoothest.h"
#include "flipfree/holonomy/field_aligned.h"
#include "flipfree/mesh/decimated/decimated.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/quads/cells.h"
#include "flipfree/quads/coarse.h"
#include "flipfree/quads/places.h"
#include "flipfree/quads/proxy.h"
#include "flipfree/quads/transfer.h"
#include "flipfree/seamless/request.h"

namespace flipfree::quads {

namespace {

// Of the field that is made where none is given, to the principal curvatures: it brings the cones
// that parts of machines need, and costs organic shapes little.
constexpr double kAlignment = 0.1;
// Of its cones that are merged: a few irregular vertices fewer, with angles as good. From 0.065 on
// teeth of gears and steps of stairs go.
constexpr double kReach = 0.055;
constexpr std::int64_t kMostQuads = 10'000'000;
// Of an edge of the surface that quads are made on, in sides of these. With features a quad's
// diagonal: else cones around a hole find no vertex but the next ring of its rim, where whole
// numbers cannot tell them from it. Without, corners come nearer to tips on long edges.
constexpr double kLongestSides = 3.0, kLongestBesideFeatures = 1.42;

// A map that quads may have: along the axes at its border, without cones of one quarter turn.
Prepared prepare_for_quads(const certify::Parametrization& map, const ExecutionContext& context) {
  FlatMap flat = flat_map(map);
  if (!flat.oblique.empty()) {
    const HalfedgeId h = flat.oblique[0];
    const VertexId a = flat.surface[h].source, b = flat.surface.target(h);
    throw_invalid(ErrorCode::kBadShape,
                  "Edge " + vertex_id(a) + "-" + vertex_id(b) +
                      " of the border does not run along an axis of the map. Quads need an "
                      "aligned boundary.",
                  ElementKind::kEdge, {a, b});
  }
  Prepared p = prepare(std::move(flat), map, context);
  const std::vector<HalfedgeId> first = leaving(p.flat.surface, p.quarters.size());
  std::vector<Index> sharp;
  for (std::size_t v = 0; v < first.size(); ++v) {
    if (first[v] != kInvalid && p.flat.surface[first[v]].opposite != kInvalid && p.quarters[v] == 1)
      sharp.push_back(static_cast<Index>(v));
  }
  if (!sharp.empty())
    throw_invalid(ErrorCode::kBadAngles,
                  "The map has only one quarter turn at vertex " + vertex_id(sharp[0]) +
                      ", where a quad would meet itself. Give a field without such cones "
                      "(simplify).",
                  ElementKind::kVertex, first_elements(sharp));
  return p;
}

// One choice of integers, and its cells.
struct Attempt {
  CoarseSurface coarse;
  Cells cells;
  std::vector<std::string> defects;
  double count() const { return static_cast<double>(cells.quads.size()); }
};

// Whether the border has as many sides as it is long. Two edges of it with the same ends are one
// edge inside to everyone who knows the quads alone.
bool keeps_border(const Cells& cells, const CoarseSurface& coarse) {
  std::int64_t length = 0;
  for (HalfedgeId h = 0; h < coarse.halfedges(); ++h) {
    const Gauss q = coarse[h].integer;
    if (coarse[h].opposite == kInvalid) length += std::abs(q.x) + std::abs(q.y);
  }
  return length == static_cast<std::int64_t>(border_sides(cells.quads).size());
}

Attempt attempt_with(CoarseSurface coarse, const ExecutionContext& context) {
  Attempt made;
  made.cells = extract_cells(coarse, context);
  made.defects = quad_defects(made.cells.quads, static_cast<Index>(made.cells.corners.size()));
  if (made.defects.empty() && !keeps_border(made.cells, coarse))
    made.defects.push_back("two edges of a border have the same ends");
  made.coarse = std::move(coarse);
  return made;
}

// Integers for about `wanted` quads; `coarse` is where they begin.
std::optional<Attempt> attempt_at(CoarseSurface coarse, const Prepared& p, const Scales& scales,
                                  double wanted, double count, ExecutionContext& context) {
  if (!choose_integers(coarse, p, scales, wanted, count, context)) return std::nullopt;
  if (twice_area_in_quads(coarse) > 4 * kMostQuads) return std::nullopt;
  return attempt_with(std::move(coarse), context);
}

// As near to `target` quads as a few scales come, then by lengths that give way, from there and
// anew: of a tube of few coarse triangles one or the other ends far off. More where so few are no
// mesh.
Attempt nearest_attempt(const Prepared& p, const Scales& scales, double target,
                        ExecutionContext& context, Stats& stats) {
  constexpr double kNear = 0.05;
  constexpr int kMostScales = 3;
  constexpr int kMostRaised = 24;
  std::optional<Attempt> best;
  CoarseSurface latest = p.coarse;
  std::int64_t tries = 0;
  const auto off = [&](double count) { return std::abs(std::log(count / target)); };
  const auto is_near = [&] { return best && off(best->count()) <= std::log1p(kNear); };
  // The count that comes out; 0 for none.
  const auto offer = [&](double wanted, double held_to) {
    context.report("integers", 0.02 * static_cast<double>(std::min<std::int64_t>(tries, 10)));
    ++tries;
    std::optional<Attempt> made = attempt_at(latest, p, scales, wanted, held_to, context);
    if (!made) return 0.0;
    latest = made->coarse;
    const double count = made->count();
    if (made->defects.empty() && (!best || off(count) < off(best->count()))) best = std::move(made);
    return count;
  };
  double wanted = target;
  for (int i = 0; i < kMostScales && !is_near(); ++i) {
    const double count = offer(wanted, 0.0);
    if (count == 0.0) break;
    wanted *= target / count;
  }
  CoarseSurface anew = p.coarse;
  for (int from = 0; from < 2; ++from) {
    if (!is_near()) offer(target, target);
    std::swap(latest, anew);
  }
  for (int i = 1; i <= kMostRaised && !best; ++i) offer(target * std::pow(1.5, i), 0.0);
  if (!best)
    throw_not_converged(ErrorCode::kIterationLimit,
                        "No whole numbers were found for the edges between the map's cones. Ask "
                        "for more quads, or simplify the field.");
  stats["count_raised"] = static_cast<std::int64_t>(best->count() > (1.0 + kNear) * target ? 1 : 0);
  stats["scales_tried"] = tries;
  return *std::move(best);
}

// The map's own integers.
Attempt attempt_of_map(const Prepared& p, const ExecutionContext& context) {
  CoarseSurface coarse = p.coarse;
  for (HalfedgeId h = 0; h < coarse.halfedges(); ++h) {
    const Vector2 e = p.flat.unit * as_vector(coarse[h].edge);
    const Gauss q{std::llround(e.x()), std::llround(e.y())};
    if (as_vector(q) != e || !fits(q)) {
      const VertexId a = coarse[h].source, b = coarse.target(h);
      throw_invalid(ErrorCode::kBadOption,
                    "Vertices " + vertex_id(a) + " and " + vertex_id(b) +
                        " of the map, cones or corners, are not whole numbers apart. Use quads(), "
                        "which chooses such numbers.",
                    ElementKind::kVertex, {a, b});
    }
    coarse[h].integer = q;
  }
  double cells = 0.0;  // the sum of products may be too large for 64 bits
  for (FaceId f = 0; f < coarse.faces(); ++f)
    cells += 0.5 * static_cast<double>(coarse.twice_area(f, &Side::integer));
  if (cells > static_cast<double>(kMostQuads))
    throw_invalid(ErrorCode::kBadOption, "The map has " + std::to_string(std::llround(cells)) +
                                             " cells, more than 10000000. Scale it down by a "
                                             "power of two, or use quads().");
  return attempt_with(std::move(coarse), context);
}

// Edges of the map that quads run along: the border, features, and what is sharp.
mesh::EdgeFlags lines_of(const certify::Parametrization& map) {
  constexpr double kSharp = 0.8;  // cosine of the angle between normals: 37 degrees
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  std::vector<Vector3> normal;
  for (FaceId f = 0; f < static_cast<FaceId>(map.surface.faces.rows()); ++f)
    normal.push_back(map.surface.area_vector(f).normalized());
  mesh::EdgeFlags lines(adjacency.opposite.size(), 0);
  for (HalfedgeId h = 0; at(h) < lines.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    lines[at(h)] = o == kInvalid || normal[at(h / 3)].dot(normal[at(o / 3)]) <= kSharp ? 1 : 0;
  }
  for (const HalfedgeId h : map.features) lines[at(h)] = lines[at(adjacency.opposite[at(h)])] = 1;
  return lines;
}

// Corners on lines stay there, and those at the coarse surface's vertices on them where they are.
std::vector<Freedom> freedom_of(const mesh::Surface& surface, const mesh::EdgeFlags& lines,
                                const std::vector<Carrier>& corners,
                                const std::vector<Spot>& spots) {
  const std::vector<char> on_line = on_lines(surface, lines, spots);
  std::vector<Freedom> freedom;
  for (std::size_t v = 0; v < spots.size(); ++v)
    freedom.push_back(on_line[v] == 0        ? Freedom::kFree
                      : corners[v].at_vertex ? Freedom::kHeld
                                             : Freedom::kAlongLine);
  return freedom;
}

// The face at the middle of a quad: where one gets from its corners, or from where its centre was,
// over the surface; of these ways, which part at creases, the one that ends nearest.
FaceId face_at_middle(const mesh::Surface& surface, const Quad& quad,
                      const std::vector<Spot>& spots, const Spot& centre) {
  const Vector3 middle = middle_of(surface, quad, spots);
  FaceId nearest = kInvalid;
  double least = 0.0;
  for (std::size_t k = 0; k <= 4; ++k) {
    const Spot& from = k == 4 ? centre : spots[at(quad[k])];
    const Spot spot = slide(surface, {}, from, middle - position(surface, from));
    const double off = (position(surface, spot) - middle).squaredNorm();
    if (nearest != kInvalid && off >= least) continue;
    nearest = spot.face;
    least = off;
  }
  return nearest;
}

// The smoothest field, a little along curvature.
field::CrossField own_field(const mesh::Surface& surface, const IndexPairs& features,
                            const std::vector<double>& sizing, ExecutionContext& context) {
  field::FieldOptions options;
  options.edges = features;
  options.let_go = true;
  options.simplify = true;
  options.reach = kReach;
  options.sizing = sizing;
  options.alignment = kAlignment;
  return field::compute_cross_field(surface, options, context).field;
}

void set_corners(const mesh::Surface& surface, const std::vector<Spot>& spots, QuadMesh& mesh) {
  const auto count = static_cast<Eigen::Index>(spots.size());
  mesh.vertices.resize(count, 3);
  mesh.barycentric.resize(count, 3);
  mesh.parent_face.clear();
  for (Eigen::Index v = 0; v < count; ++v) {
    mesh.parent_face.push_back(spots[at(v)].face);
    mesh.barycentric.row(v) = spots[at(v)].weight;
    mesh.vertices.row(v) = position(surface, spots[at(v)]);
  }
}

// `around` and `count` as certify_quads() takes them.
void certify(const mesh::Surface& surface, const std::vector<Index>* around, std::int64_t count,
             QuadMesh& mesh, const ExecutionContext& context) {
  mesh.certificate = certify_quads(surface, mesh, around, count, context);
  if (!mesh.certificate.ok)
    throw_not_converged(ErrorCode::kCertificateFailed,
                        "The quads fail their certificate: " + mesh.certificate.failures[0] +
                            ". Ask for more quads.");
}

QuadMesh finished(const Prepared& p, Attempt made, const certify::Parametrization& map,
                  const mesh::Surface& surface, const QuadOptions& options,
                  ExecutionContext& context, Stats stats) {
  QuadMesh mesh;
  std::vector<Spot> spots = spots_of(made.cells.corners, made.coarse, p.flat.surface, context);
  const std::vector<Spot> centres =
      spots_of(made.cells.centres, made.coarse, p.flat.surface, context);
  mesh.quads = std::move(made.cells.quads);
  {
    constexpr int kRounds = 30;
    const ProgressRange range(context, 0.3, 0.8);
    const mesh::EdgeFlags lines = lines_of(map);
    relax(map.surface, mesh.quads, lines, freedom_of(map.surface, lines, made.cells.corners, spots),
          kRounds, spots, context);
  }
  std::vector<Index> around;
  for (const Carrier& carrier : made.cells.corners) {
    const Side& side = made.coarse[carrier.halfedge];
    around.push_back(carrier.at_vertex                              ? p.quarters[at(side.source)]
                     : carrier.on_edge && side.opposite == kInvalid ? 2
                                                                    : 4);
  }
  std::vector<Spot> corners;
  for (const Spot& spot : spots) corners.push_back(on_input(map, surface, spot));
  set_corners(surface, corners, mesh);
  for (std::size_t q = 0; q < mesh.quads.size(); ++q)
    mesh.quad_parent.push_back(
        map.parent_face[at(face_at_middle(map.surface, mesh.quads[q], spots, centres[q]))]);
  context.report("certifying", 0.8);
  certify(surface, &around, twice_area_in_quads(made.coarse) / 2, mesh, context);
  std::int64_t flat_kept = 0;
  std::vector<HalfedgeId> first = leaving(made.coarse, p.quarters.size());
  for (std::size_t v = 0; v < first.size(); ++v) {
    if (first[v] == kInvalid) continue;
    flat_kept += p.quarters[v] == (made.coarse[first[v]].opposite == kInvalid ? 2 : 4);
  }
  stats["kept_vertices"] = flat_kept;
  stats["coarse_faces"] = static_cast<std::int64_t>(made.coarse.faces());
  if (options.with_map) {
    mesh.map = integer_map(map, surface, p, made.coarse, context, stats);
    if (mesh.map) {
      certify_integers(p.quarters, surface, options.features, *mesh.map, context);
      if (!mesh.map->certificate.ok) mesh.map.reset();
    }
  }
  mesh.stats = std::move(stats);
  return mesh;
}

// How many, of a surface of that area.
double wanted_quads(const QuadOptions& options, double area) {
  const double target =
      options.target > 0.0 ? options.target : area / (options.edge_length * options.edge_length);
  if (!(target <= static_cast<double>(kMostQuads)))
    throw_invalid(ErrorCode::kBadOption,
                  "edge_length is so short that it takes more than 10000000 quads. Give a longer "
                  "one.");
  return target;
}

// The sizing that was asked for at the vertices of the divided surface, and by its curvature.
std::vector<double> sizing_of(const DividedSurface& fine, const mesh::Surface& surface,
                              const QuadOptions& options) {
  std::vector<double> sizing;
  if (options.adaptive > 0.0) sizing = field::curvature_sizing(fine.surface, options.adaptive);
  if (options.sizing.empty()) return sizing;
  const std::vector<double> asked =
      holonomy::carried_sizing(surface, fine.provenance, options.sizing);
  sizing.resize(asked.size(), 1.0);
  for (std::size_t v = 0; v < sizing.size(); ++v) sizing[v] *= asked[v];
  return sizing;
}

// Of every vertex the one of the input that it is, or the nearest corner of the face that it is in.
std::vector<VertexId> vertices_of_input(const DividedSurface& fine, const mesh::Surface& surface) {
  std::vector<VertexId> vertices;
  for (const mesh::SurfacePoint& point : fine.provenance.vertex) {
    const auto v = static_cast<VertexId>(vertices.size());
    Eigen::Index nearest = 0;
    point.weight.maxCoeff(&nearest);
    const bool known = v < surface.vertices.rows() || point.face == kInvalid;
    vertices.push_back(known ? v : surface.faces(point.face, nearest));
  }
  return vertices;
}

QuadMesh quads_of_all(const mesh::Surface& surface, const std::optional<field::GivenField>& given,
                      const QuadOptions& options, ExecutionContext& context) {
  Stopwatch watch;
  certify::Parametrization map;
  Stats stats;
  {
    const double area = mesh::area_of(surface), wanted = wanted_quads(options, area);
    holonomy::AlignedOptions align;
    align.ragged = std::sqrt(area / wanted);
    // A given field is one of the faces as they are.
    const auto most = given ? 0 : at(surface.faces.rows()) + static_cast<std::size_t>(2 * wanted);
    const DividedSurface fine = divided(
        surface, options.features,
        (options.features.rows() > 0 ? kLongestBesideFeatures : kLongestSides) * align.ragged, most,
        context);
    align.sizing = sizing_of(fine, surface, options);
    align.features = fine.features;
    try {
      field::CrossField own;
      {
        const ProgressRange range(context, 0.0, 0.1);
        own = given ? field::read_field(surface, *given, context)
                    : own_field(fine.surface, fine.features, align.sizing, context);
      }
      const ProgressRange range(context, 0.1, 0.6);
      map = holonomy::compute_field_aligned_map(fine.surface, own, align, context);
    } catch (...) {
      seamless::rethrow_placed(fine.provenance.face, vertices_of_input(fine, surface));
    }
    seamless::name_input_places(surface, fine.provenance, fine.surface.faces, map);
    std::set<std::pair<VertexId, VertexId>> pieces;
    for (const auto& [a, b] : map.certificate.features_missed) pieces.insert(std::minmax(a, b));
    std::set<HalfedgeId> missed;
    for (std::size_t i = 0; i < fine.whole.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const std::pair<VertexId, VertexId> ends =
          std::minmax(fine.features(row, 0), fine.features(row, 1));
      if (pieces.contains(ends)) missed.insert(fine.whole[i]);
    }
    stats["features"] =
        static_cast<std::int64_t>(std::set(fine.whole.begin(), fine.whole.end()).size());
    stats["features_missed"] = static_cast<std::int64_t>(missed.size());
  }
  for (const auto& [name, value] : map.stats) stats["map." + name] = value;
  stats["seconds.map"] = watch.seconds();
  watch.restart();
  const ProgressRange range(context, 0.6, 1.0);
  Prepared p = prepare_for_quads(map, context);
  Scales scales = scales_of(p, map);
  const double target = wanted_quads(options, scales.area);
  stats["target"] = target;
  const std::vector<HalfedgeId> close = close_features(p, scales, target);
  stats["features_close"] = static_cast<std::int64_t>(close.size() / 2);
  if (!close.empty()) {
    std::erase_if(map.features, [&](HalfedgeId h) {
      return std::find(close.begin(), close.end(), h) != close.end();
    });
    p = prepare_for_quads(map, context);
    scales = scales_of(p, map);
  }
  stats["seconds.coarse"] = watch.seconds();
  watch.restart();
  Attempt made = nearest_attempt(p, scales, std::max(target, 1.0), context, stats);
  stats["seconds.integers"] = watch.seconds();
  watch.restart();
  QuadMesh mesh = finished(p, std::move(made), map, surface, options, context, std::move(stats));
  mesh.stats["seconds.finish"] = watch.seconds();
  return mesh;
}

// On fewer triangles that are enough for them, then on all.
QuadMesh quads_by_proxy(const mesh::Surface& surface, QuadOptions options, Index triangles,
                        ExecutionContext& context) {
  Stopwatch watch;
  std::vector<VertexId> held;
  for (Eigen::Index i = 0; i < options.features.rows(); ++i)
    held.insert(held.end(), {options.features(i, 0), options.features(i, 1)});
  const IndexPairs features = options.features;
  mesh::Decimated few;
  {
    const ProgressRange range(context, 0.0, 0.2);
    few = mesh::decimate(surface, triangles, context, held);
  }
  const double decimated = watch.seconds();
  for (Eigen::Index i = 0; i < 2 * features.rows(); ++i)
    options.features.data()[i] = few.into[at(features.data()[i])];
  if (!options.sizing.empty()) {
    std::vector<double> sizing;
    for (const VertexId v : few.origin) sizing.push_back(options.sizing[at(v)]);
    options.sizing = std::move(sizing);
  }
  QuadMesh mesh;
  {
    const ProgressRange range(context, 0.2, 0.6);
    mesh = quads_of_all(few.surface, std::nullopt, options, context);
  }
  mesh.stats["seconds.decimated"] = decimated;
  mesh.stats["proxy_faces"] = static_cast<std::int64_t>(few.surface.faces.rows());
  watch.restart();
  {
    const ProgressRange range(context, 0.6, 0.8);
    BroughtBack back = bring_back(surface, features, mesh.quads, mesh.vertices, context);
    mesh.quad_parent = std::move(back.quad_parent);
    set_corners(surface, back.spots, mesh);
  }
  context.report("certifying", 0.8);
  certify(surface, nullptr, -1, mesh, context);
  mesh.stats["seconds.brought_back"] = watch.seconds();
  return mesh;
}

}  // namespace

QuadMesh quads_of_surface(const mesh::Surface& surface,
                          const std::optional<field::GivenField>& given, const QuadOptions& options,
                          ExecutionContext& context) {
  constexpr double kPerQuad = 8.0;
  constexpr double kFew = 50'000.0;
  field::check_sizing(options.sizing, surface);
  mesh::validate(surface, {}, context);
  const double enough = std::max(kFew, kPerQuad * wanted_quads(options, mesh::area_of(surface)));
  if (given || options.with_map || static_cast<double>(surface.faces.rows()) < 2.0 * enough)
    return quads_of_all(surface, given, options, context);
  return quads_by_proxy(surface, options, static_cast<Index>(enough), context);
}

QuadMesh quads_of_map(const certify::Parametrization& map, const mesh::Surface& surface,
                      const QuadOptions& options, ExecutionContext& context) {
  mesh::ValidateOptions rules;
  rules.reject_zero_area = false;  // pieces of a refined map may have none
  mesh::validate(map.surface, rules, context);
  const Prepared p = prepare_for_quads(map, context);
  Attempt made = attempt_of_map(p, context);
  if (!made.defects.empty())
    throw_invalid(ErrorCode::kBadOption, "The map's " + std::to_string(made.cells.quads.size()) +
                                             " cells are no mesh of quads: " + made.defects[0] +
                                             ". Take a map of more cells.");
  return finished(p, std::move(made), map, surface, options, context, {});
}

}  // namespace flipfree::quads
