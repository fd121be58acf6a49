#include "flipfree/seamless/penner/relaxation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/intrinsic/flip_lengths.h"
#include "flipfree/seamless/penner/penner_newton.h"

namespace flipfree::seamless {

using conformal::MetricEngine;
using intrinsic::FlipRecord;
using intrinsic::IntrinsicMesh;

namespace {

// A step is halved so many times.
constexpr int kRelaxationHalvings = 6;
constexpr int kRelaxationNewtonSteps = 20;

// log(exp(a) + exp(b)).
double log_sum(double a, double b) {
  return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

double sum_of_squares(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double x : values) sum += x * x;
  return sum;
}

}  // namespace

ReferenceMetric::ReferenceMetric(const intrinsic::FlippedMetric& metric) {
  std::vector<double> length = intrinsic::to_doubles(metric.initial_length);
  IntrinsicMesh mesh = metric.initial;
  intrinsic::FlipLengths<double> lengths(length);
  for (std::size_t i = 0; i < metric.euclidean_flips; ++i) {
    // The first plain flip of a symmetric one is that of the edge which gave it its type.
    const auto stencil =
        intrinsic::flip_stencil(mesh, metric.flips[i].plain.edges[0], metric.flips[i].type);
    lengths.euclidean(stencil);
    intrinsic::flip_symmetrically(mesh, stencil);
  }
  mesh_ = {std::move(mesh.next), std::move(mesh.origin)};
  logarithm_.reserve(length.size());
  for (const double l : length) logarithm_.push_back(std::log(l));
  for (std::size_t i = metric.euclidean_flips; i < metric.flips.size(); ++i) {
    const intrinsic::PlainFlips& plain = metric.flips[i].plain;
    for (int k = 0; k < plain.count; ++k) flip(plain.edges[at(k)]);
  }
}

void ReferenceMetric::flip(EdgeId e) {
  const HalfedgeId h = 2 * e, o = h + 1;
  const auto of = [&](HalfedgeId g) { return logarithm_[at(g >> 1)]; };
  const double a = of(mesh_.next_of(h)) + of(mesh_.next_of(o));
  const double b = of(mesh_.previous(h)) + of(mesh_.previous(o));
  logarithm_[at(e)] = log_sum(a, b) - logarithm_[at(e)];
  intrinsic::flip_edge(mesh_, e);
}

std::vector<double> ReferenceMetric::ratios(const std::vector<double>& lengths) const {
  std::vector<double> r(lengths.size());
  double mean = 0.0;
  for (std::size_t e = 0; e < r.size(); ++e) {
    r[e] = std::log(lengths[e]) - logarithm_[e];
    mean += r[e] / static_cast<double>(r.size());
  }
  for (double& x : r) x -= mean;
  return r;
}

bool Relaxation::step(std::unique_ptr<MetricEngine>& engine, intrinsic::LoopCarrier& loops,
                      ReferenceMetric& reference) {
  PennerAngles angles;
  measure(*engine, loops, targets_, angles, context_);
  std::vector<double> wish = reference.ratios(engine->lengths());
  const double before = sum_of_squares(wish);
  for (double& w : wish) w = -w;
  std::vector<double> direction;
  if (!system_.solve(engine->mesh(), loops, angles, wish, direction, context_)) return false;
  double most = 0.0;
  for (const double d : direction) most = std::max(most, std::abs(d));
  PennerNewtonOptions newton;
  newton.tolerance = tolerance_;
  newton.max_iterations = kRelaxationNewtonSteps;
  double step = std::min(1.0, kMostRelaxationChange / std::max(most, 1e-300));
  for (int halving = 0; halving < kRelaxationHalvings; ++halving, step *= 0.5) {
    context_.check();
    std::vector<double> part = direction;
    for (double& d : part) d *= step;
    std::unique_ptr<MetricEngine> trial = engine->copy();
    intrinsic::LoopCarrier carried = loops;
    ReferenceMetric followed = reference;
    const std::size_t first = trial->flips().size();
    trial->stretch(part, context_);
    if (!trial->restore_delaunay(context_)) continue;
    intrinsic::replay_flips(trial->flips(), first, trial->flips().size(), context_,
                            [&](EdgeId e) { carried.flip(e); });
    if (run_penner(trial, carried, targets_, newton, context_).end != PennerEnd::kConverged)
      continue;
    intrinsic::replay_flips(trial->flips(), first, trial->flips().size(), context_,
                            [&](EdgeId e) { followed.flip(e); });
    if (!(sum_of_squares(followed.ratios(trial->lengths())) < before)) continue;
    engine = std::move(trial);
    loops = std::move(carried);
    reference = std::move(followed);
    return true;
  }
  return false;
}

std::vector<double> vertex_means(const IntrinsicMesh& mesh, const std::vector<double>& ratios) {
  const Index last = *std::max_element(mesh.unknown.begin(), mesh.unknown.end());
  std::vector<double> sum(at(last + 1), 0.0);
  std::vector<double> count(sum.size(), 0.0);
  for (std::size_t h = 0; h < mesh.halfedge_count(); ++h) {
    const std::size_t v = at(mesh.unknown[at(mesh.origin[h])]);
    sum[v] += ratios[h / 2];
    count[v] += 1.0;
  }
  for (std::size_t v = 0; v < sum.size(); ++v) sum[v] /= count[v];
  return sum;
}

double scaling_energy(const std::vector<double>& scale, const std::vector<double>& area) {
  double whole = 0.0, larger = 0.0, smaller = 0.0;
  for (std::size_t v = 0; v < scale.size(); ++v) {
    whole += area[v];
    larger += area[v] * std::exp(2.0 * scale[v]);
    smaller += area[v] * std::exp(-2.0 * scale[v]);
  }
  return std::sqrt((larger / whole) * (smaller / whole));
}

}  // namespace flipfree::seamless
