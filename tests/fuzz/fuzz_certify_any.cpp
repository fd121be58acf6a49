#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "finding.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/separated_map.h"
#include "planar_maps.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

using Loop = std::pair<std::vector<HalfedgeId>, Index>;

// Strips around a vertex, and half-edges at random that seldom are a strip.
Loop read_loop(Bytes& bytes, const mesh::Surface& surface, const mesh::Adjacency& adjacency) {
  const auto count = static_cast<Index>(surface.faces.size());
  std::vector<HalfedgeId> strip;
  const HalfedgeId first = bytes.below(count);
  if (bytes.flag()) {
    for (Index n = bytes.below(4); n >= 0; --n) strip.push_back(bytes.below(count));
  } else {
    HalfedgeId h = first;
    do {
      strip.push_back(h);
      h = adjacency.opposite[at(h)];
      if (h != kInvalid) h = next_corner(h);
    } while (h != kInvalid && h != first);
  }
  return {std::move(strip), bytes.flag() ? 4 : bytes.between(-4, 4)};
}

// A map and the same with what certify_any() has to see through.
struct Disguised {
  mesh::Surface surface;
  Points2 uv;
  std::vector<FaceId> face;      // per face of the map
  std::vector<VertexId> vertex;  // per vertex of it
  FaceId turned = kInvalid;      // of the map

  // Corners of a face that is turned run 0, 2, 1, its edges 2, 1, 0.
  CornerId corner(CornerId c) const {
    const Index k = c / 3 == turned ? (3 - c % 3) % 3 : c % 3;
    return 3 * face[at(c / 3)] + k;
  }
  HalfedgeId halfedge(HalfedgeId h) const {
    return 3 * face[at(h / 3)] + (h / 3 == turned ? 2 - h % 3 : h % 3);
  }
};

Disguised disguise(Bytes& bytes, const mesh::Surface& surface, const Points2& uv, FaceId turned) {
  Disguised out;
  out.turned = turned;
  const auto face_count = static_cast<Index>(surface.faces.rows());
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const Index unused = bytes.below(3);
  out.surface.vertices.resize(unused + vertex_count, 3);
  for (Index i = 0; i < unused; ++i)
    out.surface.vertices.row(i) << bytes.number(), bytes.number(), bytes.number();
  out.surface.vertices.bottomRows(vertex_count) = surface.vertices;
  out.vertex.resize(at(vertex_count));
  std::iota(out.vertex.begin(), out.vertex.end(), unused);
  std::vector<FaceId> before;  // of the map, in front of which a face that uses a vertex twice is
  for (Index n = bytes.below(4); n > 0; --n) before.push_back(bytes.below(face_count + 1));
  std::sort(before.begin(), before.end());
  const Index all = face_count + static_cast<Index>(before.size());
  Triangles faces(all, 3);
  out.uv.resize(3 * all, 2);
  Index next = 0;
  const auto collapsed = [&] {
    const VertexId a = bytes.below(unused + vertex_count);
    const VertexId b = bytes.below(unused + vertex_count);
    faces.row(next) << a, b, bytes.flag() ? a : b;
    for (Index k = 0; k < 3; ++k) out.uv.row(3 * next + k) << bytes.eighth(), bytes.eighth();
    ++next;
  };
  auto waiting = before.begin();
  for (FaceId f = 0; f < face_count; ++f) {
    for (; waiting != before.end() && *waiting == f; ++waiting) collapsed();
    out.face.push_back(next++);
    for (CornerId c = 3 * f; c < 3 * f + 3; ++c) {
      const CornerId own = out.corner(c);
      faces(own / 3, own % 3) = out.vertex[at(surface.faces(f, c % 3))];
      out.uv.row(own) = uv.row(c);
    }
  }
  for (; waiting != before.end(); ++waiting) collapsed();
  out.surface.faces = std::move(faces);
  return out;
}

// A face of a map that is left as it is: joined to another one that tells which way it was.
FaceId read_turned(Bytes& bytes, const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                   const mesh::EdgeFlags& cuts) {
  const FaceId f = bytes.below(static_cast<Index>(surface.faces.rows()));
  for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
    if (adjacency.opposite[at(h)] != kInvalid && cuts[at(h)] == 0) return f;
  }
  return kInvalid;
}

std::vector<FaceId> sorted(std::vector<FaceId> faces) {
  std::sort(faces.begin(), faces.end());
  return faces;
}

}  // namespace

void fuzz_certify_any(Bytes bytes) {
  const int wishes = bytes.byte();
  const PlanarMap map = read_planar_map(bytes, (wishes & 8) != 0);
  const Points2 uv = map.corner_uv();
  const mesh::Surface& surface = map.surface;
  const ExecutionContext context;
  if (!uv.allFinite() || !(uv.cwiseAbs().maxCoeff() < 1e30)) return;
  if (!certify::is_clean(surface, context)) return;
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const mesh::Adjacency& adjacency = surface.adjacency();

  certify::CertifyRequest request;
  request.surface = &surface;
  request.uv = &uv;
  request.require_bijective = (wishes & 1) != 0;
  request.require_disjoint = (wishes & 2) != 0;
  request.require_seamless = (wishes & 4) != 0;
  for (Index n = bytes.below(3); n > 0; --n) {
    certify::CornerPin pin{bytes.below(static_cast<Index>(uv.rows())), Vector2::Zero()};
    pin.uv = uv.row(pin.corner).transpose();
    if (bytes.flag()) pin.uv.x() = std::nextafter(pin.uv.x(), HUGE_VAL);
    request.pins.push_back(pin);
  }
  for (Index n = bytes.below(3); n > 0; --n) {
    const VertexId v = bytes.below(vertex_count);
    request.cone_angles.emplace_back(v, bytes.between(1, 6) * 0.5 * std::numbers::pi);
  }
  for (Index n = bytes.below(3); n > 0; --n)
    request.loops.push_back(read_loop(bytes, surface, adjacency));
  const certify::Certificate plain = certify::certify(request, context);

  FaceId turned = kInvalid;
  if (plain.flips64 == 0 && plain.flips32 == 0 && bytes.flag())
    turned = read_turned(bytes, surface, adjacency, mesh::uv_cuts(adjacency, uv));
  const Disguised other = disguise(bytes, surface, uv, turned);
  certify::CertifyRequest asked = request;
  asked.surface = &other.surface;
  asked.uv = &other.uv;
  for (certify::CornerPin& pin : asked.pins) pin.corner = other.corner(pin.corner);
  for (auto& [v, angle] : asked.cone_angles) v = other.vertex[at(v)];
  for (auto& [loop, turns] : asked.loops) {
    // Left is left of the first face as it is given.
    if (loop.front() / 3 == turned) turns = -turns;
    for (HalfedgeId& h : loop) h = other.halfedge(h);
  }
  const certify::Certificate found = certify::certify_any(asked, context);

  const auto counts = [](const certify::Certificate& c) {
    return std::vector<std::int64_t>{
        c.ok ? 1 : 0,    c.triangles,        c.flips64,
        c.flips32,       c.winding_failures, c.pin_failures,
        c.seam_failures, c.seam_edges,       c.seams_exact64,
        c.seams_exact32, c.cone_failures,    c.holonomy_failures,
        c.overlaps,      c.island_overlaps,  static_cast<std::int64_t>(c.quarter_cones.size())};
  };
  require(counts(plain) == counts(found), "certify_any says something else than certify");
  for (std::size_t i = 0; i < plain.quarter_cones.size(); ++i) {
    const auto [v, k] = plain.quarter_cones[i];
    require(found.quarter_cones[i] == std::pair(other.vertex[at(v)], k), "other cones");
  }
  for (const FaceId f : found.failed_faces)
    require(f >= 0 && f < other.surface.faces.rows(), "a face that does not exist has failed");
  // Of the vertices whose angles are wrong the first names a face, if it has one.
  if (turned != kInvalid || plain.cone_failures > 0) return;
  std::vector<FaceId> failed = plain.failed_faces;
  for (FaceId& f : failed) f = other.face[at(f)];
  require(sorted(failed) == sorted(found.failed_faces), "other faces have failed");
}

}  // namespace flipfree::fuzz
