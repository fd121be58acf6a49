#include "flipfree/distortion/rounding.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimizer.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::distortion {

namespace {

constexpr int kMostSweeps = 6;                 // over single points, before the region is opened
constexpr int kFirstRings = 2;                 // around the vertices at fault
constexpr std::size_t kMostConflicts = 10000;  // of boundary edges, looked at in a sweep
constexpr int kMostSettling = 4;               // rounds
constexpr int kNear = 2;                       // grains around where a vertex is in 64 bits
// Height of a triangle, in grains, beyond which nothing is gained at first.
constexpr double kFirstHeight = 4.0;
// Of two places that are as good the nearer one; little beside the height that is won.
constexpr double kPriceOfWay = 1e-3;
// From where it was, in radii of its star, a vertex is moved by at most: one, then by halves.
constexpr double kFarthest = 4.0;

// What is wrong at a vertex, then how low the lowest triangle is: the greater one is better.
using Score = std::pair<int, double>;

// One ring of faces more around the marked vertices (#V), and all that move with these.
void grow(const Triangles& faces, const std::vector<VertexId>& leader, std::vector<char>& marked) {
  std::vector<char> wider = marked;
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    const bool any = marked[at(faces(f, 0))] || marked[at(faces(f, 1))] || marked[at(faces(f, 2))];
    for (int k = 0; any && k < 3; ++k) wider[at(faces(f, k))] = 1;
  }
  for (std::size_t v = 0; v < wider.size(); ++v)
    if (wider[v] != 0 && leader[v] != kInvalid) wider[at(leader[v])] = 1;
  for (std::size_t v = 0; v < wider.size(); ++v)
    if (leader[v] != kInvalid && wider[at(leader[v])] != 0) wider[v] = 1;
  marked.swap(wider);
}

class Repair {
 public:
  Repair(const Triangles& faces, const PointRules& rules, Points2& points,
         const ExecutionContext& context)
      : faces_(faces),
        rules_(rules),
        points_(points),
        context_(context),
        corners_(corners_by_vertex(rules.leader.size(), faces)),
        copies_(rules.leader.size(),
                [&](const auto& add) {
                  for (std::size_t v = 0; v < rules.leader.size(); ++v)
                    if (rules.leader[v] != kInvalid) add(rules.leader[v], static_cast<VertexId>(v));
                }),
        marked_(rules.leader.size(), 0) {
    if (!rules.bijective) return;
    boundary_ = find_boundary(static_cast<Index>(rules.leader.size()), faces);
    edges_at_ = Lists<Index>(rules.leader.size(), [&](const auto& add) {
      for (std::size_t e = 0; e < boundary_.edges.size(); ++e)
        for (const VertexId v : boundary_.edges[e]) add(v, static_cast<Index>(e));
    });
  }

  // Corners of bad triangles, ends of boundary edges that meet.
  std::vector<VertexId> faults() {
    bad_ = flipped_faces(faces_, points_, context_);
    std::vector<VertexId> found;
    for (const FaceId f : bad_) {
      for (int k = 0; k < 3; ++k) found.push_back(faces_(f, k));
    }
    if (rules_.bijective) {
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
  const std::vector<FaceId>& bad_faces() const { return bad_; }

  // Moves the points of a region that starts at `faulty` and slowly grows, so that the triangles
  // around each get a height of some grains; of more from round to round, so that crowds spread.
  // Returns the vertices still at fault.
  std::vector<VertexId> sweep(std::vector<VertexId> faulty) {
    std::fill(marked_.begin(), marked_.end(), char{0});
    enough_ = kFirstHeight;
    for (int round = 0; !faulty.empty() && round < kMostSweeps; ++round, enough_ *= 2.0) {
      for (const VertexId v : faulty) {
        const VertexId leader = rules_.leader[at(v)];
        marked_[at(leader == kInvalid ? v : leader)] = 1;
      }
      const bool any = for_marked([&](VertexId v) { return improve(v); });
      faulty = faults();
      if (any && round % 2 == 0) continue;
      const std::vector<char> before = marked_;
      grow(faces_, rules_.leader, marked_);
      if (!any && marked_ == before) break;
    }
    return faulty;
  }

  // Moves the vertices of the last sweep's region to where the distortion of the map from `wide`
  // is least near by, as long as that gets less. Precondition: none is at fault; none gets to be.
  void settle(const Points2& wide) {
    grow(faces_, rules_.leader, marked_);
    for (int round = 0; round < kMostSettling; ++round) {
      if (!for_marked([&](VertexId v) { return settle(v, wide); })) break;
    }
  }

 private:
  // The leaders in the region, ascending: is move(v) true of any?
  template <typename Move>
  bool for_marked(const Move& move) {
    bool any = false;
    for (std::size_t v = 0; v < marked_.size(); ++v) {
      if (marked_[v] == 0 || copies_[static_cast<VertexId>(v)].empty()) continue;
      context_.check();
      any = move(static_cast<VertexId>(v)) || any;
    }
    return any;
  }

  double grain_at(VertexId v) const {
    if (rules_.grain > 0) return rules_.grain;
    return points_.row(v).cwiseAbs().maxCoeff() * std::numeric_limits<float>::epsilon();
  }
  Vector2 snapped(VertexId v, const Vector2& p) const {
    Vector2 to = rules_.grain > 0 ? Vector2(rules_.grain * (p / rules_.grain).array().round())
                                  : as_stored(p);
    if (rules_.axis.empty()) return to;
    if (rules_.axis[at(v)] == PointRules::kFirst) to.y() = points_(v, 1);
    if (rules_.axis[at(v)] == PointRules::kSecond) to.x() = points_(v, 0);
    return to;
  }
  // Puts a leader to a place, and with it all that move with it. False if one is out of range.
  bool move(VertexId v, const Vector2& to) {
    const Vector2 by = to - points_.row(v).transpose();
    bool within = true;
    for (const VertexId copy : copies_[v]) {
      if (copy == v) {
        points_.row(v) = to.transpose();
      } else {
        points_.row(copy) += turned(by, rules_.turns[at(copy)]).transpose();
      }
      within = within && (points_.row(copy).array().abs() <= rules_.largest).all();
    }
    return within;
  }
  // R^turns p.
  static Vector2 turned(const Vector2& p, Index turns) {
    const Vector2 half = turns % 2 == 0 ? p : Vector2(-p.y(), p.x());
    return ((turns % 4) + 4) % 4 < 2 ? half : Vector2(-half);
  }

  // Of the points around where v is in 64 bits, and its own, the best; true if it moved.
  bool settle(VertexId v, const Points2& wide) {
    const double grain = grain_at(v);
    // Edges at v reach as far as its neighbours, and meet what lies anywhere along them.
    find_near(v, star(v).second + (points_.row(v) - wide.row(v)).cwiseAbs().maxCoeff() +
                     (kNear + 1) * grain);
    double least = distortion(v, wide);
    const Vector2 start = points_.row(v).transpose();
    Vector2 place = start;
    for (int dx = -kNear; dx <= kNear; ++dx) {
      for (int dy = -kNear; dy <= kNear; ++dy) {
        const bool within = move(v, snapped(v, wide.row(v).transpose() + grain * Vector2(dx, dy)));
        const double now = within ? distortion(v, wide) : least;
        if (!(now < least) || conflicts(v) > 0) continue;
        least = now;
        place = points_.row(v).transpose();
      }
    }
    move(v, place);
    return place != start;
  }

  // Symmetric Dirichlet energy, times area, of the faces around v as a map from `wide`; infinite if
  // one is folded.
  double distortion(VertexId v, const Points2& wide) const {
    double sum = 0;
    for_faces(v, [&](FaceId f, const Vector2& a, const Vector2& b, const Vector2& c) {
      const Vector2 u = b - a, w = c - a;
      const Vector2 p = (wide.row(faces_(f, 1)) - wide.row(faces_(f, 0))).transpose();
      const Vector2 q = (wide.row(faces_(f, 2)) - wide.row(faces_(f, 0))).transpose();
      const double before = std::abs(cross(p, q)), area = std::abs(cross(u, w));
      // (u w) = J (p q): |J|^2 is the squared length of both rows of (u w) adj(p q) over that of
      // `before`.
      const double stretch =
          (u * q.y() - w * p.y()).squaredNorm() + (w * p.x() - u * q.x()).squaredNorm();
      sum += numeric::orientation(a, b, c) > 0 && area > 0
                 ? stretch / before + stretch * before / (area * area)
                 : std::numeric_limits<double>::infinity();
    });
    return sum;
  }

  // Tries other points for v; true if it moved.
  bool improve(VertexId v) {
    const Vector2 start = points_.row(v).transpose();
    const double grain = grain_at(v);
    const double high_enough = enough_ * grain;
    const auto [centre, radius] = star(v);
    if (!std::isfinite(radius)) return false;  // a neighbour lies beyond the range of floats
    find_near(v, kFarthest * radius + grain);
    Score gained = score(v, high_enough);  // without the price of the way
    Score best = gained;
    Vector2 place = start;
    const auto attempt = [&](const Vector2& candidate) {
      const Vector2 p = snapped(v, candidate);
      if (p == place || !move(v, p)) return;
      const Score own = score(v, high_enough);
      const Score s{own.first, own.second - kPriceOfWay * (p - start).norm()};
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
    // From the neighbouring points to the whole star's size, until nothing is wrong; then back down
    // from the best point so far. At the origin floats are as fine as one likes.
    double reach = std::max(0.5 * grain, 0x1p-60 * radius);
    for (; reach > 0.0 && reach <= radius && gained < Score(0, high_enough); reach *= 2.0)
      attempt_around(start, reach);
    if (gained.first < 0) attempt(centre);
    for (double r = 0.5 * reach; r > 0.25 * grain && r > 0; r *= 0.5) {
      // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): attempt() moves `place`
      const Vector2 around = place;
      attempt_around(around, r);
    }
    move(v, place);
    return place != start;
  }

  template <typename Visit>
  void for_faces(VertexId v, const Visit& visit) const {
    for (const VertexId copy : copies_[v]) {
      for (const CornerId c : corners_[copy]) {
        const FaceId f = c / 3;
        const auto p = [&](int k) -> Vector2 { return points_.row(faces_(f, k)).transpose(); };
        visit(f, p(0), p(1), p(2));
      }
    }
  }

  // Mean of the neighbours and the largest distance to one, as v and what moves with it see them.
  std::pair<Vector2, double> star(VertexId v) const {
    Vector2 sum = Vector2::Zero();
    double radius = 0;
    int count = 0;
    for (const VertexId copy : copies_[v]) {
      for (const CornerId own : corners_[copy]) {
        for (const CornerId c : {next_corner(own), previous_corner(own)}) {
          const Vector2 offset = (points_.row(faces_.data()[c]) - points_.row(copy)).transpose();
          sum += copy == v ? offset : turned(offset, -rules_.turns[at(copy)]);
          radius = std::max(radius, offset.norm());
          ++count;
        }
      }
    }
    return {points_.row(v).transpose() + sum / std::max(count, 1), radius};
  }

  // How many faces are folded at v and boundary edges meet others, as a negative number; the lowest
  // height of a face, of which no more than `enough` counts, negative of one that is folded.
  Score score(VertexId v, double enough) const {
    Score sum{-conflicts(v), enough};
    for_faces(v, [&](FaceId, const Vector2& a, const Vector2& b, const Vector2& c) {
      const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm(), 1e-300});
      const double height = std::abs(twice_area(a, b, c)) / longest;
      const bool good = numeric::orientation(a, b, c) > 0;
      sum.second = std::min(sum.second, good ? height : -height);
      if (!good) --sum.first;
    });
    return sum;
  }

  // Boundary edges that those at v can meet while it is moved by no more than `reach` along an
  // axis.
  void find_near(VertexId v, double reach) {
    near_.clear();
    if (!rules_.bijective || edges_at_[v].empty()) return;
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
  int conflicts(VertexId v) const {
    if (near_.empty()) return 0;
    int count = 0;
    for (const Index e : edges_at_[v]) {
      for (const Index f : near_)
        if (f != e && edges_meet(boundary_.edges[at(e)], boundary_.edges[at(f)], points_)) ++count;
    }
    return count;
  }

  const Triangles& faces_;
  const PointRules& rules_;
  Points2& points_;
  const ExecutionContext& context_;
  Lists<CornerId> corners_;
  Lists<VertexId> copies_;    // by leader
  std::vector<char> marked_;  // vertices that the sweep may have moved
  std::vector<FaceId> bad_;
  double enough_ = kFirstHeight;
  Boundary boundary_;
  Lists<Index> edges_at_;
  std::vector<Index> near_;
};

[[noreturn]] void give_up(const PointRules& rules, const std::vector<FaceId>& bad,
                          const std::vector<VertexId>& seeds) {
  const std::string what = bad.empty() ? std::string("The boundary meets itself")
                                       : std::to_string(bad.size()) + " triangles flip or collapse";
  const ElementKind kind = bad.empty() ? ElementKind::kVertex : ElementKind::kFace;
  throw_not_converged(ErrorCode::kRoundingFlips, what + ", " + rules.where, kind,
                      first_elements(bad.empty() ? seeds : bad));
}

// Exact predicates know no infinity.
void require_finite(const Triangles& faces, const PointRules& rules, const Points2& points) {
  if (points.allFinite()) return;
  std::vector<FaceId> outside;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    bool finite = true;
    for (Index k = 0; k < 3; ++k) finite = finite && points.row(faces(f, k)).allFinite();
    if (!finite) outside.push_back(f);
  }
  give_up(rules, outside, {});
}

}  // namespace

void open_crowd(const Triangles& faces, const std::vector<char>& marked, std::vector<char> held,
                const PartSystem& system_of, Points2& uv, ExecutionContext& context) {
  std::vector<FaceId> chosen;
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    if (marked[at(faces(f, 0))] && marked[at(faces(f, 1))] && marked[at(faces(f, 2))]) {
      chosen.push_back(f);
    } else {
      for (int k = 0; k < 3; ++k) held[at(faces(f, k))] = 1;
    }
  }
  if (chosen.empty()) return;
  MinimizeOptions minimize;
  minimize.max_iterations = 60;
  minimize.tolerance = 1e-2;
  for (std::size_t v = 0; v < held.size(); ++v)
    if (held[v]) minimize.fixed.push_back(static_cast<VertexId>(v));
  const Triangles part = faces(chosen, Eigen::all);
  const auto system = system_of ? system_of(part, held) : nullptr;
  // Something keeps the place and the unit.
  if (!system && minimize.fixed.empty()) minimize.fixed.push_back(part(0, 0));
  uv = descend({part, equilateral_rest_shapes(chosen.size()), uv, system.get()}, minimize, context)
           .uv;
}

RepairedPoints round_and_repair(const Triangles& faces, const PointRules& rules, Points2& wide,
                                const RoundPoints& round, const OpenRegion& open,
                                const ExecutionContext& context) {
  RepairedPoints out;
  const Points2 nearest = round(wide);
  out.moved.assign(at(static_cast<Index>(wide.rows())), 0);
  out.points = nearest;
  require_finite(faces, rules, nearest);
  if (is_flip_free(faces, nearest, context) &&
      !(rules.bijective && overlaps_itself(faces, nearest, context)))
    return out;
  Repair repair(faces, rules, out.points, context);
  std::vector<VertexId> seeds = repair.faults();
  out.folded = static_cast<Index>(repair.bad_faces().size());
  std::vector<VertexId> left = repair.sweep(seeds);
  std::vector<char> region(out.moved.size(), 0);
  for (int rings = kFirstRings; !left.empty(); rings *= 2) {
    for (const VertexId v : seeds) region[at(v)] = 1;
    for (int r = 0; r < rings; ++r) grow(faces, rules.leader, region);
    // All that hangs together with the vertices at fault, which need not be the whole mesh.
    std::vector<char> wider = region;
    grow(faces, rules.leader, wider);
    const bool everything = wider == region;
    try {
      open(region, everything, wide);
    } catch (const NotConverged&) {
      give_up(rules, repair.bad_faces(), left);  // too small or too thin for doubles
    }
    out.points = round(wide);
    seeds = repair.faults();
    left = repair.sweep(seeds);
    if (!left.empty() && everything) give_up(rules, repair.bad_faces(), left);
  }
  // Loops as small as a grain can turn inside out without an edge that meets another.
  const Points2 mended = out.points;
  repair.settle(wide);
  if (!repair.faults().empty()) out.points = mended;
  for (Eigen::Index v = 0; v < wide.rows(); ++v)
    out.moved[at(v)] = out.points.row(v) != nearest.row(v) ? 1 : 0;
  return out;
}

bool repair_points(const Triangles& faces, const PointRules& rules, Points2& points,
                   const ExecutionContext& context) {
  Repair repair(faces, rules, points, context);
  return repair.sweep(repair.faults()).empty();
}

Points2f round_to_storage(const Triangles& faces, const Points2& uv, const RoundingOptions& options,
                          ExecutionContext& context, Stats& stats) {
  PointRules rules;
  rules.leader.resize(at(static_cast<Index>(uv.rows())));
  std::iota(rules.leader.begin(), rules.leader.end(), VertexId{0});
  for (const VertexId v : options.fixed) rules.leader[at(v)] = kInvalid;
  rules.bijective = options.bijective;
  rules.where =
      "when the map is rounded to the 32-bit values that are stored, and no 32-bit points near by "
      "avoid it. Cut the chart into smaller ones, or enlarge its smallest parts.";
  Points2 wide = uv;
  const RepairedPoints rounded = round_and_repair(
      faces, rules, wide, [](const Points2& map) { return as_stored(map); },
      [&](const std::vector<char>& marked, bool, Points2& map) {
        std::vector<char> held(marked.size(), 0);
        for (const VertexId v : options.fixed) held[at(v)] = 1;
        open_crowd(faces, marked, std::move(held), nullptr, map, context);
      },
      context);
  stats["rounding.repaired"] =
      std::int64_t{std::count(rounded.moved.begin(), rounded.moved.end(), char{1})};
  return rounded.points.cast<float>();
}

}  // namespace flipfree::distortion
