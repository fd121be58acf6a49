// Quads: a surface as a mesh of quads that follow a seamless map, certified.
//
//   divided()          proxy.h             first: no triangles much longer than quads
//   flat_map()         flat_surface.h      the map as integers
//   coarse_surface()   coarse.h            its cones and corners, triangulated
//   choose_integers()  coarse.h            edges in whole quads
//   extract_cells()    cells.h             the quads
//   spots_of()         places.h            where their corners lie
//   integer_map()      transfer.h          the integers as a map
//   relax()            places.h            made more regular
//   bring_back()       proxy.h             from few triangles to many
//   certify_quads()    quad_certificate.h  judged
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/field/compute.h"
#include "flipfree/quads/quad_certificate.h"

namespace flipfree::quads {

struct QuadOptions {
  // How many quads; 0: as many as quads of `edge_length`, a length on the surface, that it takes.
  double target = 0.0;
  double edge_length = 0.0;
  // How dense quads shall be: lengths of the map as AlignedOptions::sizing has them; empty: all
  // alike.
  std::vector<double> sizing;
  double adaptive = 0.0;  // in [0, 1]: besides, by the surface's curvature (field/smoothest.h)
  // Edges that shall be rows of quad edges (holonomy/field_aligned.h); what cannot be is counted in
  // the stats "features_missed" of "features". Of two at less than a tenth of
  // a quad one is let go, and counted in pieces of the map: "features_close".
  IndexPairs features;
  bool with_map = false;  // QuadMesh::map as well
};

struct QuadMesh : QuadArrays {
  // The integer map: quads, before they were relaxed, are its unit cells. Only where it was asked
  // for, and only if 32 bits hold it (transfer.h).
  std::optional<certify::Parametrization> map;
  QuadCertificate certificate;
  Stats stats;  // "target"; "proxy_faces"; "coarse_faces", "kept_vertices" (flat ones that stayed),
                // "count_raised" (1 where whole numbers leave no mesh of so few), and the map's
};

// Quads of a surface that follow a field; none: the smoothest, simplified. Every cone
// is a vertex of as many quads as it has quarter turns, and the number of quads is within 5 % of
// the one wanted where integers allow it: small numbers are sparse. Where so few quads would be no
// mesh (a quad that meets itself, two edges with the same ends), there are more. Of many more
// triangles than they take, unless a field or the map is asked for, they are made on fewer first
// (proxy.h). Throws InvalidInput (also cones of one quarter turn, whose quads meet themselves),
// NotConverged and Cancelled.
QuadMesh quads_of_surface(const mesh::Surface& surface,
                          const std::optional<field::GivenField>& given, const QuadOptions& options,
                          ExecutionContext& context);

// The unit cells of a map whose cones and corners are whole numbers apart. Throws InvalidInput
// where they are not, or the map is not seamless, or its cells are no mesh.
QuadMesh quads_of_map(const certify::Parametrization& map, const mesh::Surface& surface,
                      const QuadOptions& options, ExecutionContext& context);

}  // namespace flipfree::quads
