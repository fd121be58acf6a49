#include "flipfree/quads/tiles.h"

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/quads/integers.h"
#include "flipfree/quads/transfer.h"
#include "flipfree/quads/turned_seams.h"

namespace flipfree::quads {

namespace {

double tiles_of(const Points2& uv) {
  double twice = 0.0;
  for (Eigen::Index c = 0; c < uv.rows(); c += 3) {
    const Vector2 a = (uv.row(c + 1) - uv.row(c)).transpose();
    const Vector2 b = (uv.row(c + 2) - uv.row(c)).transpose();
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

// With about so many tiles.
std::optional<certify::Parametrization> whole_map(const certify::Parametrization& map,
                                                  const FlatMap& flat,
                                                  const std::optional<Prepared>& prepared,
                                                  double wanted, ExecutionContext& context,
                                                  Stats& stats) {
  if (!prepared) {
    const double scale = std::sqrt(wanted / tiles_of(map.uv32.cast<double>()));
    return rounded_map(map, flat, scale, context, stats);
  }
  Scales scales = scales_of(*prepared, map);
  for (double& s : scales.scale) s *= std::sqrt(wanted);
  CoarseSurface coarse = prepared->coarse;
  if (!choose_integers(coarse, prepared->flat.surface, prepared->quarters, scales.component,
                       scales.scale, 0.0, context))
    return std::nullopt;
  return integer_map(map, map.surface, *prepared, coarse, context, stats);
}

void count_seams(certify::Parametrization& map) {
  double all = 0.0, matched = 0.0;
  std::int64_t quarter = 0, half = 0;
  for (std::size_t i = 0; i < map.transitions.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double length = (map.surface.vertices.row(map.cut_edges(row, 0)) -
                           map.surface.vertices.row(map.cut_edges(row, 1)))
                              .norm();
    const Index turns = map.transitions[i].quarter_turns;
    all += length;
    matched += turns == 0 ? length : 0.0;
    quarter += turns % 2;
    half += turns == 2 ? 1 : 0;
  }
  map.stats["seams"] = static_cast<std::int64_t>(map.transitions.size());
  map.stats["seams_quarter"] = quarter;
  map.stats["seams_half"] = half;
  map.stats["seams_matched"] = all > 0.0 ? matched / all : 1.0;
}

certify::Parametrization fit_in_time(certify::Parametrization map, const TileOptions& options,
                                     ExecutionContext& context) {
  constexpr int kMostTries = 5;
  constexpr double kFiner = 2.0;  // times as many tiles
  constexpr double kMostTiles = 1e10;
  mesh::ValidateOptions rules;
  rules.reject_zero_area = false;  // pieces of a refined map may have none
  mesh::validate(map.surface, rules, context);
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  const mesh::EdgeFlags flags = mesh::flag_edges(map.surface.faces, adjacency, options.features);
  for (HalfedgeId h = 0; at(h) < flags.size(); ++h)
    if (flags[at(h)] != 0 && h < adjacency.opposite[at(h)]) map.features.push_back(h);
  const double area = mesh::area_of(map.surface);
  double wanted = area / (options.tile * options.tile);
  if (!(wanted <= kMostTiles))
    throw_invalid(
        ErrorCode::kBadOption,
        "tile is so short that it takes more than 10000000000 of them. Give a longer one.");
  if (!(wanted > 0.0))
    throw_invalid(ErrorCode::kBadOption, "The surface has no area, or tile is too long for it.");
  FlatMap flat = flat_map(map);
  std::optional<Prepared> prepared;
  if (flat.oblique.empty()) prepared = prepare(flat, map, context);
  const std::vector<Index> quarters =
      quarters_around(flat.surface, at(map.surface.vertices.rows()));
  Stats stats;
  std::optional<certify::Parametrization> whole;
  for (int i = 0; i < kMostTries && !whole; ++i, wanted *= kFiner) {
    const ProgressRange range(context, 0.9 * i / kMostTries, 0.9 * (i + 1) / kMostTries);
    stats["tries"] = static_cast<std::int64_t>(i + 1);
    whole = whole_map(map, flat, prepared, wanted, context, stats);
  }
  if (!whole)
    throw_not_converged(ErrorCode::kIterationLimit,
                        "No map with whole tiles was found without a flip. Ask for smaller tiles, "
                        "or take a map with fewer cones.");
  if (options.prefer_translations) shorten_turned_seams(*whole, context);
  const double tiles = tiles_of(whole->uv);
  context.report("certifying", 0.9);
  certify_integers(quarters, map.surface, options.features, *whole, context);
  certify::require_certificate(*whole, "Fitting tiles");
  whole->stats = std::move(stats);
  whole->stats["tile"] = std::sqrt(area / tiles);
  whole->stats["tiles"] = tiles;
  count_seams(*whole);
  return *std::move(whole);
}

}  // namespace

certify::Parametrization fit_tiles(certify::Parametrization map, const TileOptions& options,
                                   ExecutionContext& context) {
  return in_time(context, options.max_seconds, "Whole tiles were not reached",
                 "or take a map with fewer cones",
                 [&] { return fit_in_time(std::move(map), options, context); });
}

}  // namespace flipfree::quads
