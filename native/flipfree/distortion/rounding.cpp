#include "flipfree/distortion/rounding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimizer.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::distortion {
namespace {

constexpr int kMostSweeps = 6;  // over single points, before the region is opened as a whole
constexpr int kFirstRings = 2;  // around the vertices at fault
constexpr std::size_t kMostConflicts = 10000;  // of boundary edges, looked at in a sweep
constexpr int kMostSettling = 4;               // rounds
constexpr int kNear = 2;                       // grains around where a vertex is in 64 bits

double rounded(double x) { return static_cast<double>(static_cast<float>(x)); }

// Opens crowded triangles in 64 bits: minimises the distortion of the region with respect to
// equilateral triangles of one size, its rim held. A valid map all the time, so that a cluster of
// any depth can be opened, unlike by moves of single points. `region` holds vertices; all triangles
// at them take part.
void open_region(const Triangles& faces, const std::vector<VertexId>& region,
                 const RoundingOptions& options, Points2& uv, ExecutionContext& context) {
  std::vector<char> inside(at(static_cast<Index>(uv.rows())), 0);
  for (const VertexId v : region) inside[at(v)] = 1;
  std::vector<FaceId> chosen;
  std::vector<char> held(inside.size(), 0);
  for (const VertexId v : options.fixed) held[at(v)] = 1;
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    const bool takes_part =
        inside[at(faces(f, 0))] && inside[at(faces(f, 1))] && inside[at(faces(f, 2))];
    if (takes_part) {
      chosen.push_back(f);
      continue;
    }
    for (int k = 0; k < 3; ++k) held[at(faces(f, k))] = 1;
  }
  std::vector<Index> local(inside.size(), kInvalid);
  const auto [part, vertices] = mesh::part_of(faces, chosen, local);
  if (vertices.empty()) return;
  MinimizeOptions minimize;
  minimize.max_iterations = 60;
  minimize.tolerance = 1e-2;
  Points2 start(static_cast<Eigen::Index>(vertices.size()), 2);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    start.row(static_cast<Eigen::Index>(i)) = uv.row(vertices[i]);
    if (held[at(vertices[i])]) minimize.fixed.push_back(static_cast<VertexId>(i));
  }
  if (minimize.fixed.empty()) minimize.fixed.push_back(0);  // keeps the place and the unit
  const Points2 opened =
      Minimizer(part, equilateral_rest_shapes(chosen.size()), nullptr, start, minimize, context)
          .run()
          .uv;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    uv.row(vertices[i]) = opened.row(static_cast<Eigen::Index>(i));
  }
}

// Moves 32-bit points of a region, no further than it takes, so that the triangles around each get
// a height of some units in the last place; of more from round to round, so that crowds spread.
class Repair {
 public:
  Repair(const Triangles& faces, const RoundingOptions& options, Points2& points,
         const ExecutionContext& context)
      : faces_(faces),
        options_(options),
        points_(points),
        context_(context),
        movable_(at(static_cast<Index>(points.rows())), 1),
        corners_(corners_by_vertex(movable_.size(), faces)) {
    for (const VertexId v : options.fixed) movable_[at(v)] = 0;
    if (options.bijective) {
      boundary_ = find_boundary(static_cast<Index>(points.rows()), faces);
      edges_at_.resize(movable_.size());
      for (std::size_t e = 0; e < boundary_.edges.size(); ++e) {
        for (const VertexId v : boundary_.edges[e])
          edges_at_[at(v)].push_back(static_cast<Index>(e));
      }
    }
  }

  // Vertices at fault: corners of bad triangles, ends of boundary edges that meet.
  std::vector<VertexId> seeds(std::vector<FaceId>& bad) const {
    bad = flipped_faces(faces_, points_, context_);
    std::vector<VertexId> found;
    for (const FaceId f : bad) {
      for (int k = 0; k < 3; ++k) found.push_back(faces_(f, k));
    }
    if (options_.bijective) {
      const auto pairs = BoundaryGrid(boundary_, points_).conflicts(kMostConflicts, context_);
      for (const auto& pair : pairs) {
        for (const Index e : pair)
          found.insert(found.end(), boundary_.edges[at(e)].begin(), boundary_.edges[at(e)].end());
      }
      if (pairs.empty()) {
        for (const std::size_t l : turned_loops(boundary_, points_))
          found.insert(found.end(), boundary_.loops[l].begin(), boundary_.loops[l].end());
      }
    }
    sort_unique(found);
    return found;
  }

  // The region and every vertex that shares a triangle with it.
  std::vector<VertexId> grow(const std::vector<VertexId>& region) const {
    std::vector<VertexId> wider = region;
    for (const VertexId v : region) {
      for (const CornerId c : corners_[v]) {
        for (int k = 0; k < 3; ++k) wider.push_back(faces_(c / 3, k));
      }
    }
    sort_unique(wider);
    return wider;
  }

  // Moves the points of a region that starts at `seeds` and slowly grows; returns the vertices
  // still at fault.
  std::vector<VertexId> sweep(std::vector<VertexId> faulty, std::vector<FaceId>& bad) {
    std::vector<VertexId>& region = region_;
    region = faulty;
    enough_ = kFirstHeight;
    for (int round = 0; !faulty.empty() && round < kMostSweeps; ++round, enough_ *= 2.0) {
      bool any = false;
      for (std::size_t i = 0; i < region.size(); ++i) {
        if (i % 64 == 0) context_.check();
        any = improve(region[i]) || any;
      }
      faulty = seeds(bad);
      const std::size_t before = region.size();
      region.insert(region.end(), faulty.begin(), faulty.end());
      sort_unique(region);
      if (!any || round % 2 == 1) region = grow(region);
      if (!any && region.size() == before) break;
    }
    return faulty;
  }

  // Moves the vertices of the last sweep's region to where the distortion of the map from `wide`,
  // which is flip-free, is least near by, as long as that gets less. Precondition: none is at
  // fault; none gets to be.
  void settle(const Points2& wide) {
    const std::vector<VertexId> region = grow(region_);
    bool any = true;
    for (int round = 0; any && round < kMostSettling; ++round) {
      any = false;
      for (std::size_t i = 0; i < region.size(); ++i) {
        if (i % 64 == 0) context_.check();
        any = settle(region[i], wide) || any;
      }
    }
  }

 private:
  double grain_at(VertexId v) const {
    return points_.row(v).cwiseAbs().maxCoeff() * std::numeric_limits<float>::epsilon();
  }

  // Of the points around where v is in 64 bits, and its own, the best; true if it moved.
  bool settle(VertexId v, const Points2& wide) {
    if (!movable_[at(v)]) return false;
    const double grain = grain_at(v);
    // Edges at v reach as far as its neighbours, and meet what lies anywhere along them.
    find_near(v, star(v).second + (points_.row(v) - wide.row(v)).cwiseAbs().maxCoeff() +
                     (kNear + 1) * grain);
    double least = distortion(v, wide);
    Eigen::RowVector2d place = points_.row(v);
    const Eigen::RowVector2d start = place;
    for (int dx = -kNear; dx <= kNear; ++dx) {
      for (int dy = -kNear; dy <= kNear; ++dy) {
        points_.row(v) << rounded(wide(v, 0) + dx * grain), rounded(wide(v, 1) + dy * grain);
        const double now = distortion(v, wide);
        if (!(now < least) || conflicts(v) > 0) continue;
        least = now;
        place = points_.row(v);
      }
    }
    points_.row(v) = place;
    return place != start;
  }

  double distortion(VertexId v, const Points2& wide) const {
    double sum = 0;
    for (const CornerId c : corners_[v]) {
      const FaceId f = c / 3;
      const auto p = [&](int k) -> Vector2 { return points_.row(faces_(f, k)).transpose(); };
      const Vector2 a = p(0), b = p(1), d = p(2);
      const double area = (b - a).x() * (d - a).y() - (b - a).y() * (d - a).x();
      sum += distortion_between(faces_, f, wide, points_,
                                numeric::orientation(a, b, d) > 0 ? std::abs(area) : 0.0);
    }
    return sum;
  }

  // Tries other 32-bit points for v; true if it moved.
  bool improve(VertexId v) {
    if (!movable_[at(v)]) return false;
    const Vector2 start = points_.row(v).transpose();
    const double grain = grain_at(v);
    const double high_enough = enough_ * grain;
    const auto [centre, radius] = star(v);
    if (!std::isfinite(radius)) return false;  // a neighbour lies beyond the range of floats
    find_near(v, kFarthest * radius + grain);
    double best = score(v, high_enough);
    double gained = best;  // without the price of the way
    Vector2 place = start;
    const auto attempt = [&](const Vector2& candidate) {
      const Vector2 p(rounded(candidate.x()), rounded(candidate.y()));
      if (p == place || !p.allFinite()) return;
      points_.row(v) = p.transpose();
      const double own = score(v, high_enough);
      const double s = own - kPriceOfWay * (p - start).norm();
      if (s <= best) return;
      best = s;
      gained = own;
      place = p;
    };
    const auto attempt_around = [&](const Vector2& p, double r) {
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dy = -1; dy <= 1; ++dy) {
          if (dx != 0 || dy != 0) attempt(p + r * Vector2(dx, dy));
        }
      }
    };
    // From the neighbouring floats to the whole star's size, until nothing is wrong; then back down
    // from the best point so far.
    // At the origin floats are as fine as one likes.
    double reach = std::max(0.5 * grain, 0x1p-60 * radius);
    for (; reach > 0.0 && reach <= radius && gained < high_enough; reach *= 2.0)
      attempt_around(start, reach);
    if (gained < 0.0) attempt(centre);
    for (double r = 0.5 * reach; r > 0.25 * grain && r > 0; r *= 0.5) {
      // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): attempt() moves `place`
      const Vector2 around = place;
      attempt_around(around, r);
    }
    points_.row(v) = place.transpose();
    return place != start;
  }

  // Mean of the neighbours and the largest distance to one.
  std::pair<Vector2, double> star(VertexId v) const {
    Vector2 sum = Vector2::Zero();
    double radius = 0;
    int count = 0;
    for (const CornerId own : corners_[v]) {
      for (const CornerId c : {next_corner(own), previous_corner(own)}) {
        const Vector2 p = points_.row(faces_.data()[c]).transpose();
        sum += p;
        radius = std::max(radius, (p - points_.row(v).transpose()).norm());
        ++count;
      }
    }
    return {count > 0 ? Vector2(sum / count) : Vector2(points_.row(v).transpose()), radius};
  }

  // Lowest height of a triangle at v, signed, of which no more than `enough` counts; counted as
  // negative by the exact test, whatever its value. Boundary edges at v that meet others count like
  // a flipped triangle.
  double score(VertexId v, double enough) const {
    double lowest = std::numeric_limits<double>::infinity();
    double penalty = 0;
    for (const CornerId own : corners_[v]) {
      const FaceId f = own / 3;
      const Vector2 a = points_.row(faces_(f, 0)).transpose();
      const Vector2 b = points_.row(faces_(f, 1)).transpose();
      const Vector2 c = points_.row(faces_(f, 2)).transpose();
      const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm(), 1e-300});
      const double area = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
      const int sign = numeric::orientation(a, b, c);
      const double height = std::abs(area) / longest;
      lowest = std::min(lowest, sign > 0 ? height : -height);
      if (sign <= 0) penalty += kFlipPenalty;
    }
    return std::min(lowest, enough) - penalty - kFlipPenalty * conflicts(v);
  }

  // Boundary edges that those at v can meet while it is moved by no more than `reach` along an
  // axis.
  void find_near(VertexId v, double reach) {
    near_.clear();
    if (!options_.bijective || edges_at_[at(v)].empty()) return;
    const Eigen::RowVector2d low = points_.row(v).array() - reach;
    const Eigen::RowVector2d high = points_.row(v).array() + reach;
    for (std::size_t f = 0; f < boundary_.edges.size(); ++f) {
      const auto c = points_.row(boundary_.edges[f][0]);
      const auto d = points_.row(boundary_.edges[f][1]);
      if ((c.cwiseMax(d).array() >= low.array()).all() &&
          (c.cwiseMin(d).array() <= high.array()).all())
        near_.push_back(static_cast<Index>(f));
    }
  }

  // Precondition: find_near(v).
  double conflicts(VertexId v) const {
    if (!options_.bijective || edges_at_[at(v)].empty()) return 0;
    double count = 0;
    const auto point = [&](VertexId w) -> Vector2 { return points_.row(w).transpose(); };
    for (const Index e : edges_at_[at(v)]) {
      const auto& [a, b] = boundary_.edges[at(e)];
      for (const Index f : near_) {
        const auto& [c, d] = boundary_.edges[at(f)];
        if (f == e) continue;
        const bool joined = a == c || a == d || b == c || b == d;
        const bool same = !joined && (point(a) == point(c) || point(a) == point(d) ||
                                      point(b) == point(c) || point(b) == point(d));
        if (same || numeric::segments_conflict(point(a), point(b), point(c), point(d))) count += 1;
      }
    }
    return count;
  }

  // Outweighs every height: maps are scaled to at most this size before they are stored.
  static constexpr double kFlipPenalty = 1e9;
  // Height, in units in the last place of the coordinates, beyond which nothing is gained at first.
  static constexpr double kFirstHeight = 16.0;
  // Of two places that are as good the nearer one; little beside the height that is won.
  static constexpr double kPriceOfWay = 1e-3;
  // From where it was, in radii of its star, a vertex is moved by at most: one, then by halves.
  static constexpr double kFarthest = 4.0;

  const Triangles& faces_;
  const RoundingOptions& options_;
  Points2& points_;
  const ExecutionContext& context_;
  double enough_ = kFirstHeight;
  std::vector<VertexId> region_;  // vertices that the sweep may have moved, ascending
  std::vector<char> movable_;
  Lists<CornerId> corners_;
  Boundary boundary_;
  std::vector<std::vector<Index>> edges_at_;
  std::vector<Index> near_;
};

[[noreturn]] void give_up(const std::vector<FaceId>& bad, const std::vector<VertexId>& seeds) {
  const std::string what = bad.empty() ? std::string("The boundary meets itself")
                                       : std::to_string(bad.size()) + " triangles flip or collapse";
  const ElementKind kind = bad.empty() ? ElementKind::kVertex : ElementKind::kFace;
  throw_not_converged(
      ErrorCode::kRoundingFlips,
      what +
          ", when the map is rounded to the 32-bit values that are stored, and no 32-bit points "
          "near by "
          "avoid it. Cut the chart into smaller ones, or enlarge its smallest parts.",
      kind, first_elements(bad.empty() ? seeds : bad));
}

// Exact predicates know no infinity.
void require_finite(const Triangles& faces, const Points2& points) {
  if (points.allFinite()) return;
  std::vector<FaceId> outside;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    bool finite = true;
    for (Index k = 0; k < 3; ++k) finite = finite && points.row(faces(f, k)).allFinite();
    if (!finite) outside.push_back(f);
  }
  give_up(std::move(outside), {});
}

}  // namespace

Points2f round_to_storage(const Triangles& faces, const Points2& uv, const RoundingOptions& options,
                          ExecutionContext& context, Stats& stats) {
  const Points2 nearest = as_stored(uv);
  require_finite(faces, nearest);
  const bool good =
      is_flip_free(faces, nearest, context) &&
      !(options.bijective &&
        overlaps_itself(find_boundary(static_cast<Index>(uv.rows()), faces), nearest, context));
  std::int64_t moved = 0;
  Points2 points = nearest;
  if (!good) {
    Points2 wide = uv;
    Repair repair(faces, options, points, context);
    std::vector<FaceId> bad;
    std::vector<VertexId> seeds = repair.seeds(bad);
    std::vector<VertexId> region = seeds;
    std::vector<VertexId> left = repair.sweep(seeds, bad);
    for (int rings = kFirstRings; !left.empty(); rings *= 2) {
      region.insert(region.end(), seeds.begin(), seeds.end());
      for (int r = 0; r < rings; ++r) region = repair.grow(region);
      // All that is connected to the vertices at fault, which need not be the whole mesh.
      const bool everything = repair.grow(region).size() == region.size();
      try {
        open_region(faces, region, options, wide, context);
      } catch (const NotConverged&) {
        give_up(std::move(bad), left);  // too small or too thin for doubles, let alone floats
      }
      points = as_stored(wide);
      seeds = repair.seeds(bad);
      left = seeds.empty() ? seeds : repair.sweep(seeds, bad);
      if (!left.empty() && everything) give_up(std::move(bad), left);
    }
    // Loops as small as a grain can turn inside out without an edge that meets another.
    const Points2 mended = points;
    repair.settle(wide);
    if (!repair.seeds(bad).empty()) points = mended;
    for (Eigen::Index v = 0; v < points.rows(); ++v) {
      moved += points.row(v) != nearest.row(v) ? 1 : 0;
    }
  }
  stats["rounding.repaired"] = moved;
  return points.cast<float>();
}

}  // namespace flipfree::distortion
