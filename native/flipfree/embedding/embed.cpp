#include "flipfree/embedding/embed.h"

#include <numeric>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/embedding/tutte.h"

namespace flipfree {

Embedding embed_disk_refined(const Triangles& faces, Index vertex_count,
                             const std::vector<VertexId>& loop, const Points2& boundary,
                             const EmbedOptions& options, ExecutionContext& context, Stats& stats) {
  require_convex(boundary, loop);
  context.report("Tutte embedding", 0.0);
  Stopwatch watch;
  Embedding result;
  result.faces = faces;
  result.parent_face.resize(static_cast<std::size_t>(faces.rows()));
  std::iota(result.parent_face.begin(), result.parent_face.end(), 0);
  result.uv = tutte_uniform(faces, vertex_count, loop, boundary, context);
  stats["seconds_tutte"] = watch.seconds();
  std::size_t flips = count_flips(faces, result.uv, context);
  if (options.float32) flips += count_flips(faces, round_to_float(result.uv), context);
  stats["tutte_flips"] = static_cast<std::int64_t>(flips);
  stats["rung"] = std::string("tutte");
  if (flips > 0 && options.method != EmbedMethod::kTutte) {
    throw_not_converged(ErrorCode::kCertificateFailed,
                        "Tutte's map has " + std::to_string(flips) + " flips.");
  }
  context.report("Tutte embedding", 1.0);
  return result;
}

Points2 embed_disk(const Triangles& faces, Index vertex_count, const std::vector<VertexId>& loop,
                   const Points2& boundary, const EmbedOptions& options, ExecutionContext& context,
                   Stats& stats) {
  Embedding result =
      embed_disk_refined(faces, vertex_count, loop, boundary, options, context, stats);
  if (!result.added.empty()) {
    const AddedVertex& first = result.added.front();
    throw_infeasible(
        ErrorCode::kNoRoomInPolygon,
        "The edge between vertices " + std::to_string(first.a) + " and " + std::to_string(first.b) +
            " joins two points of one straight side. Allow refinement, or bend the side.",
        ElementKind::kEdge, {first.a, first.b});
  }
  return result.uv;
}

}  // namespace flipfree
