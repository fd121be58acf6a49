#include "flipfree/holonomy/engines.h"

#include <algorithm>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/field/turning.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/seamless/padding/padding.h"

namespace flipfree::holonomy {
namespace {

// Cuts one component, whose face f is the surface's faces[f]; `straight`: along the field where
// that is nearer.
seamless::CutMaker turning_cutter(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                  const field::CrossField& field, bool straight,
                                  seamless::Reroutings& done) {
  std::vector<double> rotation;
  if (straight) rotation = field::rotation_form(adjacency, field::measure_frames(surface), field);
  return [&, rotation](const mesh::Surface& component, const std::vector<Index>& cones,
                       const std::vector<FaceId>& faces, ExecutionContext& context) {
    const auto turning = [&](const intrinsic::DualLoop& strip) {
      field::DualLoop on_surface;
      for (const HalfedgeId h : strip)
        on_surface.push_back(3 * faces[static_cast<std::size_t>(h / 3)] + h % 3);
      return field::turning_number(adjacency, field, on_surface);
    };
    std::vector<double> crossings;
    for (std::size_t f = 0; f < faces.size() && !rotation.empty(); ++f) {
      for (Index k = 0; k < 3; ++k)
        crossings.push_back(-rotation[static_cast<std::size_t>(3 * faces[f] + k)]);
    }
    return seamless::make_turning_cut(component, cones, {turning, std::move(crossings), &done},
                                      context);
  };
}

// Loops turn as they happen to (thesis 5).
seamless::AdmissibleCut bare_cut(const mesh::Surface& component, const std::vector<Index>& cones,
                                 const std::vector<FaceId>&, ExecutionContext& context) {
  return seamless::make_admissible_cut(component, cones, context);
}

seamless::PennerMap without_flips(seamless::PennerMap found) {
  if (found.map.certificate.flips64 == 0) return found;
  throw certify::CertificateFailed("The field-aligned map", certify::in_input_faces(found.map));
}

seamless::PennerMap padded(const mesh::Surface& surface, const NeededTopology& needed,
                           const seamless::CutMaker& cutter, const seamless::Reroutings& done,
                           const seamless::PennerMapOptions& options, ExecutionContext& context) {
  seamless::PennerMap found =
      without_flips(seamless::compute_padding_map(surface, needed.cones, cutter, options, context));
  Stats& stats = found.map.stats;
  stats["engine"] = std::string("padding");
  stats["reroutings.loops"] = static_cast<std::int64_t>(done.loops);
  stats["reroutings.guided"] = static_cast<std::int64_t>(done.shortest);
  stats["reroutings.fallback"] = static_cast<std::int64_t>(done.fallback);
  stats["reroutings.quarters"] = static_cast<std::int64_t>(done.quarters);
  stats["reroutings.straight"] = static_cast<std::int64_t>(done.straight);
  return found;
}

// Along cuts that are straight along the field; where their metric is not reached, along short
// ones.
seamless::PennerMap rerouted(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                             const field::CrossField& field, const NeededTopology& needed,
                             const seamless::PennerMapOptions& options, ExecutionContext& context) {
  seamless::Reroutings done;
  const auto along = [&](bool straight) {
    done = {};
    return padded(surface, needed, turning_cutter(surface, adjacency, field, straight, done), done,
                  options, context);
  };
  auto first = attempt([&] { return along(true); });
  if (first) return std::move(*first);
  if (done.straight == 0) throw NotConverged(first.error());
  auto second = attempt([&] { return along(false); });
  if (!second) throw NotConverged(first.error());
  return std::move(*second);
}

}  // namespace

seamless::RefinedPieces field_cut(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                  const field::CrossField& field, const std::vector<Index>& cones,
                                  bool reroute, seamless::Reroutings& done,
                                  ExecutionContext& context) {
  return seamless::cut_components(
      surface, cones, reroute ? turning_cutter(surface, adjacency, field, true, done) : bare_cut,
      context);
}

seamless::PennerMap engine_map(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                               const field::CrossField& field, const NeededTopology& needed,
                               seamless::Engine which, bool reroute,
                               const seamless::PennerMapOptions& options,
                               ExecutionContext& context) {
  const bool open = std::find(adjacency.opposite.begin(), adjacency.opposite.end(), kInvalid) !=
                    adjacency.opposite.end();
  if (which == seamless::Engine::kPadding) {
    if (open) {
      throw_invalid(ErrorCode::kBadOption,
                    "The engine \"padding\" does not know surfaces with a boundary. Take the "
                    "engine \"penner\" or \"auto\".");
    }
    if (reroute) return rerouted(surface, adjacency, field, needed, options, context);
    return padded(surface, needed, bare_cut, {}, options, context);
  }
  const auto by_penner = [&] {
    seamless::PennerMap found = without_flips(
        seamless::compute_penner_map(surface, needed.cones, needed.loops, options, context));
    found.map.stats["engine"] = std::string("penner");
    return found;
  };
  if (which == seamless::Engine::kPenner || open) return by_penner();
  auto first = attempt(by_penner);
  if (first) return std::move(*first);
  auto second =
      attempt([&] { return rerouted(surface, adjacency, field, needed, options, context); });
  if (!second) throw NotConverged(first.error());
  return std::move(*second);
}

}  // namespace flipfree::holonomy
