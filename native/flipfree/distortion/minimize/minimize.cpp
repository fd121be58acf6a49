#include "flipfree/distortion/minimize/minimize.h"

#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/elements.h"
#include "flipfree/distortion/minimize/minimizer.h"

namespace flipfree::distortion {

void check_start(const mesh::Surface& chart, const Points2& uv, const MinimizeOptions& options,
                 const ExecutionContext& context) {
  if (chart.faces.rows() == 0) throw_invalid(ErrorCode::kEmptyMesh, "The chart has no faces.");
  if (uv.rows() != chart.vertices.rows()) {
    throw_invalid(ErrorCode::kBadShape, "The initial map has " + std::to_string(uv.rows()) +
                                            " points for " + std::to_string(chart.vertices.rows()) +
                                            " vertices.");
  }
  for (const VertexId v : options.fixed) {
    if (v < 0 || v >= uv.rows()) {
      throw_invalid(ErrorCode::kBadPins, "Fixed vertex " + std::to_string(v) + " does not exist.",
                    ElementKind::kVertex, {v});
    }
  }
  auto flipped = flipped_faces(chart.faces, uv, context);
  if (!flipped.empty()) {
    const std::string count = std::to_string(flipped.size());
    const std::string first = std::to_string(flipped.front());
    throw_invalid(ErrorCode::kFlippedMap,
                  "The initial map has " + count +
                      " flipped or collapsed triangles, the first is face " + first +
                      ". Unwrap it instead of improving it.",
                  ElementKind::kFace, first_elements(flipped));
  }
  if (options.bijective) {
    const Boundary boundary = find_boundary(static_cast<Index>(uv.rows()), chart.faces);
    const auto pair = BoundaryGrid(boundary, uv).first_conflict(context);
    if (pair[0] != kInvalid) {
      const auto& e = boundary.edges[static_cast<std::size_t>(pair[0])];
      const auto& f = boundary.edges[static_cast<std::size_t>(pair[1])];
      throw_invalid(ErrorCode::kBadOption,
                    "The initial map's boundary meets itself, first at the edges (" +
                        std::to_string(e[0]) + ", " + std::to_string(e[1]) + ") and (" +
                        std::to_string(f[0]) + ", " + std::to_string(f[1]) +
                        "). Unwrap it anew, or allow overlaps.",
                    ElementKind::kEdge, {e[0], e[1], f[0], f[1]});
    }
    const auto turned = turned_loops(boundary, uv);
    if (!turned.empty()) {
      const std::vector<VertexId>& loop = boundary.loops[turned.front()];
      throw_invalid(ErrorCode::kBadOption,
                    "The initial map covers points twice: the hole or slit at vertex " +
                        std::to_string(loop.front()) +
                        " is turned inside out. Unwrap it anew, or allow overlaps.",
                    ElementKind::kVertex, {loop.front()});
    }
  }
}

Points2 minimize_distortion(const mesh::Surface& chart, const Points2& initial_uv,
                            const MinimizeOptions& options, ExecutionContext& context,
                            Stats& stats) {
  check_start(chart, initial_uv, options, context);
  Minimizer minimizer(chart.faces, build_rest_shapes(chart, context), &chart, initial_uv, options,
                      context);
  return minimizer.run(stats);
}

}  // namespace flipfree::distortion
