#include "flipfree/seamless/request.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/conformal/boundary_angles.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::seamless {

namespace {

// No cone has less than one quarter turn.
[[noreturn]] void throw_too_sharp(VertexId v, Index quarter_turns) {
  throw_invalid(ErrorCode::kBadAngles,
                "The cone at vertex " + vertex_id(v) + " has " + std::to_string(quarter_turns) +
                    " quarter turns. Give every cone at least 1 (4 is flat inside, 2 is straight "
                    "at the boundary).",
                ElementKind::kVertex, {v});
}

// `what` sum, `but` needed; `whose` quarter turns k are to be others.
[[noreturn]] void throw_angle_sum(const std::string& what, std::int64_t sum, const std::string& but,
                                  std::int64_t needed, const std::string& whose) {
  throw_infeasible(ErrorCode::kGaussBonnet,
                   what + std::to_string(sum) + but + std::to_string(needed) + " (Gauss-Bonnet). " +
                       (sum > needed ? "Add " + std::to_string(sum - needed) + " to"
                                     : "Take " + std::to_string(needed - sum) + " from") +
                       " the sum of the " + whose + "quarter turns k.",
                   {"angle sum",
                    {{"sum", {static_cast<double>(sum) * kQuarterTurn}},
                     {"needed", {static_cast<double>(needed) * kQuarterTurn}}}});
}

constexpr double kInfinite = std::numeric_limits<double>::infinity();
// Directions of the axes that are tried, per quarter turn.
constexpr Index kAxes = 16;
// What a corner costs that stands where the curve does not turn: twice this share of the curve off
// by a quarter turn. Waves that are shorter are ridden over.
constexpr double kCornerShare = 0.01;
// Directions of an edge that are tried: so many quarter turns to either side of the nearest one,
// more if none of these leads around.
constexpr Index kReach = 3;

// Vertices between two looks at the clock.
constexpr Index kCheckVertices = 1024;

// A curve of a boundary, surface on the left; edge i leads from its vertex i to the next one.
struct BorderCurve {
  std::vector<double> direction;  // of the edges, quarter turns from an axis
  std::vector<double> turning;    // at vertex i, from edge i - 1 to edge i
  std::vector<double> length;     // of the edges; the sum is 1
  double whole = 0.0;             // length of the curve
  Index wanted = 0;               // quarter turns to the left, in all
  Index least = 0;                // most negative turn at a vertex that is tried
};

struct Labels {
  double cost = kInfinite;
  std::vector<Index> of_edge;
};

double corner_cost(double turning, Index turn) {
  if (turn == 0) return 0.0;
  const double wrong = std::abs(turning - turn) - std::abs(turning);
  return kCornerShare * (std::abs(static_cast<double>(turn)) + wrong);
}

// The cheapest directions of the edges for one direction of the axes, of which `reach` to either
// side of the nearest one are tried; edge 0 has the `first` of these. None if there is no way
// around.
Labels cheapest_from(const BorderCurve& curve, double axis, Index reach, Index first,
                     ExecutionContext& context) {
  const auto n = static_cast<Index>(curve.length.size());
  const Index width = 2 * reach + 1;
  // The directions in the middle of those that are tried; the last one is edge 0 after one way
  // around.
  std::vector<Index> middle;
  for (const double d : curve.direction)
    middle.push_back(static_cast<Index>(std::lround(d - axis)));
  middle.push_back(middle.front() + curve.wanted);
  const auto edge_cost = [&](Index i, Index label) {
    const double off = curve.direction[at(i)] - axis - (middle[at(i)] + label - reach);
    return curve.length[at(i)] * off * off;
  };
  // Per vertex and label after it: the label before it.
  std::vector<Index> from(at(width) * at(n + 1), kInvalid);
  std::vector<double> cost(at(width), kInfinite), next(at(width));
  cost[at(first)] = edge_cost(0, first);
  for (Index i = 1; i <= n; ++i) {
    if (i % kCheckVertices == 0) context.check();
    std::fill(next.begin(), next.end(), kInfinite);
    const Index rise = middle[at(i)] - middle[at(i - 1)];
    const double turning = curve.turning[at(i % n)];
    for (Index turn = curve.least; turn <= 1; ++turn) {
      const double corner = corner_cost(turning, turn);
      for (Index a = 0; a < width; ++a) {
        const Index b = a + turn - rise;
        if (b < 0 || b >= width || cost[at(a)] + corner >= next[at(b)]) continue;
        next[at(b)] = cost[at(a)] + corner;
        from[at(width) * at(i) + at(b)] = a;
      }
    }
    for (Index b = 0; i < n && b < width; ++b) next[at(b)] += edge_cost(i, b);
    std::swap(cost, next);
  }
  if (cost[at(first)] == kInfinite) return {};
  Labels found{cost[at(first)], middle};
  for (Index i = n, label = first; i >= 0; --i) {
    found.of_edge[at(i)] += label - reach;
    label = from[at(width) * at(i) + at(label)];
  }
  return found;
}

Labels cheapest(const BorderCurve& curve, double axis, ExecutionContext& context) {
  const Index most = curve.wanted + static_cast<Index>(curve.length.size());
  for (Index reach = kReach;; reach *= 2) {
    Labels best;
    for (Index first = reach - 1; first <= reach + 1; ++first) {
      Labels found = cheapest_from(curve, axis, reach, first, context);
      if (found.cost < best.cost) best = std::move(found);
    }
    context.check();
    if (best.cost < kInfinite || reach > 4 * std::abs(most)) return best;
  }
}

// Of curves together, for the direction of the axes that is best for all: per curve the quarter
// turns k of the angles at its vertices, 1 or more; the sum of 2 - k is what is wanted. Cost:
// linear, about a thousand steps a vertex.
std::vector<std::vector<Index>> choose_corners(std::span<const BorderCurve> curves,
                                               ExecutionContext& context) {
  std::vector<Labels> best;
  double least = kInfinite;
  for (Index axis = 0; axis < kAxes; ++axis) {
    std::vector<Labels> labels;
    double cost = 0.0;
    for (const BorderCurve& curve : curves) {
      labels.push_back(cheapest(curve, static_cast<double>(axis) / kAxes, context));
      cost += curve.whole * labels.back().cost;
    }
    if (!best.empty() && cost >= least) continue;
    best = std::move(labels);
    least = cost;
  }
  std::vector<std::vector<Index>> angles;
  for (const Labels& labels : best) {
    std::vector<Index>& k = angles.emplace_back();
    const std::size_t n = labels.of_edge.size() - 1;
    for (std::size_t i = 0; i < n; ++i)
      k.push_back(2 - (labels.of_edge[i == 0 ? n : i] - labels.of_edge[i == 0 ? n - 1 : i - 1]));
  }
  return angles;
}

// Sum of the curvatures inside a surface that is as good as flat, quarter turns.
constexpr double kNearlyFlat = 0.2;

bool on_border(const mesh::Surface& surface, VertexId v) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  return adjacency.opposite[at(adjacency.vertex_halfedge[at(v)])] == kInvalid;
}

// What the boundary has to turn in all, quarter turns: 4 chi less the curvature inside.
Index needed_turning(const mesh::Surface& surface, const std::vector<Index>& cones) {
  Index needed = 4 * mesh::topology(surface.faces, surface.adjacency()).euler();
  for (VertexId v = 0; at(v) < cones.size(); ++v) {
    if (on_border(surface, v)) continue;
    if (cones[at(v)] < 1) throw_too_sharp(v, cones[at(v)]);
    needed -= 4 - cones[at(v)];
  }
  return needed;
}

// Quarter turns.
double corner_angle(const mesh::Surface& surface, CornerId c) {
  const auto [a, b] = mesh::sides_at(surface, c);
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kQuarterTurn;
}

// Total angles of the surface at its vertices, quarter turns.
std::vector<double> own_angles(const mesh::Surface& surface) {
  std::vector<double> angle(at(surface.vertices.rows()), 0.0);
  for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c)
    angle[at(surface.faces(c / 3, c % 3))] += corner_angle(surface, c);
  return angle;
}

// Whole numbers near to the given ones with a given sum.
std::vector<Index> whole_with_sum(const std::vector<double>& values, Index sum) {
  std::vector<Index> whole;
  for (const double x : values) whole.push_back(static_cast<Index>(std::lround(x)));
  Index missing = sum - std::accumulate(whole.begin(), whole.end(), Index{0});
  const Index step = missing < 0 ? -1 : 1;
  for (; missing != 0; missing -= step) {
    std::size_t best = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < whole.size(); ++i) {
      const double lacks = step * (values[i] - whole[i]);
      if (lacks > most) {
        most = lacks;
        best = i;
      }
    }
    whole[best] += step;
  }
  return whole;
}

// Directions of the half-edges of a connected surface, quarter turns: unfolded face after face, so
// that where it is flat they are those in the plane.
std::vector<double> unfolded_directions(const mesh::Surface& surface) {
  std::vector<double> direction(at(surface.faces.size()), 0.0);
  const auto unfold = [&](HalfedgeId h) {
    for (int k = 0; k < 2; ++k, h = next_corner(h)) {
      const HalfedgeId next = next_corner(h);
      direction[at(next)] = direction[at(h)] + (2.0 - corner_angle(surface, next));
    }
  };
  unfold(0);
  mesh::for_each_face_across(
      surface.adjacency(), [](HalfedgeId, HalfedgeId) { return true; },
      [&](HalfedgeId h, HalfedgeId o) {
        direction[at(o)] = direction[at(h)] + 2.0;
        unfold(o);
      });
  return direction;
}

// Is the surface so flat inside that one unfolding of it is like another, and is its map to be?
bool is_flat_inside(const mesh::Surface& surface, const std::vector<double>& angles,
                    const std::vector<Index>& cones) {
  double curved = 0.0;
  for (VertexId v = 0; at(v) < cones.size(); ++v) {
    if (on_border(surface, v)) continue;
    if (cones[at(v)] != 4) return false;
    curved += std::abs(4.0 - angles[at(v)]);
  }
  return curved < kNearlyFlat;
}

// Curves of the boundary, as bent as they are but for what each lacks of the turning that is
// wanted, which is spread along it.
std::vector<BorderCurve> border_curves(const mesh::Surface& surface,
                                       const std::vector<double>& angles,
                                       const std::vector<Index>& wanted) {
  const std::vector<double> direction = unfolded_directions(surface);
  std::vector<BorderCurve> curves;
  for (const auto& loop : mesh::boundary_halfedge_loops(surface.faces, surface.adjacency())) {
    BorderCurve curve;
    curve.wanted = wanted[curves.size()];
    const std::size_t n = loop.size();
    for (const HalfedgeId h : loop) {
      const VertexId from = mesh::source(surface.faces, h), to = mesh::target(surface.faces, h);
      curve.length.push_back((surface.vertices.row(from) - surface.vertices.row(to)).stableNorm());
      curve.turning.push_back(2.0 - angles[at(from)]);
    }
    curve.whole = std::accumulate(curve.length.begin(), curve.length.end(), 0.0);
    const double lacking = static_cast<double>(curve.wanted) -
                           std::accumulate(curve.turning.begin(), curve.turning.end(), 0.0);
    for (double& length : curve.length) length /= curve.whole;
    double least = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      curve.turning[i] += 0.5 * (curve.length[(i + n - 1) % n] + curve.length[i]) * lacking;
      curve.direction.push_back(i == 0 ? direction[at(loop.front())]
                                       : curve.direction.back() + curve.turning[i]);
      least = std::min(least, std::floor(curve.turning[i]));
    }
    curve.least = static_cast<Index>(least) - 1;
    curves.push_back(std::move(curve));
  }
  return curves;
}

[[noreturn]] void throw_sum(Index sum, Index needed) {
  throw_angle_sum("The corners at the boundary turn by ", sum,
                  " quarter turns (2 - k each), but the surface and its cones need ", needed, "");
}

[[noreturn]] void throw_too_few(std::size_t vertices, Index wanted) {
  throw_infeasible(ErrorCode::kGaussBonnet,
                   "A boundary of " + std::to_string(vertices) + " vertices cannot turn by " +
                       std::to_string(wanted) +
                       " quarter turns: a corner turns by one. Subdivide its edges, or add cones "
                       "of 3 quarter turns inside.",
                   {"corner turning",
                    {{"vertices", {static_cast<double>(vertices)}},
                     {"turning", {static_cast<double>(wanted) * kQuarterTurn}}}});
}

}  // namespace

std::vector<Index> flat_inside(std::vector<Index> cones, const mesh::Surface& surface) {
  for (VertexId v = 0; at(v) < cones.size(); ++v) {
    if (cones[at(v)] == kNotGiven && !on_border(surface, v)) cones[at(v)] = 4;
  }
  return cones;
}

std::vector<Index> aligned_cones(const mesh::Surface& surface, const std::vector<Index>& cones,
                                 ExecutionContext& context) {
  const auto loops = mesh::boundary_loops(surface.faces, surface.adjacency());
  if (loops.empty()) return cones;
  const Index needed = needed_turning(surface, cones);
  std::vector<Index> all = cones;
  Index sum = 0;
  bool any = false;
  for (VertexId v = 0; at(v) < cones.size(); ++v) {
    if (!on_border(surface, v)) continue;
    if (cones[at(v)] < kNotGiven) throw_too_sharp(v, cones[at(v)]);
    any = any || cones[at(v)] != kNotGiven;
    if (cones[at(v)] == kNotGiven) all[at(v)] = 2;
    sum += 2 - all[at(v)];
  }
  if (any) {
    if (sum != needed) throw_sum(sum, needed);
    return all;
  }
  const mesh::InOwnUnit own(surface);
  const std::vector<double> angles = own_angles(own.surface());
  std::vector<double> turning;
  for (const auto& loop : loops) {
    turning.push_back(0.0);
    for (const VertexId v : loop) turning.back() += 2.0 - angles[at(v)];
  }
  const std::vector<Index> wanted = whole_with_sum(turning, needed);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i] > static_cast<Index>(loops[i].size())) throw_too_few(loops[i].size(), wanted[i]);
  }
  const std::vector<BorderCurve> curves = border_curves(own.surface(), angles, wanted);
  // Where it is flat, the axes of one curve are those of all.
  const std::size_t together = is_flat_inside(surface, angles, cones) ? curves.size() : 1;
  for (std::size_t i = 0; i < curves.size(); i += together) {
    const auto corners = choose_corners(std::span(curves).subspan(i, together), context);
    for (std::size_t c = 0; c < together; ++c) {
      for (std::size_t j = 0; j < corners[c].size(); ++j) all[at(loops[i + c][j])] = corners[c][j];
    }
  }
  return all;
}

std::vector<std::pair<VertexId, double>> prescribed_angles(const std::vector<Index>& cones,
                                                           const mesh::Surface& surface,
                                                           bool aligned) {
  std::vector<std::pair<VertexId, double>> angles;
  for (VertexId v = 0; at(v) < cones.size(); ++v) {
    const Index k = cones[at(v)];
    if (on_border(surface, v) ? aligned && k != kNotGiven : k != 4)
      angles.emplace_back(v, k * kQuarterTurn);
  }
  return angles;
}

void check_free(const mesh::Surface& surface, const std::vector<Index>& cones) {
  for (VertexId v = 0; at(v) < cones.size(); ++v) {
    if (!on_border(surface, v) || cones[at(v)] == kNotGiven) continue;
    throw_invalid(ErrorCode::kBadAngles,
                  "Vertex " + vertex_id(v) +
                      " lies on the boundary, which is free: its angle cannot be given. Leave "
                      "it out, or take the aligned boundary.",
                  ElementKind::kVertex, {v});
  }
}

std::vector<double> free_angles(const mesh::Surface& surface, const std::vector<Index>& cones,
                                Boundary boundary, ExecutionContext& context) {
  if (boundary == Boundary::kFree) check_free(surface, cones);
  const auto loops = mesh::boundary_loops(surface.faces, surface.adjacency());
  const Index needed = needed_turning(surface, cones);
  conformal::BoundaryAnglesOptions options;
  options.boundary = conformal::BoundaryGoal::kFree;
  options.cones = prescribed_angles(cones, surface, false);
  std::vector<double> angles = conformal::boundary_angles(surface, options, context);
  std::vector<double> sum, turning;
  std::vector<Index> wanted;
  for (const auto& loop : loops) {
    sum.push_back(0.0);
    wanted.push_back(0);
    for (const VertexId v : loop) {
      sum.back() += angles[at(v)];
      wanted.back() += 2 - cones[at(v)];
    }
    turning.push_back(2.0 * static_cast<double>(loop.size()) - sum.back() / kQuarterTurn);
  }
  if (boundary != Boundary::kTurning) wanted = whole_with_sum(turning, needed);
  const Index all = std::accumulate(wanted.begin(), wanted.end(), Index{0});
  if (all != needed) throw_sum(all, needed);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const double whole = (2.0 * static_cast<double>(loops[i].size()) - wanted[i]) * kQuarterTurn;
    for (const VertexId v : loops[i]) angles[at(v)] *= whole / sum[i];
  }
  return angles;
}

namespace {

bool all_divided_by(Index m, const std::vector<Index>& turns) {
  return std::all_of(turns.begin(), turns.end(), [&](Index t) { return t % m == 0; });
}

}  // namespace

std::vector<Index> cone_list(const std::vector<Index>& cones) {
  std::vector<Index> list;
  for (const Index k : cones) {
    if (k != 4) list.push_back(k);
  }
  std::sort(list.begin(), list.end());
  return list;
}

void check_cones(const std::vector<Index>& cones, Index genus) {
  std::int64_t sum = 0;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] < 1) throw_too_sharp(static_cast<VertexId>(v), cones[v]);
    sum += 4 - cones[v];
  }
  const std::int64_t needed = 8 - 8 * std::int64_t{genus};
  if (sum != needed)
    throw_angle_sum(
        "The cones' curvatures 4 - k sum to ", sum,
        " quarter turns, but a closed surface of genus " + std::to_string(genus) + " needs ",
        needed, "cones' ");
  // Loops may turn as they need to: only what no loops help is refused here.
  if (genus == 1) near_turns(cones, 1, {0.0, 0.0}, Eigen::Matrix2d::Identity());
}

std::string why_impossible(const std::vector<Index>& cones, Index genus,
                           const std::vector<Index>& loop_turns) {
  const std::vector<Index> list = cone_list(cones);
  if (genus == 1 && list.empty()) {
    const bool none =
        std::all_of(loop_turns.begin(), loop_turns.end(), [](Index t) { return t == 0; });
    return none ? "" : "On a torus without cones no loop can turn.";
  }
  if (genus == 1 && list.size() == 2) {
    const Index m = list[1] - 4;
    if (!all_divided_by(m, loop_turns)) return "";
    if (m == 1) return "A torus cannot have the cones 3 and 5 alone.";
    return "A torus with the cones " + std::to_string(list[0]) + " and " + std::to_string(list[1]) +
           " alone has a loop whose quarter turns " + std::to_string(m) + " does not divide.";
  }
  if (genus == 2 && list == std::vector<Index>{12}) {
    if (!all_divided_by(2, loop_turns) || all_divided_by(4, loop_turns)) return "";
    return "A surface of genus 2 with one cone of 12 quarter turns cannot have loops that all turn "
           "by half turns.";
  }
  if (genus == 2 && list == std::vector<Index>{6, 10} && all_divided_by(2, loop_turns)) {
    return "A surface of genus 2 with the cones 6 and 10 cannot have loops that all turn by half "
           "turns.";
  }
  return "";
}

std::optional<std::vector<Index>> near_turns(
    const std::vector<double>& angles, const Eigen::MatrixXd& norm,
    const std::function<std::string(const std::vector<Index>&)>& why) {
  const auto count = static_cast<Eigen::Index>(angles.size());
  Eigen::MatrixXd own = norm.selfadjointView<Eigen::Lower>();
  if (!own.allFinite() || Eigen::LLT<Eigen::MatrixXd>(own).info() != Eigen::Success)
    own.setIdentity();
  const Eigen::VectorXd given =
      Eigen::Map<const Eigen::VectorXd>(angles.data(), count) / kQuarterTurn;
  // Each from the last on is the nearest to what those behind it leave (Babai 1986).
  const Eigen::MatrixXd upper = Eigen::LLT<Eigen::MatrixXd>(own).matrixU();
  Eigen::VectorXd numbers(count), off = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = count; i-- > 0;) {
    numbers[i] = std::round(given[i] - upper.row(i).dot(off) / upper(i, i));
    off[i] = numbers[i] - given[i];
  }
  const Eigen::VectorXd slope = 2.0 * (own * off);
  // By what it costs to change one number by one, the cheaper way.
  std::vector<Eigen::Index> order(angles.size());
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const auto cost = [&](Eigen::Index i) { return own(i, i) - std::abs(slope[i]); };
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return cost(a) < cost(b); });
  for (std::size_t i = 0; i <= order.size(); ++i) {
    std::vector<Index> turns;
    for (const double x : numbers) turns.push_back(static_cast<Index>(x));
    if (i > 0) turns[at(order[i - 1])] += slope[order[i - 1]] > 0.0 ? -1 : 1;
    if (why(turns).empty()) return turns;
  }
  return std::nullopt;
}

std::vector<Index> near_turns(const std::vector<Index>& cones, Index genus,
                              const std::vector<double>& angles, const Eigen::MatrixXd& norm) {
  std::vector<Index> any;
  const auto found = near_turns(angles, norm, [&](const std::vector<Index>& turns) {
    if (any.empty()) any = turns;
    return why_impossible(cones, genus, turns);
  });
  if (!found) {
    const std::string why = why_impossible(cones, genus, any);
    Witness witness{"empty stratum", {{"genus", {static_cast<double>(genus)}}, {"cones", {}}}};
    for (const Index k : cone_list(cones)) witness.numbers[1].second.push_back(k);
    throw_infeasible(ErrorCode::kBadAngles, why + " Move one of the cones' angles to a third one.",
                     std::move(witness));
  }
  return *found;
}

namespace {

constexpr std::size_t kMostNamed = 1000;

// The same error with the place of the part.
[[noreturn]] void throw_of_part(const Error& error, const SurfacePart& part, bool only_one) {
  std::vector<Index> places;
  for (std::size_t i = 0; i < part.vertices.size() && places.size() < kMostNamed; ++i) {
    if (part.cones[i] != 4) places.push_back(part.vertices[i]);
  }
  ElementKind kind = ElementKind::kVertex;
  if (places.empty()) {
    kind = ElementKind::kFace;
    for (std::size_t i = 0; i < part.faces.size() && i < kMostNamed; ++i)
      places.push_back(part.faces[i]);
  }
  const std::string where = only_one ? ""
                                     : "The part of face " + face_id(part.faces.front()) + " (" +
                                           std::to_string(part.faces.size()) + " faces): ";
  throw_infeasible(error.code, where + error.message, error.witness, kind, std::move(places));
}

}  // namespace

void check_surface(const mesh::Surface& surface, ExecutionContext& context) {
  mesh::ValidateOptions rules;
  rules.allow_isolated_vertices = false;
  mesh::validate(surface, rules, context);
}

std::vector<SurfacePart> connected_parts(const mesh::Surface& surface,
                                         const std::vector<Index>& cones) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::CutMesh whole =
      mesh::cut_along(surface.faces, adjacency, mesh::EdgeFlags(adjacency.opposite.size(), 0));
  std::vector<SurfacePart> parts;
  for (mesh::Chart& chart : mesh::split_into_charts(surface.vertices, whole)) {
    SurfacePart& part = parts.emplace_back(SurfacePart{std::move(chart), {}});
    for (VertexId& v : part.vertices) {
      v = whole.vertex_origin[at(v)];
      part.cones.push_back(cones[at(v)]);
      if (!on_border(surface, v)) continue;
      part.bordered = true;
      part.corners_given = part.corners_given || cones[at(v)] != kNotGiven;
    }
  }
  return parts;
}

std::vector<VertexId> append_part(const mesh::Chart& chart, const mesh::Surface& part,
                                  mesh::Surface& whole) {
  std::vector<VertexId> number = chart.vertices;
  const auto own = static_cast<Eigen::Index>(number.size());
  const Eigen::Index end = whole.vertices.rows(), more = part.vertices.rows() - own;
  whole.vertices.conservativeResize(end + more, 3);
  whole.vertices.bottomRows(more) = part.vertices.bottomRows(more);
  for (Eigen::Index v = end; v < end + more; ++v) number.push_back(static_cast<VertexId>(v));
  Triangles faces = whole.faces;
  const Eigen::Index first = faces.rows();
  faces.conservativeResize(first + part.faces.rows(), 3);
  for (Eigen::Index f = 0; f < part.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(first + f, k) = number[at(part.faces(f, k))];
  }
  whole.faces = std::move(faces);
  return number;
}

std::vector<char> open_parts(const mesh::Surface& surface, const mesh::Components& parts) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  std::vector<char> open(at(parts.count), 0);
  for (std::size_t h = 0; h < opposite.size(); ++h) {
    if (opposite[h] == kInvalid) open[at(parts.of_face[h / 3])] = 1;
  }
  return open;
}

bool has_boundary(const mesh::Surface& surface) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  return std::find(opposite.begin(), opposite.end(), kInvalid) != opposite.end();
}

void check_request(const mesh::Surface& surface, const std::vector<Index>& cones,
                   ExecutionContext& context) {
  check_surface(surface, context);
  if (cones.size() != at(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "cones need one number per vertex.");
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] < kNotGiven) throw_too_sharp(static_cast<VertexId>(v), cones[v]);
  }
  const std::vector<SurfacePart> parts = connected_parts(surface, flat_inside(cones, surface));
  for (const SurfacePart& part : parts) {
    context.check();
    if (part.bordered) continue;
    try {
      check_cones(part.cones, mesh::topology(part.surface.faces, part.surface.adjacency()).genus());
    } catch (const Infeasible& refused) {
      throw_of_part(refused.error(), part, parts.size() == 1);
    }
  }
}

void rethrow_placed(const std::vector<FaceId>& faces, const std::vector<VertexId>& vertices) {
  const auto numbered_by = [](const std::vector<Index>& number) {
    return [&number](Index i) { return at(i) < number.size() ? number[at(i)] : kInvalid; };
  };
  const auto face = numbered_by(faces);
  const Renumbering numbers{numbered_by(vertices), face, [](Index) { return kInvalid; }};
  try {
    throw;
  } catch (const certify::CertificateFailed& failed) {
    certify::Certificate certificate = failed.certificate();
    bool refined = false;
    for (FaceId& f : certificate.failed_faces) {
      refined = refined || face(f) != f;
      f = face(f);
    }
    std::erase(certificate.failed_faces, kInvalid);
    if (refined) certify::note_refined_numbers(certificate);
    throw certify::CertificateFailed("The seamless map", std::move(certificate));
  } catch (const NotConverged& failed) {
    throw NotConverged(renumbered(failed.error(), numbers));
  } catch (const InvalidInput& failed) {
    throw InvalidInput(renumbered(failed.error(), numbers));
  } catch (const Infeasible& failed) {
    throw Infeasible(renumbered(failed.error(), numbers));
  }
}

void name_input_places(const mesh::Surface& input, const mesh::Provenance& provenance,
                       const Triangles& refined, certify::Parametrization& map) {
  for (std::size_t v = 0; v < map.vertex_parent.size(); ++v) {
    const FaceId fine = map.vertex_parent[v], face = provenance.face[at(fine)];
    auto own = map.vertex_barycentric.row(static_cast<Eigen::Index>(v));
    Vector3 weight = Vector3::Zero();
    for (Index k = 0; k < 3; ++k) {
      const mesh::SurfacePoint& point = provenance.vertex[at(refined(fine, k))];
      for (Index i = 0; i < 3; ++i) {
        for (Index j = 0; j < 3; ++j) {
          if (input.faces(face, j) == input.faces(point.face, i))
            weight[j] += own[k] * point.weight[i];
        }
      }
    }
    map.vertex_parent[v] = face;
    own = weight.transpose();
  }
  for (FaceId& parent : map.parent_face) parent = provenance.face[at(parent)];
}

}  // namespace flipfree::seamless
