#include "flipfree/distortion/seams/eliminate/arcs.h"

#include <string>

#include "flipfree/base/error.h"

namespace flipfree::distortion {
std::vector<Arc> list_arcs(Index vertex_count, const Triangles& faces,
                           const std::vector<SeamEdge>& seams) {
  std::vector<Arc> arcs;
  arcs.reserve(2 * seams.size());
  const auto corners = static_cast<HalfedgeId>(3 * faces.rows());
  for (std::size_t e = 0; e < seams.size(); ++e) {
    const auto& [h, o, r] = seams[e];
    if (h < 0 || o < 0 || h >= corners || o >= corners || h == o) {
      throw_invalid(ErrorCode::kBadOption,
                    "Seam edge " + std::to_string(e) +
                        " names half-edges that do not exist, or one twice. Name the two sides of "
                        "a cut edge.");
    }
    const auto edge = static_cast<Index>(e);
    arcs.push_back({mesh::source(faces, h), mesh::target(faces, o), r, edge});
    arcs.push_back({mesh::target(faces, h), mesh::source(faces, o), r, edge});
  }
  for (const Arc& a : arcs) {
    if (a.from < 0 || a.to < 0 || a.from >= vertex_count || a.to >= vertex_count) {
      throw_invalid(ErrorCode::kIndexOutOfRange,
                    "A face at a seam edge names a vertex that does not exist. Correct the faces.",
                    ElementKind::kFace, {seams[at(a.edge)].h / 3});
    }
  }
  return arcs;
}

}  // namespace flipfree::distortion
