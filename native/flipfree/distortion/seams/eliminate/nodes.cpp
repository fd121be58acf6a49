#include "flipfree/distortion/seams/eliminate/nodes.h"

namespace flipfree::distortion {

using numeric::GaussianInteger;
using numeric::quarter_turn;

namespace {

// factor times (x, y), as complex numbers.
Vector2 product(const GaussianInteger& factor, const Vector2& p) {
  const auto re = static_cast<double>(factor.re);
  const auto im = static_cast<double>(factor.im);
  return {re * p.x() - im * p.y(), re * p.y() + im * p.x()};
}

}  // namespace

Points2 nodes_of(const SeamConstraints& constraints, const Triangles& faces,
                 const std::vector<SeamEdge>& seams, const Points2& uv) {
  Points2 nodes = Points2::Zero(constraints.node_count(), 2);
  const auto turned_back = [&](VertexId v, Index direction) {
    return product(quarter_turn(-direction), uv.row(v).transpose());
  };
  for (Index n = 0; n < constraints.position_count(); ++n) {
    nodes.row(n) = turned_back(constraints.position[at(n)], constraints.direction[at(n)]);
    if (constraints.real[at(n)]) nodes(n, 1) = 0;
  }
  std::vector<Vector2> sum(seams.size(), Vector2::Zero());
  std::vector<double> count(seams.size(), 0.0);
  for (std::size_t e = 0; e < seams.size(); ++e) {
    const auto point = [&](CornerId c) -> Vector2 {
      return uv.row(mesh::source(faces, c)).transpose();
    };
    const auto& [h, o, r] = seams[e];
    const GaussianInteger turn = quarter_turn(r);
    const Vector2 own = 0.5 * (point(next_corner(o)) - product(turn, point(h)) + point(o) -
                               product(turn, point(next_corner(h))));
    const GaussianInteger unit = constraints.branch_unit[e];
    const std::size_t branch = at(constraints.branch[e]);
    sum[branch] += product({unit.re, -unit.im}, own);
    count[branch] += 1;
  }
  for (std::size_t t = 0; t < constraints.translation.size(); ++t) {
    const auto& [place, part] = constraints.translation[t];
    auto node = nodes.row(constraints.position_count() + static_cast<Index>(t));
    const std::size_t i = at(place);
    if (part == ShiftSource::Part::kWhole) node = (sum[i] / count[i]).transpose();
    if (part == ShiftSource::Part::kReal) node.x() = sum[i].x() / count[i];
    if (part == ShiftSource::Part::kImaginary) node.x() = sum[i].y() / count[i];
    if (part != ShiftSource::Part::kLine) continue;
    for (const auto& [v, direction] : constraints.lines[i])
      node.x() += turned_back(v, direction).y() / static_cast<double>(constraints.lines[i].size());
  }
  return nodes;
}

Points2 map_of(const SeamConstraints& constraints, const Points2& nodes) {
  const std::size_t count = constraints.divisor.size();
  Points2 uv(static_cast<Eigen::Index>(count), 2);
  for (std::size_t v = 0; v < count; ++v) {
    Vector2 total = Vector2::Zero();
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
      const NodeTerm& term = constraints.terms[at(t)];
      total += product(term.factor, nodes.row(term.node).transpose());
    }
    uv.row(static_cast<Eigen::Index>(v)) =
        total.transpose() / static_cast<double>(constraints.divisor[v]);
  }
  return uv;
}

}  // namespace flipfree::distortion
