#include "flipfree/embedding/progressive/progressive.h"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/embedding/progressive/insert.h"
#include "flipfree/embedding/progressive/simplify.h"
#include "flipfree/embedding/progressive/smoothing.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

constexpr int kMaxRetries = 4;
constexpr Size kNoLimit = std::numeric_limits<Size>::max();
constexpr double kLeastInvalidEnergy = 1e2;

Size share_of_inner(const PlanarMap& map, double share) {
  if (!(share < 1.0)) return kNoLimit;
  return static_cast<Size>(share * static_cast<double>(vertices_left(map, {}).size()));
}

// Inner vertices within `rings` edges of v.
std::vector<VertexId> neighbourhood(const PlanarMap& map, VertexId v, int rings,
                                    std::vector<Index>& mark, Index stamp) {
  std::vector<VertexId> found{v};
  mark[static_cast<Size>(v)] = stamp;
  Size begin = 0;
  for (int ring = 0; ring < rings; ++ring) {
    const Size end = found.size();
    for (; begin < end; ++begin) {
      const HalfedgeId first = map.mesh.outgoing(found[begin]);
      HalfedgeId h = first;
      do {
        const VertexId w = map.mesh.target(h);
        if (!map.mesh.is_boundary(w) && mark[static_cast<Size>(w)] != stamp) {
          mark[static_cast<Size>(w)] = stamp;
          found.push_back(w);
        }
        h = map.mesh.rotate(h);
      } while (h != first);
    }
  }
  return found;
}

}  // namespace

void progressive_embedding(PlanarMap& map, const ProgressiveOptions& options,
                           ExecutionContext& context, Stats& stats) {
  Stopwatch watch;
  CollapseRecord record;
  if (options.start == ProgressiveStart::kNothing) {
    const ProgressRange range(context, 0.0, 0.2);
    collapse_all(map, record, context);
  } else {
    const bool repair = options.start == ProgressiveStart::kRepair;
    collapse_invalid(map, repair, repair ? share_of_inner(map, options.most_repaired) : kNoLimit,
                     record, context);
  }
  stats["collapses"] = static_cast<std::int64_t>(record.size());
  stats["seconds_simplify"] = watch.seconds();
  watch.restart();

  std::vector<VertexId> alive = vertices_left(map, record);
  const Size total = record.size();
  const bool local_only = options.start == ProgressiveStart::kRepair;
  if (!local_only) smooth_sweeps(map, alive, options.final_sweeps, options.settled / 10, context);
  Size next_sweep = static_cast<Size>(static_cast<double>(alive.size()) * options.growth) + 1;

  InsertScratch scratch;
  SmoothingQueue queue(map.mesh.vertex_count());
  std::vector<Index> mark(static_cast<Size>(map.mesh.vertex_count()), kInvalid);
  Index stamp = 0;
  std::int64_t retries = 0;
  std::int64_t recollapses = 0;
  bool from_nothing = options.start == ProgressiveStart::kNothing;
  while (!record.empty()) {
    const HalfedgeId h = record.back();
    const VertexId v0 = map.mesh.target(h);
    if (record.size() % 64 == 0) {
      context.report("progressive embedding",
                     0.2 + 0.7 * std::max(0.0, 1.0 - static_cast<double>(record.size()) /
                                                         static_cast<double>(total)));
    }
    bool inserted = insert_vertex(map, h, scratch);
    for (int attempt = 0; !inserted && attempt < kMaxRetries; ++attempt) {
      // Algorithm 2, line 11: improve the quality and try again, over ever more rings.
      ++retries;
      const std::vector<VertexId> around = neighbourhood(map, v0, 2 + 2 * attempt, mark, stamp++);
      smooth_sweeps(map, around, 50, 1e-3, context);
      inserted = insert_vertex(map, h, scratch);
    }
    if (!inserted) {
      // The surroundings are too small for the grid, and smoothing opens them too slowly. Collapse
      // what is small, smooth the coarser map, where that is cheap, and come back to this insertion
      // later: the record is a stack.
      if (from_nothing) {
        throw_not_converged(ErrorCode::kIterationLimit,
                            "Vertex " + vertex_id(map.mesh.source(h)) +
                                " found no valid position beside vertex " + vertex_id(v0) + ".",
                            ElementKind::kVertex, {map.mesh.source(h), v0});
      }
      const Size before = record.size();
      if (map.invalid_energy > kLeastInvalidEnergy) {
        map.invalid_energy =
            std::max(kLeastInvalidEnergy, std::min(map.invalid_energy, kInvalidEnergyDouble) / 1e4);
        collapse_invalid(map, false, kNoLimit, record, context);
      } else {
        collapse_all(map, record, context);
        from_nothing = true;
      }
      recollapses += static_cast<std::int64_t>(record.size() - before);
      alive = vertices_left(map, record);
      smooth_sweeps(map, alive, options.final_sweeps, 1e-3, context);
      next_sweep = static_cast<Size>(static_cast<double>(alive.size()) * options.growth) + 1;
      continue;
    }
    record.pop_back();
    const VertexId m = map.mesh.source(h);
    alive.push_back(m);
    queue.push_star(map, m);
    queue.push_star(map, v0);
    queue.run(map,
              static_cast<Size>(options.local_steps) *
                  static_cast<Size>(std::min<Index>(16, map.mesh.degree(m))),
              options.settled);
    if (!local_only && alive.size() >= next_sweep) {
      smooth_sweeps(map, alive, options.sweeps, options.settled / 10, context);
      next_sweep = static_cast<Size>(static_cast<double>(alive.size()) * options.growth) + 1;
    }
  }
  if (!local_only) smooth_sweeps(map, alive, options.final_sweeps, options.settled / 10, context);
  stats["insertion_retries"] = retries;
  stats["recollapses"] = recollapses;
  stats["seconds_insert"] = watch.seconds();
}

}  // namespace flipfree::embedding
