#include "flipfree/certify/separated_map.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/certify/measures.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/separated/separated.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::certify {
namespace {

// Per corner of the input, the corner of the separated surface; kInvalid of faces without triangle.
std::vector<CornerId> corners_from_input(const mesh::SeparatedSurface& separated) {
  std::vector<CornerId> result(3 * (separated.face_origin.size() + separated.collapsed.size()),
                               kInvalid);
  for (CornerId c = 0; c < static_cast<CornerId>(separated.surface.faces.size()); ++c)
    result[at(separated.corner_origin(c))] = c;
  return result;
}

template <typename Values>
Values taken_from_input(const mesh::SeparatedSurface& separated, const Values& of_input) {
  Values result(separated.surface.faces.size(), 2);
  for (CornerId c = 0; c < static_cast<CornerId>(result.rows()); ++c)
    result.row(c) = of_input.row(separated.corner_origin(c));
  return result;
}

// The pins of corners of the separated surface; those of faces without a triangle in `left_out`.
std::vector<CornerPin> moved_pins(const std::vector<CornerPin>& of_input,
                                  const std::vector<CornerId>& corner,
                                  std::vector<CornerPin>& left_out) {
  require_corners(of_input, static_cast<Index>(corner.size()));
  std::vector<CornerPin> moved;
  for (const CornerPin& pin : of_input) {
    const CornerId c = corner[at(pin.corner)];
    (c != kInvalid ? moved : left_out).push_back(c != kInvalid ? CornerPin{c, pin.uv} : pin);
  }
  return moved;
}

// A corner of a face without a triangle has no chart to be contradictory in.
void require_one_place(std::vector<CornerPin> pins) {
  require_storable_pins(pins, std::numeric_limits<Index>::max());
  std::stable_sort(pins.begin(), pins.end(),
                   [](const CornerPin& a, const CornerPin& b) { return a.corner < b.corner; });
  for (std::size_t i = 1; i < pins.size(); ++i) {
    if (pins[i].corner != pins[i - 1].corner || pins[i].uv == pins[i - 1].uv) continue;
    throw_invalid(ErrorCode::kBadPins,
                  "Corner " + corner_id(pins[i].corner) +
                      " is pinned to two different places. Unpin it, or give it one.",
                  ElementKind::kCorner, {pins[i].corner});
  }
}

// Every copy of a vertex is to have its angle; vertices of no face with a triangle in `left_out`.
std::vector<std::pair<VertexId, double>> moved_cones(
    const std::vector<std::pair<VertexId, double>>& of_input,
    const mesh::SeparatedSurface& separated, std::vector<VertexId>& left_out) {
  std::vector<std::pair<VertexId, double>> moved;
  const auto& origin = separated.vertex_origin;
  for (const auto& [v, angle] : of_input) {
    const auto copies = std::equal_range(origin.begin(), origin.end(), v);
    if (copies.first == copies.second) left_out.push_back(v);
    for (auto copy = copies.first; copy != copies.second; ++copy)
      moved.emplace_back(static_cast<VertexId>(copy - origin.begin()), angle);
  }
  sort_unique(left_out);
  return moved;
}

// Loops that pass no face without a triangle. What turns to the left on faces that were turned over
// turns to the right on the surface.
std::vector<std::pair<std::vector<HalfedgeId>, Index>> moved_loops(
    const std::vector<std::pair<std::vector<HalfedgeId>, Index>>& of_input,
    const mesh::SeparatedSurface& separated, const std::vector<CornerId>& corner) {
  std::vector<std::pair<std::vector<HalfedgeId>, Index>> result;
  for (const auto& [loop, turns] : of_input) {
    std::vector<HalfedgeId> moved;
    for (const HalfedgeId h : loop) {
      const bool exists = h >= 0 && at(h) < corner.size();
      const CornerId from = exists ? corner[at(h)] : kInvalid;
      if (from == kInvalid) break;
      const CornerId to = corner[at(next_corner(h))];
      moved.push_back(next_corner(from) == to ? from : to);
    }
    if (moved.size() < loop.size() || loop.empty()) continue;
    const bool turned = separated.turned[at(moved.front() / 3)] != 0;
    result.emplace_back(std::move(moved), turned ? -turns : turns);
  }
  return result;
}

bool any_shape(const mesh::Surface& surface) {
  return mesh::shapeless_faces(surface.vertices, surface.faces).size() <
         static_cast<std::size_t>(surface.faces.rows());
}

Renumbering numbers_of_input(const mesh::SeparatedSurface& separated) {
  const auto of = [](const std::vector<Index>& origin) {
    return [&origin](Index i) { return at(i) < origin.size() ? origin[at(i)] : kInvalid; };
  };
  return {of(separated.vertex_origin), of(separated.face_origin), [&separated](Index c) {
            return c < static_cast<Index>(separated.surface.faces.size())
                       ? separated.corner_origin(c)
                       : kInvalid;
          }};
}

Certificate in_input_terms(const mesh::SeparatedSurface& separated, Certificate certificate) {
  for (auto* faces : {&certificate.failed_faces, &certificate.island_overlap_faces,
                      &certificate.mirrored_faces}) {
    for (FaceId& f : *faces) f = separated.face_origin[at(f)];
  }
  for (auto& [v, k] : certificate.quarter_cones) v = separated.vertex_origin[at(v)];
  auto& missed = certificate.features_missed;
  for (auto& [a, b] : missed) {
    const VertexId from = separated.vertex_origin[at(a)], to = separated.vertex_origin[at(b)];
    std::tie(a, b) = std::minmax(from, to);
  }
  sort_unique(missed);
  for (SeamTransition& seam : certificate.seams) {
    seam.from = separated.vertex_origin[at(seam.from)];
    seam.to = separated.vertex_origin[at(seam.to)];
  }
  const Renumbering numbers = numbers_of_input(separated);
  for (std::string& failure : certificate.failures) failure = renumbered(failure, numbers);
  return certificate;
}

// What is missed beside the separated surface: "<figure>: <count> of <what>".
void add_failures(const char* figure, std::size_t count, const std::string& what,
                  std::int64_t& counted, Certificate& certificate) {
  counted = std::max<std::int64_t>(counted, 0) + static_cast<std::int64_t>(count);
  if (count == 0) return;
  certificate.ok = false;
  certificate.failures.push_back(figure + (": " + std::to_string(count)) + " of " + what);
}

// The faces of those pins that the map does not meet.
std::vector<FaceId> missed_by(const CertifyRequest& map, const std::vector<CornerPin>& pins) {
  std::vector<FaceId> missed;
  for (const CornerPin& pin : pins) {
    const bool met =
        map.uv->row(pin.corner).transpose() == pin.uv &&
        (map.uv32 == nullptr || map.uv32->row(pin.corner).transpose() == pin.uv.cast<float>());
    if (!met) missed.push_back(pin.corner / 3);
  }
  return missed;
}

// All edges of the separated surface on the input's.
IndexPairs sorted_features(const mesh::SeparatedSurface& separated, const IndexPairs& features) {
  const std::vector<mesh::VertexPair> wanted = mesh::sorted_pairs(features);
  std::vector<mesh::VertexPair> moved, met;
  const Triangles& faces = separated.surface.faces;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * faces.rows()) && !wanted.empty(); ++h) {
    const auto [a, b] = mesh::ends(faces, h);
    const mesh::VertexPair origin =
        std::minmax({separated.vertex_origin[at(a)], separated.vertex_origin[at(b)]});
    if (!std::binary_search(wanted.begin(), wanted.end(), origin)) continue;
    moved.emplace_back(a, b);
    met.push_back(origin);
  }
  std::sort(met.begin(), met.end());
  VertexId used = 0;
  for (const VertexId v : separated.vertex_origin) used = std::max(used, v + 1);
  for (const auto& [a, b] : wanted) {
    if (!std::binary_search(met.begin(), met.end(), std::pair(a, b))) throw_no_edge(a, b, used);
  }
  sort_unique(moved);
  return mesh::rows_of(moved);
}

// On the user's positions; `request` in terms of the input, uv of its corners.
Certificate judge(const mesh::SeparatedSurface& separated, const CertifyRequest& request,
                  const ExecutionContext& context) {
  const Points2 uv = taken_from_input(separated, *request.uv);
  Points2f uv32;
  if (request.uv32 != nullptr) uv32 = taken_from_input(separated, *request.uv32);
  CertifyRequest own = request;
  own.surface = &separated.surface;
  own.uv = &uv;
  if (request.uv32 != nullptr) own.uv32 = &uv32;
  own.mirrored.clear();
  if (!request.mirrored.empty())
    for (const FaceId f : separated.face_origin) own.mirrored.push_back(request.mirrored.at(at(f)));
  const std::vector<CornerId> corner = corners_from_input(separated);
  std::vector<CornerPin> collapsed;
  own.pins = moved_pins(request.pins, corner, collapsed);
  std::vector<VertexId> unused;
  own.cone_angles = moved_cones(request.cone_angles, separated, unused);
  own.require_distortion = request.require_distortion && any_shape(separated.surface);
  own.loops = moved_loops(request.loops, separated, corner);
  own.features = sorted_features(separated, request.features);
  own.provenance = {};
  Certificate result = in_input_terms(separated, certify(own, context));
  if (result.feature_edges >= 0) result.feature_edges = request.features.rows();
  if (!collapsed.empty()) {
    const std::vector<FaceId> missed = missed_by(request, collapsed);
    add_failures(
        "G3", missed.size(),
        "the pins of faces that use a vertex twice are not met bit for bit, first at face " +
            (missed.empty() ? "" : face_id(missed.front())),
        result.pin_failures, result);
    result.failed_faces.insert(result.failed_faces.end(), missed.begin(), missed.end());
    result.failed_faces = first_elements(result.failed_faces);
  }
  if (!unused.empty())
    add_failures("G5", unused.size(),
                 "the vertices with a prescribed angle are used by no face with a triangle, first "
                 "vertex " +
                     vertex_id(unused.front()),
                 result.cone_failures, result);
  // Loops through such faces are no strips. As others they are judged where G4 holds.
  const std::size_t lost = request.loops.size() - own.loops.size();
  if (lost > 0 && result.seam_failures == 0 && result.flips64 == 0 && result.flips32 == 0)
    add_failures("G6", lost, "the loops pass faces that use a vertex twice",
                 result.holonomy_failures, result);
  result.mends = separated.mends;
  return result;
}

// Faces that use a vertex twice: their pins, else a point of the map at each vertex, of any face
// there.
template <typename Values>
void fill_collapsed(const mesh::Surface& input, const mesh::SeparatedSurface& separated,
                    const std::vector<CornerPin>& pins, Values& uv) {
  if (separated.collapsed.empty()) return;
  std::vector<CornerId> any(at(input.vertices.rows()), kInvalid);
  for (CornerId c = 0; c < static_cast<CornerId>(separated.surface.faces.size()); ++c) {
    const CornerId o = separated.corner_origin(c);
    CornerId& of_vertex = any[at(input.faces(o / 3, o % 3))];
    if (of_vertex == kInvalid) of_vertex = o;
  }
  for (const FaceId f : separated.collapsed) {
    CornerId spare = kInvalid;
    for (Index k = 0; k < 3; ++k) spare = std::max(spare, any[at(input.faces(f, k))]);
    for (Index k = 0; k < 3; ++k) {
      const CornerId own = any[at(input.faces(f, k))];
      const CornerId from = own != kInvalid ? own : spare;
      if (from == kInvalid) {
        uv.row(3 * f + k).setZero();
      } else {
        uv.row(3 * f + k) = uv.row(from);
      }
    }
  }
  for (const CornerPin& pin : pins)
    uv.row(pin.corner) = pin.uv.transpose().cast<typename Values::Scalar>();
}

}  // namespace

bool is_clean(const mesh::Surface& surface, const ExecutionContext& context) {
  return mesh::find_defects(surface, {}, context).empty() &&
         mesh::shapeless_faces(surface.vertices, surface.faces).empty();
}

Certificate certify_any(const CertifyRequest& request, const ExecutionContext& context) {
  if (request.surface == nullptr || request.uv == nullptr ||
      request.uv->rows() != 3 * request.surface->faces.rows() ||
      is_clean(*request.surface, context)) {
    return certify(request, context);
  }
  mesh::SeparateOptions options;
  options.corner_uv = request.uv;
  return judge(mesh::separate(*request.surface, options, context), request, context);
}

SeparatedMap::SeparatedMap(const mesh::Surface& input, const mesh::SeparateOptions& options,
                           const ExecutionContext& context)
    : input_(input), separated_(mesh::separate(input, options, context)) {
  if (separated_.surface.faces.rows() == 0) {
    throw_invalid(ErrorCode::kRepeatedCorner,
                  "Every face uses a vertex twice, so that there is nothing to map. Delete "
                  "degenerate faces (Merge by Distance).",
                  ElementKind::kFace, {separated_.collapsed.front()});
  }
  rest_ = {mesh::rest_positions(separated_.surface), separated_.surface.faces};
}

IndexPairs SeparatedMap::edges(const IndexPairs& of_input) const {
  return mesh::copies_of_edges(input_, separated_, of_input);
}

IndexPairs SeparatedMap::edges_of_input(const IndexPairs& of_surface) const {
  std::vector<mesh::VertexPair> edges = mesh::sorted_pairs(
      of_surface.unaryExpr([&](VertexId v) { return separated_.vertex_origin[at(v)]; }));
  sort_unique(edges);
  return mesh::rows_of(edges);
}

std::vector<CornerPin> SeparatedMap::pins(const std::vector<CornerPin>& of_input) const {
  std::vector<CornerPin> collapsed;
  std::vector<CornerPin> moved = moved_pins(of_input, corners_from_input(separated_), collapsed);
  require_one_place(std::move(collapsed));
  return moved;
}

std::vector<CornerId> SeparatedMap::corners(const std::vector<CornerId>& of_input) const {
  const std::vector<CornerId> corner = corners_from_input(separated_);
  std::vector<CornerId> result;
  for (const CornerId c : of_input) {
    if (corner[at(c)] != kInvalid) result.push_back(corner[at(c)]);
  }
  return result;
}

Points2 SeparatedMap::corners(const Points2& of_input) const {
  return taken_from_input(separated_, of_input);
}

Error SeparatedMap::in_terms_of_input(Error error) const {
  return renumbered(std::move(error), numbers_of_input(separated_));
}

Certificate SeparatedMap::in_terms_of_input(Certificate certificate) const {
  return in_input_terms(separated_, std::move(certificate));
}

Parametrization SeparatedMap::on_input(const Parametrization& solved, const CertifyRequest& request,
                                       const ExecutionContext& context) const {
  Parametrization map;
  map.surface = input_;
  map.stats = solved.stats;
  std::vector<CornerPin> pins;
  moved_pins(request.pins, corners_from_input(separated_), pins);
  const auto bring = [&](const auto& solved_uv, auto& uv) {
    if (solved_uv.rows() == 0) return;
    uv.resize(input_.faces.size(), 2);
    for (CornerId c = 0; c < static_cast<CornerId>(solved_uv.rows()); ++c)
      uv.row(separated_.corner_origin(c)) = solved_uv.row(c);
    fill_collapsed(input_, separated_, pins, uv);
  };
  bring(solved.uv, map.uv);
  bring(solved.uv32, map.uv32);
  bring(solved.agreed, map.agreed);
  map.cut_edges = edges_of_input(solved.cut_edges);
  set_identity_provenance(map);
  CertifyRequest own = request;
  own.uv = &map.uv;
  own.uv32 = &map.uv32;
  map.certificate = judge(separated_, own, context);
  if (map.certificate.ok && !request.pins.empty()) {
    // Who reads the map finds sides joined that pins have put onto each other.
    own.surface = &map.surface;
    Certificate read = certify_any(own, context);
    if (!read.ok) {
      read.failures.emplace_back(
          "(Pins join two islands along an edge, on the same side of it: unpin one of its ends)");
      map.certificate = std::move(read);
    }
  }
  return map;
}

}  // namespace flipfree::certify
