#include "flipfree/mesh/validate.h"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/islands.h"

namespace flipfree::mesh {
namespace {

// Collects the elements of one kind of defect and words them.
struct Finding {
  ErrorCode code;
  ElementKind kind;
  std::vector<Index> elements;
  std::size_t count = 0;

  void add(std::initializer_list<Index> ids) {
    ++count;
    if (elements.size() + ids.size() <= kMostElements) elements.insert(elements.end(), ids);
  }
};

std::string place(const Finding& finding) {
  const std::vector<Index>& ids = finding.elements;
  if (finding.kind == ElementKind::kFace) return "Face " + face_id(ids[0]);
  if (finding.kind == ElementKind::kVertex) return "Vertex " + vertex_id(ids[0]);
  return "Edge " + vertex_id(ids[0]) + "-" + vertex_id(ids[1]);
}

std::string others(const Finding& finding) {
  if (finding.count <= 1) return "";
  return " (and " + std::to_string(finding.count - 1) + " more)";
}

void report(std::vector<Error>& defects, const Finding& finding, const std::string& what,
            const std::string& cure) {
  if (finding.count == 0) return;
  defects.push_back({finding.code, place(finding) + others(finding) + " " + what + ". " + cure,
                     finding.kind, finding.elements});
}

constexpr Index kCheckEvery = 1 << 14;  // faces, between looks at a cancel

void check_edges(const Surface& surface, const ExecutionContext& context,
                 std::vector<Error>& defects) {
  const Triangles& faces = surface.faces;
  Finding duplicate{ErrorCode::kDuplicateFace, ElementKind::kFace, {}};
  Finding crowded{ErrorCode::kNonManifoldEdge, ElementKind::kEdge, {}};
  Finding twisted{ErrorCode::kInconsistentOrientation, ElementKind::kEdge, {}};
  std::vector<FaceId> found;
  for_each_edge(static_cast<Index>(surface.vertices.rows()), faces, context,
                [&](std::span<const HalfedgeId> edge) {
                  const auto [low, high] = ends(faces, edge[0]);
                  if (edge.size() > 2) {
                    crowded.add({low, high});
                  } else if (edge.size() == 2 && source(faces, edge[0]) == source(faces, edge[1])) {
                    twisted.add({low, high});
                  }
                  append_duplicates(faces, edge, found);
                });
  sort_unique(found);
  for (const FaceId f : found) duplicate.add({f});
  report(defects, duplicate, "has the same three vertices as another face",
         "Delete one of the two.");
  report(defects, crowded, "belongs to more than two faces",
         "Split the surface there or delete the extra faces (Select Non Manifold shows them).");
  report(defects, twisted, "is used by both its faces in the same direction",
         "Recalculate the normals.");
}

void check_vertices(const Surface& surface, const ValidateOptions& options,
                    std::vector<Error>& defects) {
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const Adjacency& adjacency = surface.adjacency();
  std::vector<Index> degree(at(vertex_count), 0);
  for (const VertexId v : surface.faces.triangles().reshaped()) ++degree[at(v)];
  Finding pinched{ErrorCode::kNonManifoldVertex, ElementKind::kVertex, {}};
  Finding isolated{ErrorCode::kIsolatedVertex, ElementKind::kVertex, {}};
  for (VertexId v = 0; v < vertex_count; ++v) {
    if (adjacency.vertex_halfedge[at(v)] == kInvalid) {
      isolated.add({v});
      continue;
    }
    Index fan = 0;
    for_each_outgoing(adjacency, v, [&](HalfedgeId) { ++fan; });
    if (fan != degree[at(v)]) pinched.add({v});
  }
  report(defects, pinched, "joins parts of the surface that share no edge",
         "Split the vertex (Rip, or Split by Edges).");
  if (!options.allow_isolated_vertices) {
    report(defects, isolated, "belongs to no face", "Delete loose vertices.");
  }
  if (!defects.empty()) return;
  const Topology t = topology(surface.faces, adjacency);
  if ((options.require_connected || options.require_disk) && t.components != 1) {
    defects.push_back({ErrorCode::kDisconnected,
                       "The mesh has " + std::to_string(t.components) +
                           " connected parts where one is needed. Separate by Loose Parts and "
                           "treat them one by one."});
  } else if (options.require_disk && !t.is_disk()) {
    defects.push_back({ErrorCode::kNotADisk,
                       "The mesh is not a disk: it has " + std::to_string(t.boundary_loops) +
                           " boundary loops and genus " + std::to_string(t.genus()) +
                           ". Cut it open with seams, or delete faces, until one boundary loop and "
                           "no handle is left."});
  }
}

void check_shape(const Surface& surface, const ValidateOptions& options,
                 const ExecutionContext& context, std::vector<Error>& defects) {
  if (!options.reject_zero_area) return;
  Finding edge{ErrorCode::kZeroLengthEdge, ElementKind::kEdge, {}};
  Finding face{ErrorCode::kZeroAreaFace, ElementKind::kFace, {}};
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    if (f % kCheckEvery == 0) context.check();
    if (has_area(surface.vertices, surface.faces, f)) continue;
    bool zero_edge = false;
    for (Index k = 0; k < 3; ++k) {
      const VertexId p = surface.faces(f, k);
      const VertexId q = surface.faces(f, (k + 1) % 3);
      if (surface.vertices.row(p) == surface.vertices.row(q)) {
        zero_edge = true;
        edge.add({std::min(p, q), std::max(p, q)});
      }
    }
    if (!zero_edge) face.add({f});
  }
  report(defects, edge, "has length zero", "Merge its end points (Merge by Distance).");
  report(defects, face, "has area zero: its three corners lie on one line",
         "Dissolve it (Degenerate Dissolve) or move a corner.");
}

}  // namespace

std::vector<Error> value_defects(const Surface& surface) {
  std::vector<Error> defects;
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const auto face_count = static_cast<Index>(surface.faces.rows());
  if (face_count == 0) {
    return {{ErrorCode::kEmptyMesh, "The mesh has no faces. Add at least one triangle."}};
  }
  Finding range{ErrorCode::kIndexOutOfRange, ElementKind::kFace, {}};
  Finding repeated{ErrorCode::kRepeatedCorner, ElementKind::kFace, {}};
  for (FaceId f = 0; f < face_count; ++f) {
    const auto v = surface.faces.row(f);
    if (v.minCoeff() < 0 || v.maxCoeff() >= vertex_count) {
      range.add({f});
    } else if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
      repeated.add({f});
    }
  }
  report(defects, range,
         "uses a vertex that does not exist (the mesh has " + std::to_string(vertex_count) + ")",
         "Correct its indices.");
  report(defects, repeated, "uses one vertex twice",
         "Delete degenerate faces (Merge by Distance).");
  Finding infinite{ErrorCode::kNotFinite, ElementKind::kVertex, {}};
  for (VertexId v = 0; v < vertex_count; ++v) {
    if (!surface.vertices.row(v).allFinite()) infinite.add({v});
  }
  report(defects, infinite, "has a coordinate that is NaN or infinite", "Delete or move it.");
  return defects;
}

std::vector<Error> find_defects(const Surface& surface, const ValidateOptions& options,
                                const ExecutionContext& context) {
  std::vector<Error> defects = value_defects(surface);
  if (!defects.empty()) return defects;
  check_edges(surface, context, defects);
  context.check();
  if (defects.empty()) check_vertices(surface, options, defects);
  context.check();
  check_shape(surface, options, context, defects);
  return defects;
}

void validate(const Surface& surface, const ValidateOptions& options,
              const ExecutionContext& context) {
  const std::vector<Error> defects = find_defects(surface, options, context);
  if (defects.empty()) return;
  Error first = defects.front();
  for (std::size_t i = 1; i < defects.size(); ++i) {
    first.message += (i == 1 ? " Also: " : ", ") + std::string(describe(defects[i].code));
  }
  if (defects.size() > 1) first.message += ".";
  throw InvalidInput(std::move(first));
}

}  // namespace flipfree::mesh
