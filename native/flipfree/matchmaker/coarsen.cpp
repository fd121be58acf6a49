#include "flipfree/matchmaker/coarsen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/embedding/disk.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/request.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {

namespace {

using Mesh = mesh::EditableTriangulation;

// A removal may not leave a triangle that is worse than the worst it removes, except up to so many
// times the mean energy.
constexpr double kMostTimesMean = 4.0;
// A star with more corners than this is left alone.
constexpr std::size_t kMostRemovedCorners = 40;
// What a triangle costs that is turned over in the map.
constexpr double kTurnedOver = 1e300;
// Boundary vertices with a wider angle stay. Beyond 2 pi the triangles that fill the corner may
// wind once more around a vertex of its rim.
constexpr double kWidestCorner = 1.9 * std::numbers::pi;
// What a triangle costs that there may not be.
constexpr double kForbidden = std::numeric_limits<double>::infinity();

// The triangulation of a polygon with corners 0 ... n - 1, n >= 3, whose worst triangle costs
// least, by dynamic programming over the chords (Klincsek 1980): corners, ascending in each
// triangle; empty if there is none. cost(i, k, j), i < k < j. Cost: O(n^3).
template <class Cost>
std::vector<std::array<std::size_t, 3>> fill_polygon(std::size_t n, const Cost& cost) {
  std::vector<double> best(n * n, kForbidden);  // of the chord i, j: n i + j
  std::vector<std::size_t> apex(n * n, 0);
  for (std::size_t i = 0; i + 1 < n; ++i) best[i * n + i + 1] = -kForbidden;
  for (std::size_t length = 2; length < n; ++length) {
    for (std::size_t i = 0; i + length < n; ++i) {
      const std::size_t j = i + length;
      for (std::size_t k = i + 1; k < j; ++k) {
        const double parts = std::max(best[i * n + k], best[k * n + j]);
        if (parts >= best[i * n + j]) continue;
        const double worst = std::max(parts, cost(i, k, j));
        if (worst >= best[i * n + j]) continue;
        best[i * n + j] = worst;
        apex[i * n + j] = k;
      }
    }
  }
  std::vector<std::array<std::size_t, 3>> triangles;
  if (best[n - 1] == kForbidden) return triangles;
  std::vector<std::array<std::size_t, 2>> open = {{0, n - 1}};
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    if (j == i + 1) continue;
    const std::size_t k = apex[i * n + j];
    triangles.push_back({i, k, j});
    open.push_back({i, k});
    open.push_back({k, j});
  }
  return triangles;
}

// The star of a vertex and what is to replace it.
struct StarFilling {
  std::vector<FaceId> star;
  std::vector<Mesh::Triangle> triangles;
  std::vector<FaceId> parents;  // per triangle

  void replace_in(Mesh& mesh) const { mesh.replace(star, triangles, parents); }
};

class VertexRemover {
 public:
  // The map must outlive it. Measures the map's energy: O(#F).
  VertexRemover(const mesh::RefinedMap& map, const ExecutionContext& context)
      : map_(map), mesh_(map.surface.mesh) {
    const auto [sums, length] = measured(map_, context);
    const double scale = length * sums.best_scale();
    scale2_ = scale * scale;
    mean_ = sums.at_best_scale();
    // Too distorted to be measured: whatever is valid will do.
    if (std::isfinite(mean_) && scale2_ > 0 && std::isfinite(scale2_)) return;
    scale2_ = 1;
    mean_ = std::numeric_limits<double>::infinity();
  }

  // The triangulation of the star without the vertex that is best in the map; positive there, or,
  // if triangles may be `turned_over`, as far as may be. False if there is none, or the star is not
  // where its support says, or has too many corners.
  bool fill(VertexId v, bool turned_over, StarFilling& filling) {
    std::vector<Side> sides;
    filling = {mesh_.star(v), {}, {}};
    if (filling.star.empty() || !split_star(v, sides)) return false;
    if (mesh_.is_boundary_vertex(v) && angle(v) > kWidestCorner) return false;
    bound_ = kMostTimesMean * mean_;
    for (const FaceId f : filling.star) {
      const Mesh::Triangle t = mesh_.corners(f);
      bound_ = std::max(bound_, energy(t[0], t[1], t[2]));
    }
    for (const Side& side : sides) {
      if (!triangulate(side, turned_over, filling.triangles)) return false;
      filling.parents.resize(filling.triangles.size(), side.parent);
    }
    return true;
  }

 private:
  // One side of a star: corners counter-clockwise, closed by the edge from the last to the first.
  struct Side {
    std::vector<VertexId> corners;
    FaceId parent = kInvalid;
  };

  double angle(VertexId v) const {
    double sum = 0;
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      sum += turn(uv(mesh_.target(h)) - uv(v), uv(mesh_.apex(h)) - uv(v));
    });
    return sum;
  }

  // Does w lie on the input edge that v, with two supports, lies on?
  bool on_edge_of(VertexId v, VertexId w) const {
    const mesh::Support& s = support(v);
    const mesh::Support& t = support(w);
    for (std::size_t i = 0; i < 3 && t.vertex[i] != kInvalid; ++i) {
      if (t.vertex[i] != s.vertex[0] && t.vertex[i] != s.vertex[1]) return false;
    }
    return true;
  }

  // False if v is not where its support says: then it is left alone.
  bool split_star(VertexId v, std::vector<Side>& sides) const {
    const bool boundary = mesh_.is_boundary_vertex(v);
    std::vector<HalfedgeId> fan;
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) { fan.push_back(h); });
    if (support(v).vertex[2] != kInvalid) {
      Side& side = sides.emplace_back();
      for (const HalfedgeId h : fan) side.corners.push_back(mesh_.target(h));
      side.parent = mesh_.parent(fan.front() / 3);
      return !boundary;
    }
    // From where the edge leaves v on.
    const auto first = std::find_if(fan.begin(), fan.end(),
                                    [&](HalfedgeId h) { return on_edge_of(v, mesh_.target(h)); });
    if (first == fan.end() || (boundary && first != fan.begin())) return false;
    std::rotate(fan.begin(), first, fan.end());
    for (const HalfedgeId h : fan) {
      if (on_edge_of(v, mesh_.target(h))) sides.push_back({{}, mesh_.parent(h / 3)});
      if (mesh_.parent(h / 3) != sides.back().parent) return false;
      sides.back().corners.push_back(mesh_.target(h));
      if (on_edge_of(v, mesh_.apex(h))) sides.back().corners.push_back(mesh_.apex(h));
    }
    return sides.size() == (boundary ? 1U : 2U);
  }

  // Least worst energy; all triangles positive in both planes. Appends to `triangles`.
  bool triangulate(const Side& side, bool turned_over, std::vector<Mesh::Triangle>& triangles) {
    const std::vector<VertexId>& c = side.corners;
    const std::size_t n = c.size();
    if (n < 3 || n > kMostRemovedCorners) return false;
    Polygon polygon;
    for (const VertexId v : c) polygon.push_back(uv(v));
    if (!turned_over) {
      const bool repeats = polygon.front() == polygon.back() ||
                           std::adjacent_find(polygon.begin(), polygon.end()) != polygon.end();
      if (repeats || embedding::turning_number(rows_of(polygon)) != 1) return false;
    }
    // As stored: triangles between held vertices could not be repaired when the map is rounded.
    Polygon stored;
    for (const Vector2& p : polygon) stored.push_back(as_stored(p));
    const auto cost = [&](std::size_t i, std::size_t k, std::size_t j) {
      const bool positive = numeric::orientation(polygon[i], polygon[k], polygon[j]) > 0 &&
                            numeric::orientation(stored[i], stored[k], stored[j]) > 0;
      if (!positive && !turned_over) return kForbidden;
      if (map_.surface.orientation_in_parent(side.parent, c[i], c[k], c[j]) <= 0) return kForbidden;
      if (!positive) return kTurnedOver;
      const double value = energy(c[i], c[k], c[j]);
      return value > bound_ && !turned_over ? kForbidden : value;
    };
    const auto filled = fill_polygon(n, cost);
    for (const auto& [i, k, j] : filled) triangles.push_back({c[i], c[k], c[j]});
    return !filled.empty();
  }

  // Symmetric Dirichlet energy at the map's scale.
  double energy(VertexId a, VertexId b, VertexId c) const {
    const auto position = [&](VertexId v) { return map_.surface.position[at(v)]; };
    const distortion::RestTriangle rest =
        distortion::unfold({position(a), position(b), position(c)}, distortion::kFlattestRest);
    const auto place = [&](VertexId v) { return map_.uv.row(v).data(); };
    const distortion::Jacobian j = distortion::jacobian(rest, place(a), place(b), place(c));
    const double square = 0.25 * (j.a * j.a + j.b * j.b + j.c * j.c + j.d * j.d);
    return square * scale2_ + square / (j.determinant * j.determinant * scale2_);
  }

  const mesh::Support& support(VertexId v) const { return map_.surface.support[at(v)]; }
  Vector2 uv(VertexId v) const { return map_.uv.row(v).transpose(); }

  const mesh::RefinedMap& map_;
  const Mesh& mesh_;
  double scale2_ = 1;  // square of the best global scale
  double mean_ = 0;    // energy of the map
  double bound_ = 0;   // of the new triangles of the star at hand
};

}  // namespace

Index thin_out(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
               ExecutionContext& context) {
  const std::vector<char> stays = flags_of(held, map.surface.position.size());
  VertexRemover remover(map, context);
  Index removed = 0;
  for (VertexId v = map.surface.mesh.vertex_count(); v-- > keep;) {
    if (v % 256 == 0) context.check();
    StarFilling filling;
    if (stays[at(v)] != 0 || !remover.fill(v, false, filling)) continue;
    filling.replace_in(map.surface.mesh);
    ++removed;
  }
  if (removed > 0) map = mesh::compacted_map(map);
  return removed;
}

Index remove_by_untangling(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                           int rings, ExecutionContext& context) {
  constexpr int kIterations = 80;
  constexpr int kPatience = 10;
  distortion::UntangleOptions untangling;
  untangling.max_iterations = kIterations;
  untangling.patience = kPatience;
  untangling.extra_iterations = 1;
  Mesh& mesh = map.surface.mesh;
  VertexRemover remover(map, context);
  const std::vector<char> stays = flags_of(held, map.surface.position.size());
  std::vector<char> fixed = stays;
  for (VertexId v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.is_boundary_vertex(v)) fixed[at(v)] = 1;
  }
  Index removed = 0;
  for (VertexId v = mesh.vertex_count(); v-- > keep;) {
    context.check();
    StarFilling filling;
    if (stays[at(v)] != 0 || !remover.fill(v, true, filling)) continue;
    std::sort(filling.star.begin(), filling.star.end());
    std::vector<VertexId> near = vertices_near(mesh, {v}, rings);
    near.erase(std::lower_bound(near.begin(), near.end(), v));
    const std::vector<FaceId> faces = faces_at(mesh, near);
    std::vector<Mesh::Triangle> triangles = filling.triangles;
    for (const FaceId f : faces) {
      if (!std::binary_search(filling.star.begin(), filling.star.end(), f))
        triangles.push_back(mesh.corners(f));
    }
    const Patch patch = make_patch(map, triangles, near, fixed);
    const distortion::UntangleResult result =
        distortion::Untangler(patch.surface, patch.fixed, context)
            .run(patch.uv, untangling, context);
    if (result.flips != 0 ||
        !distortion::is_flip_free(patch.surface.faces, as_stored(result.uv), context) ||
        winds_more(map, patch, static_cast<FaceId>(patch.surface.faces.rows()), result.uv, faces))
      continue;
    map.uv(patch.vertices, Eigen::all) = result.uv;
    filling.replace_in(mesh);
    ++removed;
  }
  return removed;
}

namespace {

// Takes refinement back by making room for the input's faces: the energy of the split ones, as they
// would be whole, is lowered until they are positive (untangle.h), while the map itself, as it is
// split, stays valid behind a barrier.
//
// Untangling the whole faces alone succeeds as often, but then vertices wind twice; here they can
// only be taken whole where removing a vertex leaves a valid map (thin_out()).

constexpr int kUnfoldingRounds = 6;
// Newton steps of a round, and without progress; and of the energy after it.
constexpr int kUnfoldingSteps = 30;
constexpr int kUnfoldingPatience = 10;
constexpr int kStepsAfterUnfolding = 5;
// Vertices move within so many rings around split faces.
constexpr int kRingsAroundSplits = 6;
// Lower values force more faces to be whole, but squeeze what is around those that can't be.
constexpr double kLeastEpsilon = 1e-3;
// Of the faces that are to be taken back: they hold the map, but not its shape.
constexpr double kPieceWeight = 0.01;

// Makes room for the split faces; false if there is none, and the map is as before. Untangled is
// the neighbourhood of the split input faces: the map's faces there, those of split faces with
// little weight, which stay positive, and after them the split faces as they would be whole.
bool make_room_for_wholes(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                          ExecutionContext& context) {
  const Mesh& mesh = map.surface.mesh;
  std::vector<VertexId> seeds;
  for (VertexId v = keep; v < mesh.vertex_count(); ++v) seeds.push_back(v);
  std::vector<FaceId> split;  // input faces
  for (const FaceId f : faces_at(mesh, seeds)) split.push_back(mesh.parent(f));
  sort_unique(split);
  const std::vector<VertexId> near = vertices_near(mesh, std::move(seeds), kRingsAroundSplits + 1);
  const std::vector<FaceId> faces = faces_at(mesh, near);
  std::vector<Mesh::Triangle> triangles;
  std::vector<double> weights;
  for (const FaceId f : faces) {
    triangles.push_back(mesh.corners(f));
    const bool part = std::binary_search(split.begin(), split.end(), mesh.parent(f));
    weights.push_back(part ? kPieceWeight : 1.0);
  }
  const Triangles& input = map.surface.input->faces;
  for (const FaceId f : split) {
    triangles.push_back({input(f, 0), input(f, 1), input(f, 2)});
    weights.push_back(1.0);
  }
  const Patch patch = make_patch(map, triangles, near, flags_of(held, map.surface.position.size()));
  distortion::UntangleOptions options;
  options.max_iterations = kUnfoldingSteps;
  options.patience = kUnfoldingPatience;
  options.least_epsilon = kLeastEpsilon;
  options.guards = static_cast<Index>(faces.size());
  options.weights = &weights;
  const Points2 uv =
      distortion::Untangler(patch.surface, patch.fixed, context).run(patch.uv, options, context).uv;
  // Long steps between valid maps may pass through others.
  if (winds_more(map, patch, options.guards, uv, faces)) return false;
  map.uv(patch.vertices, Eigen::all) = uv;
  return true;
}

// `held`: vertices that do not move. Precondition: map.uv is flip-free, inner vertices wind once.
// Guarantee: so it is afterwards, vertices below `keep` are there still. Cost: at most six times
// some thirty-five Newton steps near split faces.
void unfold_wholes(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                   ExecutionContext& context) {
  for (int round = 0; round < kUnfoldingRounds && map.surface.mesh.vertex_count() > keep; ++round) {
    const Points2 valid = map.uv;
    const Index there = map.surface.mesh.vertex_count();
    const std::vector<VertexId> seeds = beside_added(map.surface.mesh, keep);
    if (!make_room_for_wholes(map, held, keep, context) ||
        thin_out(map, held, keep, context) == 0) {
      // What had to give way for nothing goes back.
      if (map.surface.mesh.vertex_count() == there) map.uv = valid;
      return;
    }
    if (!relax_near_added(map, seeds, keep, held, kStepsAfterUnfolding, context)) return;
  }
}

// Plain removals: rounds at most, and Newton steps after each; one that removes less than this
// share (in per cent) is the last.
constexpr int kRounds = 12;
constexpr int kStepsOfRound = 8;
constexpr Index kWorthwhile = 2;
// Untangling: rounds at most, and Newton steps after each. One that frees less than one vertex in
// so many (with neighbourhoods of one ring, of two) is followed by larger neighbourhoods.
constexpr int kUntanglingRounds = 12;
constexpr int kStepsOfUntangling = 20;
constexpr std::array<Index, 2> kWorthwhileUntangling = {7, 12};

// Unfolding: so often, after so many Newton steps each.
constexpr int kUnfoldings = 2;
constexpr int kStepsOfUnfolding = 30;

struct Coarsener {
  mesh::RefinedMap& map;
  const std::vector<VertexId>& held;
  Index keep;
  ExecutionContext& context;

  void run(const CoarsenOptions& options) {
    {
      const ProgressRange range(context, 0.0, 0.5);
      remove_plainly();
    }
    const ProgressRange rest(context, 0.5, 1.0);
    if (added() > options.most_untangled * keep) return;
    if (options.unfold) unfold();
    untangle();
  }

  Index added() const { return map.surface.mesh.vertex_count() - keep; }

  std::vector<VertexId> beside() const { return beside_added(map.surface.mesh, keep); }

  // Near these and what is added still. False when the map is too squeezed; what is removed is
  // removed.
  bool relaxed(const std::vector<VertexId>& seeds, int steps) {
    return relax_near_added(map, seeds, keep, held, steps, context);
  }

  void remove_plainly() {
    for (int round = 0; round < kRounds && added() > 0; ++round) {
      const double share = 1.0 / kRounds;
      const ProgressRange range(context, round * share, (round + 1) * share);
      context.report("taking refinement back", 0.0);
      const Index before = added();
      const std::vector<VertexId> seeds = beside();
      const Index removed = thin_out(map, held, keep, context);
      if (removed == 0 || !relaxed(seeds, kStepsOfRound) || 100 * removed < kWorthwhile * before)
        return;
    }
  }

  void unfold() {
    for (int i = 0; i < kUnfoldings && added() > 0; ++i) {
      relaxed(beside(), kStepsOfUnfolding);
      unfold_wholes(map, held, keep, context);
    }
  }

  void untangle() {
    int rings = 1;
    for (int round = 0; round < kUntanglingRounds && added() > 0; ++round) {
      const double share = 1.0 / kUntanglingRounds;
      const ProgressRange range(context, round * share, (round + 1) * share);
      const Index before = added();
      const std::vector<VertexId> seeds = beside();
      remove_by_untangling(map, held, keep, rings, context);
      map = mesh::compacted_map(map);
      relaxed(seeds, kStepsOfUntangling);
      thin_out(map, held, keep, context);
      if (kWorthwhileUntangling[at(rings - 1)] * (before - added()) >= before) continue;
      if (at(rings) == kWorthwhileUntangling.size()) return;
      ++rings;
    }
  }
};

}  // namespace

void coarsen(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
             const CoarsenOptions& options, ExecutionContext& context, Stats& stats) {
  if (ended_in_time([&] { Coarsener{map, held, keep, context}.run(options); })) return;
  map = mesh::compacted_map(map);  // valid after every step, but of vertices that are gone
  note_time_limit(stats);
}

}  // namespace flipfree::matchmaker
