#include "flipfree/distortion/seams/eliminate/straight_lines.h"

#include "flipfree/base/disjoint_sets.h"

namespace flipfree::distortion {
StraightLines straight_lines(Index vertex_count, const Triangles& faces,
                             const std::vector<StraightEdge>& straight) {
  StraightLines lines;
  lines.sides.resize(at(vertex_count));
  // Edges first; then those that continue each other are one line.
  for (std::size_t e = 0; e < straight.size(); ++e) {
    const auto& [h, direction] = straight[e];
    const HalfedgeId n = next_corner(h);
    lines.sides[at(faces(h / 3, h % 3))][1] = {static_cast<Index>(e), direction};
    lines.sides[at(faces(n / 3, n % 3))][0] = {static_cast<Index>(e), direction};
  }
  DisjointSets sets(static_cast<Index>(straight.size()));
  for (const auto& [in, out] : lines.sides) {
    if (in.line == kInvalid || out.line == kInvalid || in.direction != out.direction) continue;
    sets.join(out.line, in.line);
  }
  std::vector<Index> number(straight.size(), kInvalid);
  for (VertexId v = 0; v < vertex_count; ++v) {
    for (LineSide& side : lines.sides[at(v)]) {
      if (side.line == kInvalid) continue;
      Index& line = number[at(sets.find(side.line))];
      if (line == kInvalid) {
        line = static_cast<Index>(lines.vertices.size());
        lines.vertices.emplace_back();
      }
      side.line = line;
      lines.vertices[at(line)].emplace_back(v, side.direction);
    }
  }
  return lines;
}

}  // namespace flipfree::distortion
