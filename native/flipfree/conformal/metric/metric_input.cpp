#include "flipfree/conformal/metric/metric_input.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/elements.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::conformal {
namespace {

constexpr double kPi = std::numbers::pi;

void check_options(const MetricOptions& options) {
  if (!(options.tolerance > 0.0) || !std::isfinite(options.tolerance)) {
    throw_invalid(ErrorCode::kBadOption, "tolerance must be a positive number of radians.");
  }
  if (options.bits != 0 && (options.bits < 53 || options.bits > kLargestBits)) {
    throw_invalid(ErrorCode::kBadOption,
                  "precision must be \"auto\" or 53 to 4096 mantissa bits, not " +
                      std::to_string(options.bits) + ".");
  }
}

void check_topology(const std::vector<Error>& defects) {
  if (!defects.empty()) throw InvalidInput(defects.front());
}

// Lengths per edge from lengths per corner; both sides must agree and every face be a proper
// triangle.
std::vector<double> edge_lengths(const intrinsic::IntrinsicSetup& setup, const Points3& lengths) {
  std::vector<double> result(setup.mesh.edge_count(), 0.0);
  for (Eigen::Index f = 0; f < lengths.rows(); ++f) {
    const auto l = lengths.row(f);
    const bool proper = l.allFinite() && l.minCoeff() > 0.0 && l[0] + l[1] > l[2] &&
                        l[1] + l[2] > l[0] && l[2] + l[0] > l[1];
    if (!proper) {
      throw_invalid(ErrorCode::kZeroAreaFace,
                    "The lengths of face " + std::to_string(f) + " (" + short_text(l[0]) + ", " +
                        short_text(l[1]) + ", " + short_text(l[2]) +
                        ") do not satisfy the strict triangle inequality. Correct them.",
                    ElementKind::kFace, {static_cast<Index>(f)});
    }
    for (int k = 0; k < 3; ++k) {
      const HalfedgeId h = setup.input_halfedge[static_cast<std::size_t>(3 * f + k)];
      double& stored = result[static_cast<std::size_t>(h >> 1)];
      if (stored != 0.0 && std::abs(stored - l[k]) > 1e-12 * stored) {
        throw_invalid(ErrorCode::kBadShape,
                      "The two faces at the edge from corner " + std::to_string(k) + " of face " +
                          std::to_string(f) + " give it different lengths, " + short_text(stored) +
                          " and " + short_text(l[k]) + ". Make them equal.",
                      ElementKind::kFace, {static_cast<Index>(f)});
      }
      if (stored == 0.0) stored = l[k];
    }
  }
  if (setup.mesh.symmetric()) {
    for (std::size_t e = 0; e < result.size(); ++e) {
      const HalfedgeId r = setup.mesh.reflection[2 * e];
      if (result[e] == 0.0) result[e] = result[static_cast<std::size_t>(r >> 1)];
    }
  }
  return result;
}

Index euler_characteristic(const intrinsic::IntrinsicSetup& setup, Index vertex_count,
                           Index face_count) {
  const intrinsic::IntrinsicMesh& m = setup.mesh;
  Index edges = static_cast<Index>(m.edge_count());
  if (m.symmetric()) {
    edges = static_cast<Index>(std::count_if(
        m.edge_label.begin(), m.edge_label.end(),
        [](intrinsic::EdgeLabel label) { return label != intrinsic::EdgeLabel::kTwo; }));
  }
  return vertex_count - edges + face_count;
}

}  // namespace

std::string short_text(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof(buffer), "%.6g", value);
  return buffer;
}

EngineInput checked_input(const mesh::Surface& surface, const Points3* lengths,
                          const MetricOptions& options) {
  check_options(options);
  if (lengths != nullptr && lengths->rows() != surface.faces.rows())
    throw_invalid(ErrorCode::kBadShape, "lengths must have one row per face.");
  EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  mesh::ValidateOptions rules;
  rules.require_connected = true;
  rules.allow_isolated_vertices = false;
  if (lengths == nullptr) {
    check_topology(mesh::find_defects(surface, rules));
  } else {
    rules.reject_zero_area = false;
    check_topology(
        mesh::find_defects({Points3::Zero(input.vertex_count, 3), surface.faces}, rules));
  }
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  if (lengths == nullptr) {
    input.positions = &surface.vertices;
  } else {
    input.edge_length = edge_lengths(input.setup, *lengths);
  }
  return input;
}

std::vector<double> checked_targets(const std::vector<double>& target, const EngineInput& input,
                                    double tolerance) {
  const intrinsic::IntrinsicSetup& setup = input.setup;
  const Index vertex_count = input.vertex_count;
  const auto face_count = static_cast<Index>(setup.input_halfedge.size() / 3);
  const Index euler = euler_characteristic(setup, vertex_count, face_count);
  if (target.size() != static_cast<std::size_t>(vertex_count)) {
    throw_invalid(ErrorCode::kBadShape, "target_angles has " + std::to_string(target.size()) +
                                            " entries for " + std::to_string(vertex_count) +
                                            " vertices. Give one angle per vertex.");
  }
  std::vector<Index> bad;
  for (std::size_t v = 0; v < target.size(); ++v) {
    if (!(target[v] > 0.0) || !std::isfinite(target[v])) bad.push_back(static_cast<Index>(v));
  }
  if (!bad.empty()) {
    throw_invalid(
        ErrorCode::kBadAngles,
        "The target angle of vertex " + std::to_string(bad.front()) +
            " is not a positive number. Every angle must be greater than 0 (flat interior is 2 pi, "
            "straight boundary pi).",
        ElementKind::kVertex, first_elements(bad));
  }
  long double sum = 0.0L;
  long double curvature = 0.0L;
  for (std::size_t v = 0; v < target.size(); ++v) {
    sum += target[v];
    curvature += (setup.on_boundary[v] ? 1.0L : 2.0L) * std::numbers::pi_v<long double> - target[v];
  }
  const long double missing = std::numbers::pi_v<long double> * face_count - sum;
  const double share = static_cast<double>(missing / vertex_count);
  if (std::abs(share) > std::max(0.5 * tolerance, 1e-12)) {
    throw_infeasible(ErrorCode::kGaussBonnet,
                     "The prescribed curvatures sum to " +
                         short_text(static_cast<double>(curvature)) +
                         ", but 2 pi times the Euler "
                         "characteristic " +
                         std::to_string(euler) + " is " + short_text(2.0 * kPi * euler) +
                         " (Gauss-Bonnet). Add " + short_text(static_cast<double>(missing)) +
                         " radians (" + short_text(static_cast<double>(missing) / (0.5 * kPi)) +
                         " quarter turns) to the sum of the target angles.",
                     {"angle sum",
                      {{"sum", {static_cast<double>(sum)}},
                       {"needed", {std::numbers::pi * static_cast<double>(face_count)}}}});
  }
  std::vector<double> spread = target;
  for (double& t : spread) t += share;
  return spread;
}

}  // namespace flipfree::conformal
