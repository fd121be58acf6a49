#include "flipfree/unwrap/packing/pack.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/measures.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/packing/place.h"
#include "flipfree/unwrap/packing/rectangles.h"

namespace flipfree::unwrap {
namespace {

struct PackedCharts {
  std::vector<Points2> uv;
  Grouping grouping;
  std::vector<Index> layout;
  std::vector<char> moved;
  std::vector<KeptAsStored> kept;
};

void check_options(const Points2& corner_uv, const PackOptions& options) {
  const auto require = [](bool holds, ErrorCode code, const std::string& what) {
    if (!holds) throw_invalid(code, what);
  };
  const auto text = [](auto number) { return std::to_string(number); };
  const Index first = options.first_tile;
  require(first >= 0 && first < kTiles, ErrorCode::kBadOption,
          "There are tiles 0 to 99 (UDIM 1001 to 1100), not " + text(first) + ".");
  require(options.tiles >= 1 && first + options.tiles <= kTiles, ErrorCode::kBadOption,
          "UDIM has tiles 1001 to 1100: from " + text(1001 + first) + " on there are " +
              text(kTiles - first) + ", not " + text(options.tiles) + ".");
  for (const std::vector<Index>* numbers : {&options.groups, &options.layouts}) {
    require(numbers->empty() || 3 * static_cast<Eigen::Index>(numbers->size()) == corner_uv.rows(),
            ErrorCode::kBadShape, "Groups and layouts need one number per face.");
  }
  if (!options.layouts.empty()) {
    require(!options.together && !options.place_like && options.tiles == 1, ErrorCode::kBadOption,
            "Layouts have a tile each. Give no layouts, or one tile and neither together nor "
            "place_like.");
    const std::set<Index> numbers(options.layouts.begin(), options.layouts.end());
    const std::size_t room = at(kTiles - first);
    require(options.share_tile || numbers.size() <= room, ErrorCode::kBadOption,
            "From that tile on UDIM has " + text(room) + ", not one for each of " +
                text(numbers.size()) + " layouts. Let them share a tile.");
  }
  require(options.groups.empty() || (!options.together && !options.stack), ErrorCode::kBadOption,
          "Groups move as one. Give no groups, or neither together nor stack.");
  for (const CornerId c : options.unmoved) {
    if (c < 0 || c >= corner_uv.rows()) {
      throw_invalid(ErrorCode::kIndexOutOfRange,
                    "Corner " + corner_id(c) + " that shall stay does not exist.");
    }
  }
  require(options.obstacles.rows() % 3 == 0, ErrorCode::kBadShape,
          "Obstacles need three rows per triangle.");
  require(options.obstacles.allFinite(), ErrorCode::kNotFinite,
          "An obstacle has a coordinate that is not finite. Leave it out.");
  if (!options.place_like) return;
  require(options.place_like->rows() == corner_uv.rows(), ErrorCode::kBadShape,
          "The former UVs need one row per face corner.");
  require(!options.together, ErrorCode::kBadOption,
          "Former places are kept chart by chart. Give no place_like, or not together.");
}

// What stays may lie on top of itself, so may what moves as one; stacked charts shall.
bool all_disjoint(const PackOptions& options) {
  return options.unmoved.empty() && options.groups.empty() && !options.stack &&
         (options.layouts.empty() || !options.share_tile);
}

// Turns over the charts that move and are mirror images.
void turn_over(const std::vector<mesh::Chart>& charts, const std::vector<CornerId>& unmoved,
               Points2& corner_uv) {
  if (certify::flipped_faces(corner_uv).empty()) return;
  std::set<FaceId> held;
  for (const CornerId c : unmoved) held.insert(c / 3);
  for (const mesh::Chart& chart : charts) {
    const auto stays = [&](FaceId f) { return held.count(f) != 0; };
    if (std::any_of(chart.faces.begin(), chart.faces.end(), stays)) continue;
    const Points2 image = mirror_image(by_vertex(chart, corner_uv));
    if (certify::flipped_faces(by_corner(chart.surface.faces, image)).empty())
      put_corners(chart, image, corner_uv);
  }
}

PackedCharts read_charts(const std::vector<mesh::Chart>& charts, const Points2& corner_uv,
                         const mesh::Components& components, const PackOptions& options,
                         const ExecutionContext& context) {
  std::vector<char> stays(at(corner_uv.rows()), 0);
  for (const CornerId c : options.unmoved) stays[at(c)] = 1;
  PackedCharts result;
  result.grouping.rigid = !options.groups.empty();
  for (const mesh::Chart& chart : charts) {
    Points2 uv = by_vertex(chart, corner_uv);
    std::vector<VertexId> fixed;
    for (std::size_t h = 0; h < corner_count(chart); ++h) {
      if (stays[corner_of(chart, h)] != 0) fixed.push_back(chart.surface.faces.data()[h]);
    }
    if (options.together)
      result.grouping.group.push_back(components.of_face[at(chart.faces.front())]);
    const auto highest = [&](const std::vector<Index>& numbers) {
      Index number = kInvalid;
      for (const FaceId f : chart.faces) number = std::max(number, numbers[at(f)]);
      return number;
    };
    if (!options.groups.empty()) result.grouping.group.push_back(highest(options.groups));
    if (!options.layouts.empty()) result.layout.push_back(highest(options.layouts));
    result.moved.push_back(fixed.empty());
    const bool bijective =
        options.keep_bijective && !overlaps_itself(chart.surface.faces, uv, context);
    result.kept.push_back({bijective, std::move(fixed)});
    result.uv.push_back(std::move(uv));
  }
  return result;
}

std::vector<Points2f> round_packed(const std::vector<mesh::Chart>& charts,
                                   const PackedCharts& packed, const std::vector<Points2>& uv,
                                   const ExecutionContext& context) {
  StoredCharts stored = store_charts(charts, uv, packed.kept, context);
  if (stored.unstorable.empty()) return std::move(stored.uv);
  auto& [c, error] = stored.unstorable.front();
  error.elements = first_elements(faces_at(error, charts[c].surface.faces));
  error.kind = ElementKind::kFace;
  for (Index& f : error.elements) f = charts[c].faces[at(f)];
  throw NotConverged(std::move(error));
}

template <class T>
std::vector<T> chosen(const std::vector<T>& all, const std::vector<std::size_t>& which) {
  std::vector<T> result;
  if (!all.empty())
    for (const std::size_t i : which) result.push_back(all[i]);
  return result;
}

// The charts of every layout by themselves, in its tile.
PlacedCharts place_layouts(const std::vector<mesh::Chart>& charts, const PackedCharts& packed,
                           const PackOptions& options, ExecutionContext& context) {
  PlacingOptions placing = options;
  const auto place = [&](const std::vector<mesh::Chart>& own, const PackedCharts& of,
                         const Points2& stays) {
    return place_charts(
        own, of.uv, of.moved, placing, of.grouping, stays,
        [&](const std::vector<Points2>& uv) { return round_packed(own, of, uv, context); },
        context);
  };
  if (packed.layout.empty()) return place(charts, packed, options.obstacles);
  std::map<Index, std::vector<std::size_t>> layouts;
  for (std::size_t c = 0; c < charts.size(); ++c) layouts[packed.layout[c]].push_back(c);
  PlacedCharts all;
  all.uv.resize(charts.size());
  all.stored.resize(charts.size());
  all.mirrored.resize(charts.size());
  all.margin_met = true;
  all.tile = options.first_tile;
  all.tiles = 0;
  double done = 0.0;
  for (const auto& [number, own] : layouts) {
    const double share = static_cast<double>(own.size()) / static_cast<double>(charts.size());
    const ProgressRange range(context, done, done + share);
    done += share;
    std::vector<Points2> stays{options.obstacles};
    for (std::size_t c = 0; c < charts.size() && !options.share_tile; ++c) {
      if (packed.moved[c] == 0 && packed.layout[c] != number)
        stays.push_back(by_corner(charts[c].surface.faces, packed.uv[c]));
    }
    const PackedCharts of{chosen(packed.uv, own),
                          {chosen(packed.grouping.group, own), packed.grouping.rigid},
                          {},
                          chosen(packed.moved, own),
                          chosen(packed.kept, own)};
    PlacedCharts placed = place(chosen(charts, own), of, below_each_other(stays));
    for (std::size_t i = 0; i < own.size(); ++i) {
      all.uv[own[i]] = std::move(placed.uv[i]);
      all.stored[own[i]] = std::move(placed.stored[i]);
      all.mirrored[own[i]] = placed.mirrored[i];
    }
    if (!options.share_tile) placing.first_tile = placed.tile + 1;
    all.tiles += placed.tiles;
    all.fill += placed.fill * placed.tiles;
    all.stacked += placed.stacked;
    all.enlarged += placed.enlarged;
    all.margin_met &= placed.margin_met;
  }
  all.fill /= std::max(all.tiles, Index{1});
  return all;
}

// Precondition: the surface is valid.
certify::Parametrization pack_clean(const mesh::Surface& surface, Points2 corner_uv,
                                    const PackOptions& options, ExecutionContext& context) {
  const Stopwatch watch;
  check_options(corner_uv, options);
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::EdgeFlags cuts = mesh::uv_cuts(adjacency, corner_uv);
  const std::vector<mesh::Chart> charts =
      mesh::split_into_charts(surface.vertices, mesh::cut_along(surface.faces, adjacency, cuts));
  if (options.stack_mirrored) turn_over(charts, options.unmoved, corner_uv);
  distortion::require_valid_map(surface, corner_uv, context);
  const PackedCharts packed =
      read_charts(charts, corner_uv, mesh::face_components(adjacency), options, context);
  PlacedCharts placed = [&] {
    const ProgressRange range(context, 0.1, 0.7);
    return place_layouts(charts, packed, options, context);
  }();

  certify::CertifyRequest request;
  if (placed.stacked > 0) request.mirrored.assign(at(surface.faces.rows()), 0);
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (placed.mirrored[c] == 0) continue;
    placed.uv[c].col(0) *= -1.0;
    placed.stored[c].col(0) *= -1.0F;
    for (const FaceId f : charts[c].faces) request.mirrored[at(f)] = 1;
  }
  certify::Parametrization map =
      map_of_charts(surface, mesh::flagged_edges(surface.faces, adjacency, cuts), charts, placed.uv,
                    placed.stored);
  context.report("certifying", 0.7);
  request.require_disjoint = all_disjoint(options);
  certify::certify_map(map, surface, request, context);
  certify::require_certificate(map, "The packed map");
  map.stats["charts"] = static_cast<std::int64_t>(charts.size());
  map.stats["density"] = areas_of(charts, placed.uv, packed.moved).density();
  report(placed, map.stats);
  map.stats["tiles"] = static_cast<std::int64_t>(placed.tiles);
  map.stats["stacked"] = static_cast<std::int64_t>(placed.stacked);
  map.stats["energy"] = map.certificate.energy;
  map.stats["seconds"] = watch.seconds();
  context.report("done", 1.0);
  return map;
}

// A mesh that is no clean surface: by way of one (mesh/separated).
certify::Parametrization pack_separated(const mesh::Surface& surface, const Points2& corner_uv,
                                        const PackOptions& options, ExecutionContext& context) {
  check_options(corner_uv, options);
  mesh::SeparateOptions separating;
  separating.corner_uv = &corner_uv;
  const certify::SeparatedMap separated(surface, separating, context);
  PackOptions own = options;
  own.unmoved = separated.corners(options.unmoved);
  for (std::vector<Index>* numbers : {&own.groups, &own.layouts}) {
    if (numbers->empty()) continue;
    std::vector<Index> of_faces;
    for (const FaceId f : separated.separated().face_origin) of_faces.push_back((*numbers)[at(f)]);
    *numbers = std::move(of_faces);
  }
  if (options.place_like) own.place_like = separated.corners(*options.place_like);
  const certify::Parametrization solved = separated.solve(
      [&] { return pack_clean(separated.surface(), separated.corners(corner_uv), own, context); });
  certify::CertifyRequest request;
  for (const CornerId c : options.unmoved) request.pins.push_back({c, corner_uv.row(c)});
  request.require_disjoint = all_disjoint(options);
  if (solved.certificate.mirrored_islands > 0) request.mirrored.assign(at(surface.faces.rows()), 0);
  for (const FaceId f : solved.certificate.mirrored_faces)
    request.mirrored[at(separated.separated().face_origin[at(f)])] = 1;
  certify::Parametrization map = separated.on_input(solved, request, context);
  certify::require_certificate(map, "The packed map");
  return map;
}

}  // namespace

certify::Parametrization pack(const mesh::Surface& surface, const Points2& corner_uv,
                              const PackOptions& options, ExecutionContext& context) {
  context.report("packing", 0.0);
  distortion::require_corner_uv(surface, corner_uv);
  return certify::is_clean(surface, context) ? pack_clean(surface, corner_uv, options, context)
                                             : pack_separated(surface, corner_uv, options, context);
}

}  // namespace flipfree::unwrap
