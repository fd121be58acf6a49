// Maps as the certificate takes them, one row per corner, and their certificates.
#pragma once

#include "flipfree/certify/certify.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::test {

inline mesh::Adjacency adjacency_of(const mesh::Surface& surface) { return surface.adjacency(); }

// The UVs of vertices (#V x 2), corner by corner (3 #F x 2).
inline Points2 corners(const mesh::Surface& surface, const Points2& vertex_uv) {
  Points2 uv(3 * surface.faces.rows(), 2);
  for (CornerId c = 0; c < uv.rows(); ++c) uv.row(c) = vertex_uv.row(surface.faces(c / 3, c % 3));
  return uv;
}

// The map that drops z.
inline Points2 flat(const mesh::Surface& surface) {
  return corners(surface, surface.vertices.leftCols<2>());
}

// The certificate of what `request` asks, of this surface and map.
inline certify::Certificate measure(const mesh::Surface& surface, const Points2& uv,
                                    certify::CertifyRequest request = {}) {
  request.surface = &surface;
  request.uv = &uv;
  return certify::certify(request, ExecutionContext());
}

}  // namespace flipfree::test
