#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/seamless/padding/hole_chain.h"
#include "flipfree/seamless/padding/padding.h"
#include "flipfree/seamless/padding/paths.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

namespace {

// The path that makes two components of one disk, so that the cut can be equalized (thesis 5.3.2,
// 5.3.3).

// Which cut the cones ask for.
enum class Pattern {
  kChain,      // all cones are multiples of four
  kTwoTNodes,  // genus 1 and 2
  kExtraPath,  // genus 3 and more
  kLoop        // around a cone with k = 1
};

// One sector of each T-node, each named by its first half-edge.
using JoinedSectors = std::array<HalfedgeId, 2>;

// Cones whose excess sums to a given number (thesis 5.3.3).

// A cone that alone is right for the part on one side of an extra path.
bool fits_alone(Index k, Index genus) { return k % 4 != 0 && k >= 2 && k <= 8 * genus - 2; }

// Places that are no corners: all, or those on holes.
std::vector<Index> straight_places(const DiskBoundary& boundary, bool on_holes) {
  std::vector<Index> places;
  for (Index i = 0; i < boundary.size(); ++i) {
    const bool hole = boundary.canvas.curve(boundary.halfedges[at(i)]) == Curve::kLoop;
    if (boundary.corner[at(i)] == 0 && (hole || !on_holes)) places.push_back(i);
  }
  return places;
}

// Where T-nodes can be: not at nodes, nor on both sides of one branch at different vertices.
bool can_be_t_nodes(const DiskBoundary& boundary, const PathEnds& ends) {
  const mesh::EditableTriangulation& mesh = boundary.canvas.mesh();
  if (boundary.corner[at(ends.from)] != 0 || boundary.corner[at(ends.to)] != 0) return false;
  const HalfedgeId from = boundary.halfedges[at(ends.from)];
  const HalfedgeId to = boundary.halfedges[at(ends.to)];
  if (boundary.branch[at(ends.from)] != boundary.branch[at(ends.to)]) return true;
  if (mesh.source(from) == mesh.source(to)) return true;
  // The same side if no corner is between them, one way or the other.
  return boundary.corners_between(ends.from, ends.to) == 0 ||
         boundary.corners_between(ends.to, ends.from) == 0;
}

// Vertices with cones (k other than 4) whose k - 4 sum to `excess`, by dynamic programming; nothing
// if there are none. `cones`: #V, quarter turns. excess: not zero. Cost: O(number of cones * range
// of their sums).
std::optional<std::vector<VertexId>> cones_with_excess(const std::vector<Index>& cones,
                                                       Index excess) {
  // How each sum was reached first: by this cone after that sum.
  std::map<Index, std::pair<VertexId, Index>> reached = {{0, {kInvalid, 0}}};
  std::vector<Index> sums = {0};
  for (VertexId v = 0; at(v) < cones.size() && !reached.contains(excess); ++v) {
    const Index more = cones[at(v)] - kFlat;
    if (more == 0) continue;
    // Sums that are new now have v last, so that no cone is taken twice.
    for (std::size_t i = 0, known = sums.size(); i < known; ++i) {
      if (reached.try_emplace(sums[i] + more, v, sums[i]).second) sums.push_back(sums[i] + more);
    }
  }
  if (!reached.contains(excess)) return std::nullopt;
  std::vector<VertexId> found;
  for (Index sum = excess; sum != 0; sum = reached[sum].second) found.push_back(reached[sum].first);
  std::sort(found.begin(), found.end());
  return found;
}

// Precondition: check_cones() passed.
Pattern pattern_for(const std::vector<Index>& cones, Index genus) {
  if (std::all_of(cones.begin(), cones.end(), [](Index k) { return k % 4 == 0; }))
    return Pattern::kChain;
  if (genus < 3) {
    // Of the parts that paths between the T-nodes can make, one of each two.
    const std::vector<Index> excesses =
        genus == 1 ? std::vector<Index>{-2} : std::vector<Index>{-2, -1, 1, 2, 3};
    if (std::any_of(excesses.begin(), excesses.end(),
                    [&](Index e) { return cones_with_excess(cones, e).has_value(); }))
      return Pattern::kTwoTNodes;
  } else if (std::any_of(cones.begin(), cones.end(),
                         [&](Index k) { return fits_alone(k, genus); })) {
    return Pattern::kExtraPath;
  }
  return Pattern::kLoop;  // a torus with cones 3 and 5 alone aside, one has one quarter turn
}

// Are all cones even, and such that a twisted chain along which some loop turns by an odd number of
// quarters can be joined: with half of all corners, but for one more or less of two, on a side?
bool can_be_twisted(const std::vector<Index>& cones, Index genus) {
  // 4 genus - 2 corners of 8 genus; the other cones fit the others.
  return genus > 0 &&
         std::none_of(cones.begin(), cones.end(), [](Index k) { return k % 2 != 0; }) &&
         cones_with_excess(cones, 4 * genus - 6);
}

// All between which a path can leave parts that fit the cones. Preconditions:
// draw_chain_with_t_nodes() or draw_twisted_chain(), then BranchGraph::divide(); pattern_for() is
// kTwoTNodes, or can_be_twisted().
std::vector<JoinedSectors> joinable_sectors(Canvas& canvas,
                                            const std::array<VertexId, 2>& t_nodes) {
  const DiskBoundary boundary(canvas);
  std::vector<JoinedSectors> joinable;
  for (const HalfedgeId from : canvas.drawn_around(t_nodes[0])) {
    for (const HalfedgeId to : canvas.drawn_around(t_nodes[1])) {
      const Index corners =
          boundary.left_corners({boundary.place[at(from)], boundary.place[at(to)]});
      if (corners % 4 != 0 && cones_with_excess(canvas.cones(), corners - kFlat))
        joinable.push_back({from, to});
    }
  }
  if (joinable.empty()) throw InternalError("no pattern of the cut fits the cones");
  return joinable;
}

// From one T-node to the other one, within the disk, between some of these sectors: the shortest
// path, or, where the search finds none, one around chosen cones, which there always is.
void draw_joining_path(Canvas& canvas, const std::vector<JoinedSectors>& sectors) {
  const DiskBoundary boundary(canvas);
  std::vector<Index> from, to;
  for (const auto& [f, t] : sectors) {
    from.push_back(boundary.place[at(f)]);
    to.push_back(boundary.place[at(t)]);
  }
  const auto allowed = [&](const PathEnds& ends) {
    const JoinedSectors joined = {boundary.halfedges[at(ends.from)],
                                  boundary.halfedges[at(ends.to)]};
    return std::find(sectors.begin(), sectors.end(), joined) != sectors.end();
  };
  const auto path = shortest_separating_path(boundary, from, to, allowed);
  if (!path.empty()) return canvas.draw(path, Curve::kExtra);
  const PathEnds ends{from.front(), to.front()};
  const auto inside = cones_with_excess(canvas.cones(), boundary.left_corners(ends) - kFlat);
  if (!inside) throw InternalError("cones that do not fit between the sectors");
  canvas.draw(fenced_path(boundary, ends, *inside), Curve::kExtra);
}

// From a hole to anywhere on the boundary, but if it is to the facing side of the same branch to
// the same vertex: with two T-nodes, or one node. The shortest one, or one around a single cone,
// likewise. Preconditions: draw_hole_chain(), then BranchGraph::divide(); pattern_for() is
// kExtraPath.
void draw_extra_path(Canvas& canvas, Index genus) {
  const DiskBoundary boundary(canvas);
  const std::vector<Index>& cones = canvas.cones();
  const auto allowed = [&](const PathEnds& ends) { return can_be_t_nodes(boundary, ends); };
  const std::vector<Index> from = straight_places(boundary, true);
  const std::vector<Index> anywhere = straight_places(boundary, false);
  const auto path = shortest_separating_path(boundary, from, anywhere, allowed);
  if (!path.empty()) return canvas.draw(path, Curve::kExtra);
  // The cone with the fewest corners around it.
  VertexId cone = kInvalid;
  for (VertexId v = 0; v < static_cast<VertexId>(cones.size()); ++v) {
    if (fits_alone(cones[at(v)], genus) && (cone == kInvalid || cones[at(v)] < cones[at(cone)]))
      cone = v;
  }
  for (const Index f : from) {
    for (const Index t : anywhere) {
      const PathEnds ends{f, t};
      if (f == t || !allowed(ends) || boundary.left_corners(ends) != cones[at(cone)] ||
          // fences need somewhere to begin
          boundary.places_between(f, t).empty() || boundary.places_between(t, f).empty())
        continue;
      canvas.draw(fenced_path(boundary, ends, {cone}), Curve::kExtra);
      return;
    }
  }
  throw InternalError("no place on the cut is right for the extra path");
}

// From one of these sectors, or any beside a hole where there are none, around the nearest cone
// with k = 1 and back. Preconditions: as above, but pattern_for() is kLoop.
void draw_loop_around_cone(Canvas& canvas, std::vector<HalfedgeId> sectors) {
  const DiskBoundary boundary(canvas);
  if (sectors.empty()) {
    for (const Index place : straight_places(boundary, true))
      sectors.push_back(boundary.halfedges[at(place)]);
  }
  const auto is_end = [&](HalfedgeId h) {
    return canvas.excess(canvas.mesh().target(h)) == 1 - kFlat;
  };
  const std::vector<HalfedgeId> path = free_path(canvas, canvas.inside(sectors), is_end);
  if (path.empty()) throw InternalError("no way from the cut to a cone");
  const Index place = boundary.place[at(canvas.sector_of(path.front()))];
  const VertexId cone = canvas.mesh().target(path.back());
  canvas.draw(fenced_loop(boundary, place, cone), Curve::kExtra);
}

// From this scale_range() on a cut is drawn again, led by the cones: shortest curves leave disks
// that are far from having right angles. Of what the prices below lead to, the smallest range is
// taken.
constexpr double kFarOff = 100.0;
// ChainGuide::quarter_price: in the cones' own flat angles, of which drifts grow from handle to
// handle, and along a field, whose loops turn by whole quarters.
constexpr double kConesPrices[] = {0.7, 1.5, 3.0};
constexpr double kFieldPrice = 2.0;

// Draws the cut for one pattern after the other. `wished`: null, or how its loops are to turn.
class Drawer {
 public:
  Drawer(Canvas& canvas, Index genus, const WishedTurns* wished, const ChainGuide& guide)
      : canvas_(canvas), genus_(genus), wished_(wished), guide_(guide) {
    if (wished_ == nullptr) return;
    guide_.turning = [&canvas, wished](const std::vector<VertexId>& cycle) {
      return wished->turning(strip_on_input(canvas, cycle));
    };
  }

  void draw(Pattern pattern) {
    if (wished_ != nullptr && can_be_twisted(canvas_.cones(), genus_) && draw_twisted()) return;
    if (pattern == Pattern::kTwoTNodes)
      return join(draw_chain_with_t_nodes(canvas_, genus_, guide_));
    draw_hole_chain(canvas_, genus_, guide_);
    if (pattern == Pattern::kLoop) return close_loop();
    BranchGraph graph = divided();
    if (wished_ != nullptr) reroute(graph, {Ending{}}, *wished_);
    if (pattern == Pattern::kExtraPath) draw_extra_path(canvas_, genus_);
  }

 private:
  BranchGraph divided() {
    BranchGraph graph(canvas_);
    graph.divide();
    return graph;
  }

  // False, and nothing is drawn, if no loop is to turn by an odd number of quarters.
  bool draw_twisted() {
    ChainGuide short_ones = guide_;
    short_ones.crossings = nullptr;
    draw_hole_chain(canvas_, genus_, short_ones);
    const BranchGraph graph = divided();
    const std::vector<Index> odd = odd_branches(graph, wished_->turning);
    if (odd.empty()) {
      canvas_.erase_all();
      return false;
    }
    join(draw_twisted_chain(canvas_, draw_loop_across(graph, odd), genus_, guide_));
    return true;
  }

  void join(const std::array<VertexId, 2>& t_nodes) {
    BranchGraph graph = divided();
    std::vector<JoinedSectors> sectors = joinable_sectors(canvas_, t_nodes);
    if (wished_ != nullptr) {
      std::vector<Ending> endings;
      for (const auto& [from, to] : sectors)
        endings.push_back({{graph.end_of(from), graph.end_of(to)}});
      const Ending& ending = endings[reroute(graph, endings, *wished_)];
      sectors = {{graph.leaving(ending.divided[0]), graph.leaving(ending.divided[1])}};
    }
    draw_joining_path(canvas_, sectors);
  }

  void close_loop() {
    BranchGraph graph = divided();
    std::vector<HalfedgeId> sectors;
    if (wished_ != nullptr) {
      std::vector<Ending> endings;
      for (Index end = 0; at(end) < graph.next_end.size(); ++end) {
        if (graph.branch_of(end).kind == Curve::kLoop) endings.push_back({{}, end});
      }
      const Ending& ending = endings[reroute(graph, endings, *wished_)];
      sectors = canvas_.edges_along(graph.walked_from(ending.bent));
      sectors.erase(sectors.begin());
    }
    draw_loop_around_cone(canvas_, sectors);
  }

  Canvas& canvas_;
  Index genus_;
  const WishedTurns* wished_;
  ChainGuide guide_;
};

// Branches, flat sectors, and the extra path if T-nodes make it one.
void read_branches(Canvas& canvas, AdmissibleCut& cut) {
  const BranchGraph graph(canvas);
  for (Index b = 0; at(b) < graph.branches.size(); ++b) {
    const BranchGraph::Branch& branch = graph.branches[at(b)];
    cut.branches.push_back(canvas.edges_along(branch.vertices));
    if (branch.kind != Curve::kExtra) continue;
    for (const Index end : {2 * b, 2 * b + 1}) {
      const Index next = graph.next_end[at(end)];
      if (graph.next_end[at(graph.next_end[at(next)])] != end) continue;
      // A T-node: opposite of the extra path.
      cut.flat_sectors.push_back(graph.leaving(next));
      cut.extra_path = b;
    }
  }
}

Index genus_of(const mesh::Surface& surface) {
  return mesh::topology(surface.faces, surface.adjacency()).genus();
}

AdmissibleCut draw_cut(const mesh::Surface& surface, const std::vector<Index>& cones, Index genus,
                       const WishedTurns* wished, const ChainGuide& guide,
                       const ExecutionContext& context) {
  // A sphere is not cut: its cones may be neighbours.
  const std::vector<Index> flat(cones.size(), kFlat);
  Canvas canvas(surface, genus == 0 ? flat : cones, context);
  if (genus > 0) Drawer(canvas, genus, wished, guide).draw(pattern_for(cones, genus));
  AdmissibleCut cut;
  cut.surface = to_surface(canvas.refined());
  cut.provenance = provenance_of(canvas.refined());
  read_branches(canvas, cut);
  return cut;
}

// A cut of the surface in its own unit, on the surface itself.
AdmissibleCut in_given_unit(AdmissibleCut cut, const mesh::Surface& surface, double unit) {
  cut.surface.vertices *= unit;
  cut.surface.vertices.topRows(surface.vertices.rows()) = surface.vertices;
  return cut;
}

}  // namespace

AdmissibleCut make_admissible_cut(const mesh::Surface& surface, const std::vector<Index>& cones,
                                  const std::vector<FaceId>&, ExecutionContext& context) {
  const Index genus = genus_of(surface);
  check_cones(cones, genus);
  const mesh::InOwnUnit scaled(surface);
  const auto range_of = [&](const AdmissibleCut& cut) {
    if (cut.branches.empty()) return 0.0;
    const auto range = attempt([&] { return scale_range(cut, cones, context); });
    return range ? *range : std::numeric_limits<double>::infinity();
  };
  AdmissibleCut best = draw_cut(scaled.surface(), cones, genus, nullptr, {}, context);
  double least = range_of(best);
  const bool far_off = least >= kFarOff;
  for (std::size_t i = 0; far_off && i < std::size(kConesPrices); ++i) {
    auto led = attempt([&] {
      const std::vector<double> crossings = flat_crossings(scaled.surface(), cones, context);
      return draw_cut(scaled.surface(), cones, genus, nullptr,
                      {nullptr, &crossings, kConesPrices[i]}, context);
    });
    const double range = led ? range_of(*led) : least;
    if (range >= least) continue;
    least = range;
    best = std::move(*led);
  }
  return in_given_unit(std::move(best), surface, scaled.unit());
}

AdmissibleCut make_turning_cut(const mesh::Surface& surface, const std::vector<Index>& cones,
                               const WishedTurns& wished, ExecutionContext& context) {
  const Index genus = genus_of(surface);
  check_cones(cones, genus);
  const mesh::InOwnUnit scaled(surface);
  const Reroutings before = *wished.done;
  const auto draw = [&](const std::vector<double>* crossings) {
    *wished.done = before;
    if (crossings != nullptr) ++wished.done->straight;
    return draw_cut(scaled.surface(), cones, genus, &wished, {nullptr, crossings, kFieldPrice},
                    context);
  };
  const auto along = genus == 0 || wished.crossings.empty() ? nullptr : &wished.crossings;
  auto drawn = attempt([&] { return draw(along); });
  if (!drawn && along == nullptr) throw NotConverged(drawn.error());
  AdmissibleCut cut = drawn ? std::move(*drawn) : draw(nullptr);
  return in_given_unit(std::move(cut), surface, scaled.unit());
}

}  // namespace flipfree::seamless
