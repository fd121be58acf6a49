#include "flipfree/base/failure/elements.h"

namespace flipfree {

std::vector<FaceId> faces_at(const Error& error, const Triangles& faces) {
  if (error.kind == ElementKind::kFace) return error.elements;
  std::vector<FaceId> found;
  if (error.kind != ElementKind::kVertex) return found;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    const auto corners = faces.row(f);
    if (std::find_first_of(corners.begin(), corners.end(), error.elements.begin(),
                           error.elements.end()) != corners.end()) {
      found.push_back(f);
    }
  }
  return found;
}

}  // namespace flipfree
