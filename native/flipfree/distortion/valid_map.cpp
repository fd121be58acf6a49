#include "flipfree/distortion/valid_map.h"

#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/measures.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::distortion {

void require_corner_uv(const mesh::Surface& surface, const Points2& corner_uv) {
  if (corner_uv.rows() == 3 * surface.faces.rows()) return;
  throw_invalid(ErrorCode::kBadShape, "uv has " + std::to_string(corner_uv.rows()) + " rows for " +
                                          std::to_string(surface.faces.rows()) +
                                          " faces. Give one row per face corner.");
}

void require_valid_map(const mesh::Surface& surface, const Points2& corner_uv,
                       const ExecutionContext& context) {
  mesh::validate(surface, {}, context);
  require_corner_uv(surface, corner_uv);
  const std::vector<FaceId> flipped = certify::flipped_faces(corner_uv);
  if (flipped.empty()) return;
  const std::string what =
      (flipped.size() == 1 ? "1 triangle of the map is"
                           : std::to_string(flipped.size()) + " triangles of the map are") +
      " flipped, collapsed or not finite, the first is face " + face_id(flipped.front()) +
      ". Repair the map, or unwrap the mesh first.";
  throw_invalid(ErrorCode::kFlippedMap, what, ElementKind::kFace, first_elements(flipped));
}

}  // namespace flipfree::distortion
