#include "flipfree/seamless/error_places.h"

#include <algorithm>
#include <utility>

#include "flipfree/certify/certified_map.h"

namespace flipfree::seamless {
namespace {

// The numbers of these ids; every one once if asked for.
std::vector<Index> numbered(const std::vector<Index>& ids, const std::vector<Index>& number,
                            bool once) {
  std::vector<Index> found;
  for (const Index i : ids) {
    if (i < 0 || static_cast<std::size_t>(i) >= number.size()) continue;
    const Index n = number[static_cast<std::size_t>(i)];
    if (!once || std::find(found.begin(), found.end(), n) == found.end()) found.push_back(n);
  }
  return found;
}

}  // namespace

Error placed_in(Error error, const std::vector<FaceId>& faces,
                const std::vector<VertexId>& vertices) {
  if (error.kind == ElementKind::kCorner) {
    for (Index& c : error.elements) c /= 3;
    error.kind = ElementKind::kFace;
  }
  if (error.kind == ElementKind::kFace) {
    error.elements = numbered(error.elements, faces, true);
  } else if (error.kind == ElementKind::kVertex) {
    error.elements = numbered(error.elements, vertices, true);
  } else if (error.kind == ElementKind::kEdge) {
    const std::vector<Index> ends = numbered(error.elements, vertices, false);
    error.elements = ends.size() == error.elements.size() ? ends : std::vector<Index>{};
  }
  if (error.elements.empty()) error.kind = ElementKind::kNone;
  return error;
}

void rethrow_placed(const std::vector<FaceId>& faces, const std::vector<VertexId>& vertices) {
  try {
    throw;
  } catch (const certify::CertificateFailed& failed) {
    certify::Certificate certificate = failed.certificate();
    certificate.failed_faces = numbered(certificate.failed_faces, faces, true);
    throw certify::CertificateFailed("The seamless map", std::move(certificate));
  } catch (const NotConverged& failed) {
    throw NotConverged(placed_in(failed.error(), faces, vertices));
  }
}

}  // namespace flipfree::seamless
