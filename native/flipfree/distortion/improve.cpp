#include "flipfree/distortion/improve.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/certify/texture.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"

namespace flipfree::distortion {
namespace {

using Targets = std::vector<std::pair<VertexId, Vector2>>;

struct ChartMap {
  Points2 uv;
  Points2f uv32;
  Targets pins;
  bool bijective = false;
  Stats stats;
};

// Corner pins as targets of chart vertices; corners of one vertex must agree.
void assign_pins(const mesh::Surface& surface, const std::vector<mesh::Chart>& charts,
                 const ImproveOptions& options, std::vector<ChartMap>& maps) {
  if (options.pins.empty()) return;
  std::vector<std::pair<Index, Index>> place(at(static_cast<Index>(surface.faces.rows())));
  for (std::size_t c = 0; c < charts.size(); ++c) {
    for (std::size_t f = 0; f < charts[c].faces.size(); ++f) {
      place[at(charts[c].faces[f])] = {static_cast<Index>(c), static_cast<Index>(f)};
    }
  }
  certify::require_storable_pins(options.pins, static_cast<Index>(surface.faces.size()));
  for (const certify::CornerPin& pin : options.pins) {
    const auto [c, f] = place[at(pin.corner / 3)];
    Targets& pins = maps[at(c)].pins;
    pins.emplace_back(charts[at(c)].surface.faces(f, pin.corner % 3), pin.uv);
  }
  for (ChartMap& map : maps) {
    Targets& pins = map.pins;
    std::stable_sort(pins.begin(), pins.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t i = 1; i < pins.size(); ++i) {
      if (pins[i].first != pins[i - 1].first || pins[i].second == pins[i - 1].second) continue;
      throw_invalid(ErrorCode::kBadPins,
                    "Two corners that share one place in the map are pinned to different places. "
                    "Unpin one of them.");
    }
    pins.erase(std::unique(pins.begin(), pins.end(),
                           [](const auto& a, const auto& b) { return a.first == b.first; }),
               pins.end());
  }
}

// UV length of a surface length 1, over the whole map.
double common_scale(const mesh::Surface& surface, const Points2& corner_uv) {
  double uv_area = 0;
  double area = 0;
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    const Vector2 a = (corner_uv.row(3 * f + 1) - corner_uv.row(3 * f)).transpose();
    const Vector2 b = (corner_uv.row(3 * f + 2) - corner_uv.row(3 * f)).transpose();
    uv_area += std::abs(a.x() * b.y() - a.y() * b.x());
    const Vector3 p =
        surface.vertices.row(surface.faces(f, 1)) - surface.vertices.row(surface.faces(f, 0));
    const Vector3 q =
        surface.vertices.row(surface.faces(f, 2)) - surface.vertices.row(surface.faces(f, 0));
    area += std::sqrt(std::max(0.0, p.squaredNorm() * q.squaredNorm() - p.dot(q) * p.dot(q)));
  }
  return std::sqrt(uv_area / area);
}

// Turns `uv` by the angle that brings it nearest to `like`, centres it there, scales it; only if it
// stays flip-free.
void place_like(const Triangles& faces, const Points2& like, double scale, bool bijective,
                Points2& uv, const ExecutionContext& context) {
  Points2 placed = moved(fit_motion(uv, like, scale), uv);
  if (!is_flip_free(faces, placed, context)) return;
  if (bijective && overlaps_itself(faces, placed, context)) return;
  uv = std::move(placed);
}

// Names the chart by its first face: elements of a chart are no elements of the user's mesh.
Error in_chart(const Error& error, const mesh::Chart& chart) {
  Error named = error;
  named.message = "Chart at face " + face_id(chart.faces.front()) + ": " + error.message;
  named.kind = ElementKind::kFace;
  named.elements = {chart.faces.front()};
  return named;
}

// From the texture to UVs, with every pin at its place. What rounding on the way would fold stays
// as it was given; with pins, storing it will say so.
void bring_back(const Triangles& faces, const Points2& given, double aspect, ChartMap& map,
                const ExecutionContext& context) {
  if (aspect == 1.0) return;
  Points2 uv = certify::from_texture(map.uv, aspect, given);
  for (const auto& [v, target] : map.pins) uv.row(v) = target.transpose();
  map.uv = !map.pins.empty() || is_flip_free(faces, uv, context) ? std::move(uv) : given;
}

// scale: length on the texture of a surface length 1, over the whole map.
void improve_chart(const mesh::Chart& chart, const ImproveOptions& options, double scale,
                   ChartMap& map, ExecutionContext& context) {
  const mesh::InOwnUnit own(chart.surface);
  scale *= own.unit();
  const Points2 given = map.uv;
  const Points2 before = certify::on_texture(given, options.aspect);
  map.uv = before;
  const Triangles& faces = chart.surface.faces;
  MinimizeOptions minimize;
  minimize.max_iterations = options.max_iterations;
  minimize.tolerance = options.tolerance;
  minimize.bijective = map.bijective;
  RoundingOptions rounding;
  rounding.bijective = map.bijective;
  try {
    if (map.pins.empty()) {
      improve_in_time(context, map.stats, [&] {
        const MapInHand before_is_valid(context);
        Minimized better = with_own_map(
            [&] { return minimize_distortion(own.surface(), before, minimize, context); });
        report(better, map.stats);
        map.uv = std::move(better.uv);
      });
      const Grace placing(context);
      place_like(faces, before, scale, map.bijective, map.uv, context);
    } else {
      minimize.acceptable = true;
      Targets targets = map.pins;
      for (auto& [v, target] : targets) target = certify::on_texture(target, options.aspect);
      TargetsResult result = with_own_map(
          [&] { return minimize_with_targets(own.surface(), before, targets, minimize, context); });
      report(result, map.stats);
      if (!result.missed.empty()) {
        const VertexId v = result.missed.front();
        throw_not_converged(ErrorCode::kLineSearchStalled,
                            "The pin at (" + std::to_string(given(v, 0)) + ", " +
                                std::to_string(given(v, 1)) + ") in the map came only " +
                                std::to_string(static_cast<int>(100 * result.fraction)) +
                                " % of its way without flipping a triangle. Match pins instead, "
                                "which refines the mesh.");
      }
      map.uv = std::move(result.uv);
      for (const auto& [v, target] : map.pins) rounding.fixed.push_back(v);
    }
    const Grace storing(context, Grace::kShort);
    bring_back(faces, given, options.aspect, map, context);
    map.uv32 = round_to_storage(faces, map.uv, rounding, context, map.stats);
  } catch (const TimeIsOver&) {
    if (!(options.max_seconds > 0)) throw;  // the limit is the caller's
    if (map.pins.empty())
      throw_out_of_time("The map was not stored", options.max_seconds, "or cut it into parts");
    throw_out_of_time("The pins were not reached", options.max_seconds,
                      "or move pins nearer to where their surroundings are");
  } catch (const NotConverged& e) {
    throw NotConverged(in_chart(e.error(), chart));
  }
}

// The largest chart alone if it is half of everything, the others side by side.
void improve_all(const std::vector<mesh::Chart>& charts, const ImproveOptions& options,
                 double scale, std::vector<ChartMap>& maps, ExecutionContext& context) {
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return charts[a].faces.size() > charts[b].faces.size();
  });
  std::size_t total = 0;
  for (const mesh::Chart& chart : charts) total += chart.faces.size();
  std::size_t alone = 0;
  if (2 * charts[order[0]].faces.size() >= total) {
    const ProgressRange range(
        context, 0.0,
        static_cast<double>(charts[order[0]].faces.size()) / static_cast<double>(total));
    improve_chart(charts[order[0]], options, scale, maps[order[0]], context);
    alone = 1;
  }
  // Charts for which there is no time keep their maps.
  const ExecutionContext timed(&context, 1);
  const Grace all(context);
  parallel_for(context, order.size() - alone, 1, [&](std::size_t i, std::size_t, std::size_t) {
    ExecutionContext part(&timed, 1);
    improve_chart(charts[order[alone + i]], options, scale, maps[order[alone + i]], part);
  });
}

// Spreads the charts' UVs over the corners.
template <typename Pick>
auto corners_of(const mesh::Surface& surface, const std::vector<mesh::Chart>& charts,
                const std::vector<ChartMap>& maps, Pick pick) {
  std::decay_t<decltype(pick(maps.front()))> corners(3 * surface.faces.rows(), 2);
  for (std::size_t c = 0; c < charts.size(); ++c) {
    for (std::size_t f = 0; f < charts[c].faces.size(); ++f) {
      for (Index k = 0; k < 3; ++k) {
        corners.row(3 * charts[c].faces[f] + k) =
            pick(maps[c]).row(charts[c].surface.faces(static_cast<Eigen::Index>(f), k));
      }
    }
  }
  return corners;
}

certify::Parametrization improve_clean(const mesh::Surface& surface, const Points2& corner_uv,
                                       const ImproveOptions& options, ExecutionContext& context) {
  const Stopwatch watch;
  require_valid_map(surface, corner_uv, context);
  const mesh::Adjacency adjacency = mesh::build_adjacency(surface);
  const mesh::EdgeFlags cuts = mesh::uv_cuts(adjacency, corner_uv);
  const mesh::CutMesh cut = mesh::cut_along(surface.faces, adjacency, cuts);
  const std::vector<mesh::Chart> charts = mesh::split_into_charts(surface.vertices, cut);
  std::vector<ChartMap> maps(charts.size());
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const Triangles& faces = charts[c].surface.faces;
    maps[c].uv.resize(charts[c].surface.vertices.rows(), 2);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) {
        maps[c].uv.row(faces(f, k)) =
            corner_uv.row(3 * charts[c].faces[static_cast<std::size_t>(f)] + k);
      }
    }
    maps[c].bijective = options.keep_bijective && !overlaps_itself(faces, maps[c].uv, context);
  }
  assign_pins(surface, charts, options, maps);

  certify::Parametrization map;
  map.surface = surface;
  map.cut_edges = mesh::flagged_edges(surface.faces, adjacency, cuts);
  certify::set_identity_provenance(map);
  certify::CertifyRequest request;
  request.surface = &surface;
  request.uv = &corner_uv;
  request.measure_overlaps = false;
  request.aspect = options.aspect;
  const double energy_before = certify::certify(request, context).energy;
  bool hurried = false;
  {
    const ProgressRange range(context, 0.05, 0.93);
    const double left =
        std::min(limit_of(options.max_seconds) - watch.seconds(), context.seconds_left());
    const TimeLimit limit(context,
                          seconds_to_search(left, static_cast<Index>(surface.faces.rows())));
    improve_all(charts, options,
                common_scale(surface, certify::on_texture(corner_uv, options.aspect)), maps,
                context);
    hurried = context.time_is_over() || context.accepted();
  }
  const Grace finishing(context);
  context.report("certifying", 0.95);
  map.uv =
      corners_of(surface, charts, maps, [](const ChartMap& m) -> const Points2& { return m.uv; });
  map.uv32 = corners_of(surface, charts, maps,
                        [](const ChartMap& m) -> const Points2f& { return m.uv32; });
  const auto largest = std::max_element(
      charts.begin(), charts.end(),
      [](const mesh::Chart& a, const mesh::Chart& b) { return a.faces.size() < b.faces.size(); });
  map.stats = maps[static_cast<std::size_t>(largest - charts.begin())].stats;
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
  require_corner_uv(surface, corner_uv);
  return certify::is_clean(surface, context)
             ? improve_clean(surface, corner_uv, options, context)
             : improve_separated(surface, corner_uv, options, context);
}

}  // namespace flipfree::distortion
