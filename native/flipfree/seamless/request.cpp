#include "flipfree/seamless/request.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/corners.h"

namespace flipfree::seamless {
namespace {

bool all_divided_by(Index m, const std::vector<Index>& turns) {
  return std::all_of(turns.begin(), turns.end(), [&](Index t) { return t % m == 0; });
}

}  // namespace

std::vector<Index> cone_list(const std::vector<Index>& cones) {
  std::vector<Index> list;
  for (const Index k : cones) {
    if (k != 4) list.push_back(k);
  }
  std::sort(list.begin(), list.end());
  return list;
}

void check_cones(const std::vector<Index>& cones, Index genus) {
  std::int64_t sum = 0;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] < 1) throw_too_sharp(static_cast<VertexId>(v), cones[v]);
    sum += 4 - cones[v];
  }
  const std::int64_t needed = 8 - 8 * std::int64_t{genus};
  if (sum == needed) return;
  throw_angle_sum(
      "The cones' curvatures 4 - k sum to ", sum,
      " quarter turns, but a closed surface of genus " + std::to_string(genus) + " needs ", needed,
      "cones' ");
}

std::string why_impossible(const std::vector<Index>& cones, Index genus,
                           const std::vector<Index>& loop_turns) {
  const std::vector<Index> list = cone_list(cones);
  if (genus == 1 && list.empty()) {
    const bool none =
        std::all_of(loop_turns.begin(), loop_turns.end(), [](Index t) { return t == 0; });
    return none ? "" : "On a torus without cones no loop can turn.";
  }
  if (genus == 1 && list.size() == 2) {
    const Index m = list[1] - 4;
    if (!all_divided_by(m, loop_turns)) return "";
    if (m == 1) return "A torus cannot have the cones 3 and 5 alone.";
    return "A torus with the cones " + std::to_string(list[0]) + " and " + std::to_string(list[1]) +
           " alone has a loop whose quarter turns " + std::to_string(m) + " does not divide.";
  }
  if (genus == 2 && list == std::vector<Index>{12}) {
    if (!all_divided_by(2, loop_turns) || all_divided_by(4, loop_turns)) return "";
    return "A surface of genus 2 with one cone of 12 quarter turns cannot have loops that all turn "
           "by half turns.";
  }
  if (genus == 2 && list == std::vector<Index>{6, 10} && all_divided_by(2, loop_turns)) {
    return "A surface of genus 2 with the cones 6 and 10 cannot have loops that all turn by half "
           "turns.";
  }
  return "";
}

std::optional<std::vector<Index>> near_turns(
    const std::vector<double>& angles, const Eigen::MatrixXd& norm,
    const std::function<std::string(const std::vector<Index>&)>& why) {
  const auto count = static_cast<Eigen::Index>(angles.size());
  Eigen::MatrixXd own = norm.selfadjointView<Eigen::Lower>();
  if (!own.allFinite() || Eigen::LLT<Eigen::MatrixXd>(own).info() != Eigen::Success)
    own.setIdentity();
  const Eigen::VectorXd given =
      Eigen::Map<const Eigen::VectorXd>(angles.data(), count) / kQuarterTurn;
  // Each from the last on is the nearest to what those behind it leave (Babai 1986).
  const Eigen::MatrixXd upper = Eigen::LLT<Eigen::MatrixXd>(own).matrixU();
  Eigen::VectorXd numbers(count), off = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = count; i-- > 0;) {
    numbers[i] = std::round(given[i] - upper.row(i).dot(off) / upper(i, i));
    off[i] = numbers[i] - given[i];
  }
  const Eigen::VectorXd slope = 2.0 * (own * off);
  // By what it costs to change one number by one, the cheaper way.
  std::vector<Eigen::Index> order(angles.size());
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const auto cost = [&](Eigen::Index i) { return own(i, i) - std::abs(slope[i]); };
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return cost(a) < cost(b); });
  for (std::size_t i = 0; i <= order.size(); ++i) {
    std::vector<Index> turns;
    for (const double x : numbers) turns.push_back(static_cast<Index>(x));
    if (i > 0) turns[at(order[i - 1])] += slope[order[i - 1]] > 0.0 ? -1 : 1;
    if (why(turns).empty()) return turns;
  }
  return std::nullopt;
}

std::vector<Index> near_turns(const std::vector<Index>& cones, Index genus,
                              const std::vector<double>& angles, const Eigen::MatrixXd& norm) {
  std::vector<Index> any;
  const auto found = near_turns(angles, norm, [&](const std::vector<Index>& turns) {
    if (any.empty()) any = turns;
    return why_impossible(cones, genus, turns);
  });
  if (!found) {
    const std::string why = why_impossible(cones, genus, any);
    Witness witness{"empty stratum", {{"genus", {static_cast<double>(genus)}}, {"cones", {}}}};
    for (const Index k : cone_list(cones)) witness.numbers[1].second.push_back(k);
    throw_infeasible(ErrorCode::kBadAngles, why + " Move one of the cones' angles to a third one.",
                     std::move(witness));
  }
  return *found;
}

namespace {

constexpr std::size_t kMostNamed = 1000;

Index genus_of_part(const SurfacePart& part) {
  const auto faces = static_cast<Index>(part.faces.size());
  return (2 - (static_cast<Index>(part.vertices.size()) - faces / 2)) / 2;
}

// The same error with the place of the part.
[[noreturn]] void throw_of_part(const Error& error, const SurfacePart& part, bool only_one) {
  std::vector<Index> places;
  for (std::size_t i = 0; i < part.vertices.size() && places.size() < kMostNamed; ++i) {
    if (part.cones[i] != 4) places.push_back(part.vertices[i]);
  }
  ElementKind kind = ElementKind::kVertex;
  if (places.empty()) {
    kind = ElementKind::kFace;
    for (std::size_t i = 0; i < part.faces.size() && i < kMostNamed; ++i)
      places.push_back(part.faces[i]);
  }
  const std::string where = only_one ? ""
                                     : "The part of face " + face_id(part.faces.front()) + " (" +
                                           std::to_string(part.faces.size()) + " faces): ";
  throw_infeasible(error.code, where + error.message, error.witness, kind, std::move(places));
}

}  // namespace

void check_surface(const mesh::Surface& surface, ExecutionContext& context) {
  mesh::ValidateOptions rules;
  rules.allow_isolated_vertices = false;
  mesh::validate(surface, rules, context);
}

std::vector<SurfacePart> connected_parts(const mesh::Surface& surface,
                                         const std::vector<Index>& cones) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::CutMesh whole =
      mesh::cut_along(surface.faces, adjacency, mesh::EdgeFlags(adjacency.opposite.size(), 0));
  std::vector<SurfacePart> parts;
  for (mesh::Chart& chart : mesh::split_into_charts(surface.vertices, whole)) {
    SurfacePart& part = parts.emplace_back(SurfacePart{std::move(chart), {}});
    for (VertexId& v : part.vertices) {
      v = whole.vertex_origin[at(v)];
      part.cones.push_back(cones[at(v)]);
      if (adjacency.opposite[at(adjacency.vertex_halfedge[at(v)])] != kInvalid) continue;
      part.bordered = true;
      part.corners_given = part.corners_given || cones[at(v)] != kNotGiven;
    }
  }
  return parts;
}

std::vector<VertexId> append_part(const mesh::Chart& chart, const mesh::Surface& part,
                                  mesh::Surface& whole) {
  std::vector<VertexId> number = chart.vertices;
  const auto own = static_cast<Eigen::Index>(number.size());
  const Eigen::Index end = whole.vertices.rows(), more = part.vertices.rows() - own;
  whole.vertices.conservativeResize(end + more, 3);
  whole.vertices.bottomRows(more) = part.vertices.bottomRows(more);
  for (Eigen::Index v = end; v < end + more; ++v) number.push_back(static_cast<VertexId>(v));
  Triangles faces = whole.faces;
  const Eigen::Index first = faces.rows();
  faces.conservativeResize(first + part.faces.rows(), 3);
  for (Eigen::Index f = 0; f < part.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) faces(first + f, k) = number[at(part.faces(f, k))];
  }
  whole.faces = std::move(faces);
  return number;
}

std::vector<char> open_parts(const mesh::Surface& surface, const mesh::Components& parts) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  std::vector<char> open(at(parts.count), 0);
  for (std::size_t h = 0; h < opposite.size(); ++h) {
    if (opposite[h] == kInvalid) open[at(parts.of_face[h / 3])] = 1;
  }
  return open;
}

bool has_boundary(const mesh::Surface& surface) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  return std::find(opposite.begin(), opposite.end(), kInvalid) != opposite.end();
}

void check_request(const mesh::Surface& surface, const std::vector<Index>& cones,
                   ExecutionContext& context) {
  check_surface(surface, context);
  if (cones.size() != at(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "cones need one number per vertex.");
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] < kNotGiven) throw_too_sharp(static_cast<VertexId>(v), cones[v]);
  }
  const std::vector<SurfacePart> parts = connected_parts(surface, flat_inside(cones, surface));
  for (const SurfacePart& part : parts) {
    context.check();
    if (part.bordered) continue;
    try {
      check_cones(part.cones, genus_of_part(part));
      // Loops may turn as they need to: only what no loops help is refused here.
      if (genus_of_part(part) == 1)
        near_turns(part.cones, 1, {0.0, 0.0}, Eigen::Matrix2d::Identity());
    } catch (const Infeasible& refused) {
      throw_of_part(refused.error(), part, parts.size() == 1);
    }
  }
}

void rethrow_placed(const std::vector<FaceId>& faces, const std::vector<VertexId>& vertices) {
  const auto numbered_by = [](const std::vector<Index>& number) {
    return [&number](Index i) { return at(i) < number.size() ? number[at(i)] : kInvalid; };
  };
  const auto face = numbered_by(faces);
  const Renumbering numbers{numbered_by(vertices), face, [](Index) { return kInvalid; }};
  try {
    throw;
  } catch (const certify::CertificateFailed& failed) {
    certify::Certificate certificate = failed.certificate();
    bool refined = false;
    for (FaceId& f : certificate.failed_faces) {
      refined = refined || face(f) != f;
      f = face(f);
    }
    std::erase(certificate.failed_faces, kInvalid);
    if (refined) certify::note_refined_numbers(certificate);
    throw certify::CertificateFailed("The seamless map", std::move(certificate));
  } catch (const NotConverged& failed) {
    throw NotConverged(renumbered(failed.error(), numbers));
  } catch (const InvalidInput& failed) {
    throw InvalidInput(renumbered(failed.error(), numbers));
  } catch (const Infeasible& failed) {
    throw Infeasible(renumbered(failed.error(), numbers));
  }
}

namespace {

// Weights of vertex v of the refined surface for the corners of a face of the input that it lies
// in.
Vector3 weights_in(const mesh::Surface& input, const mesh::Provenance& provenance, VertexId v,
                   FaceId face) {
  const mesh::SurfacePoint& point = provenance.vertex[at(v)];
  if (point.face == face) return point.weight;
  Vector3 weight = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    if (point.weight[k] == 0.0) continue;
    bool found = false;
    for (int j = 0; j < 3; ++j) {
      if (input.faces(face, j) != input.faces(point.face, k)) continue;
      weight[j] = point.weight[k];
      found = true;
    }
    if (!found) {
      throw InternalError("refined pieces: vertex " + std::to_string(v) + " lies outside face " +
                          std::to_string(face));
    }
  }
  return weight;
}

}  // namespace

void name_input_places(const mesh::Surface& input, const mesh::Provenance& provenance,
                       const Triangles& refined, certify::Parametrization& map) {
  for (std::size_t v = 0; v < map.vertex_parent.size(); ++v) {
    const FaceId fine = map.vertex_parent[v];
    const FaceId face = provenance.face[at(fine)];
    Vector3 weight = Vector3::Zero();
    for (Index k = 0; k < 3; ++k) {
      const double share = map.vertex_barycentric(static_cast<Eigen::Index>(v), k);
      if (share != 0.0) weight += share * weights_in(input, provenance, refined(fine, k), face);
    }
    map.vertex_parent[v] = face;
    map.vertex_barycentric.row(static_cast<Eigen::Index>(v)) = weight;
  }
  for (FaceId& parent : map.parent_face) parent = provenance.face[at(parent)];
}

}  // namespace flipfree::seamless
