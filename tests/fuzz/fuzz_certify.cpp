#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "finding.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/measures.h"
#include "judge.h"
#include "planar_maps.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

// What certify/ says of the map with these values against the judge; positive: no flipped face.
void compare(const mesh::Surface& surface, const mesh::Adjacency& adjacency, const Points2& uv,
             const Judge& judge, bool positive, std::int64_t& places) {
  require(certify::flipped_faces(uv) == judge.flipped(),
          "flipped_faces differs from rational areas");
  const mesh::EdgeFlags cuts = mesh::uv_cuts(adjacency, uv);
  const certify::IslandOverlaps islands =
      certify::island_overlaps(mesh::components_between(adjacency, cuts), uv);
  require(islands.pairs == judge.island_pairs(), "island_overlaps differs from all pairs");
  require((islands.pairs > 0) == !islands.faces.empty(), "island_overlaps names no face");
  require(static_cast<std::int64_t>(certify::seam_failures(adjacency, cuts, uv).size()) ==
              judge.seams(),
          "seam_failures differs from rational differences");
  if (!positive) return;
  const std::vector<VertexId> winding = certify::winding_failures(adjacency, cuts, uv);
  require(std::set<VertexId>(winding.begin(), winding.end()) == judge.winding(),
          "winding_failures differs from counting a direction");
  const certify::Overlaps overlaps = certify::boundary_overlaps(surface.faces, adjacency, cuts, uv);
  std::int64_t contacts = 0;
  bool turned = false;
  for (const FaceId chart : judge.charts()) {
    const std::int64_t own = judge.contacts(chart);
    contacts += own;
    if (own == 0) turned = turned || judge.covers_twice(chart);
  }
  require(overlaps.contacts == contacts, "contacts differ from all pairs of boundary edges");
  require((overlaps.turned_loops > 0) == turned, "turned loops differ from all pairs of triangles");
  require((overlaps.places() > 0) == !overlaps.faces.empty(), "overlaps name no face");
  places = std::max(places, overlaps.places());
}

}  // namespace

void fuzz_certify(Bytes bytes) {
  const int wishes = bytes.byte();
  const PlanarMap map = read_planar_map(bytes, true);
  const Points2 uv = map.corner_uv();
  if (!uv.allFinite() || !(uv.cwiseAbs().maxCoeff() < 1e30)) return;
  const Points2f uv32 = uv.cast<float>();
  const Points2 stored = uv32.cast<double>();
  const mesh::Surface& surface = map.surface;

  certify::CertifyRequest request;
  request.surface = &surface;
  request.uv = &uv;
  request.require_bijective = (wishes & 1) != 0;
  request.require_disjoint = (wishes & 2) != 0;
  request.require_seamless = (wishes & 4) != 0;
  std::int64_t missed = 0;
  for (Index n = wishes >> 6; n > 0; --n) {
    certify::CornerPin pin{bytes.below(static_cast<Index>(uv.rows())), Vector2::Zero()};
    pin.uv = uv.row(pin.corner).transpose();
    if (bytes.flag()) pin.uv.x() = std::nextafter(pin.uv.x(), HUGE_VAL);
    missed += pin.uv != uv.row(pin.corner).transpose();
    request.pins.push_back(pin);
  }
  const ExecutionContext context;
  const certify::Certificate certificate = certify::certify(request, context);

  const mesh::Adjacency& adjacency = surface.adjacency();
  const Judge judge(surface, uv);
  const Judge judge32(surface, stored);
  const bool positive = judge.flipped().empty() && judge32.flipped().empty();
  std::int64_t places = 0;
  compare(surface, adjacency, uv, judge, positive, places);
  compare(surface, adjacency, stored, judge32, positive, places);

  require(certificate.flips64 == static_cast<std::int64_t>(judge.flipped().size()) &&
              certificate.flips32 == static_cast<std::int64_t>(judge32.flipped().size()),
          "the certificate's flips are others");
  require(certificate.pin_failures == missed, "the certificate's pins are others");
  const std::int64_t islands = std::max(judge.island_pairs(), judge32.island_pairs());
  require(certificate.island_overlaps == islands, "the certificate's island overlaps are others");
  bool ok = positive && missed == 0;
  if (request.require_disjoint) ok = ok && islands == 0;
  if (request.require_seamless) ok = ok && judge.seams() == 0 && judge32.seams() == 0;
  if (positive) {
    std::set<VertexId> winding = judge.winding();
    winding.merge(judge32.winding());
    require(certificate.winding_failures == static_cast<std::int64_t>(winding.size()),
            "the certificate's winding failures are others");
    require(certificate.overlaps == places, "the certificate's overlaps are others");
    ok = ok && winding.empty() && !(request.require_bijective && places > 0);
  }
  require(certificate.ok == ok, "ok is not what the judge says");
  require(certificate.ok == certificate.failures.empty(), "ok beside failures");
}

}  // namespace flipfree::fuzz
