#include "flipfree/seamless/exact/seamless_map.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <optional>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/measures.h"
#include "flipfree/conformal/suggest_cones.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/exact/parts.h"
#include "flipfree/seamless/exact/take_back.h"
#include "flipfree/seamless/padding/padding.h"
#include "flipfree/seamless/request.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {
namespace {

// Cones of whole quarter turns for a surface that has none yet: per vertex, 4 where it is flat,
// kNotGiven at boundaries, as check_request() accepts them: those of conformal::suggest_cones on
// every connected part by itself; none where these would be the cones 3 and 5, which no torus has.
// The options' quantum is not looked at, max_seconds hold for each part. Errors: those of
// check_request() but for cones, and of suggest_cones().
std::vector<Index> suggested_turns(const mesh::Surface& surface,
                                   const conformal::SuggestConesOptions& options,
                                   ExecutionContext& context) {
  conformal::SuggestConesOptions own = options;
  own.quantum = kQuarterTurn;
  const Stopwatch watch;
  std::vector<Index> turns(at(surface.vertices.rows()), 4);
  const std::vector<SurfacePart> parts = connected_parts(surface, turns);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const ProgressRange range(context, i, parts.size());
    const mesh::Surface& part = parts[i].surface;
    constexpr double kLeastSeconds = 1e-3;
    if (options.enough_seconds > 0.0)  // what a part leaves is the next ones'
      own.enough_seconds = std::max(kLeastSeconds, options.enough_seconds - watch.seconds());
    const conformal::SuggestedCones found = placed(parts[i].faces, parts[i].vertices, [&] {
      return conformal::suggest_cones(mesh::InOwnUnit(part).surface(), own, context);
    });
    std::vector<Index> own_turns;
    for (const double angle : found.target_angles)
      own_turns.push_back(static_cast<Index>(std::lround(angle / kQuarterTurn)));
    for (const auto& loop : mesh::boundary_loops(part.faces, part.adjacency())) {
      for (const VertexId v : loop) own_turns[at(v)] = kNotGiven;
    }
    if (cone_list(own_turns) == std::vector<Index>{3, 5}) continue;
    for (std::size_t v = 0; v < own_turns.size(); ++v)
      turns[at(parts[i].vertices[v])] = own_turns[v];
  }
  return turns;
}

// Of the progress.
constexpr double kSuggestionShare = 0.4;
constexpr double kEngineShare = 0.5;
// Where boundaries may be free: the attempt without, then that to find out which must be.
constexpr double kFirstAttemptShare = 0.4, kPartsShare = 0.7;
// Of that of finish_map().
constexpr double kTakenBackShare = 0.6;
// Newton steps of the optimiser between two rounds of taking refinement back.
constexpr int kCoarseSteps = 15;

// Turns every chart of a closed part so that the mesh's edges, its `diagonals` (vertex pairs) left
// out, run along the axes as well as they can: no field says which way up. Where there is a
// boundary, that says it.
void turn_along_edges(const IndexPairs& diagonals, certify::Parametrization& map) {
  const mesh::Surface& surface = map.surface;
  const mesh::Components parts = mesh::face_components(surface.adjacency());
  const std::vector<char> open = open_parts(surface, parts);
  const std::vector<char> left_out =
      mesh::flag_pairs(surface.faces, static_cast<Index>(surface.vertices.rows()), &diagonals);
  const auto counts = [&](HalfedgeId h) {
    return open[at(parts.of_face[at(h / 3)])] == 0 && left_out[at(h)] == 0;
  };
  Points2 turned = map.uv;
  turn_to_axes(parts.of_face, parts.count, counts, turned);
  // Rounding may fold a sliver; the map then lies as it did.
  if (certify::flipped_faces(turned).empty()) map.uv = std::move(turned);
}

bool is_aligned(Boundary boundary) {
  return boundary != Boundary::kFree && boundary != Boundary::kTurning;
}

// The map's certificate, as a map of `surface`; throws if it does not hold.
void judge(const mesh::Surface& surface, const std::vector<Index>& cones, const Strips& strips,
           const SeamlessOptions& options, certify::Parametrization& map,
           ExecutionContext& context) {
  const Grace judging(context, Grace::kShort);
  certify::CertifyRequest request;
  request.require_seamless = options.exact;
  request.measure_overlaps = false;
  request.require_cones = true;
  request.features = options.features;
  request.require_features = false;
  if (options.exact) request.loops = strips;
  request.cone_angles = prescribed_angles(cones, surface, is_aligned(options.boundary));
  certify::certify_map(map, surface, request, context);
  certify::require_certificate(map, "The seamless map");
}

// Less distorted, its seams exact, as the options say; `aligned`: per face of the input.
void make_map_exact(const std::vector<char>& aligned, const SeamlessOptions& options,
                    certify::Parametrization& map, ExecutionContext& context) {
  distortion::CutMap cut = cut_of(map, aligned);
  cut.straight.insert(cut.straight.end(), options.straight.begin(), options.straight.end());
  distortion::ExactOptions exact_options;
  exact_options.optimise = options.optimise;
  exact_options.max_iterations = options.max_iterations;
  exact_options.exact = options.exact;
  distortion::ExactMap exact = placed(  // it counts faces of the refined map
      map.parent_face, {}, [&] { return distortion::make_exact(cut, exact_options, context); });
  map.uv = distortion::corners_of(cut, exact.uv);
  if (options.exact) {
    spread_charts(exact.step, map);
    map.uv32 = map.uv.cast<float>();
  } else {
    map.uv32 = Points2f(map.uv.rows(), 2);  // a resize that fails frees twice
    for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c)
      map.uv32.row(c) = exact.uv32.row(cut.surface.faces(c / 3, c % 3));
  }
  map.agreed.resize(0, 2);
  for (const distortion::StraightEdge& edge : options.straight) map.features.push_back(edge.h);
  for (auto& [name, value] : exact.stats) map.stats[name] = std::move(value);
}

certify::Parametrization map_at_once(const mesh::Surface& surface, const std::vector<Index>& cones,
                                     const SeamlessOptions& options, ExecutionContext& context) {
  PennerOptions engine = options.engine;
  engine.boundary = options.boundary;
  PennerMap found;
  {
    const ProgressRange range(context, 0.0, kEngineShare);
    found = by_engine(
        options.which, has_boundary(surface),
        [&] { return compute_penner_map(surface, cones, {}, engine, context); },
        [&] { return compute_padding_map(surface, cones, make_admissible_cut, engine, context); });
    turn_along_edges(engine.uncuttable, found.map);
  }
  const ProgressRange range(context, kEngineShare, 1.0);
  return finish_map(std::move(found), surface, {}, options, context);
}

// Boundaries are aligned where `cones` say how, and free elsewhere. What an aligned boundary would
// flatten is divided first.
certify::Parametrization map_with_corners(const mesh::Surface& surface,
                                          const std::vector<Index>& cones,
                                          const SeamlessOptions& options,
                                          ExecutionContext& context) {
  SeamlessOptions own = options;
  own.boundary = Boundary::kGiven;
  const std::optional<DividedSides> divided =
      divided_sides(surface, cones, side_chords(surface, cones), options.engine.uncuttable);
  if (!divided) return map_at_once(surface, cones, own, context);
  const DividedSides& pieces = *divided;
  own.engine.uncuttable = pieces.uncuttable;
  certify::Parametrization map = placed(pieces.provenance.face, pieces.place, [&] {
    return map_at_once(pieces.surface, pieces.cones, own, context);
  });
  name_input_places(surface, pieces.provenance, pieces.surface.faces, map);
  judge(surface, cones, {}, own, map, context);
  map.stats["divided_chords"] =
      static_cast<std::int64_t>(pieces.surface.vertices.rows() - surface.vertices.rows());
  map.stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows() - surface.vertices.rows());
  return map;
}

// Or why there is none.
Outcome<certify::Parametrization> aligned_map(const mesh::Surface& surface,
                                              const std::vector<SurfacePart>& parts,
                                              const std::vector<Index>& cones,
                                              const SeamlessOptions& options,
                                              ExecutionContext& context) {
  return attempt_part([&] {
    const std::vector<char> none(parts.size(), 0);
    return map_with_corners(surface, with_corners(parts, none, cones, context), options, context);
  });
}

// The parts that find no map with an aligned boundary and have no corners that somebody wants; all
// such parts if each finds one by itself.
std::vector<char> parts_to_free(const std::vector<SurfacePart>& parts,
                                const SeamlessOptions& options, ExecutionContext& context) {
  std::vector<char> freed(parts.size(), 0), may_be(parts.size(), 0);
  for (std::size_t i = 0; i < parts.size(); ++i)
    may_be[i] = parts[i].bordered && !parts[i].corners_given ? 1 : 0;
  if (parts.size() == 1) return may_be;
  SeamlessOptions own = options;
  own.engine.uncuttable.resize(0, 2);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const ProgressRange range(context, i, parts.size());
    if (may_be[i] == 0) continue;
    SurfacePart alone = parts[i];
    std::iota(alone.vertices.begin(), alone.vertices.end(), 0);
    if (!aligned_map(alone.surface, {alone}, alone.cones, own, context)) freed[i] = 1;
  }
  return std::count(freed.begin(), freed.end(), 1) > 0 ? freed : may_be;
}

// A map of a surface with a boundary.
certify::Parametrization map_of_open(const mesh::Surface& surface, const std::vector<Index>& given,
                                     const SeamlessOptions& options, ExecutionContext& context) {
  const std::vector<Index> cones = flat_inside(given, surface);
  const std::vector<SurfacePart> parts = connected_parts(surface, cones);
  std::vector<char> freed(parts.size(), 0);
  if (options.boundary == Boundary::kAligned)
    return map_with_corners(surface, with_corners(parts, freed, cones, context), options, context);
  std::optional<Outcome<certify::Parametrization>> first;
  {
    const ProgressRange range(context, 0.0, kFirstAttemptShare);
    first = aligned_map(surface, parts, cones, options, context);
  }
  if (*first) return std::move(**first);
  {
    const ProgressRange range(context, kFirstAttemptShare, kPartsShare);
    freed = parts_to_free(parts, options, context);
  }
  const ProgressRange range(context, kPartsShare, 1.0);
  certify::Parametrization map =
      map_with_corners(surface, with_corners(parts, freed, cones, context), options, context);
  map.stats["freed_boundaries"] =
      static_cast<std::int64_t>(std::count(freed.begin(), freed.end(), 1));
  return map;
}

certify::Parametrization map_in_scale(const mesh::Surface& surface, const std::vector<Index>& cones,
                                      const SeamlessOptions& options, ExecutionContext& context) {
  const bool aligned = options.boundary != Boundary::kFree && has_boundary(surface);
  return aligned ? map_of_open(surface, cones, options, context)
                 : map_at_once(surface, cones, options, context);
}

certify::Parametrization seamless_map_in_time(const mesh::Surface& surface,
                                              const std::vector<Index>& cones,
                                              const SeamlessOptions& options,
                                              ExecutionContext& context) {
  check_request(surface, cones, context);
  if (options.boundary == Boundary::kFree) check_free(surface, cones);
  return solve_in_scale(surface, [&](const EnlargedParts* parts) {
    if (parts == nullptr) return map_in_scale(surface, cones, options, context);
    certify::Parametrization map = map_in_scale(parts->surface, cones, options, context);
    place_on(surface, map);
    judge(surface, flat_inside(cones, surface), {}, options, map, context);
    map.stats["energy"] = map.certificate.energy;
    return map;
  });
}

}  // namespace

PennerMap by_engine(Engine which, bool open, const std::function<PennerMap()>& penner,
                    const std::function<PennerMap()>& padding) {
  if (which == Engine::kPadding) {
    if (open) {
      throw_invalid(
          ErrorCode::kBadOption,
          "The engine \"padding\" does not know surfaces with a boundary. Take the engine "
          "\"penner\" or \"auto\".");
    }
    return padding();
  }
  if (which == Engine::kPenner || open) return penner();
  auto first = attempt(penner);
  if (first) return std::move(*first);
  auto second = attempt(padding);
  if (!second) throw NotConverged(first.error());
  return std::move(*second);
}

certify::Parametrization compute_seamless_map(const mesh::Surface& surface,
                                              const std::vector<Index>& cones,
                                              const SeamlessOptions& options,
                                              ExecutionContext& context) {
  return in_time(context, options.max_seconds, "The seamless map was not reached",
                 "or spread the curvature over more vertices",
                 [&] { return seamless_map_in_time(surface, cones, options, context); });
}

certify::Parametrization finish_map(PennerMap found, const mesh::Surface& surface,
                                    const Strips& strips, const SeamlessOptions& options,
                                    ExecutionContext& context) {
  certify::Parametrization map = std::move(found.map);
  const std::vector<char> aligned = is_aligned(options.boundary)
                                        ? aligned_faces(surface, found.cones)
                                        : std::vector<char>(at(surface.faces.rows()), 0);
  const double engine_energy = map.certificate.energy;
  const auto engine_added = map.surface.vertices.rows() - surface.vertices.rows();
  // Strips are named by the faces that the engine's map has.
  const bool taken = options.optimise && engine_added > 0 && strips.empty();
  if (taken) {
    const ProgressRange range(context, 0.0, kTakenBackShare);
    const TimeLimit limit(context, seconds_to_search(context.seconds_left(),
                                                     static_cast<Index>(map.surface.faces.rows())));
    take_back(surface, aligned, options.engine.uncuttable,
              std::min(kCoarseSteps, options.max_iterations), map, context);
  }
  const ProgressRange finishing(context, taken ? kTakenBackShare : 0.0, 1.0);
  make_map_exact(aligned, options, map, context);
  write_transitions(map);
  judge(surface, found.cones, strips, options, map, context);
  map.stats.try_emplace("engine", std::string("penner"));
  map.stats.try_emplace("engine.added_vertices", static_cast<std::int64_t>(engine_added));
  map.stats.try_emplace("energy.engine", engine_energy);
  map.stats["energy.optimised"] = map.certificate.energy;
  map.stats["energy"] = map.certificate.energy;
  return map;
}

certify::Parametrization map_with_suggested_cones(const mesh::Surface& surface,
                                                  const SeamlessOptions& options,
                                                  ExecutionContext& context) {
  return in_time(context, options.max_seconds, "The seamless map was not reached",
                 "or give the cones", [&] {
                   std::vector<Index> cones;
                   {
                     const ProgressRange range(context, 0.0, kSuggestionShare);
                     check_surface(surface, context);
                     conformal::SuggestConesOptions suggestion;
                     suggestion.bound = options.suggested_bound;
                     // Saddles of many quarters each are far from any surface with many handles.
                     const Index euler = mesh::topology(surface.faces, surface.adjacency()).euler();
                     suggestion.max_cones = std::max(suggestion.max_cones, 4 * std::abs(euler));
                     // The best cones that half of the time finds, where it is limited, or else the
                     // first.
                     if (options.max_seconds > 0.0)
                       suggestion.enough_seconds = 0.5 * context.seconds_left();
                     cones = suggested_turns(surface, suggestion, context);
                   }
                   const ProgressRange range(context, kSuggestionShare, 1.0);
                   return seamless_map_in_time(surface, cones, options, context);
                 });
}

}  // namespace flipfree::seamless
