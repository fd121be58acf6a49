// Maps of any triangles: unwrap, improve, repair, pack; of disks with a prescribed boundary, lines
// and pins: embed, match.
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/distortion/improve.h"
#include "flipfree/embedding/embed_surface.h"
#include "flipfree/matchmaker/match.h"
#include "flipfree/unwrap/islands/grids.h"
#include "flipfree/unwrap/packing/pack.h"
#include "flipfree/unwrap/repair/repair.h"
#include "flipfree/unwrap/seams/auto_islands.h"
#include "flipfree/unwrap/unwrap.h"
#include "job.h"

namespace flipfree::python {
namespace {

unwrap::UnwrapOptions read_unwrap(OptionReader& read) {
  unwrap::UnwrapOptions options;
  read("cuts", options.cuts);
  read("uncuttable", options.uncuttable);
  read("pins", options.pins);
  read("materials", options.material);
  read("polygons", options.polygon);
  read("find_seams", options.seams.find);
  read("stretch", options.seams.stretch);
  read("sharp_angle", options.seams.sharp_angle);
  read("weighted", options.seams.weighted);
  read("weights", options.seams.weights);
  read("bijective", options.bijective);
  read("may_add_cuts", options.may_add_cuts);
  read("cut_extremities", options.cut_extremities);
  read("iterations", options.max_iterations);
  read("tolerance", options.tolerance);
  read("margin", options.margin);
  read("effort", options.effort);
  read("max_seconds", options.max_seconds);
  return options;
}

unwrap::RectifyOptions read_rectify(OptionReader& read) {
  unwrap::RectifyOptions options;
  read("uv", options.corner_uv);
  read("polygons", options.polygon);
  read("cuts", options.cuts);
  return options;
}

distortion::ImproveOptions read_improve(OptionReader& read) {
  distortion::ImproveOptions options;
  read("pins", options.pins);
  read("keep_bijective", options.keep_bijective);
  read("iterations", options.max_iterations);
  read("tolerance", options.tolerance);
  read("max_seconds", options.max_seconds);
  read("aspect", options.aspect);
  return options;
}

unwrap::RepairOptions read_repair(OptionReader& read) {
  using unwrap::SelfOverlaps;
  using unwrap::StretchedIslands;
  unwrap::RepairOptions options;
  read("cuts", options.cuts);
  read("uncuttable", options.uncuttable);
  read("pins", options.pins);
  read.choice(
      "overlaps", options.overlaps,
      {{"cut", SelfOverlaps::kCut}, {"open", SelfOverlaps::kOpen}, {"keep", SelfOverlaps::kKeep}});
  read.choice("stretched", options.stretched,
              {{"keep", StretchedIslands::kCount}, {"improve", StretchedIslands::kImprove}});
  read("disjoint", options.disjoint);
  read("margin", options.margin);
  read("iterations", options.max_iterations);
  read("tolerance", options.tolerance);
  read("max_seconds", options.max_seconds);
  read("aspect", options.aspect);
  return options;
}

unwrap::PackOptions read_pack(OptionReader& read) {
  using unwrap::Rotation;
  unwrap::PackOptions options;
  read("margin", options.margin);
  read("together", options.together);
  read("scale_true", options.scale_true);
  read("keep_bijective", options.keep_bijective);
  read("unmoved", options.unmoved);
  read("obstacles", options.obstacles);
  read("groups", options.groups);
  read("layouts", options.layouts);
  read("share_tile", options.share_tile);
  read.choice("rotation", options.rotation,
              {{"none", Rotation::kNone},
               {"quarters", Rotation::kQuarters},
               {"straight", Rotation::kStraight},
               {"free", Rotation::kFree}});
  read("stack_similar", options.stack);
  read("stack_mirrored", options.stack_mirrored);
  read("effort", options.effort);
  read("first_tile", options.first_tile);
  read("tiles", options.tiles);
  read("density", options.density);
  return options;
}

embedding::EmbedSurfaceOptions read_embed(OptionReader& read) {
  using embedding::BoundaryShape;
  using embedding::EmbedMethod;
  embedding::EmbedSurfaceOptions options;
  read.choice("shape", options.shape,
              {{"circle", BoundaryShape::kCircle},
               {"square", BoundaryShape::kSquare},
               {"triangle", BoundaryShape::kTriangle}});
  read("polygon", options.polygon);
  read("loop", options.loop);
  read("initial", options.initial);
  read.choice("method", options.method,
              {{"ladder", EmbedMethod::kLadder},
               {"progressive", EmbedMethod::kProgressive},
               {"tutte", EmbedMethod::kTutte}});
  read("start_from_tutte", options.start_from_tutte);
  read("optimise", options.optimise);
  read("iterations", options.max_iterations);
  read("tolerance", options.tolerance);
  read("max_seconds", options.max_seconds);
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
  read("boundary_loop", request.boundary_loop);
  read("boundary_uv", request.boundary_uv);
  read("paths", request.paths);
  read("movable", request.movable);
  return request;
}

matchmaker::MatchOptions read_match(OptionReader& read) {
  using matchmaker::MatchEngine;
  matchmaker::MatchOptions options;
  read("optimise", options.optimise);
  read("bijective", options.bijective);
  read("iterations", options.max_iterations);
  read("max_seconds", options.max_seconds);
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
  def_call(module, "embed", read_embed, &embedding::embed_surface);
  def_job(module, "match", [](OptionReader& read) {
    return [request = read_request(read), options = read_match(read)](const mesh::Surface& surface,
                                                                      ExecutionContext& context) {
      return matchmaker::match_piece(surface, request, options, context);
    };
  });
  def_job(module, "unwrap", [](OptionReader& read) {
    return [places = read.value<std::optional<Points2>>("place_like"), options = read_unwrap(read)](
               const mesh::Surface& surface, ExecutionContext& context) mutable {
      options.place_like = places ? &*places : nullptr;
      return unwrap::unwrap(surface, options, context);
    };
  });
  def_call(module, "auto_seams", read_unwrap, &unwrap::find_seams);
  def_call(module, "rectify", read_rectify, &unwrap::rectify);
  def_job(module, "improve", [](OptionReader& read) {
    return [uv = read.value<Points2>("uv"), repair = read.value<bool>("repair"),
            options = read_improve(read)](const mesh::Surface& surface, ExecutionContext& context) {
      return repair ? unwrap::improve_any(surface, uv, options, context)
                    : distortion::improve(surface, uv, options, context);
    };
  });
  def_job(module, "repair", [](OptionReader& read) {
    return [uv = read.value<Points2>("uv"), options = read_repair(read)](
               const mesh::Surface& surface, ExecutionContext& context) {
      return unwrap::repair(surface, uv, options, context);
    };
  });
  def_job(module, "pack", [](OptionReader& read) {
    return [uv = read.value<Points2>("uv"), max_seconds = read.value<double>("max_seconds"),
            places = read.value<std::optional<Points2>>("place_like"), options = read_pack(read)](
               const mesh::Surface& surface, ExecutionContext& context) mutable {
      options.place_like = places ? &*places : nullptr;
      return in_time(context, max_seconds, "The charts were not packed",
                     "or pack fewer faces at once",
                     [&] { return unwrap::pack(surface, uv, options, context); });
    };
  });
}

}  // namespace flipfree::python
