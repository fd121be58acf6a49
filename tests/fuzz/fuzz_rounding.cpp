#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "finding.h"
#include "flipfree/distortion/rounding.h"
#include "planar_maps.h"
#include "rational.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

// Edges that one face has, as vertices of the cut mesh.
std::vector<std::array<VertexId, 2>> border(const Triangles& faces) {
  std::map<std::array<VertexId, 2>, int> count;
  for (FaceId f = 0; f < faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      const VertexId a = faces(f, k), b = faces(f, (k + 1) % 3);
      ++count[{std::min(a, b), std::max(a, b)}];
    }
  }
  std::vector<std::array<VertexId, 2>> edges;
  for (const auto& [edge, faces_there] : count) {
    if (faces_there == 1) edges.push_back(edge);
  }
  return edges;
}

// Do two edges meet elsewhere than in a vertex that both have?
bool meets_itself(const std::vector<std::array<VertexId, 2>>& border, const Points2& uv) {
  const auto point = [&](VertexId v) { return exact(uv.row(v).transpose()); };
  for (std::size_t i = 0; i < border.size(); ++i) {
    for (std::size_t j = i + 1; j < border.size(); ++j) {
      const auto& [a, b] = border[i];
      const VertexId c = border[j][0], d = border[j][1];
      const Meeting m = meeting(point(a), point(b), point(c), point(d));
      if (!m.meet) continue;
      if (m.along) return true;
      const auto shared = [&](VertexId v) { return (v == c || v == d) && point(v) == m.at; };
      if (!shared(a) && !shared(b)) return true;
    }
  }
  return false;
}

}  // namespace

void fuzz_rounding(Bytes bytes) {
  const Index wishes = bytes.byte();
  PlanarMap map = read_planar_map(bytes, false);
  // Crowded: shrunk beside an offset, so that floats cannot hold all of it.
  if ((wishes & 1) != 0) {
    const Points2 before = map.uv;
    map.uv *= std::pow(2.0, -bytes.below(40));
    map.uv.rowwise() += Eigen::RowVector2d(bytes.number(), bytes.eighth());
    if (!map.uv.allFinite() || !(map.uv.cwiseAbs().maxCoeff() < 1e30)) map.uv = before;
  }
  const auto corner = [&](const Points2& uv, FaceId f, Index k) {
    return exact(uv.row(map.cut.faces(f, k)).transpose());
  };
  const auto all_positive = [&](const Points2& uv) {
    for (FaceId f = 0; f < map.cut.faces.rows(); ++f) {
      if (side(corner(uv, f, 0), corner(uv, f, 1), corner(uv, f, 2)) <= 0) return false;
    }
    return true;
  };
  if (!all_positive(map.uv)) return;
  distortion::RoundingOptions options;
  for (Index n = wishes >> 6; n > 0; --n) {
    const VertexId v = bytes.below(static_cast<Index>(map.uv.rows()));
    const Points2 before = map.uv;
    map.uv.row(v) = map.uv.row(v).cast<float>().cast<double>().eval();
    if (!map.uv.allFinite() || !all_positive(map.uv)) {  // beyond floats
      map.uv = before;
    } else {
      options.fixed.push_back(v);
    }
  }
  const auto edges = border(map.cut.faces);
  options.bijective = (wishes & 2) != 0 && !meets_itself(edges, map.uv);
  ExecutionContext context;
  const TimeLimit limit(context, 20.0);
  Stats stats;
  Points2f stored;
  if (!allowed([&] {
        stored = distortion::round_to_storage(map.cut.faces, map.uv, options, context, stats);
      }))
    return;
  require(stored.rows() == map.uv.rows() && stored.allFinite(), "values are missing");
  require(all_positive(stored.cast<double>()), "a triangle is flipped as stored");
  for (const VertexId v : options.fixed) {
    require(stored.row(v) == Points2f(map.uv.cast<float>()).row(v), "a fixed vertex was moved");
  }
  require(!options.bijective || !meets_itself(edges, stored.cast<double>()),
          "the boundary meets itself as stored");
}

}  // namespace flipfree::fuzz
