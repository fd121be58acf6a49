// By how much the loops of a finished cut turn, and by how much a cross field does along them,
// judged slowly and with nothing of the solver's: on the right hand of loops, by corners of faces,
// over a spanning tree that nobody has seen.
#pragma once

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/field/turning.h"
#include "flipfree/holonomy/needed_topology.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/seamless/padding/segments.h"

namespace flipfree::test {

class TurningJudge {
 public:
  TurningJudge(const seamless::AdmissibleCut& cut, const mesh::Surface& input,
               const field::CrossField& field)
      : cut_(cut),
        input_(input),
        field_(field),
        own_(mesh::build_adjacency(cut.surface)),
        of_input_(mesh::build_adjacency(input)) {
    for (const std::vector<HalfedgeId>& branch : cut.branches) {
      for (const HalfedgeId h : branch) {
        is_cut_.insert(h);
        is_cut_.insert(opposite(h));
      }
    }
    for (const HalfedgeId h : is_cut_) ++degree_[from(h)];
  }

  // Loops of a random spanning tree's cycles that turn otherwise than the field; "" if none does.
  std::string complaint(unsigned seed) {
    loops_ = 0;
    for (const std::vector<HalfedgeId>& loop : random_cycles(seed)) {
      ++loops_;
      intrinsic::DualLoop strip;
      const Index turn = turn_on_right(loop, strip);
      const holonomy::Refined refined{cut_.surface, own_, cut_.provenance.face};
      const intrinsic::DualLoop on_input = holonomy::projected(refined, input_, of_input_, strip);
      // Around a part of the cut without a vertex of the input inside: as around a point.
      const Index wanted =
          on_input.empty() ? turn : field::turning_number(of_input_, field_, on_input);
      if (turn != wanted)
        return "a loop that turns by " + std::to_string(turn) + " instead of " +
               std::to_string(wanted);
    }
    return "";
  }
  // Of the last call.
  Index loops() const { return loops_; }

 private:
  VertexId from(HalfedgeId h) const { return cut_.surface.faces(h / 3, h % 3); }
  VertexId to(HalfedgeId h) const { return cut_.surface.faces(h / 3, (h + 1) % 3); }
  HalfedgeId opposite(HalfedgeId h) const { return own_.opposite[at(h)]; }
  static HalfedgeId before(HalfedgeId h) { return h % 3 == 0 ? h + 2 : h - 1; }

  std::vector<std::vector<HalfedgeId>> random_cycles(unsigned seed) const {
    std::vector<std::size_t> order(cut_.branches.size());
    std::iota(order.begin(), order.end(), 0U);
    std::mt19937 random(seed);
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
    std::map<VertexId, VertexId> root;
    const auto find = [&](VertexId v) {
      while (root.try_emplace(v, v).first->second != v) v = root.at(v);
      return v;
    };
    std::map<VertexId, std::vector<std::pair<std::size_t, bool>>> tree;
    std::vector<std::size_t> left_over;
    for (const std::size_t b : order) {
      const VertexId head = from(cut_.branches[b].front()), tail = to(cut_.branches[b].back());
      if (find(head) == find(tail)) {
        left_over.push_back(b);
        continue;
      }
      root[find(head)] = find(tail);
      tree[head].emplace_back(b, false);
      tree[tail].emplace_back(b, true);
    }
    std::vector<std::vector<HalfedgeId>> cycles;
    for (const std::size_t b : left_over) {
      std::vector<HalfedgeId> cycle = cut_.branches[b];
      const VertexId goal = from(cycle.front());
      std::set<VertexId> seen;
      close(tree, to(cycle.back()), goal, seen, cycle);
      cycles.push_back(cycle);
    }
    return cycles;
  }

  using Tree = std::map<VertexId, std::vector<std::pair<std::size_t, bool>>>;
  bool close(const Tree& tree, VertexId v, VertexId goal, std::set<VertexId>& seen,
             std::vector<HalfedgeId>& cycle) const {
    if (v == goal) return true;
    seen.insert(v);
    for (const auto& [b, backwards] : tree.at(v)) {
      std::vector<HalfedgeId> branch = cut_.branches[b];
      if (backwards) {
        std::reverse(branch.begin(), branch.end());
        for (HalfedgeId& h : branch) h = opposite(h);
      }
      if (seen.contains(to(branch.back()))) continue;
      const std::size_t length = cycle.size();
      cycle.insert(cycle.end(), branch.begin(), branch.end());
      if (close(tree, to(branch.back()), goal, seen, cycle)) return true;
      cycle.resize(length);
    }
    return false;
  }

  // Quarter turns to the left, on the right hand of the loop; `strip` receives the faces there.
  Index turn_on_right(const std::vector<HalfedgeId>& loop, intrinsic::DualLoop& strip) const {
    Index turn = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const HalfedgeId out = loop[(i + 1) % loop.size()];
      HalfedgeId h = opposite(loop[i]);
      turn += angle(h) - 2;
      while (opposite(before(h)) != out) {
        strip.push_back(before(h));
        h = opposite(before(h));
        if (is_cut_.contains(h)) turn += angle(h);
      }
    }
    return turn;
  }

  // Of the sector that begins with h.
  Index angle(HalfedgeId h) const {
    const bool flat =
        std::find(cut_.flat_sectors.begin(), cut_.flat_sectors.end(), h) != cut_.flat_sectors.end();
    return flat || degree_.at(from(h)) == 2 ? 2 : 1;
  }

  const seamless::AdmissibleCut& cut_;
  const mesh::Surface& input_;
  const field::CrossField& field_;
  mesh::Adjacency own_, of_input_;
  std::set<HalfedgeId> is_cut_;
  std::map<VertexId, int> degree_;
  Index loops_ = 0;
};

}  // namespace flipfree::test
