#include "flipfree/matchmaker/coarsening/coarsen.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "flipfree/matchmaker/coarsening/coarsening_rounds.h"
#include "flipfree/matchmaker/coarsening/untangle_removal.h"
#include "flipfree/matchmaker/request/time_share.h"
#include "flipfree/matchmaker/smooth/relax.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

constexpr int kRelaxIterations = 6;
// So many idle rounds in a row are the last.
constexpr int kIdle = 2;
// Passes in which what is left is untangled vertex by vertex: while each frees this share (in per
// cent), and if there is not more left than so many times the vertices to keep.
constexpr int kMostEasings = 4;
constexpr Index kWorthEasing = 10;
constexpr Index kMostEased = 2;

// A map whose refinement is being taken back, relaxed on the way.
class Coarsener {
 public:
  Coarsener(mesh::RefinedMap map, const Constraints& constraints, Index keep,
            ExecutionContext& context)
      : map_(std::move(map)),
        constraints_(constraints),
        keep_(keep),
        context_(context),
        order_(keep) {}

  // The map so far, valid at every check of the context.
  mesh::RefinedMap& map() { return map_; }

  void all() {
    {
      const ProgressRange range(context_, 0.0, 0.8);
      run({.idle = kIdle});
    }
    const ProgressRange rest(context_, 0.8, 1.0);
    if (constraints_.use(Device::kUntangle)) untangle_one_by_one();
  }

  void bounded() { run({.worthwhile = 0}); }

  std::int64_t passes() const { return passes_; }

 private:
  Index added() const { return map_.surface.mesh.vertex_count() - keep_; }
  std::vector<VertexId> held() const { return held_vertices(map_.surface, constraints_); }

  // False when the map is too squeezed; what is removed is removed.
  bool relaxed() {
    RelaxOptions options;
    options.steps = kRelaxIterations;
    options.memory = &order_;
    return relax(map_, held(), options, context_);
  }

  void run(const Schedule& schedule) {
    passes_ +=
        coarsen_in_rounds(map_, held(), keep_, schedule, context_, [&] { return relaxed(); });
  }

  void untangle_one_by_one() {
    for (int pass = 0; pass < kMostEasings && added() > 0 && added() <= kMostEased * keep_;
         ++pass) {
      const Index there = added();
      if (remove_by_untangling(map_, held(), keep_, context_) == 0) return;
      map_ = mesh::compacted_map(map_);
      if (!relaxed()) return;
      thin_out(map_, held(), keep_, context_);
      if (100 * (there - added()) < kWorthEasing * there) return;
    }
  }

  mesh::RefinedMap map_;
  const Constraints& constraints_;
  Index keep_;
  ExecutionContext& context_;
  numeric::EliminationMemory order_;
  std::int64_t passes_ = 0;
};

}  // namespace

mesh::RefinedMap coarsen(mesh::RefinedMap map, const Constraints& constraints, Index keep,
                         ExecutionContext& context, Stats& stats, Coarsening how) {
  const Index before = map.surface.mesh.vertex_count();
  Coarsener coarsener(std::move(map), constraints, keep, context);
  const bool to_the_end = while_time_lasts(coarsener.map(), [&] {
    how == Coarsening::kBounded ? coarsener.bounded() : coarsener.all();
  });
  if (!to_the_end) note_time_limit(stats);
  stats["coarsen.passes"] = coarsener.passes();
  mesh::RefinedMap result = std::move(coarsener.map());
  stats["coarsen.removed"] = static_cast<std::int64_t>(before - result.surface.mesh.vertex_count());
  return result;
}

}  // namespace flipfree::matchmaker
