#include "flipfree/field/guidance/sized_frames.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"

namespace flipfree::field {
namespace {

// By so much a direction changes at most: more is a jump of sizes that no triangle there can take.
constexpr double kMost = 0.125 * std::numbers::pi;

}  // namespace

void check_sizing(const std::vector<double>& sizing, const mesh::Surface& surface) {
  if (sizing.empty()) return;
  if (sizing.size() != static_cast<std::size_t>(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "sizing needs one number per vertex.");
  for (std::size_t v = 0; v < sizing.size(); ++v) {
    if (sizing[v] > 0.0 && std::isfinite(sizing[v])) continue;
    throw_invalid(ErrorCode::kBadOption,
                  "sizing at vertex " + std::to_string(v) +
                      " is not a positive number. Give the length in the map of a length 1 there.",
                  ElementKind::kVertex, {static_cast<Index>(v)});
  }
}

Frames sized_frames(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                    const Frames& frames, const std::vector<double>& sizing) {
  Frames sized = frames;
  for (HalfedgeId h = 0; at(h) < sized.direction.size(); ++h) {
    if (adjacency.opposite[at(h)] == kInvalid) continue;
    const double growth = std::log(sizing[at(mesh::target(surface.faces, h))] /
                                   sizing[at(mesh::source(surface.faces, h))]);
    if (growth == 0.0) continue;  // also where a corner has no angle
    // d(angle at j) = cot(angle at k) / 2 (p_i - p_j) + cot(angle at i) / 2 (p_k - p_j) to first
    // order, as both edges of the corner at j change (Springborn, Schroeder, Pinkall 2008).
    const double change = -0.5 * growth / std::tan(frames.corner[at(previous_corner(h))]);
    sized.direction[at(h)] += std::clamp(change, -kMost, kMost);
  }
  return sized;
}

}  // namespace flipfree::field
