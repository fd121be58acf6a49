// What is wrong with a chart's map, and where.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

// A chart in its own unit, with what stays the same while its map is mended.
struct DamagedChart {
  const mesh::Surface& surface;
  const mesh::Adjacency& adjacency;
  std::vector<double> area;   // #F, of the surface
  std::vector<char> unknown;  // #V: its place is a guess
  std::vector<char> pinned;   // #V: its place is given
  // UV length per surface length: of its own open faces where these are `healthy` enough, 0: not
  // known.
  double density = 0.0;
};

// Square root of the median, by area, of UV area over area of the positive faces without stacked
// vertices, nor `unknown` ones (#V flags; empty: none); 0 without any.
struct Density {
  double value = 0.0;
  double area = 0.0;   // of those of these faces with an energy of at most 10
  double share = 0.0;  // that of the surface's area
};
Density density_of(const mesh::Surface& surface, const Points2& uv,
                   const std::vector<char>& unknown = {});

// Per face (|J|^2 + |J^-1|^2) / 4 at the density; infinite where it is not positive.
std::vector<double> face_energies(const mesh::Surface& surface, const Points2& uv, double density);

// What the map costs where it is healthy, at least 1: the median by area of the energies that are
// finite, and the mean of those up to 25 times that.
struct Healthy {
  double median = 1.0;
  double mean = 1.0;
};
Healthy healthy_energy(const std::vector<double>& area, const std::vector<double>& energies);

// Flags of the faces that cannot stay: flipped, collapsed, with a vertex of no place, around a
// vertex that winds more than once, or beside such and drawn out more than 4 times as much as
// the median. Of a chart that is `spoilt` anyway, also faces drawn out more than 25 times as much,
// wherever they are. Cost: O(#F).
std::vector<char> find_damage(const DamagedChart& chart, const Points2& uv,
                              const std::vector<double>& energies, const Healthy& healthy,
                              bool spoilt, const ExecutionContext& context);

// Parts of a chart whose vertices are placed anew between neighbours that stay where they are.

// Unfolds what is bad (find_damage, of a spoilt chart) in the chart's map and moves no more than
// that takes: first as few vertices as every bad face has one of, those in the same place as others
// before all; where that does not open them at about the distortion around, all vertices of bad
// faces, and more and more rings around these. Vertices that move are placed between those that
// stay by distortion::Untangler, and relaxed. False if something bad is left, whose vertices are
// where they were. Deterministic; the same for any number of threads. Precondition: a known
// density. Cost: a few Newton solves of the parts that move.
bool mend_in_place(const DamagedChart& chart, Points2& uv, ExecutionContext& context);

}  // namespace flipfree::unwrap
