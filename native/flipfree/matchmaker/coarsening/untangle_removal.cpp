#include "flipfree/matchmaker/coarsening/untangle_removal.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/coarsening/relax.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

constexpr int kRemovalPatience = 10;
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
  std::uint64_t name = 0;     // of the neighbourhood as it would be, for VainRemovals
  bool done = false;          // patch.uv is valid
};

// Tells neighbourhoods apart: where their vertices are on the surface, and how they are joined.
// (After Steele, Lea, Flood 2014, as in plan_motion.cpp.)
std::uint64_t neighbourhood_hash(const mesh::RefinedSurface& surface, const Patch& patch,
                                 int rings) {
  auto name = static_cast<std::uint64_t>(rings);
  const auto mix = [&](std::uint64_t value) {
    name = (name ^ value) * 0x9e3779b97f4a7c15u;
    name ^= name >> 29;
  };
  for (const VertexId v : patch.vertices) {
    const mesh::Support& support = surface.support[at(v)];
    for (std::size_t i = 0; i < 3; ++i) {
      mix(static_cast<std::uint64_t>(support.vertex[i]));
      mix(std::bit_cast<std::uint64_t>(support.weight[i]));
    }
  }
  for (Eigen::Index i = 0; i < patch.surface.faces.size(); ++i)
    mix(static_cast<std::uint64_t>(patch.surface.faces.data()[i]));
  return name;
}

class UntanglingRemover {
 public:
  UntanglingRemover(mesh::RefinedMap& map, const std::vector<VertexId>& held,
                    const UntangleRemovalOptions& options, ExecutionContext& context)
      : options_(options),
        map_(map),
        mesh_(map.surface.mesh),
        remover_(map),
        context_(context),
        held_(map.surface.position.size(), 0) {
    for (const VertexId v : held) held_[at(v)] = 1;
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
        if (attempt.done) {
          take(attempt);
          ++removed;
        } else if (options_.vain != nullptr) {
          options_.vain->insert(attempt.name);
        }
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
      const VertexId v = vertices[at];
      if (held_[static_cast<std::size_t>(v)] != 0 || mesh_.outgoing(v) == kInvalid) continue;
      std::vector<VertexId> near = vertices_near(mesh_, {v}, options_.rings);
      near.erase(std::lower_bound(near.begin(), near.end(), v));
      Attempt attempt;
      attempt.vertex = v;
      attempt.faces = faces_at(mesh_, near);
      const bool apart = std::none_of(attempt.faces.begin(), attempt.faces.end(), [&](FaceId f) {
        return taken_[static_cast<std::size_t>(f)] != 0;
      });
      if (!apart) {
        later.push_back(v);
        continue;
      }
      if (!prepare(attempt, near)) continue;
      for (const FaceId f : attempt.faces) taken_[static_cast<std::size_t>(f)] = 1;
      batch.push_back(std::move(attempt));
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

  // What is to be untangled; false if the vertex cannot be removed. `near`: the vertices that may
  // move.
  bool prepare(Attempt& attempt, const std::vector<VertexId>& near) {
    if (!remover_.fill(attempt.vertex, attempt.filling)) return false;
    std::sort(attempt.filling.star.begin(), attempt.filling.star.end());
    std::vector<Mesh::Triangle> triangles = attempt.filling.triangles;
    for (const FaceId f : attempt.faces) {
      if (!std::binary_search(attempt.filling.star.begin(), attempt.filling.star.end(), f))
        triangles.push_back(mesh_.corners(f));
    }
    attempt.patch = make_patch(map_, triangles);
    if (options_.vain != nullptr) {
      attempt.name = neighbourhood_hash(map_.surface, attempt.patch, options_.rings);
      if (options_.vain->contains(attempt.name)) return false;
    }
    for (const VertexId w : attempt.patch.vertices) {
      const bool moves = std::binary_search(near.begin(), near.end(), w) && held_[at(w)] == 0 &&
                         !mesh_.is_boundary_vertex(w);
      attempt.fixed.push_back(moves ? 0 : 1);
    }
    return true;
  }

  void untangle(Attempt& attempt, ExecutionContext& context) const {
    distortion::UntangleOptions options;
    options.max_iterations = options_.iterations;
    options.patience = kRemovalPatience;
    options.extra_iterations = 1;
    Patch& patch = attempt.patch;
    distortion::Untangler untangler(patch.surface, attempt.fixed, context);
    const distortion::UntangleResult result = untangler.run(patch.uv, options, context);
    // Positive as stored, too.
    const Points2f stored = result.uv.cast<float>();
    attempt.done =
        result.flips == 0 &&
        distortion::find_flips(patch.surface.faces, stored.cast<double>(), context).empty() &&
        !winds_more(map_, patch.vertices, patch.surface.faces, result.uv, attempt.faces);
    if (attempt.done) patch.uv = result.uv;
  }

  void take(const Attempt& attempt) {
    for (std::size_t i = 0; i < attempt.patch.vertices.size(); ++i)
      map_.uv.row(attempt.patch.vertices[i]) = attempt.patch.uv.row(static_cast<Eigen::Index>(i));
    mesh_.replace(attempt.filling.star, attempt.filling.triangles, attempt.filling.parents);
  }

  const UntangleRemovalOptions& options_;
  mesh::RefinedMap& map_;
  Mesh& mesh_;
  VertexRemover remover_;
  ExecutionContext& context_;
  std::vector<char> held_;
  std::vector<char> taken_;  // per face slot: in a neighbourhood of the batch
};

}  // namespace

Index remove_by_untangling(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                           ExecutionContext& context, const UntangleRemovalOptions& options) {
  std::vector<VertexId> vertices;
  for (VertexId v = map.surface.mesh.vertex_count(); v-- > keep;) vertices.push_back(v);
  return UntanglingRemover(map, held, options, context).remove(std::move(vertices));
}

}  // namespace flipfree::matchmaker
