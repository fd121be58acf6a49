#include "flipfree/matchmaker/untangle_removal.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "flipfree/matchmaker/remove_vertex.h"
#include "flipfree/matchmaker/untangle.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree {
namespace {

using Mesh = EditableTriangulation;

constexpr int kIterations = 40;
constexpr int kPatience = 10;
// Vertices within so many edges of the one that is removed may move.
constexpr int kRings = 2;

class UntanglingRemover {
 public:
  UntanglingRemover(RefinedMap& map, const std::vector<VertexId>& held, ExecutionContext& context)
      : map_(map),
        mesh_(map.surface.mesh),
        remover_(map),
        context_(context),
        held_(map.surface.position.size(), 0),
        local_(map.surface.position.size(), kInvalid) {
    for (const VertexId v : held) held_[static_cast<std::size_t>(v)] = 1;
  }

  bool remove(VertexId v) {
    if (held_[static_cast<std::size_t>(v)] != 0 || mesh_.outgoing(v) == kInvalid) return false;
    if (!remover_.fill(v, filling_)) return false;
    gather(v);
    const bool done = untangle();
    for (const VertexId w : vertices_) local_[static_cast<std::size_t>(w)] = kInvalid;
    if (done) mesh_.replace(filling_.star, filling_.triangles, filling_.parents);
    return done;
  }

 private:
  // The vertices that may move, then those of the rim; the faces that have a vertex that may.
  void gather(VertexId removed) {
    std::vector<VertexId> near = {removed};
    for (int ring = 0; ring < kRings; ++ring) {
      const std::size_t count = near.size();
      for (std::size_t i = 0; i < count; ++i) {
        mesh_.for_each_outgoing(near[i], [&](HalfedgeId h) {
          near.push_back(mesh_.target(h));
          near.push_back(mesh_.apex(h));
        });
      }
      std::sort(near.begin(), near.end());
      near.erase(std::unique(near.begin(), near.end()), near.end());
    }
    faces_.clear();
    for (const VertexId v : near) {
      if (v == removed) continue;
      mesh_.for_each_outgoing(v, [&](HalfedgeId h) { faces_.push_back(h / 3); });
    }
    std::sort(faces_.begin(), faces_.end());
    faces_.erase(std::unique(faces_.begin(), faces_.end()), faces_.end());
    std::sort(filling_.star.begin(), filling_.star.end());
    triangles_ = filling_.triangles;
    for (const FaceId f : faces_) {
      if (!std::binary_search(filling_.star.begin(), filling_.star.end(), f))
        triangles_.push_back(mesh_.corners(f));
    }
    vertices_.clear();
    fixed_.clear();
    for (const Mesh::Triangle& t : triangles_) {
      for (const VertexId v : t) {
        Index& number = local_[static_cast<std::size_t>(v)];
        if (number != kInvalid) continue;
        number = static_cast<Index>(vertices_.size());
        vertices_.push_back(v);
        const bool moves = std::binary_search(near.begin(), near.end(), v) &&
                           held_[static_cast<std::size_t>(v)] == 0 && !mesh_.is_boundary_vertex(v);
        fixed_.push_back(moves ? 0 : 1);
      }
    }
  }

  bool untangle() {
    Surface patch;
    patch.vertices.resize(static_cast<Eigen::Index>(vertices_.size()), 3);
    patch.faces.resize(static_cast<Eigen::Index>(triangles_.size()), 3);
    Points2 start(static_cast<Eigen::Index>(vertices_.size()), 2);
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      const VertexId v = vertices_[i];
      patch.vertices.row(static_cast<Eigen::Index>(i)) =
          map_.surface.position[static_cast<std::size_t>(v)].transpose();
      start.row(static_cast<Eigen::Index>(i)) = map_.uv.row(v);
    }
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        patch.faces(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(k)) =
            local_[static_cast<std::size_t>(triangles_[t][k])];
      }
    }
    UntangleOptions options;
    options.max_iterations = kIterations;
    options.patience = kPatience;
    options.extra_iterations = 1;
    Untangler untangler(patch, fixed_, context_);
    const UntangleResult result = untangler.run(start, options, context_);
    if (result.flips != 0 || !survives(patch.faces, result.uv)) return false;
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      map_.uv.row(vertices_[i]) = result.uv.row(static_cast<Eigen::Index>(i));
    }
    return true;
  }

  // Positive as stored, and no vertex wound once more than before. Positive triangles can wind
  // twice; angles about 2 pi apart are told apart beyond rounding.
  bool survives(const Triangles& faces, const Points2& after) const {
    const Points2f stored = after.cast<float>();
    if (!find_flips(faces, stored.cast<double>(), context_).empty()) return false;
    std::vector<double> gain(vertices_.size(), 0.0);
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        const auto at = [&](Eigen::Index i) -> Vector2 {
          return after.row(faces(f, (k + i) % 3)).transpose();
        };
        gain[static_cast<std::size_t>(faces(f, k))] += angle(at(0), at(1), at(2));
      }
    }
    for (const FaceId f : faces_) {
      const Mesh::Triangle t = mesh_.corners(f);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto at = [&](std::size_t i) -> Vector2 {
          return map_.uv.row(t[(k + i) % 3]).transpose();
        };
        const Index number = local_[static_cast<std::size_t>(t[k])];
        if (number != kInvalid)
          gain[static_cast<std::size_t>(number)] -= angle(at(0), at(1), at(2));
      }
    }
    return std::all_of(gain.begin(), gain.end(), [](double g) { return g < std::numbers::pi; });
  }

  static double angle(const Vector2& apex, const Vector2& right, const Vector2& left) {
    const Vector2 a = right - apex;
    const Vector2 b = left - apex;
    return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }

  RefinedMap& map_;
  Mesh& mesh_;
  VertexRemover remover_;
  ExecutionContext& context_;
  std::vector<char> held_;
  std::vector<Index> local_;  // #V, number within the neighbourhood
  StarFilling filling_;
  std::vector<FaceId> faces_;       // of the neighbourhood as it is
  std::vector<VertexId> vertices_;  // without the one to be removed
  std::vector<char> fixed_;
  std::vector<Mesh::Triangle> triangles_;  // as they would be
};

}  // namespace

Index remove_by_untangling(RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                           ExecutionContext& context) {
  UntanglingRemover remover(map, held, context);
  Index removed = 0;
  for (VertexId v = map.surface.mesh.vertex_count(); v-- > keep;) {
    context.check();
    if (remover.remove(v)) ++removed;
  }
  return removed;
}

}  // namespace flipfree
