#include "flipfree/matchmaker/coarsen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "flipfree/matchmaker/first_try.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/remove_vertex.h"
#include "flipfree/matchmaker/restore.h"
#include "flipfree/matchmaker/untangle_removal.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree {
namespace {

using Mesh = EditableTriangulation;

constexpr int kMostPasses = 12;
constexpr int kRelaxIterations = 6;
// A pass that removes a smaller share (in per cent) of what is there is idle.
constexpr Index kWorthwhile = 2;
// Neighbourhoods in which pieces are untangled at the end.
constexpr std::array<int, 2> kRings = {2, 5};
// Passes in which what is left is untangled vertex by vertex: while each frees this share (in per
// cent), and if there is not more left than so many times the vertices to keep.
constexpr int kMostEasings = 4;
constexpr Index kWorthEasing = 10;
constexpr Index kMostEased = 2;
}  // namespace

Index straighten(RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                 ExecutionContext& context) {
  const RefinedSurface& surface = map.surface;
  const Mesh& mesh = surface.mesh;
  const Triangles& input = surface.input->faces;
  const auto uv = [&](VertexId v) -> Vector2 { return map.uv.row(v).transpose(); };
  // Input faces that cannot be whole again.
  std::vector<char> bent(static_cast<std::size_t>(input.rows()), 0);
  for (FaceId f = 0; f < input.rows(); ++f) {
    bent[static_cast<std::size_t>(f)] =
        orientation(uv(input(f, 0)), uv(input(f, 1)), uv(input(f, 2))) <= 0 ? 1 : 0;
  }
  const Index count = mesh.vertex_count();
  std::vector<Vector2> straight(static_cast<std::size_t>(count - keep), Vector2::Zero());
  for (VertexId v = keep; v < count; ++v) {
    const Support& s = surface.support[static_cast<std::size_t>(v)];
    for (std::size_t i = 0; i < 3 && s.vertex[i] != kInvalid; ++i) {
      straight[static_cast<std::size_t>(v - keep)] += s.weight[i] * uv(s.vertex[i]);
    }
  }
  const auto leave = [&](VertexId v) {
    mesh.for_each_outgoing(
        v, [&](HalfedgeId h) { bent[static_cast<std::size_t>(mesh.parent(h / 3))] = 1; });
  };
  for (VertexId v = surface.input_vertices(); v < keep; ++v) leave(v);
  for (const VertexId v : held) {
    if (v >= keep) leave(v);
  }
  const auto stays = [&](VertexId v) {
    bool all = true;
    mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      all = all && bent[static_cast<std::size_t>(mesh.parent(h / 3))] != 0;
    });
    return all;
  };
  const auto place = [&](VertexId v) {
    return v < keep || stays(v) ? uv(v) : straight[static_cast<std::size_t>(v - keep)];
  };
  const auto around = [&](VertexId v, std::vector<FaceId>& faces) {
    mesh.for_each_outgoing(v, [&](HalfedgeId h) { faces.push_back(h / 3); });
  };
  std::vector<FaceId> open;
  for (VertexId v = keep; v < count; ++v) around(v, open);
  std::sort(open.begin(), open.end());
  open.erase(std::unique(open.begin(), open.end()), open.end());
  std::vector<std::pair<FaceId, FaceId>> parts;  // input face, face
  parts.reserve(open.size());
  for (const FaceId f : open) parts.emplace_back(mesh.parent(f), f);
  std::sort(parts.begin(), parts.end());
  const auto bend = [&](FaceId parent) {
    if (std::exchange(bent[static_cast<std::size_t>(parent)], char{1}) != 0) return;
    for (auto part = std::lower_bound(parts.begin(), parts.end(), std::pair(parent, FaceId{0}));
         part != parts.end() && part->first == parent; ++part) {
      for (const VertexId v : mesh.corners(part->second)) {
        if (v >= keep) around(v, open);
      }
    }
  };
  const auto bend_around = [&](VertexId v) {
    std::vector<FaceId> parents;
    mesh.for_each_outgoing(v, [&](HalfedgeId h) { parents.push_back(mesh.parent(h / 3)); });
    for (const FaceId parent : parents) bend(parent);
  };
  // Positive triangles can wind twice around an inner vertex; a bound in the middle of once and
  // twice decides beyond rounding.
  const auto winds_once = [&](VertexId v) {
    double angle = 0;
    const Vector2 p = place(v);
    mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      const Vector2 a = place(mesh.target(h)) - p;
      const Vector2 b = place(mesh.apex(h)) - p;
      angle += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    });
    return mesh.is_boundary_vertex(v) || angle < 3 * std::numbers::pi;
  };
  Index steps = 0;
  while (!open.empty()) {
    while (!open.empty()) {
      if (++steps % 1024 == 0) context.check();
      const FaceId f = open.back();
      open.pop_back();
      const Mesh::Triangle c = mesh.corners(f);
      if (orientation(place(c[0]), place(c[1]), place(c[2])) > 0) continue;
      // Give this face, or, if it is bent already, its neighbours across straight edges their bends
      // back.
      if (bent[static_cast<std::size_t>(mesh.parent(f))] != 0) {
        for (const VertexId v : c) {
          if (v >= keep && !stays(v)) bend_around(v);
        }
      }
      bend(mesh.parent(f));
    }
    for (const auto& part : parts) {
      for (const VertexId v : mesh.corners(part.second)) {
        if (winds_once(v)) continue;
        bend_around(v);
        mesh.for_each_outgoing(v, [&](HalfedgeId h) {
          for (const VertexId w : {mesh.target(h), mesh.apex(h)}) {
            if (w >= keep && !stays(w)) bend_around(w);
          }
        });
      }
    }
  }
  std::vector<std::pair<VertexId, Vector2>> moved;
  for (VertexId v = keep; v < count; ++v) {
    if (mesh.outgoing(v) != kInvalid && !stays(v)) moved.emplace_back(v, place(v));
  }
  for (const auto& [v, p] : moved) map.uv.row(v) = p.transpose();
  return static_cast<Index>(moved.size());
}

RefinedMap compacted_map(const RefinedMap& map) {
  RefinedMap result;
  std::vector<VertexId> old_vertex;
  result.surface = compacted(map.surface, old_vertex);
  result.uv.resize(static_cast<Eigen::Index>(old_vertex.size()), 2);
  for (std::size_t v = 0; v < old_vertex.size(); ++v) {
    result.uv.row(static_cast<Eigen::Index>(v)) = map.uv.row(old_vertex[v]);
  }
  return result;
}

Index remove_vertices(RefinedMap& map, const std::vector<char>& removable,
                      ExecutionContext& context) {
  VertexRemover remover(map);
  Index removed = 0;
  for (VertexId v = map.surface.mesh.vertex_count(); v-- > 0;) {
    if (v % 256 == 0) context.check();
    if (removable[static_cast<std::size_t>(v)] != 0 && remover.remove(v)) ++removed;
  }
  return removed;
}

Index thin_out(RefinedMap& map, const std::vector<VertexId>& held, Index keep,
               ExecutionContext& context) {
  std::vector<char> removable(map.surface.position.size(), 0);
  std::fill(removable.begin() +
                std::min<std::ptrdiff_t>(keep, static_cast<std::ptrdiff_t>(removable.size())),
            removable.end(), char{1});
  for (const VertexId v : held) removable[static_cast<std::size_t>(v)] = 0;
  const Index removed = remove_vertices(map, removable, context);
  if (removed > 0) map = compacted_map(map);
  return removed;
}

Index remove_added(RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                   ExecutionContext& context) {
  straighten(map, held, keep, context);
  return thin_out(map, held, keep, context);
}

RefinedMap coarsen(RefinedMap map, const Constraints& constraints, Index keep,
                   ExecutionContext& context, Stats& stats) {
  const Index before = map.surface.mesh.vertex_count();
  const auto added = [&] { return map.surface.mesh.vertex_count() - keep; };
  EliminationMemory order(keep);
  RelaxOptions relaxing;
  relaxing.steps = kRelaxIterations;
  relaxing.memory = &order;
  // False when the map is too squeezed; what is removed is removed.
  const auto relax_all = [&] {
    return relax(map, held_vertices(map.surface, constraints), relaxing, context);
  };
  std::int64_t passes = 0;
  int idle = 0;
  for (int pass = 0; pass < kMostPasses && idle < 2 && added() > 0; ++pass, ++passes) {
    context.report("taking refinement back", 0.8 * static_cast<double>(pass) / kMostPasses);
    const ProgressRange quiet(context, 0.8 * static_cast<double>(pass) / kMostPasses,
                              0.8 * static_cast<double>(pass + 1) / kMostPasses);
    const Index there = added();
    const Index removed = remove_added(map, held_vertices(map.surface, constraints), keep, context);
    idle = 100 * removed < kWorthwhile * there ? idle + 1 : 0;
    if (added() == 0 || !relax_all()) break;
  }
  const ProgressRange rest(context, 0.8, 1.0);
  for (const int rings : kRings) {
    if (added() == 0 || added() > keep / 2) break;
    std::vector<char> held(map.surface.position.size(), 0);
    for (const VertexId v : held_vertices(map.surface, constraints))
      held[static_cast<std::size_t>(v)] = 1;
    if (restore_pieces(map, held, keep, rings, context) == 0) continue;
    map = compacted_map(map);
    relax_all();
  }
  for (int pass = 0; pass < kMostEasings && added() > 0 && added() <= kMostEased * keep; ++pass) {
    const Index there = added();
    const std::vector<VertexId> held = held_vertices(map.surface, constraints);
    if (remove_by_untangling(map, held, keep, context) == 0) break;
    map = compacted_map(map);
    if (!relax_all()) break;
    remove_added(map, held, keep, context);
    if (100 * (there - added()) < kWorthEasing * there) break;
  }
  stats["coarsen.removed"] = static_cast<std::int64_t>(before - map.surface.mesh.vertex_count());
  stats["coarsen.passes"] = passes;
  return map;
}

RefinedMap coarsen_gently(RefinedMap map, const Constraints& constraints, Index keep,
                          ExecutionContext& context, Stats& stats) {
  const Index before = map.surface.mesh.vertex_count();
  EliminationMemory order(keep);
  RelaxOptions relaxing;
  relaxing.steps = kRelaxIterations;
  relaxing.memory = &order;
  std::int64_t passes = 0;
  for (; passes < kMostPasses && map.surface.mesh.vertex_count() > keep; ++passes) {
    const double share = static_cast<double>(passes) / kMostPasses;
    context.report("taking refinement back", share);
    const ProgressRange quiet(context, share, share);
    const std::vector<VertexId> held = held_vertices(map.surface, constraints);
    if (thin_out(map, held, keep, context) == 0) break;
    // If it is too squeezed to be relaxed, what is removed is removed.
    if (!relax(map, held, relaxing, context)) break;
  }
  stats["coarsen.removed"] = static_cast<std::int64_t>(before - map.surface.mesh.vertex_count());
  stats["coarsen.passes"] = passes;
  return map;
}

}  // namespace flipfree
