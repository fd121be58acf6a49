#include "flipfree/certify/certify.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/tolerances.h"
#include "flipfree/certify/measures.h"
#include "flipfree/certify/overlap.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::certify {
namespace {

// CertifyRequest::mirrored, with what is found; may be empty.
std::vector<Index> all_mirrored(const CertifyRequest& request, const Points2f& uv32) {
  std::vector<Index> mirrored = request.mirrored;
  if (!request.find_mirrored || flipped_faces(uv32).empty()) return mirrored;
  mirrored.resize(at(uv32.rows() / 3), 0);
  const mesh::Adjacency adjacency = mesh::build_adjacency(*request.surface);
  const mesh::Components charts =
      mesh::components_between(adjacency, mesh::uv_cuts(adjacency, uv32.cast<double>()));
  std::vector<char> negative(at(charts.count), 1);
  const Points2f image = uv32 * Eigen::DiagonalMatrix<float, 2>(-1.0F, 1.0F);
  for (const FaceId f : flipped_faces(image)) negative[at(charts.of_face[at(f)])] = 0;
  for (std::size_t f = 0; f < mirrored.size(); ++f)
    if (negative[at(charts.of_face[f])] != 0) mirrored[f] = 1;
  return mirrored;
}

// A copy with u negated on these faces.
template <typename Points>
Points mirror_images(const Points& uv, const std::vector<Index>& mirrored) {
  Points image = uv;
  for (std::size_t f = 0; f < mirrored.size(); ++f)
    if (mirrored[f] != 0) image.col(0).segment(static_cast<Eigen::Index>(3 * f), 3) *= -1;
  return image;
}

struct Certifier {
  const CertifyRequest& request;
  const mesh::Surface& surface;
  const std::vector<Index>& mirrored;  // see CertifyRequest
  const Points2& given;                // the map, which decides what is joined and lies on what
  const Points2f& given32;
  const Points2& uv;  // its mirror_images(), which are judged
  const Points2f& uv32;
  Points2 stored{};  // uv32 as doubles, exact
  mesh::Adjacency adjacency{};
  mesh::EdgeFlags cuts{};    // of the 64-bit map
  mesh::EdgeFlags cuts32{};  // of the stored one
  Certificate certificate{};
  // What takes time, measured on all threads; judged below, in a fixed order.
  std::vector<FaceId> flips64{};
  std::vector<FaceId> flips32{};
  std::vector<VertexId> winding64{};
  std::vector<VertexId> winding32{};
  Overlaps overlaps64{};
  Overlaps overlaps32{};
  IslandOverlaps islands64{};
  IslandOverlaps islands32{};
  std::vector<double> angle_sum{};  // per vertex, if angles are prescribed
  // Per vertex, where the map is seamless: see quarter_turns_around().
  std::vector<Index> quarters64{};
  std::vector<Index> quarters32{};
  ProvenanceReport provenance{};
  EnergyFigures energy64{};
  EnergyFigures energy32{};

  void measure(const ExecutionContext& context) {
    parallel_for(context, 6, 1, [&](std::size_t task, std::size_t, std::size_t) {
      if (task == 0) {
        adjacency = mesh::build_adjacency(surface);
        cuts = mesh::uv_cuts(adjacency, given);
      } else if (task == 1) {
        flips64 = flipped_faces(uv);
      } else if (task == 2) {
        flips32 = flipped_faces(uv32);
        stored = uv32.cast<double>();
      } else if (task == 3) {
        energy64 = symmetric_dirichlet(surface, uv, request.aspect);
      } else if (task == 4) {
        energy32 = symmetric_dirichlet(surface, uv32.cast<double>(), request.aspect);
      } else if (request.parent != nullptr) {
        provenance = check_provenance(surface, {request.parent, request.parent_face,
                                                request.vertex_parent, request.vertex_barycentric});
      }
    });
    const Points2 mirrored_stored = mirrored.empty() ? Points2() : given32.cast<double>();
    const Points2& given_stored = mirrored.empty() ? stored : mirrored_stored;
    cuts32 = mesh::uv_cuts(adjacency, given_stored);
    if (!mirrored.empty()) judge_mirrored();
    const bool flip_free = flips64.empty() && flips32.empty();
    parallel_for(context, 7, 1, [&](std::size_t task, std::size_t, std::size_t) {
      if (task == 0) {
        if (judges_cones()) add_angles();
        return;
      }
      const bool as_stored = task % 2 == 0;
      const Points2& values = as_stored ? stored : uv;
      const mesh::EdgeFlags& own_cuts = as_stored ? cuts32 : cuts;
      if (task > 4) {
        if (overlaps_count())
          (as_stored ? islands32 : islands64) = island_overlaps(
              mesh::components_between(adjacency, own_cuts), as_stored ? given_stored : given);
      } else if (!flip_free) {
        return;
      } else if (task > 2) {
        if (overlaps_count())
          (as_stored ? overlaps32 : overlaps64) =
              boundary_overlaps(surface.faces, adjacency, own_cuts, values);
      } else {
        (as_stored ? winding32 : winding64) = winding_failures(adjacency, own_cuts, values);
      }
    });
  }

  void judge_mirrored() {
    const mesh::Components charts = mesh::components_between(adjacency, cuts32);
    std::vector<Index> islands;
    for (FaceId f = 0; at(f) < mirrored.size(); ++f) {
      if (mirrored[at(f)] == 0) continue;
      certificate.mirrored_faces.push_back(f);
      islands.push_back(charts.of_face[at(f)]);
    }
    sort_unique(islands);
    certificate.mirrored_islands = static_cast<std::int64_t>(islands.size());
    for (const bool as_stored : {false, true}) {
      std::vector<FaceId>& flips = as_stored ? flips32 : flips64;
      for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        if (o == kInvalid || (as_stored ? cuts32 : cuts)[at(h)] != 0) continue;
        if (mirrored[at(h / 3)] != 0 && mirrored[at(o / 3)] == 0) flips.push_back(h / 3);
      }
      sort_unique(flips);
    }
  }

  bool judges_cones() const { return request.require_cones || !request.cone_angles.empty(); }
  bool overlaps_count() const {
    return request.measure_overlaps || request.require_bijective || request.require_disjoint;
  }

  void add_angles() {
    angle_sum.assign(static_cast<std::size_t>(surface.vertices.rows()), 0.0);
    for (CornerId c = 0; c < uv.rows(); ++c)
      angle_sum[static_cast<std::size_t>(surface.faces(c / 3, c % 3))] += corner_angle(c);
  }

  void fail(const std::string& sentence, const std::vector<FaceId>& faces) {
    certificate.failures.push_back(sentence);
    for (const FaceId f : faces) {
      if (certificate.failed_faces.size() >= kMostElements) break;
      certificate.failed_faces.push_back(f);
    }
  }

  static std::string counted(std::size_t count, const char* one, const char* many) {
    return std::to_string(count) + " " + (count == 1 ? one : many);
  }

  void check_flips() {
    certificate.flips64 = static_cast<std::int64_t>(flips64.size());
    certificate.flips32 = static_cast<std::int64_t>(flips32.size());
    if (!flips64.empty()) {
      fail("G1: " + counted(flips64.size(), "triangle is", "triangles are") +
               " flipped or degenerate in 64-bit UVs, first face " + face_id(flips64[0]),
           flips64);
    }
    if (!flips32.empty()) {
      fail("G1: " + counted(flips32.size(), "triangle is", "triangles are") +
               " flipped or degenerate in the stored 32-bit UVs, first face " + face_id(flips32[0]),
           flips32);
    }
  }

  void check_winding() {
    std::vector<VertexId> bad;
    std::set_union(winding64.begin(), winding64.end(), winding32.begin(), winding32.end(),
                   std::back_inserter(bad));
    // A vertex with a prescribed angle is judged by G5 instead.
    std::vector<VertexId> prescribed;
    for (const auto& [v, angle] : request.cone_angles) prescribed.push_back(v);
    std::sort(prescribed.begin(), prescribed.end());
    std::erase_if(bad, [&](VertexId v) {
      return std::binary_search(prescribed.begin(), prescribed.end(), v);
    });
    certificate.winding_failures = static_cast<std::int64_t>(bad.size());
    if (!bad.empty()) {
      fail("G2: the map winds more than once around " + counted(bad.size(), "vertex", "vertices") +
               ", first vertex " + vertex_id(bad[0]),
           {adjacency.vertex_halfedge[static_cast<std::size_t>(bad[0])] / 3});
    }
  }

  void check_pins() {
    std::int64_t missed = 0;
    CornerId first = kInvalid;
    for (const CornerPin& pin : request.pins) {
      const bool met = given(pin.corner, 0) == pin.uv.x() && given(pin.corner, 1) == pin.uv.y() &&
                       given32(pin.corner, 0) == static_cast<float>(pin.uv.x()) &&
                       given32(pin.corner, 1) == static_cast<float>(pin.uv.y());
      if (!met && missed++ == 0) first = pin.corner;
    }
    certificate.pin_failures = missed;
    if (missed > 0) {
      fail("G3: " + counted(static_cast<std::size_t>(missed), "pin is", "pins are") +
               " not met bit for bit, first at vertex " +
               vertex_id(surface.faces(first / 3, first % 3)),
           {first / 3});
    }
  }

  void check_seams() {
    const auto seams64 = measure_seams(adjacency, cuts, uv);
    const auto bad32 = seam_failures(adjacency, cuts32, stored);
    std::vector<HalfedgeId> bad;
    certificate.seam_deviation = 0;
    for (const SeamMeasure& seam : seams64) {
      if (seam.deviation != 0) bad.push_back(seam.h);
      if (std::isnan(seam.deviation) || seam.deviation > certificate.seam_deviation)
        certificate.seam_deviation = seam.deviation;
      certificate.seams.push_back({mesh::source(surface.faces, seam.h),
                                   mesh::target(surface.faces, seam.h), seam.quarter_turns,
                                   seam.translation});
    }
    // Edges that rounding has joined are no cuts there.
    certificate.seam_edges = static_cast<std::int64_t>(seams64.size());
    certificate.seams_exact64 = certificate.seam_edges - static_cast<std::int64_t>(bad.size());
    certificate.seams_exact32 =
        std::max<std::int64_t>(0, certificate.seam_edges - static_cast<std::int64_t>(bad32.size()));
    bad.insert(bad.end(), bad32.begin(), bad32.end());
    sort_unique(bad);
    certificate.seam_failures = static_cast<std::int64_t>(bad.size());
    if (!bad.empty()) {
      fail("G4: " + counted(bad.size(), "seam edge is", "seam edges are") +
               " not matched by a quarter turn and a translation, first edge " +
               vertex_id(mesh::source(surface.faces, bad[0])) + "-" +
               vertex_id(mesh::target(surface.faces, bad[0])),
           {bad[0] / 3});
    }
    if (bad.empty() && flips64.empty() && flips32.empty()) {
      quarters64 = quarter_turns_around(adjacency, uv);
      quarters32 = quarter_turns_around(adjacency, stored);
      for (std::size_t v = 0; v < quarters64.size(); ++v) {
        if (quarters64[v] != kInvalid && quarters64[v] != 4)
          certificate.quarter_cones.emplace_back(static_cast<VertexId>(v), quarters64[v]);
      }
      check_loops();
    }
  }

  void check_loops() {
    if (request.loops.empty()) return;
    certificate.holonomy_failures = 0;
    for (const auto& [loop, turns] : request.loops) {
      if (quarter_turns_along(adjacency, uv, loop) == turns &&
          quarter_turns_along(adjacency, stored, loop) == turns)
        continue;
      if (certificate.holonomy_failures++ > 0) continue;
      const bool exists = !loop.empty() && loop[0] >= 0 && loop[0] / 3 < surface.faces.rows();
      fail("G6: the map does not turn by " + std::to_string(turns) + " quarter turns along " +
               (exists ? "the loop through face " + face_id(loop[0] / 3) : "a loop"),
           std::vector<FaceId>(exists ? 1 : 0, exists ? loop[0] / 3 : 0));
    }
  }

  double corner_angle(CornerId c) const {
    const Vector2 p = uv.row(c);
    const Vector2 a = uv.row(next_corner(c)).transpose() - p;
    const Vector2 b = uv.row(previous_corner(c)).transpose() - p;
    return turn(a, b);
  }

  // Of a seamless map, angles at interior vertices are whole numbers of quarter turns.
  bool has_angle(std::size_t v, double target) const {
    const bool exact = v < quarters64.size() && quarters64[v] != kInvalid;
    if (!exact) return std::abs(angle_sum[v] - target) <= kConeAngleTolerance;
    const double quarters = std::round(target / (0.5 * std::numbers::pi));
    return std::abs(target - quarters * 0.5 * std::numbers::pi) <= kConeAngleTolerance &&
           quarters == quarters64[v] && quarters == quarters32[v];
  }

  // G5: prescribed angles are there; an interior vertex without one has 2 pi.
  void check_cones() {
    if (!judges_cones()) return;
    const auto vertex_count = static_cast<std::size_t>(surface.vertices.rows());
    std::vector<double> target_angle(vertex_count, 2.0 * std::numbers::pi);
    std::vector<char> judged(vertex_count, 0);
    for (std::size_t v = 0; v < vertex_count; ++v) {
      const HalfedgeId h = adjacency.vertex_halfedge[v];
      judged[v] = h != kInvalid && adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid;
    }
    for (const auto& [v, angle] : request.cone_angles) {
      target_angle[static_cast<std::size_t>(v)] = angle;
      judged[static_cast<std::size_t>(v)] = 1;
    }
    const std::vector<double>& sum = angle_sum;
    std::int64_t wrong = 0;
    VertexId first = kInvalid;
    for (std::size_t v = 0; v < vertex_count; ++v) {
      if (!judged[v] || has_angle(v, target_angle[v])) continue;
      if (wrong++ == 0) first = static_cast<VertexId>(v);
    }
    certificate.cone_failures = wrong;
    if (wrong > 0) {
      const HalfedgeId there = adjacency.vertex_halfedge[static_cast<std::size_t>(first)];
      fail("G5: " + counted(static_cast<std::size_t>(wrong), "vertex has", "vertices have") +
               " another total angle than prescribed, first vertex " + vertex_id(first) + " with " +
               std::to_string(sum[static_cast<std::size_t>(first)]) + " instead of " +
               std::to_string(target_angle[static_cast<std::size_t>(first)]),
           std::vector<FaceId>(there == kInvalid ? 0 : 1, there / 3));
    }
  }

  void check_overlaps() {
    if (!overlaps_count()) return;
    const Overlaps& shown = overlaps64.places() > 0 ? overlaps64 : overlaps32;
    certificate.overlaps = std::max(overlaps64.places(), overlaps32.places());
    if (certificate.overlaps == 0 || !request.require_bijective) return;
    const std::string first = ", first at face " + face_id(shown.faces[0]);
    if (shown.contacts > 0) {
      fail("The boundary of a chart meets itself in " +
               counted(static_cast<std::size_t>(shown.contacts), "place", "places") + first,
           shown.faces);
    } else {
      fail(counted(static_cast<std::size_t>(shown.turned_loops), "hole or slit of a chart is",
                   "holes or slits of charts are") +
               " turned inside out, so that the chart covers points twice" + first,
           shown.faces);
    }
  }

  void check_islands() {
    if (!overlaps_count()) return;
    const IslandOverlaps& shown = islands64.pairs > islands32.pairs ? islands64 : islands32;
    certificate.island_overlaps = shown.pairs;
    certificate.island_overlap_faces = shown.faces;
    if (shown.pairs > 0 && request.require_disjoint) {
      fail(counted(static_cast<std::size_t>(shown.pairs), "pair of charts overlaps",
                   "pairs of charts overlap") +
               ", first at face " + face_id(shown.faces[0]),
           shown.faces);
    }
  }

  void judge_distortion() {
    const EnergyFigures energy = worse_of(energy64, energy32);
    const bool finite = std::isfinite(energy.mean) && std::isfinite(energy.maximum);
    if (!finite && !request.require_distortion) {
      certificate.energy = certificate.max_energy = certificate.energy_p99 = -1.0;
      return;
    }
    certificate.energy = energy.mean;
    certificate.max_energy = energy.maximum;
    certificate.energy_p99 = energy.percentile99;
  }

  // Where triangles are so small or thin that their areas vanish among doubles.
  void check_figures() {
    const Certificate& c = certificate;
    if (!c.failures.empty() || (std::isfinite(c.energy) && std::isfinite(c.max_energy))) return;
    fail(
        "The distortion is not a finite number: areas of the surface, or of the map, are too small "
        "for doubles",
        {});
  }

  void check_features() {
    if (request.features.rows() == 0) return;
    const Provenance parent{request.parent, request.parent_face, request.vertex_parent,
                            request.vertex_barycentric};
    std::vector<Index> missed;
    for (const Points2* values : {&uv, static_cast<const Points2*>(&stored)}) {
      const std::vector<Index> own =
          missed_features(request.features, surface, adjacency, parent, *values);
      missed.insert(missed.end(), own.begin(), own.end());
    }
    sort_unique(missed);
    certificate.feature_edges = request.features.rows();
    for (const Index i : missed)
      certificate.features_missed.emplace_back(request.features(i, 0), request.features(i, 1));
    if (missed.empty() || !request.require_features) return;
    fail("G8: " + counted(missed.size(), "feature is", "features are") +
             " no isoline, first edge " + vertex_id(certificate.features_missed[0].first) + "-" +
             vertex_id(certificate.features_missed[0].second),
         {});
  }

  void check_provenance_of_refinement() {
    if (request.parent == nullptr) return;
    certificate.provenance_failures = provenance.failures;
    if (provenance.failures > 0)
      fail("G7: the refined mesh does not subdivide the input: " + provenance.first,
           provenance.faces);
  }
};

void check_shapes(const CertifyRequest& request) {
  if (request.surface == nullptr || request.uv == nullptr ||
      request.uv->rows() != 3 * request.surface->faces.rows() ||
      (request.uv32 != nullptr && request.uv32->rows() != request.uv->rows())) {
    throw_invalid(ErrorCode::kBadShape,
                  "The map needs one UV per face corner: shape (faces, 3, 2).");
  }
  if (!request.mirrored.empty() && 3 * request.mirrored.size() != at(request.uv->rows()))
    throw_invalid(ErrorCode::kBadShape, "What is mirrored needs one number per face.");
  if (request.require_seamless && (request.find_mirrored || !request.mirrored.empty()))
    throw_invalid(ErrorCode::kBadOption,
                  "Seamless maps have no mirrored islands. Ask for one of the two.");
  require_corners(request.pins, static_cast<Index>(request.uv->rows()));
  for (const auto& [v, angle] : request.cone_angles) {
    if (v < 0 || v >= request.surface->vertices.rows()) {
      throw_invalid(ErrorCode::kBadAngles,
                    "A cone names vertex " + vertex_id(v) +
                        ", which does not exist. Name vertices of the mesh.");
    }
    if (!std::isfinite(angle)) {
      throw_invalid(
          ErrorCode::kBadAngles,
          "The cone at vertex " + vertex_id(v) + " has no finite angle. Give it in radians.",
          ElementKind::kVertex, {v});
    }
  }
}

}  // namespace

Certificate certify(const CertifyRequest& request, const ExecutionContext& context) {
  check_shapes(request);
  const Points2f rounded =
      request.uv32 != nullptr ? Points2f() : Points2f(request.uv->cast<float>());
  const mesh::Surface& surface = *request.surface;
  const Points2f& uv32 = request.uv32 != nullptr ? *request.uv32 : rounded;
  std::vector<Index> mirrored = all_mirrored(request, uv32);
  const bool any = std::any_of(mirrored.begin(), mirrored.end(), [](Index m) { return m != 0; });
  if (!any) mirrored.clear();
  const Points2 image = any ? mirror_images(*request.uv, mirrored) : Points2();
  const Points2f image32 = any ? mirror_images(uv32, mirrored) : Points2f();
  Certifier certifier{request,
                      surface,
                      mirrored,
                      *request.uv,
                      uv32,
                      any ? image : *request.uv,
                      any ? image32 : uv32};
  certifier.certificate.triangles = surface.faces.rows();
  certifier.measure(context);
  certifier.check_flips();
  context.check();
  if (certifier.certificate.flips64 == 0 && certifier.certificate.flips32 == 0) {
    certifier.check_winding();
    certifier.check_overlaps();
    certifier.check_features();
    context.check();
  }
  certifier.check_islands();
  certifier.check_pins();
  if (request.require_seamless) certifier.check_seams();
  certifier.check_cones();
  certifier.check_provenance_of_refinement();
  certifier.judge_distortion();
  certifier.check_figures();
  certifier.certificate.ok = certifier.certificate.failures.empty();
  return certifier.certificate;
}

}  // namespace flipfree::certify
