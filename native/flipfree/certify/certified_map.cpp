#include "flipfree/certify/certified_map.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace flipfree::certify {

void agree_with_storage(Parametrization& map, const CertifyRequest& request,
                        const ExecutionContext& context) {
  map.agreed.resize(0, 2);
  const Points2f nearest = map.uv.cast<float>();
  if (nearest == map.uv32) return;
  map.agreed = map.uv32.cast<double>();
  if (!request.cone_angles.empty()) return;
  Points2 mixed = map.agreed;
  for (Eigen::Index row = 0; row < mixed.rows(); ++row) {
    if (nearest.row(row) == map.uv32.row(row)) mixed.row(row) = map.uv.row(row);
  }
  CertifyRequest again = request;
  again.uv = &mixed;
  again.provenance = {};  // the same subdivision
  if (certify(again, context).ok) {
    map.agreed = std::move(mixed);
    return;
  }
  again.uv = &map.agreed;
  again.pins.clear();  // met as stored
  Certificate stored = certify(again, context);
  if (!stored.ok) map.certificate = std::move(stored);
}

namespace {

std::string failure_text(const std::string& what, const Certificate& certificate) {
  std::string text = what + " did not pass its certificate, so nothing is returned.";
  for (const std::string& failure : certificate.failures) text += " " + failure + ".";
  return text;
}

}  // namespace

void certify_map(Parametrization& map, const mesh::Surface& input, const CertifyRequest& extra,
                 const ExecutionContext& context) {
  CertifyRequest request = extra;
  request.surface = &map.surface;
  request.uv = &map.uv;
  request.uv32 = &map.uv32;
  request.provenance = {&input, &map.parent_face, &map.vertex_parent, &map.vertex_barycentric};
  map.certificate = certify(request, context);
  if (map.certificate.ok) agree_with_storage(map, request, context);
}

CertificateFailed::CertificateFailed(const std::string& what, Certificate certificate)
    : NotConverged({ErrorCode::kCertificateFailed, failure_text(what, certificate),
                    ElementKind::kFace, certificate.failed_faces}),
      certificate_(std::move(certificate)) {}

Certificate in_input_faces(const Parametrization& map) {
  Certificate certificate = map.certificate;
  bool refined = false;
  for (FaceId& f : certificate.failed_faces) {
    if (at(f) >= map.parent_face.size()) continue;
    refined = refined || map.parent_face[at(f)] != f;
    f = map.parent_face[at(f)];
  }
  sort_unique(certificate.failed_faces);
  if (refined) note_refined_numbers(certificate);
  return certificate;
}

void note_refined_numbers(Certificate& certificate) {
  const std::string note = "(Numbers are those of the refined mesh)";
  std::vector<std::string>& failures = certificate.failures;
  if (failures.empty() || failures.back() != note) failures.push_back(note);
}

void require_certificate(const Parametrization& map, const char* what) {
  if (!map.certificate.ok) throw CertificateFailed(what, in_input_faces(map));
}

void set_refinement(Parametrization& map, const mesh::RefinedSurface& refined) {
  const mesh::Provenance where = mesh::provenance_of(refined);
  map.surface = mesh::to_surface(refined);
  map.parent_face = where.face;
  map.vertex_parent.clear();
  map.vertex_barycentric.resize(map.surface.vertices.rows(), 3);
  for (std::size_t v = 0; v < where.vertex.size(); ++v) {
    map.vertex_parent.push_back(where.vertex[v].face);
    map.vertex_barycentric.row(static_cast<Eigen::Index>(v)) = where.vertex[v].weight;
  }
}

void set_identity_provenance(Parametrization& map) {
  const Eigen::Index face_count = map.surface.faces.rows();
  const Eigen::Index vertex_count = map.surface.vertices.rows();
  map.parent_face.resize(at(face_count));
  map.vertex_parent.assign(at(vertex_count), kInvalid);
  map.vertex_barycentric = Points3::Zero(vertex_count, 3);
  for (FaceId f = 0; f < face_count; ++f) {
    map.parent_face[at(f)] = f;
    for (Index k = 0; k < 3; ++k) {
      const VertexId v = map.surface.faces(f, k);
      if (map.vertex_parent[at(v)] != kInvalid) continue;
      map.vertex_parent[at(v)] = f;
      map.vertex_barycentric(v, k) = 1.0;
    }
  }
}

}  // namespace flipfree::certify
