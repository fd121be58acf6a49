#include "flipfree/matchmaker/restore.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <utility>

#include "flipfree/matchmaker/untangle.h"

namespace flipfree {
namespace {

using Mesh = EditableTriangulation;

constexpr int kIterations = 60;
constexpr int kPatience = 15;
// Larger pieces do not come apart.
constexpr std::size_t kMostFaces = 200;

// Refined input faces that share added vertices.
struct Piece {
  std::vector<FaceId> inputs;
  std::vector<FaceId> faces;  // their parts
};

class Restorer {
 public:
  Restorer(RefinedMap& map, const std::vector<char>& held, Index keep, ExecutionContext& context)
      : map_(map), mesh_(map.surface.mesh), held_(held), keep_(keep), context_(context) {}

  std::vector<Piece> pieces() const {
    const Index count = mesh_.vertex_count();
    std::vector<Piece> result;
    std::vector<char> done(static_cast<std::size_t>(mesh_.face_slots()), 0);
    for (VertexId v = keep_; v < count; ++v) {
      std::vector<VertexId> open = {v};
      Piece piece;
      bool whole = true;
      while (!open.empty()) {
        const VertexId w = open.back();
        open.pop_back();
        mesh_.for_each_outgoing(w, [&](HalfedgeId h) {
          if (std::exchange(done[static_cast<std::size_t>(h / 3)], char{1}) != 0) return;
          piece.faces.push_back(h / 3);
          piece.inputs.push_back(mesh_.parent(h / 3));
          for (const VertexId c : mesh_.corners(h / 3)) {
            if (c >= keep_) open.push_back(c);
            whole = whole && (c < map_.surface.input_vertices() ||
                              (c >= keep_ && held_[static_cast<std::size_t>(c)] == 0));
          }
        });
      }
      if (piece.faces.empty() || !whole) continue;
      std::sort(piece.inputs.begin(), piece.inputs.end());
      piece.inputs.erase(std::unique(piece.inputs.begin(), piece.inputs.end()), piece.inputs.end());
      // Parts that touch no added vertex are none: every part of a refined face has one.
      std::sort(piece.faces.begin(), piece.faces.end());
      result.push_back(std::move(piece));
    }
    return result;
  }

  bool restore(const Piece& piece, int rings, bool hold_boundary) {
    context_.check();
    // The neighbourhood: the piece's input faces, and rings of faces around them.
    std::vector<FaceId> near = piece.faces;
    std::vector<FaceId> front = near;
    for (int ring = 0; ring < rings; ++ring) {
      std::vector<FaceId> next;
      for (const FaceId f : front) {
        for (const VertexId v : mesh_.corners(f)) {
          mesh_.for_each_outgoing(v, [&](HalfedgeId h) { next.push_back(h / 3); });
        }
      }
      std::sort(next.begin(), next.end());
      next.erase(std::unique(next.begin(), next.end()), next.end());
      std::vector<FaceId> fresh;
      std::set_difference(next.begin(), next.end(), near.begin(), near.end(),
                          std::back_inserter(fresh));
      std::vector<FaceId> all;
      std::set_union(near.begin(), near.end(), fresh.begin(), fresh.end(), std::back_inserter(all));
      near = std::move(all);
      front = std::move(fresh);
    }
    std::vector<FaceId> around;
    std::set_difference(near.begin(), near.end(), piece.faces.begin(), piece.faces.end(),
                        std::back_inserter(around));

    std::vector<VertexId> vertices;
    std::vector<Mesh::Triangle> triangles;
    for (const FaceId f : piece.inputs) {
      const auto& input = map_.surface.input->faces;
      triangles.push_back({input(f, 0), input(f, 1), input(f, 2)});
    }
    for (const FaceId f : around) triangles.push_back(mesh_.corners(f));
    for (const Mesh::Triangle& t : triangles) vertices.insert(vertices.end(), t.begin(), t.end());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    const auto local = [&](VertexId v) {
      return static_cast<Index>(std::lower_bound(vertices.begin(), vertices.end(), v) -
                                vertices.begin());
    };
    Surface patch;
    Points2 start(static_cast<Eigen::Index>(vertices.size()), 2);
    std::vector<char> fixed(vertices.size(), 0);
    patch.vertices.resize(static_cast<Eigen::Index>(vertices.size()), 3);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const VertexId v = vertices[i];
      patch.vertices.row(static_cast<Eigen::Index>(i)) =
          map_.surface.position[static_cast<std::size_t>(v)].transpose();
      start.row(static_cast<Eigen::Index>(i)) = map_.uv.row(v);
      bool inside = held_[static_cast<std::size_t>(v)] == 0 &&
                    !(hold_boundary && mesh_.is_boundary_vertex(v));
      mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
        inside = inside && std::binary_search(near.begin(), near.end(), h / 3);
      });
      fixed[i] = inside ? 0 : 1;
    }
    patch.faces.resize(static_cast<Eigen::Index>(triangles.size()), 3);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        patch.faces(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(k)) =
            local(triangles[t][k]);
      }
    }
    UntangleOptions options;
    options.max_iterations = kIterations;
    options.patience = kPatience;
    Untangler untangler(patch, fixed, context_);
    const UntangleResult result = untangler.run(start, options, context_);
    const bool ok = result.flips == 0 && winds_once(patch.faces, result.uv, vertices, near);
    if (!ok) return false;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      map_.uv.row(vertices[i]) = result.uv.row(static_cast<Eigen::Index>(i));
    }
    triangles.resize(piece.inputs.size());
    mesh_.replace(piece.faces, triangles, piece.inputs);
    return true;
  }

 private:
  // Positive triangles can wind twice around an inner vertex; a bound in the middle of once and
  // twice decides beyond rounding.
  bool winds_once(const Triangles& faces, const Points2& uv, const std::vector<VertexId>& vertices,
                  const std::vector<FaceId>& near) const {
    std::vector<double> angle(vertices.size(), 0.0);
    // Beyond the neighbourhood nothing changes.
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      mesh_.for_each_outgoing(vertices[i], [&](HalfedgeId h) {
        if (std::binary_search(near.begin(), near.end(), h / 3)) return;
        const Vector2 p = map_.uv.row(vertices[i]).transpose();
        const Vector2 a = map_.uv.row(mesh_.target(h)).transpose() - p;
        const Vector2 b = map_.uv.row(mesh_.apex(h)).transpose() - p;
        angle[i] += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
      });
    }
    for (FaceId f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) {
        const VertexId v = faces(f, k);
        const Vector2 a = (uv.row(faces(f, (k + 1) % 3)) - uv.row(v)).transpose();
        const Vector2 b = (uv.row(faces(f, (k + 2) % 3)) - uv.row(v)).transpose();
        angle[static_cast<std::size_t>(v)] += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
      }
    }
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (!mesh_.is_boundary_vertex(vertices[i]) && angle[i] > 3 * std::numbers::pi) return false;
    }
    return true;
  }

  RefinedMap& map_;
  Mesh& mesh_;
  const std::vector<char>& held_;
  Index keep_;
  ExecutionContext& context_;
};

}  // namespace

Index restore_pieces(RefinedMap& map, const std::vector<char>& held, Index keep, int rings,
                     ExecutionContext& context) {
  Restorer restorer(map, held, keep, context);
  for (const Piece& piece : restorer.pieces()) {
    if (piece.faces.size() > kMostFaces) continue;
    if (!restorer.restore(piece, rings, true)) restorer.restore(piece, rings, false);
  }
  Index removed = 0;
  for (VertexId v = keep; v < map.surface.mesh.vertex_count(); ++v) {
    if (map.surface.mesh.outgoing(v) == kInvalid) ++removed;
  }
  return removed;
}

}  // namespace flipfree
