#include "flipfree/matchmaker/finish/store_map.h"

#include <algorithm>
#include <cstddef>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/outcome.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/matchmaker/coarsening/remove_added.h"
#include "flipfree/matchmaker/coarsening/untangle_removal.h"
#include "flipfree/matchmaker/smooth/neighbourhood.h"
#include "flipfree/matchmaker/smooth/relax.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

// Attempts: near the triangles that are too thin, then everywhere. Newton steps of each, and rings
// around the triangles.
constexpr int kAttempts = 2;
constexpr int kStepsPerAttempt = 60;
constexpr int kRingsAroundThin = 10;
// See seconds_to_store().
constexpr double kSecondsAtLeast = 0.02;
constexpr double kSecondsPerFace = 1e-5;

// The triangles that could not be stored, as faces of the map.
std::vector<FaceId> slots_of(const mesh::RefinedMap& map, const std::vector<Index>& faces) {
  std::vector<FaceId> slots;
  map.surface.mesh.faces(&slots);
  std::vector<FaceId> result;
  result.reserve(faces.size());
  for (const Index f : faces) result.push_back(slots[static_cast<std::size_t>(f)]);
  return result;
}

// Takes added vertices away, as nothing fits between held vertices that are neighbours among the
// 32-bit points, and relaxes the map.
void make_room_for_thin(mesh::RefinedMap& map, const std::vector<Index>& thin,
                        const std::vector<VertexId>& held, Index keep, int attempt,
                        ExecutionContext& context) {
  std::vector<VertexId> seeds;
  for (const FaceId f : slots_of(map, thin)) {
    for (const VertexId v : map.surface.mesh.corners(f)) {
      if (v < keep) seeds.push_back(v);
    }
  }
  // Added vertices that are held would lose their ids.
  const bool all_low = std::all_of(held.begin(), held.end(), [&](VertexId v) { return v < keep; });
  if (all_low) {
    if (remove_by_untangling(map, held, keep, context) > 0) map = mesh::compacted_map(map);
    thin_out(map, held, keep, context);
  }
  RelaxOptions options;
  options.steps = kStepsPerAttempt;
  options.lengthen = true;
  if (attempt == 0 && !seeds.empty()) {
    relax_near(map, seeds, kRingsAroundThin, held, options, context);
  } else {
    relax(map, held, options, context);
  }
}

[[noreturn]] void give_up(const mesh::RefinedMap& map, const std::vector<Index>& thin) {
  std::vector<Index> inputs;
  for (const FaceId f : slots_of(map, thin)) inputs.push_back(map.surface.mesh.parent(f));
  std::sort(inputs.begin(), inputs.end());
  inputs.erase(std::unique(inputs.begin(), inputs.end()), inputs.end());
  const std::string first =
      inputs.empty() ? "" : ", the first is " + std::to_string(inputs.front());
  const std::string count = std::to_string(inputs.size());
  throw_not_converged(ErrorCode::kRoundingFlips,
                      "A map without flips was found, but parts of " + count + " faces" + first +
                          ", are too thin in it for the 32-bit values that are stored. Move pins "
                          "nearer to where their surroundings are, or pin fewer vertices.",
                      ElementKind::kFace, std::move(inputs));
}

// Vertices are not named: those that touch are added ones, as a rule, which the caller never saw.
[[noreturn]] void refuse_touching() {
  throw_not_converged(
      ErrorCode::kRoundingFlips,
      "A map without flips that does not overlap itself was found, but parts of its "
      "boundary are so near each other that they meet in the 32-bit values that are "
      "stored. Allow overlaps, or move pins nearer to where their surroundings are.");
}

}  // namespace

double seconds_to_store(const mesh::RefinedSurface& surface) {
  return kSecondsAtLeast + kSecondsPerFace * static_cast<double>(surface.mesh.face_slots());
}

Points2f store_map(mesh::RefinedMap& map, const std::vector<VertexId>& held, Index keep,
                   bool bijective, ExecutionContext& context, Stats& stats) {
  distortion::RoundingOptions rounding;
  rounding.fixed = held;
  rounding.bijective = bijective;
  std::vector<VertexId> still = held;
  if (bijective)
    still.insert(still.end(), map.surface.boundary.begin(), map.surface.boundary.end());
  for (int attempt = 0;; ++attempt) {
    stats["rounding.rooms"] = std::int64_t{attempt};
    // As a rule far less; where nothing fits, repairing goes on for minutes.
    const double seconds = std::max(context.seconds_left(), seconds_to_store(map.surface));
    Outcome<Points2f> stored = flipfree::attempt([&] {
      const Overtime storing(context);
      const TimeLimit limit(context, seconds);
      return distortion::round_to_storage(to_surface(map.surface).faces, map.uv, rounding, context,
                                          stats);
    });
    if (stored) return std::move(*stored);
    if (stored.error().code != ErrorCode::kRoundingFlips) throw NotConverged(stored.error());
    const std::vector<Index>& thin = stored.error().elements;
    // Of a boundary that meets itself, vertices are named.
    if (stored.error().kind != ElementKind::kFace) refuse_touching();
    if (attempt == kAttempts) give_up(map, thin);
    make_room_for_thin(map, thin, still, keep, attempt, context);
  }
}

}  // namespace flipfree::matchmaker
