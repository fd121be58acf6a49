#include "flipfree/certify/certify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/tolerances.h"
#include "flipfree/certify/measures.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::certify {
namespace {

// CertifyRequest::mirrored, with what is found; empty where no face is.
std::vector<Index> all_mirrored(const CertifyRequest& request, const Points2& stored) {
  std::vector<Index> mirrored = request.mirrored;
  if (request.find_mirrored && !flipped_faces(stored).empty()) {
    mirrored.resize(at(stored.rows() / 3), 0);
    const mesh::Adjacency& adjacency = request.surface->adjacency();
    const mesh::Components charts =
        mesh::components_between(adjacency, mesh::uv_cuts(adjacency, stored));
    std::vector<char> negative(at(charts.count), 1);
    const Points2 image = stored * Eigen::DiagonalMatrix<double, 2>(-1.0, 1.0);
    for (const FaceId f : flipped_faces(image)) negative[at(charts.of_face[at(f)])] = 0;
    for (std::size_t f = 0; f < mirrored.size(); ++f)
      if (negative[at(charts.of_face[f])] != 0) mirrored[f] = 1;
  }
  const bool any = std::any_of(mirrored.begin(), mirrored.end(), [](Index m) { return m != 0; });
  return any ? mirrored : std::vector<Index>();
}

// The map as it was solved, or as it is stored, and what is measured of it.
struct Form {
  Points2 given;  // decides what is joined and lies on what
  Points2 uv;     // with u negated where the map is mirrored: is judged
  mesh::EdgeFlags cuts{};
  std::vector<FaceId> flips{};
  std::vector<VertexId> winding{};
  Overlaps overlaps{};
  IslandOverlaps islands{};
  std::vector<Index> quarters{};  // per vertex, where seamless: see quarter_turns_around()
  EnergyFigures energy{};
};

Form make_form(const Points2& given, const std::vector<Index>& mirrored) {
  Form form{given, given};
  for (std::size_t f = 0; f < mirrored.size(); ++f)
    if (mirrored[f] != 0) form.uv.col(0).segment(static_cast<Eigen::Index>(3 * f), 3) *= -1;
  return form;
}

struct Certifier {
  const CertifyRequest& request;
  const mesh::Surface& surface;
  std::vector<Index> mirrored;  // see CertifyRequest
  std::array<Form, 2> forms;    // as solved, as stored
  const mesh::Adjacency& adjacency = surface.adjacency();
  Certificate certificate{};
  std::vector<double> angle_sum{};  // per vertex, if angles are prescribed
  ProvenanceReport provenance{};

  bool flip_free() const { return forms[0].flips.empty() && forms[1].flips.empty(); }

  // What takes time, on all threads; judged below, in a fixed order.
  void measure(const ExecutionContext& context) {
    parallel_for(context, 5, 1, [&](std::size_t task, std::size_t, std::size_t) {
      Form& form = forms[task % 2];
      if (task < 2) {
        form.flips = flipped_faces(form.uv);
      } else if (task < 4) {
        form.energy = symmetric_dirichlet(surface, form.uv, request.aspect);
      } else if (request.provenance.parent != nullptr) {
        provenance = check_provenance(surface, request.provenance);
      }
    });
    for (Form& form : forms) form.cuts = mesh::uv_cuts(adjacency, form.given);
    if (!mirrored.empty()) judge_mirrored();
    parallel_for(context, 7, 1, [&](std::size_t task, std::size_t, std::size_t) {
      Form& form = forms[task % 2];
      if (task == 6) {
        if (judges_cones()) add_angles();
      } else if (task < 2) {
        if (overlaps_count())
          form.islands =
              island_overlaps(mesh::components_between(adjacency, form.cuts), form.given);
      } else if (flip_free() && task < 4) {
        form.winding = winding_failures(adjacency, form.cuts, form.uv);
      } else if (flip_free() && overlaps_count()) {
        form.overlaps = boundary_overlaps(surface.faces, adjacency, form.cuts, form.uv);
      }
    });
  }

  void judge_mirrored() {
    const mesh::Components charts = mesh::components_between(adjacency, forms[1].cuts);
    std::vector<Index> islands;
    for (FaceId f = 0; at(f) < mirrored.size(); ++f) {
      if (mirrored[at(f)] == 0) continue;
      certificate.mirrored_faces.push_back(f);
      islands.push_back(charts.of_face[at(f)]);
    }
    sort_unique(islands);
    certificate.mirrored_islands = static_cast<std::int64_t>(islands.size());
    for (Form& form : forms) {
      for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        if (o == kInvalid || form.cuts[at(h)] != 0) continue;
        if (mirrored[at(h / 3)] != 0 && mirrored[at(o / 3)] == 0) form.flips.push_back(h / 3);
      }
      sort_unique(form.flips);
    }
  }

  bool judges_cones() const { return request.require_cones || !request.cone_angles.empty(); }
  bool overlaps_count() const {
    return request.measure_overlaps || request.require_bijective || request.require_disjoint;
  }

  void add_angles() {
    angle_sum.assign(adjacency.vertex_halfedge.size(), 0.0);
    const Points2& uv = forms[0].uv;
    for (CornerId c = 0; c < uv.rows(); ++c)
      angle_sum[at(mesh::source(surface.faces, c))] += corner_angle(uv, c);
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
    certificate.flips64 = static_cast<std::int64_t>(forms[0].flips.size());
    certificate.flips32 = static_cast<std::int64_t>(forms[1].flips.size());
    for (const Form& form : forms) {
      if (form.flips.empty()) continue;
      fail("G1: " + counted(form.flips.size(), "triangle is", "triangles are") +
               " flipped or degenerate in " +
               (&form == &forms[0] ? "64-bit UVs" : "the stored 32-bit UVs") + ", first face " +
               face_id(form.flips[0]),
           form.flips);
    }
  }

  void check_winding() {
    std::vector<VertexId> bad = forms[0].winding;
    bad.insert(bad.end(), forms[1].winding.begin(), forms[1].winding.end());
    sort_unique(bad);
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
           {adjacency.vertex_halfedge[at(bad[0])] / 3});
    }
  }

  void check_pins() {
    std::int64_t missed = 0;
    CornerId first = kInvalid;
    for (const CornerPin& pin : request.pins) {
      const bool met = forms[0].given.row(pin.corner).transpose() == pin.uv &&
                       forms[1].given.row(pin.corner).transpose() == as_stored(pin.uv);
      if (!met && missed++ == 0) first = pin.corner;
    }
    certificate.pin_failures = missed;
    if (missed > 0) {
      fail("G3: " + counted(at(missed), "pin is", "pins are") +
               " not met bit for bit, first at vertex " +
               vertex_id(surface.faces(first / 3, first % 3)),
           {first / 3});
    }
  }

  void check_seams() {
    const auto seams64 = measure_seams(adjacency, forms[0].cuts, forms[0].uv);
    const auto bad32 = seam_failures(adjacency, forms[1].cuts, forms[1].uv);
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
    if (!bad.empty() || !flip_free()) return;
    for (Form& form : forms) form.quarters = quarter_turns_around(adjacency, form.uv);
    for (std::size_t v = 0; v < forms[0].quarters.size(); ++v) {
      const Index turns = forms[0].quarters[v];
      if (turns != kInvalid && turns != 4)
        certificate.quarter_cones.emplace_back(static_cast<VertexId>(v), turns);
    }
    check_loops();
  }

  void check_loops() {
    if (request.loops.empty()) return;
    certificate.holonomy_failures = 0;
    for (const auto& [loop, turns] : request.loops) {
      if (quarter_turns_along(adjacency, forms[0].uv, loop) == turns &&
          quarter_turns_along(adjacency, forms[1].uv, loop) == turns)
        continue;
      if (certificate.holonomy_failures++ > 0) continue;
      const bool exists = !loop.empty() && loop[0] >= 0 && loop[0] / 3 < surface.faces.rows();
      fail("G6: the map does not turn by " + std::to_string(turns) + " quarter turns along " +
               (exists ? "the loop through face " + face_id(loop[0] / 3) : "a loop"),
           std::vector<FaceId>(exists ? 1 : 0, exists ? loop[0] / 3 : 0));
    }
  }

  // Of a seamless map, angles at interior vertices are whole numbers of quarter turns.
  bool has_angle(std::size_t v, double target) const {
    const std::vector<Index>&solved = forms[0].quarters, &stored = forms[1].quarters;
    const bool exact = v < solved.size() && solved[v] != kInvalid;
    if (!exact) return std::abs(angle_sum[v] - target) <= kConeAngleTolerance;
    const double quarters = std::round(target / (0.5 * std::numbers::pi));
    return std::abs(target - quarters * 0.5 * std::numbers::pi) <= kConeAngleTolerance &&
           quarters == solved[v] && quarters == stored[v];
  }

  // G5: prescribed angles are there; an interior vertex without one has 2 pi.
  void check_cones() {
    if (!judges_cones()) return;
    const auto vertex_count = static_cast<std::size_t>(surface.vertices.rows());
    std::vector<double> target_angle(vertex_count, 2.0 * std::numbers::pi);
    std::vector<char> judged(vertex_count, 0);
    for (std::size_t v = 0; v < vertex_count; ++v) {
      const HalfedgeId h = adjacency.vertex_halfedge[v];
      judged[v] = h != kInvalid && adjacency.opposite[at(h)] != kInvalid;
    }
    for (const auto& [v, angle] : request.cone_angles) {
      target_angle[at(v)] = angle;
      judged[at(v)] = 1;
    }
    std::int64_t wrong = 0;
    VertexId first = kInvalid;
    for (std::size_t v = 0; v < vertex_count; ++v) {
      if (!judged[v] || has_angle(v, target_angle[v])) continue;
      if (wrong++ == 0) first = static_cast<VertexId>(v);
    }
    certificate.cone_failures = wrong;
    if (wrong > 0) {
      const HalfedgeId there = adjacency.vertex_halfedge[at(first)];
      fail("G5: " + counted(at(wrong), "vertex has", "vertices have") +
               " another total angle than prescribed, first vertex " + vertex_id(first) + " with " +
               std::to_string(angle_sum[at(first)]) + " instead of " +
               std::to_string(target_angle[at(first)]),
           std::vector<FaceId>(there == kInvalid ? 0 : 1, there / 3));
    }
  }

  void check_overlaps() {
    if (!overlaps_count()) return;
    const Overlaps& shown = forms[forms[0].overlaps.places() > 0 ? 0 : 1].overlaps;
    certificate.overlaps = std::max(forms[0].overlaps.places(), forms[1].overlaps.places());
    if (certificate.overlaps == 0 || !request.require_bijective) return;
    const std::string first = ", first at face " + face_id(shown.faces[0]);
    if (shown.contacts > 0) {
      fail("The boundary of a chart meets itself in " +
               counted(at(shown.contacts), "place", "places") + first,
           shown.faces);
    } else {
      fail(counted(at(shown.turned_loops), "hole or slit of a chart is",
                   "holes or slits of charts are") +
               " turned inside out, so that the chart covers points twice" + first,
           shown.faces);
    }
  }

  void check_islands() {
    if (!overlaps_count()) return;
    const bool solved = forms[0].islands.pairs > forms[1].islands.pairs;
    const IslandOverlaps& shown = forms[solved ? 0 : 1].islands;
    certificate.island_overlaps = shown.pairs;
    certificate.island_overlap_faces = shown.faces;
    if (shown.pairs > 0 && request.require_disjoint) {
      fail(counted(at(shown.pairs), "pair of charts overlaps", "pairs of charts overlap") +
               ", first at face " + face_id(shown.faces[0]),
           shown.faces);
    }
  }

  void judge_distortion() {
    const EnergyFigures energy = worse_of(forms[0].energy, forms[1].energy);
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
    // Without provenance edges of the input cannot be looked up.
    if (request.features.rows() == 0 || provenance.failures > 0) return;
    std::vector<Index> missed;
    for (const Form& form : forms) {
      const std::vector<Index> own =
          missed_features(request.features, surface, adjacency, request.provenance, form.uv);
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
    if (request.provenance.parent == nullptr) return;
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
  const Points2 stored = request.uv32 != nullptr ? Points2(request.uv32->cast<double>())
                                                 : Points2(as_stored(*request.uv));
  const std::vector<Index> mirrored = all_mirrored(request, stored);
  Certifier certifier{request,
                      *request.surface,
                      mirrored,
                      {make_form(*request.uv, mirrored), make_form(stored, mirrored)}};
  certifier.certificate.triangles = request.surface->faces.rows();
  certifier.measure(context);
  certifier.check_flips();
  context.check();
  if (certifier.flip_free()) {
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
