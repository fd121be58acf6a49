#include "flipfree/matchmaker/finish/settle.h"

#include <algorithm>
#include <cstddef>

#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/matchmaker/coarsening/coarsening_rounds.h"
#include "flipfree/matchmaker/coarsening/untangle_removal.h"
#include "flipfree/matchmaker/request/time_share.h"
#include "flipfree/matchmaker/smooth/relax.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

// Faces of more than so many times the map's energy are bad; they and those of added vertices are
// relaxed with so many rings of vertices around them.
constexpr double kBad = 8.0;
constexpr int kRingsAroundBad = 3;
// Newton steps near bad faces: at first, and after each round of taking refinement back.
constexpr int kStepsAtFirst = 15;
constexpr int kStepsAfterRound = 5;
// Newton steps of the whole map in the middle.
constexpr int kStepsOfAll = 5;
constexpr int kMostRounds = 5;
// Rounds end early when one frees less than this share (in per cent).
constexpr Index kWorthwhileRound = 10;

class Settler {
 public:
  Settler(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
          ExecutionContext& context)
      : map_(map), held_(held), keep_(keep), context_(context) {}

  void run() {
    relax_bad(kStepsAtFirst);
    coarsen_in_rounds();
    untangle();
    RelaxOptions options;
    options.steps = kStepsOfAll;
    options.lengthen = true;
    options.memory = &order_;
    relax(map_, held_, options, context_);
    coarsen_in_rounds();
    untangle();
  }

 private:
  Index added() const { return map_.surface.mesh.vertex_count() - keep_; }

  void coarsen_in_rounds() {
    matchmaker::coarsen_in_rounds(map_, held_, keep_, {kMostRounds, kWorthwhileRound, 1}, context_,
                                  [&] {
                                    relax_bad(kStepsAfterRound);
                                    return true;
                                  });
  }

  void untangle() {
    if (added() == 0 || remove_by_untangling(map_, held_, keep_, context_) == 0) return;
    map_ = mesh::compacted_map(map_);
    relax_bad(kStepsAfterRound);
  }

  void relax_bad(int steps) {
    RelaxOptions options;
    options.steps = steps;
    options.lengthen = true;
    options.memory = &order_;
    relax_near(map_, bad_vertices(), kRingsAroundBad, held_, options, context_);
  }

  // Corners of bad faces, and added vertices.
  std::vector<VertexId> bad_vertices() const {
    const Triangles faces = map_.surface.mesh.faces();
    std::vector<VertexId> bad;
    const distortion::RestShapes rest =
        distortion::build_rest_shapes(to_surface(map_.surface), context_);
    const distortion::EnergySums sums =
        distortion::sum_energy(faces, rest.triangles, map_.uv, context_);
    const double scale2 = sums.best_scale() * sums.best_scale();
    const double most = kBad * sums.at_best_scale();
    for (FaceId f = 0; f < faces.rows(); ++f) {
      const auto at = [&](Index k) { return map_.uv.row(faces(f, k)).data(); };
      const distortion::Jacobian j =
          distortion::jacobian(rest.triangles[static_cast<std::size_t>(f)], at(0), at(1), at(2));
      const double stretch = 0.25 * (j.a * j.a + j.b * j.b + j.c * j.c + j.d * j.d);
      const double shrink = stretch / (j.determinant * j.determinant);
      if (scale2 * stretch + shrink / scale2 <= most) continue;
      for (Index k = 0; k < 3; ++k) bad.push_back(faces(f, k));
    }
    for (VertexId v = keep_; v < map_.surface.mesh.vertex_count(); ++v) bad.push_back(v);
    return bad;
  }

  mesh::RefinedMap& map_;
  const std::vector<VertexId>& held_;
  Index keep_;
  ExecutionContext& context_;
  numeric::EliminationMemory order_{keep_};
};

}  // namespace

void settle(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
            ExecutionContext& context) {
  while_time_lasts(map, [&] { Settler(map, held, keep, context).run(); });
}

}  // namespace flipfree::matchmaker
