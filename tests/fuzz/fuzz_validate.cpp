#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "finding.h"
#include "flipfree/mesh/validate.h"
#include "meshes.h"
#include "rational.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

// What is wrong with a mesh, from the definitions.
struct MeshJudge {
  std::set<ErrorCode> codes;

  bool values(const mesh::Surface& surface) {
    const auto count = static_cast<Index>(surface.vertices.rows());
    if (surface.faces.rows() == 0) codes.insert(ErrorCode::kEmptyMesh);
    for (FaceId f = 0; f < surface.faces.rows(); ++f) {
      bool inside = true;
      for (const VertexId v : surface.faces.row(f)) inside = inside && v >= 0 && v < count;
      const Index a = surface.faces(f, 0), b = surface.faces(f, 1), c = surface.faces(f, 2);
      if (!inside) {
        codes.insert(ErrorCode::kIndexOutOfRange);
      } else if (a == b || b == c || c == a) {
        codes.insert(ErrorCode::kRepeatedCorner);
      }
    }
    if (surface.faces.rows() > 0 && !surface.vertices.allFinite())
      codes.insert(ErrorCode::kNotFinite);
    return codes.empty();
  }

  void edges(const Triangles& faces) {
    std::map<std::pair<VertexId, VertexId>, int> directed;
    std::map<std::pair<VertexId, VertexId>, int> undirected;
    std::set<std::array<VertexId, 3>> seen;
    for (FaceId f = 0; f < faces.rows(); ++f) {
      std::array<VertexId, 3> corners{faces(f, 0), faces(f, 1), faces(f, 2)};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto edge = std::pair{corners[k], corners[(k + 1) % 3]};
        ++directed[edge];
        ++undirected[std::minmax(edge.first, edge.second)];
      }
      std::sort(corners.begin(), corners.end());
      if (!seen.insert(corners).second) codes.insert(ErrorCode::kDuplicateFace);
    }
    for (const auto& [edge, n] : undirected) {
      if (n > 2) codes.insert(ErrorCode::kNonManifoldEdge);
      if (n == 2 && directed[edge] != 1) codes.insert(ErrorCode::kInconsistentOrientation);
    }
  }

  // Faces around a vertex joined where they share an edge at it: more than one group is a pinch.
  void vertices(const mesh::Surface& surface, bool allow_isolated) {
    for (VertexId v = 0; v < surface.vertices.rows(); ++v) {
      std::vector<std::set<VertexId>> groups;
      for (FaceId f = 0; f < surface.faces.rows(); ++f) {
        std::set<VertexId> others;
        for (const VertexId w : surface.faces.row(f)) others.insert(w);
        if (others.erase(v) == 0) continue;
        for (auto g = groups.begin(); g != groups.end();) {
          const bool shares =
              std::any_of(g->begin(), g->end(), [&](VertexId w) { return others.contains(w); });
          if (!shares) {
            ++g;
            continue;
          }
          others.insert(g->begin(), g->end());
          g = groups.erase(g);
        }
        groups.push_back(std::move(others));
      }
      if (groups.empty() && !allow_isolated) codes.insert(ErrorCode::kIsolatedVertex);
      if (groups.size() > 1) codes.insert(ErrorCode::kNonManifoldVertex);
    }
  }

  void shapes(const mesh::Surface& surface) {
    for (FaceId f = 0; f < surface.faces.rows(); ++f) {
      std::array<std::array<Rational, 3>, 3> p;
      for (Index k = 0; k < 3; ++k) {
        for (Index i = 0; i < 3; ++i)
          p[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)] =
              Rational(surface.vertices(surface.faces(f, k), i));
      }
      if (p[0] == p[1] || p[1] == p[2] || p[2] == p[0]) {
        codes.insert(ErrorCode::kZeroLengthEdge);
        continue;
      }
      bool flat = true;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        flat = flat && (p[1][i] - p[0][i]) * (p[2][j] - p[0][j]) ==
                           (p[1][j] - p[0][j]) * (p[2][i] - p[0][i]);
      }
      if (flat) codes.insert(ErrorCode::kZeroAreaFace);
    }
  }
};

}  // namespace

void fuzz_validate(Bytes bytes) {
  mesh::ValidateOptions options;
  options.allow_isolated_vertices = bytes.flag();
  const mesh::Surface surface = read_rubbish(bytes);
  std::vector<Error> defects;
  require(allowed([&] { defects = mesh::find_defects(surface, options); }),
          "find_defects has thrown");

  MeshJudge judge;
  if (judge.values(surface)) {
    judge.edges(surface.faces);
    if (judge.codes.empty()) judge.vertices(surface, options.allow_isolated_vertices);
    judge.shapes(surface);
  }
  std::set<ErrorCode> codes;
  for (const Error& defect : defects) {
    codes.insert(defect.code);
    require(!defect.message.empty(), "a defect without a message");
    for (const Index id : defect.elements)
      require(defect.kind != ElementKind::kFace || (id >= 0 && id < surface.faces.rows()),
              "a defect names a face that does not exist");
  }
  require(codes == judge.codes, "find_defects differs from the definitions");
  bool refused = false;
  try {
    mesh::validate(surface, options);
  } catch (const InvalidInput&) {
    refused = true;
  }
  require(refused == !defects.empty(), "validate does not do what find_defects says");
}

}  // namespace flipfree::fuzz
