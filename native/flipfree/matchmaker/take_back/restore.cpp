#include "flipfree/matchmaker/take_back/restore.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/smooth/neighbourhood.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

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
  Restorer(mesh::RefinedMap& map, const std::vector<char>& held, Index keep,
           ExecutionContext& context)
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
    std::vector<VertexId> near;
    for (const FaceId f : piece.faces) {
      const Mesh::Triangle t = mesh_.corners(f);
      near.insert(near.end(), t.begin(), t.end());
    }
    near = vertices_near(mesh_, std::move(near), rings - 1);
    const std::vector<FaceId> faces = faces_at(mesh_, near);
    std::vector<Mesh::Triangle> triangles;
    const Triangles& input = map_.surface.input->faces;
    for (const FaceId f : piece.inputs)
      triangles.push_back({input(f, 0), input(f, 1), input(f, 2)});
    for (const FaceId f : faces) {
      if (!std::binary_search(piece.faces.begin(), piece.faces.end(), f))
        triangles.push_back(mesh_.corners(f));
    }
    const Patch patch = make_patch(map_, triangles);
    std::vector<char> fixed;
    for (const VertexId v : patch.vertices) {
      const bool moves = std::binary_search(near.begin(), near.end(), v) &&
                         held_[static_cast<std::size_t>(v)] == 0 &&
                         !(hold_boundary && mesh_.is_boundary_vertex(v));
      fixed.push_back(moves ? 0 : 1);
    }
    distortion::UntangleOptions options;
    options.max_iterations = kIterations;
    options.patience = kPatience;
    distortion::Untangler untangler(patch.surface, fixed, context_);
    const distortion::UntangleResult result = untangler.run(patch.uv, options, context_);
    if (result.flips != 0 ||
        winds_more(map_, patch.vertices, patch.surface.faces, result.uv, faces))
      return false;
    for (std::size_t i = 0; i < patch.vertices.size(); ++i)
      map_.uv.row(patch.vertices[i]) = result.uv.row(static_cast<Eigen::Index>(i));
    triangles.resize(piece.inputs.size());
    mesh_.replace(piece.faces, triangles, piece.inputs);
    return true;
  }

 private:
  mesh::RefinedMap& map_;
  Mesh& mesh_;
  const std::vector<char>& held_;
  Index keep_;
  ExecutionContext& context_;
};

}  // namespace

Index restore_pieces(mesh::RefinedMap& map, const std::vector<char>& held, Index keep, int rings,
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

}  // namespace flipfree::matchmaker
