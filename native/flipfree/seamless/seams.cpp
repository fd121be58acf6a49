#include "flipfree/seamless/seams.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::seamless {
namespace {

std::complex<double> as_complex(const Vector2& v) { return {v.x(), v.y()}; }

}  // namespace

void turn_to_axes(const std::vector<Index>& chart_of_face, Index charts,
                  const std::function<bool(HalfedgeId)>& counts, Points2& corner_uv) {
  std::vector<std::complex<double>> turn(at(charts), 0.0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(corner_uv.rows()); ++h) {
    const Vector2 along = corner_uv.row(next_corner(h)) - corner_uv.row(h);
    const double length = along.norm();
    if (!(length > 0.0) || !counts(h)) continue;
    const std::complex<double> direction = as_complex(along / length);
    const std::complex<double> twice = direction * direction;
    turn[at(chart_of_face[at(h / 3)])] += length * twice * twice;
  }
  for (std::complex<double>& sum : turn) sum = std::polar(1.0, -0.25 * std::arg(sum));
  for (Eigen::Index c = 0; c < corner_uv.rows(); ++c) {
    const std::complex<double> p =
        turn[at(chart_of_face[at(static_cast<Index>(c) / 3)])] * as_complex(corner_uv.row(c));
    corner_uv.row(c) << p.real(), p.imag();
  }
}

certify::Transition across(const Points2& uv, HalfedgeId h, HalfedgeId o) {
  const Vector2 source = uv.row(h), target = uv.row(next_corner(h));
  const Vector2 other_source = uv.row(next_corner(o)), other_target = uv.row(o);
  const double angle = turn(target - source, other_target - other_source);
  certify::Transition found;
  found.quarter_turns = static_cast<Index>(std::lround(angle / kQuarterTurn) & 3);
  found.translation =
      0.5 * (other_source + other_target) - turned(0.5 * (source + target), found.quarter_turns);
  return found;
}

void write_transitions(certify::Parametrization& map) {
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  const mesh::EdgeFlags cut = mesh::flag_edges(map.surface.faces, adjacency, map.cut_edges);
  Eigen::Index edge = 0;
  map.cut_edges =
      IndexPairs(std::count(cut.begin(), cut.end(), 1) / 2, 2);  // a resize that fails frees twice
  map.transitions.clear();
  for (HalfedgeId h = 0; at(h) < cut.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (cut[at(h)] == 0 || o < h) continue;
    map.cut_edges.row(edge++) << mesh::source(map.surface.faces, h),
        mesh::target(map.surface.faces, h);
    map.transitions.push_back(across(map.uv, h, o));
  }
}

}  // namespace flipfree::seamless
