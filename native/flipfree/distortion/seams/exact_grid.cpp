#include "flipfree/distortion/seams/exact_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/distortion/minimize/minimizer.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/distortion/seams/seam_system.h"

namespace flipfree::distortion {

namespace {

using numeric::GaussianInteger;

constexpr int kFirstGridRings = 2;  // around the vertices at fault
// Room for what rounding and repairs move points by, in steps.
constexpr double kSlack = 256;

// The largest size of a coordinate.
double half_extent(const Points2& uv) { return uv.cwiseAbs().maxCoeff(); }

// Every component, as faces and seams join it, about the origin: what lies far off costs all of
// them digits.
Points2 centred(const Triangles& faces, const std::vector<SeamEdge>& seams, const Points2& uv,
                double unit = 0.0) {
  DisjointSets sets(static_cast<Index>(uv.rows()));
  for (FaceId f = 0; f < faces.rows(); ++f) {
    sets.join(faces(f, 0), faces(f, 1));
    sets.join(faces(f, 0), faces(f, 2));
  }
  for (const SeamEdge& seam : seams)
    sets.join(mesh::source(faces, seam.h), mesh::source(faces, seam.o));
  Points2 low = uv, high = uv;
  for (VertexId v = 0; v < uv.rows(); ++v) {
    const Index root = sets.find(v);
    low.row(root) = low.row(root).cwiseMin(uv.row(v));
    high.row(root) = high.row(root).cwiseMax(uv.row(v));
  }
  Points2 moved = uv;
  for (VertexId v = 0; v < uv.rows(); ++v) {
    const Index root = sets.find(v);
    Eigen::RowVector2d middle = 0.5 * (low.row(root) + high.row(root));
    if (unit > 0.0) middle = (middle / unit).array().round() * unit;
    moved.row(v) -= middle;
  }
  return moved;
}

double step_for(double extent) {
  const double numbers = static_cast<double>(kLargestGridNumber) - kSlack;
  // Floats have no finer numbers than their least.
  double step = std::max<double>(std::ldexp(1.0, std::ilogb(extent) - 24),
                                 std::numeric_limits<float>::denorm_min());
  while (extent > numbers * step) step *= 2;
  return step;
}

// Nodes rounded, vertices computed from them: no error anywhere.
GridPoints rounded_map(const SeamConstraints& constraints, const Points2& nodes, double step) {
  std::vector<GaussianInteger> whole(at(constraints.node_count()));
  for (Index n = 0; n < constraints.node_count(); ++n) {
    const std::int64_t unit = n < constraints.position_count() ? 1 : constraints.translation_step;
    const double scale = step * static_cast<double>(unit);
    whole[at(n)] = {unit * std::llround(nodes(n, 0) / scale),
                    unit * std::llround(nodes(n, 1) / scale)};
  }
  GridPoints points(static_cast<Eigen::Index>(constraints.divisor.size()), 2);
  for (std::size_t v = 0; v < constraints.divisor.size(); ++v) {
    GaussianInteger sum;
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
      const NodeTerm& term = constraints.terms[at(t)];
      sum = sum + term.factor * whole[at(term.node)];
    }
    const std::int64_t d = constraints.divisor[v];
    if (sum.re % d != 0 || sum.im % d != 0)
      throw InternalError("seams: a vertex is not on the grid of its nodes");
    points.row(static_cast<Eigen::Index>(v)) << sum.re / d, sum.im / d;
  }
  return points;
}

// Opens crowded triangles in 64 bits under the constraints: minimises the distortion of the region
// with respect to equilateral triangles of one size, its rim and all translations held.
void open_region(const SeamConstraints& constraints, const Triangles& faces,
                 const std::vector<VertexId>& region, Points2& uv, ExecutionContext& context) {
  std::vector<char> inside(at(static_cast<Index>(uv.rows())), 0);
  for (const VertexId v : region) inside[at(v)] = 1;
  std::vector<FaceId> chosen;
  std::vector<char> held(inside.size(), 0);
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    if (inside[at(faces(f, 0))] && inside[at(faces(f, 1))] && inside[at(faces(f, 2))]) {
      chosen.push_back(f);
      continue;
    }
    for (int k = 0; k < 3; ++k) held[at(faces(f, k))] = 1;
  }
  if (chosen.empty()) return;
  Triangles part(static_cast<Eigen::Index>(chosen.size()), 3);
  for (std::size_t i = 0; i < chosen.size(); ++i)
    part.row(static_cast<Eigen::Index>(i)) = faces.row(chosen[i]);
  MinimizeOptions minimize;
  minimize.max_iterations = 60;
  minimize.tolerance = 1e-2;
  for (std::size_t v = 0; v < held.size(); ++v) {
    if (held[v]) minimize.fixed.push_back(static_cast<VertexId>(v));
  }
  const double before = half_extent(uv);
  SeamSystem system(constraints, part, held, context);
  uv = Minimizer(part, equilateral_rest_shapes(chosen.size()), nullptr, uv, minimize, context,
                 &system)
           .run()
           .uv;
  // A map opened as a whole comes back in the unit of the equilateral triangles.
  if (minimize.fixed.empty()) {
    uv *= std::ldexp(1.0, static_cast<int>(std::lround(std::log2(before / half_extent(uv)))));
  }
}

[[noreturn]] void give_up(const std::vector<FaceId>& folded) {
  throw_not_converged(
      ErrorCode::kRoundingFlips,
      std::to_string(folded.size()) +
          " triangles flip or collapse when the seamless map is rounded to a grid that 32-bit "
          "values hold, and no grid points near by avoid it. Reduce the distortion: more cones, or "
          "fewer far apart.",
      ElementKind::kFace, first_elements(folded));
}

GridMap finish(const SeamConstraints& constraints, const Triangles& faces,
               const std::vector<SeamEdge>& seams, const GridPoints& points, double step) {
  GridMap map;
  map.step = step;
  map.uv = points.cast<double>() * step;
  map.transition.resize(static_cast<Eigen::Index>(seams.size()), 2);
  const auto corner = [&](CornerId c) -> GaussianInteger {
    const VertexId v = faces(c / 3, c % 3);
    return {points(v, 0), points(v, 1)};
  };
  std::vector<GaussianInteger> of_branch(seams.size());
  for (std::size_t e = 0; e < seams.size(); ++e) {
    const auto& [h, o, r] = seams[e];
    const GaussianInteger turn = numeric::quarter_turn(r);
    const GaussianInteger t = corner(next_corner(o)) + -(turn * corner(h));
    const GaussianInteger again = corner(o) + -(turn * corner(next_corner(h)));
    // The lowest edge of a branch stands for it, so that its translation is known here.
    const std::size_t branch = at(constraints.branch[e]);
    if (branch == e) of_branch[e] = t;
    if (!(t == again) || !(t == constraints.branch_unit[e] * of_branch[branch]))
      throw InternalError("seams: the sides of a seam edge do not match on the grid");
    map.transition.row(static_cast<Eigen::Index>(e)) << static_cast<double>(t.re) * step,
        static_cast<double>(t.im) * step;
  }
  return map;
}

constexpr int kMostGridSweeps = 8;    // over single points, before the region is opened as a whole
constexpr int kMostGridSettling = 4;  // rounds
constexpr std::int64_t kNearSteps = 2;  // steps around where it is in 64 bits
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::size_t kFaceGrain = 16384;

// Twice the signed area, exact.
std::int64_t twice_grid_area(const Triangles& faces, const GridPoints& points, FaceId f) {
  const auto* a = points.data() + 2 * static_cast<std::ptrdiff_t>(faces(f, 0));
  const auto* b = points.data() + 2 * static_cast<std::ptrdiff_t>(faces(f, 1));
  const auto* c = points.data() + 2 * static_cast<std::ptrdiff_t>(faces(f, 2));
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

}  // namespace

// Exact: the faces that are not positively oriented, ascending.
std::vector<FaceId> folded_faces(const Triangles& faces, const GridPoints& points,
                                 const ExecutionContext& context) {
  std::vector<FaceId> folded = indices_where(
      context, static_cast<std::size_t>(faces.rows()), kFaceGrain,
      [&](std::size_t f) { return twice_grid_area(faces, points, static_cast<FaceId>(f)) <= 0; });
  context.check();
  return folded;
}

GridMap round_to_grid(const SeamConstraints& constraints, const Triangles& faces,
                      const std::vector<SeamEdge>& seams, const Points2& uv,
                      ExecutionContext& context, Stats& stats, double unit,
                      const std::vector<char>& held) {
  Points2 wide = centred(faces, seams, uv, unit);
  double step = step_for(half_extent(wide));
  GridPoints points;
  GridPoints nearest;
  const auto round = [&] {
    const Points2 nodes = nodes_of(constraints, faces, seams, wide);
    for (step = step_for(half_extent(wide));; step *= 2) {
      points = rounded_map(constraints, nodes, step);
      if (points.cwiseAbs().maxCoeff() <= kLargestGridNumber) break;
    }
    nearest = points;
  };
  round();
  std::vector<FaceId> folded = folded_faces(faces, points, context);
  stats["rounding.folded"] = static_cast<std::int64_t>(folded.size());
  std::int64_t opened = 0;
  if (!folded.empty()) {
    GridRepair repair(constraints, faces, points, held, context);
    std::vector<VertexId> region;
    folded = repair.sweep(folded);
    for (int rings = kFirstGridRings; !folded.empty(); rings *= 2) {
      for (const FaceId f : folded) {
        for (int k = 0; k < 3; ++k) region.push_back(faces(f, k));
      }
      for (int r = 0; r < rings; ++r) region = repair.grow(region);
      const bool everything = repair.grow(region).size() == region.size();
      if (everything && unit > 0.0) give_up(std::move(folded));  // opened, it has another scale
      ++opened;
      try {
        open_region(constraints, faces, region, wide, context);
      } catch (const NotConverged&) {
        give_up(std::move(folded));  // too small or too thin for doubles, let alone the grid
      }
      wide = centred(faces, seams, wide, unit);
      round();
      folded = repair.sweep(folded_faces(faces, points, context));
      if (!folded.empty() && everything) give_up(std::move(folded));
    }
    repair.settle(wide / step);
  }
  std::int64_t moved = 0;
  for (const VertexId v : constraints.position) moved += points.row(v) != nearest.row(v) ? 1 : 0;
  stats["rounding.repaired"] = moved;
  stats["rounding.opened"] = opened;
  stats["rounding.step"] = step;
  return finish(constraints, faces, seams, points, step);
}

std::optional<Points2> unfold_on_grid(const SeamConstraints& constraints, const Triangles& faces,
                                      const std::vector<SeamEdge>& seams, const Points2& uv,
                                      std::size_t most, ExecutionContext& context) {
  const Points2 wide = centred(faces, seams, uv);
  const Points2 nodes = nodes_of(constraints, faces, seams, wide);
  GridPoints points;
  double step = step_for(half_extent(wide));
  for (;; step *= 2) {
    points = rounded_map(constraints, nodes, step);
    if (points.cwiseAbs().maxCoeff() <= kLargestGridNumber) break;
  }
  std::vector<FaceId> folded = folded_faces(faces, points, context);
  if (folded.size() > most) return std::nullopt;
  if (!folded.empty()) folded = GridRepair(constraints, faces, points, {}, context).sweep(folded);
  if (!folded.empty()) return std::nullopt;
  return Points2(points.cast<double>() * step);
}

GridRepair::GridRepair(const SeamConstraints& constraints, const Triangles& faces,
                       GridPoints& points, const std::vector<char>& held,
                       const ExecutionContext& context)
    : real_(constraints.real),
      faces_(faces),
      held_(held),
      points_(points),
      context_(context),
      node_of_(constraints.divisor.size(), kInvalid),
      corners_(corners_by_vertex(node_of_.size(), faces)) {
  copies_ = Lists<Copy>(constraints.position.size(), [&](const auto& add) {
    for (std::size_t v = 0; v < node_of_.size(); ++v) {
      for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
        const NodeTerm& term = constraints.terms[at(t)];
        if (term.node >= constraints.position_count()) continue;
        node_of_[v] = term.node;
        // The factor is a unit times the divisor.
        const Index turns = term.factor.re > 0   ? 0
                            : term.factor.im > 0 ? 1
                            : term.factor.re < 0 ? 2
                                                 : 3;
        add(term.node, Copy{static_cast<VertexId>(v), turns});
      }
    }
  });
}

std::vector<Index> GridRepair::nodes_of_faces(const std::vector<FaceId>& chosen) const {
  std::vector<Index> nodes;
  for (const FaceId f : chosen) {
    for (int k = 0; k < 3; ++k) {
      const Index node = node_of_[at(faces_(f, k))];
      if (node != kInvalid) nodes.push_back(node);
    }
  }
  sort_unique(nodes);
  return nodes;
}

std::vector<Index> GridRepair::grown(const std::vector<Index>& nodes) const {
  std::vector<FaceId> around;
  for (const Index n : nodes) {
    for (const Copy& copy : copies_[n]) {
      for (const CornerId c : corners_[copy.vertex]) around.push_back(c / 3);
    }
  }
  std::vector<Index> wider = nodes_of_faces(around);
  wider.insert(wider.end(), nodes.begin(), nodes.end());
  sort_unique(wider);
  return wider;
}

std::vector<VertexId> GridRepair::grow(const std::vector<VertexId>& region) const {
  std::vector<VertexId> wider = region;
  for (const VertexId v : region) {
    for (const CornerId c : corners_[v]) {
      for (int k = 0; k < 3; ++k) wider.push_back(faces_(c / 3, k));
    }
  }
  sort_unique(wider);
  const std::size_t reached = wider.size();
  for (std::size_t i = 0; i < reached; ++i) {
    const Index node = node_of_[at(wider[i])];
    if (node == kInvalid) continue;
    for (const Copy& copy : copies_[node]) wider.push_back(copy.vertex);
  }
  sort_unique(wider);
  return wider;
}

std::vector<FaceId> GridRepair::sweep(std::vector<FaceId> folded) {
  std::vector<Index>& region = region_;
  region = nodes_of_faces(folded);
  for (int round = 0; !folded.empty() && round < kMostGridSweeps; ++round) {
    enough_ = std::ldexp(1.0, round);
    bool any = false;
    for (std::size_t i = 0; i < region.size(); ++i) {
      if (i % 64 == 0) context_.check();
      any = improve(region[i]) || any;
    }
    folded = folded_faces(faces_, points_, context_);
    const std::size_t before = region.size();
    const std::vector<Index> seeds = nodes_of_faces(folded);
    region.insert(region.end(), seeds.begin(), seeds.end());
    sort_unique(region);
    if (!any || round % 2 == 1) region = grown(region);
    if (!any && region.size() == before && round > 3) break;
  }
  return folded;
}

void GridRepair::shift(Index node, std::int64_t x, std::int64_t y) {
  for (const auto& [v, turns] : copies_[node]) {
    const numeric::GaussianInteger by =
        numeric::quarter_turn(turns) * numeric::GaussianInteger{x, y};
    points_(v, 0) += by.re;
    points_(v, 1) += by.im;
  }
}

bool GridRepair::within(Index node) const {
  return std::ranges::all_of(copies_[node], [&](const Copy& copy) {
    return points_.row(copy.vertex).cwiseAbs().maxCoeff() <= kLargestGridNumber;
  });
}

// Tries other grid points for the node; true if it moved.
bool GridRepair::improve(Index node) {
  if (is_held(node)) return false;
  // Mean of the neighbours and the largest distance to one, seen from the node's own copy.
  Vector2 sum = Vector2::Zero();
  double radius = 0;
  int count = 0;
  for (const auto& [v, turns] : copies_[node]) {
    for (const CornerId c : corners_[v]) {
      for (const CornerId other : {next_corner(c), previous_corner(c)}) {
        const VertexId w = faces_.data()[other];
        const auto by =
            numeric::quarter_turn(-turns) *
            numeric::GaussianInteger{points_(w, 0) - points_(v, 0), points_(w, 1) - points_(v, 1)};
        const Vector2 offset(static_cast<double>(by.re), static_cast<double>(by.im));
        sum += offset;
        radius = std::max(radius, offset.norm());
        ++count;
      }
    }
  }
  if (count == 0) return false;
  double best = score(node);
  if (best >= enough_) return false;
  const bool real = real_[at(node)] != 0;
  std::int64_t moved[2] = {0, 0};
  const auto attempt = [&](double x, double y) {
    const std::int64_t to[2] = {std::llround(x), real ? 0 : std::llround(y)};
    const std::int64_t by[2] = {to[0] - moved[0], to[1] - moved[1]};
    if (by[0] == 0 && by[1] == 0) return;
    shift(node, by[0], by[1]);
    const double s = within(node) ? score(node) : -std::numeric_limits<double>::infinity();
    if (s > best) {
      best = s;
      std::copy(to, to + 2, moved);
    } else {
      shift(node, -by[0], -by[1]);
    }
  };
  const auto around = [&](double x, double y, double r) {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        if ((dx != 0 || dy != 0) && best < enough_) attempt(x + r * dx, y + r * dy);
      }
    }
  };
  // Near by first: what is far distorts.
  for (double r = 1; r <= radius && best < enough_; r *= 2) around(0, 0, r);
  // Pattern search from the star's size down to single steps, from the best point so far.
  if (best < enough_) attempt(sum.x() / count, sum.y() / count);
  for (double r = radius; r >= 0.5 && best < enough_; r *= 0.5)
    around(static_cast<double>(moved[0]), static_cast<double>(moved[1]), r);
  return moved[0] != 0 || moved[1] != 0;
}

void GridRepair::settle(const Points2& wide) {
  const std::vector<Index> region = grown(region_);
  bool any = true;
  for (int round = 0; any && round < kMostGridSettling; ++round) {
    any = false;
    for (std::size_t i = 0; i < region.size(); ++i) {
      if (i % 64 == 0) context_.check();
      any = settle(region[i], wide) || any;
    }
  }
}

// Of the places around where it is in 64 bits, and its own, the best; true if it moved.
bool GridRepair::settle(Index node, const Points2& wide) {
  if (is_held(node)) return false;
  using numeric::GaussianInteger;
  const VertexId v = copies_[node][0].vertex;
  const Index turns = copies_[node][0].turns;
  double least = distortion(node, wide);
  bool moved = false;
  for (std::int64_t x = -kNearSteps; x <= kNearSteps; ++x) {
    for (std::int64_t y = -kNearSteps; y <= kNearSteps; ++y) {
      const GaussianInteger own{std::llround(wide(v, 0)) + x - points_(v, 0),
                                std::llround(wide(v, 1)) + y - points_(v, 1)};
      GaussianInteger by = numeric::quarter_turn(-turns) * own;
      if (real_[at(node)] != 0) by.im = 0;
      shift(node, by.re, by.im);
      const double now = within(node) ? distortion(node, wide) : kNever;
      if (now < least) {
        least = now;
        moved = true;
      } else {
        shift(node, -by.re, -by.im);
      }
    }
  }
  return moved;
}

// Symmetric Dirichlet energy, times area, of the faces around the node as a map from `wide`;
// infinite if one is folded.
double GridRepair::distortion(Index node, const Points2& wide) const {
  double sum = 0;
  for (const Copy& copy : copies_[node]) {
    for (const CornerId c : corners_[copy.vertex]) {
      const FaceId f = c / 3;
      sum += distortion_between(faces_, f, wide, points_,
                                static_cast<double>(twice_grid_area(faces_, points_, f)));
    }
  }
  return sum;
}

// Lowest height of a triangle around the node, signed; the number of folded ones counts first.
double GridRepair::score(Index node) const {
  double lowest = std::numeric_limits<double>::infinity();
  double folded = 0;
  for (const Copy& copy : copies_[node]) {
    for (const CornerId c : corners_[copy.vertex]) {
      const FaceId f = c / 3;
      const std::int64_t area = twice_grid_area(faces_, points_, f);
      double longest = 1;
      for (int k = 0; k < 3; ++k) {
        const Eigen::RowVector2d edge =
            (points_.row(faces_(f, (k + 1) % 3)) - points_.row(faces_(f, k))).cast<double>();
        longest = std::max(longest, edge.norm());
      }
      lowest = std::min(lowest, static_cast<double>(area) / longest);
      if (area <= 0) folded += 1;
    }
  }
  return std::min(lowest, enough_) - 2.0 * static_cast<double>(kLargestGridNumber) * folded;
}

}  // namespace flipfree::distortion
