#include "flipfree/seamless/request.h"

#include <algorithm>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/bordered/corners.h"
#include "flipfree/seamless/near_turns.h"
#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {

namespace {

constexpr std::size_t kMostNamed = 1000;

struct ConnectedPart {
  bool closed = true;
  std::vector<FaceId> faces;
  std::vector<VertexId> vertices;
  std::vector<Index> cones;  // per vertex of it

  Index genus() const {
    const auto f = static_cast<Index>(faces.size());
    return (2 - (static_cast<Index>(vertices.size()) - f / 2)) / 2;
  }
};

// The outgoing half-edge of a boundary vertex is one of the boundary.
bool is_border(const mesh::Adjacency& adjacency, std::size_t v) {
  return adjacency.opposite[at(adjacency.vertex_halfedge[v])] == kInvalid;
}

std::vector<ConnectedPart> parts_of(const std::vector<Index>& cones,
                                    const mesh::Adjacency& adjacency) {
  const mesh::Components components = mesh::face_components(adjacency);
  std::vector<ConnectedPart> parts(at(components.count));
  for (std::size_t f = 0; f < components.of_face.size(); ++f)
    parts[at(components.of_face[f])].faces.push_back(static_cast<FaceId>(f));
  for (std::size_t v = 0; v < cones.size(); ++v) {
    const FaceId f = adjacency.vertex_halfedge[v] / 3;
    ConnectedPart& part = parts[at(components.of_face[at(f)])];
    part.vertices.push_back(static_cast<VertexId>(v));
    part.closed = part.closed && !is_border(adjacency, v);
    part.cones.push_back(cones[v]);
  }
  return parts;
}

// The same error with the place of the part.
[[noreturn]] void throw_of_part(const Error& error, const ConnectedPart& part, bool only_one) {
  std::vector<Index> places;
  for (std::size_t i = 0; i < part.vertices.size() && places.size() < kMostNamed; ++i) {
    if (part.cones[i] != 4) places.push_back(part.vertices[i]);
  }
  ElementKind kind = ElementKind::kVertex;
  if (places.empty()) {
    kind = ElementKind::kFace;
    for (std::size_t i = 0; i < part.faces.size() && i < kMostNamed; ++i)
      places.push_back(part.faces[i]);
  }
  const std::string where = only_one ? ""
                                     : "The part of face " + face_id(part.faces.front()) + " (" +
                                           std::to_string(part.faces.size()) + " faces): ";
  throw_infeasible(error.code, where + error.message, error.witness, kind, std::move(places));
}

}  // namespace

void check_surface(const mesh::Surface& surface, ExecutionContext& context) {
  mesh::ValidateOptions rules;
  rules.allow_isolated_vertices = false;
  mesh::validate(surface, rules, context);
}

void check_request(const mesh::Surface& surface, const std::vector<Index>& cones,
                   ExecutionContext& context) {
  check_surface(surface, context);
  if (cones.size() != static_cast<std::size_t>(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "cones need one number per vertex.");
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] >= kNotGiven) continue;
    throw_invalid(ErrorCode::kBadAngles,
                  "The cone at vertex " + vertex_id(v) + " has " + std::to_string(cones[v]) +
                      " quarter turns. Give every cone at least 1 (4 is flat).",
                  ElementKind::kVertex, {static_cast<Index>(v)});
  }
  const std::vector<ConnectedPart> parts = parts_of(flat_inside(cones, adjacency), adjacency);
  for (const ConnectedPart& part : parts) {
    context.check();
    if (!part.closed) continue;
    try {
      check_cones(part.cones, part.genus());
      // Loops may turn as they need to: only what no loops help is refused here.
      if (part.genus() == 1) near_turns(part.cones, 1, {0.0, 0.0}, Eigen::Matrix2d::Identity(), 1);
    } catch (const Infeasible& refused) {
      throw_of_part(refused.error(), part, parts.size() == 1);
    }
  }
}

namespace {

// The numbers of these ids; every one once if asked for.
std::vector<Index> numbered(const std::vector<Index>& ids, const std::vector<Index>& number,
                            bool once) {
  std::vector<Index> found;
  for (const Index i : ids) {
    if (i < 0 || static_cast<std::size_t>(i) >= number.size()) continue;
    const Index n = number[at(i)];
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
