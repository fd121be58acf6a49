#include "flipfree/unwrap/islands/grids.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <set>
#include <span>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {
namespace {

// Widths are at least this share of the largest.
constexpr double kThinnestLine = 1e-6;
// Between islands, in the extent of the largest.
constexpr double kApart = 1.5;

using GridCell = std::array<Index, 2>;
// From a cell to the next one below, on the right, above, on the left.
constexpr std::array<GridCell, 4> kSteps = {{{0, -1}, {1, 0}, {0, 1}, {-1, 0}}};

Quad quad_across(HalfedgeId h, HalfedgeId o) {
  return {{next_corner(h), previous_corner(h), next_corner(o), previous_corner(o)}, {h, o}};
}

HalfedgeId longest_side(const mesh::Surface& surface, FaceId f) {
  return std::max({3 * f, 3 * f + 1, 3 * f + 2}, [&](HalfedgeId a, HalfedgeId b) {
    return edge_length(surface, a) < edge_length(surface, b);
  });
}

// Gives each quad its island, its lower side and its cell.
void number_cells(Grids& grids) {
  grids.island.assign(grids.quads.size(), kInvalid);
  grids.turn.assign(grids.quads.size(), 0);
  grids.cell.assign(grids.quads.size(), {0, 0});
  // The next quad, if it has no place yet: it has one then.
  const auto step = [&](Index quad, Index way) {
    const Index beyond = grids.across[at(4 * quad + (grids.turn[at(quad)] + way) % 4)];
    if (beyond == kInvalid || grids.island[at(beyond / 4)] != kInvalid) return kInvalid;
    const Index next = beyond / 4;
    grids.island[at(next)] = grids.island[at(quad)];
    grids.turn[at(next)] = (beyond - way + 2) % 4;
    for (std::size_t k = 0; k < 2; ++k)
      grids.cell[at(next)][k] = grids.cell[at(quad)][k] + kSteps[at(way)][k];
    return next;
  };
  Index count = 0;
  for (Index seed = 0; seed < static_cast<Index>(grids.quads.size()); ++seed) {
    if (grids.island[at(seed)] != kInvalid) continue;
    grids.island[at(seed)] = count++;
    // Columns first, then what lies beside them.
    std::deque<std::pair<Index, bool>> next = {{seed, true}};
    for (const Index way : {1, 3}) {
      for (Index q = step(seed, way); q != kInvalid; q = step(q, way)) next.emplace_front(q, true);
    }
    while (!next.empty()) {
      const auto [q, is_column] = next.front();
      next.pop_front();
      if (is_column) next.emplace_back(q, false);
      for (const Index way : is_column ? std::array{0, 2} : std::array{1, 3}) {
        if (const Index n = step(q, way); n != kInvalid) next.emplace_front(n, true);
      }
    }
  }
}

// Finds irregular and misplaced quads, each once.
void find_faults(Grids& grids) {
  std::set<std::tuple<Index, GridCell>> taken;
  for (Index q = 0; q < static_cast<Index>(grids.quads.size()); ++q) {
    bool is_irregular = false;
    bool is_misplaced = !taken.emplace(grids.island[at(q)], grids.cell[at(q)]).second;
    for (Index j = 0; j < 4; ++j) {
      Index around = 4 * q + j;
      for (int turn = 0; turn < 4 && around != kInvalid; ++turn) {
        const Index beyond = grids.across[at(around)];
        around = beyond == kInvalid ? kInvalid : beyond - beyond % 4 + (beyond + 1) % 4;
      }
      is_irregular = is_irregular || (around != kInvalid && around != 4 * q + j);
      const Index beyond = grids.across[at(4 * q + j)];
      if (beyond == kInvalid) continue;
      const Index way = (j - grids.turn[at(q)] + 4) % 4;
      const Index next = beyond / 4;
      // An island that closes up comes back in the same row or column.
      bool is_elsewhere = true;
      for (std::size_t k = 0; k < 2; ++k) {
        if (grids.cell[at(next)][k] == grids.cell[at(q)][k] + kSteps[at(way)][k])
          is_elsewhere = false;
      }
      is_misplaced = is_misplaced || is_elsewhere || (beyond - way + 2) % 4 != grids.turn[at(next)];
    }
    if (is_irregular) grids.irregular.push_back(q);
    if (is_misplaced) grids.misplaced.push_back(q);
  }
}

// Per quad where its column (axis 0) or row begins and ends.
std::vector<std::array<double, 2>> lines_of(const mesh::Surface& surface, const Grids& grids,
                                            std::size_t axis) {
  struct Line {
    double sum = 0.0;  // of its quads' widths
    double count = 0.0;
    std::array<double, 2> ends{};
  };
  std::map<std::pair<Index, Index>, Line> lines;  // by island
  const auto line_of = [&](std::size_t q) -> Line& {
    return lines[{grids.island[q], grids.cell[q][axis]}];
  };
  for (std::size_t q = 0; q < grids.quads.size(); ++q) {
    Line& line = line_of(q);
    line.count += 1.0;
    for (const Index way : {0, 2}) {
      const Index side = way + static_cast<Index>(axis);
      line.sum += 0.5 * edge_length(surface, grids.side(static_cast<Index>(q), side));
    }
  }
  double widest = 0.0;
  for (const auto& [place, line] : lines) widest = std::max(widest, line.sum / line.count);
  double reached = 0.0;
  Index island = kInvalid;
  for (auto& [place, line] : lines) {
    if (std::exchange(island, place.first) != place.first) reached = 0.0;
    line.ends[0] = reached;
    line.ends[1] = reached += std::max(line.sum / line.count, kThinnestLine * widest);
  }
  std::vector<std::array<double, 2>> ends;
  for (std::size_t q = 0; q < grids.quads.size(); ++q) ends.push_back(line_of(q).ends);
  return ends;
}

// Of faces that share an edge with one other, wound like them.
std::vector<HalfedgeId> opposites_of(const Triangles& faces, const ExecutionContext& context) {
  std::vector<HalfedgeId> opposite(at(static_cast<Index>(faces.size())), kInvalid);
  mesh::for_each_edge(faces.maxCoeff() + 1, faces, context, [&](std::span<const HalfedgeId> edge) {
    if (edge.size() != 2 || mesh::source(faces, edge[0]) == mesh::source(faces, edge[1])) return;
    opposite[at(edge[0])] = edge[1];
    opposite[at(edge[1])] = edge[0];
  });
  return opposite;
}

void refuse(std::vector<FaceId> faces, const char* why, ErrorCode code) {
  if (faces.empty()) return;
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  throw_invalid(code,
                (faces.size() == 1 ? "1 face" : std::to_string(faces.size()) + " faces") +
                    ", first face " + face_id(faces.front()) + ": " + why +
                    ". Cut around, or leave these islands out.",
                ElementKind::kFace, first_elements(faces));
}

// `ends`, and seams of the map; but where an island is a grid without those inside it.
mesh::EdgeFlags with_seams(const mesh::Adjacency& adjacency, const std::vector<Quad>& quads,
                           const Points2& corner_uv, mesh::EdgeFlags ends) {
  const mesh::EdgeFlags torn = mesh::uv_cuts(adjacency, corner_uv);
  const mesh::Components islands = mesh::components_between(adjacency, torn);
  const auto of = [&](HalfedgeId h) { return islands.of_face[at(h / 3)]; };
  mesh::EdgeFlags between = ends;
  for (std::size_t h = 0; h < ends.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[h];
    if (o != kInvalid && of(static_cast<HalfedgeId>(h)) != of(o)) between[h] = 1;
  }
  const Grids joined = grids_of(adjacency.opposite, quads, between);
  std::vector<char> is_wrong(at(islands.count), 0);
  for (const auto* faults : {&joined.irregular, &joined.misplaced}) {
    for (const Index q : *faults) is_wrong[at(of(joined.quads[at(q)].side[0]))] = 1;
  }
  for (std::size_t h = 0; h < ends.size(); ++h) {
    if (torn[h] != 0 && is_wrong[at(of(static_cast<HalfedgeId>(h)))] != 0) between[h] = 1;
  }
  return between;
}

std::vector<FaceId> triangles_at(const Grids& grids, const std::vector<Index>& quads) {
  std::vector<FaceId> faces;
  for (const Index q : quads) faces.push_back(grids.quads[at(q)].diagonal[0] / 3);
  return faces;
}

}  // namespace

std::vector<Quad> quads_of(const mesh::Surface& surface, const std::vector<HalfedgeId>& opposite,
                           const std::vector<Index>& polygon, bool in_pairs) {
  std::unordered_map<Index, Index> count;
  for (const Index p : polygon) ++count[p];
  std::vector<Quad> quads;
  const auto is_alone = [&](FaceId f) {
    return in_pairs && (polygon.empty() || count[polygon[at(f)]] == 1);
  };
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const HalfedgeId longest = longest_side(surface, f);
    HalfedgeId inside = kInvalid;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const HalfedgeId o = opposite[at(h)];
      if (o == kInvalid) continue;
      const FaceId g = o / 3;
      const bool is_pair =
          is_alone(f)
              ? h == longest && is_alone(g) && longest_side(surface, g) == o
              : !polygon.empty() && polygon[at(f)] == polygon[at(g)] && count[polygon[at(f)]] == 2;
      if (!is_pair) continue;
      inside = inside == kInvalid ? h : static_cast<HalfedgeId>(opposite.size());
    }
    if (inside == kInvalid || inside == static_cast<HalfedgeId>(opposite.size())) continue;
    const HalfedgeId o = opposite[at(inside)];
    if (o > inside && mesh::source(surface.faces, previous_corner(inside)) !=
                          mesh::source(surface.faces, previous_corner(o)))
      quads.push_back(quad_across(inside, o));
  }
  return quads;
}

Grids grids_of(const std::vector<HalfedgeId>& opposite, std::vector<Quad> quads,
               const mesh::EdgeFlags& ends) {
  Grids grids;
  grids.quads = std::move(quads);
  std::vector<Index> side_at(opposite.size(), kInvalid);
  for (std::size_t q = 0; q < grids.quads.size(); ++q) {
    for (std::size_t j = 0; j < 4; ++j)
      side_at[at(grids.quads[q].side[j])] = static_cast<Index>(4 * q + j);
  }
  for (const Quad& quad : grids.quads) {
    for (const HalfedgeId h : quad.side) {
      const HalfedgeId o = ends[at(h)] != 0 ? kInvalid : opposite[at(h)];
      grids.across.push_back(o == kInvalid ? kInvalid : side_at[at(o)]);
    }
  }
  number_cells(grids);
  find_faults(grids);
  return grids;
}

Points2 straight_corners(const mesh::Surface& surface, const Grids& grids) {
  Points2 corners = Points2::Zero(surface.faces.size(), 2);
  const auto columns = lines_of(surface, grids, 0);
  const auto rows = lines_of(surface, grids, 1);
  for (std::size_t q = 0; q < grids.quads.size(); ++q) {
    const Quad& quad = grids.quads[q];
    const auto [left, right] = columns[q];
    const auto [low, high] = rows[q];
    const std::array<Eigen::RowVector2d, 4> box = {
        {{left, low}, {right, low}, {right, high}, {left, high}}};
    const auto corner = [&](std::size_t j) { return box[(j + 4 - at(grids.turn[q])) % 4]; };
    for (std::size_t j = 0; j < 4; ++j) corners.row(quad.side[j]) = corner(j);
    corners.row(quad.diagonal[0]) = corner(2);
    corners.row(quad.diagonal[1]) = corner(0);
  }
  return corners;
}

Points2 rectify(const mesh::Surface& surface, const RectifyOptions& options,
                ExecutionContext& context) {
  context.report("finding grids", 0.0);
  if (surface.faces.rows() == 0 || surface.faces.triangles().minCoeff() < 0 ||
      surface.faces.triangles().maxCoeff() >= surface.vertices.rows())
    return Points2::Zero(surface.faces.size(), 2);
  const mesh::Adjacency adjacency{opposites_of(surface.faces, context), {}};
  const std::vector<Quad> quads = quads_of(surface, adjacency.opposite, options.polygon, true);
  std::vector<char> in_quad(at(static_cast<Index>(surface.faces.rows())), 0);
  for (const Quad& quad : quads)
    in_quad[at(quad.diagonal[0] / 3)] = in_quad[at(quad.diagonal[1] / 3)] = 1;
  std::vector<FaceId> others;
  for (std::size_t f = 0; f < in_quad.size(); ++f)
    if (in_quad[f] == 0) others.push_back(static_cast<FaceId>(f));
  refuse(std::move(others), "no quad", ErrorCode::kNoQuad);
  context.check();
  mesh::EdgeFlags ends =
      mesh::flag_pairs(surface.faces, static_cast<Index>(surface.vertices.rows()), &options.cuts);
  if (options.corner_uv.rows() > 0)
    ends = with_seams(adjacency, quads, options.corner_uv, std::move(ends));
  const Grids grids = grids_of(adjacency.opposite, quads, ends);
  refuse(triangles_at(grids, grids.irregular), "other than four quads meet inside the island",
         ErrorCode::kNoGrid);
  refuse(triangles_at(grids, grids.misplaced), "its island is no grid", ErrorCode::kNoGrid);
  Points2 corners = straight_corners(surface, grids);
  // The sides of an edge between two islands must not meet.
  const double wide = kApart * corners.maxCoeff();
  const Index islands = *std::max_element(grids.island.begin(), grids.island.end()) + 1;
  const auto many = static_cast<Index>(std::ceil(std::sqrt(static_cast<double>(islands))));
  for (std::size_t q = 0; q < quads.size(); ++q) {
    const Index island = grids.island[q];
    const Eigen::RowVector2d shift(wide * (island % many), wide * (island / many));
    for (const HalfedgeId h : quads[q].diagonal)
      corners.middleRows(h - h % 3, 3).rowwise() += shift;
  }
  return corners;
}

}  // namespace flipfree::unwrap
