#include "finding.h"

#include <set>

namespace flipfree::fuzz {

void check_error(const Exception& e, const mesh::Surface* surface) {
  const Error& error = e.error();
  if (error.code == ErrorCode::kInternal) throw Finding{"internal error: " + error.message};
  if (error.message.empty()) throw Finding{"an error without a message"};
  if (surface == nullptr) return;
  const Triangles& faces = surface->faces;
  const auto names = [&](Index count) {
    for (const Index id : error.elements) {
      if (id < 0 || id >= count) throw Finding{"it names what does not exist: " + error.message};
    }
  };
  if (error.code == ErrorCode::kIndexOutOfRange || error.code == ErrorCode::kNotAnEdge ||
      error.code == ErrorCode::kBadPins)
    return;
  switch (error.kind) {
    case ElementKind::kNone:
      return;
    case ElementKind::kVertex:
      return names(static_cast<Index>(surface->vertices.rows()));
    case ElementKind::kFace:
      return names(static_cast<Index>(faces.rows()));
    case ElementKind::kCorner:
      return names(static_cast<Index>(3 * faces.rows()));
    case ElementKind::kEdge:
      break;
  }
  std::set<std::pair<VertexId, VertexId>> edges;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) edges.insert(std::minmax(faces(f, k), faces(f, (k + 1) % 3)));
  }
  for (std::size_t i = 0; i + 1 < error.elements.size(); i += 2) {
    if (!edges.contains(std::minmax(error.elements[i], error.elements[i + 1])))
      throw Finding{"it names an edge that is none: " + error.message};
  }
}

}  // namespace flipfree::fuzz
