#include "flipfree/unwrap/repair/repair.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/unwrap/repair/repair_clean.h"

namespace flipfree::unwrap {
namespace {

// Counts: one that is missing is 0.
void add(const StatValue& more, StatValue& count) {
  const auto value = [](const StatValue& stat) {
    const auto* number = std::get_if<std::int64_t>(&stat);
    return number == nullptr ? std::int64_t{0} : *number;
  };
  count = value(count) + value(more);
}

// Corners of faces that use a vertex twice, which no chart has: where another corner at their
// vertex was at the same place they go on to be where that is, else they stay. But for pinned ones.
void follow_neighbours(const std::vector<FaceId>& collapsed, const mesh::Surface& surface,
                       const Points2& corner_uv, const std::vector<certify::CornerPin>& pins,
                       certify::Parametrization& map) {
  if (collapsed.empty()) return;
  using Place = std::tuple<VertexId, double, double>;
  const auto place_of = [&](CornerId c) {
    return Place{surface.faces.data()[c], corner_uv(c, 0), corner_uv(c, 1)};
  };
  std::map<Place, CornerId> at_place;  // of the faces that have a triangle
  std::vector<CornerId> following;
  const auto corners = static_cast<CornerId>(surface.faces.size());
  std::vector<char> held(static_cast<std::size_t>(corners), 0);
  for (const certify::CornerPin& pin : pins) held[static_cast<std::size_t>(pin.corner)] = 1;
  for (const FaceId f : collapsed) {
    for (CornerId c = 3 * f; c < 3 * f + 3; ++c) {
      if (held[static_cast<std::size_t>(c)] != 0 || !is_storable(corner_uv.row(c).transpose()))
        continue;
      following.push_back(c);
      at_place.try_emplace(place_of(c), kInvalid);
    }
  }
  for (CornerId c = 0; c < corners; ++c) {
    if (!is_storable(corner_uv.row(c).transpose()) ||
        std::binary_search(collapsed.begin(), collapsed.end(), c / 3))
      continue;
    const auto found = at_place.find(place_of(c));
    if (found != at_place.end() && found->second == kInvalid) found->second = c;
  }
  const auto follow = [&](auto& values) {
    using Scalar = typename std::decay_t<decltype(values)>::Scalar;
    for (const CornerId c : following) {
      const CornerId leader = at_place.at(place_of(c));
      if (leader == kInvalid) {
        values.row(c) = corner_uv.row(c).template cast<Scalar>();
      } else {
        values.row(c) = values.row(leader);
      }
    }
  };
  follow(map.uv);
  follow(map.uv32);
  if (map.agreed.rows() > 0) follow(map.agreed);
}

// A mesh that is no clean surface: by way of one (mesh/separated), with corner_uv as its map.
certify::Parametrization repair_separated(const mesh::Surface& surface, const Points2& corner_uv,
                                          const RepairOptions& options, ExecutionContext& context) {
  // Values that are none join nothing and turn nothing over.
  Points2 finite = corner_uv;
  for (Eigen::Index c = 0; c < finite.rows(); ++c) {
    if (!is_storable(finite.row(c).transpose())) finite.row(c).setZero();
  }
  mesh::SeparateOptions separating;
  separating.corner_uv = &finite;
  separating.diagonals = &options.uncuttable;
  const certify::SeparatedMap separated(surface, separating, context);
  RepairOptions own = options;
  own.cuts = separated.edges(options.cuts);
  own.uncuttable = separated.edges(options.uncuttable);
  own.pins = separated.pins(options.pins);
  const Points2 own_uv = separated.corners(corner_uv);
  const certify::Parametrization solved =
      separated.solve([&] { return repair_clean(separated.surface(), own_uv, own, context); });
  certify::CertifyRequest request;
  request.pins = options.pins;
  request.aspect = options.aspect;
  certify::Parametrization map = separated.on_input(solved, request, context);
  follow_neighbours(separated.separated().collapsed, surface, corner_uv, options.pins, map);
  return map;
}

// Which faces are one island, and which side of it is up, is read from the map. The repaired one
// can be read otherwise: faces at an edge of contradictory windings, apart before, may have come to
// share it. What is wrong with it then is repaired as well.
certify::Parametrization repair_any(const mesh::Surface& surface, const Points2& corner_uv,
                                    const RepairOptions& options, ExecutionContext& context) {
  constexpr int kRounds = 8;
  certify::Parametrization map = repair_separated(surface, corner_uv, options, context);
  for (int round = 1;; ++round) {
    {
      const Untimed judging(context);
      certify::CertifyRequest request;
      request.surface = &surface;
      request.uv = &map.uv;
      request.uv32 = &map.uv32;
      request.pins = options.pins;
      request.require_bijective = options.overlaps != SelfOverlaps::kKeep;
      request.require_disjoint = options.disjoint && options.pins.empty();
      request.aspect = options.aspect;
      map.certificate = certify::certify_any(request, context);
    }
    if (map.certificate.ok || round == kRounds) break;
    Stats before = std::move(map.stats);
    map = repair_separated(surface, map.uv, options, context);
    for (auto& [name, value] : before) {
      if (name.starts_with("charts_") || name == "added_cuts") add(value, map.stats[name]);
      if (name.ends_with("_before") || name.starts_with("corners_")) map.stats[name] = value;
    }
  }
  map.stats["corners_kept"] = (map.uv.array() == corner_uv.array()).rowwise().all().count();
  map.stats["energy"] = map.certificate.energy;
  map.stats["max_energy"] = map.certificate.max_energy;
  certify::require_certificate(map, "The repaired map");
  return map;
}

}  // namespace

certify::Parametrization repair(const mesh::Surface& surface, const Points2& corner_uv,
                                const RepairOptions& options, ExecutionContext& context) try {
  const Stopwatch watch;
  const TimeLimit limit(context, limit_of(options.max_seconds));
  context.report("checking the map", 0.0);
  distortion::require_corner_uv(surface, corner_uv);
  certify::Parametrization map = certify::is_clean(surface, context)
                                     ? repair_clean(surface, corner_uv, options, context)
                                     : repair_any(surface, corner_uv, options, context);
  map.stats["seconds"] = watch.seconds();
  const Untimed finishing(context);
  context.report("done", 1.0);
  return map;
} catch (const TimeIsOver&) {
  if (!(options.max_seconds > 0)) throw;  // the limit is the caller's
  throw_out_of_time("Not all islands were mended", options.max_seconds,
                    "or repair the mesh in parts");
}

}  // namespace flipfree::unwrap
