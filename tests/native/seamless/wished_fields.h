// Cross fields with given cones that turn at random along handles: the integers alone, for tests.
#pragma once

#include <random>
#include <utility>
#include <vector>

#include "flipfree/field/turning.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/seamless/padding/padding.h"

namespace flipfree::test {

// `reach`: along each of 2 g loops of a basis the field turns by up to so many quarters.
inline field::CrossField wished_field(const mesh::Surface& surface, const std::vector<Index>& cones,
                                      Index reach, std::mt19937& random) {
  ExecutionContext context;
  const mesh::Adjacency adjacency = mesh::build_adjacency(surface);
  const auto at = [](Index i) { return static_cast<std::size_t>(i); };
  field::CrossField field{std::vector<double>(at(static_cast<Index>(surface.faces.rows())), 0.0),
                          std::vector<Index>(at(static_cast<Index>(surface.faces.size())), 0)};
  const auto add = [&](HalfedgeId h, Index quarters) {
    field.matching[at(h)] += quarters;
    field.matching[at(adjacency.opposite[at(h)])] -= quarters;
  };
  const intrinsic::TreeCotree tree = intrinsic::tree_cotree(
      surface.faces, adjacency, intrinsic::steps_across(surface, adjacency), context);
  const std::vector<Index> own =
      field::cone_turns(surface.faces, adjacency, field::measure_frames(surface), field);
  std::vector<Index> missing(cones.size());
  for (std::size_t v = 0; v < cones.size(); ++v) missing[v] = cones[v] - own[v];
  for (auto v = tree.order.rbegin(); v != tree.order.rend(); ++v) {
    const HalfedgeId h = tree.to_parent[at(*v)];
    if (h == kInvalid) continue;
    add(h, -missing[at(*v)]);
    missing[at(mesh::target(surface.faces, h))] += missing[at(*v)];
  }
  for (std::size_t i = 0; i < tree.left_over.size(); ++i) {
    const Index turns = static_cast<Index>(random() % (2 * at(reach) + 1)) - reach;
    // The chain crosses its own loop only, from the right of it.
    const Index more = field::turning_number(adjacency, field, tree.loops[i]) - turns;
    for (const HalfedgeId h : intrinsic::chain_of(surface.faces, adjacency, tree, i)) add(h, more);
    if (field::turning_number(adjacency, field, tree.loops[i]) == turns) continue;
    for (const HalfedgeId h : intrinsic::chain_of(surface.faces, adjacency, tree, i))
      add(h, -2 * more);
  }
  return field;
}

inline seamless::WishedTurns turns_of(const mesh::Surface& surface,
                                      const mesh::Adjacency& adjacency,
                                      const field::CrossField& field, seamless::Reroutings& done) {
  std::vector<double> crossings =
      field::rotation_form(adjacency, field::measure_frames(surface), field);
  for (double& crossing : crossings) crossing = -crossing;
  return {[&](const intrinsic::DualLoop& strip) {
            return field::turning_number(adjacency, field, strip);
          },
          std::move(crossings), &done};
}

}  // namespace flipfree::test
