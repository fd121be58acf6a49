#include "flipfree/holonomy/field_aligned.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/alignment/align.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/field/smoothest.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/seamless/exact/parts.h"
#include "flipfree/seamless/exact/take_back.h"
#include "flipfree/seamless/request.h"

namespace flipfree::holonomy {
namespace {

// Adds the cut of a component, given as a chart of the input.
void add_piece(const mesh::Chart& chart, seamless::AdmissibleCut cut, RefinedPieces& out) {
  seamless::append_part(chart, cut.surface, out.surface);
  for (std::size_t v = chart.vertices.size(); v < cut.provenance.vertex.size(); ++v) {
    mesh::SurfacePoint& point = out.provenance.vertex.emplace_back(cut.provenance.vertex[v]);
    point.face = chart.faces[at(point.face)];
  }
  for (const FaceId f : cut.provenance.face) out.provenance.face.push_back(chart.faces[at(f)]);
  out.cuts.push_back(std::move(cut));
}

// Cuts one component, whose face f is the surface's faces[f], along the field where that works.
seamless::CutMaker turning_cutter(const mesh::Surface& surface, const field::CrossField& field,
                                  seamless::Reroutings& done) {
  const std::vector<double> rotation = field::rotation_form(field::measure_frames(surface), field);
  return [&, rotation](const mesh::Surface& component, const std::vector<Index>& cones,
                       const std::vector<FaceId>& faces, ExecutionContext& context) {
    const auto turning = [&](field::DualLoop strip) {
      for (HalfedgeId& h : strip) h = 3 * faces[at(h / 3)] + h % 3;
      return field::turning_number(surface, field, strip);
    };
    std::vector<double> crossings;
    for (const FaceId f : faces) {
      for (Index k = 0; k < 3; ++k) crossings.push_back(-rotation[at(3 * f + k)]);
    }
    return seamless::make_turning_cut(component, cones, {turning, std::move(crossings), &done},
                                      context);
  };
}

}  // namespace

RefinedPieces field_cut(const mesh::Surface& surface, const field::CrossField* field,
                        const std::vector<Index>& cones, seamless::Reroutings& done,
                        ExecutionContext& context) {
  const seamless::CutMaker make_cut =
      field != nullptr ? turning_cutter(surface, *field, done) : seamless::make_admissible_cut;
  const std::vector<seamless::SurfacePart> charts = seamless::connected_parts(surface, cones);
  RefinedPieces out;
  out.surface.vertices = surface.vertices;
  out.provenance.vertex.resize(at(surface.vertices.rows()));
  for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c)
    out.provenance.vertex[at(surface.faces(c / 3, c % 3))] = {c / 3, Vector3::Unit(c % 3)};
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const ProgressRange range(context, i, charts.size());
    add_piece(charts[i], make_cut(charts[i].surface, charts[i].cones, charts[i].faces, context),
              out);
  }
  return out;
}

namespace {

// Of the progress.
constexpr double kEngineShare = 0.5;
constexpr double kTakenBackShare = 0.65;
// Of that of aligned_map().
constexpr double kAlignmentShare = 0.6;
// Newton steps between two rounds of taking refinement back.
constexpr int kCoarseSteps = 15;

// What a map is to follow, and how.
struct Aligning {
  const mesh::Surface& surface;
  const field::CrossField& field;
  const NeededTopology& needed;
  const AlignedOptions& options;
  ExecutionContext& context;

  const mesh::Adjacency& adjacency() const { return surface.adjacency(); }
  bool aligned() const { return options.boundary == seamless::Boundary::kAligned; }
  bool on_border(VertexId v) const {
    return adjacency().opposite[at(adjacency().vertex_halfedge[at(v)])] == kInvalid;
  }
};

// A map with the topology that is needed, and without flips. Where `reroute` is off, padding's
// loops turn as they happen to, so that the topology is that of the cones alone.
seamless::PennerMap engine_map(const Aligning& to) {
  const mesh::Surface& surface = to.surface;
  const AlignedOptions& options = to.options;
  ExecutionContext& context = to.context;
  seamless::PennerOptions engine = options.engine;
  engine.boundary = options.boundary;
  return seamless::by_engine(
      options.which, seamless::has_boundary(surface),
      [&] {
        return seamless::compute_penner_map(surface, to.needed.cones, to.needed.loops, engine,
                                            context);
      },
      [&] {
        seamless::Reroutings done;
        const bool turning = options.reroute || options.which != seamless::Engine::kPadding;
        seamless::PennerMap found = seamless::compute_padding_map(
            surface, to.needed.cones,
            turning ? turning_cutter(surface, to.field, done) : seamless::make_admissible_cut,
            engine, context);
        Stats& stats = found.map.stats;
        stats["reroutings.loops"] = static_cast<std::int64_t>(done.loops);
        stats["reroutings.guided"] = static_cast<std::int64_t>(done.shortest);
        stats["reroutings.fallback"] = static_cast<std::int64_t>(done.fallback);
        stats["reroutings.quarters"] = static_cast<std::int64_t>(done.quarters);
        stats["reroutings.straight"] = static_cast<std::int64_t>(done.straight);
        return found;
      });
}

// Where no angle is asked for, at free boundaries, the field may have any number of quarter turns.
void check_cones(const Aligning& to) {
  std::vector<Index> cones = to.needed.cones;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    const bool any = !to.aligned() && to.on_border(static_cast<VertexId>(v));
    if (any) cones[v] = seamless::kNotGiven;
    if (cones[v] >= 1 || any) continue;
    throw_invalid(ErrorCode::kBadAngles,
                  "The field turns by so much around vertex " + vertex_id(v) +
                      " that a map would have " + std::to_string(cones[v]) +
                      " quarter turns there, and every map has 1 at least. Smooth the field there.",
                  ElementKind::kVertex, {static_cast<Index>(v)});
  }
  seamless::check_request(to.surface, cones, to.context);
}

// The geometric mean of the sizing at a face's corners.
double mean_sizing(const mesh::Surface& surface, FaceId f, const Vector3& weight,
                   const std::vector<double>& sizing) {
  double sum = 0.0;
  for (int k = 0; k < 3; ++k)
    if (weight[k] > 0.0) sum += weight[k] * std::log(sizing[at(surface.faces(f, k))]);
  return std::exp(sum);
}

// Loops of the refined surface that generate its homology, and those along its boundaries, with the
// field's turns.
seamless::Strips strips_of(const Refinement& refined, const Aligning& to) {
  seamless::Strips strips;
  const auto add = [&](std::vector<DualLoop> loops) {
    for (DualLoop& loop : loops) {
      if (loop.empty()) continue;
      const DualLoop on_input = refined.projected(loop);
      // Around nothing: the corner of a face that was divided.
      if (on_input.empty()) continue;
      const Index turns = field::turning_number(to.surface, to.field, on_input);
      strips.emplace_back(std::move(loop), turns);
    }
  };
  add(intrinsic::tree_cotree(refined.surface, to.context).loops);
  add(field::boundary_strips(refined.surface));
  return strips;
}

// The edges of the refined surface on features inside of the input, with the direction of the four
// in which the field lets each run. Where it turns between, or is 30 degrees off, there is none.
std::vector<distortion::StraightEdge> features_of(const Refinement& refined,
                                                  const IndexPairs& wanted,
                                                  const std::vector<double>& direction) {
  if (wanted.rows() == 0) return {};
  constexpr double kMostOff = 1.0 / 3.0;  // of a quarter turn
  const std::vector<HalfedgeId>& opposite = refined.surface.adjacency().opposite;
  const mesh::EdgeFlags flags =
      mesh::flag_edges(refined.input.faces, refined.input.adjacency(), wanted);
  const field::Frames frames = field::measure_frames(refined.surface);
  std::vector<distortion::StraightEdge> features;
  for (HalfedgeId h = 0; at(h) < opposite.size(); ++h) {
    const HalfedgeId o = opposite[at(h)];
    if (o < h) continue;  // the boundary as well
    const HalfedgeId side = refined.input_halfedge(h);
    if (side == kInvalid || flags[at(side)] == 0) continue;
    const auto turns = [&](HalfedgeId i) {
      return (frames.direction[at(i)] - direction[at(i / 3)]) / kQuarterTurn;
    };
    const double there = turns(h), back = turns(o);
    if (std::abs(there - std::round(there)) > kMostOff ||
        std::abs(back - std::round(back)) > kMostOff)
      continue;
    // One of the two forwards along its axis, so that neighbours in one chart are one line.
    const Index quarter = static_cast<Index>(std::lround(there)) & 3;
    const Index other = static_cast<Index>(std::lround(back)) & 3;
    features.push_back(quarter < 2 ? distortion::StraightEdge{h, quarter}
                                   : distortion::StraightEdge{o, other});
  }
  return features;
}

void add_angles(const distortion::CutMap& cut, const std::vector<double>& direction,
                const Points2& uv, const ExecutionContext& context, Stats& stats) {
  const Points2 off = distortion::angles_off(cut, direction, uv, context);
  std::vector<std::pair<double, double>> sorted;
  for (const auto& face : off.rowwise()) sorted.emplace_back(face[0], face[1]);
  std::sort(sorted.begin(), sorted.end());
  const double area = off.col(1).sum();
  double below = 0.0;
  std::size_t i = 0;
  while (i + 1 < sorted.size() && below + sorted[i].second < 0.95 * area)
    below += sorted[i++].second;
  stats["angle_mean"] = off.col(0).dot(off.col(1)) / area;
  stats["angle_p95"] = sorted[i].first;
}

// A unit vector of the face, `angle` from its first edge, in the map; any positive length.
Vector2 mapped(const mesh::Surface& surface, FaceId f, double angle, const Points2& corner_uv) {
  const auto [a, b] = mesh::sides_at(surface, 3 * f);
  // b is `right` along a and `left` to the left of it.
  const double right = a.dot(b) / a.norm(), left = a.cross(b).norm() / a.norm();
  const double second = std::sin(angle) / left;
  const double first = (std::cos(angle) - second * right) / a.norm();
  return first * (corner_uv.row(3 * f + 1) - corner_uv.row(3 * f)).transpose() +
         second * (corner_uv.row(3 * f + 2) - corner_uv.row(3 * f)).transpose();
}

// Turns the UVs (3 #F x 2) of each component of the surface, as a whole, so that the map takes the
// directions to +u in the mean by area. `upright`: components with a boundary, which runs along the
// axes, turn by whole quarters. Cost: O(#F).
void turn_towards(const mesh::Surface& surface, const std::vector<double>& direction, bool upright,
                  Points2& corner_uv) {
  const mesh::Components parts = mesh::face_components(surface.adjacency());
  std::vector<char> by_quarters(at(parts.count), 0);
  if (upright) by_quarters = seamless::open_parts(surface, parts);
  std::vector<std::complex<double>> mean(at(parts.count), 0.0);
  for (FaceId f = 0; at(f) < direction.size(); ++f) {
    const Vector2 d = mapped(surface, f, direction[at(f)], corner_uv);
    const double length = d.norm();
    if (!(length > 0.0) || !std::isfinite(length)) continue;
    const auto [a, b] = mesh::sides_at(surface, 3 * f);
    mean[at(parts.of_face[at(f)])] +=
        0.5 * a.cross(b).norm() / length * std::complex<double>(d.x(), d.y());
  }
  for (std::size_t part = 0; part < mean.size(); ++part) {
    if (by_quarters[part] == 0) continue;
    constexpr std::complex<double> kQuarters[] = {{1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}};
    const double quarters = std::arg(mean[part]) / kQuarterTurn;
    mean[part] = kQuarters[at(static_cast<Index>(std::lround(quarters)) & 3)];
  }
  for (CornerId c = 0; c < static_cast<CornerId>(corner_uv.rows()); ++c) {
    const std::complex<double> m = mean[at(parts.of_face[at(c / 3)])];
    if (!(std::abs(m) > 0.0)) continue;
    const std::complex<double> z =
        std::complex<double>(corner_uv(c, 0), corner_uv(c, 1)) * std::conj(m) / std::abs(m);
    corner_uv.row(c) << z.real(), z.imag();
  }
}

// Per face of the refinement: angle from its half-edge 3 f to the direction, counter-clockwise. The
// first face of each piece between cuts begins, with the field's own direction. Precondition: cut
// along `cuts`, the surface consists of disks without cones inside. Cost: O(#F).
std::vector<double> combed_directions(const Refinement& refined, const mesh::EdgeFlags& cuts,
                                      const field::CrossField& field) {
  // Per face: quarter turns from its parent's direction to the one that is chosen.
  std::vector<Index> turned(refined.parent_face.size(), 0);
  const std::vector<Index> quarters = field::quarters_across(refined.input, field);
  mesh::for_each_face_across(
      refined.surface.adjacency(), [&](HalfedgeId h, HalfedgeId) { return cuts[at(h)] == 0; },
      [&](HalfedgeId h, HalfedgeId o) {
        const HalfedgeId side = refined.input_halfedge(h);
        // This face's direction goes with the neighbour's, turned by so many quarters.
        const Index across = side == kInvalid ? 0 : quarters[at(side)];
        turned[at(o / 3)] = (turned[at(h / 3)] + across) % 4;
      });
  const Points3 of_parent = field::directions_of(refined.input, field.angle);
  std::vector<double> angle =
      field::angles_of(refined.surface, of_parent(refined.parent_face, Eigen::all));
  for (std::size_t f = 0; f < turned.size(); ++f) angle[f] += turned[f] * kQuarterTurn;
  return angle;
}

// The second half: an engine's map that is to follow the field, as a map of `given`: the surface,
// or what it was before parts of it were enlarged.
certify::Parametrization aligned_map(seamless::PennerMap found, const mesh::Surface& given,
                                     const Aligning& to) {
  const AlignedOptions& options = to.options;
  ExecutionContext& context = to.context;
  certify::Parametrization& map = found.map;
  const mesh::Adjacency& own = map.surface.adjacency();
  const Refinement refined{to.surface, map.surface, map.parent_face};
  const mesh::EdgeFlags cuts = mesh::flag_edges(map.surface.faces, own, map.cut_edges);
  const seamless::Strips strips = options.reroute ? strips_of(refined, to) : seamless::Strips{};
  const std::vector<double> direction = combed_directions(refined, cuts, to.field);
  Points2 turned = map.uv;
  turn_towards(map.surface, direction, to.aligned(), turned);
  // Rounding may fold a sliver; the map is then aligned from where it lies.
  if (certify::flipped_faces(turned).empty()) map.uv = std::move(turned);
  distortion::CutMap cut = distortion::cut_map(map.surface, own, cuts, map.uv);
  if (to.aligned()) cut.straight = distortion::straight_boundary(cut, own);
  seamless::SeamlessOptions finish;
  finish.optimise = false;
  finish.exact = options.exact;
  finish.boundary = options.boundary;
  finish.features = options.features;
  const std::vector<distortion::StraightEdge> features =
      features_of(refined, options.features, direction);
  Stats stats;
  add_angles(cut, direction, cut.uv, context, stats);
  stats["angle_mean_engine"] = stats["angle_mean"];
  if (options.optimise) {
    const ProgressRange range(context, 0.0, kAlignmentShare);
    distortion::AlignOptions align;
    align.direction = direction;
    for (std::size_t f = 0; f < map.parent_face.size() && !options.sizing.empty(); ++f)
      align.size.push_back(mean_sizing(to.surface, map.parent_face[f], Vector3::Constant(1.0 / 3.0),
                                       options.sizing));
    align.max_iterations = options.max_iterations;
    try {
      if (features.empty()) {
        map.uv = distortion::corners_of(cut, distortion::align(cut, align, context, stats));
      } else {
        distortion::FeatureAlignment met =
            distortion::align_with_features(cut, align, features, context, stats);
        map.uv = distortion::corners_of(cut, met.uv);
        finish.straight = std::move(met.features);
      }
    } catch (...) {
      seamless::rethrow_placed(map.parent_face, {});  // it counts faces of the refined map
    }
  }
  const ProgressRange range(context, options.optimise ? kAlignmentShare : 0.0, 1.0);
  if (&given != &to.surface) seamless::place_on(given, map);
  certify::Parametrization result =
      seamless::finish_map(std::move(found), given, strips, finish, context);
  Points2 uv(cut.uv.rows(), 2);
  for (CornerId c = 0; c < static_cast<CornerId>(result.uv.rows()); ++c)
    uv.row(cut.surface.faces(c / 3, c % 3)) = result.uv.row(c);
  add_angles(cut, direction, uv, context, stats);
  for (auto& [name, value] : stats) result.stats[name] = std::move(value);
  result.stats["loops_checked"] = static_cast<std::int64_t>(strips.size());
  return result;
}

// An engine's map; if it is to be optimised, with as little refinement as it can do with.
seamless::PennerMap simplified_engine_map(const Aligning& to) {
  seamless::PennerMap found;
  {
    const ProgressRange range(to.context, 0.0, kEngineShare);
    found = engine_map(to);
  }
  const auto added = found.map.surface.vertices.rows() - to.surface.vertices.rows();
  found.map.stats["energy.engine"] = found.map.certificate.energy;
  if (!to.options.optimise || added == 0) return found;
  const ProgressRange range(to.context, kEngineShare, kTakenBackShare);
  const std::vector<char> faces(at(to.surface.faces.rows()), to.aligned() ? 1 : 0);
  seamless::take_back(to.surface, faces, to.options.engine.uncuttable, kCoarseSteps, found.map,
                      to.context);
  return found;
}

// Edges that an aligned boundary or features would flatten: as if the surface were cut open along
// these, which are straight where the field has two quarter turns beside them.
std::vector<HalfedgeId> flattened_edges(const Aligning& to) {
  const IndexPairs& lines = to.options.features;
  if (lines.rows() == 0 && !to.aligned()) return {};
  const mesh::EdgeFlags features = mesh::flag_edges(to.surface.faces, to.adjacency(), lines);
  const mesh::CutMesh open = mesh::cut_along(to.surface.faces, to.adjacency(), features);
  mesh::Surface beside{Points3(std::ssize(open.vertex_origin), 3), open.faces};
  for (Eigen::Index v = 0; v < beside.vertices.rows(); ++v)
    beside.vertices.row(v) = to.surface.vertices.row(open.vertex_origin[at(v)]);
  field::CrossField apart = to.field;
  for (std::size_t h = 0; h < features.size(); ++h)
    if (features[h] != 0) apart.matching[h] = 0;
  std::vector<Index> turns = field::cone_turns(field::measure_frames(beside), apart);
  std::vector<char> on_feature(to.needed.cones.size(), 0);
  for (const VertexId v : lines.reshaped()) on_feature[at(v)] = 1;
  for (std::size_t v = 0; v < turns.size(); ++v) {
    const VertexId origin = open.vertex_origin[v];
    if (to.on_border(origin) && (!to.aligned() || on_feature[at(origin)] == 0))
      turns[v] = to.aligned() ? to.needed.cones[at(origin)] : 0;
  }
  return seamless::side_chords(beside, turns);
}

// The same; what an aligned boundary or features would flatten is divided first. Padding alone
// looks at the field, which is of the whole faces, and it knows closed surfaces only.
seamless::PennerMap map_without_side_chords(const Aligning& to) {
  std::optional<seamless::DividedSides> divided;
  if (to.options.which != seamless::Engine::kPadding) {
    divided = seamless::divided_sides(to.surface, to.needed.cones, flattened_edges(to),
                                      to.options.engine.uncuttable);
  }
  if (!divided) return simplified_engine_map(to);
  const seamless::DividedSides& pieces = *divided;
  AlignedOptions of_pieces = to.options;
  of_pieces.engine.uncuttable = pieces.uncuttable;
  of_pieces.which = seamless::Engine::kPenner;
  seamless::PennerMap found;
  try {
    const NeededTopology needed{
        pieces.cones,
        turned_loops({to.surface, pieces.surface, pieces.provenance.face}, pieces.cones, to.field,
                     to.needed.border, to.aligned(), to.context),
        {}};
    found = simplified_engine_map({pieces.surface, to.field, needed, of_pieces, to.context});
  } catch (const NotConverged&) {
    // Whole faces may be possible, by padding too; features beside flattened edges are then missed.
    if (to.options.features.rows() > 0) return simplified_engine_map(to);
    seamless::rethrow_placed(pieces.provenance.face, pieces.place);
  } catch (...) {
    seamless::rethrow_placed(pieces.provenance.face, pieces.place);
  }
  seamless::name_input_places(to.surface, pieces.provenance, pieces.surface.faces, found.map);
  const std::int64_t chords = pieces.surface.vertices.rows() - to.surface.vertices.rows();
  Stats& stats = found.map.stats;
  stats["divided_chords"] = chords;
  found.cones = to.needed.cones;
  return found;
}

certify::Parametrization map_in_scale(const mesh::Surface& given, const Aligning& to) {
  seamless::PennerMap found = map_without_side_chords(to);
  const ProgressRange range(to.context, kTakenBackShare, 1.0);
  certify::Parametrization map = aligned_map(std::move(found), given, to);
  map.stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows() - given.vertices.rows());
  return map;
}

certify::Parametrization map_in_time(const mesh::Surface& surface, const field::CrossField& field,
                                     const AlignedOptions& given, ExecutionContext& context) {
  AlignedOptions options = given;
  const bool aligned = options.boundary == seamless::Boundary::kAligned;
  if (!aligned) options.boundary = seamless::Boundary::kTurning;
  seamless::check_surface(surface, context);
  field::check_sizing(options.sizing, surface);
  const NeededTopology needed = needed_topology(surface, field, aligned, options.ragged, context);
  const Aligning to{surface, field, needed, options, context};
  check_cones(to);
  return seamless::solve_in_scale(surface, [&](const seamless::EnlargedParts* parts) {
    return parts == nullptr
               ? map_in_scale(surface, to)
               : map_in_scale(surface, {parts->surface, field, needed, options, context});
  });
}

}  // namespace

certify::Parametrization compute_field_aligned_map(const mesh::Surface& surface,
                                                   const field::CrossField& field,
                                                   const AlignedOptions& options,
                                                   ExecutionContext& context) {
  return in_time(context, options.max_seconds, "The field-aligned map was not reached",
                 "or simplify the field",
                 [&] { return map_in_time(surface, field, options, context); });
}

std::vector<double> carried_sizing(const mesh::Surface& surface, const mesh::Provenance& provenance,
                                   const std::vector<double>& sizing) {
  std::vector<double> carried;
  for (const mesh::SurfacePoint& point : provenance.vertex) {
    const bool placed = point.face != kInvalid;
    carried.push_back(placed ? mean_sizing(surface, point.face, point.weight, sizing) : 1.0);
  }
  return carried;
}

namespace {

// Edges inside between two features, from one to the other or with one beside either face; longest
// first. An aligned boundary is one as well.
std::vector<HalfedgeId> edges_between(const mesh::Surface& surface, const AlignedOptions& options) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::EdgeFlags features = mesh::flag_edges(surface.faces, adjacency, options.features);
  const bool aligned = options.boundary == seamless::Boundary::kAligned;
  std::vector<char> vertex_on(at(surface.vertices.rows()), 0), face_on(at(surface.faces.rows()), 0);
  for (HalfedgeId h = 0; at(h) < features.size(); ++h) {
    if (features[at(h)] == 0 && !(aligned && adjacency.opposite[at(h)] == kInvalid)) continue;
    face_on[at(h / 3)] = 1;
    vertex_on[at(mesh::source(surface.faces, h))] = vertex_on[at(mesh::target(surface.faces, h))] =
        1;
  }
  std::vector<std::pair<double, HalfedgeId>> found;
  for (HalfedgeId h = 0; at(h) < features.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    const VertexId a = mesh::source(surface.faces, h), b = mesh::target(surface.faces, h);
    if (o < h || features[at(h)] != 0) continue;  // the boundary as well
    if ((vertex_on[at(a)] == 0 || vertex_on[at(b)] == 0) &&
        (face_on[at(h / 3)] == 0 || face_on[at(o / 3)] == 0))
      continue;
    found.emplace_back(-(surface.vertices.row(a) - surface.vertices.row(b)).norm(), h);
  }
  std::sort(found.begin(), found.end());
  std::vector<HalfedgeId> edges;
  for (const auto& [length, h] : found) edges.push_back(h);
  return edges;
}

double missed_length(const certify::Parametrization& map) {
  double sum = 0.0;
  for (const auto& [a, b] : map.certificate.features_missed)
    sum += (map.surface.vertices.row(a) - map.surface.vertices.row(b)).norm();
  return sum;
}

}  // namespace

certify::Parametrization compute_map_along_features(const mesh::Surface& surface,
                                                    const field::FieldOptions& made,
                                                    const AlignedOptions& options,
                                                    ExecutionContext& context) {
  constexpr double kFieldShare = 0.2, kFirstShare = 0.5;
  const auto solve = [&](const mesh::Surface& own, const field::FieldOptions& field,
                         const AlignedOptions& align) {
    field::CrossField found;
    {
      const ProgressRange range(context, 0.0, kFieldShare);
      found = field::compute_cross_field(own, field, context).field;
    }
    const ProgressRange range(context, kFieldShare, 1.0);
    return compute_field_aligned_map(own, found, align, context);
  };
  const bool once = options.features.rows() == 0 || made.cones;
  certify::Parametrization whole;
  {
    const ProgressRange range(context, 0.0, once ? 1.0 : kFirstShare);
    whole = solve(surface, made, options);
  }
  if (once || whole.certificate.features_missed.empty()) return whole;
  const ProgressRange range(context, kFirstShare, 1.0);
  try {
    const std::optional<seamless::DividedSides> divided =
        seamless::divided_sides(surface, std::vector<Index>(at(surface.vertices.rows()), 4),
                                edges_between(surface, options), options.engine.uncuttable);
    if (!divided) return whole;
    const seamless::DividedSides& pieces = *divided;
    field::FieldOptions field = made;
    AlignedOptions align = options;
    align.engine.uncuttable = pieces.uncuttable;
    if (!made.sizing.empty())
      field.sizing = align.sizing = carried_sizing(surface, pieces.provenance, made.sizing);
    certify::Parametrization map = solve(pieces.surface, field, align);
    seamless::name_input_places(surface, pieces.provenance, pieces.surface.faces, map);
    map.stats["divided_between"] =
        static_cast<std::int64_t>(pieces.surface.vertices.rows() - surface.vertices.rows());
    map.stats["added_vertices"] =
        static_cast<std::int64_t>(map.surface.vertices.rows() - surface.vertices.rows());
    // What was judged is a map of the pieces: that these lie on the surface is left.
    certify::Parametrization placed = map;
    certify::CertifyRequest places;
    places.measure_overlaps = false;
    certify::certify_map(placed, surface, places, context);
    const bool better = placed.certificate.ok && missed_length(map) < missed_length(whole);
    return better ? map : whole;
  } catch (const Cancelled&) {
    throw;
  } catch (const InternalError&) {
    throw;
  } catch (const Exception&) {
    return whole;  // the pieces have no such map, or not in time
  }
}

}  // namespace flipfree::holonomy
