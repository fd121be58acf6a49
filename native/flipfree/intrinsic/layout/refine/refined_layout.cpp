#include "flipfree/intrinsic/layout/refine/refined_layout.h"

#include "flipfree/mesh/refined/invariants.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::intrinsic {
namespace {

// A vertex in the plane of two weights of a face, whichever face its record names.
Vector2 place_in(const mesh::Surface& input, FaceId parent, const mesh::SurfacePoint& point) {
  Vector2 place = Vector2::Zero();
  for (int k = 0; k < 3; ++k) {
    for (int own = 1; own < 3; ++own) {
      if (input.faces(point.face, k) == input.faces(parent, own)) place[own - 1] = point.weight[k];
    }
  }
  return place;
}

}  // namespace

std::string find_broken_invariant(const mesh::Surface& input, const RefinedLayout& layout) {
  const Triangles& faces = layout.surface.faces;
  if (layout.uv.rows() != 3 * faces.rows()) return "not one place per corner";
  if (layout.provenance.vertex.size() != static_cast<std::size_t>(layout.surface.vertices.rows()))
    return "not one provenance per vertex";
  if (std::string broken = mesh::find_broken_provenance(input, faces, layout.provenance);
      !broken.empty())
    return broken;
  if (!layout.invalid.empty()) return {};
  for (Index f = 0; f < static_cast<Index>(faces.rows()); ++f) {
    const auto place = [&](int k) {
      return place_in(input, layout.provenance.face[static_cast<std::size_t>(f)],
                      layout.provenance.vertex[static_cast<std::size_t>(faces(f, k))]);
    };
    if (numeric::orientation(place(0), place(1), place(2)) <= 0)
      return "face " + std::to_string(f) + " does not turn as its parent does";
    const auto uv = [&](int k) { return Vector2(layout.uv.row(3 * f + k)); };
    if (numeric::orientation(uv(0), uv(1), uv(2)) <= 0)
      return "face " + std::to_string(f) + " is not positive";
  }
  return {};
}

}  // namespace flipfree::intrinsic
