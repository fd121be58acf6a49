#include "flipfree/intrinsic/flipped_metric.h"

#include <algorithm>
#include <string>
#include <type_traits>

#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic {
namespace {

template <typename To, typename Convert>
std::vector<To> converted(const Scalars& values, const Convert& convert) {
  return std::visit(
      [&](const auto& v) {
        std::vector<To> out;
        out.reserve(v.size());
        for (const auto& x : v) out.push_back(convert(x));
        return out;
      },
      values);
}

std::size_t size_of(const Scalars& values) {
  return std::visit([](const auto& v) { return v.size(); }, values);
}

}  // namespace

std::vector<double> to_doubles(const Scalars& values) {
  return converted<double>(values, [](const auto& x) {
    return numeric::ScalarTraits<std::decay_t<decltype(x)>>::to_double(x);
  });
}

std::vector<long double> widened(const Scalars& values) {
  return converted<long double>(values, [](const auto& x) { return numeric::widen(x); });
}

bool are_lengths(const Scalars& values) {
  return std::visit(
      [](const auto& v) {
        using T = typename std::decay_t<decltype(v)>::value_type;
        return std::all_of(v.begin(), v.end(), [](const T& x) { return is_usable_length(x); });
      },
      values);
}

std::string find_broken_invariant(const FlippedMetric& metric) {
  if (std::string broken = find_broken_invariant(metric.initial); !broken.empty())
    return "initial mesh: " + broken;
  if (std::string broken = find_broken_invariant(metric.mesh); !broken.empty())
    return "final mesh: " + broken;
  if (size_of(metric.initial_length) != metric.initial.edge_count() ||
      size_of(metric.length) != metric.mesh.edge_count())
    return "not one length per edge";
  if (!are_lengths(metric.initial_length)) return "an initial length is no positive number";
  if (!are_lengths(metric.length)) return "a length is no positive number";
  if (size_of(metric.u) != metric.on_boundary.size()) return "not one scale factor per vertex";
  if (metric.euclidean_flips > metric.flips.size()) return "more Euclidean flips than flips";
  for (std::size_t c = 0; c < metric.input_halfedge.size(); ++c) {
    const HalfedgeId h = metric.input_halfedge[c];
    const HalfedgeId next = metric.input_halfedge[at(next_corner(static_cast<CornerId>(c)))];
    if (h < 0 || at(h) >= metric.initial.halfedge_count() || metric.initial.next_of(h) != next)
      return "corner " + std::to_string(c) + " of the input has no half-edge of its own";
  }
  FlipMesh mesh = metric.initial;
  for (const FlipRecord& record : metric.flips)
    for (const EdgeId e : record.plain) flip_edge(mesh, e);
  if (mesh.next != metric.mesh.next) return "the flips do not lead to the final mesh";
  return {};
}

}  // namespace flipfree::intrinsic
