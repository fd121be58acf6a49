#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <variant>
#include <vector>

#include "finding.h"
#include "flipfree/conformal/metric.h"
#include "flipfree/mesh/adjacency.h"
#include "meshes.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

using conformal::ConformalMetric;
using conformal::MetricOptions;
using intrinsic::EdgeLabel;
using intrinsic::IntrinsicMesh;
using Number = numeric::BigFloat<64>;  // up to 4096 bits, as many as metrics have

// As many bits as products of the metric's numbers, or at least as those numbers have.
int bits_for(const ConformalMetric& metric) { return std::clamp(2 * metric.bits, 1024, 4096); }

std::vector<Number> in_full(const intrinsic::Scalars& scalars, int bits) {
  std::vector<Number> result;
  std::visit(
      [&](const auto& values) {
        for (const auto& x : values) {
          if constexpr (std::is_same_v<std::decay_t<decltype(x)>, double>) {
            result.emplace_back(x, bits);
          } else {
            result.push_back(Number::rounded(x, bits));
          }
        }
      },
      scalars);
  return result;
}

// From the law of cosines: cos = (b^2 + c^2 - a^2) / (2 b c), sin by Heron in Kahan's order, whose
// one difference that can vanish is of numbers without a rounding.
double angle(const Number& opposite, const Number& b, const Number& c) {
  std::array<const Number*, 3> side{&opposite, &b, &c};
  std::sort(side.begin(), side.end(), [](const Number* x, const Number* y) { return *y < *x; });
  const auto& [longest, second, third] = side;
  const Number excess = *third - (*longest - *second);
  require(excess > Number(0.0), "a triangle of the metric is none");
  const Number cosine = b * b + c * c - opposite * opposite;
  const Number square = (*longest + (*second + *third)) * excess * (*third + (*longest - *second)) *
                        (*longest + (*second - *third));
  return atan2(sqrt(square), cosine).to_double();
}

// Total angle per vertex of the user's, from the lengths alone. In a double cover every vertex is
// there twice, or has twice its angle.
std::vector<double> angles_of(const conformal::ConformalMetric& metric,
                              const std::vector<Number>& length, std::size_t vertices) {
  const intrinsic::IntrinsicMesh& mesh = metric.mesh;
  std::vector<double> sum(vertices, 0.0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mesh.halfedge_count()); ++h) {
    const HalfedgeId n = mesh.next[at(h)];
    const HalfedgeId p = mesh.next[at(n)];
    const auto l = [&](HalfedgeId k) -> const Number& { return length[at(k >> 1)]; };
    sum[at(mesh.unknown[at(mesh.origin[at(h)])])] +=
        (mesh.symmetric() ? 0.5 : 1.0) * angle(l(n), l(h), l(p));
  }
  return sum;
}

// No edge violates the criterion beyond the rounding of lengths of so many bits.
void require_delaunay(const conformal::ConformalMetric& metric, const std::vector<Number>& length) {
  const intrinsic::IntrinsicMesh& mesh = metric.mesh;
  const int bits = bits_for(metric);
  const Number bound = Number::power_of_two(8 - metric.bits, bits);
  for (EdgeId e = 0; e < static_cast<EdgeId>(mesh.edge_count()); ++e) {
    if (mesh.label_of_edge(e) == intrinsic::EdgeLabel::kDiagonal) continue;
    const auto opposite_cosine = [&](HalfedgeId h, Number& numerator, Number& product) {
      const Number& a = length[at(mesh.next[at(h)] >> 1)];
      const Number& b = length[at(mesh.previous(h) >> 1)];
      const Number& c = length[at(e)];
      numerator = a * a + b * b - c * c;
      product = a * b;
    };
    Number left, right, left_product, right_product;
    opposite_cosine(2 * e, left, left_product);
    opposite_cosine(2 * e + 1, right, right_product);
    // The two cosines' sum may not be negative; sizes as the criterion's terms.
    const Number c2 = length[at(e)] * length[at(e)];
    const Number two(2.0, bits);
    const Number sum = left * right_product + right * left_product;
    const Number size = (left + two * c2) * right_product + (right + two * c2) * left_product;
    require(sum >= -(bound * size), "an edge is not Delaunay");
  }
}

}  // namespace

void fuzz_metric(Bytes bytes) {
  const Index wishes = bytes.byte();
  const mesh::Surface surface = read_mesh(bytes, Kind::kConnected, 24);
  const auto vertices = static_cast<Index>(surface.vertices.rows());
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::Topology t = mesh::topology(surface.faces, adjacency);
  // What Gauss and Bonnet leave is shared by all, so that most targets add up.
  std::vector<double> target;
  double missing = -2.0 * std::numbers::pi * t.euler();
  for (VertexId v = 0; v < vertices; ++v) {
    const bool outer = adjacency.opposite[at(adjacency.vertex_halfedge[at(v)])] == kInvalid;
    const double flat = outer ? std::numbers::pi : 2.0 * std::numbers::pi;
    target.push_back(flat * (1.0 + ((wishes & 1) != 0 ? 0.95 * bytes.fraction() : 0.0)));
    missing += flat - target.back();
  }
  if ((wishes & 2) != 0) {
    target[at(bytes.below(vertices))] += missing;
  } else {
    for (double& angle : target) angle += missing / vertices;
  }
  if (bytes.byte() == 255) target[at(bytes.below(vertices))] = bytes.any_number();
  conformal::MetricOptions options;
  options.tolerance = 1e-8;
  options.bits = (wishes & 12) == 12 ? 113 : (wishes & 8) != 0 ? 53 : 0;
  options.max_iterations = 100;
  options.max_seconds = 4.0;
  options.require_convergence = (wishes & 16) != 0;
  ExecutionContext context;
  context.threads = 1;
  conformal::ConformalMetric metric;
  if (!allowed(
          [&] { metric = conformal::compute_conformal_metric(surface, target, options, context); },
          &surface))
    return;
  require(metric.angles.size() == target.size() && metric.scale_factors.size() == target.size(),
          "a figure is missing");
  require(metric.converged || !options.require_convergence, "returned without convergence");
  if (!metric.converged) return;
  const std::string broken = intrinsic::find_broken_invariant(metric.mesh);
  if (!broken.empty()) throw Finding{"the metric's mesh is broken: " + broken};
  const std::vector<Number> length = in_full(metric.length, bits_for(metric));
  const std::vector<double> angles = angles_of(metric, length, target.size());
  for (std::size_t v = 0; v < target.size(); ++v)
    require(std::abs(angles[v] - target[v]) <= 2.0 * options.tolerance, "an angle is not reached");
  require_delaunay(metric, length);
}

}  // namespace flipfree::fuzz
