#include "flipfree/mesh/validate.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"

namespace flipfree {
namespace {

constexpr std::size_t kMostElementsListed = 1000;

// Collects the elements of one kind of defect and words them.
struct Finding {
  ErrorCode code;
  ElementKind kind;
  std::vector<Index> elements;
  std::size_t count = 0;

  void add(std::initializer_list<Index> ids) {
    ++count;
    if (elements.size() + ids.size() <= kMostElementsListed) elements.insert(elements.end(), ids);
  }
};

std::string place(const Finding& finding) {
  switch (finding.kind) {
    case ElementKind::kVertex:
      return "vertex " + std::to_string(finding.elements[0]);
    case ElementKind::kEdge:
      return "edge " + std::to_string(finding.elements[0]) + "-" +
             std::to_string(finding.elements[1]);
    case ElementKind::kFace:
      return "face " + std::to_string(finding.elements[0]);
    case ElementKind::kCorner:
      return "corner " + std::to_string(finding.elements[0]);
    case ElementKind::kNone:
      break;
  }
  return "the mesh";
}

std::string others(const Finding& finding) {
  if (finding.count <= 1) return "";
  return " (and " + std::to_string(finding.count - 1) + " more)";
}

void report(std::vector<Error>& defects, const Finding& finding, const std::string& what,
            const std::string& cure) {
  if (finding.count == 0) return;
  std::string at = place(finding);
  at[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(at[0])));
  defects.push_back({finding.code, at + others(finding) + " " + what + ". " + cure, finding.kind,
                     finding.elements});
}

void check_values(const Surface& surface, std::vector<Error>& defects) {
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const auto face_count = static_cast<Index>(surface.faces.rows());
  if (face_count == 0) {
    defects.push_back({ErrorCode::kEmptyMesh,
                       "The mesh has no faces. Add at least one triangle.",
                       ElementKind::kNone,
                       {}});
    return;
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
}

void check_faces_distinct(const Surface& surface, std::vector<Error>& defects) {
  using Key = std::array<Index, 4>;  // sorted corners, face
  std::vector<Key> keys(static_cast<std::size_t>(surface.faces.rows()));
  for (std::size_t f = 0; f < keys.size(); ++f) {
    const auto row = surface.faces.row(static_cast<Eigen::Index>(f));
    keys[f] = {row[0], row[1], row[2], static_cast<Index>(f)};
    std::sort(keys[f].begin(), keys[f].begin() + 3);
  }
  std::sort(keys.begin(), keys.end());
  Finding duplicate{ErrorCode::kDuplicateFace, ElementKind::kFace, {}};
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (std::equal(keys[i].begin(), keys[i].begin() + 3, keys[i - 1].begin()))
      duplicate.add({keys[i][3]});
  }
  report(defects, duplicate, "has the same three vertices as another face",
         "Delete one of the two.");
}

void check_edges(const Surface& surface, std::vector<Error>& defects) {
  struct Use {
    Index low, high;
    bool forward;
    bool operator<(const Use& o) const { return low != o.low ? low < o.low : high < o.high; }
  };
  std::vector<Use> uses;
  uses.reserve(static_cast<std::size_t>(3 * surface.faces.rows()));
  for (HalfedgeId h = 0; h < 3 * surface.faces.rows(); ++h) {
    const VertexId a = source(surface.faces, h);
    const VertexId b = target(surface.faces, h);
    uses.push_back({std::min(a, b), std::max(a, b), a < b});
  }
  std::sort(uses.begin(), uses.end());
  Finding crowded{ErrorCode::kNonManifoldEdge, ElementKind::kEdge, {}};
  Finding twisted{ErrorCode::kInconsistentOrientation, ElementKind::kEdge, {}};
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t j = i + 1;
    while (j < uses.size() && !(uses[i] < uses[j])) ++j;
    if (j - i > 2) {
      crowded.add({uses[i].low, uses[i].high});
    } else if (j - i == 2 && uses[i].forward == uses[i + 1].forward) {
      twisted.add({uses[i].low, uses[i].high});
    }
    i = j;
  }
  report(defects, crowded, "belongs to more than two faces",
         "Split the surface there or delete the extra faces (Select Non Manifold shows them).");
  report(defects, twisted, "is used by both its faces in the same direction",
         "Recalculate the normals.");
}

void check_vertices(const Surface& surface, const ValidateOptions& options,
                    std::vector<Error>& defects) {
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const Adjacency adjacency = build_adjacency(vertex_count, surface.faces);
  std::vector<Index> degree(static_cast<std::size_t>(vertex_count), 0);
  for (const VertexId v : surface.faces.reshaped()) ++degree[static_cast<std::size_t>(v)];
  Finding pinched{ErrorCode::kNonManifoldVertex, ElementKind::kVertex, {}};
  Finding isolated{ErrorCode::kIsolatedVertex, ElementKind::kVertex, {}};
  for (VertexId v = 0; v < vertex_count; ++v) {
    const HalfedgeId start = adjacency.vertex_halfedge[static_cast<std::size_t>(v)];
    if (start == kInvalid) {
      isolated.add({v});
      continue;
    }
    Index fan = 0;
    HalfedgeId h = start;
    do {
      ++fan;
      h = rotate_ccw(adjacency, h);
    } while (h != kInvalid && h != start);
    if (fan != degree[static_cast<std::size_t>(v)]) pinched.add({v});
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
                           "treat them one by one.",
                       ElementKind::kNone,
                       {}});
  } else if (options.require_disk && !t.is_disk()) {
    defects.push_back({ErrorCode::kNotADisk,
                       "The mesh is not a disk: it has " + std::to_string(t.boundary_loops) +
                           " boundary loops and genus " + std::to_string(t.genus()) +
                           ". Cut it open with seams, or delete faces, until one boundary loop and "
                           "no handle is left.",
                       ElementKind::kNone,
                       {}});
  }
}

void check_shape(const Surface& surface, const ValidateOptions& options,
                 std::vector<Error>& defects) {
  if (!options.reject_zero_area) return;
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const auto point = [&](VertexId v) {
    return Kernel::Point_3(surface.vertices(v, 0), surface.vertices(v, 1), surface.vertices(v, 2));
  };
  Finding edge{ErrorCode::kZeroLengthEdge, ElementKind::kEdge, {}};
  Finding face{ErrorCode::kZeroAreaFace, ElementKind::kFace, {}};
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const Vector3 a = surface.vertices.row(surface.faces(f, 0));
    const Vector3 b = surface.vertices.row(surface.faces(f, 1));
    const Vector3 c = surface.vertices.row(surface.faces(f, 2));
    // The exact predicate only where the cross product could be rounding: 1e-14 is far above its
    // relative error.
    const Vector3 ab = b - a;
    const Vector3 ac = c - a;
    const double scale = ab.cwiseAbs().maxCoeff() * ac.cwiseAbs().maxCoeff();
    if (scale > 1e-250 && scale < 1e250 && ab.cross(ac).cwiseAbs().maxCoeff() > 1e-14 * scale &&
        ab.norm() > 1e-8 * a.norm() && ac.norm() > 1e-8 * a.norm()) {
      continue;
    }
    bool zero_edge = false;
    for (Index k = 0; k < 3; ++k) {
      const VertexId p = surface.faces(f, k);
      const VertexId q = surface.faces(f, (k + 1) % 3);
      if (surface.vertices.row(p) == surface.vertices.row(q)) {
        zero_edge = true;
        edge.add({std::min(p, q), std::max(p, q)});
      }
    }
    if (!zero_edge && CGAL::collinear(point(surface.faces(f, 0)), point(surface.faces(f, 1)),
                                      point(surface.faces(f, 2)))) {
      face.add({f});
    }
  }
  report(defects, edge, "has length zero", "Merge its end points (Merge by Distance).");
  report(defects, face, "has area zero: its three corners lie on one line",
         "Dissolve it (Degenerate Dissolve) or move a corner.");
}

}  // namespace

std::vector<Error> find_defects(const Surface& surface, const ValidateOptions& options) {
  std::vector<Error> defects;
  check_values(surface, defects);
  if (!defects.empty()) return defects;
  check_faces_distinct(surface, defects);
  check_edges(surface, defects);
  if (defects.empty()) check_vertices(surface, options, defects);
  check_shape(surface, options, defects);
  return defects;
}

void validate(const Surface& surface, const ValidateOptions& options) {
  const std::vector<Error> defects = find_defects(surface, options);
  if (defects.empty()) return;
  Error first = defects.front();
  for (std::size_t i = 1; i < defects.size(); ++i) {
    first.message += (i == 1 ? " Also: " : ", ") + std::string(describe(defects[i].code));
  }
  if (defects.size() > 1) first.message += ".";
  throw InvalidInput(std::move(first));
}

}  // namespace flipfree
