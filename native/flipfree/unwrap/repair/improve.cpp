#include "flipfree/unwrap/repair/improve.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/certify/texture.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/place.h"
#include "flipfree/unwrap/repair/given_map.h"
#include "flipfree/unwrap/repair/repair.h"

namespace flipfree::unwrap {
namespace {

// Turns `uv` by the angle that brings it nearest to `like`, centres it there, scales it; only if it
// stays flip-free.
void place_like(const Triangles& faces, const Points2& like, double scale, bool bijective,
                Points2& uv, const ExecutionContext& context) {
  Points2 placed = moved(fit_motion(uv, like, scale), uv);
  if (!distortion::is_flip_free(faces, placed, context)) return;
  if (bijective && overlaps_itself(faces, placed, context)) return;
  uv = std::move(placed);
}

// From the texture to UVs, with every pin at its place. What rounding on the way would fold stays
// as it was given; with pins, storing it will say so.
Points2 brought_back(const Points2& uv, const Triangles& faces, const Points2& given,
                     const VertexPins& pins, double aspect, const ExecutionContext& context) {
  if (aspect == 1.0) return uv;
  Points2 back = certify::from_texture(uv, aspect, given);
  for (const auto& [v, target] : pins) back.row(v) = target.transpose();
  return !pins.empty() || distortion::is_flip_free(faces, back, context) ? back : given;
}

// The chart's map for `uv`, which is given, and what is stored of it, which is returned. scale:
// length on the texture of a surface length 1, over the whole map.
Points2f improve_chart(const mesh::Chart& chart, const VertexPins& pins,
                       const ImproveOptions& options, double scale, Points2& uv, Stats& stats,
                       ExecutionContext& context) {
  const mesh::InOwnUnit own(chart.surface);
  scale *= own.unit();
  const Points2 given = uv;
  const Points2 before = certify::on_texture(given, options.aspect);
  uv = before;
  const Triangles& faces = chart.surface.faces;
  distortion::MinimizeOptions minimize;
  minimize.max_iterations = options.max_iterations;
  minimize.tolerance = options.tolerance;
  minimize.bijective = [&] {
    const Grace reading(context);
    return options.keep_bijective && !overlaps_itself(faces, given, context);
  }();
  distortion::RoundingOptions rounding;
  rounding.bijective = minimize.bijective;
  try {
    if (pins.empty()) {
      improve_in_time(context, stats, [&] {
        const MapInHand before_is_valid(context);
        distortion::Minimized better = distortion::with_own_map([&] {
          return distortion::minimize_distortion(own.surface(), before, minimize, context);
        });
        report(better, stats);
        uv = std::move(better.uv);
      });
      const Grace placing(context);
      place_like(faces, before, scale, minimize.bijective, uv, context);
    } else {
      minimize.acceptable = true;
      const VertexPins targets = on_texture(pins, options.aspect);
      distortion::TargetsResult result = distortion::with_own_map([&] {
        return distortion::minimize_with_targets(own.surface(), before, targets, minimize, context);
      });
      report(result, stats);
      if (!result.missed.empty()) {
        const VertexId v = result.missed.front();
        throw_not_converged(ErrorCode::kLineSearchStalled,
                            "The pin at (" + std::to_string(given(v, 0)) + ", " +
                                std::to_string(given(v, 1)) + ") in the map came only " +
                                std::to_string(static_cast<int>(100 * result.fraction)) +
                                " % of its way without flipping a triangle. Match pins instead, "
                                "which refines the mesh.");
      }
      uv = std::move(result.uv);
      for (const auto& [v, target] : pins) rounding.fixed.push_back(v);
    }
    const Grace storing(context, Grace::kShort);
    uv = brought_back(uv, faces, given, pins, options.aspect, context);
    return distortion::round_to_storage(faces, uv, rounding, context, stats);
  } catch (const TimeIsOver&) {
    if (!(options.max_seconds > 0)) throw;  // the limit is the caller's
    if (pins.empty())
      throw_out_of_time("The map was not stored", options.max_seconds, "or cut it into parts");
    throw_out_of_time("The pins were not reached", options.max_seconds,
                      "or move pins nearer to where their surroundings are");
  } catch (const NotConverged& e) {
    // Elements of a chart are no elements of the user's mesh.
    const FaceId first = chart.faces.front();
    throw_not_converged(e.error().code,
                        "Chart at face " + face_id(first) + ": " + e.error().message,
                        ElementKind::kFace, {first});
  }
}

certify::Parametrization improve_clean(const mesh::Surface& surface, const Points2& corner_uv,
                                       const ImproveOptions& options, ExecutionContext& context) {
  const Stopwatch watch;
  distortion::require_valid_map(surface, corner_uv, context);
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::EdgeFlags cuts = mesh::uv_cuts(adjacency, corner_uv);
  const std::vector<mesh::Chart> charts =
      mesh::split_into_charts(surface.vertices, mesh::cut_along(surface.faces, adjacency, cuts));
  const ChartPins pins =
      pins_of_charts(charts, options.pins, static_cast<Index>(surface.faces.size()));
  std::vector<Points2> uv;
  for (const mesh::Chart& chart : charts) uv.push_back(by_vertex(chart, corner_uv));
  std::vector<Points2f> stored(charts.size());
  std::vector<Stats> stats(charts.size());
  const double scale =
      areas_of(charts, on_texture(uv, options.aspect), std::vector<char>(charts.size(), 1))
          .density();
  certify::CertifyRequest request;
  request.surface = &surface;
  request.uv = &corner_uv;
  request.measure_overlaps = false;
  request.aspect = options.aspect;
  const double energy_before = certify::certify(request, context).energy;
  const std::vector<std::size_t> order = largest_first(charts);
  bool hurried = false;
  {
    const ProgressRange range(context, 0.05, 0.93);
    const double left =
        std::min(limit_of(options.max_seconds) - watch.seconds(), context.seconds_left());
    const TimeLimit limit(context,
                          seconds_to_search(left, static_cast<Index>(surface.faces.rows())));
    // Charts for which there is no time keep their maps.
    const ExecutionContext timed(&context, 1);
    const Grace all(context);
    for_each_chart(
        charts, order, "reducing distortion", context, [&](std::size_t c, ExecutionContext& part) {
          const TimeLimit own(part, timed.seconds_left());
          stored[c] = improve_chart(charts[c], pins[c], options, scale, uv[c], stats[c], part);
        });
    hurried = timed.time_is_over() || context.accepted();
  }
  const Grace finishing(context);
  context.report("certifying", 0.95);
  certify::Parametrization map = map_of_charts(
      surface, mesh::flagged_edges(surface.faces, adjacency, cuts), charts, uv, stored);
  map.stats = std::move(stats[order[0]]);
  certify::CertifyRequest final_request;
  final_request.pins = options.pins;
  final_request.aspect = options.aspect;
  certify::certify_map(map, surface, final_request, context);
  const bool keeps_input =
      options.pins.empty() && map.certificate.ok && map.certificate.energy > energy_before;
  if (keeps_input) {
    // Nothing was gained: the user's own values, as far as 32 bits hold them.
    certify::Parametrization given = map;
    given.uv = corner_uv;
    given.uv32 = corner_uv.cast<float>();
    certify::certify_map(given, surface, final_request, context);
    if (given.certificate.ok) map = std::move(given);  // or rounding folds them
  }
  map.stats["time_limit_reached"] = static_cast<std::int64_t>(hurried);
  map.stats["charts"] = static_cast<std::int64_t>(charts.size());
  map.stats["energy_before"] = energy_before;
  map.stats["energy"] = map.certificate.energy;
  map.stats["max_energy"] = map.certificate.max_energy;
  map.stats["added_vertices"] = std::int64_t{0};
  map.stats["seconds"] = watch.seconds();
  certify::require_certificate(map, "The improved map");
  context.report("done", 1.0);
  return map;
}

// A mesh that is no clean surface: by way of one (mesh/separated).
certify::Parametrization improve_separated(const mesh::Surface& surface, const Points2& corner_uv,
                                           const ImproveOptions& options,
                                           ExecutionContext& context) {
  mesh::SeparateOptions separating;
  separating.corner_uv = &corner_uv;
  const certify::SeparatedMap separated(surface, separating, context);
  ImproveOptions own = options;
  own.pins = separated.pins(options.pins);
  const certify::Parametrization solved = separated.solve([&] {
    return improve_clean(separated.surface(), separated.corners(corner_uv), own, context);
  });
  const Grace finishing(context);
  certify::CertifyRequest request;
  request.pins = options.pins;
  request.aspect = options.aspect;
  certify::Parametrization map = separated.on_input(solved, request, context);
  certify::require_certificate(map, "The improved map");
  return map;
}

}  // namespace

certify::Parametrization improve(const mesh::Surface& surface, const Points2& corner_uv,
                                 const ImproveOptions& options, ExecutionContext& context) {
  context.report("checking the map", 0.0);
  distortion::require_corner_uv(surface, corner_uv);
  return certify::is_clean(surface, context)
             ? improve_clean(surface, corner_uv, options, context)
             : improve_separated(surface, corner_uv, options, context);
}

certify::Parametrization improve_any(const mesh::Surface& surface, const Points2& corner_uv,
                                     const ImproveOptions& options, ExecutionContext& context) {
  const Stopwatch watch;
  try {
    return improve(surface, corner_uv, options, context);
  } catch (const InvalidInput& refused) {
    if (refused.error().code != ErrorCode::kFlippedMap) throw;
  }
  RepairOptions mending;
  mending.pins = options.pins;
  mending.overlaps = SelfOverlaps::kKeep;
  mending.stretched = StretchedIslands::kIgnore;
  mending.max_seconds = options.max_seconds;
  mending.aspect = options.aspect;
  const certify::Parametrization mended = [&] {
    const ProgressRange range(context, 0.0, 0.5);
    return repair(surface, corner_uv, mending, context);
  }();
  // What is left of the time; errors speak of all of it.
  constexpr double kLeastSeconds = 1e-3;
  const TimeLimit left(context, options.max_seconds > 0.0
                                    ? std::max(kLeastSeconds, options.max_seconds - watch.seconds())
                                    : limit_of(0.0));
  const ProgressRange range(context, 0.5, 1.0);
  certify::Parametrization map = improve(surface, mended.uv32.cast<double>(), options, context);
  map.stats["energy_before"] = std::numeric_limits<double>::infinity();
  map.stats.insert(mended.stats.begin(), mended.stats.end());
  map.stats["seconds"] = watch.seconds();
  return map;
}

}  // namespace flipfree::unwrap
