#include "flipfree/seamless/padding/topology.h"

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/seamless/padding/extra_path.h"
#include "flipfree/seamless/padding/hole_chain.h"
#include "flipfree/seamless/padding/reroute.h"
#include "flipfree/seamless/padding/turn_meter.h"
#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {

namespace {

// From this scale_range() on a cut is drawn again, led by the cones: shortest curves leave disks
// that are far from having right angles. Of what the prices below lead to, the smallest range is
// taken.
constexpr double kFarOff = 100.0;
// ChainGuide::quarter_price: in the cones' own flat angles, of which drifts grow from handle to
// handle, and along a field, whose loops turn by whole quarters.
constexpr double kConesPrices[] = {0.7, 1.5, 3.0};
constexpr double kFieldPrice = 2.0;

// What the curves are led by; null: nothing.
struct Lead {
  const WishedTurns* wished = nullptr;
  const std::vector<double>* crossings = nullptr;
  double quarter_price = 0.0;
};

// Draws the cut for one pattern after the other.
class Drawer {
 public:
  Drawer(Canvas& canvas, const mesh::Surface& input, const std::vector<Index>& cones,
         const Lead& lead, const ExecutionContext& context)
      : canvas_(canvas),
        input_(input),
        input_adjacency_(
            mesh::build_adjacency(static_cast<Index>(input.vertices.rows()), input.faces)),
        cones_(cones),
        wished_(lead.wished),
        guide_{nullptr, lead.crossings, lead.quarter_price},
        context_(context) {
    if (wished_ != nullptr) {
      guide_.turning = [this](const std::vector<VertexId>& cycle) {
        return wished_->turning(strip_on_input(canvas_, input_adjacency_, cycle));
      };
    }
  }

  void draw(Pattern pattern, Index genus) {
    if (wished_ != nullptr && can_be_twisted(cones_, genus)) {
      ChainGuide short_ones = guide_;
      short_ones.crossings = nullptr;
      draw_hole_chain(canvas_, genus, context_, short_ones);
      divide();
      const std::vector<Index> odd =
          odd_branches(canvas_, input_adjacency_, graph_, wished_->turning);
      if (!odd.empty()) {
        const std::vector<VertexId> first = draw_loop_across(canvas_, graph_, odd, context_);
        join(draw_twisted_chain(canvas_, first, genus, context_, guide_));
        return;
      }
      canvas_.erase_all();
    }
    if (pattern == Pattern::kTwoTNodes) {
      join(draw_chain_with_t_nodes(canvas_, genus, context_, guide_));
      return;
    }
    draw_hole_chain(canvas_, genus, context_, guide_);
    divide();
    if (pattern == Pattern::kLoop) {
      close_loop();
      return;
    }
    if (wished_ != nullptr) end_as({Ending{}});
    if (pattern == Pattern::kExtraPath && !draw_shortest_extra_path(canvas_, context_))
      draw_fenced_extra_path(canvas_, cones_, genus, context_);
  }

 private:
  void divide() {
    graph_ = branch_graph(canvas_);
    divide_branches(canvas_, graph_);
  }

  std::size_t end_as(const std::vector<Ending>& endings) {
    return reroute(canvas_, input_, cones_, endings, *wished_, graph_, context_);
  }

  void join(const std::array<VertexId, 2>& t_nodes) {
    divide();
    std::vector<JoinedSectors> sectors = joinable_sectors(canvas_, t_nodes, cones_);
    if (wished_ != nullptr) {
      std::vector<Ending> endings;
      for (const auto& [from, to] : sectors)
        endings.push_back({{end_of(canvas_, graph_, from), end_of(canvas_, graph_, to)}});
      const Ending& ending = endings[end_as(endings)];
      sectors = {{leaving(canvas_, graph_, ending.divided[0]),
                  leaving(canvas_, graph_, ending.divided[1])}};
    }
    if (!draw_shortest_joining_path(canvas_, sectors, context_))
      draw_fenced_joining_path(canvas_, sectors, cones_, context_);
  }

  void close_loop() {
    std::vector<HalfedgeId> sectors = sectors_on_holes(canvas_);
    if (wished_ != nullptr) {
      std::vector<Ending> endings;
      for (Index end = 0; at(end) < graph_.next_end.size(); ++end) {
        if (graph_.branch_of(end).kind == Curve::kLoop) endings.push_back({{}, end});
      }
      const std::vector<VertexId> bent = graph_.walked_from(endings[end_as(endings)].bent);
      sectors.clear();
      for (std::size_t i = 1; i + 1 < bent.size(); ++i)
        sectors.push_back(canvas_.mesh().find(bent[i], bent[i + 1]));
    }
    draw_loop_around_cone(canvas_, sectors, cones_, context_);
  }

  Canvas& canvas_;
  const mesh::Surface& input_;
  const mesh::Adjacency input_adjacency_;
  const std::vector<Index>& cones_;
  const WishedTurns* wished_;
  ChainGuide guide_;
  const ExecutionContext& context_;
  BranchGraph graph_;
};

// Branches, flat sectors, and the extra path if T-nodes make it one.
void read_branches(const Canvas& canvas, AdmissibleCut& cut) {
  const BranchGraph graph = branch_graph(canvas);
  const auto first = [&](Index end) { return leaving(canvas, graph, end); };
  for (Index b = 0; at(b) < graph.branches.size(); ++b) {
    const BranchGraph::Branch& branch = graph.branches[at(b)];
    cut.branches.push_back(canvas.edges_along(branch.vertices));
    if (branch.kind != Curve::kExtra) continue;
    for (const Index end : {2 * b, 2 * b + 1}) {
      const Index next = graph.next_end[at(end)];
      if (graph.next_end[at(graph.next_end[at(next)])] != end) continue;
      // A T-node: opposite of the extra path.
      cut.flat_sectors.push_back(first(next));
      cut.extra_path = b;
    }
  }
}

Index genus_of(const mesh::Surface& surface) {
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  return mesh::topology(surface.faces, mesh::build_adjacency(vertex_count, surface.faces)).genus();
}

AdmissibleCut draw_cut(const mesh::Surface& surface, const std::vector<Index>& cones, Index genus,
                       const Lead& lead, const ExecutionContext& context) {
  const Pattern pattern = pattern_for(cones, genus);
  // A sphere is not cut: its cones may be neighbours.
  Canvas canvas(surface, pattern == Pattern::kNone ? std::vector<Index>(cones.size(), 4) : cones);
  AdmissibleCut cut;
  if (pattern != Pattern::kNone) Drawer(canvas, surface, cones, lead, context).draw(pattern, genus);
  cut.surface = canvas.surface();
  cut.provenance = canvas.provenance();
  if (pattern != Pattern::kNone) read_branches(canvas, cut);
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
                                  ExecutionContext& context) {
  const Index genus = genus_of(surface);
  check_cones(cones, genus);
  const mesh::InOwnUnit scaled(surface);
  const auto range_of = [&](const AdmissibleCut& cut) {
    if (cut.branches.empty()) return 0.0;
    const auto range = attempt([&] { return scale_range(cut, cones, context); });
    return range ? *range : std::numeric_limits<double>::infinity();
  };
  AdmissibleCut best = draw_cut(scaled.surface(), cones, genus, {}, context);
  double least = range_of(best);
  const bool far_off = least >= kFarOff;
  for (std::size_t i = 0; far_off && i < std::size(kConesPrices); ++i) {
    auto led = attempt([&] {
      const std::vector<double> crossings = flat_crossings(scaled.surface(), cones, context);
      return draw_cut(scaled.surface(), cones, genus, {nullptr, &crossings, kConesPrices[i]},
                      context);
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
  Reroutings done;
  const auto draw = [&](const std::vector<double>* crossings) {
    WishedTurns own = wished;
    own.done = &done;
    done = {};
    done.straight = crossings == nullptr ? 0 : 1;
    return draw_cut(scaled.surface(), cones, genus, {&own, crossings, kFieldPrice}, context);
  };
  const auto along = genus == 0 || wished.crossings.empty() ? nullptr : &wished.crossings;
  auto drawn = attempt([&] { return draw(along); });
  if (!drawn && along == nullptr) throw NotConverged(drawn.error());
  AdmissibleCut cut = drawn ? std::move(*drawn) : draw(nullptr);
  if (wished.done != nullptr) *wished.done += done;
  return in_given_unit(std::move(cut), surface, scaled.unit());
}

}  // namespace flipfree::seamless
