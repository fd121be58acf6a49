#include "flipfree/matchmaker/untangle_removal.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/matchmaker/neighbourhood.h"
#include "flipfree/matchmaker/remove_vertex.h"
#include "flipfree/matchmaker/untangle.h"

namespace flipfree {
namespace {

using Mesh = EditableTriangulation;

constexpr int kIterations = 40;
constexpr int kPatience = 10;
// Vertices within so many edges of the one that is removed may move.
constexpr int kRings = 2;
// So many neighbourhoods that have no face in common are untangled side by side, of so many
// vertices that are looked at.
constexpr std::size_t kTogether = 12;
constexpr std::size_t kLookedAt = 48;

// The neighbourhood of a vertex without it.
struct Attempt {
  VertexId vertex = kInvalid;
  StarFilling filling;
  std::vector<FaceId> faces;  // of the neighbourhood as it is
  Patch patch;                // as it would be
  std::vector<char> fixed;    // per vertex of the patch
  bool done = false;          // patch.uv is valid
};

class UntanglingRemover {
 public:
  UntanglingRemover(RefinedMap& map, const std::vector<VertexId>& held, ExecutionContext& context)
      : map_(map),
        mesh_(map.surface.mesh),
        remover_(map),
        context_(context),
        held_(map.surface.position.size(), 0) {
    for (const VertexId v : held) held_[static_cast<std::size_t>(v)] = 1;
  }

  // Tries to remove the vertices, in their order as far as their neighbourhoods are apart. Returns
  // how many went. The same for any number of threads.
  Index remove(std::vector<VertexId> vertices) {
    Index removed = 0;
    while (!vertices.empty()) {
      context_.check();
      std::vector<Attempt> batch = next_batch(vertices);
      parallel_for(context_, batch.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
        ExecutionContext own(&context_, 1);
        untangle(batch[i], own);
      });
      for (const Attempt& attempt : batch) {
        if (!attempt.done) continue;
        take(attempt);
        ++removed;
      }
    }
    return removed;
  }

 private:
  // From the front of the list: vertices whose neighbourhoods have no face in common. They, and
  // those that cannot be removed, leave the list.
  std::vector<Attempt> next_batch(std::vector<VertexId>& vertices) {
    std::vector<Attempt> batch;
    std::vector<VertexId> later;
    taken_.resize(static_cast<std::size_t>(mesh_.face_slots()), 0);
    std::size_t at = 0;
    for (; at < vertices.size() && batch.size() < kTogether && at < kLookedAt; ++at) {
      std::optional<Attempt> attempt = prepare(vertices[at]);
      if (!attempt) continue;
      const bool apart = std::none_of(attempt->faces.begin(), attempt->faces.end(), [&](FaceId f) {
        return taken_[static_cast<std::size_t>(f)] != 0;
      });
      if (!apart) {
        later.push_back(vertices[at]);
        continue;
      }
      for (const FaceId f : attempt->faces) taken_[static_cast<std::size_t>(f)] = 1;
      batch.push_back(std::move(*attempt));
    }
    for (const Attempt& attempt : batch) {
      for (const FaceId f : attempt.faces) taken_[static_cast<std::size_t>(f)] = 0;
    }
    // Those that were put off keep their places before the rest.
    std::copy(later.begin(), later.end(),
              vertices.begin() + static_cast<std::ptrdiff_t>(at - later.size()));
    vertices.erase(vertices.begin(),
                   vertices.begin() + static_cast<std::ptrdiff_t>(at - later.size()));
    return batch;
  }

  std::optional<Attempt> prepare(VertexId v) {
    if (held_[static_cast<std::size_t>(v)] != 0 || mesh_.outgoing(v) == kInvalid)
      return std::nullopt;
    Attempt attempt;
    attempt.vertex = v;
    if (!remover_.fill(v, attempt.filling)) return std::nullopt;
    std::vector<VertexId> near = vertices_near(mesh_, {v}, kRings);
    near.erase(std::lower_bound(near.begin(), near.end(), v));
    attempt.faces = faces_at(mesh_, near);
    std::sort(attempt.filling.star.begin(), attempt.filling.star.end());
    std::vector<Mesh::Triangle> triangles = attempt.filling.triangles;
    for (const FaceId f : attempt.faces) {
      if (!std::binary_search(attempt.filling.star.begin(), attempt.filling.star.end(), f))
        triangles.push_back(mesh_.corners(f));
    }
    attempt.patch = make_patch(map_, triangles);
    for (const VertexId w : attempt.patch.vertices) {
      const bool moves = std::binary_search(near.begin(), near.end(), w) &&
                         held_[static_cast<std::size_t>(w)] == 0 && !mesh_.is_boundary_vertex(w);
      attempt.fixed.push_back(moves ? 0 : 1);
    }
    return attempt;
  }

  void untangle(Attempt& attempt, ExecutionContext& context) const {
    UntangleOptions options;
    options.max_iterations = kIterations;
    options.patience = kPatience;
    options.extra_iterations = 1;
    Patch& patch = attempt.patch;
    Untangler untangler(patch.surface, attempt.fixed, context);
    const UntangleResult result = untangler.run(patch.uv, options, context);
    // Positive as stored, too.
    const Points2f stored = result.uv.cast<float>();
    attempt.done = result.flips == 0 &&
                   find_flips(patch.surface.faces, stored.cast<double>(), context).empty() &&
                   !winds_more(map_, patch.vertices, patch.surface.faces, result.uv, attempt.faces);
    if (attempt.done) patch.uv = result.uv;
  }

  void take(const Attempt& attempt) {
    for (std::size_t i = 0; i < attempt.patch.vertices.size(); ++i)
      map_.uv.row(attempt.patch.vertices[i]) = attempt.patch.uv.row(static_cast<Eigen::Index>(i));
    mesh_.replace(attempt.filling.star, attempt.filling.triangles, attempt.filling.parents);
  }

  RefinedMap& map_;
  Mesh& mesh_;
  VertexRemover remover_;
  ExecutionContext& context_;
  std::vector<char> held_;
  std::vector<char> taken_;  // per face slot: in a neighbourhood of the batch
};

}  // namespace

Index remove_by_untangling(RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                           ExecutionContext& context) {
  std::vector<VertexId> vertices;
  for (VertexId v = map.surface.mesh.vertex_count(); v-- > keep;) vertices.push_back(v);
  return UntanglingRemover(map, held, context).remove(std::move(vertices));
}

}  // namespace flipfree
