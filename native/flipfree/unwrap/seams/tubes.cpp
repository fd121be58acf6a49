#include "flipfree/unwrap/seams/tubes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/unwrap/islands/grids.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/seams/nets.h"
#include "flipfree/unwrap/seams/search.h"

namespace flipfree::unwrap {
namespace {

// Tubes end where faces bend by this much (radians), but for steps and bevels; and at what is no
// quad where they bend by that much.
constexpr double kCrease = kBendAngle;
constexpr double kLeastEnd = 0.26;
// Roots of the area of the connected part: quads of steps and bevels are narrower than the first,
// and tubes are wider than the second.
constexpr double kStepWidth = 0.03;
constexpr double kLeastTube = 0.09;
// Faces bend by this much where a step or a bevel begins; and all along what is round about a tube.
constexpr double kStepBend = 0.3;
constexpr double kRoundBend = 0.2;
// The lengths of a tube's rows, or those of its columns, differ by this share: it unrolls not.
constexpr double kSame = 0.03;

// Per face the root of the area of its connected part.
std::vector<double> sizes_of(const mesh::Surface& surface) {
  const mesh::Components parts = mesh::face_components(surface.adjacency());
  std::vector<double> area(at(parts.count), 0.0);
  for (std::size_t f = 0; f < parts.of_face.size(); ++f)
    area[at(parts.of_face[f])] += face_area(surface, static_cast<FaceId>(f));
  std::vector<double> sizes;
  for (const Index part : parts.of_face) sizes.push_back(std::sqrt(area[at(part)]));
  return sizes;
}

// Per face: is it of a quad that is one of a step or a bevel?
std::vector<char> steps_of(const mesh::Surface& surface, const std::vector<Quad>& quads,
                           const std::vector<double>& sizes) {
  std::vector<char> is_step(sizes.size(), 0);
  for (const Quad& quad : quads) {
    double area = 0.0;
    double longest = 0.0;
    for (const HalfedgeId h : quad.diagonal) area += face_area(surface, h / 3);
    for (const HalfedgeId h : quad.side) longest = std::max(longest, edge_length(surface, h));
    for (const HalfedgeId h : quad.diagonal)
      is_step[at(h / 3)] = area < kStepWidth * sizes[at(h / 3)] * longest ? 1 : 0;
  }
  return is_step;
}

// Rows of quads that close up, each as the sides by which its quads follow each other.
std::vector<std::vector<Index>> rings_of(const Grids& all) {
  std::vector<std::vector<Index>> rings;
  std::vector<char> seen(all.across.size(), 0);
  for (Index first = 0; first < static_cast<Index>(seen.size()); ++first) {
    std::vector<Index> ring;
    Index side = first;
    while (side != kInvalid && seen[at(side)] == 0) {
      seen[at(side)] = 1;
      ring.push_back(side);
      side = all.across[at(side)];
      if (side != kInvalid) side = side - side % 4 + (side + 2) % 4;
    }
    if (side == first && !ring.empty()) rings.push_back(std::move(ring));
  }
  return rings;
}

// Seams, and creases, but those of steps, and those of what goes round about a tube with corners.
mesh::EdgeFlags ends_of(const mesh::Surface& surface, const Grids& all,
                        const std::vector<std::vector<Index>>& rings,
                        const std::vector<char>& is_step, mesh::EdgeFlags seams) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  const auto bend = [&](HalfedgeId h) { return bend_between(surface, h / 3, opposite[at(h)] / 3); };
  std::vector<char> is_round(seams.size(), 0);
  for (const std::vector<Index>& ring : rings) {
    if (std::ranges::any_of(ring, [&](Index side) { return bend(all.edge(side)) < kRoundBend; }))
      continue;
    for (const Index side : ring)
      is_round[at(all.edge(side))] = is_round[at(opposite[at(all.edge(side))])] = 1;
  }
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(seams.size()); ++h) {
    const HalfedgeId o = opposite[at(h)];
    if (o > h && is_step[at(h / 3)] == 0 && is_step[at(o / 3)] == 0 && is_round[at(h)] == 0 &&
        bend(h) >= kCrease)
      seams[at(h)] = seams[at(o)] = 1;
  }
  return seams;
}

// The grids of a surface that may be tubes, by island.
class TubeFinder {
 public:
  TubeFinder(const mesh::Surface& surface, const mesh::EdgeFlags& ends,
             const std::vector<double>& cost, Grids grids)
      : surface_(surface),
        opposite_(surface.adjacency().opposite),
        ends_(ends),
        cost_(cost),
        grids_(std::move(grids)) {}

  Tubes run(const std::vector<double>& sizes, const Stretch& bound) {
    std::map<Index, std::vector<Index>> tubes_of;  // by island: quads
    for (std::size_t q = 0; q < grids_.quads.size(); ++q)
      tubes_of[grids_.island[q]].push_back(static_cast<Index>(q));
    for (const auto* faults : {&grids_.irregular, &grids_.misplaced})
      for (const Index q : *faults) tubes_of.erase(grids_.island[at(q)]);
    std::erase_if(tubes_of, [&](const auto& island) {
      return !ends_well(island.second) || !turn_to_cheapest(island.second);
    });
    const std::vector<char> none(cost_.size() / 3, 0);
    Tubes tubes{mesh::EdgeFlags(cost_.size(), 0), {}, none, none};
    if (tubes_of.empty()) return tubes;
    tubes.corner_uv = straight_corners(surface_, grids_);
    const mesh::EdgeFlags torn = mesh::uv_cuts(surface_.adjacency(), tubes.corner_uv);
    std::vector<Index> local(at(surface_.vertices.rows()), kInvalid);
    for (const auto& [island, quads] : tubes_of) {
      std::vector<FaceId> faces;
      for (const Index q : quads)
        for (const HalfedgeId h : grids_.quads[at(q)].diagonal) faces.push_back(h / 3);
      Points2 uv(3 * static_cast<Eigen::Index>(faces.size()), 2);
      for (std::size_t i = 0; i < faces.size(); ++i)
        uv.middleRows(3 * static_cast<Eigen::Index>(i), 3) =
            tubes.corner_uv.middleRows(3 * faces[i], 3);
      const double size = sizes[at(faces.front())];
      if (uv.colwise().maxCoeff().minCoeff() < kLeastTube * size || unrolls(quads, size)) continue;
      const mesh::Part part = mesh::part_of(surface_.faces, faces, local);
      const mesh::Surface own{surface_.vertices(part.vertices, Eigen::all), part.faces};
      if (stretch_of(own, uv).within(bound)) take(quads, torn, tubes);
    }
    return tubes;
  }

 private:
  bool ends_well(const std::vector<Index>& quads) const {
    for (const Index q : quads) {
      for (Index j = 0; j < 4; ++j) {
        const HalfedgeId h = grids_.quads[at(q)].side[at(j)];
        const HalfedgeId o = opposite_[at(h)];
        if (grids_.across[at(4 * q + j)] == kInvalid && o != kInvalid && ends_[at(h)] == 0 &&
            bend_between(surface_, h / 3, o / 3) < kLeastEnd)
          return false;
      }
    }
    return true;
  }

  // Numbers the lines of a grid that closes up anew, so that the first one begins where a cut costs
  // least. False if it does not close up.
  bool turn_to_cheapest(const std::vector<Index>& quads) {
    bool closes = false;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto line_of = [&](Index q) -> Index& { return grids_.cell[at(q)][axis]; };
      const Index low = line_of(std::ranges::min(quads, {}, line_of));
      const Index count = line_of(std::ranges::max(quads, {}, line_of)) - low + 1;
      // Beyond the lower side of every first cell, or the left one, is the last.
      const Index way = axis == 0 ? 3 : 0;
      bool is_closed = count > 2;
      std::vector<double> price(at(count), 0.0);
      for (const Index q : quads) {
        const Index line = line_of(q) - low;
        const Index beyond = grids_.across[at(4 * q + (grids_.turn[at(q)] + way) % 4)];
        is_closed = is_closed && beyond != kInvalid &&
                    line_of(beyond / 4) - low == (line + count - 1) % count;
        price[at(line)] += cost_[at(grids_.side(q, way))];
      }
      if (!is_closed) continue;
      const auto best =
          static_cast<Index>(std::min_element(price.begin(), price.end()) - price.begin());
      if (!(price[at(best)] < mesh::ShortestPaths::kUnreached)) return false;
      for (const Index q : quads) line_of(q) = (line_of(q) - low - best + count) % count;
      closes = true;
    }
    return closes;
  }

  // Do rows have one length, and columns, but for steps?
  bool unrolls(const std::vector<Index>& quads, double size) const {
    const auto length = [&](Index q, std::size_t axis) {
      const auto way = static_cast<Index>(axis);
      return 0.5 * (edge_length(surface_, grids_.side(q, way)) +
                    edge_length(surface_, grids_.side(q, way + 2)));
    };
    std::array<std::map<Index, char>, 2> is_step;
    for (const Index q : quads) {
      for (std::size_t axis = 0; axis < 2; ++axis) {
        bool bends = false;
        for (const Index way : {1, 3}) {
          const HalfedgeId h = grids_.side(q, way - static_cast<Index>(axis));
          const HalfedgeId o = opposite_[at(h)];
          bends = bends || o == kInvalid || bend_between(surface_, h / 3, o / 3) >= kStepBend;
        }
        if (bends && length(q, axis) < kStepWidth * size)
          is_step[axis][grids_.cell[at(q)][axis]] = 1;
      }
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      std::map<Index, double> lengths;  // of columns, then of rows
      for (const Index q : quads) {
        const auto& [column, row] = grids_.cell[at(q)];
        if (is_step[0].count(column) == 0 && is_step[1].count(row) == 0)
          lengths[grids_.cell[at(q)][axis]] += length(q, 1 - axis);
      }
      if (lengths.empty()) continue;
      const auto [least, most] =
          std::ranges::minmax_element(lengths, {}, [](const auto& line) { return line.second; });
      if (least->second < (1.0 - kSame) * most->second) return false;
    }
    return true;
  }

  void take(const std::vector<Index>& quads, const mesh::EdgeFlags& torn, Tubes& tubes) const {
    for (const Index q : quads) {
      for (const HalfedgeId h : grids_.quads[at(q)].diagonal) tubes.of_face[at(h / 3)] = 1;
      for (Index j = 0; j < 4; ++j) {
        const HalfedgeId h = grids_.quads[at(q)].side[at(j)];
        const HalfedgeId o = opposite_[at(h)];
        if (o != kInvalid && (grids_.across[at(4 * q + j)] == kInvalid || torn[at(h)] != 0))
          tubes.cut[at(h)] = tubes.cut[at(o)] = 1;
      }
    }
  }

  const mesh::Surface& surface_;
  const std::vector<HalfedgeId>& opposite_;
  const mesh::EdgeFlags& ends_;
  const std::vector<double>& cost_;
  Grids grids_;
};

}  // namespace

Tubes find_tubes(const mesh::Surface& surface, const mesh::EdgeFlags& seams,
                 const std::vector<double>& cost, const std::vector<Index>& polygon,
                 const Stretch& bound) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  std::vector<Quad> quads = quads_of(surface, opposite, polygon, polygon.empty());
  const std::vector<double> sizes = sizes_of(surface);
  const std::vector<char> is_step = steps_of(surface, quads, sizes);
  const Grids all = grids_of(opposite, quads, seams);
  const std::vector<std::vector<Index>> rings = rings_of(all);
  const mesh::EdgeFlags ends = ends_of(surface, all, rings, is_step, seams);
  Grids grids = grids_of(opposite, std::move(quads), ends);
  Tubes tubes = TubeFinder(surface, ends, cost, std::move(grids)).run(sizes, bound);
  for (const std::vector<Index>& ring : rings) {
    const auto is_narrow = [&](Index side) {
      const HalfedgeId h = all.edge(side);
      return is_step[at(h / 3)] != 0 && edge_length(surface, h) < kStepWidth * sizes[at(h / 3)];
    };
    if (!std::ranges::all_of(ring, is_narrow)) continue;
    for (const Index side : ring)
      for (const HalfedgeId h : all.quads[at(side / 4)].diagonal) tubes.is_rim[at(h / 3)] = 1;
  }
  return tubes;
}

}  // namespace flipfree::unwrap
