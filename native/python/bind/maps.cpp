// Maps of any triangles: unwrap, improve, repair, pack; of disks with a prescribed boundary, lines
// and pins: embed, match.
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/embedding/embed_surface.h"
#include "flipfree/matchmaker/match.h"
#include "flipfree/unwrap/islands/grids.h"
#include "flipfree/unwrap/packing/pack.h"
#include "flipfree/unwrap/repair/improve.h"
#include "flipfree/unwrap/repair/repair.h"
#include "flipfree/unwrap/seams/auto_islands.h"
#include "flipfree/unwrap/unwrap.h"
#include "job.h"

namespace flipfree::python {
namespace {

unwrap::UnwrapOptions read_unwrap(OptionReader& read) {
  unwrap::UnwrapOptions options;
  FLIPFREE_READ(read, options, cuts, uncuttable, pins, bijective, may_add_cuts, cut_extremities,
                tolerance, margin, effort, max_seconds);
  read("materials", options.material);
  read("polygons", options.polygon);
  read("find_seams", options.seams.find);
  read("stretch", options.seams.stretch);
  read("sharp_angle", options.seams.sharp_angle);
  read("weighted", options.seams.weighted);
  read("weights", options.seams.weights);
  read("iterations", options.max_iterations);
  return options;
}

unwrap::RectifyOptions read_rectify(OptionReader& read) {
  unwrap::RectifyOptions options;
  read("uv", options.corner_uv);
  read("polygons", options.polygon);
  read("cuts", options.cuts);
  return options;
}

unwrap::ImproveOptions read_improve(OptionReader& read) {
  unwrap::ImproveOptions options;
  FLIPFREE_READ(read, options, pins, keep_bijective, tolerance, max_seconds, aspect);
  read("iterations", options.max_iterations);
  return options;
}

unwrap::RepairOptions read_repair(OptionReader& read) {
  using unwrap::SelfOverlaps;
  using unwrap::StretchedIslands;
  unwrap::RepairOptions options;
  FLIPFREE_READ(read, options, cuts, uncuttable, pins, disjoint, margin, tolerance, max_seconds,
                aspect);
  read.choice(
      "overlaps", options.overlaps,
      {{"cut", SelfOverlaps::kCut}, {"open", SelfOverlaps::kOpen}, {"keep", SelfOverlaps::kKeep}});
  read.choice("stretched", options.stretched,
              {{"keep", StretchedIslands::kCount}, {"improve", StretchedIslands::kImprove}});
  read("iterations", options.max_iterations);
  return options;
}

unwrap::PackOptions read_pack(OptionReader& read) {
  using unwrap::Rotation;
  unwrap::PackOptions options;
  FLIPFREE_READ(read, options, margin, together, scale_true, keep_bijective, unmoved, obstacles,
                groups, layouts, share_tile, stack_mirrored, effort, first_tile, tiles, density);
  read.choice("rotation", options.rotation,
              {{"none", Rotation::kNone},
               {"quarters", Rotation::kQuarters},
               {"straight", Rotation::kStraight},
               {"free", Rotation::kFree}});
  read("stack_similar", options.stack);
  return options;
}

embedding::EmbedSurfaceOptions read_embed(OptionReader& read) {
  using embedding::BoundaryShape;
  using embedding::EmbedMethod;
  embedding::EmbedSurfaceOptions options;
  read.choice("boundary", options.shape,
              {{"circle", BoundaryShape::kCircle},
               {"square", BoundaryShape::kSquare},
               {"triangle", BoundaryShape::kTriangle}});
  FLIPFREE_READ(read, options, polygon, loop, initial, start_from_tutte, optimise, tolerance,
                max_seconds);
  read.choice("method", options.method,
              {{"ladder", EmbedMethod::kLadder},
               {"progressive", EmbedMethod::kProgressive},
               {"tutte", EmbedMethod::kTutte}});
  read("iterations", options.max_iterations);
  return options;
}

matchmaker::MatchRequest read_request(OptionReader& read) {
  using matchmaker::Polygon;
  matchmaker::MatchRequest request;
  const auto [pinned, targets] = read.value<std::pair<std::vector<VertexId>, Polygon>>("points");
  for (std::size_t i = 0; i < pinned.size(); ++i) request.points.push_back({pinned[i], targets[i]});
  using Line = std::pair<std::vector<VertexId>, Polygon>;
  for (auto& [vertices, polyline] : read.value<std::vector<Line>>("lines")) {
    request.lines.push_back({vertices, polyline});
  }
  FLIPFREE_READ(read, request, boundary_loop, boundary_uv, paths, movable);
  return request;
}

matchmaker::MatchOptions read_match(OptionReader& read) {
  using matchmaker::MatchEngine;
  matchmaker::MatchOptions options;
  FLIPFREE_READ(read, options, optimise, bijective, max_seconds);
  read("iterations", options.max_iterations);
  read.choice("engine", options.engine,
              {{"auto", MatchEngine::kAuto},
               {"first try", MatchEngine::kFirstTry},
               {"outline", MatchEngine::kOutline},
               {"arms", MatchEngine::kArms},
               {"matchmaker", MatchEngine::kMatchmaker}});
  return options;
}

}  // namespace

void bind_maps(py::module_& module) {
  using Places = std::optional<Points2>;
  const auto uv = option<Points2>("uv");
  const auto place_like = option<Places>("place_like");
  def_job(module, "embed", prepared(&embedding::embed_surface, read_embed));
  def_job(module, "match", prepared(&matchmaker::match, read_request, read_match));
  const auto unwrap_like = [](const auto& surface, const Places& places,
                              unwrap::UnwrapOptions options, auto& context) {
    options.place_like = places ? &*places : nullptr;
    return unwrap::unwrap(surface, options, context);
  };
  def_job(module, "unwrap", prepared(unwrap_like, place_like, read_unwrap));
  def_job(module, "auto_seams", prepared(&unwrap::find_seams, read_unwrap));
  def_job(module, "rectify", "The islands were not straightened",
          "or straighten fewer faces at once", prepared(&unwrap::rectify, read_rectify));
  const auto improve = [](const auto& surface, const Points2& corner_uv, bool repair,
                          const auto& options, auto& context) {
    return repair ? unwrap::improve_any(surface, corner_uv, options, context)
                  : unwrap::improve(surface, corner_uv, options, context);
  };
  def_job(module, "improve", prepared(improve, uv, option<bool>("repair"), read_improve));
  def_job(module, "repair", prepared(&unwrap::repair, uv, read_repair));
  const auto pack_like = [](const auto& surface, const Points2& corner_uv, const Places& places,
                            unwrap::PackOptions options, auto& context) {
    options.place_like = places ? &*places : nullptr;
    return unwrap::pack(surface, corner_uv, options, context);
  };
  def_job(module, "pack", "The charts were not packed", "or pack fewer faces at once",
          prepared(pack_like, uv, place_like, read_pack));
}

}  // namespace flipfree::python
